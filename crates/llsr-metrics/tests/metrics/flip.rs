//! FLIP against its authors' evaluator, against a slow transcription of the paper, and by properties.

use crate::common::{busy, picture, slow_flip, step};
use llsr_metrics::{Error, ErrorMap, Flip, Image};
use proptest::prelude::*;

fn map(width: usize, a: &[[f32; 3]], b: &[[f32; 3]], ppd: f64) -> ErrorMap {
    let height = a.len() / width;
    let image = |pixels| Image::new(width, height, pixels).expect("size fits");
    Flip::new(ppd)
        .expect("in range")
        .map(image(a), image(b))
        .expect("finite")
}

/// Values printed by the authors' evaluator (Python package flip-evaluator 1.7, `evaluate` with "LDR",
/// `inputsRGB=False`) for the same pictures: mean, and the pixels (0, 0), (30, 20), (39, 47).
#[test]
fn agrees_with_the_authors_evaluator() {
    let rows = [
        (
            40,
            busy(40, 90, 1),
            busy(40, 90, 2),
            67.0,
            0.353_560_4,
            [0.774_322_1, 0.393_764_3, 0.304_267_5],
        ),
        (
            40,
            busy(40, 90, 1),
            busy(40, 90, 2),
            30.0,
            0.649_431_9,
            [0.820_081_1, 0.970_023_6, 0.403_966_4],
        ),
        (
            64,
            step(64, 48, 80),
            step(64, 48, 83),
            67.0,
            0.064_269_1,
            [0.0, 0.611_438_4, 0.0],
        ),
        (
            64,
            step(64, 48, 80),
            step(64, 48, 83),
            30.0,
            0.050_087_8,
            [0.0, 0.851_356_2, 0.0],
        ),
    ];
    for (width, a, b, ppd, mean, pixels) in rows {
        let map = map(width, &a, &b, ppd);
        assert!(
            (map.mean() - mean).abs() < 2e-5,
            "mean {} for {mean} at {ppd}",
            map.mean()
        );
        for ((x, y), expected) in [(0, 0), (30, 20), (39, 47)].into_iter().zip(pixels) {
            let found = map.values()[y * width + x];
            assert!(
                (found - expected).abs() < 3e-4,
                "({x}, {y}): {found} for {expected} at {ppd}"
            );
        }
    }
}

/// Taller than a band of scan lines at the lower resolution, and smaller than a filter at the higher.
#[test]
fn agrees_with_two_dimensional_filters() {
    for (width, height, ppd) in [(12, 150, 20.0), (31, 17, 67.0), (1, 1, 67.0), (3, 2, 120.0)] {
        let (a, b) = (busy(width, height, 3), busy(width, height, 5));
        let found = map(width, &a, &b, ppd);
        for (i, (f, s)) in found
            .values()
            .iter()
            .zip(slow_flip(width, height, &a, &b, ppd))
            .enumerate()
        {
            assert!(
                (f64::from(*f) - s).abs() < 2e-4,
                "pixel {i} of {width} x {height}: {f} for {s}"
            );
        }
    }
}

#[test]
fn worst_pairs_reach_one() {
    // Two flat pictures have no features, and green against blue is the largest colour difference there is.
    let (green, blue) = ([[0.0, 1.0, 0.0]; 12], [[0.0, 0.0, 1.0]; 12]);
    let map = map(4, &green, &blue, 67.0);
    assert!((map.mean() - 1.0).abs() < 1e-5, "{}", map.mean());
}

#[test]
fn resolution_is_checked() {
    for ppd in [0.0, 0.99, 1000.1, -67.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Flip::new(ppd), Err(Error::PixelsPerDegree(_))), "{ppd}");
    }
    assert!(
        Flip::new(1.0).is_ok() && Flip::new(1000.0).is_ok(),
        "the ends of the range work"
    );
}

#[cfg(feature = "rayon")]
#[test]
fn threads_do_not_change_bits() {
    let (a, b) = (busy(65, 700, 1), busy(65, 700, 4));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("pool");
        pool.install(|| map(65, &a, &b, 67.0))
    };
    assert_eq!(with(1), with(3), "one and three threads");
}

prop_compose! {
    fn pair()(width in 1..20usize, height in 1..20usize)
        (a in prop::collection::vec(prop::array::uniform3(-0.2..1.2f32), width * height),
         b in prop::collection::vec(prop::array::uniform3(-0.2..1.2f32), width * height),
         width in Just(width)) -> (usize, Vec<[f32; 3]>, Vec<[f32; 3]>) {
        (width, a, b)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn is_a_bounded_symmetric_difference((width, a, b) in pair(), ppd in 1.0..150.0f64) {
        let there = map(width, &a, &b, ppd);
        prop_assert!(there.values().iter().all(|v| (0.0..=1.0).contains(v)));
        prop_assert_eq!(&there, &map(width, &b, &a, ppd), "order of the two");
        let same = map(width, &a, &a, ppd);
        prop_assert!(same.values().iter().all(|v| *v == 0.0), "equal images");
        let (x, y) = there.largest();
        let largest = there.values()[y * width + x];
        prop_assert!(there.values().iter().all(|v| *v <= largest));
        prop_assert!(f64::from(largest) >= there.mean() - 1e-6);
    }

    /// Turning both pictures turns the map: filters have no direction and both borders are treated alike.
    #[test]
    fn follows_reflections((width, a, b) in pair()) {
        let height = a.len() / width;
        let straight = map(width, &a, &b, 67.0);
        let turn = |p: &[[f32; 3]]| picture(height, width, |x, y| p[(height - 1 - x) * width + y]);
        let turned = map(height, &turn(&a), &turn(&b), 67.0);
        for x in 0..height {
            for y in 0..width {
                let s = straight.values()[(height - 1 - x) * width + y];
                let t = turned.values()[y * height + x];
                prop_assert!((s - t).abs() < 2e-3, "{s} and {t}");
            }
        }
    }
}
