//! Tests per second of every bisection on a closure that costs nothing: what a search adds to its rays.
//!
//! `cargo bench -p llsr-rsb`; throughput counts tests.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use llsr_rsb::{Method, Stop, average_tests, bisect};
use llsr_visibility::Bracket;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

fn benches(c: &mut Criterion) {
    const SEARCHES: u32 = 1024;
    for tolerance in [0.05, 0.001] {
        let mut group = c.benchmark_group(format!("tolerance {tolerance}"));
        let stop = Stop::Tolerance(tolerance);
        for method in Method::ALL {
            let tests = f64::from(SEARCHES) * average_tests(method, stop);
            group.throughput(Throughput::Elements(tests.round() as u64));
            group.bench_function(method.name(), |b| {
                let mut rng = Pcg64Mcg::seed_from_u64(1);
                b.iter(|| {
                    let mut sum = 0.0;
                    for i in 0..SEARCHES {
                        let lambda = f64::from(i) / f64::from(SEARCHES);
                        let mut visible = |t: f64| t <= lambda;
                        let unit = Bracket::new(0.0, 1.0, true);
                        sum += bisect(method, &mut visible, unit, stop, &mut rng).estimate;
                    }
                    sum
                });
            });
        }
        group.finish();
    }
}

criterion_group!(all, benches);
criterion_main!(all);
