//! Cost of the parts of a frame: `cargo bench -p llsr-render-cache`.
//!
//! Points lie on a wall and on bars before it, as many as pixels, some of them hidden as the camera has moved since; `scattered`
//! stores them in random order, which is the worst for the caches of the machine, `in order` as their pixels follow each
//! other, which is what the store strives for.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{Mat4, Vec3};
use llsr_render_cache::*;

const SIZES: [(u32, u32); 2] = [(512, 512), (1920, 1080)];

struct Random(u64);

impl Random {
    /// Uniform in [0, 1).
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Looks along -z, 90 degrees wide and high, moved and turned a little by `motion`.
fn view(width: u32, height: u32, motion: f32) -> View {
    let projection = Mat4::from_cols_array_2d(&[
        [1., 0., 0., 0.],
        [0., 1., 0., 0.],
        [0., 0., 0., -1.],
        [0., 0., 0.1, 0.],
    ]);
    let camera =
        Mat4::from_rotation_y(0.1 * motion) * Mat4::from_translation(Vec3::new(0.3, 0.1, 0.2) * motion);
    View::new(&(projection * camera), width, height).expect("size")
}

fn sample(x: f32, y: f32) -> Point {
    let bar = (x * 4.0).rem_euclid(1.0) < 0.4;
    let depth = if bar { 2.0 } else { 5.0 };
    Point {
        position: Vec3::new(x * depth, -y * depth, -depth),
        colour: Vec3::new(0.5 + 0.4 * x, 0.5 + 0.4 * y, 0.3),
        surface: 0,
        object: u32::from(bar),
        lights: 1,
    }
}

/// As many points as pixels, evenly spread.
fn store(width: u32, height: u32, scattered: bool) -> PointStore {
    let count = (width * height) as usize;
    let mut store = PointStore::new(count).expect("capacity");
    let image = PointImage::new(width, height).expect("size");
    let mut random = Random(7);
    for i in 0..count as u32 {
        let (u, v) = if scattered {
            (random.next(), random.next())
        } else {
            (
                ((i % width) as f32 + random.next()) / width as f32,
                ((i / width) as f32 + random.next()) / height as f32,
            )
        };
        store.insert(
            &sample(2.0 * u - 1.0, 2.0 * v - 1.0),
            &image,
            &Replacement::default(),
        );
    }
    // Old enough to be filtered.
    store.advance(9, 255);
    store
}

fn reproject(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("reproject");
    for (width, height) in SIZES {
        for (order, scattered) in [("scattered", true), ("in order", false)] {
            let store = store(width, height, scattered);
            let mut image = PointImage::new(width, height).expect("size");
            for (name, reach) in [("no filter", 0), ("filter 3", 3)] {
                let filter = DepthFilter {
                    reach,
                    ..DepthFilter::default()
                };
                let id = BenchmarkId::new(format!("{width}x{height} {order}"), name);
                let view = view(width, height, 0.5);
                group.bench_function(id, |b| b.iter(|| image.reproject(&store, &view, &filter)));
            }
        }
    }
    group.finish();
}

fn rest(criterion: &mut Criterion) {
    let (width, height) = SIZES[0];
    let mut store = store(width, height, true);
    let mut image = PointImage::new(width, height).expect("size");
    image.reproject(&store, &view(width, height, 0.5), &DepthFilter::default());
    let mut priorities = Priorities::new(width, height).expect("size");
    let mut chooser = Chooser::new(width, height).expect("size");
    let mut requests = Vec::new();
    let mut group = criterion.benchmark_group("512x512");
    group.bench_function("advance", |b| b.iter(|| store.advance(1, 255)));
    group.bench_function("invalidate object", |b| {
        b.iter(|| store.invalidate_object(77, Fate::Remove))
    });
    let missing = vec![0u8; width as usize];
    group.bench_function("priorities", |b| {
        b.iter(|| priorities.update(&image, AgeRule::default(), |_| &missing))
    });
    group.bench_function("priorities by gaps", |b| {
        b.iter(|| priorities.update_by_gaps(&image, AgeRule::default()));
    });
    group.bench_function("choose 1%", |b| {
        b.iter(|| chooser.choose(&mut priorities, 2621, 0.3, 0, &mut requests));
    });
    let mut prediction = Prediction::new(width, height).expect("size");
    let ahead = view(width, height, 1.5);
    group.bench_function("predict from a quarter", |b| {
        b.iter(|| prediction.update(&store, &ahead, 4, 1, 13))
    });
    let mut random = Random(3);
    group.bench_function("insert into a full store", |b| {
        b.iter(|| {
            let point = sample(2.0 * random.next() - 1.0, 2.0 * random.next() - 1.0);
            store.insert(&point, &image, &Replacement::default())
        });
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(30).warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_secs(1));
    targets = reproject, rest
}
criterion_main!(benches);
