//! The claims: tables and equations of the paper, the closed forms of llsr-rsb, tests made by the finders.
//!
//! OF99 is Ouellette & Fiume 1999. Formulas of the paper are written out here a second time, as printed or as
//! corrected, and share nothing with the crate.

use llsr_rsb::{
    Method, Stop, average_bracket_length, average_mean_square_error, average_tests, bisect,
    expected_bracket_length, expected_estimate, mean_square_error, uniform,
};
use llsr_tdf::{Answer, Coherence, Tdf, TdfScratch};
use llsr_visibility::{Bracket, Partition};
use rand_pcg::Pcg64Mcg;

use super::sampling::Claim;
use super::{Group, SAMPLES};

/// Numbers of tests for which every claim is checked.
const TESTS: std::ops::RangeInclusive<u32> = 1..=8;

/// Gives every claim a stream of its own.
#[derive(Default)]
struct Claims {
    next: u64,
    groups: Vec<Group>,
}

impl Claims {
    fn group(&mut self, name: &'static str) {
        self.groups.push(Group {
            name,
            claims: Vec::new(),
        });
    }

    fn add(&mut self, place: String, claimed: f64, draw: impl FnMut(&mut Pcg64Mcg) -> f64) {
        self.add_with(SAMPLES, place, claimed, draw);
    }

    fn add_with(
        &mut self,
        samples: u32,
        place: String,
        claimed: f64,
        draw: impl FnMut(&mut Pcg64Mcg) -> f64,
    ) {
        let claim = Claim::new(place, self.next, samples, claimed, draw);
        self.next += 1;
        self.groups
            .last_mut()
            .expect("a group is open")
            .claims
            .push(claim);
    }

    /// Claims the expected estimate after `tests` tests of a change at `lambda`.
    fn estimate(&mut self, method: Method, tests: u32, lambda: f64, claimed: f64) {
        let place = format!("{}, {tests} tests, lambda = {lambda:.4}", method.name());
        self.add(place, claimed, |rng| {
            search(method, Stop::Tests(tests), lambda, rng).estimate
        });
    }
}

/// Pure bisection gives the same every time.
fn samples(method: Method) -> u32 {
    if method == Method::Bisection { 2 } else { SAMPLES }
}

/// A search of the whole light for one change, visible below it.
fn search(method: Method, stop: Stop, lambda: f64, rng: &mut Pcg64Mcg) -> llsr_rsb::Found {
    bisect(
        method,
        &mut |t: f64| t <= lambda,
        Bracket::new(0.0, 1.0, true),
        stop,
        rng,
    )
}

/// Places of a change at which a formula is checked, ends included.
fn places(count: u32) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| f64::from(i) / f64::from(count - 1))
}

/// Everything that is to hold.
pub(super) fn true_groups() -> Vec<Group> {
    let mut claims = Claims::default();
    paper(&mut claims);
    closed_forms(&mut claims);
    lengths(&mut claims);
    dithered(&mut claims);
    tests_made(&mut claims);
    claims.groups
}

/// The two formulas that are misprinted, as printed.
pub(super) fn misprints() -> Vec<Group> {
    let mut claims = Claims {
        next: 1_000_000,
        groups: Vec::new(),
    };
    claims.group("Eq. 3, denominator 2^(n+1)");
    for tests in TESTS {
        for lambda in places(5) {
            let printed = (0.5 + lambda * (power(tests) - 1.0)) / power(tests + 1);
            claims.estimate(Method::RandomCut, tests, lambda, printed);
        }
    }
    claims.group("Table 1, last cell + 49/18 lambda^2");
    for i in 0..=8 {
        let lambda = 0.75 + f64::from(i) / 32.0;
        let printed = -275.0 / 144.0 + 401.0 / 72.0 * lambda + 49.0 / 18.0 * lambda * lambda;
        claims.estimate(Method::RandomSeed, 3, lambda, printed);
    }
    claims.groups
}

/// Table 1: number of tests, range of lambda, coefficients of 1, lambda and lambda^2.
const TABLE_1: [(u32, f64, f64, [f64; 3]); 7] = [
    (1, 0.0, 1.0, [1.0 / 4.0, 1.0 / 2.0, 0.0]),
    (2, 0.0, 0.5, [1.0 / 8.0, 1.0 / 4.0, 1.0]),
    (2, 0.5, 1.0, [-3.0 / 8.0, 9.0 / 4.0, -1.0]),
    (3, 0.0, 0.25, [1.0 / 16.0, 1.0 / 8.0, 49.0 / 18.0]),
    (3, 0.25, 0.5, [13.0 / 144.0, 41.0 / 72.0, 1.0 / 2.0]),
    (3, 0.5, 0.75, [-23.0 / 144.0, 113.0 / 72.0, -1.0 / 2.0]),
    (3, 0.75, 1.0, [-275.0 / 144.0, 401.0 / 72.0, -49.0 / 18.0]),
];

/// Table 1 and equations 2 to 4 (with the corrections of `docs/papers/of99.md`).
fn paper(claims: &mut Claims) {
    claims.group("Table 1 (RSB), cell by cell");
    for (tests, low, high, [a, b, c]) in TABLE_1 {
        for share in places(9) {
            let lambda = low + (high - low) * share;
            claims.estimate(
                Method::RandomSeed,
                tests,
                lambda,
                a + b * lambda + c * lambda * lambda,
            );
        }
    }
    claims.group("Eq. 2 (PB), n = 1..8");
    for n in TESTS {
        for lambda in places(33) {
            // The paper counts one more than the tests; lambda = 1 belongs to the last step.
            let step = (power(n - 1) * lambda).floor().min(power(n - 1) - 1.0);
            claims.estimate(Method::Bisection, n - 1, lambda, (2.0 * step + 1.0) / power(n));
        }
    }
    claims.group("Eq. 2 (JB), n = 1..8");
    for n in TESTS {
        for lambda in places(12) {
            let step = (power(n - 1) * lambda).floor().min(power(n - 1) - 1.0);
            claims.estimate(Method::Jittered, n - 1, lambda, (2.0 * step + 1.0) / power(n));
        }
    }
    claims.group("Eq. 3 (RC), corrected, n = 1..8");
    for n in TESTS {
        for lambda in places(12) {
            claims.estimate(
                Method::RandomCut,
                n,
                lambda,
                (0.5 + lambda * (power(n) - 1.0)) / power(n),
            );
        }
    }
    claims.group("Eq. 4 (RSB, n = 2, lambda <= 1/2)");
    for i in 0..=8 {
        let lambda = f64::from(i) / 16.0;
        // The integral of a straight line is its value in the middle times the length.
        let line =
            |from: f64, to: f64, slope: f64, offset: f64| (to - from) * (0.5 * (from + to) * slope + offset);
        let integral = line(0.0, lambda, 0.75, 0.25)
            + line(lambda, 2.0 * lambda, 0.75, 0.0)
            + line(2.0 * lambda, 1.0, 0.25, 0.0);
        claims.estimate(Method::RandomSeed, 2, lambda, integral);
    }
}

/// Expected estimate and mean square error as llsr-rsb states them.
fn closed_forms(claims: &mut Claims) {
    claims.group("expected_estimate, RSB");
    for tests in TESTS.chain([12]) {
        for lambda in places(17) {
            let claimed = expected_estimate(Method::RandomSeed, tests, lambda);
            claims.estimate(Method::RandomSeed, tests, lambda, claimed);
        }
    }
    claims.group("mean_square_error, all methods");
    for method in Method::ALL {
        for tests in TESTS {
            for lambda in places(7) {
                let place = format!("{}, {tests} tests, lambda = {lambda:.4}", method.name());
                let claimed = mean_square_error(method, tests, lambda);
                claims.add_with(samples(method), place, claimed, |rng| {
                    (search(method, Stop::Tests(tests), lambda, rng).estimate - lambda).powi(2)
                });
            }
        }
    }
    claims.group("average_mean_square_error");
    for method in Method::ALL {
        for stop in [
            Stop::Tests(4),
            Stop::Budget(4),
            Stop::Tolerance(0.25),
            Stop::Tolerance(0.05),
        ] {
            let place = format!("{}, {stop:?}", method.name());
            claims.add(place, average_mean_square_error(method, stop), |rng| {
                let lambda = uniform(rng);
                (search(method, stop, lambda, rng).estimate - lambda).powi(2)
            });
        }
    }
}

/// Expected lengths of the last bracket (OF99 sections 3.3 and 3.4).
fn lengths(claims: &mut Claims) {
    claims.group("bracket length at lambda, RC, RSB");
    for method in [Method::RandomCut, Method::RandomSeed] {
        for tests in TESTS {
            for lambda in places(9) {
                let place = format!("{}, {tests} tests, lambda = {lambda:.4}", method.name());
                claims.add(place, expected_bracket_length(method, tests, lambda), |rng| {
                    search(method, Stop::Tests(tests), lambda, rng).bracket.len()
                });
            }
        }
    }
    claims.group("bracket length, mean over lambda");
    for method in Method::ALL {
        for tests in TESTS {
            let printed = match method {
                Method::RandomCut => (2.0f64 / 3.0).powi(tests as i32),
                Method::RandomSeed => 2.0 / 3.0 / power(tests - 1),
                _ => 1.0 / power(tests),
            };
            let stated = average_bracket_length(method, tests);
            assert!(
                (printed - stated).abs() < 1e-15,
                "{method:?}, {tests} tests: {printed} or {stated}"
            );
            let place = format!("{}, {tests} tests", method.name());
            claims.add(place, printed, |rng| {
                let lambda = uniform(rng);
                search(method, Stop::Tests(tests), lambda, rng).bracket.len()
            });
        }
    }
}

/// Dithered bisection has no bias, unless somebody clamps its estimate.
fn dithered(claims: &mut Claims) {
    for (name, stop) in [
        ("dithered, bias at 64 lambda", Stop::Tests(4)),
        ("dithered, bias, exact budget", Stop::Budget(4)),
        ("dithered, bias, tolerance 0.05", Stop::Tolerance(0.05)),
    ] {
        claims.group(name);
        for lambda in places(64) {
            let place = format!("lambda = {lambda:.4}");
            claims.add(place, lambda, |rng| {
                search(Method::Dithered, stop, lambda, rng).estimate
            });
        }
    }
    claims.group("dithered, clamped: bias up to h/8");
    let cell = 1.0 / 16.0;
    for share in places(8) {
        let lambda = 0.5 * cell * share;
        let bias = (0.5 * cell - lambda).powi(2) / (2.0 * cell);
        assert!(bias <= cell / 8.0, "{bias} at {lambda}");
        claims.add(format!("lambda = {lambda:.4}"), lambda + bias, |rng| {
            search(Method::Dithered, Stop::Tests(4), lambda, rng)
                .estimate
                .clamp(0.0, 1.0)
        });
    }
}

/// Numbers of tests.
fn tests_made(claims: &mut Claims) {
    claims.group("average_tests");
    for method in Method::ALL {
        for stop in [
            Stop::Tests(4),
            Stop::Tolerance(0.25),
            Stop::Tolerance(0.05),
            Stop::Tolerance(0.003),
        ] {
            let place = format!("{}, {stop:?}", method.name());
            claims.add(place, average_tests(method, stop), |rng| {
                let lambda = uniform(rng);
                f64::from(search(method, stop, lambda, rng).tests)
            });
        }
    }
    claims.group("Voronoi Search, nu = 0.25: 4.5");
    let tdf = Tdf::default();
    let (mut scratch, mut partition) = (TdfScratch::new(), Partition::dark());
    for visible in [true, false] {
        claims.add(format!("visible: {visible}"), 4.5, |rng| {
            let mut oracle = |_: f64| visible;
            let report = tdf.find(
                &mut oracle,
                &mut Coherence::new(),
                rng,
                &mut scratch,
                &mut partition,
            );
            assert_eq!(report.answer, Answer::NothingFound, "{report:?}");
            f64::from(report.inner_tests)
        });
    }
}

/// 2 to the power of `n`.
fn power(n: u32) -> f64 {
    2f64.powi(n as i32)
}
