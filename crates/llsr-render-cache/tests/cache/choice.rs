//! Priorities, the choice of pixels by error diffusion, and prediction.

use std::collections::BTreeSet;

use glam::Vec3;
use llsr_render_cache::*;
use proptest::prelude::*;

use crate::scene::*;

fn priorities(width: u32, height: u32, value: impl Fn(u32, u32) -> u8) -> Priorities {
    let mut priorities = Priorities::new(width, height).expect("size");
    for y in 0..height {
        for (x, v) in priorities.row_mut(y).iter_mut().enumerate() {
            *v = value(x as u32, y);
        }
    }
    priorities
}

fn choose(priorities: &mut Priorities, count: usize, phase: f64) -> Vec<Request> {
    let (width, height) = priorities.size();
    let mut out = Vec::new();
    Chooser::new(width, height)
        .expect("size")
        .choose(priorities, count, phase, 0, &mut out);
    out
}

#[test]
fn age_rule() {
    let rule = AgeRule {
        young: 10,
        old: 110,
        highest: 200,
    };
    let mut store = PointStore::new(300).expect("capacity");
    let mut image = PointImage::new(16, 16).expect("size");
    for (age, expected) in [(0u8, 0), (10, 0), (11, 2), (60, 100), (110, 200), (255, 200)] {
        store.clear();
        put(&mut store, &point(position(16, 16, 3.5, 2.5, 1.0), 1));
        store.advance(age, 255);
        image.reproject(&store, &view(16, 16), &OFF);
        let mut priorities = Priorities::new(16, 16).expect("size");
        priorities.update(&image, rule, |_| &[0; 16]);
        let found = priorities.row(2)[3];
        assert!(
            found.abs_diff(expected) <= 1,
            "{found} for {expected} at age {age}"
        );
        // Where weight is missing the age does not matter.
        priorities.update(&image, rule, |y| if y == 2 { &[99; 16] } else { &[255; 16] });
        assert_eq!(
            (priorities.row(2)[3], priorities.row(3)[3]),
            (99, 255),
            "as the interpolation says"
        );
    }
    for rule in [
        AgeRule {
            young: 255,
            old: 0,
            highest: 255,
        },
        AgeRule {
            young: 7,
            old: 7,
            highest: 255,
        },
    ] {
        let mut priorities = Priorities::new(16, 16).expect("size");
        priorities.update(&image, rule, |_| &[0; 16]);
        let young = u8::from(rule.young == 7) * 255;
        assert_eq!(priorities.row(2)[3], young, "no span to be linear over: {rule:?}");
    }
}

#[test]
fn gaps_are_as_a_3x3_filter_finds_them() {
    let (width, height) = (21u32, 10u32);
    let mut random = Random(5);
    let mut store = PointStore::new(500).expect("capacity");
    let there: Vec<bool> = (0..width * height).map(|_| random.next() < 0.3).collect();
    for (i, _) in there.iter().enumerate().filter(|(_, there)| **there) {
        let (x, y) = ((i as u32 % width) as f32 + 0.5, (i as u32 / width) as f32 + 0.5);
        put(&mut store, &point(position(width, height, x, y, 2.0), 1));
    }
    let mut image = PointImage::new(width, height).expect("size");
    image.reproject(&store, &view(width, height), &OFF);
    let mut priorities = Priorities::new(width, height).expect("size");
    priorities.update_by_gaps(&image, AgeRule::default());
    for y in 0..height as i32 {
        for x in 0..width as i32 {
            let mut weight = 0;
            for (dx, dy) in (-1..2).flat_map(|dx| (-1..2).map(move |dy| (dx, dy))) {
                let (x, y) = (x + dx, y + dy);
                let inside = x >= 0 && y >= 0 && x < width as i32 && y < height as i32;
                if inside && there[(y * width as i32 + x) as usize] {
                    weight += (2 - dx.abs()) * (2 - dy.abs());
                }
            }
            let own = there[(y * width as i32 + x) as usize];
            let expected = if own { 0 } else { 255 - 20 * weight };
            assert_eq!(
                i32::from(priorities.row(y as u32)[x as usize]),
                expected,
                "({x}, {y})"
            );
        }
    }
}

#[test]
fn pending_pixels_wait() {
    let mut wanted = priorities(32, 32, |_, _| 255);
    let mut chooser = Chooser::new(32, 32).expect("size");
    let image = PointImage::new(32, 32).expect("size");
    let mut seen = BTreeSet::new();
    let mut requests = Vec::new();
    for round in 0..4 {
        chooser.choose(&mut wanted, 200, 0.0, 3, &mut requests);
        assert_eq!(requests.len(), 200, "round {round}");
        assert!(
            requests.iter().all(|r| seen.insert(*r)),
            "none is asked for twice while it is under way"
        );
        wanted.update_by_gaps(&image, AgeRule::default());
    }
    // The first ones are due again.
    chooser.choose(&mut wanted, 1024, 0.0, 0, &mut requests);
    assert_eq!(
        requests.len(),
        1024 - 3 * 200,
        "three rounds less one are still under way"
    );
}

#[test]
fn saturated_and_sparse_priorities() {
    // 30 pixels of 255 among 1: a plain share would have to take each of them several times.
    let value = |x: u32, y: u32| if y == 3 && x < 30 { 255 } else { 1 };
    let chosen = choose(&mut priorities(64, 64, value), 100, 0.3);
    let unique: BTreeSet<_> = chosen.iter().copied().collect();
    assert_eq!(
        (chosen.len(), unique.len()),
        (100, 100),
        "as many as asked for, none twice"
    );
    let strong = chosen.iter().filter(|r| value(r.x, r.y) == 255).count();
    assert_eq!(strong, 30, "all of those that matter");
    // Fewer pixels than wanted: all of them, and no other.
    let few = |x: u32, y: u32| u8::from((x * y) % 50 == 7) * (x as u8 + 1);
    let chosen: BTreeSet<_> = choose(&mut priorities(50, 41, few), 1000, 0.9)
        .into_iter()
        .collect();
    let all = (0..50)
        .flat_map(|x| (0..41).map(move |y| Request { x, y }))
        .filter(|r| few(r.x, r.y) > 0);
    assert_eq!(chosen, all.collect(), "every pixel that wants anything");
    assert!(
        choose(&mut priorities(9, 9, |_, _| 0), 10, 0.0).is_empty(),
        "nobody wants anything"
    );
    assert!(
        choose(&mut priorities(9, 9, |_, _| 9), 0, 0.0).is_empty(),
        "nothing may be asked for"
    );
}

#[test]
fn spreads_better_than_chance() {
    // Mean distance to the nearest other chosen pixel: for random pixels it is 0.5 / sqrt(density).
    let chosen = choose(&mut priorities(256, 256, |_, _| 200), 655, 0.5);
    let distance = |a: &Request| {
        let to = |b: &Request| f64::from(a.x.abs_diff(b.x)).hypot(f64::from(a.y.abs_diff(b.y)));
        chosen.iter().filter(|b| *b != a).map(to).fold(f64::MAX, f64::min)
    };
    let mean = chosen.iter().map(distance).sum::<f64>() / chosen.len() as f64;
    let chance = 0.5 * (65536.0 / 655.0f64).sqrt();
    assert!(mean > 1.3 * chance, "{mean} pixels apart, by chance {chance}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// As many as asked for, and in every aligned square its share to less than one.
    #[test]
    fn every_square_gets_its_share(seed in any::<u64>(), count in 1..500usize, phase in 0.0..1.0f64) {
        let mut random = Random(seed);
        let noise: Vec<u8> = (0..64 * 64).map(|_| 20 + random.below(40) as u8).collect();
        let value = |x: u32, y: u32| if x > 40 { noise[(y * 64 + x) as usize] * 4 } else { noise[(y * 64 + x) as usize] };
        let mut wanted = priorities(64, 64, value);
        let chosen = choose(&mut wanted, count, phase);
        prop_assert_eq!(chosen.len(), count);
        prop_assert_eq!(chosen.iter().collect::<BTreeSet<_>>().len(), count);
        let total: f64 = (0..64).flat_map(|y| (0..64).map(move |x| f64::from(value(x, y)))).sum();
        // No pixel needs more than one.
        prop_assume!(240.0 * count as f64 <= total);
        for side in [4, 8, 16, 32, 64] {
            for (sx, sy) in (0..64 / side).flat_map(|sx| (0..64 / side).map(move |sy| (sx * side, sy * side))) {
                let inside = |r: &&Request| (sx..sx + side).contains(&r.x) && (sy..sy + side).contains(&r.y);
                let found = chosen.iter().filter(inside).count() as f64;
                let pixels = (sx..sx + side).flat_map(|x| (sy..sy + side).map(move |y| (x, y)));
                let share = count as f64 * pixels.map(|(x, y)| f64::from(value(x, y))).sum::<f64>() / total;
                prop_assert!((found - share).abs() < 1.0 + 1e-6, "{} for {} in {} at {} {}", found, share, side, sx, sy);
            }
        }
    }

    /// Over all phases each pixel is chosen in proportion to its priority.
    #[test]
    fn choice_is_proportional(seed in any::<u64>(), shift in 0.0..1.0f64) {
        let mut random = Random(seed);
        let values: Vec<u8> = (0..16 * 16).map(|_| random.below(100) as u8).collect();
        let mut wanted = priorities(16, 16, |x, y| values[(y * 16 + x) as usize]);
        let (count, phases) = (20, 500);
        let mut found = vec![0; 256];
        for i in 0..phases {
            let phase = (shift + f64::from(i) / f64::from(phases)).fract();
            for r in choose(&mut wanted, count, phase) {
                found[(r.y * 16 + r.x) as usize] += 1;
            }
        }
        let total: f64 = values.iter().map(|&v| f64::from(v)).sum();
        for (f, v) in found.iter().zip(&values) {
            let expected = f64::from(phases) * count as f64 * f64::from(*v) / total;
            // Phases are a regular grid: the count of those in an interval is off by less than one, at each end.
            prop_assert!((f64::from(*f) - expected).abs() <= 2.0, "{} for {}", f, expected);
        }
    }
}

#[test]
fn prediction_finds_what_will_come_into_view() {
    // A wall sampled from straight ahead; the camera is about to turn to the left by 0.3.
    let (width, height) = (160, 120);
    let mut random = Random(2);
    let mut store = PointStore::new(20_000).expect("capacity");
    for _ in 0..20_000 {
        let (x, y) = (random.next() * width as f32, random.next() * height as f32);
        put(&mut store, &point(position(width, height, x, y, 4.0), 1));
    }
    let mut prediction = Prediction::new(width, height).expect("size");
    let mut requests = Vec::new();
    for share in [1, 4] {
        let now = view(width, height);
        prediction.update(&store, &now, share, 3, 13);
        assert!(
            prediction.uncovered() < 0.01,
            "{} of the present view",
            prediction.uncovered()
        );
        let turned = matrix(Vec3::ZERO, 0.3);
        let next = View::new(&turned, width, height).expect("size");
        prediction.update(&store, &next, share, 5, 13);
        let uncovered = prediction.uncovered();
        assert!((0.1..0.6).contains(&uncovered), "{uncovered} of the coming view");
        prediction.choose(50, 0.7, &mut requests);
        assert_eq!(requests.len(), 50, "as many as asked for");
        let known: Vec<_> = store
            .iter()
            .filter_map(|(_, p)| next.project(p.position))
            .collect();
        let covered = |r: &&Request| {
            let near = |k: &&Projected| k.x.abs_diff(r.x) <= 2 && k.y.abs_diff(r.y) <= 2;
            known.iter().filter(near).count() > 8
        };
        // A covered place has 26 points around; cells at the border of what is covered have fewer.
        let wasted = requests.iter().filter(covered).count();
        assert!(wasted <= 3, "{wasted} of 50 requests where points are");
        let cells: BTreeSet<_> = requests.iter().map(|r| (r.x / 8, r.y / 8)).collect();
        assert_eq!(cells.len(), 50, "one a cell");
    }
    // Odd sizes: requests stay in the picture.
    let mut prediction = Prediction::new(13, 9).expect("size");
    let empty = PointStore::new(1).expect("capacity");
    prediction.update(&empty, &view(13, 9), 0, 0, 0);
    for i in 0..64 {
        prediction.choose(100, f64::from(i) / 64.0, &mut requests);
        assert_eq!(requests.len(), 4, "one in each cell");
        assert!(requests.iter().all(|r| r.x < 13 && r.y < 9), "{requests:?}");
    }
}
