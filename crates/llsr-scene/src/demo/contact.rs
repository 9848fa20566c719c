//! A torus that leans on a capsule: after figure 9 of Bala, Walter & Greenberg 2003.

use glam::{Affine3A, DVec3, Mat3, Quat, Vec2, Vec3};

use super::solid::{arc, lathe, put, torus};
use crate::{Camera, FieldOfView, LinearLight, Material, Mesh, Scene};

/// Radius of the capsule, of the torus's centre line and of its tube (m).
const CAPSULE: f32 = 0.55;
const RING: f32 = 0.82;
const TUBE: f32 = 0.17;
/// How deep the two run into each other and into the floor (m), so that no light passes where they touch.
const SUNK: f32 = 0.002;

/// A torus that stands on the floor and leans on a lying capsule, under one tube.
///
/// Towards the contact the shadow's umbral and penumbral boundaries run together and the shadow hardens. Round bodies that
/// touch have their boundary a little beside the contact: at r tan(e / 2) under a tube of radius r, for light that comes at
/// an angle e from the surface, where it is r (1 - cos e) below what casts it. With the floor there are 30,000 triangles.
pub(super) fn torus_capsule() -> Scene {
    let mut scene = Scene::default();
    let mut paint = |name: &str, color: [f32; 3], roughness| {
        scene.add_material(Material {
            roughness,
            ..Material::diffuse(name, color.into())
        })
    };
    let floor = paint("floor", [0.66, 0.64, 0.60], 1.0);
    let red = paint("red", [0.68, 0.16, 0.10], 0.35);
    let cream = paint("cream", [0.80, 0.72, 0.55], 0.5);
    let half = 4.0;
    let corners = [
        Vec3::new(-half, 0.0, -half),
        Vec3::new(-half, 0.0, half),
        Vec3::new(half, 0.0, half),
        Vec3::new(half, 0.0, -half),
    ];
    scene.add_mesh(Mesh::quad("floor", corners, floor));

    // The capsule lies along x. 35 parts for each cap and 4 for the mantle; 2 n for a part, n at the tips.
    let straight = 0.9;
    let profile: Vec<Vec2> = arc(Vec2::new(0.0, -straight), CAPSULE, -90.0, 0.0, 35)
        .chain((1..4).map(|i| Vec2::new(CAPSULE, straight * (0.5 * i as f32 - 1.0))))
        .chain(arc(Vec2::new(0.0, straight), CAPSULE, 0.0, 90.0, 35))
        .collect();
    let lie = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
    let axis_height = CAPSULE - SUNK;
    let mut capsule = Mesh {
        name: "capsule".to_owned(),
        ..Mesh::default()
    };
    put(
        &mut capsule,
        &lathe(&profile, 96, 60.0, cream),
        Affine3A::from_rotation_translation(lie, Vec3::new(0.0, axis_height, 0.0)),
    );
    scene.add_mesh(capsule);

    // Seen along x the torus is two discs. The lower one stands on the floor, in front; the upper one touches the capsule,
    // square to the line between the two: the ring is a tangent of the circle that is a tube wider than the capsule.
    let reach = CAPSULE + TUBE - SUNK;
    let low = TUBE - SUNK;
    let from_axis = (reach * reach + 4.0 * RING * RING).sqrt();
    let foot = Vec3::new(
        0.0,
        low,
        (from_axis * from_axis - (axis_height - low).powi(2)).sqrt(),
    );
    let to_axis = Vec3::new(0.0, axis_height, 0.0) - foot;
    let lift = (reach / from_axis).asin();
    let up = Quat::from_rotation_x(lift) * to_axis.normalize();
    let axis = Vec3::X.cross(up);
    let turn = Quat::from_mat3(&Mat3::from_cols(Vec3::X, axis, Vec3::X.cross(axis)));
    let mut ring = Mesh {
        name: "torus".to_owned(),
        ..Mesh::default()
    };
    put(
        &mut ring,
        &torus(RING, TUBE, 131, 61, red),
        Affine3A::from_rotation_translation(turn.normalize(), foot + RING * up + Vec3::X * 0.12),
    );
    scene.add_mesh(ring);

    let (a, b) = (DVec3::new(-2.6, 2.6, 0.9), DVec3::new(-2.0, 3.2, 2.1));
    scene.add_light(LinearLight::new("tube", a, b, 9_000.0));
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(3.3, 2.7, 2.3),
        DVec3::new(0.12, 0.42, 0.42),
        DVec3::Y,
        FieldOfView::vertical_degrees(38.0),
    ));
    scene
}
