//! Cost of each pass: `cargo bench -p llsr-epi`.
//!
//! Edges are synthetic sets with the counts of BWG03 table 3; half of the pixels have a sample. One thread.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use llsr_epi::{EdgeList, EdgePointImage, Occlusion, Picture, Point, ScreenSegment, Settings};
use llsr_testkit::epi::edge_sets::EdgeSet;
use llsr_testkit::epi::windows::Stream;

const SIZE: u32 = 512;

fn prepare(set: EdgeSet) -> (EdgePointImage, EdgeList) {
    let mut image = EdgePointImage::new(SIZE, SIZE, Settings::default()).expect("size");
    let mut stream = Stream::new(9);
    for y in 0..SIZE {
        for x in 0..SIZE {
            if stream.unit() < 0.5 {
                image.insert(&Point {
                    position: Vec2::new(x as f32 + stream.unit(), y as f32 + stream.unit()),
                    depth: 2.0,
                    colour: Vec3::new(stream.unit(), 0.5, x as f32 / SIZE as f32),
                });
            }
        }
    }
    let mut list = EdgeList::new(SIZE, SIZE);
    for edge in set.edges() {
        list.push(ScreenSegment {
            a: edge.a,
            b: edge.b,
            depth_a: edge.depth[0],
            depth_b: edge.depth[1],
        });
    }
    (image, list)
}

fn passes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("512x512");
    for set in EdgeSet::ALL {
        let (mut image, list) = prepare(set);
        let mut picture = Picture::new(SIZE, SIZE);
        let id = |pass: &str| BenchmarkId::new(pass, format!("{set:?}"));
        group.bench_function(id("rasterize"), |b| {
            b.iter(|| image.rasterize(&list, Some(Occlusion::default())));
        });
        group.bench_function(id("classify"), |b| b.iter(|| image.classify()));
        group.bench_function(id("reach"), |b| b.iter(|| image.reach()));
        group.bench_function(id("interpolate"), |b| b.iter(|| image.interpolate(&mut picture)));
        group.bench_function(id("filter complex"), |b| {
            b.iter(|| image.filter_complex(&mut picture, |_, _| Vec3::ONE));
        });
        group.bench_function(id("antialias"), |b| b.iter(|| image.antialias(&mut picture)));
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(std::time::Duration::from_millis(200))
        .measurement_time(std::time::Duration::from_millis(500));
    targets = passes
}
criterion_main!(benches);
