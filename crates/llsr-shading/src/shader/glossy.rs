//! Direct light with traced glossy reflections.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use llsr_quadrature::MetalRough;
use rand_pcg::Pcg64Mcg;

use crate::random::mix;
use crate::shader::gi::{frame, unit};
use crate::shader::look::{Shaded, direct_and_met, direct_only, shade_each};
use crate::shader::world::CurrentStage;
use crate::shader::{
    Encounters, SceneChange, ShadeRequest, ShadedPoint, Shader, ShaderError, ShaderScratch, World,
};
use crate::{DirectLight, Settings, SurfacePoint};

/// Widths of lobes below this are counted as this: as narrow as the light's own reflections are.
const LEAST_WIDTH: f64 = 1e-4;

/// How glossy reflections are traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlossySettings {
    /// Reflected rays of a visible point, 1 to 1024.
    pub rays: u32,
    /// How often a ray may be reflected, up to 8; with 0 there are no traced reflections at all.
    pub reflections: u32,
    /// Irradiance on diffuse lobes on top of direct light, linear RGB in lux or W/m2.
    pub ambient: Vec3,
}

impl Default for GlossySettings {
    fn default() -> Self {
        Self {
            rays: 8,
            reflections: 2,
            ambient: Vec3::ZERO,
        }
    }
}

/// glTF's metal-rough surfaces in direct light, with ray-traced reflections of the surfaces around them ("direct with glossy
/// reflections", Bala et al. 2003, section 7).
///
/// Light that comes straight from the lights is integrated over their visible parts, as in the tile renderer; reflected rays
/// bring what other surfaces send, themselves lit in the same way. Directions are those of normals that the viewer sees (E. Heitz,
/// "Sampling the GGX distribution of visible normals", JCGT 7(4), 2018), stratified, with the stratification turned at
/// random for each point.
#[derive(Debug)]
pub struct GlossyShader {
    stage: CurrentStage,
    settings: Settings,
    glossy: GlossySettings,
}

impl GlossyShader {
    /// A shader for `world`. Settings out of their range are taken to its end.
    pub fn new(world: Arc<World>, settings: &GlossySettings) -> Self {
        let shading = Settings {
            glossy: true,
            ..Settings::default()
        };
        Self {
            stage: CurrentStage::new(world, &shading),
            settings: shading,
            glossy: GlossySettings {
                rays: settings.rays.clamp(1, 1024),
                reflections: settings.reflections.min(8),
                ..*settings
            },
        }
    }
}

/// What the work on one batch needs.
struct Batch<'a> {
    world: &'a World,
    direct: DirectLight<'a>,
    settings: &'a GlossySettings,
}

impl Batch<'_> {
    fn material(&self, surface: &SurfacePoint) -> MetalRough {
        let material = &self.world.scene().materials[surface.material.index()];
        MetalRough {
            base_color: surface.albedo.as_dvec3(),
            metallic: f64::from(material.metallic),
            roughness: f64::from(material.roughness),
        }
    }

    /// What a surface sends to its viewer besides reflections of lights: its own light, and ambient light on its diffuse lobe.
    fn constant(&self, surface: &SurfacePoint, material: &MetalRough) -> DVec3 {
        let diffuse = material.diffuse_color() * (DVec3::ONE - material.f0());
        let ambient = self.settings.ambient.as_dvec3() * std::f64::consts::FRAC_1_PI;
        surface.emission.as_dvec3() + diffuse * ambient
    }

    /// Radiance that `rays` reflected rays bring to the viewer of a surface; `depth` reflections have gone before.
    fn reflected(
        &self,
        surface: &SurfacePoint,
        material: &MetalRough,
        rays: u32,
        depth: u32,
        hash: u64,
        scratch: &mut ShaderScratch,
    ) -> DVec3 {
        if depth >= self.settings.reflections {
            return DVec3::ZERO;
        }
        let mut random = Pcg64Mcg::new(u128::from(mix(hash)) << 64 | u128::from(hash) | 1);
        let turn = (unit(&mut random), unit(&mut random));
        let lobe = Lobe::new(surface, material);
        let mut sum = DVec3::ZERO;
        for number in 0..rays {
            // A lattice of rank one (the golden ratio's), shifted: strata in both numbers, whatever the count.
            let u = (f64::from(number) / f64::from(rays) + turn.0).fract();
            let v = (f64::from(number) * 0.618_033_988_749_894_8 + turn.1).fract();
            let Some((direction, weight)) = lobe.sample(u, v) else {
                continue;
            };
            if direction.dot(surface.geometric_normal) <= 0.0 {
                continue;
            }
            if let Some(met) = self.world.look(surface.origin, direction) {
                let seed = mix(hash ^ mix(u64::from(number) + 1));
                sum += weight * self.radiance(&met, depth + 1, seed, scratch);
            }
        }
        sum / f64::from(rays)
    }

    /// What a surface that was met on the way sends back along the ray.
    fn radiance(&self, surface: &SurfacePoint, depth: u32, hash: u64, scratch: &mut ShaderScratch) -> DVec3 {
        let material = self.material(surface);
        let mut sum = self.constant(surface, &material);
        direct_only(
            self.world,
            &self.direct,
            surface,
            hash,
            scratch,
            |colour, answer| {
                sum += colour * material.radiance(&answer.lobes);
            },
        );
        sum + self.reflected(surface, &material, 1, depth, hash, scratch)
    }
}

/// The microfacet lobe of a surface towards its viewer.
struct Lobe {
    axes: glam::DMat3,
    /// Direction to the viewer in the frame of the normal.
    viewer: DVec3,
    width: f64,
    f0: DVec3,
}

impl Lobe {
    fn new(surface: &SurfacePoint, material: &MetalRough) -> Self {
        let axes = frame(surface.shading_normal);
        let mut viewer = axes.transpose() * surface.to_viewer;
        // A viewer below the shading normal's horizon looks along it.
        viewer.z = viewer.z.max(1e-4);
        Self {
            axes,
            viewer: viewer.normalize(),
            width: (material.roughness * material.roughness).clamp(LEAST_WIDTH, 1.0),
            f0: material.f0(),
        }
    }

    /// A direction for two numbers in [0, 1), and the lobe over its density; `None` below the horizon.
    fn sample(&self, u: f64, v: f64) -> Option<(DVec3, DVec3)> {
        let (a, viewer) = (self.width, self.viewer);
        // The lobe stretched to a hemisphere, and a disc across the viewer's direction.
        let stretched = DVec3::new(a * viewer.x, a * viewer.y, viewer.z).normalize();
        let across = DVec3::new(-stretched.y, stretched.x, 0.0).normalize_or(DVec3::X);
        let (sin, cos) = (TAU * v).sin_cos();
        let (radius, half) = (u.sqrt(), 0.5 * (1.0 + stretched.z));
        let x = radius * cos;
        let y = (1.0 - half) * (1.0 - x * x).max(0.0).sqrt() + half * radius * sin;
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        let on_hemisphere = across * x + stretched.cross(across) * y + stretched * z;
        let normal =
            DVec3::new(a * on_hemisphere.x, a * on_hemisphere.y, on_hemisphere.z.max(0.0)).normalize();
        let cosine = viewer.dot(normal);
        let light = normal * (2.0 * cosine) - viewer;
        if light.z <= 0.0 {
            return None;
        }
        // What is left of the lobe over the density of visible normals: F G2 / G1.
        let smith = |z: f64| (a * a + (1.0 - a * a) * z * z).sqrt();
        let (towards, from) = (smith(viewer.z), smith(light.z));
        let masking = light.z * (viewer.z + towards) / (light.z * towards + viewer.z * from);
        let schlick = (1.0 - cosine).max(0.0).powi(5);
        let fresnel = self.f0 + (DVec3::ONE - self.f0) * schlick;
        Some((self.axes * light, fresnel * masking))
    }
}

impl Shader for GlossyShader {
    fn name(&self) -> &str {
        "glossy"
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
        let batch = Batch {
            world,
            direct: DirectLight::prepared(&stage.lights, world.tracer(), &self.settings),
            settings: &self.glossy,
        };
        shade_each(world, requests, seed, points, met, |surface, hash, met| {
            let material = batch.material(surface);
            let mut radiance = batch.constant(surface, &material);
            let direct = &batch.direct;
            let lights = direct_and_met(world, direct, surface, hash, scratch, met, |colour, answer| {
                radiance += colour * material.radiance(&answer.lobes);
            });
            radiance += batch.reflected(surface, &material, self.glossy.rays, 0, hash, scratch);
            Shaded::new(radiance.as_vec3(), lights)
        })
    }

    fn changed(&self, change: &SceneChange) {
        self.stage.advance(change);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use llsr_scene::{MaterialId, ObjectId};

    fn surface(to_viewer: DVec3) -> SurfacePoint {
        SurfacePoint {
            position: DVec3::ZERO,
            origin: DVec3::ZERO,
            geometric_normal: DVec3::Y,
            shading_normal: DVec3::Y,
            to_viewer,
            distance: 1.0,
            albedo: Vec3::ONE,
            emission: Vec3::ZERO,
            object: ObjectId(0),
            material: MaterialId(0),
            textured: None,
        }
    }

    /// The mean weight is the lobe's reflectance: compared with a dense sum of the lobe's definition over the hemisphere.
    #[test]
    fn sampled_lobes_reflect_as_much_as_their_definition() {
        for (roughness, height) in [(0.3, 0.9), (0.6, 0.5), (1.0, 0.2), (0.8, 0.99)] {
            let viewer = DVec3::new(f64::sqrt(1.0 - height * height), height, 0.0);
            let material = MetalRough {
                base_color: DVec3::new(0.9, 0.5, 0.1),
                metallic: 1.0,
                roughness,
            };
            let lobe = Lobe::new(&surface(viewer), &material);
            let n = 300;
            let cells = || (0..n * n).map(|i| (f64::from(i % n) + 0.5, f64::from(i / n) + 0.5));
            let count = f64::from(n * n);
            let mut sampled = DVec3::ZERO;
            let mut towards = DVec3::ZERO;
            for (u, v) in cells() {
                if let Some((direction, weight)) = lobe.sample(u / f64::from(n), v / f64::from(n)) {
                    sampled += weight / count;
                    towards += direction * weight.x / count;
                }
            }
            // D F G2 / (4 cos_v) with the half vector, by the midpoint rule in the cosine and the azimuth.
            let a2 = roughness.powi(4);
            let mut summed = DVec3::ZERO;
            let mut summed_towards = DVec3::ZERO;
            for (u, v) in cells() {
                let (cosine, azimuth) = (u / f64::from(n), TAU * v / f64::from(n));
                let sine = f64::sqrt(1.0 - cosine * cosine);
                let light = DVec3::new(sine * azimuth.cos(), cosine, sine * azimuth.sin());
                let half = (light + viewer).normalize();
                let d = a2 / (std::f64::consts::PI * (half.y * half.y * (a2 - 1.0) + 1.0).powi(2));
                let lambda = |z: f64| 0.5 * ((1.0 + a2 * (1.0 - z * z) / (z * z)).sqrt() - 1.0);
                let g = 1.0 / (1.0 + lambda(cosine) + lambda(height));
                let fresnel = material.f0() + (DVec3::ONE - material.f0()) * (1.0 - viewer.dot(half)).powi(5);
                let value = fresnel * (d * g / (4.0 * height) * TAU / count);
                summed += value;
                summed_towards += light * value.x;
            }
            assert!(
                (sampled - summed).length() < 0.01 * summed.length(),
                "{roughness}: {sampled} for {summed}"
            );
            assert!(
                (towards - summed_towards).length() < 0.01 * summed_towards.length(),
                "{roughness}: towards {towards} for {summed_towards}"
            );
        }
    }
}
