//! Light that comes along a path over diffuse surfaces.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use rand_pcg::Pcg64Mcg;

use crate::shader::gi::gather::{cosine_direction, frame, unit};
use crate::shader::look::direct_only;
use crate::shader::{ShaderScratch, World};
use crate::{DirectLight, SurfacePoint};

/// A path that carries less than this share of its light goes on by chance.
const ROULETTE: f64 = 0.3;

/// What paths are traced with.
pub(crate) struct Paths<'a> {
    pub(crate) world: &'a World,
    /// Direct light where a path first meets a surface.
    pub(crate) first: DirectLight<'a>,
    /// Direct light farther on.
    pub(crate) later: DirectLight<'a>,
    /// Surfaces that a path may meet, at least 1.
    pub(crate) bounces: u32,
}

impl Paths<'_> {
    /// Radiance that arrives from `direction`, with the distance of the surface that it comes from (infinite if there is
    /// none). Unbiased, but for what would come over more surfaces than the limit.
    pub(crate) fn radiance(
        &self,
        origin: DVec3,
        direction: DVec3,
        random: &mut Pcg64Mcg,
        scratch: &mut ShaderScratch,
    ) -> (DVec3, f64) {
        let mut sum = DVec3::ZERO;
        let mut share = DVec3::ONE;
        let mut distance = f64::INFINITY;
        let (mut origin, mut direction) = (origin, direction);
        for bounce in 0..self.bounces {
            let Some(surface) = self.world.look(origin, direction) else {
                break;
            };
            let direct = if bounce == 0 {
                distance = surface.distance;
                &self.first
            } else {
                &self.later
            };
            let seed = rand_core::Rng::next_u64(random);
            let mut irradiance = DVec3::ZERO;
            direct_only(self.world, direct, &surface, seed, scratch, |colour, answer| {
                irradiance += colour * answer.irradiance;
            });
            let albedo = surface.albedo.as_dvec3();
            sum += share * (surface.emission.as_dvec3() + albedo * irradiance * FRAC_1_PI);
            share *= albedo;
            let most = share.max_element();
            if most < ROULETTE {
                let chance = most / ROULETTE;
                if unit(random) >= chance {
                    break;
                }
                share /= chance;
            }
            // Cosine-weighted, so that the share is the albedo alone.
            let (u, v) = (unit(random), unit(random));
            direction = cosine_direction(&frame(surface.shading_normal), u, v);
            if direction.dot(surface.geometric_normal) <= 0.0 {
                break;
            }
            origin = surface.origin;
        }
        (sum, distance)
    }

    /// A hemisphere's directions that a surface can get light from at all.
    pub(crate) fn is_above(surface: &SurfacePoint, direction: DVec3) -> bool {
        direction.dot(surface.geometric_normal) > 0.0
    }
}
