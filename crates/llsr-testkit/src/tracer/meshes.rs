//! Closed meshes by formula, in any number of triangles.

use std::f32::consts::TAU;

use glam::Vec3;
use llsr_scene::{Geometry, MaterialId, Mesh, Scene};

/// A torus around the y axis with radii `major` and `minor` (m), of `2 * around * across` triangles; closed.
pub fn torus(major: f32, minor: f32, around: u32, across: u32, material: MaterialId) -> Mesh {
    grid("torus", around, across, material, |u, v| {
        let (su, cu) = (TAU * u).sin_cos();
        let (sv, cv) = (TAU * v).sin_cos();
        Vec3::new((major + minor * cv) * cu, minor * sv, (major + minor * cv) * su)
    })
}

/// A tube along a (2, 3) torus knot about 2 m across, of `2 * around * across` triangles; closed.
///
/// `bumps` is the height of regular bumps relative to the tube's radius: 0 is smooth, 0.2 is rough.
pub fn bumpy_knot(around: u32, across: u32, bumps: f32, material: MaterialId) -> Mesh {
    let center = |u: f32| {
        let (s3, c3) = (3.0 * TAU * u).sin_cos();
        let (s2, c2) = (2.0 * TAU * u).sin_cos();
        let r = 0.7 + 0.25 * c3;
        Vec3::new(r * c2, 0.35 * s3, r * s2)
    };
    grid("knot", around, across, material, |u, v| {
        let at = center(u);
        let along = (center(u + 1e-3) - center(u - 1e-3)).normalize();
        let side = along.cross(Vec3::Y).normalize();
        let up = side.cross(along);
        let (sv, cv) = (TAU * v).sin_cos();
        let wave = (TAU * 60.0 * u).sin() * (TAU * 9.0 * v).sin();
        let fine = (TAU * 271.0 * u).sin() * (TAU * 31.0 * v).cos();
        let radius = 0.16 * (1.0 + bumps * (0.7 * wave + 0.3 * fine));
        at + (side * cv + up * sv) * radius
    })
}

/// A closed grid, periodic in both directions.
fn grid(name: &str, around: u32, across: u32, material: MaterialId, at: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let mut positions = Vec::with_capacity((around * across) as usize);
    let mut triangles = Vec::with_capacity((2 * around * across) as usize);
    for i in 0..around {
        for j in 0..across {
            positions.push(at(i as f32 / around as f32, j as f32 / across as f32));
            let index = |i: u32, j: u32| (i % around) * across + j % across;
            let [a, b, c, d] = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Mesh::new(name, positions, triangles, material)
}

/// All triangles of the scene's meshes in its recentred frame, in the order of objects.
pub fn world_triangles(scene: &Scene) -> Vec<[Vec3; 3]> {
    let mut all = Vec::new();
    for object in &scene.objects {
        if let Geometry::Mesh(mesh) = object.geometry {
            let mesh = &scene.meshes[mesh.index()];
            all.extend(
                (0..mesh.triangles.len())
                    .map(|i| mesh.corners(i).map(|p| object.transform.transform_point3(p))),
            );
        }
    }
    all
}
