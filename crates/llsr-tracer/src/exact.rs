//! Decisions in double precision about one triangle.
//!
//! Vertices are `f32` and therefore exact in `f64`; so are the ends of a segment, which are `f64`. Signs come from
//! adaptive exact predicates (Shewchuk 1997), so neighbouring triangles never disagree about their common edge.

use glam::{DVec3, Vec3};
use robust::{Coord3D, orient3d};

fn coord(p: DVec3) -> Coord3D<f64> {
    Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    }
}

/// Does the open segment `p`-`q` cut the triangle, its edges included?
///
/// A triangle whose plane holds an end of the segment does not cut it.
pub(crate) fn segment_cuts_triangle(p: DVec3, q: DVec3, triangle: [Vec3; 3]) -> bool {
    let [p, q] = [p, q].map(coord);
    let [a, b, c] = triangle.map(|v| coord(v.as_dvec3()));
    let at_p = orient3d(a, b, c, p);
    let at_q = orient3d(a, b, c, q);
    if !((at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0)) {
        return false;
    }
    let u = orient3d(p, q, b, c);
    let v = orient3d(p, q, c, a);
    if (u > 0.0 && v < 0.0) || (u < 0.0 && v > 0.0) {
        return false;
    }
    let w = orient3d(p, q, a, b);
    (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleHit {
    /// Ray parameter, in lengths of the direction.
    pub(crate) t: f64,
    /// Weights of the second and third corner; all three weights are in [0, 1].
    pub(crate) barycentrics: [f64; 2],
}

/// Meets the ray `origin + t direction` with a triangle; edges count as inside, with a tolerance of a few roundings,
/// so that no ray slips between neighbours. A triangle seen edge-on is missed.
pub(crate) fn ray_meets_triangle(
    origin: DVec3,
    direction: DVec3,
    triangle: [Vec3; 3],
) -> Option<TriangleHit> {
    let [a, b, c] = triangle.map(|v| v.as_dvec3() - origin);
    // Twice the signed volumes; the permanents bound their rounding errors.
    let (u, u_permanent) = volume(direction, b, c);
    let (v, v_permanent) = volume(direction, c, a);
    let (w, w_permanent) = volume(direction, a, b);
    const TOLERANCE: f64 = 8.0 * f64::EPSILON;
    let (eu, ev, ew) = (
        TOLERANCE * u_permanent,
        TOLERANCE * v_permanent,
        TOLERANCE * w_permanent,
    );
    let inside = (u >= -eu && v >= -ev && w >= -ew) || (u <= eu && v <= ev && w <= ew);
    if !inside {
        return None;
    }
    let sum = u + v + w;
    // Edge vectors of the corners are exact or nearly so, unlike those of the translated corners.
    let [p0, p1, p2] = triangle.map(|v| v.as_dvec3());
    let normal = (p1 - p0).cross(p2 - p0);
    let facing = normal.dot(direction);
    let t = normal.dot(a) / facing;
    if facing == 0.0 || sum == 0.0 || !t.is_finite() {
        return None;
    }
    let v = (v / sum).clamp(0.0, 1.0);
    let w = (w / sum).clamp(0.0, 1.0 - v);
    Some(TriangleHit {
        t,
        barycentrics: [v, w],
    })
}

/// `a . (b x c)` and the sum of the absolute values of its products.
fn volume(a: DVec3, b: DVec3, c: DVec3) -> (f64, f64) {
    let (left, right) = (
        DVec3::new(b.y * c.z, b.z * c.x, b.x * c.y),
        DVec3::new(b.z * c.y, b.x * c.z, b.y * c.x),
    );
    let permanent = a.abs().dot(left.abs() + right.abs());
    (a.dot(left - right), permanent)
}
