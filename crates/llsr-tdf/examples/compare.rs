//! Tests per pixel and error of both finders on rows of pixels of known visibility.
//!
//! `cargo run --release -p llsr-tdf --example compare [EPSILON [NU]]`

use llsr_rsb::{Method, Stop};
use llsr_tdf::{ChangeCoherence, Coherence, Finder, FinderScratch, Shift, Tdf, TdfScratch};
use llsr_testkit::visibility::{Row, Steps, rows};
use llsr_visibility::Partition;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Sums over the pixels of a kind of row.
#[derive(Clone, Copy, Default)]
struct Totals {
    pixels: f64,
    inner_tests: f64,
    batches: f64,
    squared_error: f64,
    error: f64,
    wrong_count: f64,
}

impl Totals {
    fn add(&mut self, tests: u32, batches: u32, partition: &Partition, truth: &Steps) {
        let error = partition.measure() - truth.measure();
        self.pixels += 1.0;
        self.inner_tests += f64::from(tests);
        self.batches += f64::from(batches);
        self.squared_error += error * error;
        self.error += error;
        self.wrong_count += f64::from(partition.discontinuities() != truth.partition().discontinuities());
    }

    fn print(&self, name: &str, search: &str) {
        println!(
            "{name:6} {search:12} {:6.2} {:8.2} {:9.4} {:+9.4} {:7.1}%",
            self.inner_tests / self.pixels,
            self.batches / self.pixels,
            (self.squared_error / self.pixels).sqrt(),
            self.error / self.pixels,
            100.0 * self.wrong_count / self.pixels,
        );
    }
}

fn main() {
    let mut args = std::env::args().skip(1).map(|arg| arg.parse().expect("a number"));
    let (epsilon, nu) = (args.next().unwrap_or(0.05), args.next().unwrap_or(0.25));
    println!(
        "tolerance {epsilon}, nu {nu}; two end tests of each pixel not counted; error of the visible width"
    );
    println!("row    search        tests  batches       rms      bias  wrong count");
    let all = rows(64);
    for kind in all.chunk_by(|a, b| a.name == b.name) {
        let name = kind[0].name;
        for method in [Method::RandomSeed, Method::Dithered] {
            let tdf = Tdf {
                method,
                stop: Stop::Tolerance(epsilon),
                nu,
                search_rest: false,
            };
            tdf_totals(&tdf, kind).print(name, &format!("tdf {}", method.name()));
        }
        finder_totals(&Finder { epsilon, nu }, kind).print(name, "finder");
    }
}

fn tdf_totals(tdf: &Tdf, rows: &[Row]) -> Totals {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let (mut scratch, mut partition, mut totals) = (TdfScratch::new(), Partition::dark(), Totals::default());
    for row in rows {
        let mut coherence = Coherence::new();
        for pixel in &row.pixels {
            let mut oracle = |t: f64| pixel.at(t);
            let report = tdf.find(
                &mut oracle,
                &mut coherence,
                &mut rng,
                &mut scratch,
                &mut partition,
            );
            totals.add(report.inner_tests, 1 + report.inner_tests, &partition, pixel);
        }
    }
    totals
}

fn finder_totals(finder: &Finder, rows: &[Row]) -> Totals {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let (mut scratch, mut partition, mut totals) =
        (FinderScratch::new(), Partition::dark(), Totals::default());
    for row in rows {
        let mut coherence = ChangeCoherence::new();
        for pixel in &row.pixels {
            let mut oracle = |t: f64| pixel.at(t);
            let shift = Shift::from_rng(&mut rng);
            let report = finder.find(&mut oracle, &mut coherence, shift, &mut scratch, &mut partition);
            totals.add(report.inner_tests, report.batches, &partition, pixel);
        }
    }
    totals
}
