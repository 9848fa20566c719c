//! Polygons into triangles.

use std::collections::VecDeque;

use glam::{DVec2, DVec3};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// Polygons with more corners than this are cut as a fan: the triangulation's worst case is quadratic.
const MOST_CORNERS: usize = 1 << 13;

/// Distance from the mean plane, relative to the polygon's size, from which a polygon counts as out of plane.
const FLATNESS: f64 = 0.01;

/// How a polygon became triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// As it should.
    Plain,
    /// Fewer than three corners follow each other at different places: no triangles.
    Empty,
    /// Its corners do not lie in a plane; it was cut as seen along its mean normal.
    NonPlanar,
    /// Its outline crosses itself, encloses nothing or is too long; it became a fan from the first corner.
    Fan,
}

/// Cuts the polygon with these corners into triangles of corner numbers, oriented as the polygon.
///
/// Corners at the place of the one before are skipped. Convex outlines become a fan, others a constrained Delaunay
/// triangulation in the plane of their mean normal (the one whose components are the areas of the outline's
/// projections). Outlines may touch themselves, as a slit to a hole does. Triangles are appended to `triangles`;
/// each corner number is below `corners.len()`.
pub(crate) fn triangulate(corners: &[DVec3], triangles: &mut Vec<[u32; 3]>) -> Outcome {
    let n = corners.len();
    let moves_on = |i: &u32| corners[*i as usize] != corners[(*i as usize + n - 1) % n];
    let outline: Vec<u32> = (0..n as u32).filter(moves_on).collect();
    if outline.len() < 3 {
        return Outcome::Empty;
    }
    let start = triangles.len();
    let places: Vec<DVec3> = outline.iter().map(|&i| corners[i as usize]).collect();
    let outcome = triangulate_outline(&places, triangles);
    for triangle in &mut triangles[start..] {
        *triangle = triangle.map(|i| outline[i as usize]);
    }
    outcome
}

/// The same for at least three corners, each at another place than the one before.
fn triangulate_outline(corners: &[DVec3], triangles: &mut Vec<[u32; 3]>) -> Outcome {
    let n = corners.len();
    let fan = |triangles: &mut Vec<[u32; 3]>| triangles.extend((2..n as u32).map(|i| [0, i - 1, i]));
    if n == 3 {
        fan(triangles);
        return Outcome::Plain;
    }
    let origin = corners[0];
    // Relative to a corner, so that far coordinates do not cancel.
    let mean_normal: DVec3 = (1..n - 1)
        .map(|i| (corners[i] - origin).cross(corners[i + 1] - origin))
        .sum();
    let size = corners
        .iter()
        .map(|&c| (c - origin).abs().max_element())
        .fold(0.0, f64::max);
    let Some(normal) = mean_normal.try_normalize() else {
        fan(triangles);
        return Outcome::Fan;
    };
    let x_axis = normal.any_orthonormal_vector();
    let y_axis = normal.cross(x_axis);
    let flat: Vec<DVec2> = corners
        .iter()
        .map(|&c| {
            let offset = (c - origin) / size;
            snapped(DVec2::new(offset.dot(x_axis), offset.dot(y_axis)))
        })
        .collect();
    let heights = corners.iter().map(|&c| (c - origin).dot(normal) / size);
    let (low, high) = heights.fold((0.0f64, 0.0f64), |(low, high), h| (low.min(h), high.max(h)));
    let outcome = if high - low > FLATNESS {
        Outcome::NonPlanar
    } else {
        Outcome::Plain
    };
    if is_convex(&flat) {
        fan(triangles);
        return outcome;
    }
    let start = triangles.len();
    if n <= MOST_CORNERS && constrained(&flat, triangles).is_some() {
        return outcome;
    }
    triangles.truncate(start);
    fan(triangles);
    Outcome::Fan
}

/// Rounds to a grid of 2^-40: spade refuses numbers that are too small.
fn snapped(p: DVec2) -> DVec2 {
    const GRID: f64 = (1u64 << 40) as f64;
    (p * GRID).round() / GRID
}

/// True if each corner turns left and the outline goes round once.
fn is_convex(flat: &[DVec2]) -> bool {
    let n = flat.len();
    let mut sign_changes = 0;
    let mut last = 0.0;
    for i in 0..n {
        let (a, b, c) = (flat[i], flat[(i + 1) % n], flat[(i + 2) % n]);
        if (b - a).perp_dot(c - b) <= 0.0 {
            return false;
        }
        let dx = b.x - a.x;
        if dx != 0.0 {
            sign_changes += usize::from(dx * last < 0.0);
            last = dx;
        }
    }
    // Around once, x turns back twice; the first turn may hide where the loop closes.
    sign_changes <= 2
}

/// Constrained Delaunay triangulation, filled by the even-odd rule; `None` if outline edges cross.
fn constrained(flat: &[DVec2], triangles: &mut Vec<[u32; 3]>) -> Option<()> {
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles: Vec<FixedVertexHandle> = Vec::with_capacity(flat.len());
    let mut corner_of: Vec<u32> = Vec::with_capacity(flat.len());
    for (corner, p) in flat.iter().enumerate() {
        let handle = cdt.insert(Point2::new(p.x, p.y)).ok()?;
        if handle.index() == corner_of.len() {
            corner_of.push(corner as u32);
        }
        handles.push(handle);
    }
    // Edges that the outline runs along an odd number of times: a slit runs along its edges twice and bounds nothing.
    let mut bounds = vec![false; cdt.num_undirected_edges()];
    for (i, &from) in handles.iter().enumerate() {
        let to = handles[(i + 1) % handles.len()];
        if from == to {
            continue;
        }
        let edges = cdt.try_add_constraint(from, to);
        if edges.is_empty() {
            return None;
        }
        for edge in edges {
            bounds[edge.as_undirected().index()] ^= true;
        }
    }
    // From outside inwards; each bounding edge turns outside to inside or back.
    let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); cdt.num_all_faces()];
    for edge in cdt.undirected_edges() {
        let sides = [edge.as_directed(), edge.as_directed().rev()].map(|e| e.face().fix().index());
        let bounding = bounds[edge.fix().index()];
        neighbours[sides[0]].push((sides[1], bounding));
        neighbours[sides[1]].push((sides[0], bounding));
    }
    let mut inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let outer = cdt.outer_face().fix().index();
    inside[outer] = Some(false);
    let mut queue = VecDeque::from([(outer, false)]);
    while let Some((face, is_inside)) = queue.pop_front() {
        for &(next, bounding) in &neighbours[face] {
            if inside[next].is_none() {
                inside[next] = Some(is_inside ^ bounding);
                queue.push_back((next, is_inside ^ bounding));
            }
        }
    }
    let start = triangles.len();
    for face in cdt.inner_faces() {
        if inside[face.fix().index()] == Some(true) {
            triangles.push(face.vertices().map(|vertex| corner_of[vertex.fix().index()]));
        }
    }
    (triangles.len() > start).then_some(())
}
