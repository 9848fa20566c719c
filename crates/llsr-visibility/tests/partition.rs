//! Partitions against a list of points that are in or out.

use llsr_visibility::{Bracket, ByRef, Certificate, Counting, Panel, Partition, Visibility};
use proptest::collection::vec;
use proptest::prelude::*;

/// Ends of panels: sixteenths, so that many coincide, from outside [0, 1] too.
fn end() -> impl Strategy<Value = f64> {
    (-8i32..=24).prop_map(|i| f64::from(i) / 16.0)
}

proptest! {
    #[test]
    fn a_union_covers_what_its_panels_cover(panels in vec((end(), end()), 0..12)) {
        let mut union = Partition::dark();
        for &(start, end) in &panels {
            union.insert(Panel::exact(start, end));
        }
        let mut rest = Partition::lit();
        union.complement_into(&mut rest);
        // Between the sixteenths no panel ends.
        for i in 0..16 {
            let t = (f64::from(i) + 0.5) / 16.0;
            let covered = panels.iter().any(|&(start, end)| start < t && t < end);
            prop_assert_eq!(union.contains(t), covered, "{} in {:?}", t, union);
            prop_assert_eq!(rest.contains(t), !covered, "{} in {:?}", t, rest);
        }
        prop_assert!((union.measure() + rest.measure() - 1.0).abs() < 1e-15, "measures");
        prop_assert_eq!(union.discontinuities(), rest.discontinuities(), "changes");
        for panels in [union.panels(), rest.panels()] {
            prop_assert!(panels.iter().all(|p| 0.0 <= p.start && p.start < p.end && p.end <= 1.0), "ends");
            prop_assert!(panels.windows(2).all(|pair| pair[0].end < pair[1].start), "order");
        }
    }

    #[test]
    fn the_order_of_insertion_does_not_matter(mut panels in vec((end(), end(), 0u8..4), 0..8)) {
        let union = |panels: &[(f64, f64, u8)]| {
            let mut union = Partition::dark();
            for &(start, end, uncertainty) in panels {
                let uncertainty = f64::from(uncertainty);
                union.insert(Panel { start, end, start_uncertainty: uncertainty, end_uncertainty: uncertainty });
            }
            union
        };
        let forwards = union(&panels);
        panels.reverse();
        prop_assert_eq!(forwards, union(&panels));
    }

    #[test]
    fn merging_is_inserting_all(a in vec((end(), end()), 0..6), b in vec((end(), end()), 0..6)) {
        let union = |panels: &[(f64, f64)]| {
            let mut union = Partition::dark();
            panels.iter().for_each(|&(start, end)| union.insert(Panel::exact(start, end)));
            union
        };
        let mut merged = union(&a);
        merged.merge(&union(&b));
        prop_assert_eq!(merged, union(&[a, b].concat()));
    }
}

#[test]
fn what_is_no_interval_is_left_out() {
    let mut partition = Partition::dark();
    for (start, end) in [
        (f64::NAN, 0.5),
        (0.2, f64::NAN),
        (0.7, 0.3),
        (0.4, 0.4),
        (1.0, 2.0),
        (-1.0, 0.0),
    ] {
        partition.insert(Panel::exact(start, end));
        partition.push(Panel::exact(start, end));
    }
    assert!(partition.is_dark(), "{partition:?}");
    partition.insert(Panel::exact(f64::NEG_INFINITY, f64::INFINITY));
    assert!(partition.is_lit(), "{partition:?}");
    assert_eq!(
        partition.discontinuities(),
        0,
        "the ends of the light are no changes"
    );
}

#[test]
fn ends_cut_at_the_light_are_exact_and_the_surer_of_two_equal_ends_stays() {
    let sure = |start, end, uncertainty| Panel {
        start,
        end,
        start_uncertainty: uncertainty,
        end_uncertainty: uncertainty,
    };
    let mut partition = Partition::dark();
    partition.insert(sure(-0.5, 0.25, 0.125));
    partition.insert(sure(0.0, 0.25, 0.0625));
    let panel = partition.panels()[0];
    assert_eq!(
        (panel.start_uncertainty, panel.end_uncertainty),
        (0.0, 0.0625),
        "{panel:?}"
    );
}

#[test]
fn a_panel_pushed_onto_its_neighbour_joins_it() {
    let mut partition = Partition::dark();
    partition.push(Panel::exact(0.1, 0.2));
    partition.push(Panel {
        end_uncertainty: 0.01,
        ..Panel::exact(0.2, 0.3)
    });
    partition.push(Panel::exact(0.5, 0.6));
    assert_eq!(partition.panels().len(), 2, "{partition:?}");
    assert_eq!(
        partition.panels()[0],
        Panel {
            end_uncertainty: 0.01,
            ..Panel::exact(0.1, 0.3)
        },
        "joined"
    );
    let directions: Vec<bool> = partition.changes().map(|change| change.visible_above).collect();
    assert_eq!(directions, [true, false, true, false], "changes alternate");
}

#[test]
fn refilling_restores_the_certificate() {
    let mut partition = Partition::dark();
    partition.insert(Panel::exact(0.1, 0.2));
    partition.set_certificate(Certificate::Sampled);
    partition.fill();
    assert_eq!(partition, Partition::lit(), "filled");
    partition.set_certificate(Certificate::BoundedGaps(0.1));
    partition.clear();
    assert_eq!(partition, Partition::dark(), "cleared");
}

#[test]
fn the_weaker_certificate_stays() {
    use Certificate::{BoundedGaps, Exact, Sampled};
    let ascending = [Exact, BoundedGaps(0.1), BoundedGaps(0.2), Sampled];
    for (i, &a) in ascending.iter().enumerate() {
        for (j, &b) in ascending.iter().enumerate() {
            assert_eq!(a.weaker(b), ascending[i.max(j)], "{a:?} and {b:?}");
        }
        assert_eq!(
            a.weaker(BoundedGaps(f64::NAN)),
            Sampled,
            "a bound that is no number promises nothing"
        );
        assert_eq!(
            BoundedGaps(f64::NAN).weaker(a),
            Sampled,
            "a bound that is no number promises nothing"
        );
    }
    assert_eq!(ascending.map(Certificate::level), [0, 1, 1, 2], "levels");
}

#[test]
fn a_bracket_keeps_the_half_with_the_change() {
    let bracket = Bracket::new(0.25, 0.75, false);
    assert_eq!(
        bracket.narrowed(0.5, false),
        Bracket::new(0.5, 0.75, false),
        "change above"
    );
    assert_eq!(
        bracket.narrowed(0.5, true),
        Bracket::new(0.25, 0.5, false),
        "change below"
    );
    assert_eq!(
        (bracket.len(), bracket.midpoint()),
        (0.5, 0.5),
        "length and midpoint"
    );
    assert!(
        bracket.contains(0.25) && bracket.contains(0.75) && !bracket.contains(0.8),
        "ends included"
    );
}

#[test]
fn every_question_is_counted_once() {
    let mut oracle = |t: f64| t < 0.5;
    let mut counting = Counting::new(ByRef(&mut oracle));
    let mut answers = [false; 3];
    counting.visible_each(&[0.1, 0.6, 0.4], &mut answers);
    assert_eq!(answers, [true, false, true], "answers in order");
    assert!(!counting.visible(0.9), "one more");
    assert_eq!(counting.tests(), 4, "questions asked");
    assert!(counting.into_inner().visible(0.2), "the oracle comes back");
}

#[test]
#[should_panic(expected = "one answer per question")]
fn answers_without_questions_are_refused() {
    (|_: f64| true).visible_each(&[0.1], &mut [false; 2]);
}
