//! A disc light.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::{Fan, line, normalization};
use crate::light::LineLight;

/// A Lambertian disc (or ellipse) that emits to the side of `u.cross(v)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscLight {
    /// The centre, in metres.
    pub center: DVec3,
    /// From the centre to the rim, in the direction of the chords.
    pub u: DVec3,
    /// From the centre to the rim, across the chords; at right angles to `u`, and as long for a disc.
    pub v: DVec3,
    /// Total flux in lumens or watts.
    pub flux: f64,
}

impl DiscLight {
    /// A round disc that emits to the side of `normal` (unit), its chords in some direction of its plane.
    pub fn new(center: DVec3, normal: DVec3, radius: f64, flux: f64) -> Self {
        let u = normal.any_orthonormal_vector();
        Self {
            center,
            u: radius * u,
            v: radius * normal.cross(u),
            flux,
        }
    }

    /// The chords that the disc is to a receiver at `position`, one per node.
    ///
    /// `nodes` as for [`TubeLight::lines`](crate::TubeLight::lines). Places run over the chords from `-v` to `v`
    /// by an angle on whose sine the receiver's view across the chords depends, which keeps the rim smooth. A
    /// receiver behind the disc or in its plane gets no lines; so does every receiver of a disc without area.
    /// Lazy; no allocation.
    ///
    /// ```
    /// use glam::DVec3;
    /// use llsr_quadrature::{DiscLight, GaussRule, LineIrradiance, Receiver};
    ///
    /// // Straight under a disc of radius r at height h, E = flux / (pi r^2) r^2 / (r^2 + h^2).
    /// let disc = DiscLight::new(DVec3::new(0.0, 2.0, 0.0), -DVec3::Y, 0.5, 1000.0);
    /// let receiver = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
    /// let rule = GaussRule::new(8);
    /// let lines = disc.lines(receiver.position, rule.iter());
    /// let lux: f64 = lines.map(|light| LineIrradiance::new(&receiver, &light).panel(0.0, 1.0)).sum();
    /// assert!((lux / (1000.0 / (std::f64::consts::PI * 4.25)) - 1.0).abs() < 1e-6, "{lux}");
    /// ```
    pub fn lines<N: IntoIterator<Item = (f64, f64), IntoIter: Clone>>(
        &self,
        position: DVec3,
        nodes: N,
    ) -> impl Iterator<Item = LineLight> + use<N> {
        let Self { center, u, v, flux } = *self;
        let direction = u.try_normalize();
        let sideways = direction.and_then(|d| (v - v.dot(d) * d).try_normalize());
        let fan = direction.zip(sideways).and_then(|(direction, sideways)| {
            let from = center - position;
            let height = -from.dot(direction.cross(sideways));
            let (middle, half) = (from.dot(sideways), v.dot(sideways));
            let fan = Fan::new((middle - half, middle + half), height);
            // pi^2 L Lv h dg with Lv = flux / (pi^2 |u| half) and L = 2 |u| chord.
            (height > 0.0).then_some((fan, 2.0 * fan.angle / half))
        });
        let nodes = nodes.into_iter();
        let flux = flux * normalization(nodes.clone(), |x| 2.0 * (PI * x).sin().powi(2));
        nodes.map_while(move |(x, weight)| {
            let (fan, share) = fan?;
            // The share of the view is sin^2 of a quarter turn times x.
            let (sin, cos) = (FRAC_PI_2 * x).sin_cos();
            let (before, after, distance) = fan.at(sin * sin);
            let chord = 2.0 * (before * after).sqrt();
            let middle = center + v * (before - after);
            let flux = weight * PI * sin * cos * share * chord * distance * flux;
            Some(line(middle - u * chord, middle + u * chord, flux))
        })
    }
}
