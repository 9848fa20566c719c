//! Triangles that show an analytic primitive to programs that do not know it.

use std::f32::consts::{PI, TAU};

use glam::Vec3;
use llsr_scene::{MaterialId, Mesh, Shape};

/// Segments of a full circle.
const SEGMENTS: u32 = 48;

/// Rings of a sphere from pole to pole.
const RINGS: u32 = 24;

/// A mesh with normals, inscribed in `shape` and oriented outwards.
pub(super) fn tessellate(shape: &Shape, material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    match *shape {
        Shape::Sphere { center, radius } => {
            let frame = Frame::new(Vec3::Y);
            let profile: Vec<[f32; 4]> = (0..=RINGS)
                .map(|ring| {
                    // Exact at the poles, where the ring is one point.
                    let (sin, cos) = match ring {
                        0 => (0.0, 1.0),
                        RINGS => (0.0, -1.0),
                        _ => (PI * ring as f32 / RINGS as f32).sin_cos(),
                    };
                    [radius * sin, -radius * cos, sin, -cos]
                })
                .collect();
            revolve(&mut mesh, center, &frame, &profile);
        }
        Shape::Cylinder { a, b, radius, capped } => {
            let frame = Frame::new(b - a);
            let height = a.distance(b);
            revolve(
                &mut mesh,
                a,
                &frame,
                &[[radius, 0.0, 1.0, 0.0], [radius, height, 1.0, 0.0]],
            );
            if capped {
                disc(&mut mesh, a, &Frame::new(a - b), radius);
                disc(&mut mesh, b, &frame, radius);
            }
        }
        Shape::Cone {
            base,
            apex,
            radius,
            capped,
        } => {
            let frame = Frame::new(apex - base);
            let height = base.distance(apex);
            let slant = height.hypot(radius);
            let (out, up) = (height / slant, radius / slant);
            revolve(
                &mut mesh,
                base,
                &frame,
                &[[radius, 0.0, out, up], [0.0, height, out, up]],
            );
            if capped {
                disc(&mut mesh, base, &Frame::new(base - apex), radius);
            }
        }
        Shape::Disc {
            center,
            normal,
            radius,
        } => disc(&mut mesh, center, &Frame::new(normal), radius),
    }
    // Poles and tips make triangles of two points.
    let positions = &mesh.positions;
    mesh.triangles.retain(|&[a, b, c]| {
        let [a, b, c] = [a, b, c].map(|v| positions[v as usize]);
        a != b && b != c && c != a
    });
    mesh.materials = vec![material; mesh.triangles.len()];
    mesh
}

/// An axis and two directions across, right-handed in the order `u`, `v`, `axis`.
struct Frame {
    u: Vec3,
    v: Vec3,
    axis: Vec3,
}

impl Frame {
    fn new(axis: Vec3) -> Self {
        let axis = axis.normalize_or(Vec3::Y);
        let (u, v) = axis.any_orthonormal_pair();
        let v = if u.cross(v).dot(axis) < 0.0 { -v } else { v };
        Self { u, v, axis }
    }

    fn around(&self, segment: u32) -> Vec3 {
        // The last segment ends exactly where the first one starts.
        let (sin, cos) = (TAU * (segment % SEGMENTS) as f32 / SEGMENTS as f32).sin_cos();
        self.u * cos + self.v * sin
    }
}

/// Turns a profile of (radius, height, normal outwards, normal upwards) around the axis through `base`.
fn revolve(mesh: &mut Mesh, base: Vec3, frame: &Frame, profile: &[[f32; 4]]) {
    let start = mesh.positions.len() as u32;
    for &[radius, height, out, up] in profile {
        for segment in 0..=SEGMENTS {
            let around = frame.around(segment);
            mesh.positions.push(base + around * radius + frame.axis * height);
            mesh.normals.push((around * out + frame.axis * up).normalize());
        }
    }
    let row = SEGMENTS + 1;
    for ring in 0..profile.len() as u32 - 1 {
        for segment in 0..SEGMENTS {
            let a = start + ring * row + segment;
            let (b, c, d) = (a + 1, a + row + 1, a + row);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

fn disc(mesh: &mut Mesh, center: Vec3, frame: &Frame, radius: f32) {
    let start = mesh.positions.len() as u32;
    mesh.positions.push(center);
    mesh.positions
        .extend((0..SEGMENTS).map(|segment| center + frame.around(segment) * radius));
    mesh.normals
        .extend(std::iter::repeat_n(frame.axis, SEGMENTS as usize + 1));
    let rim = |segment: u32| start + 1 + segment % SEGMENTS;
    mesh.triangles
        .extend((0..SEGMENTS).map(|segment| [start, rim(segment), rim(segment + 1)]));
}

#[cfg(test)]
mod tests {
    use llsr_scene::Adjacency;

    use super::*;

    fn shapes() -> [Shape; 4] {
        let (a, b) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.5, 2.0, 5.0));
        [
            Shape::Sphere {
                center: a,
                radius: 0.5,
            },
            Shape::Cylinder {
                a,
                b,
                radius: 0.3,
                capped: true,
            },
            Shape::Cone {
                base: a,
                apex: b,
                radius: 0.3,
                capped: true,
            },
            Shape::Disc {
                center: a,
                normal: Vec3::Z,
                radius: 0.7,
            },
        ]
    }

    #[test]
    fn bodies_look_outwards_and_fill_the_shape() {
        for shape in shapes() {
            let mesh = tessellate(&shape, MaterialId(3));
            assert!(mesh.is_valid(), "{shape:?}");
            for (index, triangle) in mesh.triangles.iter().enumerate() {
                let [a, b, c] = mesh.corners(index);
                let face = (b - a).cross(c - a);
                let shading: Vec3 = triangle.iter().map(|&v| mesh.normals[v as usize]).sum();
                assert!(
                    face.dot(shading) > 0.0,
                    "{shape:?}: triangle {index} and its normals agree"
                );
            }
        }
        let volume = |shape: &Shape| -> f64 {
            let mesh = tessellate(shape, MaterialId(0));
            (0..mesh.triangles.len())
                .map(|i| mesh.corners(i).map(|p| p.as_dvec3()))
                .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
                .sum()
        };
        let height = (0.25f64 + 4.0).sqrt();
        let [sphere, cylinder, cone, _] = shapes();
        let wants = [
            (sphere, 4.0 / 3.0 * std::f64::consts::PI * 0.125),
            (cylinder, std::f64::consts::PI * 0.09 * height),
            (cone, std::f64::consts::PI * 0.03 * height),
        ];
        for (shape, want) in wants {
            let ratio = volume(&shape) / want;
            assert!(
                (0.985..1.0).contains(&ratio),
                "{shape:?}: inscribed, ratio {ratio}"
            );
        }
    }

    #[test]
    fn bounds_are_those_of_the_shape() {
        for shape in shapes() {
            let (mesh, exact) = (tessellate(&shape, MaterialId(0)).bounds(), shape.bounds());
            let error = (mesh.min - exact.min)
                .abs()
                .max((mesh.max - exact.max).abs())
                .max_element();
            assert!(error < 0.01, "{shape:?}: {error}");
        }
    }

    #[test]
    fn a_sphere_has_no_gap() {
        let shape = Shape::Sphere {
            center: Vec3::new(3.0, -1.0, 0.5),
            radius: 1.0,
        };
        let mesh = tessellate(&shape, MaterialId(0));
        let adjacency = Adjacency::new(&mesh.positions, &mesh.triangles);
        assert!(adjacency.is_closed(), "{} open edges", adjacency.boundary_edges);
    }
}
