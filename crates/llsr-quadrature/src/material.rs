//! The metal-rough material of glTF 2.0.

use std::f64::consts::FRAC_1_PI;
use std::ops::{Add, AddAssign};

use glam::DVec3;

/// Base colour, metalness and roughness, as glTF 2.0 defines them (appendix B of its specification).
///
/// The microfacet lobe is GGX with the height-correlated Smith term and Schlick's Fresnel term; under it, where
/// the surface is not metal, a Lambertian lobe gets what Fresnel does not reflect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetalRough {
    /// Linear RGB in [0, 1].
    pub base_color: DVec3,
    /// 0 (dielectric) to 1 (metal).
    pub metallic: f64,
    /// Perceptual roughness in [0, 1]; the width of the lobe is its square.
    pub roughness: f64,
}

impl MetalRough {
    /// Reflectance of a dielectric of index 1.5 at normal incidence.
    const DIELECTRIC: f64 = 0.04;

    /// Reflectance at normal incidence, linear RGB.
    pub fn f0(&self) -> DVec3 {
        DVec3::splat(Self::DIELECTRIC).lerp(self.base_color, self.metallic)
    }

    /// Albedo of the Lambertian lobe before Fresnel's share is taken off, linear RGB.
    pub fn diffuse_color(&self) -> DVec3 {
        self.base_color * (1.0 - self.metallic)
    }

    /// Reflected radiance per channel from scalar integrals over the light.
    ///
    /// Schlick's term is `f0 (1 - s) + s` with `s = (1 - cos)^5`, linear in the colour `f0`; so three scalar
    /// integrals serve every channel.
    pub fn radiance(&self, lobes: &Lobes) -> DVec3 {
        let f0 = self.f0();
        let diffuse = self.diffuse_color() * (DVec3::ONE - f0) * (FRAC_1_PI * lobes.diffuse);
        f0 * lobes.f0 + DVec3::splat(lobes.grazing) + diffuse
    }
}

/// Integrals over the visible part of a light, in lux or W/m2 per steradian: combined by
/// [`MetalRough::radiance`], added over panels and lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lobes {
    /// Of `(1 - s) D V cos(theta)`: the weight of the reflectance at normal incidence.
    pub f0: f64,
    /// Of `s D V cos(theta)`: the white part of Schlick's term.
    pub grazing: f64,
    /// Of `(1 - s) cos(theta)`: irradiance that reaches the Lambertian lobe, before its `1 - f0` (lux or W/m2).
    pub diffuse: f64,
}

impl Add for Lobes {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            f0: self.f0 + other.f0,
            grazing: self.grazing + other.grazing,
            diffuse: self.diffuse + other.diffuse,
        }
    }
}

impl AddAssign for Lobes {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
