//! The corpus through both finders.

use llsr_rsb::{Method, Stop};
use llsr_tdf::{ChangeCoherence, Coherence, Finder, FinderScratch, Shift, Tdf, TdfScratch};
use llsr_testkit::visibility::{Case, corpus};
use llsr_visibility::{Certificate, Partition};
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Repetitions of each case, each with other random numbers and the pixel before remembered.
const PIXELS: u32 = 50;

fn check(case: &Case, partition: &Partition, tolerance: f64, search: &str) {
    let found: Vec<_> = partition.changes().collect();
    let truth: Vec<f64> = case.changes.clone();
    // A change within the tolerance of an end of the light may be moved onto it.
    let at_end = |t: f64| t <= tolerance || t >= 1.0 - tolerance;
    let sure = truth.iter().filter(|&&t| !at_end(t)).count();
    assert!(
        (sure..=truth.len()).contains(&found.len()),
        "{search}, {}: {found:?} for {truth:?}",
        case.id()
    );
    for change in &found {
        let near = truth
            .iter()
            .any(|t| (t - change.t).abs() <= change.uncertainty + 1e-15);
        assert!(near, "{search}, {}: {change:?} for {truth:?}", case.id());
        assert!(
            change.uncertainty <= tolerance * 2.0,
            "{search}, {}: {change:?}",
            case.id()
        );
    }
    let bound = tolerance * 2.0 * truth.len() as f64;
    assert!(
        (partition.measure() - case.visible).abs() <= bound + 1e-15,
        "{search}, {}",
        case.id()
    );
    assert_eq!(
        partition.certificate(),
        Certificate::Sampled,
        "{search}, {}",
        case.id()
    );
}

#[test]
fn the_two_discontinuity_finder_solves_every_case_with_up_to_two_wide_runs() {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    let (mut scratch, mut partition) = (TdfScratch::new(), Partition::dark());
    for case in corpus().iter().filter(|case| case.is_for("tdf")) {
        for method in Method::ALL {
            for tolerance in [0.05, 1e-6] {
                let tdf = Tdf {
                    method,
                    stop: Stop::Tolerance(tolerance),
                    nu: 0.25,
                    search_rest: true,
                };
                let mut coherence = Coherence::new();
                for _ in 0..PIXELS {
                    let mut oracle = case.steps();
                    let report = tdf.find(
                        &mut oracle,
                        &mut coherence,
                        &mut rng,
                        &mut scratch,
                        &mut partition,
                    );
                    check(case, &partition, tolerance, method.name());
                    assert_eq!(
                        usize::from(report.discontinuities),
                        case.changes.len(),
                        "{}",
                        case.id()
                    );
                    assert_eq!(
                        usize::from(coherence.state()),
                        case.changes.len(),
                        "{}",
                        case.id()
                    );
                }
            }
        }
    }
}

#[test]
fn the_finder_solves_every_case_with_runs_wider_than_nu() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let (mut scratch, mut partition) = (FinderScratch::new(), Partition::dark());
    for case in corpus().iter().filter(|case| case.is_for("finder")) {
        for epsilon in [0.05, 1e-3, 1e-9] {
            let finder = Finder {
                epsilon,
                nu: 1.0 / 64.0,
            };
            let mut coherence = ChangeCoherence::new();
            for _ in 0..PIXELS {
                let mut oracle = case.steps();
                let shift = Shift::from_rng(&mut rng);
                let report = finder.find(&mut oracle, &mut coherence, shift, &mut scratch, &mut partition);
                check(case, &partition, epsilon, "finder");
                assert_eq!(
                    report.discontinuities as usize,
                    case.changes.len(),
                    "{}",
                    case.id()
                );
                assert!(
                    report.widest_untested <= finder.nu + 1e-15,
                    "{}: {report:?}",
                    case.id()
                );
            }
        }
    }
}
