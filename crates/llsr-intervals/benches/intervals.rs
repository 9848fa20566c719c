//! Cost of an interval dot product: one at a time, over slices, and with a rounding after every operation.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use llsr_intervals::{Interval, IntervalSlices, IntervalVec3};

const COUNT: usize = 512;

fn boxes() -> Vec<IntervalVec3<f32>> {
    let wave = |k: usize, phase: f32| (k as f32 * 0.37 + phase).sin();
    (0..COUNT)
        .map(|k| {
            let range =
                |phase: f32| Interval::of([wave(k, phase), wave(k, phase) + 0.1 * wave(3 * k, phase)]);
            IntervalVec3::new(range(0.0), range(1.0), range(2.0))
        })
        .collect()
}

fn dot_products(criterion: &mut Criterion) {
    let boxes = boxes();
    let v = IntervalVec3::of([[0.3f32, -0.2, 0.9], [0.31, -0.1, 0.95]]);
    let column = |f: fn(&IntervalVec3<f32>) -> f32| boxes.iter().map(f).collect::<Vec<f32>>();
    let lo = [column(|b| b.x.lo()), column(|b| b.y.lo()), column(|b| b.z.lo())];
    let hi = [column(|b| b.x.hi()), column(|b| b.y.hi()), column(|b| b.z.hi())];
    let slices = IntervalSlices::new(lo.each_ref().map(Vec::as_slice), hi.each_ref().map(Vec::as_slice));
    let (mut low, mut high) = (vec![0.0; COUNT], vec![0.0; COUNT]);

    let mut group = criterion.benchmark_group("dot_512");
    group.bench_function("slices", |bench| {
        bench.iter(|| slices.dot_into(black_box(&v), &mut low, &mut high));
    });
    group.bench_function("one_by_one", |bench| {
        bench.iter(|| {
            for (k, b) in boxes.iter().enumerate() {
                let dot = b.dot(black_box(&v));
                (low[k], high[k]) = (dot.lo(), dot.hi());
            }
        });
    });
    group.bench_function("rounded_at_each_step", |bench| {
        bench.iter(|| {
            for (k, b) in boxes.iter().enumerate() {
                let v = black_box(&v);
                let dot = b.x * v.x + b.y * v.y + b.z * v.z;
                (low[k], high[k]) = (dot.lo(), dot.hi());
            }
        });
    });
    group.finish();
}

criterion_group!(benches, dot_products);
criterion_main!(benches);
