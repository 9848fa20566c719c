//! The glossy shader against reflections that are known.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use llsr_scene::{LinearLight, Material, Mesh, PointLight, Primitive, Scene, Shape, Viewport, demo};
use llsr_shading::{GlossySettings, GlossyShader, Place, Settings, ShadeRequest, Shader, World, render};
use llsr_tracer::Tracer;

use crate::support::{MOVABLE, placed, requests, room, shade, shade_in_pieces, world};

fn still(scene: Scene) -> Arc<World> {
    Arc::new(World::new(Arc::new(scene), &[]).0)
}

#[test]
fn without_reflections_it_is_the_tile_renderer() {
    let scene = demo::build("sphere-and-friends").expect("built in");
    let view = Viewport {
        width: 24,
        height: 24,
    };
    let (tracer, _) = Tracer::new(&scene);
    let settings = Settings {
        glossy: true,
        ..Settings::default()
    };
    let picture = render(&scene, &tracer, &scene.cameras[0], view, &settings, &|| true).expect("not stopped");
    let rays = requests(&scene, view);
    let settings = GlossySettings {
        reflections: 0,
        ..GlossySettings::default()
    };
    let (points, _) = shade(&GlossyShader::new(still(scene), &settings), &rays, 0);
    for point in &points {
        let expected = picture.film.channel("G").expect("a picture")[point.id as usize];
        assert!(
            (point.colour.y - expected).abs() <= 1e-4 * expected + 1e-6,
            "{point:?} for {expected}"
        );
    }
}

/// In a perfectly white, closed metal sphere every reflection has the radiance of the emission again, once for each time that
/// rays may be reflected; rough metals lose what single scattering loses.
#[test]
fn reflections_in_a_shining_sphere_are_a_series() {
    let mut scene = Scene::new("shining sphere");
    let mirror = scene.add_material(Material {
        metallic: 1.0,
        roughness: 0.1,
        emission: Vec3::new(3.0, 2.0, 1.0),
        ..Material::diffuse("mirror", Vec3::ONE)
    });
    let shape = Shape::Sphere {
        center: Vec3::ZERO,
        radius: 1.0,
    };
    scene.add_primitive(
        "sphere",
        Primitive {
            shape,
            material: mirror,
        },
    );
    let world = still(scene);
    let ray = ShadeRequest {
        id: 0,
        origin: DVec3::new(0.1, 0.2, 0.0),
        direction: DVec3::new(0.3, -1.0, 0.4),
    };
    for reflections in 0..4u32 {
        let settings = GlossySettings {
            rays: 64,
            reflections,
            ..GlossySettings::default()
        };
        let (points, _) = shade(&GlossyShader::new(Arc::clone(&world), &settings), &[ray], 1);
        let expected = Vec3::new(3.0, 2.0, 1.0) * (1 + reflections) as f32;
        let off = (points[0].colour / expected - 1.0).abs().max_element();
        assert!(off < 0.01, "{reflections}: {} for {expected}", points[0].colour);
    }
}

/// A mirror on the floor shows a red wall as the eye would see it from behind the mirror.
#[test]
fn a_mirror_shows_what_stands_before_it() {
    let mut scene = Scene::new("mirror");
    let mirror = scene.add_material(Material {
        metallic: 1.0,
        roughness: 0.02,
        ..Material::diffuse("mirror", Vec3::ONE)
    });
    let red = scene.add_material(Material::diffuse("red", Vec3::new(0.8, 0.1, 0.1)));
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let floor = [
        p(-4.0, 0.0, 4.0),
        p(4.0, 0.0, 4.0),
        p(4.0, 0.0, -2.0),
        p(-4.0, 0.0, -2.0),
    ];
    scene.add_mesh(Mesh::quad("floor", floor, mirror));
    let wall = [
        p(-4.0, 0.0, -2.0),
        p(4.0, 0.0, -2.0),
        p(4.0, 4.0, -2.0),
        p(-4.0, 4.0, -2.0),
    ];
    scene.add_mesh(Mesh::quad("wall", wall, red));
    // Far behind the viewer, so that its own reflection lies elsewhere.
    let (a, b) = (DVec3::new(-1.0, 3.5, 9.0), DVec3::new(1.0, 3.5, 9.0));
    scene.add_light(LinearLight::new("tube", a, b, 5000.0));
    let world = still(scene);
    let settings = GlossySettings {
        rays: 32,
        ambient: Vec3::splat(10.0),
        ..GlossySettings::default()
    };
    let shader = GlossyShader::new(world, &settings);
    let eye = DVec3::new(0.0, 1.5, 3.0);
    for x in [-0.5, 0.3] {
        let place = DVec3::new(x, 0.0, 0.2);
        let towards = place - eye;
        let reflected = DVec3::new(towards.x, -towards.y, towards.z);
        let ray = |id, origin, direction| ShadeRequest {
            id,
            origin,
            direction,
        };
        let (points, met) = shade(
            &shader,
            &[ray(0, eye, towards), ray(1, place + DVec3::Y * 1e-9, reflected)],
            0,
        );
        let (in_mirror, direct) = (points[0].colour, points[1].colour);
        assert!(
            (in_mirror / direct - 1.0).abs().max_element() < 0.03,
            "{in_mirror} for {direct}"
        );
        assert_eq!(met.objects.len(), 2, "floor and wall");
    }
}

#[test]
fn reflected_ambient_light_falls_on_diffuse_lobes_only() {
    let mut scene = Scene::new("two plates");
    let metal = scene.add_material(Material {
        metallic: 1.0,
        ..Material::diffuse("metal", Vec3::splat(0.9))
    });
    let paint = scene.add_material(Material::diffuse("paint", Vec3::splat(0.5)));
    let p = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    scene.add_mesh(Mesh::quad(
        "metal",
        [p(-1.0, 1.0), p(0.0, 1.0), p(0.0, -1.0), p(-1.0, -1.0)],
        metal,
    ));
    scene.add_mesh(Mesh::quad(
        "paint",
        [p(0.0, 1.0), p(1.0, 1.0), p(1.0, -1.0), p(0.0, -1.0)],
        paint,
    ));
    scene.add_light(PointLight {
        name: "off".into(),
        position: DVec3::Y,
        flux: 0.0,
        color: Vec3::ONE,
    });
    let settings = GlossySettings {
        ambient: Vec3::splat(std::f32::consts::PI),
        ..GlossySettings::default()
    };
    let down = |id, x| ShadeRequest {
        id,
        origin: DVec3::new(x, 1.0, 0.1),
        direction: DVec3::NEG_Y,
    };
    let (points, _) = shade(
        &GlossyShader::new(still(scene), &settings),
        &[down(0, -0.5), down(1, 0.5)],
        0,
    );
    assert_eq!(points[0].colour, Vec3::ZERO, "metal has no diffuse lobe");
    let expected = 0.5 * 0.96;
    assert!(
        (points[1].colour.y - expected).abs() < 1e-5,
        "{points:?} for {expected}"
    );
}

#[test]
fn points_do_not_depend_on_the_batch_and_changes_are_followed() {
    let mut scene = room();
    scene.materials[0].roughness = 0.3;
    scene.materials[1].metallic = 0.8;
    let rays = requests(
        &scene,
        Viewport {
            width: 16,
            height: 12,
        },
    );
    let first = world(scene.clone());
    let shader = GlossyShader::new(Arc::clone(&first), &GlossySettings::default());
    let (whole, _) = shade(&shader, &rays, 7);
    assert_eq!(
        whole,
        shade_in_pieces(&shader, &rays, 7),
        "the same points, bit by bit"
    );
    let (other_seed, _) = shade(&shader, &rays, 8);
    assert!(
        whole != other_seed,
        "reflections are sampled anew for another seed"
    );
    let to = placed(0.4, -0.9, 0.8, 0.2);
    shader.changed(
        &first
            .moved(&[Place::Object(MOVABLE[1], to)])
            .expect("a good place"),
    );
    let (after, _) = shade(&shader, &rays, 7);
    scene.objects[MOVABLE[1].index()].transform = to;
    let fresh = GlossyShader::new(world(scene), &GlossySettings::default());
    assert_eq!(after, shade(&fresh, &rays, 7).0, "as good as new");
}
