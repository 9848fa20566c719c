//! Pixels per second of both finders on rows of pixels of known visibility: what they add to their rays.
//!
//! `cargo bench -p llsr-tdf`; throughput counts pixels. Tests per pixel: `--example compare`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use llsr_tdf::{ChangeCoherence, Coherence, Finder, FinderScratch, Shift, Tdf, TdfScratch};
use llsr_testkit::visibility::{Row, Steps, rows};
use llsr_visibility::{Partition, Visibility};
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// A light by reference.
struct Light<'a>(&'a Steps);

impl Visibility for Light<'_> {
    fn visible(&mut self, t: f64) -> bool {
        self.0.at(t)
    }
}

fn with_tdf(rows: &[Row]) -> f64 {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let (tdf, mut scratch, mut partition) = (Tdf::default(), TdfScratch::new(), Partition::dark());
    let mut sum = 0.0;
    for row in rows {
        let mut coherence = Coherence::new();
        for pixel in &row.pixels {
            tdf.find(
                &mut Light(pixel),
                &mut coherence,
                &mut rng,
                &mut scratch,
                &mut partition,
            );
            sum += partition.measure();
        }
    }
    sum
}

fn with_finder(rows: &[Row]) -> f64 {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let (finder, mut scratch, mut partition) = (Finder::default(), FinderScratch::new(), Partition::dark());
    let mut sum = 0.0;
    let mut coherence = ChangeCoherence::new();
    for row in rows {
        coherence.clear();
        for pixel in &row.pixels {
            let shift = Shift::from_rng(&mut rng);
            finder.find(
                &mut Light(pixel),
                &mut coherence,
                shift,
                &mut scratch,
                &mut partition,
            );
            sum += partition.measure();
        }
    }
    sum
}

fn benches(c: &mut Criterion) {
    let all = rows(4);
    for kind in all.chunk_by(|a, b| a.name == b.name) {
        let mut group = c.benchmark_group(kind[0].name);
        group.throughput(Throughput::Elements(
            kind.iter().map(|row| row.pixels.len() as u64).sum(),
        ));
        group.bench_function("tdf", |b| b.iter(|| with_tdf(kind)));
        group.bench_function("finder", |b| b.iter(|| with_finder(kind)));
        group.finish();
    }
}

criterion_group!(all, benches);
criterion_main!(all);
