//! Analytic primitives as meshes.

use std::f32::consts::PI;

use glam::Vec3;
use llsr_scene::{MaterialId, Mesh, Shape};

/// Fewest and most corners of a circle.
const CORNERS: (f32, f32) = (16.0, 512.0);

/// A mesh that lies within `tolerance` (m) of the surface, from both sides.
///
/// A circle of radius r becomes a polygon whose corners lie outside and whose sides run inside it by the same
/// length, r (1 - cos(pi/n)) / 2. A sphere, bent in both directions, gets half of the tolerance from each.
/// The number of corners is between 16 and 512. Closed shapes give closed meshes that look outwards.
pub(super) fn tessellate(shape: &Shape, tolerance: f32) -> Mesh {
    match *shape {
        Shape::Sphere { center, radius } => sphere(center, radius, tolerance),
        Shape::Cylinder { a, b, radius, capped } => {
            let n = corners(radius, tolerance);
            let mut surface = Surface::default();
            let (u, v) = frame(b - a);
            let low = surface.circle(a, u, v, radius, n);
            let high = surface.circle(b, u, v, radius, n);
            for i in 0..n {
                let j = (i + 1) % n;
                surface.face([low + i, low + j, high + j]);
                surface.face([low + i, high + j, high + i]);
            }
            if capped {
                surface.fan(low, n, a, true);
                surface.fan(high, n, b, false);
            }
            surface.mesh("cylinder")
        }
        Shape::Cone {
            base,
            apex,
            radius,
            capped,
        } => {
            let n = corners(radius, tolerance);
            let mut surface = Surface::default();
            let (u, v) = frame(apex - base);
            let rim = surface.circle(base, u, v, radius, n);
            surface.fan(rim, n, apex, false);
            if capped {
                surface.fan(rim, n, base, true);
            }
            surface.mesh("cone")
        }
        Shape::Disc {
            center,
            normal,
            radius,
        } => {
            let n = corners(radius, tolerance);
            let mut surface = Surface::default();
            let (u, v) = frame(normal);
            let rim = surface.circle(center, u, v, radius, n);
            surface.fan(rim, n, center, false);
            surface.mesh("disc")
        }
    }
}

/// Corners of a circle whose polygon keeps the tolerance.
fn corners(radius: f32, tolerance: f32) -> u32 {
    // r (1 - cos(pi/n)) / 2 = r pi^2 / (4 n^2)
    let n = 0.5 * PI * (radius / tolerance).sqrt();
    // Not a number: too few.
    let n = if n > CORNERS.0 {
        n.min(CORNERS.1)
    } else {
        CORNERS.0
    };
    // Even, so that a sphere's equator lies in its middle.
    2 * (0.5 * n).ceil() as u32
}

/// How much farther than the circle the corners of its polygon lie.
fn outwards(n: u32) -> f32 {
    2.0 / (1.0 + (PI / n as f32).cos())
}

/// Two unit vectors that make a right-handed frame with `axis`.
fn frame(axis: Vec3) -> (Vec3, Vec3) {
    axis.normalize_or(Vec3::Y).any_orthonormal_pair()
}

fn sphere(center: Vec3, radius: f32, tolerance: f32) -> Mesh {
    let columns = corners(radius, 0.5 * tolerance);
    let rows = columns / 2;
    // Sides bend inwards along both directions.
    let out = radius * outwards(columns) * outwards(columns);
    let mut surface = Surface::default();
    let point = |row: u32, column: u32| {
        let polar = PI * row as f32 / rows as f32;
        let around = 2.0 * PI * column as f32 / columns as f32;
        let (sin, cos) = polar.sin_cos();
        center + out * Vec3::new(sin * around.cos(), cos, -sin * around.sin())
    };
    let top = surface.point(center + out * Vec3::Y);
    let first = surface.positions.len() as u32;
    for row in 1..rows {
        for column in 0..columns {
            surface.point(point(row, column));
        }
    }
    let bottom = surface.point(center - out * Vec3::Y);
    let at = |row: u32, column: u32| match row {
        0 => top,
        r if r == rows => bottom,
        r => first + (r - 1) * columns + column % columns,
    };
    for row in 0..rows {
        for column in 0..columns {
            let [p, q, s, t] = [
                at(row, column),
                at(row + 1, column),
                at(row + 1, column + 1),
                at(row, column + 1),
            ];
            if q != s {
                surface.face([p, q, s]);
            }
            if p != t {
                surface.face([p, s, t]);
            }
        }
    }
    surface.mesh("sphere")
}

#[derive(Default)]
struct Surface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    fn point(&mut self, p: Vec3) -> u32 {
        self.positions.push(p);
        self.positions.len() as u32 - 1
    }

    fn face(&mut self, corners: [u32; 3]) {
        self.triangles.push(corners);
    }

    /// `n` corners around `center`, counter-clockwise seen from u x v; the number of the first.
    fn circle(&mut self, center: Vec3, u: Vec3, v: Vec3, radius: f32, n: u32) -> u32 {
        let first = self.positions.len() as u32;
        let out = radius * outwards(n);
        for i in 0..n {
            let (sin, cos) = (2.0 * PI * i as f32 / n as f32).sin_cos();
            self.point(center + out * (cos * u + sin * v));
        }
        first
    }

    /// Triangles from a circle to `tip`; `turned` if they look the other way.
    fn fan(&mut self, first: u32, n: u32, tip: Vec3, turned: bool) {
        let tip = self.point(tip);
        for i in 0..n {
            let (a, b) = (first + i, first + (i + 1) % n);
            self.face(if turned { [b, a, tip] } else { [a, b, tip] });
        }
    }

    fn mesh(self, name: &str) -> Mesh {
        Mesh::new(name, self.positions, self.triangles, MaterialId(0))
    }
}

#[cfg(test)]
mod tests {
    use llsr_scene::Adjacency;

    use super::*;

    fn volume(mesh: &Mesh) -> f32 {
        (0..mesh.triangles.len())
            .map(|i| {
                let [a, b, c] = mesh.corners(i);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    #[test]
    fn closed_shapes_look_outwards_and_keep_their_volume() {
        let axis = Vec3::new(0.3, 1.0, -0.4);
        let length = axis.length();
        let shapes = [
            (
                Shape::Sphere {
                    center: Vec3::ONE,
                    radius: 0.5,
                },
                4.0 / 3.0 * PI * 0.125,
            ),
            (
                Shape::Cylinder {
                    a: Vec3::ONE,
                    b: Vec3::ONE + axis,
                    radius: 0.5,
                    capped: true,
                },
                PI * 0.25 * length,
            ),
            (
                Shape::Cone {
                    base: Vec3::ONE,
                    apex: Vec3::ONE + axis,
                    radius: 0.5,
                    capped: true,
                },
                PI * 0.25 * length / 3.0,
            ),
        ];
        for (shape, expected) in shapes {
            let mesh = tessellate(&shape, 1e-4);
            let adjacency = Adjacency::new(&mesh.positions, &mesh.triangles);
            assert!(
                adjacency.is_closed() && adjacency.degenerate_faces == 0,
                "{shape:?}"
            );
            let found = volume(&mesh);
            assert!(
                (found / expected - 1.0).abs() < 1e-3,
                "{shape:?}: {found} of {expected}"
            );
        }
    }

    #[test]
    fn spheres_keep_the_tolerance_and_sizes_are_bounded() {
        let (center, radius) = (Vec3::new(1.0, 2.0, 3.0), 0.7);
        for tolerance in [1e-2, 1e-3] {
            let mesh = tessellate(&Shape::Sphere { center, radius }, tolerance);
            for i in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(i);
                for p in [a, 0.5 * (a + b), 0.5 * (b + c), (a + b + c) / 3.0] {
                    let off = (p.distance(center) - radius).abs();
                    assert!(off < 1.05 * tolerance, "{off} off with tolerance {tolerance}");
                }
            }
        }
        for tolerance in [0.0, f32::NAN, f32::INFINITY] {
            let normal = Vec3::Y;
            let disc = tessellate(
                &Shape::Disc {
                    center,
                    normal,
                    radius,
                },
                tolerance,
            );
            assert!(
                (1..=512).contains(&disc.triangles.len()),
                "{}",
                disc.triangles.len()
            );
        }
    }
}
