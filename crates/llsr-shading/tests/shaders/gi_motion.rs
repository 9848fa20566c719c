//! Global illumination while things move: records of before a move serve until they are renewed.

use std::sync::Arc;

use glam::DVec3;
use llsr_scene::{LightId, ObjectId, Viewport};
use llsr_shading::{
    GiSettings, GiShader, Place, Renewal, SceneChange, ShadeRequest, ShadedPoint, Shader, World,
};

use crate::gi::cornell;
use crate::support::{placed, requests, shade, shade_in_pieces};

/// The block that may move.
const BLOCK: ObjectId = ObjectId(6);

fn settings(renewal: Renewal) -> GiSettings {
    GiSettings {
        rays: [5, 16],
        renewal,
        ..GiSettings::default()
    }
}

fn box_and_rays() -> (Arc<World>, Vec<ShadeRequest>) {
    let scene = cornell();
    let viewport = Viewport {
        width: 20,
        height: 20,
    };
    let rays = requests(&scene, viewport);
    (Arc::new(World::new(Arc::new(scene), &[BLOCK]).0), rays)
}

fn light_moved(world: &World, by: DVec3) -> SceneChange {
    let mut light = world.lights()[0].clone();
    light.translate(by);
    world
        .moved(&[Place::Light(LightId(0), light)])
        .expect("a good place")
}

/// Mean difference of colours, as a share of the mean colour of `b`.
fn difference(a: &[ShadedPoint], b: &[ShadedPoint]) -> f64 {
    let sum: f64 = a
        .iter()
        .zip(b)
        .map(|(a, b)| f64::from((a.colour - b.colour).length()))
        .sum();
    sum / b.iter().map(|b| f64::from(b.colour.length())).sum::<f64>()
}

/// Shades until no point is provisional. Returns the points and how often that was.
fn settled(shader: &GiShader, rays: &[ShadeRequest]) -> (Vec<ShadedPoint>, usize) {
    for round in 1..2000 {
        let (points, _) = shade(shader, rays, 0);
        if !points.iter().any(|point| point.provisional) {
            return (points, round);
        }
    }
    panic!("some points are provisional for ever");
}

#[test]
fn a_moved_light_is_followed_at_little_cost_and_in_the_end_to_the_bit() {
    let (world, rays) = box_and_rays();
    let shader = GiShader::new(Arc::clone(&world), &settings(Renewal::Gradual));
    let (before, _) = shade(&shader, &rays, 0);
    assert!(
        before.iter().all(|point| !point.provisional),
        "nothing has moved yet"
    );
    let made = shader.counts().made;
    let change = light_moved(&world, DVec3::new(0.25, -0.1, 0.2));
    shader.changed(&change);
    let (first, _) = shade(&shader, &rays, 0);
    let renewed = shader.counts().made - made;

    let fresh = GiShader::new(Arc::clone(&change.world), &settings(Renewal::AtOnce));
    let (expected, _) = shade(&fresh, &rays, 0);
    let needed = fresh.counts().made;
    let provisional = first.iter().filter(|point| point.provisional).count();
    let (stale, now) = (difference(&before, &expected), difference(&first, &expected));
    println!("{renewed} of {needed} records, {provisional} provisional; error {stale:.4}, then {now:.4}");
    assert!(
        renewed > 0 && renewed * 10 < needed,
        "{renewed} of {needed} records"
    );
    assert!(
        provisional * 2 > rays.len(),
        "{provisional} points are provisional"
    );
    assert!(
        now < 0.4 * stale,
        "direct light is that of now: {now} instead of {stale}"
    );

    let (last, rounds) = settled(&shader, &rays);
    assert_eq!(last, expected, "after {rounds} rounds");
    assert!(rounds > 1 && rounds < 600, "{rounds} rounds");
}

/// As in a drag: a move after every few points. The error stays that of a light that lags behind by some way.
#[test]
fn points_come_while_a_light_is_dragged() {
    let (mut world, rays) = box_and_rays();
    let shader = GiShader::new(Arc::clone(&world), &settings(Renewal::Gradual));
    shade(&shader, &rays, 0);
    let made = shader.counts().made;
    let mut points = Vec::new();
    for portion in rays.chunks(10) {
        let change = light_moved(&world, DVec3::new(0.01, 0.0, -0.005));
        shader.changed(&change);
        world = change.world;
        points.extend(shade(&shader, portion, 0).0);
    }
    let renewed = shader.counts().made - made;
    let fresh = GiShader::new(Arc::clone(&world), &settings(Renewal::AtOnce));
    let (expected, _) = shade(&fresh, &rays, 0);
    println!(
        "{renewed} records, a fresh shader makes {} for the last place alone",
        fresh.counts().made
    );
    // 40 moves, each of which would have cost as many as the last alone.
    assert!(
        renewed * 10 < fresh.counts().made,
        "{renewed} records in 40 moves"
    );
    let (last, _) = settled(&shader, &rays);
    assert_eq!(last, expected, "when it is let go");
}

#[test]
fn a_moved_object_is_followed_as_by_a_shader_that_renews_at_once() {
    let (world, rays) = box_and_rays();
    let to = placed(0.4, 0.3, 0.0, 0.55);
    let change = world.moved(&[Place::Object(BLOCK, to)]).expect("a good place");
    let both = [Renewal::Gradual, Renewal::AtOnce].map(|renewal| {
        let shader = GiShader::new(Arc::clone(&world), &settings(renewal));
        shade(&shader, &rays, 0);
        let made = shader.counts().made;
        shader.changed(&change);
        let (first, _) = shade(&shader, &rays, 0);
        let renewed = shader.counts().made - made;
        (first, renewed, settled(&shader, &rays).0)
    });
    let [(first, few, gradual), (_, all, at_once)] = both;
    println!(
        "{few} and {all} records; error at first {:.4}",
        difference(&first, &at_once)
    );
    assert!(few * 5 < all, "{few} and {all} records");
    assert!(difference(&first, &at_once) < 0.1, "most light is direct");
    assert_eq!(gradual, at_once, "in the end");
}

#[test]
fn until_something_moves_both_ways_are_the_same() {
    let (world, rays) = box_and_rays();
    let at_once = GiShader::new(Arc::clone(&world), &settings(Renewal::AtOnce));
    let gradual = GiShader::new(world, &settings(Renewal::Gradual));
    assert_eq!(
        shade(&at_once, &rays, 0).0,
        shade_in_pieces(&gradual, &rays, 0),
        "on three threads"
    );
}
