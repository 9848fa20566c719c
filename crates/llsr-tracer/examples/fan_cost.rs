//! What fan queries cost, in single shadow rays, for the points that a camera sees.
//!
//! ```text
//! cargo run --release -p llsr-tracer --example fan_cost -- [MODEL.glb | ROOM.glb=TUBE-MATERIAL | demo:NAME]...
//! ```
//!
//! A model without lights is put on a floor below a light, and points on it and on the floor are told apart. Without
//! arguments the model is a rough knot of 870,000 triangles. Queries come in the order of a picture rendered in tiles of
//! 16x16 pixels, and again in random order, where nothing is in the caches from the query before. Means are of processor
//! time where the system tells it.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use glam::{Affine3A, DVec3, Vec3};
use llsr_io::{LoadOptions, load_scene};
use llsr_scene::{Camera, Light, Material, Mesh, Scene, Viewport};
use llsr_testkit::tracer::bumpy_knot;
use llsr_tracer::{FanQuery, FanScratch, Tracer};
use llsr_visibility::{Bracket, Partition};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Width and height of the picture, and of its tiles (pixels).
const SIZE: u32 = 512;
const TILE: u32 = 16;
/// About how many fans are measured of each kind.
const FANS: usize = 60_000;

/// A point and the light that it looks at.
type Fan = (DVec3, [DVec3; 2]);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.is_empty() {
        arguments.push("knot".to_owned());
    }
    for argument in &arguments {
        let mut scene = scene(argument)?;
        let model = scene.lights.is_empty();
        let mut light = [DVec3::ZERO; 2];
        if model {
            (scene, light) = on_a_floor(scene);
        }
        let start = Instant::now();
        let (tracer, _) = Tracer::new(&scene);
        println!(
            "{argument}: {} triangles, built in {:.2} s",
            scene.triangle_count(),
            start.elapsed().as_secs_f64()
        );
        if model {
            let [above, below] = split(fans(&scene, &tracer, &[light]), &scene);
            measure("points on it", &tracer, &above);
            measure("floor below it", &tracer, &below);
        } else {
            let lights: Vec<[DVec3; 2]> = scene
                .lights
                .iter()
                .map(Light::ends)
                .map(|(a, b)| [a, b])
                .collect();
            measure("all points", &tracer, &fans(&scene, &tracer, &lights));
        }
    }
    Ok(())
}

fn scene(argument: &str) -> Result<Scene, Box<dyn Error>> {
    if argument == "knot" {
        let mut scene = Scene::new("knot");
        let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        scene.add_mesh(bumpy_knot(2900, 150, 0.2, grey));
        return Ok(scene);
    }
    if let Some(name) = argument.strip_prefix("demo:") {
        return llsr_scene::demo::build(name).ok_or_else(|| format!("there is no scene {name}").into());
    }
    let (path, tubes) = match argument.split_once('=') {
        Some((path, material)) => (path, vec![format!("{material}=3000lm").parse()?]),
        None => (argument, Vec::new()),
    };
    let options = LoadOptions {
        tubes,
        ..LoadOptions::default()
    };
    Ok(load_scene(Path::new(path), &options)?.scene)
}

/// Scales the model to a length of 2, puts it on a floor and a light above it.
fn on_a_floor(mut scene: Scene) -> (Scene, [DVec3; 2]) {
    let bounds = scene.bounds();
    let scale = 2.0 / bounds.size().max_element();
    let center = bounds.center();
    for object in &mut scene.objects {
        object.transform =
            Affine3A::from_scale(Vec3::splat(scale)) * Affine3A::from_translation(-center) * object.transform;
    }
    let y = (bounds.min.y - center.y) * scale;
    let floor = [[-4.0, -4.0], [-4.0, 4.0], [4.0, 4.0], [4.0, -4.0]].map(|[x, z]| Vec3::new(x, y, z));
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::quad("floor", floor, grey));
    let eye = DVec3::new(2.2, 1.6, 2.6);
    scene.cameras.insert(
        0,
        Camera::look_at(
            "near",
            eye,
            DVec3::Y * -0.1,
            DVec3::Y,
            llsr_scene::FieldOfView::vertical_degrees(35.0),
        ),
    );
    (scene, [DVec3::new(-1.0, 3.0, -0.5), DVec3::new(1.0, 3.0, 0.5)])
}

/// The fans from what the camera sees to the lights above the horizon, tile by tile; only every so many tiles.
fn fans(scene: &Scene, tracer: &Tracer, lights: &[[DVec3; 2]]) -> Vec<Fan> {
    let viewport = Viewport {
        width: SIZE,
        height: SIZE,
    };
    let bounds = scene.bounds();
    let camera = scene
        .cameras
        .first()
        .cloned()
        .unwrap_or_else(|| Camera::outside(bounds.center(), 0.5 * bounds.diagonal(), viewport));
    let mut fans = Vec::new();
    let across = SIZE / TILE;
    // A step that is prime to the number of tiles in a row.
    let step = (lights.len() as u32).clamp(1, 20) | 1;
    for tile in (0..across * across).step_by(step as usize) {
        for pixel in 0..TILE * TILE {
            let x = tile % across * TILE + pixel % TILE;
            let y = tile / across * TILE + pixel / TILE;
            let (eye, direction) = camera.ray(viewport, f64::from(x) + 0.5, f64::from(y) + 0.5);
            let Some(hit) = tracer.closest(eye, direction, f64::INFINITY) else {
                continue;
            };
            let p = hit.leave(-direction);
            let normal = hit.normal * -hit.normal.dot(direction).signum();
            for &light in lights {
                if light.iter().all(|&end| normal.dot(end - p) > 0.0) {
                    fans.push((p, light));
                }
            }
        }
    }
    fans
}

/// Those that start above the floor, and those on it.
fn split(fans: Vec<Fan>, scene: &Scene) -> [Vec<Fan>; 2] {
    let floor = f64::from(scene.bounds().min.y) + 1e-3;
    let (above, below) = fans.into_iter().partition(|fan| fan.0.y > floor);
    [above, below]
}

/// What a number of queries cost (ns).
struct Cost {
    mean: f64,
    median: f64,
    high: f64,
    each: Vec<f64>,
}

/// Processor time of this thread in nanoseconds; from the clock on the wall where the system does not tell.
fn processor_time(start: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    told.and_then(|text| text.split_whitespace().next()?.parse().ok())
        .unwrap_or_else(|| start.elapsed().as_secs_f64() * 1e9)
}

/// The best of a few runs: of all items for the mean, and of each item for the rest.
fn time<T>(items: &[T], mut f: impl FnMut(&T) -> u64) -> Cost {
    let mut each = vec![f64::INFINITY; items.len()];
    let mut whole = f64::INFINITY;
    // Reading the clock takes time too.
    let clock = (0..1000)
        .map(|_| Instant::now().elapsed().as_secs_f64() * 1e9)
        .fold(f64::INFINITY, f64::min);
    for _ in 0..3 {
        let start = Instant::now();
        let before = processor_time(start);
        let sum = items.iter().fold(0u64, |sum, item| sum.wrapping_add(f(item)));
        whole = whole.min(processor_time(start) - before);
        black_box(sum);
        for (best, item) in each.iter_mut().zip(items) {
            let start = Instant::now();
            black_box(f(item));
            *best = best.min((start.elapsed().as_secs_f64() * 1e9 - clock).max(0.0));
        }
    }
    let mut sorted = each.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let at = |share: usize| sorted.get(sorted.len() * share / 100).copied().unwrap_or(0.0);
    Cost {
        mean: whole / items.len().max(1) as f64,
        median: at(50),
        high: at(99),
        each,
    }
}

/// Every so many rows of a tile, so that about `FANS` are left.
fn thinned<T: Copy>(items: &[T], most: usize) -> Vec<T> {
    let run = 128;
    let keep = items.len().div_ceil(most.max(1));
    items
        .chunks(run)
        .step_by(keep.max(1))
        .flatten()
        .copied()
        .collect()
}

fn shuffled<T: Copy>(items: &[T]) -> Vec<T> {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let mut items = items.to_vec();
    for i in (1..items.len()).rev() {
        items.swap(i, (rng.next_u64() % (i as u64 + 1)) as usize);
    }
    items
}

/// Prints the cost of fans from points to lights.
fn measure(name: &str, tracer: &Tracer, fans: &[Fan]) {
    let fans = thinned(fans, FANS);
    println!("  {name}, {} fans", fans.len());
    for (order, fans) in [("picture", fans.clone()), ("random", shuffled(&fans))] {
        measure_order(order, tracer, &fans);
    }
}

fn query(&(p, [a, b]): &Fan, prune: bool) -> FanQuery {
    FanQuery {
        prune,
        ..FanQuery::new(p, a, b)
    }
}

fn measure_order(order: &str, tracer: &Tracer, fans: &[Fan]) {
    let mut scratch = FanScratch::default();
    let mut visible = Partition::default();
    let mut kinds = Vec::new();
    let mut brackets = Vec::new();
    let mut visits = [[0f64; 4]; 2];
    let mut found = 0.0;
    for fan in fans {
        for (visits, prune) in visits.iter_mut().zip([false, true]) {
            let report = tracer.fan(&query(fan, prune), &mut scratch, &mut visible);
            for (sum, x) in visits.iter_mut().zip([
                report.nodes,
                report.blocks,
                report.triangles,
                report.pruned_blocked,
            ]) {
                *sum += f64::from(x) / fans.len() as f64;
            }
        }
        kinds.push(if visible.is_dark() {
            2
        } else {
            usize::from(!visible.is_lit())
        });
        let changes: Vec<_> = visible.changes().collect();
        found += changes.len() as f64 / fans.len() as f64;
        if let Some(change) = changes.get(changes.len() / 2) {
            let lo = (change.t - 0.03).max(0.0);
            let bracket = Bracket::new(lo, (lo + 0.0625).min(1.0), !change.visible_above);
            brackets.push((*fan, bracket));
        }
    }
    let ray = time(fans, |&(p, [a, b])| {
        u64::from(tracer.occluded(p, a + (b - a) * (p.x * 7.3).fract().abs()))
    });
    let cell = |cost: &Cost| {
        format!(
            "mean {:6.0} ns = {:5.2} rays, median {:6.0}, 99% {:6.0}",
            cost.mean,
            cost.mean / ray.mean,
            cost.median,
            cost.high
        )
    };
    println!("    {order} order: shadow ray    {}", cell(&ray));
    for (how, prune, visits) in [
        ("fan, pruned", true, visits[1]),
        ("fan, unpruned", false, visits[0]),
    ] {
        let cost = time(fans, |fan| {
            u64::from(
                tracer
                    .fan(&query(fan, prune), &mut scratch, &mut visible)
                    .triangles,
            )
        });
        let [nodes, blocks, triangles, pruned] = visits;
        println!(
            "      {how:13} {}; visits {nodes:.1} nodes, {blocks:.1} blocks, {triangles:.1} triangles; {pruned:.1} left out",
            cell(&cost)
        );
        if !prune {
            continue;
        }
        print!("        {found:.2} changes a fan;");
        for (kind, word) in ["lit", "penumbra", "umbra"].into_iter().enumerate() {
            let some: Vec<f64> = cost
                .each
                .iter()
                .zip(&kinds)
                .filter(|x| *x.1 == kind)
                .map(|x| *x.0)
                .collect();
            print!(
                " {word} {:.0}%: {:.0} ns;",
                100.0 * some.len() as f64 / fans.len() as f64,
                some.iter().sum::<f64>() / some.len().max(1) as f64
            );
        }
        println!();
    }
    let polish = time(&brackets, |&((p, [a, b]), bracket)| {
        tracer
            .polish(p, a, b, bracket, &mut scratch)
            .map_or(0, f64::to_bits)
    });
    println!("      polish 1/16   {}", cell(&polish));
}
