//! Slots, ages, invalidation and replacement.

use glam::{Affine3A, Vec3};
use llsr_render_cache::*;
use proptest::prelude::*;

use crate::scene::*;

fn at(x: f32, y: f32, depth: f32) -> Vec3 {
    position(16, 16, x, y, depth)
}

/// A store with room and the picture of what is in it, 16 x 16 pixels.
fn pictured(points: &[Point]) -> (PointStore, PointImage, Vec<u32>) {
    let mut store = PointStore::new(256).expect("capacity");
    let slots = points.iter().map(|p| put(&mut store, p)).collect();
    store.advance(10, 255);
    let mut image = PointImage::new(16, 16).expect("size");
    image.reproject(&store, &view(16, 16), &DepthFilter::default());
    (store, image, slots)
}

#[test]
fn same_surface_is_renewed() {
    let (mut store, image, slots) = pictured(&[point(at(5.1, 5.1, 3.0), 7)]);
    let sample = point(at(5.9, 5.4, 3.03), 7);
    let found = store
        .insert(&sample, &image, &Replacement::default())
        .expect("stored");
    assert_eq!(
        found,
        Insertion {
            slot: slots[0],
            place: Place::Renewed,
            changed: false
        },
        "in place"
    );
    assert_eq!(
        (store.len(), store.age(slots[0])),
        (1, Some(0)),
        "the only point, new"
    );
    assert_eq!(
        store.point(slots[0]).map(|p| p.position),
        Some(sample.position),
        "the new one"
    );
    // Another object, another depth or another pixel: another point.
    for other in [
        point(at(5.1, 5.1, 3.0), 8),
        point(at(5.1, 5.1, 2.5), 7),
        point(at(6.1, 5.1, 3.0), 7),
    ] {
        let (mut store, image, slots) = pictured(&[point(at(5.1, 5.1, 3.0), 7)]);
        let found = store
            .insert(&other, &image, &Replacement::default())
            .expect("stored");
        assert_eq!(found.place, Place::Free, "{other:?}");
        assert_eq!(
            (store.len(), store.age(slots[0])),
            (2, Some(10)),
            "the old one is left alone: {other:?}"
        );
    }
}

#[test]
fn what_a_sample_sees_past_ages() {
    let (mut store, image, slots) = pictured(&[point(at(5.1, 5.1, 3.0), 7)]);
    let policy = Replacement::default();
    let behind = point(at(5.1, 5.1, 4.0), 9);
    assert_eq!(
        store.insert(&behind, &image, &policy).map(|i| i.place),
        Some(Place::Free),
        "its own slot"
    );
    assert_eq!(
        store.age(slots[0]),
        Some(10 + policy.early_ageing),
        "the nearer one is in doubt"
    );
}

#[test]
fn hidden_points_make_room() {
    // A far point in a wall of near ones.
    let mut points: Vec<_> = (0..256)
        .map(|i| point(at((i % 16) as f32 + 0.5, (i / 16) as f32 + 0.5, 2.0), 1))
        .collect();
    points[8 * 16 + 8] = point(at(8.5, 8.5, 5.0), 2);
    let (mut store, image, slots) = pictured(&points);
    assert_eq!(
        image.counts(),
        Counts {
            occupied: 255,
            hidden: 1
        },
        "one shines through"
    );
    let sample = point(at(8.5, 8.5, 2.0), 1);
    let found = store
        .insert(&sample, &image, &Replacement::default())
        .expect("stored");
    let expected = Insertion {
        slot: slots[8 * 16 + 8],
        place: Place::Hidden,
        changed: false,
    };
    assert_eq!(found, expected, "its slot is taken");
}

#[test]
fn changed_colours_age_the_points_around() {
    let points: Vec<_> = (0..256)
        .map(|i| point(at((i % 16) as f32 + 0.5, (i / 16) as f32 + 0.5, 2.0), 1))
        .collect();
    let policy = Replacement {
        early_radius: 2,
        early_ageing: 30,
        colour_tolerance: 0.1,
        ..Replacement::default()
    };
    for (factor, changed) in [(1.0, false), (1.05, false), (0.8, true), (3.0, true)] {
        let (mut store, image, slots) = pictured(&points);
        let sample = Point {
            colour: points[0].colour * factor,
            ..points[8 * 16 + 1]
        };
        let found = store.insert(&sample, &image, &policy).expect("stored");
        assert_eq!(
            (found.place, found.changed),
            (Place::Renewed, changed),
            "colour times {factor}"
        );
        for (i, slot) in slots.iter().enumerate() {
            let (x, y) = (i % 16, i / 16);
            let around = x.abs_diff(1) <= 2 && y.abs_diff(8) <= 2;
            let expected = match (x, y) {
                (1, 8) => 0,
                _ if changed && around => 40,
                _ => 10,
            };
            assert_eq!(store.age(*slot), Some(expected), "age at ({x}, {y})");
        }
    }
    // A border in a pixel: each sample differs from the one before.
    let (mut store, image, slots) = pictured(&points);
    for i in 0..40 {
        let sample = Point {
            colour: points[0].colour * [0.5, 1.0][i % 2],
            ..points[8 * 16 + 1]
        };
        assert!(store.insert(&sample, &image, &policy).expect("stored").changed);
    }
    let age = store.age(slots[8 * 16 + 2]);
    assert_eq!(age, Some(192), "doubtful, not gone");
}

/// A point in each pixel of a picture of 64 x 4, in the order of the pixels, so that slot and pixel have the same number:
/// 16 groups of slots, four a line.
fn orderly() -> (PointStore, PointImage) {
    let mut store = PointStore::new(256).expect("capacity");
    for i in 0..256 {
        let slot = put(&mut store, &point(pixel(i, 2.0), 1));
        assert_eq!(slot, i, "slots are taken in order");
    }
    (store, PointImage::new(64, 4).expect("size"))
}

/// The middle of pixel `i` of that picture.
fn pixel(i: u32, depth: f32) -> Vec3 {
    position(64, 4, (i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5, depth)
}

#[test]
fn one_point_can_be_put_in_doubt() {
    let (mut store, _) = orderly();
    store.advance(10, 255);
    store.invalidate(37, Fate::Age(100));
    store.invalidate(83, Fate::Remove);
    // Nothing there any more.
    store.invalidate(83, Fate::Age(1));
    for (slot, age) in [(36, Some(10)), (37, Some(110)), (38, Some(10)), (83, None)] {
        assert_eq!(store.age(slot), age, "slot {slot}");
    }
}

#[test]
fn full_stores_recycle_the_oldest_or_unseen() {
    let (mut store, mut image) = orderly();
    // Out of the picture go one point in each of the groups 2, 5 and 11.
    for slot in [37, 83, 180] {
        let place = pixel(slot, 2.0);
        store.invalidate_box(place, place, Fate::Remove);
        assert_eq!(
            put(&mut store, &point(Vec3::Z, 1)),
            slot,
            "behind the eye, in the same slot"
        );
    }
    store.advance(10, 255);
    // One in the home of the new points is old.
    let old = pixel(9 * 16 + 4, 2.0);
    store.invalidate_box(old, old, Fate::Age(3));
    image.reproject(&store, &view(64, 4), &OFF);
    let mut local = [148, 144, 145, 146, 147, 149, 150, 151, 152, 153].into_iter();
    for turn in 0..12 {
        // Another object in front: nothing to renew.
        let new = point(pixel(9 * 16 + turn, 1.0), 2);
        let found = store
            .insert(&new, &image, &Replacement::default())
            .expect("stored");
        let expected = match turn {
            2 => 37,
            5 => 83,
            11 => 180,
            _ => local.next().expect("one of the home"),
        };
        assert_eq!(
            (found.slot, found.place),
            (expected, Place::Recycled),
            "turn {turn}"
        );
    }
    assert_eq!(store.len(), 256, "never more than there is room for");
}

#[test]
fn strays_make_room_at_home() {
    let (mut store, mut image) = orderly();
    // The point in slot 150 has moved to the last pixel of the picture, before what lies there; slot 3 is vacant.
    let place = pixel(150, 2.0);
    store.invalidate_box(place, place, Fate::Remove);
    let moved = point(pixel(255, 1.5), 1);
    assert_eq!(put(&mut store, &moved), 150, "the same slot");
    let place = pixel(3, 2.0);
    store.invalidate_box(place, place, Fate::Remove);
    store.advance(10, 255);
    image.reproject(&store, &view(64, 4), &OFF);
    let new = point(pixel(150, 2.0), 1);
    let found = store
        .insert(&new, &image, &Replacement::default())
        .expect("stored");
    assert_eq!((found.slot, found.place), (150, Place::Free), "at home");
    assert_eq!(
        store.point(150).map(|p| p.position),
        Some(new.position),
        "the new point"
    );
    assert_eq!(
        (store.point(3), store.age(3)),
        (Some(moved), Some(10)),
        "the stray one has moved to the vacancy"
    );
}

#[test]
fn vacancies_are_taken_at_home() {
    let mut store = PointStore::new(256).expect("capacity");
    let mut image = PointImage::new(64, 4).expect("size");
    image.reproject(&store, &view(64, 4), &OFF);
    // In any order of insertion, points end up in the groups of their pixels.
    for i in 0..256u32 {
        let i = i * 77 % 256;
        let found = store
            .insert(&point(pixel(i, 2.0), 1), &image, &Replacement::default())
            .expect("stored");
        assert_eq!((found.slot / 16, found.place), (i / 16, Place::Free), "pixel {i}");
    }
}

#[test]
fn ages_and_retirement() {
    let mut store = PointStore::new(20).expect("capacity");
    let old = put(&mut store, &point(Vec3::ONE, 1));
    assert_eq!(store.advance(200, 254), 0, "young enough");
    let young = put(&mut store, &point(Vec3::ONE, 1));
    assert_eq!((store.age(old), store.age(young)), (Some(200), Some(0)), "ages");
    assert_eq!(
        store.advance(100, 255),
        0,
        "ages stop at 255, and 255 is no limit"
    );
    assert_eq!((store.age(old), store.age(young)), (Some(255), Some(100)), "ages");
    assert_eq!(store.advance(1, 120), 1, "the old one goes");
    assert_eq!(
        (store.age(old), store.age(young), store.len()),
        (None, Some(101), 1),
        "the young one stays"
    );
    assert_eq!(store.point(old), None, "gone");
    assert_eq!(
        put(&mut store, &point(Vec3::ONE, 1)),
        old,
        "its slot is used again"
    );
    store.clear();
    assert!(store.is_empty() && store.iter().next().is_none(), "cleared");
    assert_eq!(store.age(u32::MAX), None, "no such slot");
}

#[test]
fn wrong_points_are_refused_or_repaired() {
    let mut store = PointStore::new(4).expect("capacity");
    let image = PointImage::new(4, 4).expect("size");
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let sample = point(Vec3::new(0.0, bad, -1.0), 1);
        assert_eq!(
            store.insert(&sample, &image, &Replacement::default()),
            None,
            "{bad}"
        );
    }
    assert!(store.is_empty(), "nothing was stored");
    let sample = Point {
        colour: Vec3::new(f32::NAN, -1.0, f32::INFINITY),
        ..point(Vec3::ONE, 1)
    };
    let slot = put(&mut store, &sample);
    let colour = store.point(slot).expect("a point").colour;
    assert_eq!(colour, Vec3::new(0.0, 0.0, MAX_COMPONENT), "repaired");
}

#[derive(Clone, Debug)]
enum Step {
    Insert(Point),
    Advance(u8, u8),
    Object(u32, Fate),
    Lights(u64, Fate),
    Box(Vec3, Vec3, Fate),
    Where(f32, Fate),
    Move(u32, Vec3),
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let coordinate = || (-4..5i32).prop_map(|v| v as f32);
    let vector = move || (coordinate(), coordinate(), coordinate()).prop_map(|(x, y, z)| Vec3::new(x, y, z));
    let fate = || {
        prop_oneof![
            Just(Fate::Remove),
            (0..200u8).prop_map(Fate::Age),
            (0..200u8).prop_map(Fate::Expire)
        ]
    };
    let insert = (vector(), 0..4u32, any::<u64>()).prop_map(|(position, object, lights)| {
        Step::Insert(Point {
            lights: 1 << (lights % 64),
            ..point(position, object)
        })
    });
    let step = prop_oneof![
        8 => insert,
        1 => (0..100u8, any::<u8>()).prop_map(|(ticks, limit)| Step::Advance(ticks, limit)),
        1 => (0..4u32, fate()).prop_map(|(object, fate)| Step::Object(object, fate)),
        1 => (any::<u64>(), any::<u64>(), fate()).prop_map(|(a, b, fate)| Step::Lights(a & b, fate)),
        1 => (vector(), vector(), fate()).prop_map(|(a, b, fate)| Step::Box(a, b, fate)),
        1 => (coordinate(), fate()).prop_map(|(x, fate)| Step::Where(x, fate)),
        1 => (0..4u32, vector()).prop_map(|(object, by)| Step::Move(object, by)),
    ];
    prop::collection::vec(step, 1..80)
}

#[test]
fn expiring_points_go_in_time_or_are_renewed() {
    let mut store = PointStore::new(100).expect("capacity");
    let (near, far) = (Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.0, 0.0, -9.0));
    put(&mut store, &point(near, 0));
    put(&mut store, &point(far, 0));
    let expired = store.invalidate_positions(|p| p.z > -5.0, Fate::Expire(3));
    assert_eq!(expired, 1, "only the near one");
    assert_eq!(store.advance(2, 254), 0, "not yet");
    // Again: an age never falls.
    store.invalidate_positions(|p| p.z > -5.0, Fate::Expire(3));
    assert_eq!(store.advance(1, 254), 1, "after three ticks");
    assert_eq!(
        store.iter().next().map(|(_, p)| p.position),
        Some(far),
        "the other stays"
    );
}

#[test]
fn points_rest_until_something_puts_them_in_doubt() {
    let mut store = PointStore::new(100).expect("capacity");
    let (near, far) = (Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.0, 0.0, -9.0));
    put(&mut store, &point(near, 0));
    put(&mut store, &point(far, 0));
    for tick in 0..1000 {
        assert_eq!(store.advance_to_rest(1, 240, 254), 0, "tick {tick}");
    }
    let expired = store.invalidate_positions(|p| p.z > -5.0, Fate::Expire(3));
    assert_eq!(expired, 1, "only the near one");
    let gone: Vec<usize> = (0..4).map(|_| store.advance_to_rest(1, 240, 254)).collect();
    assert_eq!(gone, [0, 0, 1, 0], "that one goes in time, the other never");
}

proptest! {
    /// Against a plain list of points and ages.
    #[test]
    fn does_what_a_list_does(steps in steps()) {
        let mut store = PointStore::new(100).expect("capacity");
        let mut model: Vec<(u32, Point, u8)> = Vec::new();
        for step in steps {
            let apply = |model: &mut Vec<(u32, Point, u8)>, fate: Fate, hit: &dyn Fn(&Point) -> bool| {
                let count = model.iter().filter(|(_, p, _)| hit(p)).count();
                match fate {
                    Fate::Remove => model.retain(|(_, p, _)| !hit(p)),
                    Fate::Age(ticks) => {
                        for (_, p, age) in model.iter_mut() {
                            *age = if hit(p) { age.saturating_add(ticks) } else { *age };
                        }
                    }
                    Fate::Expire(ticks) => {
                        for (_, _, age) in model.iter_mut().filter(|(_, p, _)| hit(p)) {
                            *age = (*age).max(255 - ticks);
                        }
                    }
                }
                count
            };
            match step {
                Step::Insert(p) => {
                    let slot = put(&mut store, &p);
                    prop_assert!(model.iter().all(|(s, _, _)| *s != slot), "a slot of its own");
                    model.push((slot, p, 0));
                }
                Step::Advance(ticks, limit) => {
                    for (_, _, age) in &mut model {
                        *age = age.saturating_add(ticks);
                    }
                    let before = model.len();
                    model.retain(|(_, _, age)| *age <= limit);
                    prop_assert_eq!(store.advance(ticks, limit), before - model.len());
                }
                Step::Object(object, fate) => {
                    let count = apply(&mut model, fate, &|p| p.object == object);
                    prop_assert_eq!(store.invalidate_object(object, fate), count);
                }
                Step::Lights(lights, fate) => {
                    let count = apply(&mut model, fate, &|p| p.lights & lights != 0);
                    prop_assert_eq!(store.invalidate_lights(lights, fate), count);
                }
                Step::Box(min, max, fate) => {
                    let inside = |p: &Point| (0..3).all(|i| min[i] <= p.position[i] && p.position[i] <= max[i]);
                    let count = apply(&mut model, fate, &inside);
                    prop_assert_eq!(store.invalidate_box(min, max, fate), count);
                }
                Step::Where(x, fate) => {
                    let count = apply(&mut model, fate, &|p| p.position.x < x);
                    prop_assert_eq!(store.invalidate_where(|p| p.position.x < x, fate), count);
                }
                Step::Move(object, by) => {
                    let mut count = 0;
                    for (_, p, _) in model.iter_mut().filter(|(_, p, _)| p.object == object) {
                        p.position += by;
                        count += 1;
                    }
                    prop_assert_eq!(store.move_object(object, &Affine3A::from_translation(by)), count);
                }
            }
            prop_assert_eq!(store.len(), model.len());
        }
        model.sort_by_key(|(slot, _, _)| *slot);
        let found: Vec<_> = store.iter().map(|(slot, p)| (slot, p, store.age(slot).unwrap_or(0))).collect();
        prop_assert_eq!(found, model);
    }
}
