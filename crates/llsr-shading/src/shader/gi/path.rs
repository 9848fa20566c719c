//! Light that comes along a path over diffuse surfaces.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use llsr_scene::{Light, LightId};
use rand_pcg::Pcg64Mcg;

use crate::shader::gi::gather::{cosine_direction, frame, unit};
use crate::shader::look::{direct_only, pixel_of};
use crate::shader::{ShaderScratch, World};
use crate::{DirectLight, LightState, SurfacePoint};

/// A path that carries less than this share of its light goes on by chance.
const ROULETTE: f64 = 0.3;

/// Lights of which each is looked at from the first surface of a path. Of more lights so many are picked.
const MANY_LIGHTS: usize = 6;

/// A light from afar.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beacon {
    middle: DVec3,
    /// Square of half its extent (m2).
    extent: f64,
    flux: f64,
    colour: DVec3,
}

impl Beacon {
    pub(crate) fn new(light: &Light) -> Self {
        let (a, b) = light.ends();
        Self {
            middle: 0.5 * (a + b),
            extent: 0.25 * a.distance_squared(b) + f64::MIN_POSITIVE,
            flux: light.flux().max(0.0),
            colour: light.color().as_dvec3(),
        }
    }

    /// About how much it may give at a point.
    fn weight(&self, point: DVec3) -> f64 {
        self.flux / (self.extent + point.distance_squared(self.middle))
    }
}

/// What paths are traced with.
pub(crate) struct Paths<'a> {
    pub(crate) world: &'a World,
    /// Direct light where a path meets a surface.
    pub(crate) direct: DirectLight<'a>,
    pub(crate) beacons: &'a [Beacon],
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
            if bounce == 0 {
                distance = surface.distance;
            }
            let seed = rand_core::Rng::next_u64(random);
            let irradiance = if bounce > 0 {
                self.by_some_lights(1.0, &surface, seed, random, scratch)
            } else if self.beacons.len() > MANY_LIGHTS {
                self.by_some_lights(MANY_LIGHTS as f64, &surface, seed, random, scratch)
            } else {
                self.by_all_lights(&surface, seed, scratch)
            };
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

    fn by_all_lights(&self, surface: &SurfacePoint, seed: u64, scratch: &mut ShaderScratch) -> DVec3 {
        let mut irradiance = DVec3::ZERO;
        direct_only(
            self.world,
            &self.direct,
            surface,
            seed,
            scratch,
            |colour, answer| {
                irradiance += colour * answer.irradiance;
            },
        );
        irradiance
    }

    /// The same on average, from `count` lights, picked by what they may give: systematic sampling, so that a light that gives
    /// more than its share is picked each time.
    fn by_some_lights(
        &self,
        count: f64,
        surface: &SurfacePoint,
        seed: u64,
        random: &mut Pcg64Mcg,
        scratch: &mut ShaderScratch,
    ) -> DVec3 {
        let all: f64 = self
            .beacons
            .iter()
            .map(|beacon| beacon.weight(surface.position))
            .sum();
        let step = all / count;
        let mut irradiance = DVec3::ZERO;
        // How far it is to the next pick along the sum of the weights.
        let mut left = step * unit(random);
        for (index, beacon) in self.beacons.iter().enumerate() {
            let weight = beacon.weight(surface.position);
            left -= weight;
            if left >= 0.0 || weight <= 0.0 {
                continue;
            }
            let picks = (-left / step).ceil();
            left += picks * step;
            let ShaderScratch {
                direct,
                states,
                statistics,
                ..
            } = scratch;
            if states.is_empty() {
                states.resize(1, LightState::default());
            }
            let id = LightId::from(index);
            let at = pixel_of(seed);
            let answer = self
                .direct
                .shade_point_by(surface, id, at, &mut states[0], direct, statistics);
            irradiance += beacon.colour * (answer.irradiance * picks * step / weight);
        }
        irradiance
    }

    /// A hemisphere's directions that a surface can get light from at all.
    pub(crate) fn is_above(surface: &SurfacePoint, direction: DVec3) -> bool {
        direction.dot(surface.geometric_normal) > 0.0
    }
}
