//! Reflected radiance by brute force: the BRDF as the glTF 2.0 specification writes it, by adaptive quadrature.

use glam::DVec3;

use super::adaptive::{Sum, adaptive};
use super::line::Law;

/// The glTF 2.0 metal-rough BRDF (appendix B) for one channel of base colour; all vectors unit.
pub fn metal_rough(base: f64, metallic: f64, roughness: f64, n: DVec3, v: DVec3, l: DVec3) -> f64 {
    let (n_l, n_v) = (n.dot(l), n.dot(v));
    if n_l <= 0.0 || n_v <= 0.0 {
        return 0.0;
    }
    let h = (v + l).normalize();
    let alpha2 = roughness.powi(4);
    // tan^2 from the cross product: 1 - (n.h)^2 would cancel.
    let (sin2, cos2) = (n.cross(h).length_squared(), n.dot(h).powi(2));
    let d = alpha2 / (std::f64::consts::PI * (cos2 * alpha2 + sin2).powi(2));
    let smith = |a: f64, b: f64| a * (b * b * (1.0 - alpha2) + alpha2).sqrt();
    let visibility = 0.5 / (smith(n_l, n_v) + smith(n_v, n_l));
    let f0 = 0.04 * (1.0 - metallic) + base * metallic;
    let fresnel = f0 + (1.0 - f0) * (1.0 - v.dot(h).abs()).powi(5);
    let diffuse = (1.0 - fresnel) * base * (1.0 - metallic) * std::f64::consts::FRAC_1_PI;
    fresnel * visibility * d + diffuse
}

/// The integral of `f` times irradiance density over the part `t0..t1` of a light of flux 1: reflected radiance,
/// if `f` maps the unit direction to the light to a BRDF.
///
/// Adaptive on each of `pieces` equal parts, so that a lobe wider than a few hundredths of a part is found;
/// the kink at the horizon is a cut. Relative error about 1e-9.
pub fn reflected(
    position: DVec3,
    normal: DVec3,
    (a, b): (DVec3, DVec3),
    law: Law,
    (t0, t1): (f64, f64),
    pieces: u32,
    mut f: impl FnMut(DVec3) -> f64,
) -> f64 {
    let axis = (b - a).normalize();
    let mut integrand = |t: f64| {
        let x = a + (b - a) * t - position;
        let l = x.normalize();
        let emission = match law {
            Law::Diffuse => l.cross(axis).length() / std::f64::consts::PI.powi(2),
            Law::Isotropic => 0.25 / std::f64::consts::PI,
        };
        f(l) * emission * normal.dot(l).max(0.0) / x.length_squared()
    };
    let mut cuts: Vec<_> = (0..=pieces)
        .map(|i| t0 + (t1 - t0) * f64::from(i) / f64::from(pieces))
        .collect();
    let horizon = normal.dot(position - a) / normal.dot(b - a);
    if horizon > t0 && horizon < t1 {
        cuts.push(horizon);
        cuts.sort_by(f64::total_cmp);
    }
    let mut sum = Sum::default();
    for pair in cuts.windows(2) {
        sum.add(adaptive(&mut integrand, pair[0], pair[1], 1e-9));
    }
    sum.value()
}
