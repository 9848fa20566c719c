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

/// Radius of the [`hare`] in a unit direction.
pub fn hare_radius(direction: Vec3) -> f32 {
    let bump = |at: Vec3, height: f32, width: f32| {
        height * (-(1.0 - direction.dot(at.normalize())).max(0.0) / width).exp()
    };
    let fur =
        (23.0 * direction.x + 3.0).sin() * (29.0 * direction.y).sin() * (31.0 * direction.z + 1.0).sin();
    0.55 + 0.02 * fur
        + bump(Vec3::new(0.35, 0.9, 0.1), 0.9, 0.012)
        + bump(Vec3::new(0.35, 0.9, -0.35), 0.8, 0.01)
        + bump(Vec3::new(0.9, 0.45, -0.1), 0.3, 0.08)
        + bump(Vec3::new(-1.0, -0.1, 0.0), 0.2, 0.03)
        + bump(Vec3::new(0.3, -1.0, 0.5), 0.15, 0.05)
}

/// A body with a head, two long ears and fur, seen as a whole from its middle (every ray from there crosses it once), of
/// `2 * around * (across - 1)` triangles; closed. The ears reach about 1.5 m.
pub fn hare(around: u32, across: u32, material: MaterialId) -> Mesh {
    let at = |ring: u32, i: u32| {
        let (st, ct) = (0.5 * TAU * ring as f32 / across as f32).sin_cos();
        let (sp, cp) = (TAU * i as f32 / around as f32).sin_cos();
        let direction = Vec3::new(st * cp, ct, st * sp);
        direction * hare_radius(direction)
    };
    let mut positions = vec![at(0, 0), at(across, 0)];
    let vertex = |ring: u32, i: u32| match ring {
        0 => 0,
        _ if ring == across => 1,
        _ => 2 + (ring - 1) * around + i % around,
    };
    let mut triangles = Vec::new();
    for ring in 0..across {
        for i in 0..around {
            let corners = [
                vertex(ring, i),
                vertex(ring, i + 1),
                vertex(ring + 1, i + 1),
                vertex(ring + 1, i),
            ];
            let [a, b, c, d] = corners;
            if ring > 0 {
                positions.push(at(ring, i));
                triangles.push([a, b, c]);
            }
            if ring + 1 < across {
                triangles.push([a, c, d]);
            }
        }
    }
    Mesh::new("hare", positions, triangles, material)
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
