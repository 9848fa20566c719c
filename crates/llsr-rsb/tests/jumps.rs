//! The jumps of the staircase against the expected estimate and against searches.

use llsr_rsb::{Method, Stop, expected_estimate, jumps, pure_bisection};
use llsr_visibility::Bracket;

#[test]
fn every_jump_is_one_and_there_are_no_others() {
    for tests in 0..=10 {
        // OF99 section 3.1: 2^(n-1) - 1 discontinuities, n - 1 tests.
        let all: Vec<_> = jumps(Method::Bisection, tests).collect();
        assert_eq!(all.len(), (1 << tests) - 1, "{tests} tests");
        for jump in &all {
            let at = |lambda| expected_estimate(Method::Bisection, tests, lambda);
            assert_eq!(at(jump.lambda.next_down()), jump.below, "below {jump:?}");
            assert_eq!(at(jump.lambda), jump.above, "at {jump:?}");
            let search = |lambda: f64| {
                let unit = Bracket::new(0.0, 1.0, true);
                pure_bisection(&mut |t: f64| t <= lambda, unit, Stop::Tests(tests)).estimate
            };
            assert_eq!(
                search(jump.lambda.next_down()),
                jump.below,
                "search below {jump:?}"
            );
            assert_eq!(search(jump.lambda), jump.above, "search at {jump:?}");
        }
        // From the top of each step to the bottom of the next nothing happens.
        for pair in all.windows(2) {
            assert_eq!(pair[0].above, pair[1].below, "{pair:?}");
            assert!(pair[0].lambda < pair[1].lambda, "{pair:?}");
        }
        assert_eq!(
            jumps(Method::Jittered, tests).collect::<Vec<_>>(),
            all,
            "jitter changes no mean"
        );
    }
    for method in [
        Method::RandomCut,
        Method::RandomSeed,
        Method::Dithered,
        Method::DitheredAt(0.5),
    ] {
        assert_eq!(jumps(method, 5).count(), 0, "{method:?}");
    }
}

#[test]
fn very_many_tests_are_cut_short() {
    let first = jumps(Method::Bisection, u32::MAX).next().expect("a jump");
    assert_eq!(first.lambda, 0.5f64.powi(52), "{first:?}");
    assert!(
        first.below < first.lambda && first.lambda < first.above,
        "{first:?}"
    );
}
