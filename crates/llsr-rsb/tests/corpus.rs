//! The corpus through every bisection.

use llsr_rsb::{Method, Stop, bisect};
use llsr_testkit::visibility::corpus;
use llsr_visibility::Bracket;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

#[test]
fn every_method_brackets_a_change_where_the_ends_differ() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let mut cases = 0;
    for case in corpus().iter().filter(|case| case.is_for("one")) {
        let mut oracle = case.steps();
        if oracle.at(0.0) == oracle.at(1.0) {
            continue;
        }
        cases += 1;
        for method in Method::ALL {
            for stop in [
                Stop::Tests(4),
                Stop::Budget(7),
                Stop::Tolerance(0.05),
                Stop::Tolerance(1e-9),
            ] {
                for _ in 0..50 {
                    let unit = Bracket::new(0.0, 1.0, oracle.at(0.0));
                    let found = bisect(method, &mut oracle, unit, stop, &mut rng);
                    let near = case.changes.iter().find(|&&t| found.bracket.contains(t));
                    let Some(change) = near else {
                        panic!("{}, {method:?}: {found:?}", case.id())
                    };
                    assert!(
                        (found.estimate - change).abs() <= found.uncertainty(),
                        "{}, {method:?}: {found:?}",
                        case.id()
                    );
                    if let Stop::Tolerance(tolerance) = stop {
                        assert!(
                            0.5 * found.bracket.len() <= tolerance * (1.0 + 1e-6),
                            "{}: {found:?}",
                            case.id()
                        );
                    }
                }
            }
        }
    }
    assert!(cases >= 8, "only {cases} cases have ends that differ");
}
