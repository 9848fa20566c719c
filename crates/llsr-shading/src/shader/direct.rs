//! Direct light and a constant for the rest.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::shader::look::{Shaded, direct_and_met, shade_each};
use crate::shader::world::CurrentStage;
use crate::shader::{
    Encounters, SceneChange, ShadeRequest, ShadedPoint, Shader, ShaderError, ShaderScratch, World,
};
use crate::{DirectLight, Settings};

/// Diffuse surfaces in direct light, with the same ambient light everywhere ("direct illumination with ambient", Bala et al.
/// 2003, section 7).
///
/// The visible part of every light is found by [`Method::Auto`](crate::Method::Auto).
#[derive(Debug)]
pub struct DirectShader {
    stage: CurrentStage,
    settings: Settings,
    ambient: DVec3,
}

impl DirectShader {
    /// A shader for `world`. `ambient` is the irradiance that comes on top of direct light (linear RGB, lux or W/m2);
    /// see [`World::suggested_ambient`].
    pub fn new(world: Arc<World>, ambient: Vec3) -> Self {
        let settings = Settings::default();
        Self {
            stage: CurrentStage::new(world, &settings),
            settings,
            ambient: ambient.as_dvec3(),
        }
    }
}

impl Shader for DirectShader {
    fn name(&self) -> &str {
        "direct"
    }

    fn shade(
        &self,
        requests: &[ShadeRequest],
        seed: u64,
        scratch: &mut ShaderScratch,
        points: &mut Vec<ShadedPoint>,
        met: &mut Encounters,
    ) -> Result<(), ShaderError> {
        let stage = self.stage.get();
        let world = &*stage.world;
        let direct = DirectLight::prepared(&stage.lights, world.tracer(), &self.settings);
        shade_each(world, requests, seed, points, met, |surface, hash, met| {
            let mut irradiance = self.ambient;
            let lights = direct_and_met(world, &direct, surface, hash, scratch, met, |colour, answer| {
                irradiance += colour * answer.irradiance;
            });
            Shaded::diffuse(world, surface, irradiance, lights)
        })
    }

    fn changed(&self, change: &SceneChange) {
        self.stage.advance(change);
    }
}
