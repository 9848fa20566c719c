//! Compares the tracer's ray queries with Embree's on the same scenes, one thread, in one run.
//!
//! ```text
//! cargo run --release -p llsr-embree-bench [-- [--embree libembree3.so.3] [--scene NAME] [--only QUERY]
//!     [--instructions portable|avx2|avx512]]
//! ```

mod embree;

use std::time::Instant;

use glam::{DVec3, Vec3};
use llsr_scene::{Material, Mesh, Scene};
use llsr_testkit::tracer::{bumpy_knot, world_triangles};
use llsr_tracer::{Instructions, Tracer};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use embree::{Embree, Ray, cpu_seconds};

fn unit(rng: &mut Pcg64Mcg) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Items measured at a time: short enough to fall between two interruptions now and then.
const CHUNK: usize = 2048;

/// The CPU time of a loop over items, each chunk at its best of several runs.
#[derive(Default)]
struct Clock {
    best: Vec<f64>,
    answer: u64,
}

impl Clock {
    fn run<T>(&mut self, items: &[T], f: impl Fn(&T) -> u64) {
        self.best.resize(items.len().div_ceil(CHUNK), f64::INFINITY);
        self.answer = 0;
        for (best, chunk) in self.best.iter_mut().zip(items.chunks(CHUNK)) {
            let start = cpu_seconds();
            self.answer += chunk.iter().map(&f).sum::<u64>();
            *best = best.min(cpu_seconds() - start);
        }
    }

    fn rate(&self, count: usize) -> f64 {
        count as f64 / self.best.iter().sum::<f64>() / 1e6
    }
}

struct Point {
    exact: DVec3,
    single: Vec3,
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let option = |name: &str| {
        let at = args.iter().position(|a| a == name)?;
        args.get(at + 1).map(String::as_str)
    };
    let path = option("--embree").unwrap_or("libembree3.so.3");
    let only = option("--only").unwrap_or("");
    let instructions = match option("--instructions") {
        Some("portable") => Instructions::Portable,
        Some("avx2") => Instructions::Avx2,
        Some("avx512") => Instructions::Avx512,
        Some(other) => {
            eprintln!("--instructions {other}: give portable, avx2 or avx512");
            std::process::exit(2);
        }
        None => Instructions::detect(),
    };
    println!(
        "{:24} {:>9} {:>7} | {:>22} | {:>22} | {:>29}",
        "scene", "triangles", "build", "closest M/s", "shadow M/s", "pencil of 8, M rays/s"
    );
    for (name, around, across, bumps) in [
        ("smooth 100k", 1000, 50, 0.0),
        ("rough 100k", 1000, 50, 0.2),
        ("smooth 870k", 2900, 150, 0.0),
        ("rough 870k", 2900, 150, 0.2),
    ] {
        if !name.contains(option("--scene").unwrap_or("")) {
            continue;
        }
        let mut scene = Scene::new(name);
        let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        scene.add_mesh(bumpy_knot(around, across, bumps, grey));
        let [w, y] = [4.0, -0.75];
        let floor = [
            Vec3::new(-w, y, -w),
            Vec3::new(-w, y, w),
            Vec3::new(w, y, w),
            Vec3::new(w, y, -w),
        ];
        scene.add_mesh(Mesh::quad("floor", floor, grey));
        compare(name, path, only, instructions, &scene);
    }
}

fn option_number(name: &str) -> Option<usize> {
    std::env::var(name).ok()?.parse().ok()
}

fn compare(name: &str, path: &str, only: &str, instructions: Instructions, scene: &Scene) {
    let triangles = world_triangles(scene);
    let vertices: Vec<Vec3> = triangles.iter().flatten().copied().collect();
    let indices: Vec<[u32; 3]> = (0..triangles.len() as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    let embree = match Embree::new(path, &vertices, &indices, false) {
        Ok(embree) => embree,
        Err(error) => {
            println!("{name}: Embree cannot be loaded: {error}");
            return;
        }
    };
    let start = Instant::now();
    let (mut tracer, _) = Tracer::new(scene);
    let build = start.elapsed().as_secs_f64();
    tracer.restrict(instructions);

    let size = 384;
    let eye = DVec3::new(1.6, 1.1, 1.9);
    let forward = (-eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let rays: Vec<DVec3> = (0..size * size)
        .map(|i| {
            let x = (f64::from(i % size) + 0.5) / f64::from(size) - 0.5;
            let y = 0.5 - (f64::from(i / size) + 0.5) / f64::from(size);
            (forward + (right * x + up * y) * 0.9).normalize()
        })
        .collect();
    let points: Vec<Point> = rays
        .iter()
        .filter_map(|&d| tracer.closest(eye, d, f64::INFINITY).map(|hit| hit.leave(-d)))
        .map(|exact| Point {
            exact,
            single: exact.as_vec3(),
        })
        .collect();
    let (a, b) = (DVec3::new(-0.9, 1.6, 0.4), DVec3::new(0.9, 1.6, -0.4));
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let ts: Vec<f64> = points.iter().map(|_| unit(&mut rng)).collect();
    let targets: Vec<DVec3> = ts.iter().map(|&t| a + (b - a) * t).collect();
    let singles: Vec<Vec3> = targets.iter().map(|q| q.as_vec3()).collect();
    let pencil: Vec<[f64; 8]> = points
        .iter()
        .map(|_| std::array::from_fn(|i| (i as f64 + unit(&mut rng)) / 8.0))
        .collect();
    let singles8: Vec<[Vec3; 8]> = pencil
        .iter()
        .map(|ts| ts.map(|t| (a + (b - a) * t).as_vec3()))
        .collect();

    let mut clocks: [Clock; 7] = Default::default();
    let eye32 = eye.as_vec3();
    // Embree needs an epsilon where this tracer needs none.
    const NEAR: f32 = 1e-4;
    let shadows: Vec<(&Point, DVec3, Vec3)> = points
        .iter()
        .zip(&targets)
        .zip(&singles)
        .map(|((p, &q), &s)| (p, q, s))
        .collect();
    let pencils: Vec<(&Point, &[f64; 8], [Vec3; 8])> = points
        .iter()
        .zip(&pencil)
        .zip(&singles8)
        .map(|((p, ts), &qs)| (p, ts, qs))
        .collect();
    let count = |blocked: [bool; 8]| blocked.iter().map(|&b| u64::from(b)).sum::<u64>();
    // For profilers: one query of this tracer, over and over.
    let repeats = option_number("LLSR_REPEATS").unwrap_or(50);
    for _ in 0..repeats {
        match only {
            "closest" => clocks[0].run(&rays, |&d| {
                u64::from(tracer.closest(eye, d, f64::INFINITY).is_some())
            }),
            "embree-shadow" => clocks[3].run(&shadows, |&(p, _, q)| {
                u64::from(embree.occluded(Ray::new(p.single, q - p.single, NEAR, 1.0)))
            }),
            "embree-closest" => clocks[1].run(&rays, |d| {
                u64::from(
                    embree
                        .closest(Ray::new(eye32, d.as_vec3(), 0.0, f32::INFINITY))
                        .is_some(),
                )
            }),
            "shadow" => clocks[2].run(&shadows, |&(p, q, _)| u64::from(tracer.occluded(p.exact, q))),
            "pencil" => clocks[4].run(&pencils, |&(p, ts, _)| {
                let mut blocked = [false; 8];
                tracer.occluded_pencil(p.exact, a, b, ts, &mut blocked);
                count(blocked)
            }),
            "embree-pencil" => clocks[5].run(&pencils, |&(p, _, qs)| {
                let rays = qs.map(|q| Ray::new(p.single, q - p.single, NEAR, 1.0));
                count(embree.occluded8(&rays, false))
            }),
            _ => break,
        }
    }
    if !only.is_empty() {
        return;
    }
    for _ in 0..9 {
        clocks[0].run(&rays, |&d| {
            u64::from(tracer.closest(eye, d, f64::INFINITY).is_some())
        });
        clocks[1].run(&rays, |d| {
            u64::from(
                embree
                    .closest(Ray::new(eye32, d.as_vec3(), 0.0, f32::INFINITY))
                    .is_some(),
            )
        });
        clocks[2].run(&shadows, |&(p, q, _)| u64::from(tracer.occluded(p.exact, q)));
        clocks[3].run(&shadows, |&(p, _, q)| {
            u64::from(embree.occluded(Ray::new(p.single, q - p.single, NEAR, 1.0)))
        });
        clocks[4].run(&pencils, |&(p, ts, _)| {
            let mut blocked = [false; 8];
            tracer.occluded_pencil(p.exact, a, b, ts, &mut blocked);
            count(blocked)
        });
        for (clock, coherent) in [(5, false), (6, true)] {
            clocks[clock].run(&pencils, |&(p, _, qs)| {
                let rays = qs.map(|q| Ray::new(p.single, q - p.single, NEAR, 1.0));
                count(embree.occluded8(&rays, coherent))
            });
        }
    }
    let (n, m) = (rays.len(), points.len());
    let rates: Vec<f64> = clocks
        .iter()
        .zip([n, n, m, m, 8 * m, 8 * m, 8 * m])
        .map(|(clock, count)| clock.rate(count))
        .collect();
    println!(
        "{name:24} {:>9} {build:>6.2}s | {:>6.2} {:>6.2} x{:<6.2} | {:>6.2} {:>6.2} x{:<6.2} | {:>6.2} {:>6.2} {:>6.2} x{:<6.2} | {:?}",
        triangles.len(),
        rates[0],
        rates[1],
        rates[0] / rates[1],
        rates[2],
        rates[3],
        rates[2] / rates[3],
        rates[4],
        rates[5],
        rates[6],
        rates[4] / rates[5].max(rates[6]),
        clocks.each_ref().map(|c| c.answer),
    );
}
