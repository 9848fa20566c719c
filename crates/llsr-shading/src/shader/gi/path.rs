//! Light that comes along a path over diffuse surfaces.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use llsr_quadrature::Receiver;
use llsr_scene::{Light, LightId};
use rand_pcg::Pcg64Mcg;

use crate::shader::gi::gather::{cosine_direction, frame, unit};
use crate::shader::{ShaderScratch, World};
use crate::{PreparedLights, SurfacePoint};

/// A path that carries less than this share of its light goes on by chance.
const ROULETTE: f64 = 0.3;

/// Shadow rays from the first surface of a path, about; from each of the others one is sent.
const FIRST_RAYS: f64 = 2.0;

/// A light from afar.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beacon {
    ends: [DVec3; 2],
    length: f64,
    flux: f64,
    colour: DVec3,
    /// Does it lie along the line between its ends, so that heights there say how it stands to a surface?
    thin: bool,
}

impl Beacon {
    pub(crate) fn new(light: &Light) -> Self {
        let (a, b) = light.ends();
        Self {
            ends: [a, b],
            length: a.distance(b),
            flux: light.flux().max(0.0),
            colour: light.color().as_dvec3(),
            thin: match light {
                Light::Linear(light) => light.radius == 0.0,
                Light::Point(_) => true,
                Light::Area(_) => false,
            },
        }
    }

    /// About how much it may give on a surface if nothing hides it; 0 only if it gives nothing. Cost: about 15 ns.
    fn weight(&self, surface: &SurfacePoint) -> f64 {
        let [a, b] = self.ends.map(|end| end - surface.position);
        let axis = b - a;
        let along = (-a.dot(axis) / axis.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let nearest = a + axis * along;
        let distance = nearest.length() + f64::MIN_POSITIVE;
        // Far off as a point, nearby as a line without end.
        let free = self.flux / (distance * (distance + self.length));
        let normal = surface.shading_normal;
        let cosine = |to: DVec3| normal.dot(to) / (to.length() + f64::MIN_POSITIVE);
        let most = cosine(a).max(cosine(b)).max(cosine(nearest));
        free * if self.thin { most } else { most.max(0.1) }.max(0.0)
    }
}

/// What paths are traced with.
pub(crate) struct Paths<'a> {
    pub(crate) world: &'a World,
    /// Its lights.
    pub(crate) lights: &'a PreparedLights,
    pub(crate) beacons: &'a [Beacon],
    /// Surfaces that a path may meet, at least 1.
    pub(crate) bounces: u32,
}

impl Paths<'_> {
    /// Radiance that arrives from `direction`, with the distance of the surface that it comes from (infinite if there is
    /// none).
    ///
    /// `known` may say what irradiance a surface gets by way of others; the path ends there. Where it says nothing the path goes on.
    /// Unbiased if that is, but for what would come over more surfaces than the limit.
    pub(crate) fn radiance(
        &self,
        origin: DVec3,
        direction: DVec3,
        random: &mut Pcg64Mcg,
        scratch: &mut ShaderScratch,
        mut known: impl FnMut(&SurfacePoint, &mut Pcg64Mcg, &mut ShaderScratch) -> Option<DVec3>,
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
            let count = if bounce == 0 { FIRST_RAYS } else { 1.0 };
            let irradiance = self.by_lights(count, &surface, random, scratch);
            let albedo = surface.albedo.as_dvec3();
            sum += share * (surface.emission.as_dvec3() + albedo * irradiance * FRAC_1_PI);
            share *= albedo;
            if let Some(irradiance) = known(&surface, random, scratch) {
                sum += share * irradiance * FRAC_1_PI;
                break;
            }
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

    /// What all lights give on average, by about `count` rays: lights are picked by about what they would give if nothing hid them.
    /// Systematic sampling, so that a light that gives more than its share is picked each time.
    fn by_lights(
        &self,
        count: f64,
        surface: &SurfacePoint,
        random: &mut Pcg64Mcg,
        scratch: &mut ShaderScratch,
    ) -> DVec3 {
        let receiver = Receiver {
            position: surface.position,
            normal: surface.shading_normal,
        };
        let facing = surface.geometric_normal;
        let weights = &mut scratch.weights;
        weights.clear();
        weights.extend(self.beacons.iter().map(|beacon| beacon.weight(surface)));
        let step = weights.iter().sum::<f64>() / count;
        let mut irradiance = DVec3::ZERO;
        // How far it is to the next pick along the sum of the weights.
        let mut left = step * unit(random);
        for (index, (&weight, beacon)) in weights.iter().zip(self.beacons).enumerate() {
            left -= weight;
            if left >= 0.0 || weight <= 0.0 {
                continue;
            }
            let picks = (-left / step).ceil();
            left += picks * step;
            let light = LightId::from(index);
            let place = self.lights.place(light, &receiver, facing, unit(random));
            if let Some((place, all)) = place
                && !self.world.tracer().occluded(surface.origin, place)
            {
                irradiance += beacon.colour * (all * picks * step / weight);
            }
        }
        irradiance
    }

    /// A hemisphere's directions that a surface can get light from at all.
    pub(crate) fn is_above(surface: &SurfacePoint, direction: DVec3) -> bool {
        direction.dot(surface.geometric_normal) > 0.0
    }
}
