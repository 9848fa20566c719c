//! How many evaluations a glossy panel takes and how far off the result is, by roughness.
//!
//! `cargo run --release -p llsr-quadrature --example glossy_cost`

use glam::DVec3;
use llsr_quadrature::{Emission, GlossyOptions, LineGlossy, LineLight, Receiver};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

const CASES: usize = 20_000;

/// A direction above the floor.
fn direction(random: &mut Pcg64Mcg) -> DVec3 {
    let mut unit = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let (z, phi) = (0.01 + 0.99 * unit(), std::f64::consts::TAU * unit());
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * phi.cos(), z, r * phi.sin())
}

fn main() {
    let receiver = Receiver {
        position: DVec3::ZERO,
        normal: DVec3::Y,
    };
    println!(
        "{CASES} random viewers and lights 2 m long at 1 m, half of the lights through the mirror direction"
    );
    println!(
        "tolerance  roughness  evaluations: mean  99%  most   error / tolerance: 99%  99.9%  most  over budget"
    );
    for tolerance in [1e-2, 1e-3, 1e-5] {
        for roughness in [0.02, 0.1, 0.3, 1.0] {
            let mut random = Pcg64Mcg::new(5);
            let (mut costs, mut errors, mut over) = (vec![], vec![], 0);
            for i in 0..CASES {
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
                let glossy = LineGlossy::new(&receiver, &light, view, roughness);
                let truth = glossy.panel(
                    0.0,
                    1.0,
                    &GlossyOptions {
                        tolerance: 1e-10,
                        max_evaluations: 448,
                    },
                );
                let found = glossy.panel(
                    0.0,
                    1.0,
                    &GlossyOptions {
                        tolerance,
                        max_evaluations: 210,
                    },
                );
                let [a, b] = [truth.lobes, found.lobes].map(|l| (l.f0, l.grazing));
                errors.push(((a.0 - b.0).abs() + (a.1 - b.1).abs()) / (a.0 + a.1) / tolerance);
                costs.push(found.evaluations);
                over += usize::from(found.error > tolerance * (found.lobes.f0 + found.lobes.grazing));
            }
            costs.sort_unstable();
            errors.sort_by(f64::total_cmp);
            let mean = costs.iter().map(|&c| f64::from(c)).sum::<f64>() / CASES as f64;
            let at = |share: f64| (share * (CASES - 1) as f64) as usize;
            println!(
                "{tolerance:9.0e} {roughness:10.2} {mean:17.1} {:5} {:5} {:22.3} {:6.3} {:6.3} {over:8}",
                costs[at(0.99)],
                costs[CASES - 1],
                errors[at(0.99)],
                errors[at(0.999)],
                errors[CASES - 1],
            );
        }
    }
}
