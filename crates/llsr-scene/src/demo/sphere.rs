//! Several objects that cause two changes of visibility: figure 1 of Ouellette & Fiume 1999.

use glam::{Affine3A, DVec3, Quat, Vec3};

use crate::{
    Camera, FieldOfView, Geometry, LinearLight, Material, Mesh, MeshId, Object, Primitive, Scene, Shape,
};

/// A sphere under a tube, shaded by a curved patch of triangles, a turned cube and a cone.
pub(super) fn sphere_and_friends() -> Scene {
    let mut scene = Scene::default();
    let floor = scene.add_material(Material::diffuse("floor", Vec3::new(0.62, 0.6, 0.56)));
    let clay = scene.add_material(Material::diffuse("clay", Vec3::new(0.75, 0.72, 0.68)));
    let red = scene.add_material(Material::diffuse("red", Vec3::new(0.7, 0.18, 0.12)));
    let blue = scene.add_material(Material::diffuse("blue", Vec3::new(0.14, 0.25, 0.6)));
    let green = scene.add_material(Material::diffuse("green", Vec3::new(0.2, 0.5, 0.2)));
    let corners = [
        Vec3::new(-20.0, 0.0, -20.0),
        Vec3::new(-20.0, 0.0, 20.0),
        Vec3::new(20.0, 0.0, 20.0),
        Vec3::new(20.0, 0.0, -20.0),
    ];
    scene.add_mesh(Mesh::quad("floor", corners, floor));
    let shape = Shape::Sphere {
        center: Vec3::new(0.0, 1.2, 0.0),
        radius: 1.2,
    };
    scene.add_primitive(
        "sphere",
        Primitive {
            shape,
            material: clay,
        },
    );

    // A patch bent over the sphere's left shoulder.
    let (columns, rows) = (12u32, 8u32);
    let mut patch = Mesh {
        name: "patch".to_owned(),
        ..Mesh::default()
    };
    for row in 0..=rows {
        for column in 0..=columns {
            let u = column as f32 / columns as f32 - 0.5;
            let v = row as f32 / rows as f32 - 0.5;
            let height = 3.1 + 0.35 * (2.6 * u).cos() - 0.4 * v * v;
            patch
                .positions
                .push(Vec3::new(-1.5 + 1.5 * u, height, 0.2 + 1.3 * v));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let i = row * (columns + 1) + column;
            let below = i + columns + 1;
            patch
                .triangles
                .extend([[i, below, below + 1], [i, below + 1, i + 1]]);
        }
    }
    patch.materials = vec![green; patch.triangles.len()];
    scene.add_mesh(patch);

    scene
        .meshes
        .push(Mesh::cuboid("cube", Vec3::splat(-0.4), Vec3::splat(0.4), blue));
    let turn = Quat::from_rotation_y(0.5) * Quat::from_rotation_x(0.6);
    scene.add_object(Object {
        name: "cube".to_owned(),
        geometry: Geometry::Mesh(MeshId::from(scene.meshes.len() - 1)),
        transform: Affine3A::from_rotation_translation(turn, Vec3::new(-0.35, 3.6, 0.4)),
    });

    let shape = Shape::Cone {
        base: Vec3::new(1.9, 0.0, 1.1),
        apex: Vec3::new(1.9, 2.9, 1.1),
        radius: 0.55,
        capped: true,
    };
    scene.add_primitive("cone", Primitive { shape, material: red });

    let (a, b) = (DVec3::new(-3.5, 5.2, 1.2), DVec3::new(3.5, 5.2, 1.2));
    scene.add_light(LinearLight::new("tube", a, b, 9_000.0));
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(2.4, 4.6, 9.2),
        DVec3::new(0.1, 1.5, 0.2),
        DVec3::Y,
        FieldOfView::vertical_degrees(36.0),
    ));
    scene
}
