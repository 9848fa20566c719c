//! What large flat surfaces hide, whether or not points lie on them.
//!
//! Points tell what is hidden only where there are enough of them. Beside a wall that the camera has just come up to there are
//! few, and the points and edges of the room behind it shine through the gaps. But a wall is known: for each cell of 4x4
//! pixels that lies within the outline of a large flat piece of surface, nothing beyond that piece is seen. (Software
//! occlusion culling with large polygons as occluders; compare S. Coorg and S. Teller, "Real-Time Occlusion Culling for
//! Models with Large Occluders", 1997.)

use std::collections::HashMap;

use glam::{Affine3A, DVec3, Mat4, Vec3};
use llsr_epi::CELL;
use llsr_scene::{Geometry, ObjectId, Scene, Viewport};

/// Triangles that may hide something, the largest of a scene.
const MOST: usize = 1024;
/// Their least area as a share of the square of the scene's diagonal: what covers few cells even from nearby.
const LEAST_AREA: f64 = 2e-5;
/// How far triangles of one flat piece may be apart, as a share of its size.
const FLAT: f64 = 1e-5;
/// Corners that a flat piece may have.
const MOST_CORNERS: usize = 12;
/// By how much farther than an occluder something must be, as a share of the depth: for rounding.
const SLACK: f64 = 2e-3;
/// Corners of a piece that the plane of the eye has cut.
const CUT_CORNERS: usize = MOST_CORNERS + 2;

/// The large flat pieces of a scene, and how far one sees past them in the last view.
#[derive(Clone, Debug, Default)]
pub(crate) struct Occluders {
    pieces: Vec<Piece>,
    /// Corners of all pieces in the frames of their objects.
    corners: Vec<Vec3>,
    columns: usize,
    /// For each cell the depth beyond which nothing is seen; infinite where no piece covers all of it.
    depths: Vec<f32>,
}

/// A convex flat piece.
#[derive(Clone, Debug)]
struct Piece {
    object: ObjectId,
    /// In the list of all corners.
    corners: std::ops::Range<usize>,
}

impl Occluders {
    /// Those of the meshes of a scene.
    pub(crate) fn new(scene: &Scene) -> Self {
        let size = scene.bounds().size().as_dvec3().length_squared();
        let mut large: Vec<(f64, ObjectId, [Vec3; 3])> = Vec::new();
        for (i, object) in scene.objects.iter().enumerate() {
            let Geometry::Mesh(mesh) = object.geometry else {
                continue;
            };
            let mesh = &scene.meshes[mesh.index()];
            for triangle in 0..mesh.triangles.len() {
                let corners = mesh.corners(triangle);
                let [a, b, c] = corners.map(|p| object.transform.transform_point3(p).as_dvec3());
                let area = 0.5 * (b - a).cross(c - a).length();
                if area > LEAST_AREA * size && area.is_finite() {
                    large.push((area, ObjectId::from(i), corners));
                }
            }
        }
        large.sort_by(|a, b| b.0.total_cmp(&a.0));
        large.truncate(MOST);
        large.sort_by_key(|triangle| triangle.1);
        let mut this = Self::default();
        for triangles in large.chunk_by(|a, b| a.1 == b.1) {
            for corners in joined(triangles.iter().map(|triangle| triangle.2)) {
                let first = this.corners.len();
                this.corners.extend(corners);
                this.pieces.push(Piece {
                    object: triangles[0].1,
                    corners: first..this.corners.len(),
                });
            }
        }
        this
    }

    /// Finds how far one sees in each cell of 4x4 pixels, row by row: a depth (distance along the view axis) beyond which
    /// everything is hidden, infinite where nothing is known. `place` tells where an object is.
    pub(crate) fn update(
        &mut self,
        matrix: &Mat4,
        viewport: Viewport,
        place: impl Fn(ObjectId) -> Affine3A,
    ) -> &[f32] {
        let (width, height) = (viewport.width as usize, viewport.height as usize);
        self.columns = width.div_ceil(CELL);
        let rows = height.div_ceil(CELL);
        self.depths.clear();
        self.depths.resize(self.columns * rows, f32::INFINITY);
        // Rows of the matrix that give columns and rows of cells before the division, and the depth.
        let (x, y, w) = (matrix.row(0), matrix.row(1), matrix.row(3));
        let half = |side: usize| 0.5 * side as f32 / CELL as f32;
        let rows = [(x + w) * half(width), (w - y) * half(height), w];
        for piece in &self.pieces {
            let placed = place(piece.object);
            let mut outline = Outline::default();
            for &corner in &self.corners[piece.corners.clone()] {
                let p = placed.transform_point3(corner).extend(1.0);
                let [x, y, w] = rows.map(|row| f64::from(row.dot(p)));
                outline.push(DVec3::new(x, y, w));
            }
            outline.cover(self.columns, &mut self.depths);
        }
        &self.depths
    }
}

/// Joins triangles that lie in a plane and share an edge to convex pieces.
fn joined(triangles: impl Iterator<Item = [Vec3; 3]>) -> Vec<Vec<Vec3>> {
    let mut pieces: Vec<Vec<Vec3>> = triangles.map(|corners| corners.to_vec()).collect();
    loop {
        let bits = |p: Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
        let mut sides: HashMap<[[u32; 3]; 2], usize> = HashMap::new();
        let mut changed = false;
        for i in 0..pieces.len() {
            let mut side = 0;
            while side < pieces[i].len() {
                let count = pieces[i].len();
                let (a, b) = (pieces[i][side], pieces[i][(side + 1) % count]);
                side += 1;
                // The neighbour runs along it in the other sense, or in the same where triangles are not oriented.
                let other = [[bits(b), bits(a)], [bits(a), bits(b)]]
                    .into_iter()
                    .find_map(|key| sides.get(&key).copied())
                    .filter(|&other| other != i && !pieces[other].is_empty());
                if let Some(other) = other
                    && let Some(union) = union(&pieces[i], &pieces[other], (a, b))
                {
                    pieces[i] = union;
                    pieces[other].clear();
                    (changed, side) = (true, 0);
                }
            }
            for (k, &a) in pieces[i].iter().enumerate() {
                let b = pieces[i][(k + 1) % pieces[i].len()];
                sides.insert([bits(a), bits(b)], i);
            }
        }
        pieces.retain(|piece| !piece.is_empty());
        if !changed {
            return pieces;
        }
    }
}

/// The union of two pieces that share the side from `a` to `b`, if it is flat and convex.
fn union(one: &[Vec3], two: &[Vec3], (a, b): (Vec3, Vec3)) -> Option<Vec<Vec3>> {
    if one.len() + two.len() - 2 > MOST_CORNERS {
        return None;
    }
    let from = one.iter().position(|&p| p == a)?;
    // From b around the first piece to a, then on along the second one.
    let mut corners: Vec<Vec3> = (1..=one.len()).map(|i| one[(from + i) % one.len()]).collect();
    let (start, end) = (
        two.iter().position(|&p| p == a)?,
        two.iter().position(|&p| p == b)?,
    );
    let n = two.len();
    let step = match (end + n - start) % n {
        // a is followed by b: the rest lies the other way round.
        1 => n - 1,
        k if k == n - 1 => 1,
        _ => return None,
    };
    corners.extend((1..n - 1).map(|i| two[(start + i * step) % n]));
    let points: Vec<DVec3> = corners.iter().map(|p| p.as_dvec3()).collect();
    let normal = newell(&points);
    let size = normal.length().sqrt();
    let normal = normal.normalize_or_zero();
    let count = points.len();
    let mut kept = Vec::new();
    for i in 0..count {
        let (before, here, after) = (
            points[(i + count - 1) % count],
            points[i],
            points[(i + 1) % count],
        );
        if (here - points[0]).dot(normal).abs() > FLAT * size {
            return None;
        }
        let turn = (here - before).cross(after - here).dot(normal);
        if turn < -FLAT * size * size {
            return None;
        }
        // Corners on a straight line go, so that more can be joined.
        if turn > FLAT * size * size {
            kept.push(corners[i]);
        }
    }
    (kept.len() >= 3).then_some(kept)
}

/// Twice the area of a polygon, along its normal.
fn newell(points: &[DVec3]) -> DVec3 {
    let first = points[0];
    let fan = points.windows(2).map(|p| (p[0] - first).cross(p[1] - first));
    fan.sum()
}

/// A convex piece in the view: columns and rows of cells before the division, and depths.
#[derive(Clone, Copy, Debug, Default)]
struct Outline {
    corners: [DVec3; MOST_CORNERS],
    count: usize,
}

impl Outline {
    fn push(&mut self, corner: DVec3) {
        if let Some(place) = self.corners.get_mut(self.count) {
            *place = corner;
            self.count += 1;
        }
    }

    /// Lowers the depths of the cells that lie within the outline.
    fn cover(&self, columns: usize, depths: &mut [f32]) {
        let rows = depths.len() / columns;
        let corners = &self.corners[..self.count];
        let farthest = corners.iter().fold(0.0, |w: f64, c| w.max(c.z));
        // Only what lies well in front of the eye: the rest is cut off.
        let near = 1e-6 * farthest;
        let mut cut = [DVec3::ZERO; CUT_CORNERS];
        let mut count = 0;
        for (i, &b) in corners.iter().enumerate() {
            let a = corners[(i + corners.len() - 1) % corners.len()];
            let mut add = |p: DVec3| {
                if let Some(place) = cut.get_mut(count) {
                    *place = p;
                    count += 1;
                }
            };
            if (a.z < near) != (b.z < near) {
                add(a + (b - a) * ((near - a.z) / (b.z - a.z)));
            }
            if b.z >= near {
                add(b);
            }
        }
        let cut = &cut[..count];
        if count < 3 || !cut.iter().all(|c| c.is_finite()) {
            return;
        }
        // 1 / depth is linear over the picture: its three coefficients.
        let normal = newell(corners);
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let inverse = normal / normal.dot(middle);
        if !inverse.is_finite() {
            return;
        }
        let points: [(f64, f64); CUT_CORNERS] = std::array::from_fn(|i| {
            let c = cut[i.min(count - 1)];
            (c.x / c.z, c.y / c.z)
        });
        let points = &points[..count];
        let top = points.iter().fold(f64::INFINITY, |y, p| y.min(p.1));
        let bottom = points.iter().fold(f64::NEG_INFINITY, |y, p| y.max(p.1));
        let first = top.ceil().clamp(0.0, rows as f64) as usize;
        let end = bottom.floor().clamp(0.0, rows as f64) as usize;
        let mut above = (first < end).then(|| span(points, first as f64));
        for row in first..end {
            let below = span(points, (row + 1) as f64);
            let (left, right) = match above.replace(below) {
                Some(above) => (above.0.max(below.0), above.1.min(below.1)),
                None => break,
            };
            let left = left.ceil().clamp(0.0, columns as f64) as usize;
            let right = right.floor().clamp(0.0, columns as f64) as usize;
            // The corner of a cell where the piece is farthest away.
            let far_row = row as f64 + if inverse.y < 0.0 { 1.0 } else { 0.0 };
            let far_column = if inverse.x < 0.0 { 1.0 } else { 0.0 };
            let row_part = inverse.y * far_row;
            let Some(cells) = depths[row * columns..][..columns].get_mut(left..right) else {
                continue;
            };
            // Without branches, so that several are divided at once.
            for (i, least) in cells.iter_mut().enumerate() {
                let column = f64::from(left as i32 + i as i32);
                let at = inverse.x * (column + far_column) + row_part + inverse.z;
                let depth = ((1.0 + SLACK) / at) as f32;
                *least = if (depth > 0.0) & (depth < *least) {
                    depth
                } else {
                    *least
                };
            }
        }
    }
}

/// Where a convex outline begins and ends on a line; empty where it does not meet it.
fn span(points: &[(f64, f64)], y: f64) -> (f64, f64) {
    let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
    for (i, &b) in points.iter().enumerate() {
        let a = points[(i + points.len() - 1) % points.len()];
        if (a.1 < y) != (b.1 < y) {
            let x = a.0 + (b.0 - a.0) * ((y - a.1) / (b.1 - a.1));
            (left, right) = (left.min(x), right.max(x));
        }
        if b.1 == y {
            (left, right) = (left.min(b.0), right.max(b.0));
        }
    }
    (left, right)
}

#[cfg(test)]
mod tests;
