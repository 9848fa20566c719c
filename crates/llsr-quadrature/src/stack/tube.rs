//! A cylinder light.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::{line, normalization};
use crate::light::LineLight;

/// A Lambertian cylinder without end caps, emitting outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeLight {
    /// One end of the axis, in metres.
    pub a: DVec3,
    /// The other end of the axis.
    pub b: DVec3,
    /// Radius in metres; 0 gives the diffuse line light.
    pub radius: f64,
    /// Total flux in lumens or watts.
    pub flux: f64,
}

impl TubeLight {
    /// The lines that the tube is to a receiver at `position`, one per node.
    ///
    /// `nodes` are pairs of a place in [0, 1] and a weight, of sum 1: a [`GaussRule`](crate::GaussRule) or
    /// [`sampled_nodes`](crate::sampled_nodes). Places run over the visible half of the tube from one
    /// silhouette to the other by the angle under which the surface is seen; lines keep the tube's direction
    /// and `t`. Inside the cylinder (prolonged) nothing is seen and there are no lines; a tube of no length is
    /// a point light, whatever its radius. Lazy; no allocation.
    ///
    /// ```
    /// use glam::DVec3;
    /// use llsr_quadrature::{GaussRule, LineIrradiance, Receiver, TubeLight};
    ///
    /// let tube =
    ///     TubeLight { a: DVec3::new(-0.6, 2.0, 0.0), b: DVec3::new(0.6, 2.0, 0.0), radius: 0.019, flux: 3000.0 };
    /// let receiver = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
    /// let rule = GaussRule::new(4);
    /// let lines = tube.lines(receiver.position, rule.iter());
    /// let lux: f64 = lines.map(|light| LineIrradiance::new(&receiver, &light).panel(0.0, 1.0)).sum();
    /// assert!((lux - 72.2).abs() < 0.1, "{lux}");
    /// ```
    pub fn lines<N: IntoIterator<Item = (f64, f64), IntoIter: Clone>>(
        &self,
        position: DVec3,
        nodes: N,
    ) -> impl Iterator<Item = LineLight> + use<N> {
        let Self { a, b, radius, flux } = *self;
        let axis = (b - a).try_normalize();
        let along = axis.unwrap_or(DVec3::ZERO);
        let from = a - position;
        let perpendicular = from - from.dot(along) * along;
        let distance = perpendicular.length();
        let straight = perpendicular.try_normalize();
        let sideways = along.cross(straight.unwrap_or(DVec3::ZERO));
        let seen = radius >= 0.0 && distance > radius;
        // Square of the tangent's length from the receiver to the circle.
        let tangent2 = (distance - radius) * (distance + radius);
        let nodes = nodes.into_iter();
        let flux = flux * normalization(nodes.clone(), |x| FRAC_PI_2 * (PI * x).sin());
        let line_at = move |(x, weight): (f64, f64)| {
            let Some(straight) = straight.filter(|_| seen && axis.is_some()) else {
                return line(a, b, weight * FRAC_PI_2 * (PI * x).sin() * flux);
            };
            // The angle of emission runs from -90 to 90 degrees; the ray's distance from the axis is
            // `radius sin(emission) = distance sin(view)`.
            let (sin, cos) = (PI * (x - 0.5)).sin_cos();
            let view_sin = sin * radius / distance;
            // distance cos(view), without cancellation for a receiver that touches the tube.
            let view_cos = (tangent2 * sin * sin + distance * distance * cos * cos).sqrt();
            let reach = tangent2 / (view_cos + radius * cos);
            let shift = reach * (straight * (view_cos / distance) + sideways * view_sin) - perpendicular;
            // pi^2 L Lv h dg with Lv = flux / (2 pi^2 radius L) and dg = radius cos / view_cos d(emission).
            let share = FRAC_PI_2 * reach * cos / view_cos;
            line(a + shift, b + shift, weight * share * flux)
        };
        let count = if seen || (axis.is_none() && radius >= 0.0) {
            usize::MAX
        } else {
            0
        };
        nodes.take(count).map(line_at)
    }
}
