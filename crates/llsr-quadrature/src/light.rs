//! What the closed forms know of a scene: one receiver and one light.

use glam::DVec3;

/// How a linear light sends out its flux.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Emission {
    /// The limit of a thin Lambertian tube: intensity falls with the sine of the angle to the axis.
    #[default]
    Diffuse,
    /// Every element sends the same intensity into every direction.
    Isotropic,
}

/// A light of no thickness between two points.
///
/// The light parameter `t` in [0, 1] runs from `a` to `b`. A light whose ends coincide is a point light of
/// intensity `flux / (4 pi)` in every direction, whatever its emission law, because it has no axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineLight {
    /// The end at `t = 0`, in metres.
    pub a: DVec3,
    /// The end at `t = 1`, in metres.
    pub b: DVec3,
    /// Emission law.
    pub emission: Emission,
    /// Total flux in lumens or watts; results are then in lux or watts per square metre.
    pub flux: f64,
}

impl LineLight {
    /// The point at light parameter `t`, exact at both ends.
    pub fn point(&self, t: f64) -> DVec3 {
        self.a * (1.0 - t) + self.b * t
    }

    /// Length in metres.
    pub fn length(&self) -> f64 {
        self.a.distance(self.b)
    }
}

/// A point that receives light on the side to which its normal points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Position in metres.
    pub position: DVec3,
    /// Unit normal. One of another length scales every result with its length.
    pub normal: DVec3,
}

/// The part of the segment `a`-`b` above the receiver's horizon, as light parameters `t0 < t1`, or `None`.
///
/// A point is above the horizon if the angle between the normal and the direction to it is less than 90
/// degrees; where the segment crosses the receiver's plane it is cut at the crossing. A segment that lies in
/// the plane has no part above it, and a zero-length one above the plane is (0, 1). `None` also for
/// coordinates that are not finite.
///
/// Callers with both a shading normal and a geometric normal clip with the geometric one here before they
/// look for occluders; [`LineIrradiance`](crate::LineIrradiance) then clips with the normal it is given.
///
/// ```
/// use glam::DVec3;
/// use llsr_quadrature::{Receiver, horizon_clip};
///
/// let receiver = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
/// let (a, b) = (DVec3::new(1.0, -1.0, 0.0), DVec3::new(1.0, 3.0, 0.0));
/// assert_eq!(horizon_clip(&receiver, a, b), Some((0.25, 1.0)));
/// assert_eq!(horizon_clip(&receiver, -b, -a - 2.0 * DVec3::Y), None);
/// ```
pub fn horizon_clip(receiver: &Receiver, a: DVec3, b: DVec3) -> Option<(f64, f64)> {
    let height_a = receiver.normal.dot(a - receiver.position);
    let height_b = receiver.normal.dot(b - receiver.position);
    if !(height_a.is_finite() && height_b.is_finite()) {
        return None;
    }
    let range = clip_heights(height_a, height_b);
    (range.0 < range.1).then_some(range)
}

/// The parameters between which a linear function with these end values is positive; empty is (0, 0).
pub(crate) fn clip_heights(height_a: f64, height_b: f64) -> (f64, f64) {
    match (height_a > 0.0, height_b > 0.0) {
        (true, true) => (0.0, 1.0),
        // Both differences add magnitudes, so the crossing has no cancellation.
        (true, false) => (0.0, height_a / (height_a - height_b)),
        (false, true) => (height_a / (height_a - height_b), 1.0),
        (false, false) => (0.0, 0.0),
    }
}
