//! A chain of tori that crosses itself: after figure 7 of Bala, Walter & Greenberg 2003.

use glam::{Affine3A, DVec3, Quat, Vec3};

use super::solid::torus;
use crate::{Camera, FieldOfView, Geometry, LinearLight, Material, MaterialId, Mesh, MeshId, Object, Scene};

/// Links of the chain; even, so that the turned ones alternate all the way round.
pub(super) const LINKS: usize = 32;
/// Radius of a link's centre line, and of its wire (m).
pub(super) const RADIUS: f32 = 2.4;
pub(super) const WIRE: f32 = 0.52;
/// Distance between the centres of neighbours along the chain (m): just too short for them to touch.
const PITCH: f32 = 2.0 * (RADIUS - WIRE) - 0.35;
/// 32 links of this many parts around and across are the paper's 73,728 triangles.
const AROUND: u32 = 48;
const ACROSS: u32 = 24;

/// The chain runs in a figure of eight, one strand over the other where it crosses.
fn curve(t: f32, size: f32) -> Vec3 {
    Vec3::new(size * t.sin(), 7.6 + 3.4 * t.cos(), 0.46 * size * (2.0 * t).sin())
}

/// Points at equal distances along the closed curve, and its length.
fn spread(size: f32, count: usize) -> (Vec<Vec3>, f32) {
    const STEPS: usize = 8192;
    let at = |i: usize| curve(std::f32::consts::TAU * (i % STEPS) as f32 / STEPS as f32, size);
    let mut along = vec![0.0f32];
    for i in 0..STEPS {
        along.push(along[i] + at(i).distance(at(i + 1)));
    }
    let length = along[STEPS];
    let points = (0..count).map(|k| {
        let wanted = length * k as f32 / count as f32;
        let after = along.partition_point(|&x| x <= wanted).clamp(1, STEPS);
        let share = (wanted - along[after - 1]) / (along[after] - along[after - 1]);
        at(after - 1).lerp(at(after), share)
    });
    (points.collect(), length)
}

/// Where the links are; a link's axis is the y axis of its frame.
pub(super) fn places() -> Vec<Affine3A> {
    // The length grows with the size of the curve.
    let (mut low, mut high) = (5.0, 60.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if spread(middle, 1).1 < PITCH * LINKS as f32 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (points, _) = spread(low, LINKS);
    (0..LINKS)
        .map(|k| {
            let tangent = (points[(k + 1) % LINKS] - points[(k + LINKS - 1) % LINKS]).normalize();
            let up = Vec3::Y.reject_from_normalized(tangent).normalize();
            // Neighbours are at right angles, both oblique, so that none is seen edge-on from below.
            let side = tangent.cross(up) * if k % 2 == 0 { 1.0 } else { -1.0 };
            let axis = (up + side).normalize();
            let turn = Quat::from_mat3(&glam::Mat3::from_cols(axis.cross(tangent), axis, tangent));
            Affine3A::from_rotation_translation(turn.normalize(), points[k])
        })
        .collect()
}

/// 32 interlocking links over a floor, under two tubes.
pub(super) fn chains() -> Scene {
    let mut scene = Scene::default();
    let floor = scene.add_material(Material::diffuse("floor", Vec3::new(0.60, 0.58, 0.54)));
    let (x, z) = (46.0, 34.0);
    let corners = [
        Vec3::new(-x, 0.0, -z),
        Vec3::new(-x, 0.0, z),
        Vec3::new(x, 0.0, z),
        Vec3::new(x, 0.0, -z),
    ];
    scene.add_mesh(Mesh::quad("floor", corners, floor));

    let paint = [
        ("brass", Vec3::new(0.78, 0.52, 0.16)),
        ("steel", Vec3::new(0.56, 0.60, 0.64)),
        ("red", Vec3::new(0.66, 0.14, 0.10)),
        ("blue", Vec3::new(0.14, 0.30, 0.60)),
    ];
    let first = scene.meshes.len();
    for (name, color) in paint {
        let material: MaterialId = scene.add_material(Material {
            roughness: 0.35,
            ..Material::diffuse(name, color)
        });
        let link = torus(RADIUS, WIRE, AROUND, ACROSS, material);
        scene.meshes.push(Mesh {
            name: format!("{name} link"),
            ..link
        });
    }
    for (k, transform) in places().into_iter().enumerate() {
        scene.add_object(Object {
            name: format!("link {}", k + 1),
            geometry: Geometry::Mesh(MeshId::from(first + k % paint.len())),
            transform,
        });
    }
    let light = |name: &str, a: [f64; 3], b: [f64; 3], flux, color: [f32; 3]| {
        let color = Vec3::from_array(color);
        LinearLight {
            color: color / crate::luminance(color),
            ..LinearLight::new(name, DVec3::from_array(a), DVec3::from_array(b), flux)
        }
    };
    scene.add_light(light(
        "warm",
        [-4.0, 30.0, -9.0],
        [6.0, 30.0, -9.0],
        600_000.0,
        [1.0, 0.86, 0.68],
    ));
    scene.add_light(light(
        "cool",
        [30.0, 24.0, 2.0],
        [30.0, 24.0, 12.0],
        400_000.0,
        [0.74, 0.87, 1.0],
    ));
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(12.8, 8.2, -2.0),
        DVec3::new(0.0, 7.2, 0.0),
        DVec3::Y,
        FieldOfView::vertical_degrees(62.0),
    ));
    // The whole eight.
    scene.cameras.push(Camera::look_at(
        "above",
        DVec3::new(30.0, 34.0, 40.0),
        DVec3::new(0.0, 4.0, 0.0),
        DVec3::Y,
        FieldOfView::vertical_degrees(40.0),
    ));
    scene
}
