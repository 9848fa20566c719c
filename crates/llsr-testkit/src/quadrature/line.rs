//! Irradiance from a line light by brute force, straight from the two emission laws.

use glam::DVec3;

use super::adaptive::adaptive;
use super::double_double::{DoubleDouble, WideVec3};

/// An emission law, spelled out here so that the oracle knows no other crate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// `Phi / (pi^2 L) sin(phi) cos(theta) / r^2` per metre of light.
    Diffuse,
    /// `Phi / (4 pi L) cos(theta) / r^2` per metre of light.
    Isotropic,
}

/// Irradiance at `position` with unit `normal` from the part `t0..t1` of the light `a`-`b` of flux 1.
///
/// Every geometric quantity is evaluated in double-double arithmetic from the coordinates as given, so the
/// result is that of exactly these numbers, to about 1e-14 relative, however badly conditioned. Needs distinct
/// ends and a receiver off the lit part of the light. Cost: up to milliseconds.
pub fn line_irradiance(
    position: DVec3,
    normal: DVec3,
    (a, b): (DVec3, DVec3),
    law: Law,
    (t0, t1): (f64, f64),
) -> f64 {
    let (from, axis) = (WideVec3::difference(a, position), WideVec3::difference(b, a));
    let normal = WideVec3::from(normal);
    let length = axis.length();
    let constant = match law {
        Law::Diffuse => 1.0 / (std::f64::consts::PI * std::f64::consts::PI),
        Law::Isotropic => 0.25 / std::f64::consts::PI,
    };
    let integrand = |t: DoubleDouble| {
        let x = from.plus(t, axis);
        let r = x.length();
        let cosine = normal.dot(x) / r;
        let sine = x.cross(axis).length() / (r * length);
        let law = if law == Law::Diffuse { sine } else { 1.0.into() };
        constant * (law * cosine / (r * r)).to_f64().max(0.0)
    };
    // Kinks and peaks: the crossing of the receiver's plane and the foot of the perpendicular.
    let (height, slope) = (normal.dot(from), normal.dot(axis));
    let foot = -from.dot(axis) / (length * length);
    let mut cuts = vec![DoubleDouble::from(t0), t1.into()];
    let mut special = vec![foot];
    if slope.hi != 0.0 {
        special.push(-height / slope);
    }
    cuts.extend(special.iter().filter(|t| t.hi > t0 && t.hi < t1));
    cuts.sort_by(|x, y| (*x - *y).hi.total_cmp(&0.0));
    let mut total = 0.0;
    for pair in cuts.windows(2) {
        let (mut lo, mut hi) = (pair[0], pair[1]);
        let width = (hi - lo).to_f64();
        if width <= 0.0 {
            continue;
        }
        // Parameters count from the end that is nearer to the foot, where the integrand may be steep.
        if (hi - foot).hi.abs() < (lo - foot).hi.abs() {
            (lo, hi) = (hi, lo);
        }
        let span = hi - lo;
        total += width * adaptive(|u| integrand(lo + span * u.into()), 0.0, 1.0, 1e-13);
    }
    total
}

/// The same in plain doubles by Simpson's rule on `steps` pairs of intervals: for stretches that are short beside their distance
/// from the receiver and lie above its horizon.
pub fn short_line_irradiance(
    position: DVec3,
    normal: DVec3,
    (a, b): (DVec3, DVec3),
    law: Law,
    (t0, t1): (f64, f64),
    steps: u32,
) -> f64 {
    let axis = (b - a).normalize();
    let density = |t: f64| {
        let x = a + (b - a) * t - position;
        let to = x.normalize();
        let emission = match law {
            Law::Diffuse => axis.cross(to).length() / (std::f64::consts::PI * std::f64::consts::PI),
            Law::Isotropic => 0.25 / std::f64::consts::PI,
        };
        emission * normal.dot(to).max(0.0) / x.length_squared()
    };
    let h = (t1 - t0) / f64::from(steps);
    (0..steps)
        .map(|i| {
            let t = t0 + h * f64::from(i);
            (density(t) + 4.0 * density(t + 0.5 * h) + density(t + h)) * h / 6.0
        })
        .sum()
}
