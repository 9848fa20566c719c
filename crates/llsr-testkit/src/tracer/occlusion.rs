//! Segments against all triangles, in exact arithmetic.

use std::cmp::Ordering;

use glam::{DVec3, Vec3};

use super::Exact;

/// Does any triangle cut the open segment `p`-`q`? Edges belong to their triangle; a triangle whose plane holds an
/// end of the segment does not cut it. Cost: tens of microseconds a triangle.
pub fn segment_is_cut(triangles: &[[Vec3; 3]], p: DVec3, q: DVec3) -> bool {
    triangles.iter().any(|&triangle| cuts(triangle, p, q))
}

fn cuts(triangle: [Vec3; 3], p: DVec3, q: DVec3) -> bool {
    let [a, b, c] = triangle.map(|v| v.as_dvec3());
    let side = |x: DVec3| Exact::orientation(a, b, c, x).sign();
    let (at_p, at_q) = (side(p), side(q));
    if at_p == Ordering::Equal || at_q == Ordering::Equal || at_p == at_q {
        return false;
    }
    let turns = [(a, b), (b, c), (c, a)].map(|(x, y)| Exact::orientation(p, q, x, y).sign());
    !(turns.contains(&Ordering::Less) && turns.contains(&Ordering::Greater))
}
