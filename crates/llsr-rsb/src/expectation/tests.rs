//! The closed forms against the paper, against integration cell by cell and against each other.

use super::*;

/// Table 1 of OF99, with the sign of its last cell corrected.
fn table_1(tests: u32, lambda: f64) -> f64 {
    let quadratic = |a: f64, b: f64, c: f64| a + b * lambda + c * lambda * lambda;
    match (tests, lambda) {
        (1, _) => quadratic(1.0 / 4.0, 1.0 / 2.0, 0.0),
        (2, ..=0.5) => quadratic(1.0 / 8.0, 1.0 / 4.0, 1.0),
        (2, _) => quadratic(-3.0 / 8.0, 9.0 / 4.0, -1.0),
        (_, ..=0.25) => quadratic(1.0 / 16.0, 1.0 / 8.0, 49.0 / 18.0),
        (_, ..=0.5) => quadratic(13.0 / 144.0, 41.0 / 72.0, 1.0 / 2.0),
        (_, ..=0.75) => quadratic(-23.0 / 144.0, 113.0 / 72.0, -1.0 / 2.0),
        _ => quadratic(-275.0 / 144.0, 401.0 / 72.0, -49.0 / 18.0),
    }
}

#[test]
fn random_seed_agrees_with_table_1() {
    for tests in 1..=3 {
        for i in 0..=1000 {
            let lambda = f64::from(i) / 1000.0;
            let (ours, table) = (
                expected_estimate(Method::RandomSeed, tests, lambda),
                table_1(tests, lambda),
            );
            assert!(
                (ours - table).abs() < 1e-14,
                "n = {tests}, lambda = {lambda}: {ours} against {table}"
            );
        }
    }
}

/// Bias and mean square error of random seed bisection by integrating over the seed cell by cell.
fn by_cells(tests: u32, lambda: f64) -> (f64, f64) {
    let cells = 2f64.powi(tests as i32 - 1);
    let mut breaks = vec![0.0, lambda, 1.0];
    for k in 1..cells as u32 {
        let k = f64::from(k);
        breaks.push((cells * lambda / k).clamp(lambda, 1.0));
        breaks.push(1.0 - (cells * (1.0 - lambda) / k).clamp(1.0 - lambda, 1.0));
    }
    breaks.sort_by(f64::total_cmp);
    let (mut bias, mut square) = (0.0, 0.0);
    for pair in breaks.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let middle = 0.5 * (from + to);
        let (lo, hi) = if middle < lambda {
            (middle, 1.0)
        } else {
            (0.0, middle)
        };
        let k = ((lambda - lo) / (hi - lo) * cells).floor().min(cells - 1.0);
        let share = (k + 0.5) / cells;
        let error = |s: f64| {
            if middle < lambda {
                s + (1.0 - s) * share - lambda
            } else {
                s * share - lambda
            }
        };
        let (a, b) = (error(from), error(to));
        bias += (to - from) * 0.5 * (a + b);
        square += (to - from) * (a * a + a * b + b * b) / 3.0;
    }
    (bias, square)
}

#[test]
fn random_seed_agrees_with_integration_cell_by_cell() {
    for tests in 1..=12 {
        for i in 0..=97 {
            let lambda = f64::from(i) / 97.0;
            let (bias, square) = by_cells(tests, lambda);
            let ours = seed::bias(tests, lambda);
            assert!(
                (ours - bias).abs() < 1e-13,
                "bias, n = {tests}, lambda = {lambda}: {ours} {bias}"
            );
            let ours = seed::mean_square_error(tests, lambda);
            assert!(
                (ours - square).abs() < 1e-10 * square,
                "square, n = {tests}, lambda = {lambda}: {ours} {square}"
            );
        }
    }
}

#[test]
fn random_seed_is_symmetric_continuous_and_converges_for_many_tests() {
    for tests in [1, 2, 7, 15, 30, 49, 50, 51, 4_000_000] {
        for i in 0..=64 {
            let lambda = f64::from(i) / 64.0;
            let here = expected_estimate(Method::RandomSeed, tests, lambda);
            let there = expected_estimate(Method::RandomSeed, tests, 1.0 - lambda);
            assert!(
                (here + there - 1.0).abs() < 1e-15,
                "n = {tests}, lambda = {lambda}"
            );
            let bound = 0.5f64.powi(tests.min(50) as i32);
            assert!(
                (here - lambda).abs() <= bound,
                "n = {tests}, lambda = {lambda}: {here}"
            );
            let just_below = expected_estimate(Method::RandomSeed, tests, lambda.next_down());
            assert!(
                (here - just_below).abs() < 1e-14,
                "n = {tests}: a jump at {lambda}"
            );
        }
        // The mean square error, averaged over lambda, has a short closed form of its own.
        if tests <= 50 {
            let steps = 20_000;
            let mean = (0..steps)
                .map(|i| {
                    mean_square_error(Method::RandomSeed, tests, (f64::from(i) + 0.5) / f64::from(steps))
                })
                .sum::<f64>()
                / f64::from(steps);
            let closed = average_mean_square_error(Method::RandomSeed, Stop::Tests(tests));
            assert!(
                (mean / closed - 1.0).abs() < 2e-3,
                "n = {tests}: {mean} against {closed}"
            );
        }
    }
}

#[test]
fn random_cut_length_agrees_with_the_closed_forms_there_are() {
    for i in 0..=40 {
        let x = f64::from(i) / 40.0;
        let q = x * (1.0 - x);
        let one = expected_bracket_length(Method::RandomCut, 1, x);
        assert!((one - (0.5 + q)).abs() < 1e-13, "one cut at {x}: {one}");
        let log = |x: f64| if x > 0.0 { x * x * x.ln() } else { 0.0 };
        let two = expected_bracket_length(Method::RandomCut, 2, x);
        let closed = 0.25 + 2.5 * q + log(x) + log(1.0 - x);
        assert!(
            (two - closed).abs() < 1e-13,
            "two cuts at {x}: {two} against {closed}"
        );
    }
    for tests in [1, 3, 8, 20] {
        let steps = 200;
        let mean = (0..steps)
            .map(|i| {
                let x = (f64::from(i) + 0.5) / f64::from(steps);
                expected_bracket_length(Method::RandomCut, tests, x)
            })
            .sum::<f64>()
            / f64::from(steps);
        let closed = average_bracket_length(Method::RandomCut, tests);
        assert!(
            (mean / closed - 1.0).abs() < 2e-4,
            "n = {tests}: {mean} against {closed}"
        );
    }
}

#[test]
fn without_a_test_every_estimate_is_the_middle() {
    for method in Method::ALL {
        assert_eq!(expected_estimate(method, 0, 0.9), 0.5, "{method:?}");
        assert_eq!(expected_bracket_length(method, 0, 0.9), 1.0, "{method:?}");
        assert_eq!(average_bracket_length(method, 0), 1.0, "{method:?}");
    }
    assert!(
        (mean_square_error(Method::RandomCut, 0, 0.9) - 0.16).abs() < 1e-15,
        "no cut"
    );
    assert!(
        (mean_square_error(Method::Dithered, 0, 0.9) - 0.16).abs() < 1e-15,
        "no lattice"
    );
}

#[test]
fn places_outside_the_bracket_count_as_its_ends() {
    for method in Method::ALL {
        assert_eq!(
            expected_estimate(method, 3, -2.0),
            expected_estimate(method, 3, 0.0),
            "{method:?}"
        );
        assert_eq!(
            expected_estimate(method, 3, 7.0),
            expected_estimate(method, 3, 1.0),
            "{method:?}"
        );
        assert!(expected_estimate(method, 3, f64::NAN).is_nan(), "{method:?}");
    }
}

#[test]
fn averages_to_a_tolerance_agree_with_those_for_a_number_of_tests() {
    // A tolerance that is a power of two is reached by bisection after so many tests, and never passed by.
    for n in 1..20 {
        let stop = Stop::Tolerance(0.5f64.powi(n as i32 + 1));
        for method in [Method::Bisection, Method::Jittered, Method::Dithered] {
            let (here, there) = (average_tests(method, stop), average_tests(method, Stop::Tests(n)));
            assert_eq!(here, there, "tests of {method:?}, n = {n}");
            let (here, there) = (
                average_mean_square_error(method, stop),
                average_mean_square_error(method, Stop::Tests(n)),
            );
            assert_eq!(here, there, "error of {method:?}, n = {n}");
        }
    }
    for method in Method::ALL {
        for stop in [
            Stop::Tolerance(0.5),
            Stop::Tolerance(7.0),
            Stop::Tests(0),
            Stop::Budget(0),
        ] {
            assert_eq!(average_tests(method, stop), 0.0, "{method:?}, {stop:?}");
            let whole = if method == Method::Jittered {
                1.0 / 6.0
            } else {
                1.0 / 12.0
            };
            assert_eq!(
                average_mean_square_error(method, stop),
                whole,
                "{method:?}, {stop:?}"
            );
        }
        for stop in [
            Stop::Tolerance(f64::NAN),
            Stop::Tolerance(-1.0),
            Stop::Tests(u32::MAX),
        ] {
            assert!(average_tests(method, stop) >= 50.0, "{method:?}, {stop:?}");
            assert!(
                average_mean_square_error(method, stop) > 0.0,
                "{method:?}, {stop:?}"
            );
        }
    }
    assert_eq!(
        average_tests(Method::Dithered, Stop::Budget(4)),
        4.0,
        "a budget is kept"
    );
    let budget = average_mean_square_error(Method::Dithered, Stop::Budget(4));
    assert!(
        (budget * 12.0 * 225.0 - 1.0).abs() < 1e-15,
        "cells of 1/15: {budget}"
    );
}
