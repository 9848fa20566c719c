//! Pinned results: a change here changes every rendered image and belongs into the change log.

use llsr_rsb::{Method, Stop};
use llsr_tdf::{ChangeCoherence, Coherence, Finder, FinderScratch, Shift, Tdf, TdfScratch};
use llsr_testkit::visibility::Steps;
use llsr_visibility::Partition;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Four pixels: nothing, a post, the post further on, a wall.
fn pixels() -> [Steps; 4] {
    [[2.0, 3.0], [0.3, 0.6], [0.35, 0.65], [0.4, 2.0]].map(|blocker| Steps::behind(&[blocker]))
}

#[test]
fn two_discontinuity_finder() {
    let mut seen = Vec::new();
    for method in [Method::RandomSeed, Method::Dithered] {
        let tdf = Tdf {
            method,
            stop: Stop::Tolerance(0.01),
            ..Tdf::default()
        };
        let mut rng = Pcg64Mcg::seed_from_u64(99);
        let (mut coherence, mut scratch, mut partition) =
            (Coherence::new(), TdfScratch::new(), Partition::dark());
        for mut pixel in pixels() {
            let report = tdf.find(&mut pixel, &mut coherence, &mut rng, &mut scratch, &mut partition);
            seen.push((report.inner_tests, partition.measure().to_bits()));
        }
    }
    let pinned = [
        (5, 4607182418800017408),
        (14, 4604535564748069233),
        (11, 4604525185121374097),
        (7, 4600797705177799624),
        (5, 4607182418800017408),
        (12, 4604489578019357206),
        (11, 4604547494425106508),
        (6, 4600886025604118343),
    ];
    assert_eq!(seen, pinned, "tests and bits of the visible width");
}

#[test]
fn finder() {
    let mut rng = Pcg64Mcg::seed_from_u64(99);
    let (mut coherence, mut scratch, mut partition) =
        (ChangeCoherence::new(), FinderScratch::new(), Partition::dark());
    let finder = Finder {
        epsilon: 0.01,
        nu: 0.25,
    };
    let seen = pixels().map(|mut pixel| {
        let shift = Shift::from_rng(&mut rng);
        let report = finder.find(&mut pixel, &mut coherence, shift, &mut scratch, &mut partition);
        (report.inner_tests, partition.measure().to_bits())
    });
    let pinned = [
        (4, 4607182418800017408),
        (12, 4604508406521266176),
        (12, 4604508406521266176),
        (11, 4600829111070643859),
    ];
    assert_eq!(seen[..], pinned, "tests and bits of the visible width");
}
