//! Proptest strategies that plant the answer.

use proptest::collection::vec;
use proptest::prelude::*;

use super::Steps;

/// A place of a change: anywhere, at an end of the light, a few ulps from a round number, or tiny.
fn place() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => 0.0..=1.0f64,
        1 => Just(0.0),
        1 => Just(1.0),
        1 => (1u32..16, -3i32..=3).prop_map(|(i, ulps)| nudged(f64::from(i) / 16.0, ulps)),
        1 => (1u32..4).prop_map(|ulps| nudged(0.0, ulps as i32)),
        1 => (1u32..4).prop_map(|ulps| nudged(1.0, -(ulps as i32))),
        1 => (1i32..1000).prop_map(|power| 0.5f64.powi(power)),
    ]
}

/// A light with `count` changes, some of them a few ulps apart or at an end.
pub fn steps_with(count: usize) -> impl Strategy<Value = Steps> {
    (any::<bool>(), vec((place(), any::<bool>(), 0i32..4), count)).prop_map(|(visible_at_start, places)| {
        let mut changes: Vec<f64> = Vec::new();
        for (place, beside, ulps) in places {
            // Some changes lie beside the one before.
            match changes.last() {
                Some(&last) if beside && ulps > 0 => changes.push(nudged(last, ulps).min(1.0)),
                _ => changes.push(place),
            }
        }
        Steps::new(visible_at_start, changes)
    })
}

/// A light with 0, 1, 2, 3 or 7 changes.
pub fn any_steps() -> impl Strategy<Value = Steps> {
    prop_oneof![
        steps_with(0),
        steps_with(1),
        steps_with(2),
        steps_with(3),
        steps_with(7)
    ]
}

/// `x` moved by so many ulps.
fn nudged(mut x: f64, ulps: i32) -> f64 {
    for _ in 0..ulps.abs() {
        x = if ulps > 0 { x.next_up() } else { x.next_down() };
    }
    x
}
