//! A tube over a matte floor: figures 5 and 6 of Ouellette & Fiume 1999.

use glam::{DVec3, Vec3};

use crate::{Camera, FieldOfView, LinearLight, Material, MaterialId, Mesh, Primitive, Scene, Shape};

fn floor(scene: &mut Scene, half: Vec3) -> MaterialId {
    let matte = scene.add_material(Material::diffuse("matte", Vec3::splat(0.75)));
    let corners = [
        Vec3::new(-half.x, 0.0, -half.z),
        Vec3::new(-half.x, 0.0, half.z),
        Vec3::new(half.x, 0.0, half.z),
        Vec3::new(half.x, 0.0, -half.z),
    ];
    scene.add_mesh(Mesh::quad("floor", corners, matte));
    matte
}

/// A light at the back, hidden on the left by a wall that runs out of the picture.
///
/// Every floor point in front of the wall sees the light from its right end up to the wall's upright edge: at
/// most one change of visibility.
pub(super) fn wall() -> Scene {
    let mut scene = Scene::default();
    let matte = floor(&mut scene, Vec3::new(40.0, 0.0, 40.0));
    let wall = [
        Vec3::new(-40.0, 0.0, -4.0),
        Vec3::new(-1.0, 0.0, -4.0),
        Vec3::new(-1.0, 30.0, -4.0),
        Vec3::new(-40.0, 30.0, -4.0),
    ];
    scene.add_mesh(Mesh::quad("wall", wall, matte));
    let (a, b) = (DVec3::new(-9.0, 3.0, -8.0), DVec3::new(9.0, 3.0, -8.0));
    scene.add_light(LinearLight::new("tube", a, b, 60_000.0));
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(0.0, 9.0, 11.0),
        DVec3::new(0.0, 0.0, 0.5),
        DVec3::Y,
        FieldOfView::vertical_degrees(42.0),
    ));
    scene
}

/// A light of length 50 whose middle is 21 units from the foot of an upright cylinder, at 45 degrees.
///
/// The cylinder is convex and the floor is flat, so that no visible point has more than two changes.
pub(super) fn cylinder(radius: f32) -> Scene {
    let mut scene = Scene::default();
    let matte = floor(&mut scene, Vec3::new(30.0, 0.0, 30.0));
    let shape = Shape::Cylinder {
        a: Vec3::ZERO,
        b: Vec3::new(0.0, 12.0, 0.0),
        radius,
        capped: true,
    };
    scene.add_primitive(
        "cylinder",
        Primitive {
            shape,
            material: matte,
        },
    );
    // Seen from the camera, the light is above and behind the upper right edge of the floor.
    let away = DVec3::new(1.0, 0.0, -1.0).normalize();
    let along = DVec3::new(1.0, 0.0, 1.0).normalize();
    let middle = 21.0 * 0.5f64.sqrt() * (away + DVec3::Y);
    scene.add_light(LinearLight::new(
        "tube",
        middle - 25.0 * along,
        middle + 25.0 * along,
        400_000.0,
    ));
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(-6.0, 26.0, 34.0),
        DVec3::new(-2.0, 2.0, 1.0),
        DVec3::Y,
        FieldOfView::vertical_degrees(38.0),
    ));
    scene
}
