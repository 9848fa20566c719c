//! Which heuristic of the two-discontinuity finder answers, and what that costs.

use llsr_rsb::{Method, Stop};
use llsr_tdf::{Answer, Coherence, Tdf, TdfReport, TdfScratch};
use llsr_testkit::visibility::{Steps, rows};
use llsr_visibility::{Panel, Partition};
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Runs the finder over pixels that follow each other.
fn walk(tdf: &Tdf, seed: u64, pixels: &[Steps]) -> Vec<TdfReport> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let (mut coherence, mut scratch, mut partition) =
        (Coherence::new(), TdfScratch::new(), Partition::dark());
    let mut find = |pixel: &Steps| {
        let mut oracle = pixel.clone();
        tdf.find(
            &mut oracle,
            &mut coherence,
            &mut rng,
            &mut scratch,
            &mut partition,
        )
    };
    pixels.iter().map(&mut find).collect()
}

fn post(from: f64, to: f64) -> Steps {
    Steps::behind(&[[from, to]])
}

#[test]
fn voronoi_search_of_an_empty_light_takes_four_or_five_tests() {
    // A seed in the outer quarters leaves a stretch of more than 3/4 (3 tests); any other one stretch of more
    // than 1/2 (3 tests) and one of more than 1/4 (1 test).
    let tdf = Tdf::default();
    let mut tests = 0;
    for seed in 0..2000 {
        let report = walk(&tdf, seed, &[post(2.0, 3.0)])[0];
        assert!((4..=5).contains(&report.inner_tests), "{report:?}");
        assert_eq!(report.answer, Answer::NothingFound, "{report:?}");
        assert!(report.certain && report.widest_untested < 0.25, "{report:?}");
        tests += report.inner_tests;
    }
    // 4.5 on average; the deviation of a mean of 2000 is 0.011.
    assert!(
        (tests as f64 / 2000.0 - 4.5).abs() < 0.06,
        "{tests} tests in 2000 searches"
    );
}

#[test]
fn ties_of_voronoi_search_are_broken_by_the_stream() {
    // After the seed, the four quarters of the wider stretch tie two by two; a blocker in one of them is met
    // sooner or later.
    let mut counts = [0; 8];
    for seed in 0..400 {
        let report = walk(
            &Tdf {
                stop: Stop::Tests(0),
                ..Tdf::default()
            },
            seed,
            &[post(0.6, 0.85)],
        )[0];
        assert_eq!(report.answer, Answer::Voronoi0, "{report:?}");
        counts[report.inner_tests as usize] += 1;
    }
    assert!(
        counts[1..=4].iter().all(|&count| count > 10),
        "tests until found: {counts:?}"
    );
}

#[test]
fn each_state_uses_its_heuristic() {
    let tdf = Tdf::default();
    let (wall, lit) = (post(0.7, 2.0), post(2.0, 3.0));
    let answers = |pixels: &[Steps]| {
        walk(&tdf, 5, pixels)
            .iter()
            .map(|r| (r.state, r.answer))
            .collect::<Vec<_>>()
    };

    // The hidden end comes out: the rest of the shadow is between the change and that end.
    let found = answers(&[wall.clone(), post(0.72, 0.98)]);
    assert_eq!(
        found,
        [(0, Answer::EndsDiffer), (1, Answer::Midpoint1)],
        "wall to post"
    );
    // It is there, but not in the middle.
    let found = answers(&[post(0.2, 2.0), post(0.9, 0.98)]);
    assert!(
        found[1] == (1, Answer::Voronoi1) || found[1] == (1, Answer::NothingFound),
        "a thin post is met at best: {found:?}"
    );
    // The other way round: t = 0 comes out.
    let found = answers(&[post(-1.0, 0.3), post(0.02, 0.28)]);
    assert_eq!(found[1], (1, Answer::Midpoint1), "wall to post below");
    // The visible end becomes hidden.
    let found = answers(&[post(-1.0, 0.3), Steps::behind(&[[-1.0, 0.3], [0.98, 2.0]])]);
    assert_eq!(found[1], (1, Answer::Midpoint1), "wall to slit");

    let found = answers(&[post(0.3, 0.7), post(0.32, 0.72), lit.clone(), wall]);
    assert!(matches!(found[0], (0, Answer::Voronoi0)), "first pixel");
    assert_eq!(
        found[1..],
        [
            (2, Answer::Midpoint2),
            (2, Answer::NothingFound),
            (0, Answer::EndsDiffer)
        ],
        "post, nothing, wall"
    );
    // A post that leaps: the old midpoint is lit.
    assert_eq!(
        answers(&[post(0.1, 0.4), post(0.6, 0.95)])[1],
        (2, Answer::Voronoi2),
        "leap"
    );
}

#[test]
fn a_gap_beside_the_searched_stretch_is_missed_but_not_in_silence() {
    // State P = 1 searches from the old change at 0.9 to t = 1; the post at 0.2 to 0.6 is wider than nu.
    let pixels = [post(0.9, 2.0), post(0.2, 0.6)];
    let missed = walk(&Tdf::default(), 1, &pixels)[1];
    assert_eq!(
        (missed.state, missed.answer),
        (1, Answer::NothingFound),
        "{missed:?}"
    );
    assert!(!missed.certain && missed.widest_untested > 0.4, "{missed:?}");

    let searching = Tdf {
        search_rest: true,
        ..Tdf::default()
    };
    let found = walk(&searching, 1, &pixels)[1];
    assert_eq!(
        (found.answer, found.discontinuities),
        (Answer::Rest1, 2),
        "{found:?}"
    );
    // With nothing there the option makes sure of it.
    let nothing = walk(&searching, 1, &[post(0.9, 2.0), post(2.0, 3.0)])[1];
    assert_eq!(nothing.answer, Answer::NothingFound, "{nothing:?}");
    assert!(nothing.certain, "{nothing:?}");
}

#[test]
fn three_changes_with_ends_that_differ_are_not_certain() {
    let report = walk(&Tdf::default(), 1, &[Steps::behind(&[[-1.0, 0.1], [0.5, 0.8]])])[0];
    assert_eq!(
        (report.answer, report.discontinuities),
        (Answer::EndsDiffer, 1),
        "{report:?}"
    );
    assert!(!report.certain, "{report:?}");
}

#[test]
fn coherence_answers_for_smooth_rows_without_voronoi_search() {
    // Of the pixels in state 1 or 2 that have a change to find, at most 2% may need Voronoi Search or fail.
    for name in ["post", "slit"] {
        let (mut coherent, mut with_changes) = (0, 0);
        for (seed, row) in rows(32).iter().filter(|row| row.name == name).enumerate() {
            for (report, pixel) in walk(&Tdf::default(), seed as u64, &row.pixels)
                .iter()
                .zip(&row.pixels)
            {
                let found_or_missed =
                    pixel.at(0.0) == pixel.at(1.0) && pixel.partition().discontinuities() == 2;
                if report.state > 0 && found_or_missed {
                    with_changes += 1;
                    coherent += u32::from(report.coherent());
                }
            }
        }
        assert!(with_changes > 500, "{name}: {with_changes} pixels");
        let share = f64::from(coherent) / f64::from(with_changes);
        assert!(share >= 0.98, "{name}: {share}");
    }
}

#[test]
fn what_another_search_found_is_remembered() {
    let mut coherence = Coherence::new();
    let mut partition = Partition::dark();
    partition.insert(Panel::exact(0.0, 0.25));
    partition.insert(Panel::exact(0.75, 1.0));
    coherence.remember(&partition);
    assert_eq!(
        (coherence.state(), coherence.changes()),
        (2, &[0.25, 0.75][..]),
        "two"
    );
    partition.insert(Panel::exact(0.4, 0.5));
    coherence.remember(&partition);
    assert_eq!(coherence.state(), 0, "four changes have no state");

    // P = 1 needs to know which end turned.
    for (panel, now, turned) in [
        (Panel::exact(0.0, 0.6), post(0.62, 0.98), Answer::Midpoint1),
        (Panel::exact(0.6, 1.0), post(0.02, 0.58), Answer::Midpoint1),
    ] {
        partition.clear();
        partition.insert(panel);
        coherence.remember(&partition);
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let report = Tdf::default().find(
            &mut now.clone(),
            &mut coherence,
            &mut rng,
            &mut TdfScratch::new(),
            &mut Partition::dark(),
        );
        assert_eq!((report.state, report.answer), (1, turned), "{panel:?}");
    }
}

#[test]
fn impossible_tolerances_end() {
    for nu in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
        let report = walk(&Tdf { nu, ..Tdf::default() }, 1, &[post(2.0, 3.0)])[0];
        assert!(report.certain, "{report:?}");
        assert!((65_536..=131_072).contains(&report.inner_tests), "{report:?}");
    }
    let report = walk(
        &Tdf {
            nu: f64::INFINITY,
            ..Tdf::default()
        },
        1,
        &[post(2.0, 3.0)],
    )[0];
    assert_eq!(
        report.inner_tests, 1,
        "the random test is always made: {report:?}"
    );
    let report = walk(
        &Tdf {
            method: Method::RandomCut,
            stop: Stop::Tolerance(0.0),
            ..Tdf::default()
        },
        1,
        &[post(0.5, 2.0)],
    )[0];
    assert!(report.inner_tests < 200, "{report:?}");
}
