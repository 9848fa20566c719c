//! The direct shader, and what it says of shadows.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use llsr_scene::{Light, LightId, ObjectId, Triple, Viewport, demo};
use llsr_shading::{
    DirectShader, Encounters, Place, PlaceError, Settings, ShadeRequest, Shader, ShaderError, ShaderScratch,
    World, render,
};
use llsr_tracer::{MoveError, Tracer};

use crate::support::{MOVABLE, placed, requests, room, shade, shade_in_pieces, world};

const VIEW: Viewport = Viewport {
    width: 40,
    height: 32,
};

#[test]
fn colours_are_those_of_the_tile_renderer() {
    for name in ["wall", "sphere-and-friends", "subway"] {
        let scene = demo::build(name).expect("built in");
        let (tracer, _) = Tracer::new(&scene);
        let picture = render(
            &scene,
            &tracer,
            &scene.cameras[0],
            VIEW,
            &Settings::default(),
            &|| true,
        )
        .expect("nobody interrupts");
        let rays = requests(&scene, VIEW);
        let shader = DirectShader::new(world_of(scene), Vec3::ZERO);
        let (points, met) = shade(&shader, &rays, 3);
        let mut lit = 0;
        for point in &points {
            for (channel, value) in ["R", "G", "B"].iter().zip(point.colour.to_array()) {
                let expected = picture.film.channel(channel).expect("a picture")[point.id as usize];
                assert!(
                    (value - expected).abs() <= 1e-4 * expected.abs() + 1e-6,
                    "{name}, pixel {}: {value} for {expected}",
                    point.id
                );
            }
            lit += u32::from(point.lights != 0);
        }
        assert!(lit > 100, "{name}: {lit} points see a light");
        assert!(!met.objects.is_empty(), "{name}: something is seen");
    }
}

fn world_of(scene: llsr_scene::Scene) -> Arc<World> {
    Arc::new(World::new(Arc::new(scene), &[]).0)
}

#[test]
fn points_do_not_depend_on_the_batch() {
    let scene = room();
    let rays = requests(&scene, VIEW);
    let shader = DirectShader::new(world(scene), Vec3::splat(20.0));
    let (whole, _) = shade(&shader, &rays, 7);
    assert_eq!(
        whole,
        shade_in_pieces(&shader, &rays, 7),
        "the same points, bit by bit"
    );
}

#[test]
fn ambient_light_is_added_to_every_surface() {
    let scene = room();
    let rays = requests(&scene, VIEW);
    let world = world(scene);
    let ambient = Vec3::new(30.0, 20.0, 10.0);
    let (dark, _) = shade(&DirectShader::new(Arc::clone(&world), Vec3::ZERO), &rays, 0);
    let (bright, _) = shade(&DirectShader::new(world, ambient), &rays, 0);
    let mut surfaces = 0;
    for (dark, bright) in dark.iter().zip(&bright) {
        let expected = dark.colour + dark.albedo * ambient / std::f32::consts::PI;
        assert!(
            (bright.colour - expected).length() <= 1e-5 * expected.length(),
            "{bright:?}"
        );
        surfaces += u32::from(dark.object.is_some());
    }
    assert!(
        surfaces > 400 && (surfaces as usize) < rays.len(),
        "{surfaces} surfaces and some background"
    );
}

/// What hides a light from a point, by looking at 4000 places of it.
fn dense(world: &World, origin: DVec3, normal: DVec3, light: &Light) -> (Vec<Option<ObjectId>>, bool) {
    let (a, b) = light.ends();
    let looks: Vec<_> = (0..4000)
        .map(|i| {
            let to = a + (b - a) * ((f64::from(i) + 0.5) / 4000.0) - origin;
            let hit = world.tracer().closest(origin, to, 1.0);
            (hit.map(|hit| hit.object), normal.dot(to) > 0.0)
        })
        .filter(|&(_, above)| above)
        .map(|(object, _)| object)
        .collect();
    let lit = looks.contains(&None);
    (looks, lit)
}

#[test]
fn shadows_are_reported_with_what_casts_them() {
    let scene = room();
    let rays = requests(
        &scene,
        Viewport {
            width: 24,
            height: 20,
        },
    );
    let world = world(scene);
    let shader = DirectShader::new(Arc::clone(&world), Vec3::ZERO);
    let (mut must_total, mut umbrae) = (BTreeSet::new(), 0);
    for ray in &rays {
        let (points, met) = shade(&shader, std::slice::from_ref(ray), 1);
        let Some(surface) = world.look(ray.origin, ray.direction.normalize()) else {
            assert!(
                met.is_empty() && points[0].object.is_none(),
                "nothing is met in the background"
            );
            continue;
        };
        assert_eq!(met.objects, [surface.object], "the visible object");
        let (mut may, mut must, mut seen) = (BTreeSet::new(), BTreeSet::new(), 0u64);
        for (index, light) in world.lights().iter().enumerate() {
            let triple = |blocker| Triple {
                light: LightId::from(index),
                blocker,
                receiver: surface.object,
            };
            let (looks, lit) = dense(&world, surface.origin, surface.geometric_normal, light);
            seen |= u64::from(lit) << index;
            may.extend(looks.iter().flatten().map(|&object| triple(object)));
            for pair in looks.windows(2) {
                if let [None, Some(object)] | [Some(object), None] = *pair {
                    must.insert(triple(object));
                }
            }
            if !lit && let Some(&Some(object)) = looks.get(looks.len() / 2) {
                must.insert(triple(object));
                umbrae += 1;
            }
        }
        let found: BTreeSet<_> = met.triples.iter().copied().collect();
        assert_eq!(found.len(), met.triples.len(), "no repetitions");
        assert!(
            found.is_superset(&must),
            "ray {}: {found:?} without some of {must:?}",
            ray.id
        );
        assert!(found.is_subset(&may), "ray {}: {found:?} beyond {may:?}", ray.id);
        // A sliver of light between two looks is seen by the shader alone.
        assert_eq!(
            points[0].lights & seen,
            seen,
            "ray {}: the lights that reach it",
            ray.id
        );
        must_total.extend(must);
    }
    assert!(
        must_total.len() >= 4 && umbrae > 3,
        "{} shadows, {umbrae} umbrae",
        must_total.len()
    );
}

#[test]
fn a_changed_shader_is_as_good_as_new() {
    let mut scene = room();
    let rays = requests(&scene, VIEW);
    let first = world(scene.clone());
    let shader = DirectShader::new(Arc::clone(&first), Vec3::ONE);
    let (before, _) = shade(&shader, &rays, 5);
    let transform = placed(0.7, 0.4, 0.3, -0.2);
    let Light::Linear(mut light) = scene.lights[1].clone() else {
        panic!("the lights are linear")
    };
    light.b += DVec3::new(0.3, -0.2, 0.8);
    let places = [
        Place::Object(ObjectId(2), transform),
        Place::Object(ObjectId(3), placed(0.0, -1.0, 0.4, 0.0)),
        Place::Light(LightId(1), light.clone().into()),
    ];
    let change = first.moved(&places).expect("good places");
    assert_eq!(change.moves.len(), 3, "each is told");
    assert!(
        change.moves[1].after.contains(Vec3::new(-1.0, 0.4, 0.0)),
        "{:?}",
        change.moves
    );
    assert!(
        change.moves[2].after.contains(light.b.as_vec3()),
        "{:?}",
        change.moves
    );
    shader.changed(&change);
    let (after, met) = shade(&shader, &rays, 5);
    scene.objects[2].transform = transform;
    scene.objects[3].transform = placed(0.0, -1.0, 0.4, 0.0);
    scene.lights[1] = light.into();
    let fresh = DirectShader::new(world(scene), Vec3::ONE);
    let (expected, expected_met) = shade(&fresh, &rays, 5);
    assert_eq!(after, expected, "the same bits");
    assert_eq!(met, expected_met, "the same encounters");
    assert!(
        before.iter().zip(&after).filter(|(a, b)| a != b).count() > 100,
        "the picture changes"
    );
}

#[test]
fn what_cannot_be_moved_is_an_error() {
    let world = world(room());
    let fixed = world.moved(&[Place::Object(ObjectId(0), placed(0.0, 0.0, 0.0, 0.0))]);
    assert_eq!(
        fixed.err(),
        Some(PlaceError::Object(MoveError::NotMovable(ObjectId(0)))),
        "the floor stays"
    );
    let mut light = world.lights()[0].clone();
    assert_eq!(
        world.moved(&[Place::Light(LightId(9), light.clone())]).err(),
        Some(PlaceError::NoSuchLight(LightId(9))),
        "no such light"
    );
    light.translate(DVec3::splat(f64::NAN));
    assert_eq!(
        world.moved(&[Place::Light(LightId(0), light)]).err(),
        Some(PlaceError::BadLight(LightId(0))),
        "nowhere"
    );
    assert_eq!(world.tracer().movable().collect::<Vec<_>>(), MOVABLE, "as asked");
}

#[test]
fn a_bad_ray_is_an_error() {
    let shader = DirectShader::new(world(room()), Vec3::ZERO);
    let good = ShadeRequest {
        id: 0,
        origin: DVec3::Y,
        direction: DVec3::NEG_Y * 3.0,
    };
    let bad = [
        ShadeRequest {
            id: 1,
            direction: DVec3::ZERO,
            ..good
        },
        ShadeRequest {
            id: 2,
            direction: DVec3::NAN,
            ..good
        },
        ShadeRequest {
            id: 3,
            origin: DVec3::INFINITY,
            ..good
        },
    ];
    for bad in bad {
        let (mut points, mut met) = (Vec::new(), Encounters::default());
        let done = shader.shade(
            &[good, bad],
            0,
            &mut ShaderScratch::default(),
            &mut points,
            &mut met,
        );
        assert_eq!(done, Err(ShaderError::BadRay { id: bad.id }), "{bad:?}");
        assert_eq!(points.len(), 1, "the rays before it are shaded");
    }
}
