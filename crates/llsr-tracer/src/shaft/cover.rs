//! Exact proofs about all segments between two groups of points.
//!
//! Both proofs rest on convexity. If two groups lie strictly on one side of a plane, so do all segments between their
//! hulls. And on which side of an edge a segment from p to q passes is an affine function of p and of q: where it is
//! positive for all pairs of corners of two hulls, it is positive for all pairs of their points.

use glam::DVec3;
use robust::{Coord3D, orient3d};

use super::ShaftLeaf;
use crate::block::TriangleBlock;
use crate::part::Geometry;
use crate::shape::Kind;

fn coord(p: DVec3) -> Coord3D<f64> {
    Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    }
}

/// Positive and negative for the two sides of the triangle's plane; the sign is exact.
fn side(triangle: &[DVec3; 3], p: DVec3) -> f64 {
    let [a, b, c] = triangle.map(coord);
    orient3d(a, b, c, coord(p))
}

/// Without those of the `lanes` whose planes have all points and the light strictly on one side.
#[inline(never)]
pub(super) fn in_the_way(block: &TriangleBlock, mut lanes: u32, points: &[DVec3], light: &[DVec3]) -> u32 {
    let mut kept = 0;
    while lanes != 0 {
        let lane = lanes.trailing_zeros();
        lanes &= lanes - 1;
        let triangle = block.triangle(lane as usize).map(|v| v.as_dvec3());
        if !on_one_side(&triangle, points, light) {
            kept |= 1 << lane;
        }
    }
    kept
}

fn on_one_side(triangle: &[DVec3; 3], points: &[DVec3], light: &[DVec3]) -> bool {
    let [first, rest @ ..] = light else { return false };
    let sign = side(triangle, *first);
    if sign == 0.0 || rest.iter().any(|&q| side(triangle, q) * sign <= 0.0) {
        return false;
    }
    // The plane's equation settles nearly all points; what its rounding leaves in doubt the predicate decides.
    let [a, b, c] = *triangle;
    let (u, v) = (b - a, c - a);
    let normal = u.cross(v) * sign.signum();
    let (m, n) = (u.abs(), v.abs());
    let bound = DVec3::new(
        m.y * n.z + m.z * n.y,
        m.z * n.x + m.x * n.z,
        m.x * n.y + m.y * n.x,
    ) * (8.0 * f64::EPSILON);
    // `orient3d` is positive on the side from which the corners run clockwise.
    points.iter().all(|&p| {
        let x = p - a;
        let height = -normal.dot(x);
        let error = bound.dot(x.abs());
        height > error || (height >= -error && side(triangle, p) * sign > 0.0)
    })
}

/// Does one surface hide all of the light from all points?
///
/// Looked for are a triangle, two triangles with a common edge, and a convex primitive.
pub(super) fn hidden(geometry: &Geometry, leaves: &[ShaftLeaf], points: &[DVec3], light: &[DVec3]) -> bool {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &p in points {
        (min, max) = (min.min(p), max.max(p));
    }
    let corners: [DVec3; 8] = std::array::from_fn(|i| {
        let pick = |bit: usize, axis: usize| if i >> bit & 1 == 1 { max[axis] } else { min[axis] };
        DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
    });
    // A few triangles that part the points from the light, each turned so that its corners run the same way as seen from
    // the points.
    const MOST: usize = 8;
    let mut parting = [[DVec3::ZERO; 3]; MOST];
    let mut count = 0;
    for leaf in leaves {
        if !leaf.at.is_block() {
            let shape = &geometry.shapes[leaf.at.index()];
            let convex = !matches!(
                shape.kind(),
                Kind::Cylinder { capped: false } | Kind::Cone { capped: false }
            );
            // For a given end the set of all points from which it is hidden by a convex body is convex, and the other
            // way round.
            if convex
                && corners
                    .iter()
                    .all(|&p| light.iter().all(|&q| shape.cuts_segment(p, q)))
            {
                return true;
            }
            continue;
        }
        let block = &geometry.blocks[leaf.at.index()];
        let mut lanes = leaf.lanes;
        while lanes != 0 && count < MOST {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let [a, b, c] = block.triangle(lane as usize).map(|v| v.as_dvec3());
            let triangle = [a, b, c];
            let sign = side(&triangle, corners[0]);
            let parts = sign != 0.0
                && corners[1..].iter().all(|&p| side(&triangle, p) * sign > 0.0)
                && light.iter().all(|&q| side(&triangle, q) * sign < 0.0);
            if !parts {
                continue;
            }
            let triangle = if sign > 0.0 { [a, b, c] } else { [a, c, b] };
            if within(&triangle, &corners, light) {
                return true;
            }
            if parting[..count]
                .iter()
                .any(|other| quad(other, &triangle).is_some_and(|outline| within(&outline, &corners, light)))
            {
                return true;
            }
            parting[count] = triangle;
            count += 1;
        }
    }
    false
}

/// The outline of two triangles that run along a common edge in opposite directions.
fn quad(one: &[DVec3; 3], other: &[DVec3; 3]) -> Option<[DVec3; 4]> {
    for i in 0..3 {
        let [a, b, c] = [0, 1, 2].map(|k| one[(i + k) % 3]);
        for j in 0..3 {
            let [d, e, f] = [0, 1, 2].map(|k| other[(j + k) % 3]);
            if a == e && b == d {
                return Some([b, c, a, f]);
            }
        }
    }
    None
}

/// Do all lines from a corner to a light's point pass on the same side of every edge of the outline?
///
/// If so, and the planes of its triangles part the corners from the light, every segment crosses one of the triangles: on
/// whichever side of the inner edge it passes, it is inside the triangle of that side.
fn within(outline: &[DVec3], corners: &[DVec3; 8], light: &[DVec3]) -> bool {
    let mut sign = 0.0;
    for (i, &from) in outline.iter().enumerate() {
        let to = outline[(i + 1) % outline.len()];
        for &q in light {
            for &p in corners {
                let passes = orient3d(coord(p), coord(q), coord(from), coord(to));
                if sign == 0.0 {
                    sign = passes;
                }
                if passes * sign <= 0.0 {
                    return false;
                }
            }
        }
    }
    true
}
