//! Lights with planted changes, a few ulps apart or at an end among them, through both finders.

use llsr_rsb::{Method, Stop};
use llsr_tdf::{ChangeCoherence, Coherence, Finder, FinderScratch, Shift, Tdf, TdfScratch};
use llsr_testkit::visibility::{Steps, any_steps};
use llsr_visibility::{Change, Partition, Visibility};
use proptest::collection::vec;
use proptest::prelude::*;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Notes every question and refuses those outside the light.
struct Noting<'a> {
    steps: &'a Steps,
    asked: Vec<f64>,
}

impl Visibility for Noting<'_> {
    fn visible(&mut self, t: f64) -> bool {
        assert!((0.0..=1.0).contains(&t), "asked at {t}");
        self.asked.push(t);
        self.steps.at(t)
    }
}

fn noting(steps: &Steps) -> Noting<'_> {
    Noting {
        steps,
        asked: Vec::new(),
    }
}

/// Every change found must be one, and no stretch wider than `widest_untested` be without a test.
fn check(steps: &Steps, asked: &mut [f64], partition: &Partition, widest_untested: f64) {
    let changes: Vec<_> = partition.changes().collect();
    asked.sort_unstable_by(f64::total_cmp);
    let widest = asked.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    assert!(
        widest <= widest_untested,
        "{widest} untested, {widest_untested} reported"
    );
    for change in &changes {
        let near = steps
            .changes
            .iter()
            .any(|t| (t - change.t).abs() <= change.uncertainty + 1e-15);
        assert!(near, "{change:?} is no change of {steps:?}");
    }
}

fn method() -> impl Strategy<Value = Method> {
    prop_oneof![
        prop::sample::select(Method::ALL.to_vec()),
        (-2.0..2.0f64).prop_map(Method::DitheredAt)
    ]
}

fn stop() -> impl Strategy<Value = Stop> {
    prop_oneof![
        prop::sample::select(vec![
            Stop::Tolerance(0.05),
            Stop::Tolerance(0.3),
            Stop::Tolerance(1e-9)
        ]),
        prop::sample::select(vec![Stop::Tolerance(0.0), Stop::Tolerance(f64::NAN)]),
        (0u32..8).prop_map(Stop::Tests),
        (0u32..8).prop_map(Stop::Budget),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn two_discontinuity_finder(
        pixels in vec(any_steps(), 1..6),
        method in method(),
        stop in stop(),
        nu in prop_oneof![Just(0.25), 0.01..1.5f64],
        search_rest: bool,
        seed: u64,
    ) {
        let tdf = Tdf { method, stop, nu, search_rest };
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let (mut coherence, mut scratch, mut partition) = (Coherence::new(), TdfScratch::new(), Partition::lit());
        for steps in &pixels {
            let mut oracle = noting(steps);
            let before = coherence.state();
            let report = tdf.find(&mut oracle, &mut coherence, &mut rng, &mut scratch, &mut partition);
            prop_assert_eq!(report.state, before);
            prop_assert_eq!(oracle.asked.len() as u32, report.end_tests + report.inner_tests, "tests");
            prop_assert_eq!(scratch.found().len(), usize::from(report.discontinuities), "found");
            check(steps, &mut oracle.asked, &partition, report.widest_untested);
            prop_assert_eq!(report.certain, report.widest_untested <= nu + 4.5e-16, "{:?}", report);
            // With both ends alike, certainty and nothing found, no run is wider than nu.
            if report.discontinuities == 0 && report.certain {
                let others = steps.runs().iter().filter(|run| run.2 != steps.at(0.0)).map(|run| run.1 - run.0).fold(0.0, f64::max);
                prop_assert!(others <= nu, "{} missed in {:?}", others, steps);
            }
            if search_rest && report.discontinuities == 0 {
                prop_assert!(report.certain, "{:?}", report);
            }
        }
    }

    #[test]
    fn finder_for_any_number(
        pixels in vec(any_steps(), 1..6),
        epsilon in prop_oneof![Just(0.05), 1e-6..0.6f64, Just(0.0), Just(f64::NAN)],
        nu in prop_oneof![Just(0.25), 0.01..1.5f64],
        lattice in prop_oneof![Just(0.0), -1.0..2.0f64],
        cover in 0.0..1.0f64,
    ) {
        let finder = Finder { epsilon, nu };
        let (mut coherence, mut scratch, mut partition) =
            (ChangeCoherence::new(), FinderScratch::new(), Partition::lit());
        for steps in &pixels {
            let mut oracle = noting(steps);
            let shift = Shift { lattice, cover };
            let report = finder.find(&mut oracle, &mut coherence, shift, &mut scratch, &mut partition);
            prop_assert_eq!(oracle.asked.len() as u32, report.end_tests + report.inner_tests, "tests");
            check(steps, &mut oracle.asked, &partition, report.widest_untested);
            prop_assert!(report.widest_untested <= nu + 1e-15, "{:?}", report);
            // The result contradicts no answer.
            for &t in &oracle.asked {
                let at_change = |end: f64| (end - t).abs() <= 1e-15;
                let on_an_end = partition.changes().any(|c| at_change(c.t)) || at_change(0.0) || at_change(1.0);
                prop_assert!(on_an_end || partition.contains(t) == steps.at(t), "{} in {:?}", t, partition);
            }
            let mut asked = oracle.asked.clone();
            asked.dedup();
            // A lattice that is not shifted has a point on the end of the light.
            prop_assert!(asked.len() + 1 >= oracle.asked.len(), "asked twice: {:?}", oracle.asked);
            // All runs wide: every change is found, to the tolerance.
            if steps.runs().iter().all(|run| run.1 - run.0 > nu.min(1.0)) {
                let cell = if epsilon > 0.0 { epsilon } else { 1e-12 };
                let found: Vec<_> = partition.changes().collect();
                prop_assert!(found.len() <= steps.changes.len(), "{:?} for {:?}", found, steps);
                for change in steps.partition().changes().filter(|c| cell < c.t && c.t < 1.0 - cell) {
                    let is_same = |found: &&Change| {
                        (found.t - change.t).abs() <= cell + 1e-15 && found.visible_above == change.visible_above
                    };
                    // Others of the kind may lie within the tolerance, too, each to be found once; alone it is exactly one.
                    let of_kind = |other: &Change| {
                        (other.t - change.t).abs() <= 2.0 * (cell + 1e-15) && other.visible_above == change.visible_above
                    };
                    let most = steps.partition().changes().filter(of_kind).count();
                    let matching = found.iter().filter(is_same).count();
                    prop_assert!((1..=most).contains(&matching), "{:?} in {:?}", change, found);
                }
            }
        }
    }
}
