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
    SeenTriangle::new(origin, triangle).meets(direction)
}

/// A triangle as the rays from one origin see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenTriangle {
    /// Of opposite edges: products whose sum with a direction is twice a signed volume.
    edges: [Edge; 3],
    /// Not normalised.
    normal: DVec3,
    /// Normal times the way to the plane.
    height: f64,
}

impl SeenTriangle {
    #[inline(always)]
    pub(crate) fn new(origin: DVec3, triangle: [Vec3; 3]) -> Self {
        let [a, b, c] = triangle.map(|v| v.as_dvec3() - origin);
        // Edge vectors of the corners are exact or nearly so, unlike those of the translated corners.
        let [p0, p1, p2] = triangle.map(|v| v.as_dvec3());
        let normal = (p1 - p0).cross(p2 - p0);
        Self {
            edges: [Edge::new(b, c), Edge::new(c, a), Edge::new(a, b)],
            normal,
            height: normal.dot(a),
        }
    }

    #[inline(always)]
    pub(crate) fn meets(&self, direction: DVec3) -> Option<TriangleHit> {
        // Twice the signed volumes; the permanents bound their rounding errors.
        let size = direction.abs();
        let [u, v, w] = [0, 1, 2].map(|i| direction.dot(self.edges[i].cross));
        const TOLERANCE: f64 = 8.0 * f64::EPSILON;
        let [eu, ev, ew] = [0, 1, 2].map(|i| TOLERANCE * size.dot(self.edges[i].permanent));
        let inside = (u >= -eu && v >= -ev && w >= -ew) || (u <= eu && v <= ev && w <= ew);
        if !inside {
            return None;
        }
        let sum = u + v + w;
        let facing = self.normal.dot(direction);
        let t = self.height / facing;
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
}

/// The cross product of two corners, and the sums of the absolute values of its products.
#[derive(Clone, Copy, Debug)]
struct Edge {
    cross: DVec3,
    permanent: DVec3,
}

impl Edge {
    #[inline(always)]
    fn new(b: DVec3, c: DVec3) -> Self {
        let (left, right) = (
            DVec3::new(b.y * c.z, b.z * c.x, b.x * c.y),
            DVec3::new(b.z * c.y, b.x * c.z, b.y * c.x),
        );
        Self {
            cross: left - right,
            permanent: left.abs() + right.abs(),
        }
    }
}
