//! Global illumination against closed forms and long random walks that share no code with it.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use llsr_scene::{
    Camera, FieldOfView, Light, LinearLight, Material, Mesh, ObjectId, PointLight, Primitive, Scene, Shape,
    Viewport,
};
use llsr_shading::{GiSettings, GiShader, Place, ShadeRequest, Shader, ShaderScratch, World};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::support::{placed, requests, room, shade, shade_in_pieces, world};

fn unit(random: &mut Pcg64Mcg) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// In a white sphere with a light in its middle all surfaces get E0 / (1 - albedo).
#[test]
fn furnace_is_as_bright_as_the_geometric_series_says() {
    for albedo in [0.3f32, 0.7] {
        let mut scene = Scene::new("furnace");
        let white = scene.add_material(Material::diffuse("white", Vec3::splat(albedo)));
        let shape = Shape::Sphere {
            center: Vec3::ZERO,
            radius: 2.0,
        };
        scene.add_primitive(
            "sphere",
            Primitive {
                shape,
                material: white,
            },
        );
        scene.add_light(PointLight {
            name: "middle".into(),
            position: DVec3::ZERO,
            flux: 1000.0,
            color: Vec3::ONE,
        });
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let rays: Vec<ShadeRequest> = (0..300)
            .map(|id| {
                let mut point = || DVec3::new(unit(&mut random), unit(&mut random), unit(&mut random)) - 0.5;
                ShadeRequest {
                    id,
                    origin: point(),
                    direction: point(),
                }
            })
            .collect();
        let settings = GiSettings {
            bounces: 32,
            ..GiSettings::default()
        };
        let shader = GiShader::new(Arc::new(World::new(Arc::new(scene), &[]).0), &settings);
        let (points, _) = shade(&shader, &rays, 0);
        let albedo = f64::from(albedo);
        let expected = albedo / PI * 1000.0 / (4.0 * PI * 4.0) / (1.0 - albedo);
        let mean = points.iter().map(|point| f64::from(point.colour.y)).sum::<f64>() / 300.0;
        assert!(
            (mean / expected - 1.0).abs() < 0.01,
            "albedo {albedo}: {mean} for {expected}"
        );
        for point in &points {
            let colour = f64::from(point.colour.y);
            assert!(
                (colour / expected - 1.0).abs() < 0.1,
                "albedo {albedo}: {colour} for {expected}"
            );
        }
        let counts = shader.counts();
        assert!(
            counts.alone < 15 && counts.made < 3000,
            "records serve many points: {counts:?}"
        );
    }
}

/// A box with a red and a green wall, two blocks, and a tube under the ceiling.
pub(crate) fn cornell() -> Scene {
    let mut scene = Scene::new("cornell");
    let mut paint = |name: &str, rgb: [f32; 3]| scene.add_material(Material::diffuse(name, Vec3::from(rgb)));
    let white = paint("white", [0.7, 0.7, 0.7]);
    let red = paint("red", [0.6, 0.06, 0.05]);
    let green = paint("green", [0.12, 0.45, 0.1]);
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    for (name, corners, material) in [
        (
            "floor",
            [
                p(-1.0, 0.0, 1.0),
                p(1.0, 0.0, 1.0),
                p(1.0, 0.0, -1.0),
                p(-1.0, 0.0, -1.0),
            ],
            white,
        ),
        (
            "ceiling",
            [
                p(-1.0, 2.0, -1.0),
                p(1.0, 2.0, -1.0),
                p(1.0, 2.0, 1.0),
                p(-1.0, 2.0, 1.0),
            ],
            white,
        ),
        (
            "back",
            [
                p(-1.0, 0.0, -1.0),
                p(1.0, 0.0, -1.0),
                p(1.0, 2.0, -1.0),
                p(-1.0, 2.0, -1.0),
            ],
            white,
        ),
        (
            "left",
            [
                p(-1.0, 0.0, 1.0),
                p(-1.0, 0.0, -1.0),
                p(-1.0, 2.0, -1.0),
                p(-1.0, 2.0, 1.0),
            ],
            red,
        ),
        (
            "right",
            [
                p(1.0, 0.0, -1.0),
                p(1.0, 0.0, 1.0),
                p(1.0, 2.0, 1.0),
                p(1.0, 2.0, -1.0),
            ],
            green,
        ),
    ] {
        scene.add_mesh(Mesh::quad(name, corners, material));
    }
    scene.add_mesh(Mesh::cuboid("tall", p(-0.3, 0.0, -0.3), p(0.3, 1.2, 0.3), white));
    scene.objects[5].transform = placed(0.35, -0.35, 0.0, -0.4);
    scene.add_mesh(Mesh::cuboid("short", p(-0.3, 0.0, -0.3), p(0.3, 0.6, 0.3), white));
    scene.objects[6].transform = placed(-0.3, 0.35, 0.0, 0.3);
    let (a, b) = (DVec3::new(-0.4, 1.6, 0.0), DVec3::new(0.4, 1.6, 0.0));
    scene.add_light(LinearLight::new("tube", a, b, 1000.0));
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(0.0, 1.0, 4.2),
        DVec3::new(0.0, 1.0, 0.0),
        DVec3::Y,
        FieldOfView::vertical_degrees(38.0),
    ));
    scene
}

/// Radiance towards the ray's origin by one random walk, from the definitions alone: the light is sampled at one place of
/// its length, directions by rejection.
fn walk(
    world: &World,
    light: &LinearLight,
    ray: &ShadeRequest,
    random: &mut Pcg64Mcg,
    direct_too: bool,
) -> DVec3 {
    let (mut origin, mut direction) = (ray.origin, ray.direction.normalize());
    let (mut sum, mut share) = (DVec3::ZERO, DVec3::ONE);
    let axis = (light.b - light.a).normalize();
    for bounce in 0..10 {
        let Some(hit) = world.tracer().closest(origin, direction, f64::INFINITY) else {
            break;
        };
        let scene = world.scene();
        let llsr_scene::Geometry::Mesh(mesh) = scene.objects[hit.object.index()].geometry else {
            panic!("all are meshes")
        };
        let material = scene.meshes[mesh.index()].materials[0];
        let normal = if hit.normal.dot(direction) > 0.0 {
            -hit.normal
        } else {
            hit.normal
        };
        share *= scene.materials[material.index()].base_color.as_dvec3();
        origin = hit.leave(normal);
        if bounce > 0 || direct_too {
            let target = light.a + (light.b - light.a) * unit(random);
            let to = target - hit.position;
            let distance = to.length();
            let cosine = normal.dot(to) / distance;
            if cosine > 0.0 && !world.tracer().occluded(origin, target) {
                let sine = axis.cross(to / distance).length();
                sum += share / PI * (light.flux / (PI * PI) * sine * cosine / (distance * distance));
            }
        }
        // Uniform on the sphere by rejection, then Lambert by adding the normal.
        let on_sphere = loop {
            let v = DVec3::new(unit(random), unit(random), unit(random)) * 2.0 - 1.0;
            if v.length_squared() <= 1.0 && v.length_squared() > 1e-4 {
                break v.normalize();
            }
        };
        direction = (normal + on_sphere).normalize();
        if !direction.is_finite() || direction.dot(normal) <= 0.0 {
            break;
        }
    }
    sum
}

#[test]
fn cornell_box_agrees_with_long_random_walks() {
    let scene = cornell();
    let Light::Linear(light) = scene.lights[0].clone() else {
        panic!("a tube")
    };
    let rays = requests(&scene, Viewport { width: 7, height: 6 });
    let world = world_without_moves(scene);
    let settings = GiSettings {
        // Many, so that what is left is the error of the method and not noise.
        rays: [20, 62],
        bounces: 10,
        ..GiSettings::default()
    };
    let shader = GiShader::new(Arc::clone(&world), &settings);
    let direct = llsr_shading::DirectShader::new(Arc::clone(&world), Vec3::ZERO);
    let (points, _) = shade(&shader, &rays, 0);
    let (lit, _) = shade(&direct, &rays, 0);
    let walks = 12_000;
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let (mut total, mut error, mut count) = (0.0, 0.0, 0);
    for ((point, lit), ray) in points.iter().zip(&lit).zip(&rays) {
        if point.object.is_none() {
            continue;
        }
        let (mut mean, mut square) = (DVec3::ZERO, 0.0);
        for _ in 0..walks {
            let one = walk(&world, &light, ray, &mut random, false);
            mean += one / f64::from(walks);
            square += one.y * one.y / f64::from(walks);
        }
        let deviation = ((square - mean.y * mean.y) / f64::from(walks)).sqrt();
        let got = (point.colour - lit.colour).as_dvec3();
        // One record in a corner may be off by several percent; four standard errors of the walks come on top.
        let off = (got.y - mean.y).abs();
        assert!(
            off < 0.15 * mean.y + 4.0 * deviation,
            "at {}: {got} for {mean} +- {deviation}",
            point.position
        );
        total += mean.y;
        error += off;
        count += 1;
    }
    assert!(count >= 30, "{count} points of the box");
    println!(
        "mean error {:.2} percent over {count} points, {:?}",
        100.0 * error / total,
        shader.counts()
    );
    assert!(
        error / total < 0.04,
        "mean error {:.4} of the indirect light",
        error / total
    );
}

fn world_without_moves(scene: Scene) -> Arc<World> {
    Arc::new(World::new(Arc::new(scene), &[]).0)
}

#[test]
fn walls_bleed_their_colour() {
    let scene = cornell();
    let at = |x: f64| ShadeRequest {
        id: 0,
        origin: DVec3::new(x, 0.2, 0.9),
        direction: DVec3::NEG_Y,
    };
    let shader = GiShader::new(world_without_moves(scene), &GiSettings::default());
    let (points, _) = shade(&shader, &[at(-0.95), at(0.95)], 0);
    let ratio = |i: usize| points[i].colour.x / points[i].colour.y;
    assert!(
        ratio(0) > 1.15 * ratio(1),
        "red on the left, green on the right: {points:?}"
    );
}

#[test]
fn points_do_not_depend_on_batches_threads_or_what_is_remembered() {
    let scene = room();
    let rays = requests(
        &scene,
        Viewport {
            width: 20,
            height: 16,
        },
    );
    let world = world(scene);
    let settings = GiSettings {
        rays: [4, 12],
        ..GiSettings::default()
    };
    let shader = GiShader::new(Arc::clone(&world), &settings);
    let (whole, met) = shade(&shader, &rays, 7);
    let (again, met_again) = shade(&shader, &rays, 7);
    assert!(whole == again && met == met_again, "with all records at hand");
    let pieces = shade_in_pieces(&GiShader::new(Arc::clone(&world), &settings), &rays, 7);
    assert_eq!(whole, pieces, "in pieces on three threads, from the start");
    let forgetful = GiSettings {
        memory: 0,
        ..settings
    };
    assert_eq!(
        whole,
        shade_in_pieces(&GiShader::new(world, &forgetful), &rays, 7),
        "without memory"
    );
}

/// Two rooms with a thin wall between them, a light in one of them.
#[test]
fn light_does_not_leak_through_thin_walls() {
    let mut scene = Scene::new("two rooms");
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.8)));
    let cuboid = |scene: &mut Scene, low: [f32; 3], high: [f32; 3]| {
        scene.add_mesh(Mesh::cuboid("wall", Vec3::from(low), Vec3::from(high), white));
    };
    cuboid(&mut scene, [-2.0, -0.1, -1.0], [2.0, 0.0, 1.0]);
    cuboid(&mut scene, [-2.0, 2.0, -1.0], [2.0, 2.1, 1.0]);
    cuboid(&mut scene, [-2.1, 0.0, -1.0], [-2.0, 2.0, 1.0]);
    cuboid(&mut scene, [2.0, 0.0, -1.0], [2.1, 2.0, 1.0]);
    cuboid(&mut scene, [-2.1, -0.1, -1.1], [2.1, 2.1, -1.0]);
    cuboid(&mut scene, [-2.1, -0.1, 1.0], [2.1, 2.1, 1.1]);
    cuboid(&mut scene, [-0.001, 0.0, -1.0], [0.001, 2.0, 1.0]);
    scene.add_light(LinearLight::new(
        "tube",
        DVec3::new(0.5, 1.9, 0.0),
        DVec3::new(1.5, 1.9, 0.0),
        1000.0,
    ));
    let shader = GiShader::new(world_without_moves(scene), &GiSettings::default());
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let mut rays = Vec::new();
    for side in [-1.0, 1.0] {
        for id in 0..150 {
            let (angle, height) = (TAU * unit(&mut random), 1.6 * unit(&mut random) - 0.8);
            rays.push(ShadeRequest {
                id,
                origin: DVec3::new(side * (0.05 + 0.5 * unit(&mut random)), 1.0, 0.0),
                direction: DVec3::new(angle.cos(), height, angle.sin()),
            });
        }
    }
    let (points, _) = shade(&shader, &rays, 0);
    assert!(
        points[..150].iter().all(|point| point.colour == Vec3::ZERO),
        "the dark room is dark"
    );
    assert!(
        points[150..].iter().all(|point| point.colour.y > 1.0),
        "the lit one is lit"
    );
}

#[test]
fn records_near_a_moved_object_are_made_anew() {
    let scene = cornell();
    let rays = requests(
        &scene,
        Viewport {
            width: 16,
            height: 16,
        },
    );
    let settings = GiSettings {
        rays: [5, 16],
        ..GiSettings::default()
    };
    let movable = [ObjectId(6)];
    let build = |scene: Scene| Arc::new(World::new(Arc::new(scene), &movable).0);
    let before = build(scene.clone());
    let shader = GiShader::new(Arc::clone(&before), &settings);
    let (old, _) = shade(&shader, &rays, 0);
    let made_before = shader.counts().made;
    let to = placed(0.4, 0.3, 0.0, 0.55);
    let change = before
        .moved(&[Place::Object(ObjectId(6), to)])
        .expect("a good place");
    shader.changed(&change);
    let (new, _) = shade(&shader, &rays, 0);
    let made = shader.counts().made - made_before;
    let mut moved = scene;
    moved.objects[6].transform = to;
    let fresh = GiShader::new(build(moved), &settings);
    let (expected, _) = shade(&fresh, &rays, 0);
    let difference = |a: &[llsr_shading::ShadedPoint], b: &[llsr_shading::ShadedPoint]| {
        let sum: f64 = a
            .iter()
            .zip(b)
            .map(|(a, b)| f64::from((a.colour - b.colour).length()))
            .sum();
        sum / b.iter().map(|b| f64::from(b.colour.length())).sum::<f64>()
    };
    let (stale, now) = (difference(&old, &expected), difference(&new, &expected));
    println!(
        "stale {stale:.4}, renewed {now:.4}; made {made_before}, then {made}, fresh {}",
        fresh.counts().made
    );
    assert!(stale > 0.03, "the move shows: {stale}");
    assert!(now < 0.01, "and is followed: {now}");
    // The box is small and open to all its records, so most of them see the block.
    assert!(
        made < fresh.counts().made,
        "{made} records for {}",
        fresh.counts().made
    );
}

#[test]
fn records_in_another_room_stay() {
    let mut scene = Scene::new("two rooms");
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.8)));
    for (x, name) in [(-1.5f32, "left"), (1.5, "right")] {
        let (low, high) = (Vec3::new(x - 1.4, 0.0, -1.0), Vec3::new(x + 1.4, 2.0, 1.0));
        scene.add_mesh(Mesh::cuboid(name, low, high, white));
        let (a, b) = (
            DVec3::new(f64::from(x) - 0.5, 1.9, 0.0),
            DVec3::new(f64::from(x) + 0.5, 1.9, 0.0),
        );
        scene.add_light(LinearLight::new(name, a, b, 500.0));
    }
    let block = scene.add_mesh(Mesh::cuboid("block", Vec3::splat(-0.2), Vec3::splat(0.2), white));
    scene.objects[block.index()].transform = placed(0.0, 1.5, 0.3, 0.0);
    let rays = |x: f64| -> Vec<ShadeRequest> {
        (0..60)
            .map(|id| ShadeRequest {
                id,
                origin: DVec3::new(x, 1.0, 0.0),
                direction: DVec3::new(
                    (0.7 * id as f64).sin(),
                    (0.31 * id as f64).cos() - 0.4,
                    (0.7 * id as f64).cos(),
                ),
            })
            .collect()
    };
    let settings = GiSettings {
        rays: [4, 12],
        ..GiSettings::default()
    };
    let world = Arc::new(World::new(Arc::new(scene), &[block]).0);
    let shader = GiShader::new(Arc::clone(&world), &settings);
    let (left, _) = shade(&shader, &rays(-1.5), 0);
    let (right, _) = shade(&shader, &rays(1.2), 0);
    let made = shader.counts().made;
    let change = world
        .moved(&[Place::Object(block, placed(0.3, 1.9, 0.4, 0.2))])
        .expect("a good place");
    shader.changed(&change);
    let (left_again, _) = shade(&shader, &rays(-1.5), 0);
    assert_eq!(left, left_again, "nothing changes on the left");
    assert_eq!(shader.counts().made, made, "and no record is made");
    let (right_again, _) = shade(&shader, &rays(1.2), 0);
    assert!(
        right != right_again && shader.counts().made > made,
        "on the right, some are"
    );
}

/// What records say must not depend on their random numbers, or walls look blotchy. Tubes hang close to a wall and a ceiling: most of
/// what a hemisphere gets there comes from the bright strips beside them.
#[test]
fn records_with_other_random_numbers_say_the_same() {
    let mut scene = cornell();
    for (name, a, b) in [
        ("ceiling", DVec3::new(-0.8, 1.93, 0.5), DVec3::new(0.8, 1.93, 0.5)),
        ("wall", DVec3::new(-0.93, 0.3, -0.6), DVec3::new(-0.93, 1.7, -0.6)),
    ] {
        scene.add_light(LinearLight::new(name, a, b, 1000.0));
    }
    let rays = requests(
        &scene,
        Viewport {
            width: 20,
            height: 16,
        },
    );
    let world = world_without_moves(scene);
    let mut scratch = ShaderScratch::default();
    let pictures: Vec<Vec<f64>> = (0..4)
        .map(|seed| {
            let settings = GiSettings {
                seed,
                ..GiSettings::default()
            };
            let shader = GiShader::new(Arc::clone(&world), &settings);
            rays.iter()
                .filter_map(|ray| world.look(ray.origin, ray.direction.normalize()))
                .map(|surface| shader.indirect_irradiance(&surface, &mut scratch).y)
                .collect()
        })
        .collect();
    let count = pictures[0].len();
    assert!(count > 150, "{count} points");
    // Variance between the four, with their mean in place of the truth.
    let (mut variance, mut level) = (0.0, 0.0);
    for point in 0..count {
        let values = pictures.iter().map(|picture| picture[point]);
        let mean = values.clone().sum::<f64>() / 4.0;
        variance += values.map(|value| (value - mean).powi(2)).sum::<f64>() / 3.0;
        level += mean;
    }
    let noise = (variance / count as f64).sqrt() / (level / count as f64);
    println!("noise {noise:.4} of the mean");
    // With lights asked at even places of their length, and paths that go on to their end, it is 0.21.
    assert!(noise < 0.07, "{noise}");
}

/// Between two sheets that almost touch it is dark; what records there say is nothing to the room.
#[test]
fn records_in_a_crevice_do_not_darken_what_is_beside_it() {
    let mut scene = cornell();
    let white = scene.objects.len();
    let material = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::cuboid(
        "plate",
        Vec3::new(-0.9, 0.002, 0.1),
        Vec3::new(-0.1, 0.004, 0.9),
        material,
    ));
    assert_eq!(scene.objects.len(), white + 1);
    let shader = GiShader::new(world_without_moves(scene.clone()), &GiSettings::default());
    let world = world_without_moves(scene);
    let mut scratch = ShaderScratch::default();
    // On the floor, from the plate's rim outwards.
    let values: Vec<f64> = (0..60)
        .map(|step| {
            let (x, z) = (
                -0.095 + 0.002 * f64::from(step % 20),
                0.3 + 0.2 * f64::from(step / 20),
            );
            let surface = world
                .look(DVec3::new(x, 0.5, z), DVec3::NEG_Y)
                .expect("the floor");
            assert!(surface.position.y < 1e-6, "beside the plate");
            shader.indirect_irradiance(&surface, &mut scratch).y
        })
        .collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    println!("least {least:.1}, mean {mean:.1}");
    assert!(least > 0.6 * mean, "{values:?}");
}
