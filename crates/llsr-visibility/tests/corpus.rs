//! The corpus through union, complement and the oracle.

use llsr_testkit::visibility::{brute_force, corpus};
use llsr_visibility::{Certificate, Panel, Partition};

#[test]
fn the_complement_of_the_union_of_blockers_is_what_is_visible() {
    let mut visible = Partition::lit();
    for case in corpus().iter().filter(|case| case.is_for("partition")) {
        let mut blocked = Partition::dark();
        for &[from, to] in &case.blocked {
            blocked.insert(Panel::exact(from, to));
        }
        blocked.complement_into(&mut visible);
        let changes: Vec<f64> = visible.changes().map(|change| change.t).collect();
        assert_eq!(changes, case.changes, "{}", case.id());
        assert_eq!(visible.discontinuities(), case.changes.len(), "{}", case.id());
        assert!(
            (visible.measure() - case.visible).abs() < 1e-15,
            "{}: {}",
            case.id(),
            visible.measure()
        );
        assert_eq!(visible.certificate(), Certificate::Exact, "{}", case.id());

        // The complement of the complement, and the light as an oracle, say the same.
        let mut twice = Partition::dark();
        visible.complement_into(&mut twice);
        assert_eq!(twice, blocked, "{}", case.id());
        let steps = case.steps();
        assert_eq!(steps.changes, case.changes, "{}", case.id());
        assert_eq!(steps.partition(), visible, "{}", case.id());
    }
}

#[test]
fn dense_tests_meet_every_change() {
    for case in corpus().iter().filter(|case| case.is_for("brute")) {
        let found = brute_force(&mut case.steps(), 4096);
        assert_eq!(found.len(), case.changes.len(), "{}", case.id());
        for (&(from, to, visible), &change) in found.iter().zip(&case.changes) {
            assert!(
                from <= change && change <= to,
                "{}: {change} not in [{from}, {to}]",
                case.id()
            );
            assert_eq!(visible, case.steps().at(to), "{}", case.id());
        }
    }
}
