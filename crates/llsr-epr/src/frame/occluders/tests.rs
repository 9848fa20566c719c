//! What is hidden, against the nearest piece along rays.

use glam::{DVec2, Vec4};
use llsr_scene::{Material, MaterialId, Mesh};

use super::*;

const VIEWPORT: Viewport = Viewport {
    width: 100,
    height: 60,
};

/// Looks along -z from the origin; a point at depth 1 within [-1, 1] is in the picture.
fn matrix() -> Mat4 {
    Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::new(0.0, 0.0, 0.0, -1.0), Vec4::ZERO)
}

fn numbers(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }
}

/// Depth at which the ray through a place of the picture (pixels) first meets a triangle.
fn first(triangles: &[[DVec3; 3]], place: DVec2) -> f64 {
    let direction = DVec3::new(
        place.x / f64::from(VIEWPORT.width) * 2.0 - 1.0,
        1.0 - place.y / f64::from(VIEWPORT.height) * 2.0,
        -1.0,
    );
    let hit = |&[a, b, c]: &[DVec3; 3]| {
        let (u, v) = (b - a, c - a);
        let across = direction.cross(v);
        let determinant = u.dot(across);
        let s = (-a).dot(across) / determinant;
        let t = direction.dot((-a).cross(u)) / determinant;
        let depth = v.dot((-a).cross(u)) / determinant;
        // Rays along the seams of a mesh must not slip through.
        let inside = s >= -1e-6 && t >= -1e-6 && s + t <= 1.0 + 1e-6 && depth > 0.0;
        if inside { depth } else { f64::INFINITY }
    };
    triangles.iter().map(hit).fold(f64::INFINITY, f64::min)
}

#[test]
fn nothing_beyond_the_depths_of_cells_is_seen() {
    let mut next = numbers(11);
    let mut covered = 0;
    for _ in 0..60 {
        let mut scene = Scene::new("pieces");
        let mut triangles = Vec::new();
        scene.add_material(Material::diffuse("grey", Vec3::ONE));
        for i in 0..4 {
            let middle = Vec3::new(next(), next(), -2.0 - next()) * 2.0;
            let (along, across) = (
                Vec3::new(next(), next(), next()) * 4.0,
                Vec3::new(next(), next(), next()) * 4.0,
            );
            let corners = [
                middle - along,
                middle + along,
                middle + along + across,
                middle - along + across,
            ];
            let mesh = Mesh::quad(format!("{i}"), corners, MaterialId::from(0));
            triangles.extend((0..2).map(|k| mesh.corners(k).map(|p| p.as_dvec3())));
            scene.add_mesh(mesh);
        }
        let mut occluders = Occluders::new(&scene);
        let depths = occluders.update(&matrix(), VIEWPORT, |_| Affine3A::IDENTITY);
        for (cell, &depth) in depths.iter().enumerate() {
            if depth == f32::INFINITY {
                continue;
            }
            covered += 1;
            let corner = DVec2::new((cell % 25) as f64, (cell / 25) as f64) * CELL as f64;
            for _ in 0..8 {
                let place = corner + DVec2::new(f64::from(next()), f64::from(next())) * 2.0 + 2.0;
                let seen = first(&triangles, place);
                assert!(
                    seen <= f64::from(depth),
                    "beyond {depth} in cell {cell} there is {seen} at {place}"
                );
            }
        }
    }
    assert!(covered > 1000, "{covered} cells were covered");
}

#[test]
fn a_wall_of_many_triangles_hides_all_behind_it() {
    let mut scene = Scene::new("wall");
    scene.add_material(Material::diffuse("grey", Vec3::ONE));
    let corner = |x: i32, y: i32| Vec3::new(0.5 * x as f32, 0.5 * y as f32, -2.0);
    let mut mesh = Mesh::default();
    for y in -6..6 {
        for x in -6..6 {
            let quad = [
                corner(x, y),
                corner(x + 1, y),
                corner(x + 1, y + 1),
                corner(x, y + 1),
            ];
            mesh.append(&Mesh::quad("", quad, MaterialId::from(0)));
        }
    }
    scene.add_mesh(mesh);
    let mut occluders = Occluders::new(&scene);
    assert_eq!(occluders.pieces.len(), 1, "one wall");
    let depths = occluders.update(&matrix(), VIEWPORT, |_| Affine3A::IDENTITY);
    assert_eq!(depths.len(), 25 * 15, "cells of 100x60 pixels");
    for &depth in depths {
        assert!((2.0..2.01).contains(&depth), "{depth} for a wall at 2");
    }
    // Moved behind the eye it hides nothing.
    let depths = occluders.update(&matrix(), VIEWPORT, |_| Affine3A::from_translation(Vec3::Z * 5.0));
    assert!(
        depths.iter().all(|&depth| depth == f32::INFINITY),
        "behind the eye"
    );
}
