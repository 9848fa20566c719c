//! What fan queries cost, against single shadow rays, on a rough knot over a floor.
//!
//! ```text
//! cargo run --release -p llsr-tracer --example fan_cost
//! ```

use std::hint::black_box;
use std::time::Instant;

use glam::{DVec3, Vec3};
use llsr_scene::{Material, Mesh, Scene};
use llsr_testkit::tracer::bumpy_knot;
use llsr_tracer::{FanQuery, FanScratch, Tracer};
use llsr_visibility::{Bracket, Partition};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn main() {
    let mut scene = Scene::new("knot over a floor");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    scene.add_mesh(bumpy_knot(2900, 150, 0.2, grey));
    let [w, y] = [4.0, -0.75];
    let floor = [[-w, -w], [-w, w], [w, w], [w, -w]].map(|[x, z]| Vec3::new(x, y, z));
    scene.add_mesh(Mesh::quad("floor", floor, grey));
    let (tracer, _) = Tracer::new(&scene);
    let light = [DVec3::new(-1.0, 3.0, -0.5), DVec3::new(1.0, 3.0, 0.5)];
    let eye = DVec3::new(3.0, 2.2, 3.0);
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let (mut above, mut below) = (Vec::new(), Vec::new());
    while above.len() < 5000 || below.len() < 5000 {
        let mut unit = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let aim = DVec3::new(unit() - 0.5, 0.6 * unit() - 0.6, unit() - 0.5) * 2.4;
        let direction = (aim - eye).normalize();
        let Some(hit) = tracer.closest(eye, direction, f64::INFINITY) else {
            continue;
        };
        let p = hit.leave(-direction);
        let normal = hit.normal * hit.normal.dot(-direction).signum();
        if light.iter().all(|&end| normal.dot(end - p) > 0.0) {
            let points = if p.y < -0.749 { &mut below } else { &mut above };
            points.push((p, light));
        }
    }
    measure("points on the knot", &tracer, &above[..5000]);
    measure("floor below it", &tracer, &below[..5000]);
}

/// Nanoseconds of the best of several runs of each item, and a sum that depends on all results.
fn time<T>(items: &[T], mut f: impl FnMut(&T) -> u64) -> Vec<f64> {
    let mut best = vec![f64::INFINITY; items.len()];
    for _ in 0..5 {
        for (best, item) in best.iter_mut().zip(items) {
            let start = Instant::now();
            black_box(f(item));
            *best = best.min(start.elapsed().as_secs_f64() * 1e9);
        }
    }
    // Reading the clock takes time too.
    let clock = (0..1000)
        .map(|_| Instant::now().elapsed().as_secs_f64() * 1e9)
        .fold(f64::INFINITY, f64::min);
    for best in &mut best {
        *best = (*best - clock).max(0.0);
    }
    best
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

fn high(x: &[f64]) -> f64 {
    let mut x = x.to_vec();
    x.sort_unstable_by(f64::total_cmp);
    x.get(x.len() * 99 / 100).copied().unwrap_or(0.0)
}

/// Prints the cost of fans from points to lights.
fn measure(name: &str, tracer: &Tracer, pairs: &[(DVec3, [DVec3; 2])]) {
    let mut scratch = FanScratch::default();
    let mut visible = Partition::default();
    let mut kinds = Vec::new();
    let mut brackets = Vec::new();
    let mut visits = [0f64; 5];
    for &(p, [a, b]) in pairs {
        let report = tracer.fan(&FanQuery::new(p, a, b), &mut scratch, &mut visible);
        for (sum, x) in visits.iter_mut().zip([
            report.nodes,
            report.blocks,
            report.triangles,
            report.pruned_blocked,
        ]) {
            *sum += f64::from(x) / pairs.len() as f64;
        }
        kinds.push(if visible.is_dark() {
            2
        } else {
            usize::from(!visible.is_lit())
        });
        let changes: Vec<_> = visible.changes().collect();
        visits[4] += changes.len() as f64 / pairs.len() as f64;
        if let Some(change) = changes.get(changes.len() / 2) {
            let lo = (change.t - 0.03).max(0.0);
            brackets.push((
                p,
                a,
                b,
                Bracket::new(lo, (lo + 0.0625).min(1.0), !change.visible_above),
            ));
        }
    }
    let ray = mean(&time(pairs, |&(p, [a, b])| {
        u64::from(tracer.occluded(p, a + (b - a) * (p.x * 7.3).fract().abs()))
    }));
    let [nodes, blocks, triangles, pruned, changes] = visits;
    println!(
        "{name}: single shadow ray {ray:.0} ns; a fan visits {nodes:.1} nodes, {blocks:.1} blocks, {triangles:.1} cut triangles, leaves out {pruned:.1}, finds {changes:.2} changes"
    );
    for (how, prune) in [("with pruning", true), ("without", false)] {
        let few = if prune { pairs.len() } else { pairs.len() / 10 };
        let fans = time(&pairs[..few], |&(p, [a, b])| {
            let query = FanQuery {
                prune,
                ..FanQuery::new(p, a, b)
            };
            u64::from(tracer.fan(&query, &mut scratch, &mut visible).triangles)
        });
        print!(
            "  {how:13} mean {:5.0} ns = {:5.2} rays, 99% {:6.0} ns;",
            mean(&fans),
            mean(&fans) / ray,
            high(&fans)
        );
        for (kind, word) in ["lit", "penumbra", "umbra"].into_iter().enumerate() {
            let some: Vec<f64> = fans
                .iter()
                .zip(&kinds)
                .filter(|x| *x.1 == kind)
                .map(|x| *x.0)
                .collect();
            print!(
                " {word} {:.0}% {:.0} ns",
                100.0 * some.len() as f64 / few as f64,
                mean(&some)
            );
        }
        println!();
    }
    let polish = time(&brackets, |&(p, a, b, bracket)| {
        tracer
            .polish(p, a, b, bracket, &mut scratch)
            .map_or(0, f64::to_bits)
    });
    println!(
        "  polishing 1/16 mean {:5.0} ns = {:5.2} rays, 99% {:6.0} ns",
        mean(&polish),
        mean(&polish) / ray,
        high(&polish)
    );
}
