//! What the finder for any number of changes promises beyond the single pixel.

use llsr_tdf::{ChangeCoherence, Finder, FinderReport, FinderScratch, Shift};
use llsr_testkit::visibility::{Row, Steps, rows};
use llsr_visibility::{Partition, Visibility};
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Runs the finder along rows; calls `see` with each report, result and truth.
fn walk(finder: &Finder, rows: &[Row], mut see: impl FnMut(FinderReport, &Partition, &Steps)) {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let (mut scratch, mut partition) = (FinderScratch::new(), Partition::dark());
    for row in rows {
        let mut coherence = ChangeCoherence::new();
        for pixel in &row.pixels {
            let mut oracle = pixel.clone();
            let shift = Shift::from_rng(&mut rng);
            let report = finder.find(&mut oracle, &mut coherence, shift, &mut scratch, &mut partition);
            see(report, &partition, pixel);
        }
    }
}

fn of_kind(name: &str) -> Vec<Row> {
    rows(32).into_iter().filter(|row| row.name == name).collect()
}

#[test]
fn tests_per_pixel_stay_low() {
    // Measured: 4.0, 4.9, 5.6, 5.6, 7.6; the two end tests come on top.
    for (name, bound) in [
        ("lit", 4.0),
        ("wall", 5.1),
        ("post", 5.9),
        ("slit", 5.9),
        ("rail", 8.0),
    ] {
        let (mut tests, mut pixels) = (0, 0);
        walk(&Finder::default(), &of_kind(name), |report, _, _| {
            tests += report.inner_tests;
            pixels += 1;
        });
        let mean = f64::from(tests) / f64::from(pixels);
        assert!(mean <= bound, "{name}: {mean} tests a pixel");
    }
}

#[test]
fn wide_runs_are_followed_and_narrow_ones_seldom_lost() {
    // A change within half a cell of an end of the light may be moved onto the end, so not all counts agree.
    for (name, bound) in [
        ("lit", 0.0),
        ("wall", 0.01),
        ("post", 0.015),
        ("rail", 0.05),
        ("wire", 0.04),
    ] {
        let (mut wrong, mut pixels) = (0, 0);
        walk(&Finder::default(), &of_kind(name), |_, partition, truth| {
            wrong += u32::from(partition.discontinuities() != truth.partition().discontinuities());
            pixels += 1;
        });
        let share = f64::from(wrong) / f64::from(pixels);
        assert!(share <= bound, "{name}: {share} of the pixels");
    }
}

#[test]
fn the_visible_width_is_unbiased_inside_the_light() {
    // Two changes half a light from each other and from the ends by more than a cell, with the pixel before
    // remembered: the mean error vanishes wherever the changes lie.
    let finder = Finder::default();
    let (mut scratch, mut partition) = (FinderScratch::new(), Partition::dark());
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    const PIXELS: u32 = 20_000;
    for i in 0..16 {
        let lo = 0.15 + 0.2 * f64::from(i) / 16.0;
        let truth = Steps::behind(&[[lo, lo + 0.5]]);
        let mut coherence = ChangeCoherence::new();
        let (mut low, mut width) = (0.0, 0.0);
        for _ in 0..PIXELS {
            let shift = Shift::from_rng(&mut rng);
            finder.find(
                &mut truth.clone(),
                &mut coherence,
                shift,
                &mut scratch,
                &mut partition,
            );
            low += partition.panels()[0].end - lo;
            width += partition.measure() - truth.measure();
        }
        // Uniform in a cell of 1/16 each: deviation 0.018 and less than twice that. Six deviations of the mean.
        let deviation = 1.0 / 16.0 / 12f64.sqrt() / f64::from(PIXELS).sqrt();
        assert!(
            (low / f64::from(PIXELS)).abs() < 6.0 * deviation,
            "lower change at {lo}: {low}"
        );
        assert!(
            (width / f64::from(PIXELS)).abs() < 12.0 * deviation,
            "width from {lo}: {width}"
        );
    }
}

#[test]
fn thin_blockers_keep_their_width_on_average() {
    // Down to far less than a cell of 1/16, once met. What bias there is (up to 4%) comes from runs whose step is
    // changed by what was measured with it.
    let finder = Finder {
        nu: 1.0,
        ..Finder::default()
    };
    let (mut scratch, mut partition) = (FinderScratch::new(), Partition::dark());
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    for width in [0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.13] {
        let truth = Steps::behind(&[[0.43, 0.43 + width]]);
        let mut coherence = ChangeCoherence::new();
        coherence.remember(&truth.partition());
        let (mut hidden, mut lost) = (0.0, 0);
        const PIXELS: u32 = 20_000;
        for _ in 0..PIXELS {
            let shift = Shift::from_rng(&mut rng);
            finder.find(
                &mut truth.clone(),
                &mut coherence,
                shift,
                &mut scratch,
                &mut partition,
            );
            hidden += 1.0 - partition.measure();
            lost += u32::from(partition.is_lit());
            if partition.is_lit() {
                coherence.remember(&truth.partition());
            }
        }
        let bias = hidden / f64::from(PIXELS) / width - 1.0;
        assert!(
            bias.abs() < 0.05,
            "a blocker of {width} is measured {bias} too wide"
        );
        assert!(
            lost < PIXELS / 1000,
            "a blocker of {width} is lost in {lost} pixels"
        );
    }
}

#[test]
fn questions_come_in_pencils_of_at_most_eight() {
    struct Pencils<'a>(&'a Steps, Vec<usize>);
    impl Visibility for Pencils<'_> {
        fn visible(&mut self, _: f64) -> bool {
            panic!("asked alone");
        }
        fn visible_each(&mut self, ts: &[f64], answers: &mut [bool]) {
            self.1.push(ts.len());
            for (answer, &t) in answers.iter_mut().zip(ts) {
                *answer = self.0.at(t);
            }
        }
    }
    let mut rng = Pcg64Mcg::seed_from_u64(12);
    let (mut scratch, mut partition) = (FinderScratch::new(), Partition::dark());
    for row in rows(2) {
        let mut coherence = ChangeCoherence::new();
        for pixel in &row.pixels {
            let mut oracle = Pencils(pixel, Vec::new());
            let shift = Shift::from_rng(&mut rng);
            let finder = Finder {
                epsilon: 0.01,
                nu: 0.1,
            };
            let report = finder.find(&mut oracle, &mut coherence, shift, &mut scratch, &mut partition);
            assert!(oracle.1.iter().all(|&n| (1..=8).contains(&n)), "{:?}", oracle.1);
            assert_eq!(oracle.1.len() as u32, report.batches, "batches");
            assert_eq!(
                oracle.1.iter().sum::<usize>() as u32,
                report.end_tests + report.inner_tests,
                "tests"
            );
        }
    }
}

#[test]
fn the_neighbour_with_more_changes_is_preferred() {
    let remembered = |truth: &Steps| {
        let mut coherence = ChangeCoherence::new();
        coherence.remember(&truth.partition());
        coherence
    };
    let (one, two) = (
        remembered(&Steps::behind(&[[0.3, 2.0]])),
        remembered(&Steps::behind(&[[0.5, 0.52]])),
    );
    let mut left = one.clone();
    left.prefer_richer(&two);
    assert_eq!(left, two, "more changes");
    left.prefer_richer(&one);
    assert_eq!(left, two, "fewer changes");
    let mut other = remembered(&Steps::behind(&[[0.1, 0.2]]));
    other.prefer_richer(&two);
    assert_eq!(other.changes(), [0.1, 0.2], "as many changes");
}

#[test]
fn what_is_newly_met_is_measured_finely_at_once() {
    // A wire that the first pixel happens to meet must not cast the shadow of a whole cell of 1/16.
    let mut rng = Pcg64Mcg::seed_from_u64(8);
    let (mut scratch, mut partition) = (FinderScratch::new(), Partition::dark());
    let truth = Steps::behind(&[[0.4, 0.41]]);
    let mut met = 0;
    for _ in 0..4000 {
        let shift = Shift::from_rng(&mut rng);
        let coherence = &mut ChangeCoherence::new();
        Finder::default().find(&mut truth.clone(), coherence, shift, &mut scratch, &mut partition);
        if !partition.is_lit() {
            met += 1;
            let hidden = 1.0 - partition.measure();
            assert!(hidden < 0.025, "{partition:?}");
        }
    }
    // One in 25 pixels: 0.01 of 0.25.
    assert!((100..220).contains(&met), "met {met} times in 4000");
}

#[test]
fn what_another_search_found_is_remembered() {
    let truth = Steps::behind(&[[0.4, 0.43], [0.6, 0.64]]);
    let mut coherence = ChangeCoherence::new();
    coherence.remember(&truth.partition());
    assert_eq!(coherence.changes(), truth.changes, "remembered");
    let mut partition = Partition::dark();
    let shift = Shift {
        lattice: 0.3,
        cover: 0.7,
    };
    let finder = Finder {
        nu: 1.0,
        ..Finder::default()
    };
    let report = finder.find(
        &mut truth.clone(),
        &mut coherence,
        shift,
        &mut FinderScratch::new(),
        &mut partition,
    );
    // Both blockers are narrower than a cell of the ordinary lattice.
    assert_eq!(report.discontinuities, 4, "{partition:?}");
    coherence.clear();
    assert!(coherence.changes().is_empty(), "forgotten");
}

#[test]
fn impossible_tolerances_end() {
    let truth = Steps::behind(&[[0.3, 2.0]]);
    let mut partition = Partition::dark();
    for (epsilon, nu) in [
        (0.0, 0.25),
        (f64::NAN, 0.25),
        (-1.0, f64::INFINITY),
        (f64::INFINITY, f64::INFINITY),
    ] {
        for lattice in [0.0, f64::NAN, f64::INFINITY, -1e-300, 1e300] {
            let shift = Shift {
                lattice,
                cover: lattice,
            };
            let mut coherence = ChangeCoherence::new();
            let mut find = || {
                let scratch = &mut FinderScratch::new();
                Finder { epsilon, nu }.find(
                    &mut truth.clone(),
                    &mut coherence,
                    shift,
                    scratch,
                    &mut partition,
                )
            };
            for report in [find(), find()] {
                assert!(report.inner_tests < 60, "{epsilon}, {nu}, {lattice}: {report:?}");
                assert_eq!(
                    report.discontinuities, 1,
                    "{epsilon}, {nu}, {lattice}: {report:?}"
                );
            }
        }
    }
    let shift = Shift {
        lattice: 0.5,
        cover: 0.5,
    };
    let finder = Finder {
        epsilon: 0.05,
        nu: 0.0,
    };
    let (coherence, scratch) = (&mut ChangeCoherence::new(), &mut FinderScratch::new());
    let report = finder.find(&mut truth.clone(), coherence, shift, scratch, &mut partition);
    assert!((65_535..=65_540).contains(&report.inner_tests), "{report:?}");
}
