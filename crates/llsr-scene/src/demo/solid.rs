//! Closed meshes by formula: turned on a lathe, swept along a path, built from blocks.
//!
//! All of them are watertight once equal positions are welded, face outwards, and carry normals (smooth where the
//! shape is) and texture coordinates in metres.

use std::f32::consts::TAU;

use glam::{Affine3A, Vec2, Vec3};

use crate::{MaterialId, Mesh};

/// Vertices with normals and texture coordinates, and triangles of one material.
struct Builder {
    mesh: Mesh,
    material: MaterialId,
}

impl Builder {
    fn new(material: MaterialId) -> Self {
        Self {
            mesh: Mesh::default(),
            material,
        }
    }

    fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.mesh.positions.push(position);
        self.mesh.normals.push(normal);
        self.mesh.uvs.push(uv);
        self.mesh.positions.len() as u32 - 1
    }

    /// A triangle, unless two of its corners coincide, as at the pole of a lathe.
    fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|v| self.mesh.positions[v as usize]);
        if a != b && b != c && c != a {
            self.mesh.triangles.push(corners);
            self.mesh.materials.push(self.material);
        }
    }
}

/// Turns a profile around the y axis.
///
/// The profile holds (radius, height) pairs and has the solid on its left: a column goes from its foot up. It begins and
/// ends on the axis, or where it began. Corners of more than `crease` degrees stay sharp. With `n` segments there are
/// `2 n` triangles for each part of the profile, `n` where one end of it lies on the axis.
pub(super) fn lathe(profile: &[Vec2], segments: u32, crease: f32, material: MaterialId) -> Mesh {
    let parts = profile.len() - 1;
    let closed = profile[0] == profile[parts];
    let normal = |part: usize| {
        let along = profile[part + 1] - profile[part];
        Vec2::new(along.y, -along.x).normalize_or_zero()
    };
    // The normal of `part` at the end it shares with `other`.
    let shared = |part: usize, other: Option<usize>| {
        let mine = normal(part);
        match other.map(normal) {
            Some(theirs) if mine.dot(theirs) > crease.to_radians().cos() => (mine + theirs).normalize(),
            _ => mine,
        }
    };
    let before = |part: usize| part.checked_sub(1).or(closed.then_some(parts - 1));
    let after = |part: usize| {
        if part + 1 < parts {
            Some(part + 1)
        } else {
            closed.then_some(0)
        }
    };
    let mut builder = Builder::new(material);
    let mut length = 0.0;
    for part in 0..parts {
        let (from, to) = (profile[part], profile[part + 1]);
        let ends = [
            (from, shared(part, before(part)), length),
            (to, shared(part, after(part)), length + from.distance(to)),
        ];
        length = ends[1].2;
        let widest = profile.iter().fold(0.0f32, |widest, point| widest.max(point.x));
        let mut rings = [0u32; 2];
        for (ring, (point, normal, v)) in rings.iter_mut().zip(ends) {
            *ring = builder.mesh.positions.len() as u32;
            for j in 0..=segments {
                let direction = round(j, segments);
                // On the axis all vertices are the same point, and the normal of a smooth tip points along it.
                let position = Vec3::new(point.x * direction.x, point.y, point.x * direction.y);
                let normal = Vec3::new(normal.x * direction.x, normal.y, normal.x * direction.y);
                let u = TAU * widest * j as f32 / segments as f32;
                builder.vertex(position, normal, Vec2::new(u, v));
            }
        }
        for j in 0..segments {
            let [a, d] = rings.map(|ring| ring + j);
            builder.triangle([a, d, d + 1]);
            builder.triangle([a, d + 1, a + 1]);
        }
    }
    builder.mesh
}

/// The unit vector after `j` of `n` steps round the circle; step `n` is bitwise step 0.
fn round(j: u32, n: u32) -> Vec2 {
    Vec2::from_angle(TAU * (j % n) as f32 / n as f32)
}

/// An arc around `center` from one angle to another (degrees from the outward direction, up positive), for profiles.
pub(super) fn arc(center: Vec2, radius: f32, from: f32, to: f32, parts: u32) -> impl Iterator<Item = Vec2> {
    (0..=parts).map(move |i| {
        let degrees = from + (to - from) * i as f32 / parts as f32;
        let point = center + radius * Vec2::from_angle(degrees.to_radians());
        // A quarter circle ends on the axis exactly.
        if degrees.abs() == 90.0 {
            Vec2::new(center.x, point.y)
        } else {
            point
        }
    })
}

/// A torus around the y axis; `2 * around * across` triangles.
pub(super) fn torus(radius: f32, tube: f32, around: u32, across: u32, material: MaterialId) -> Mesh {
    let profile: Vec<Vec2> = (0..=across)
        .map(|k| Vec2::new(radius, 0.0) + tube * round(k, across))
        .collect();
    lathe(&profile, around, 180.0, material)
}

/// A sphere around the origin; `2 * around * (across - 1)` triangles.
pub(super) fn ball(radius: f32, around: u32, across: u32, material: MaterialId) -> Mesh {
    let profile: Vec<Vec2> = arc(Vec2::ZERO, radius, -90.0, 90.0, across).collect();
    lathe(&profile, around, 180.0, material)
}

/// A rod with flat ends along a path; `radius` gives its radius at each point of the path.
///
/// `2 * sides * path.len()` triangles.
pub(super) fn sweep(path: &[Vec3], radius: impl Fn(usize) -> f32, sides: u32, material: MaterialId) -> Mesh {
    let last = path.len() - 1;
    let tangent = |i: usize| (path[(i + 1).min(last)] - path[i.saturating_sub(1)]).normalize();
    let mut builder = Builder::new(material);
    let mut across = tangent(0).any_orthonormal_vector();
    let mut length = 0.0;
    let mut previous = None;
    for i in 0..=last {
        let along = tangent(i);
        // The frame turns about the path as little as possible.
        across = across.reject_from_normalized(along).normalize();
        let other = along.cross(across);
        let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
        let slope = (radius(after) - radius(before)) / path[after].distance(path[before]);
        length += path[i].distance(path[before]);
        let ring = builder.mesh.positions.len() as u32;
        for j in 0..=sides {
            let direction = round(j, sides);
            let outward = across * direction.x + other * direction.y;
            let uv = Vec2::new(TAU * radius(i) * j as f32 / sides as f32, length);
            builder.vertex(
                path[i] + radius(i) * outward,
                (outward - slope * along).normalize(),
                uv,
            );
        }
        if let Some(previous) = previous.replace(ring) {
            for j in 0..sides {
                let (a, d): (u32, u32) = (previous + j, ring + j);
                builder.triangle([a, a + 1, d]);
                builder.triangle([a + 1, d + 1, d]);
            }
        }
        if i == 0 || i == last {
            let normal = if i == 0 { -along } else { along };
            let center = builder.vertex(path[i], normal, Vec2::ZERO);
            let rim: Vec<u32> = (0..=sides)
                .map(|j| {
                    let position = builder.mesh.positions[(ring + j) as usize];
                    builder.vertex(position, normal, radius(i) * round(j, sides))
                })
                .collect();
            for pair in rim.windows(2) {
                let (a, b) = if i == 0 {
                    (pair[1], pair[0])
                } else {
                    (pair[0], pair[1])
                };
                builder.triangle([center, a, b]);
            }
        }
    }
    builder.mesh
}

/// A straight rod with flat ends; `4 * sides` triangles.
pub(super) fn rod(from: Vec3, to: Vec3, radius: f32, sides: u32, material: MaterialId) -> Mesh {
    sweep(&[from, to], |_| radius, sides, material)
}

/// A box; 12 triangles.
pub(super) fn block(min: Vec3, max: Vec3, material: MaterialId) -> Mesh {
    let axes: [[f32; 2]; 3] = std::array::from_fn(|axis| [min[axis], max[axis]]);
    blocks([&axes[0], &axes[1], &axes[2]], |_| true, |_, _| material)
}

/// The surface of some cells of a grid with planes at the given, rising coordinates: a wall with its doorways, a table
/// with its legs. Nothing is inside, and no triangle has a vertex on an edge of another.
///
/// `filled` and `material` are asked by cell; `material` also gets the face's outward normal. Cells that touch along an
/// edge alone would make it belong to four faces.
pub(super) fn blocks(
    planes: [&[f32]; 3],
    filled: impl Fn([usize; 3]) -> bool,
    material: impl Fn([usize; 3], Vec3) -> MaterialId,
) -> Mesh {
    let cells = planes.map(|planes| planes.len() - 1);
    let solid = |cell: [usize; 3]| (0..3).all(|axis| cell[axis] < cells[axis]) && filled(cell);
    let mut builder = Builder::new(MaterialId(0));
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            for k in (0..cells[2]).filter(|&k| filled([i, j, k])) {
                let cell = [i, j, k];
                for axis in 0..3 {
                    for forward in [false, true] {
                        let mut beside = cell;
                        beside[axis] = if forward {
                            cell[axis] + 1
                        } else {
                            cell[axis].wrapping_sub(1)
                        };
                        if solid(beside) {
                            continue;
                        }
                        let normal = Vec3::AXES[axis] * if forward { 1.0 } else { -1.0 };
                        builder.material = material(cell, normal);
                        face(&mut builder, planes, cell, axis, forward, normal);
                    }
                }
            }
        }
    }
    builder.mesh
}

/// One face of a cell of [`blocks`].
fn face(
    builder: &mut Builder,
    planes: [&[f32]; 3],
    cell: [usize; 3],
    axis: usize,
    forward: bool,
    normal: Vec3,
) {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let at = |axis: usize, step: usize| planes[axis][cell[axis] + step];
    let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(du, dv)| {
        let mut position = Vec3::ZERO;
        position[axis] = at(axis, usize::from(forward));
        position[u] = at(u, du);
        position[v] = at(v, dv);
        // Upright faces have y downwards along v, as pictures do.
        let uv = match axis {
            0 => Vec2::new(position.z, -position.y),
            1 => Vec2::new(position.x, position.z),
            _ => Vec2::new(position.x, -position.y),
        };
        builder.vertex(position, normal, uv)
    });
    let [a, b, c, d] = corners;
    if forward {
        builder.triangle([a, b, c]);
        builder.triangle([a, c, d]);
    } else {
        builder.triangle([a, c, b]);
        builder.triangle([a, d, c]);
    }
}

/// Adds `part` to `whole`, moved by a rotation and a translation.
pub(super) fn put(whole: &mut Mesh, part: &Mesh, place: Affine3A) {
    let mut moved = part.clone();
    for position in &mut moved.positions {
        *position = place.transform_point3(*position);
    }
    for normal in &mut moved.normals {
        *normal = place.transform_vector3(*normal).normalize();
    }
    whole.append(&moved);
}
