//! Cost of FLIP: `cargo bench -p llsr-metrics`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use llsr_metrics::{Flip, Image};

fn picture(width: usize, height: usize, seed: usize) -> Vec<[f32; 3]> {
    let pixel =
        |x: usize, y: usize| [3, 5, 7].map(|c| ((x * x * c + y * 7 + x * y * seed) % 64) as f32 / 64.0);
    (0..width * height).map(|i| pixel(i % width, i / width)).collect()
}

fn flip(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("flip");
    group.sample_size(10);
    for (width, height, ppd) in [(256, 256, 67.0), (512, 512, 67.0), (512, 512, 20.0)] {
        let (a, b) = (picture(width, height, 1), picture(width, height, 2));
        let flip = Flip::new(ppd).expect("in range");
        let image = |pixels| Image::new(width, height, pixels).expect("size fits");
        group.throughput(Throughput::Elements((width * height) as u64));
        let id = BenchmarkId::from_parameter(format!("{width}x{height} at {ppd}"));
        group.bench_function(id, |bencher| {
            bencher.iter(|| flip.map(image(&a), image(&b)).expect("finite"))
        });
    }
    group.finish();
}

criterion_group!(benches, flip);
criterion_main!(benches);
