//! Many bars between a tube and a floor: the worst case for methods that look for a few changes of visibility.

use glam::{DVec3, Vec3};

use super::solid::block;
use crate::{Camera, FieldOfView, LinearLight, Material, Mesh, Scene};

/// A fence of 64 upright bars before a tube.
///
/// A point of the floor before the fence sees the tube through up to a third of the bars; nearer to them it is fewer, and
/// shadows are harder.
pub(super) fn bars() -> Scene {
    let mut scene = Scene::default();
    let floor = scene.add_material(Material::diffuse("floor", Vec3::splat(0.7)));
    let wood = scene.add_material(Material::diffuse("wood", Vec3::new(0.50, 0.30, 0.16)));
    let half = 6.0;
    let corners = [
        Vec3::new(-half, 0.0, -half),
        Vec3::new(-half, 0.0, half),
        Vec3::new(half, 0.0, half),
        Vec3::new(half, 0.0, -half),
    ];
    scene.add_mesh(Mesh::quad("floor", corners, floor));
    for i in 0..64 {
        let x = 0.1 * (i as f32 - 31.5);
        // A little into the floor, so that no light passes below.
        let bar = block(
            Vec3::new(x - 0.02, -0.01, -1.02),
            Vec3::new(x + 0.02, 1.1, -0.98),
            wood,
        );
        scene.add_mesh(Mesh {
            name: format!("bar {}", i + 1),
            ..bar
        });
    }
    let (a, b) = (DVec3::new(-2.4, 1.3, -2.6), DVec3::new(2.4, 1.3, -2.6));
    scene.add_light(LinearLight::new("tube", a, b, 8_000.0));
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(1.5, 1.9, 1.6),
        DVec3::new(0.2, 0.2, -0.8),
        DVec3::Y,
        FieldOfView::vertical_degrees(46.0),
    ));
    scene
}
