//! Changes planted anywhere, a few ulps apart and at ends, in brackets that are any part of the light.

use llsr_rsb::{Found, Method, Stop, bisect, dithered_bisection};
use llsr_testkit::visibility::{Steps, any_steps};
use llsr_visibility::{Bracket, Counting};
use proptest::prelude::*;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

fn method() -> impl Strategy<Value = Method> {
    prop_oneof![
        prop::sample::select(Method::ALL.to_vec()),
        (-2.0..2.0f64).prop_map(Method::DitheredAt)
    ]
}

/// A search of [`lo`, `hi`] if its ends differ, with the tests it made.
fn search(steps: &Steps, lo: f64, hi: f64, method: Method, stop: Stop, seed: u64) -> Option<(Found, u32)> {
    if steps.at(lo) == steps.at(hi) {
        return None;
    }
    let mut oracle = Counting::new(|t: f64| {
        assert!(lo < t && t < hi, "asked at {t}, outside of {lo} to {hi}");
        steps.at(t)
    });
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let found = bisect(
        method,
        &mut oracle,
        Bracket::new(lo, hi, steps.at(lo)),
        stop,
        &mut rng,
    );
    Some((found, oracle.tests()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn the_bracket_holds_a_change_and_the_estimate(
        steps in any_steps(),
        ends in (0.0..=1.0f64, 0.0..=1.0f64, 0u8..4),
        method in method(),
        stop in prop_oneof![
            (0u32..12).prop_map(Stop::Tests),
            (0u32..12).prop_map(Stop::Budget),
            (1e-6..0.7f64).prop_map(Stop::Tolerance),
            prop::sample::select(vec![0.0, -1.0, f64::NAN]).prop_map(Stop::Tolerance),
        ],
        seed: u64,
    ) {
        let (a, b, whole) = ends;
        // Mostly the whole light, as changes at its ends are otherwise seldom inside.
        let (lo, hi) = if whole > 0 { (0.0, 1.0) } else { (a.min(b), a.max(b)) };
        let Some((found, tests)) = search(&steps, lo, hi, method, stop, seed) else { return Ok(()) };
        prop_assert_eq!(found.tests, tests, "tests");
        let Bracket { lo: from, hi: to, visible_at_lo } = found.bracket;
        prop_assert!(from <= found.estimate && found.estimate <= to, "{:?}", found);
        prop_assert_eq!(visible_at_lo, steps.at(lo), "direction");
        let enclosed = |slack: f64| steps.changes.iter().any(|&t| from - slack <= t && t <= to + slack);
        prop_assert!(enclosed(0.0), "{:?} in {:?}", found, steps);
        // Beyond the first bracket only by less than a cell.
        let width = found.bracket.len();
        prop_assert!(lo - width < from || from == lo, "{:?}", found);
        prop_assert!(to < hi + width || to == hi, "{:?}", found);
        let dithered = matches!(method, Method::Dithered | Method::DitheredAt(_));
        if !dithered {
            prop_assert!(lo <= from && to <= hi, "{:?}", found);
            prop_assert_eq!(steps.at(from), steps.at(lo), "lower end");
            prop_assert_eq!(steps.at(to), steps.at(hi), "upper end");
        }
        match stop {
            Stop::Tests(n) => prop_assert!(tests <= n + u32::from(dithered), "{} of {}", tests, n),
            Stop::Budget(n) => prop_assert!(tests <= n, "{} of {}", tests, n),
            Stop::Tolerance(tolerance) if tolerance > 0.0 => {
                prop_assert!(0.5 * width <= tolerance * (1.0 + 1e-12), "{:?}", found);
            }
            // All the precision there is: neighbouring numbers, or a lattice of 2^-48 or eight ulps.
            Stop::Tolerance(_) if dithered => prop_assert!(width <= (hi - lo) * 0.5f64.powi(48) + 2e-15, "{:?}", found),
            Stop::Tolerance(_) => prop_assert!(from.next_up() >= to, "{:?}", found),
        }
    }

    #[test]
    fn a_single_change_is_estimated_to_the_tolerance(
        change in prop_oneof![0.0..1.0f64, Just(0.0), Just(0.5), (1i32..1070).prop_map(|p| 0.5f64.powi(p))],
        method in method(),
        tolerance in 1e-9..0.6f64,
        visible_at_start: bool,
        seed: u64,
    ) {
        let steps = Steps::new(visible_at_start, [change]);
        let Some((found, _)) = search(&steps, 0.0, 1.0, method, Stop::Tolerance(tolerance), seed) else { return Ok(()) };
        let bound = if method == Method::Jittered { 2.0 } else { 1.0 } * tolerance;
        prop_assert!((found.estimate - change).abs() <= bound, "{:?} for {}", found, change);
    }

    #[test]
    fn shifts_count_modulo_one(change in 0.01..0.99f64, shift in 0.0..1.0f64, n in 1u32..10) {
        let run = |shift: f64| {
            dithered_bisection(&mut |t: f64| t <= change, Bracket::new(0.0, 1.0, true), Stop::Tests(n), shift)
        };
        let (here, there) = (run(shift), run(shift - 3.0));
        prop_assert!((here.estimate - there.estimate).abs() < 1e-12 , "{:?} {:?}", here, there);
    }
}

#[test]
fn degenerate_brackets_and_shifts() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let ulp = 0.5f64.next_up();
    for method in Method::ALL {
        for stop in [
            Stop::Tests(5),
            Stop::Budget(5),
            Stop::Tolerance(0.0),
            Stop::Tolerance(1e-3),
        ] {
            for (lo, hi) in [(0.5, 0.5), (0.5, ulp), (0.0, 5e-324), (0.0, 1e-320)] {
                let mut visible = |t: f64| {
                    assert!(
                        lo < t && t < hi,
                        "{method:?}, {stop:?}: asked at {t}, outside of {lo} to {hi}"
                    );
                    t < hi
                };
                let found = bisect(method, &mut visible, Bracket::new(lo, hi, true), stop, &mut rng);
                assert!(
                    found.bracket.lo <= hi && hi <= found.bracket.hi,
                    "{method:?}, {stop:?}: {found:?}"
                );
            }
        }
    }
    for shift in [f64::NAN, f64::INFINITY, -1e-300, 1.0, 1e300, -0.0] {
        let unit = Bracket::new(0.0, 1.0, true);
        let found = dithered_bisection(&mut |t: f64| t <= 0.3, unit, Stop::Tests(5), shift);
        assert!(
            found.bracket.contains(0.3) && found.tests <= 6,
            "{shift}: {found:?}"
        );
        assert_eq!(found.bracket.len(), 1.0 / 32.0, "{shift}: {found:?}");
    }
}

#[test]
fn no_search_is_endless() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for method in Method::ALL {
        for stop in [
            Stop::Tests(u32::MAX),
            Stop::Budget(u32::MAX),
            Stop::Tolerance(f64::NEG_INFINITY),
        ] {
            for change in [0.0, 5e-324, 1e-300, 0.3, 1.0f64.next_down()] {
                let unit = Bracket::new(0.0, 1.0, true);
                let found = bisect(method, &mut |t: f64| t <= change, unit, stop, &mut rng);
                assert!(found.bracket.contains(change), "{method:?}: {found:?}");
                assert!(found.tests <= 1600, "{method:?}: {found:?}");
            }
        }
    }
}

#[test]
fn a_budget_is_kept_to_the_test() {
    for n in 1..=12 {
        for i in 0..200 {
            let (shift, change) = ((f64::from(i) + 0.5) / 200.0, (f64::from(i) * 0.618).fract());
            let unit = Bracket::new(0.0, 1.0, true);
            let found = dithered_bisection(&mut |t: f64| t <= change, unit, Stop::Budget(n), shift);
            assert_eq!(found.tests, n, "{found:?}");
        }
    }
}
