//! A rectangle light.

use std::f64::consts::PI;

use glam::DVec3;

use super::{Fan, line, normalization};
use crate::light::LineLight;

/// A Lambertian rectangle (or parallelogram) that emits to the side of `along.cross(across)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RectLight {
    /// A corner, in metres.
    pub corner: DVec3,
    /// The edge from the corner that the lines follow. The longer edge is the better choice: fewer lines.
    pub along: DVec3,
    /// The other edge from the corner.
    pub across: DVec3,
    /// Total flux in lumens or watts.
    pub flux: f64,
}

impl RectLight {
    /// The lines that the rectangle is to a receiver at `position`, one per node.
    ///
    /// `nodes` as for [`TubeLight::lines`](crate::TubeLight::lines); places run over the rectangle from the
    /// corner by the angle under which the receiver sees it across the lines. A receiver behind the rectangle
    /// or in its plane gets no lines; so does every receiver of a rectangle without area. Lazy; no allocation.
    ///
    /// ```
    /// use glam::DVec3;
    /// use llsr_quadrature::{GaussRule, LineIrradiance, Receiver, RectLight};
    ///
    /// // A ceiling panel 60 cm square, shining down.
    /// let panel = RectLight {
    ///     corner: DVec3::new(-0.3, 2.5, -0.3),
    ///     along: DVec3::new(0.6, 0.0, 0.0),
    ///     across: DVec3::new(0.0, 0.0, 0.6),
    ///     flux: 3600.0,
    /// };
    /// let receiver = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
    /// let rule = GaussRule::new(3);
    /// let lines = panel.lines(receiver.position, rule.iter());
    /// let lux: f64 = lines.map(|light| LineIrradiance::new(&receiver, &light).panel(0.0, 1.0)).sum();
    /// assert!((lux - 179.9).abs() < 0.1, "{lux}");
    /// ```
    pub fn lines<N: IntoIterator<Item = (f64, f64), IntoIter: Clone>>(
        &self,
        position: DVec3,
        nodes: N,
    ) -> impl Iterator<Item = LineLight> + use<N> {
        let Self {
            corner,
            along,
            across,
            flux,
        } = *self;
        let direction = along.try_normalize();
        let sideways = direction.and_then(|d| (across - across.dot(d) * d).try_normalize());
        let fan = direction.zip(sideways).and_then(|(direction, sideways)| {
            let from = corner - position;
            // Emission is to the side of along x across: that is where the receiver must be.
            let height = -from.dot(direction.cross(sideways));
            let start = from.dot(sideways);
            let fan = Fan::new((start, start + across.dot(sideways)), height);
            // pi^2 L Lv h dg with Lv = flux / (pi area).
            (height > 0.0).then(|| (fan, PI * fan.angle / across.dot(sideways)))
        });
        let nodes = nodes.into_iter();
        let flux = flux * normalization(nodes.clone(), |_| 1.0);
        nodes.map_while(move |(x, weight)| {
            let (fan, share) = fan?;
            let (before, _, distance) = fan.at(x);
            let a = corner + across * before;
            Some(line(a, a + along, weight * share * distance * flux))
        })
    }
}
