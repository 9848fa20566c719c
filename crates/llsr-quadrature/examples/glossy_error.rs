//! Error and run time of glossy panels beside dense sampling of the light, as a table.
//!
//! `cargo run --release -p llsr-quadrature --example glossy_error`

use std::hint::black_box;
use std::time::Instant;

use glam::DVec3;
use llsr_quadrature::{Emission, GlossyOptions, LineGlossy, LineLight, MetalRough, Receiver};
use llsr_testkit::quadrature::{Law, metal_rough, reflected};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

const CASES: usize = 600;

/// Runs of which the fastest counts.
const RUNS: u32 = 8;

struct Case {
    view: DVec3,
    light: LineLight,
}

fn unit(random: &mut Pcg64Mcg) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// A direction above the floor.
fn direction(random: &mut Pcg64Mcg) -> DVec3 {
    let (z, phi) = (0.05 + 0.95 * unit(random), std::f64::consts::TAU * unit(random));
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * phi.cos(), z, r * phi.sin())
}

/// Lights 2 m long with their middle at 1 m, half of them through the mirror direction.
fn cases() -> Vec<Case> {
    let mut random = Pcg64Mcg::new(5);
    (0..CASES)
        .map(|i| {
            let view = direction(&mut random);
            let middle = if i % 2 == 0 {
                DVec3::new(-view.x, view.y, -view.z)
            } else {
                direction(&mut random)
            };
            let half = direction(&mut random);
            let light = LineLight {
                a: middle - half,
                b: middle + half,
                emission: Emission::Diffuse,
                flux: 1.0,
            };
            Case { view, light }
        })
        .collect()
}

/// One random point in each of `count` strata.
fn sampled(case: &Case, receiver: &Receiver, roughness: f64, count: u32, random: &mut Pcg64Mcg) -> f64 {
    let LineLight { a, b, .. } = case.light;
    let axis = (b - a).normalize();
    let n = receiver.normal;
    (0..count)
        .map(|i| {
            let x = a + (b - a) * ((f64::from(i) + unit(random)) / f64::from(count));
            let to = (x - receiver.position).normalize();
            let density = axis.cross(to).length() * n.dot(to).max(0.0)
                / (std::f64::consts::PI.powi(2) * x.distance_squared(receiver.position));
            metal_rough(0.8, 0.5, roughness, n, case.view, to) * density / f64::from(count)
        })
        .sum()
}

/// Nanoseconds a panel and the error of `method`, relative RMSE over the cases with each case's truth as unit.
fn measure(cases: &[Case], truth: &[f64], mut method: impl FnMut(&Case) -> f64) -> (f64, f64) {
    let square = std::iter::zip(cases, truth)
        .map(|(case, truth)| (method(case) / truth - 1.0).powi(2))
        .sum::<f64>();
    let mut best = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        for case in cases {
            black_box(method(black_box(case)));
        }
        best = best.min(start.elapsed().as_secs_f64());
    }
    (
        best * 1e9 / cases.len() as f64,
        (square / cases.len() as f64).sqrt(),
    )
}

fn main() {
    let receiver = Receiver {
        position: DVec3::ZERO,
        normal: DVec3::Y,
    };
    let cases = cases();
    let roughnesses = [0.1, 0.2, 0.4, 1.0];
    let columns: Vec<String> = roughnesses
        .iter()
        .map(|r| format!("roughness {r}: error | ns"))
        .collect();
    println!("| method | {} |", columns.join(" | "));
    println!("|---|{}", "---|".repeat(2 * roughnesses.len()));
    let truths: Vec<Vec<f64>> = roughnesses
        .iter()
        .map(|&roughness| {
            let one = |case: &Case| {
                let brdf = |l| metal_rough(0.8, 0.5, roughness, receiver.normal, case.view, l);
                let ends = (case.light.a, case.light.b);
                reflected(
                    receiver.position,
                    receiver.normal,
                    ends,
                    Law::Diffuse,
                    (0.0, 1.0),
                    200,
                    brdf,
                )
            };
            cases.iter().map(one).collect()
        })
        .collect();
    let row = |name: String, method: &mut dyn FnMut(&Case, f64) -> f64| {
        let cells: Vec<String> = std::iter::zip(roughnesses, &truths)
            .map(|(roughness, truth)| {
                let (ns, error) = measure(&cases, truth, |case| method(case, roughness));
                format!("{error:.1e} | {ns:.0}")
            })
            .collect();
        println!("| {name} | {} |", cells.join(" | "));
    };
    for tolerance in [1e-2, 1e-3, 1e-4, 1e-6] {
        row(
            format!("panel, tolerance {tolerance:.0e}"),
            &mut |case, roughness| {
                let options = GlossyOptions {
                    tolerance,
                    max_evaluations: 448,
                };
                let material = MetalRough {
                    base_color: DVec3::splat(0.8),
                    metallic: 0.5,
                    roughness,
                };
                let line = LineGlossy::new(&receiver, &case.light, case.view, roughness);
                material.radiance(&line.panel(0.0, 1.0, &options).lobes).x
            },
        );
    }
    let mut random = Pcg64Mcg::new(6);
    for count in [4, 16, 64, 256, 1024] {
        row(format!("{count} stratified samples"), &mut |case, roughness| {
            sampled(case, &receiver, roughness, count, &mut random)
        });
    }
}
