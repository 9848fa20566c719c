//! Meshes for edge finding: smooth, rough, many, and entangled.

use std::f32::consts::TAU;

use glam::Vec3;
use llsr_scene::{MaterialId, Mesh};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn unit(random: &mut Pcg64Mcg) -> f32 {
    (random.next_u32() >> 8) as f32 / (1u32 << 24) as f32
}

fn direction(random: &mut Pcg64Mcg) -> Vec3 {
    loop {
        let v = Vec3::from_array(std::array::from_fn(|_| 2.0 * unit(random) - 1.0));
        if (0.01..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// A closed grid of `rows` by `columns` quadrilaterals, wrapped around in both directions.
fn wrapped(rows: u32, columns: u32, point: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let positions = (0..rows * columns)
        .map(|i| {
            point(
                (i / columns) as f32 / rows as f32,
                (i % columns) as f32 / columns as f32,
            )
        })
        .collect();
    let at = |row: u32, column: u32| (row % rows) * columns + column % columns;
    let triangles = (0..rows * columns)
        .flat_map(|i| {
            let (r, c) = (i / columns, i % columns);
            let [p, q, s, t] = [at(r, c), at(r + 1, c), at(r + 1, c + 1), at(r, c + 1)];
            [[p, q, s], [p, s, t]]
        })
        .collect();
    Mesh::new("grid", positions, triangles, MaterialId(0))
}

/// A unit sphere of `rows` by `2 * rows` quadrilaterals whose vertices are moved out by up to `height` at random.
/// Its faces look outwards; the poles are fans.
pub fn bumpy_sphere(rows: u32, height: f32, seed: u64) -> Mesh {
    let random = &mut Pcg64Mcg::seed_from_u64(seed);
    let columns = 2 * rows;
    let mut positions = vec![Vec3::Y, -Vec3::Y];
    for row in 1..rows {
        let polar = 0.5 * TAU * row as f32 / rows as f32;
        for column in 0..columns {
            let around = TAU * column as f32 / columns as f32;
            let p = Vec3::new(
                polar.sin() * around.cos(),
                polar.cos(),
                polar.sin() * around.sin(),
            );
            positions.push(p * (1.0 + height * unit(random)));
        }
    }
    let at = |row: u32, column: u32| match row {
        0 => 0,
        r if r == rows => 1,
        r => 2 + (r - 1) * columns + column % columns,
    };
    let triangles = (0..rows * columns)
        .flat_map(|i| {
            let (r, c) = (i / columns, i % columns);
            let [p, q, s, t] = [at(r, c), at(r, c + 1), at(r + 1, c + 1), at(r + 1, c)];
            [[p, q, s], [p, s, t]]
        })
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect();
    Mesh::new("bumpy sphere", positions, triangles, MaterialId(0))
}

/// A torus around the y axis with the given radii.
pub fn torus(major: f32, minor: f32, rows: u32, columns: u32) -> Mesh {
    wrapped(rows, columns, |u, v| {
        let (around, across) = (TAU * u, TAU * v);
        let out = major + minor * across.cos();
        Vec3::new(out * around.cos(), -minor * across.sin(), out * around.sin())
    })
}

/// A link of a chain that lies along x: a torus stretched by `straight` metres, in the xz plane, or in the xy plane
/// if `upright`.
pub fn chain_link(center: Vec3, straight: f32, upright: bool, rows: u32, columns: u32) -> Mesh {
    let mut mesh = torus(0.5, 0.12, rows, columns);
    for p in &mut mesh.positions {
        p.x += if p.x > 0.0 {
            0.5 * straight
        } else {
            -0.5 * straight
        };
        if upright {
            (p.y, p.z) = (-p.z, p.y);
        }
        *p += center;
    }
    mesh
}

/// Pairs of triangles with random planes around a unit sphere, each with one inner edge: nothing for a tree to hold
/// on to.
pub fn random_roofs(count: u32, size: f32, seed: u64) -> Mesh {
    let random = &mut Pcg64Mcg::seed_from_u64(seed);
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let base = positions.len() as u32;
        let center = direction(random);
        positions.push(center);
        positions.extend((0..3).map(|_| center + size * direction(random)));
        triangles.extend([[base, base + 1, base + 2], [base + 1, base, base + 3]]);
    }
    Mesh::new("roofs", positions, triangles, MaterialId(0))
}

/// `count` cubes with sides of `size` at random places in the unit cube.
pub fn cube_cloud(count: u32, size: f32, seed: u64) -> Mesh {
    let random = &mut Pcg64Mcg::seed_from_u64(seed);
    let mut mesh = Mesh::default();
    for _ in 0..count {
        let corner = Vec3::from_array(std::array::from_fn(|_| unit(random)));
        mesh.append(&Mesh::cuboid("", corner, corner + size, MaterialId(0)));
    }
    mesh
}
