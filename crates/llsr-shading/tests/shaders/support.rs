//! Scenes and requests that the tests share.

use std::sync::Arc;

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_scene::{
    Camera, FieldOfView, LinearLight, Material, Mesh, ObjectId, Primitive, Scene, Shape, Viewport,
};
use llsr_shading::{Encounters, ShadeRequest, ShadedPoint, Shader, ShaderScratch, World};

/// A floor, a wall, a box and a sphere that may move, two tubes.
pub(crate) fn room() -> Scene {
    let mut scene = Scene::new("room");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.6)));
    let red = scene.add_material(Material::diffuse("red", Vec3::new(0.7, 0.2, 0.1)));
    scene.add_mesh(Mesh::cuboid(
        "floor",
        Vec3::new(-3.0, -0.1, -3.0),
        Vec3::new(3.0, 0.0, 3.0),
        grey,
    ));
    scene.add_mesh(Mesh::cuboid(
        "wall",
        Vec3::new(-3.0, 0.0, -3.1),
        Vec3::new(3.0, 3.0, -3.0),
        red,
    ));
    scene.add_mesh(Mesh::cuboid(
        "box",
        Vec3::new(-0.5, 0.5, -0.5),
        Vec3::new(0.5, 0.9, 0.5),
        red,
    ));
    let sphere = Shape::Sphere {
        center: Vec3::ZERO,
        radius: 0.4,
    };
    let id = scene.add_primitive(
        "sphere",
        Primitive {
            shape: sphere,
            material: grey,
        },
    );
    scene.objects[id.index()].transform = Affine3A::from_translation(Vec3::new(1.2, 0.6, 0.3));
    for (name, z, flux) in [("front", 1.0, 3000.0), ("back", -1.5, 2000.0)] {
        let (a, b) = (DVec3::new(-1.0, 2.5, z), DVec3::new(1.0, 2.5, z));
        scene.add_light(LinearLight {
            color: Vec3::new(1.1, 0.98, 0.9),
            ..LinearLight::new(name, a, b, flux)
        });
    }
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(2.0, 2.0, 5.0),
        DVec3::new(0.0, 0.5, 0.0),
        DVec3::Y,
        FieldOfView::vertical_degrees(45.0),
    ));
    scene
}

/// The objects of [`room`] that may move.
pub(crate) const MOVABLE: [ObjectId; 2] = [ObjectId(2), ObjectId(3)];

pub(crate) fn world(scene: Scene) -> Arc<World> {
    let (world, warnings) = World::new(Arc::new(scene), &MOVABLE);
    assert!(warnings.is_empty(), "{warnings:?}");
    Arc::new(world)
}

/// Rays through the centres of all pixels of the first camera's picture.
pub(crate) fn requests(scene: &Scene, viewport: Viewport) -> Vec<ShadeRequest> {
    let camera = &scene.cameras[0];
    (0..viewport.pixels() as u64)
        .map(|id| {
            let (x, y) = (id as u32 % viewport.width, id as u32 / viewport.width);
            let (origin, direction) = camera.ray(viewport, f64::from(x) + 0.5, f64::from(y) + 0.5);
            ShadeRequest {
                id,
                origin,
                direction,
            }
        })
        .collect()
}

pub(crate) fn shade(
    shader: &dyn Shader,
    requests: &[ShadeRequest],
    seed: u64,
) -> (Vec<ShadedPoint>, Encounters) {
    let (mut points, mut met) = (Vec::new(), Encounters::default());
    let mut scratch = ShaderScratch::default();
    let done = shader.shade(requests, seed, &mut scratch, &mut points, &mut met);
    assert_eq!(done, Ok(()), "the rays are good");
    assert_eq!(points.len(), requests.len(), "a point for each ray");
    (points, met)
}

/// Shades in batches of odd sizes, backwards, on several threads at once, and puts the points back in order.
pub(crate) fn shade_in_pieces(shader: &dyn Shader, requests: &[ShadeRequest], seed: u64) -> Vec<ShadedPoint> {
    let pieces: Vec<&[ShadeRequest]> = requests.chunks(37).collect();
    let mut points: Vec<ShadedPoint> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..3usize)
            .map(|worker| {
                let mine: Vec<_> = pieces.iter().rev().skip(worker).step_by(3).collect();
                scope.spawn(move || {
                    let mut points = Vec::new();
                    let mut scratch = ShaderScratch::default();
                    let mut met = Encounters::default();
                    for piece in mine {
                        let done = shader.shade(piece, seed, &mut scratch, &mut points, &mut met);
                        assert_eq!(done, Ok(()), "the rays are good");
                    }
                    points
                })
            })
            .collect();
        workers
            .into_iter()
            .flat_map(|worker| worker.join().expect("no panic"))
            .collect()
    });
    points.sort_by_key(|point| point.id);
    points
}

/// A turn and a shift.
pub(crate) fn placed(angle: f32, x: f32, y: f32, z: f32) -> Affine3A {
    Affine3A::from_rotation_translation(Quat::from_rotation_y(angle), Vec3::new(x, y, z))
}
