//! Times of shadow edges under a grid: `shadow_speed [SCENE.glb|SCENE.obj]`.
//!
//! All objects of the scene (or a sphere of a million edges with bumps) stand on a floor under 16 + 16 bars and a tube
//! that runs askew, as in figure 13 of Bala et al. (2003). Medians of 25, in milliseconds of real time; with
//! `--features rayon` on all threads.

use std::error::Error;
use std::fmt::{Display, Formatter};
use std::hint::black_box;
use std::time::Instant;

use glam::{Affine3A, DVec3, Vec3};
use llsr_edges::{ShadowEdges, ShadowOptions, ShadowScene, ShadowStatistics};
use llsr_io::{LoadOptions, load_scene};
use llsr_scene::{LinearLight, Material, Mesh, ObjectId, Scene, Triple};

const RUNS: usize = 25;

/// Processor time of this process (ms) so far, in steps of 10; 0 where the system does not say.
fn processor_time() -> f64 {
    let line = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name in brackets, which may hold anything: fields 14 and 15 in hundredths of a second.
    let fields = line.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks = fields.skip(11).take(2).filter_map(|x| x.parse::<f64>().ok());
    ticks.sum::<f64>() * 10.0
}

/// What repeated runs took.
struct Times {
    /// Median, and the shortest (ms of real time).
    median: f64,
    least: f64,
    /// Mean processor time of all threads (ms).
    processor: f64,
}

impl Display for Times {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Self {
            median,
            least,
            processor,
        } = self;
        write!(
            f,
            "{median:.2} ms (shortest {least:.2}, processor {processor:.2})"
        )
    }
}

fn measure(mut run: impl FnMut() -> ShadowStatistics) -> (Times, ShadowStatistics) {
    let mut statistics = ShadowStatistics::default();
    let before = processor_time();
    let mut times: Vec<f64> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            statistics = black_box(run());
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let times = Times {
        median: times[RUNS / 2],
        least: times[0],
        processor: (processor_time() - before) / RUNS as f64,
    };
    (times, statistics)
}

fn grid(low: Vec3, high: Vec3, material: llsr_scene::MaterialId) -> Mesh {
    let mut mesh = Mesh {
        name: "grid".into(),
        ..Mesh::default()
    };
    let (size, width) = (high - low, 0.008 * (high - low).max_element());
    for i in 0..16u8 {
        let t = (f32::from(i) + 0.5) / 16.0;
        for across in [false, true] {
            let mut a = Vec3::new(low.x, high.y + 0.15 * size.y, low.z);
            let mut b = Vec3::new(high.x, a.y + width, high.z);
            if across {
                a.x = low.x + t * size.x;
                b.x = a.x + width;
            } else {
                (a.y, b.y) = (a.y + 2.0 * width, b.y + 2.0 * width);
                a.z = low.z + t * size.z;
                b.z = a.z + width;
            }
            mesh.append(&Mesh::cuboid("", a, b, material));
        }
    }
    mesh
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut scene = match std::env::args_os().nth(1) {
        Some(path) => load_scene(path.as_ref(), &LoadOptions::default())?.scene,
        None => {
            let mut scene = Scene::new("sphere");
            scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
            scene.add_mesh(llsr_testkit::edges::bumpy_sphere(400, 0.002, 1));
            scene
        }
    };
    scene.lights.clear();
    let bounds = scene.bounds();
    let (low, high, size) = (bounds.min, bounds.max, bounds.size());
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    let far = 2.0 * size.max_element();
    let corner = |x: f32, z: f32| bounds.center().with_y(low.y) + Vec3::new(x, 0.0, z) * far;
    let corners = [
        corner(-1.0, -1.0),
        corner(-1.0, 1.0),
        corner(1.0, 1.0),
        corner(1.0, -1.0),
    ];
    scene.add_mesh(Mesh::quad("floor", corners, grey));
    let grid_id = scene.add_mesh(grid(low, high, grey));
    let up = bounds
        .center()
        .with_y(high.y + 1.5 * size.max_element())
        .as_dvec3();
    let half = f64::from(size.max_element()) * DVec3::new(0.3, 0.02, 0.17);
    scene.add_light(LinearLight::new("tube", up - half, up + half, 1000.0));

    let start = Instant::now();
    let (mut prepared, left_out) = ShadowScene::new(&scene, ShadowOptions::default());
    let prepare = start.elapsed().as_secs_f64() * 1e3;
    println!(
        "{}: {} triangles, {} objects left out; prepared in {prepare:.0} ms",
        scene.name,
        scene.triangle_count(),
        left_out.len()
    );
    let triples = prepared.all_triples();
    let (first, all) = measure(|| ShadowEdges::default().add(&prepared, triples.iter().copied()));
    println!("all {} triples: {first}, {all:?}", triples.len());

    let mut edges = ShadowEdges::compute(&prepared, triples.iter().copied());
    let mut step = 0.0;
    let (moved, done) = measure(|| {
        step += 0.003 * size.max_element();
        prepared.move_object(
            grid_id,
            Affine3A::from_translation(Vec3::new(step, 0.0, 0.5 * step)),
        );
        edges.object_moved(&prepared, grid_id)
    });
    println!("grid moved: {moved}, {done:?}");

    let of = |blocker: ObjectId| -> Vec<Triple> {
        let wanted = |t: &&Triple| t.blocker == blocker && t.receiver != grid_id && t.receiver.0 == 0;
        triples.iter().filter(wanted).copied().collect()
    };
    for (name, blocker) in [("itself", ObjectId(0)), ("the grid", grid_id)] {
        let own = of(blocker);
        let (nothing, _) = measure(|| {
            let mut edges = ShadowEdges::default();
            let ObjectId(number) = blocker;
            // A receiver that does not exist: events alone.
            let receiver = ObjectId(1 << 20 | number);
            edges.add(&prepared, own.iter().map(|&triple| Triple { receiver, ..triple }))
        });
        let (all, done) = measure(|| ShadowEdges::default().add(&prepared, own.iter().copied()));
        let each = |time: f64| 1e3 * time / done.queries.max(1) as f64;
        println!(
            "first object under {name}: {all}, of it events {nothing}; {:.3} us (shortest {:.3}, processor {:.3}) an event \
             and receiver, {done:?}",
            each(all.median - nothing.median),
            each(all.least - nothing.least),
            each(all.processor - nothing.processor),
        );
    }
    Ok(())
}
