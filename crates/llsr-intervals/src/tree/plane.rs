//! Planes of triangles with a bounded error.

use glam::DVec3;

/// The plane of a triangle: a unit normal that is off by at most 2⁻³⁰, and a point of the triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    normal: DVec3,
    point: DVec3,
}

/// Needle triangles whose sides enclose an angle with a smaller sine have no steady normal. The computed cross
/// product of two sides u, v is off by at most 2⁻⁴⁹ |u| |v|; this keeps the direction's error below 2⁻³⁰.
const LEAST_SINE: f64 = 1.0 / (1u64 << 18) as f64;

impl Plane {
    /// The plane through `corners`, facing those who see them counter-clockwise. `None` if they lie so near a
    /// line (or at one point) that rounding could turn the normal by 2⁻³⁰ or more.
    pub fn of(corners: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let (u, v) = (b - a, c - a);
        let cross = u.cross(v);
        let length = cross.length();
        let steady = length > LEAST_SINE * u.length() * v.length() && length.is_normal();
        steady.then(|| Self {
            normal: cross / length,
            point: a,
        })
    }

    /// The unit normal.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// A point of the plane.
    pub fn point(&self) -> DVec3 {
        self.point
    }

    /// The same plane, facing the other way.
    #[must_use]
    pub fn flipped(&self) -> Self {
        Self {
            normal: -self.normal,
            ..*self
        }
    }

    /// Normal and offset in a frame with its origin at `center` and lengths multiplied by `scale`.
    pub(super) fn coefficients(&self, center: DVec3, scale: f64) -> [f64; 4] {
        let offset = self.normal.dot((self.point - center) * scale);
        [self.normal.x, self.normal.y, self.normal.z, offset]
    }
}
