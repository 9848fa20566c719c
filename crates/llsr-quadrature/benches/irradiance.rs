//! Cost of the closed forms, of Gauss rules, glossy panels, stacks and sample patterns.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use llsr_quadrature::{
    Emission, GaussRule, GlossyOptions, LineGlossy, LineIrradiance, LineLight, Pattern, Receiver, TubeLight,
};
use rand_pcg::Pcg64Mcg;

/// Receivers on a floor under a light: wide and narrow panels, near and far.
fn receivers() -> Vec<Receiver> {
    let cell = |i: u32| {
        let (x, z) = (f64::from(i % 32) / 4.0 - 4.0, f64::from(i / 32) / 4.0 - 4.0);
        Receiver {
            position: DVec3::new(x, 0.0, z),
            normal: DVec3::Y,
        }
    };
    (0..1024).map(cell).collect()
}

fn light(emission: Emission) -> LineLight {
    LineLight {
        a: DVec3::new(-1.0, 1.5, 0.2),
        b: DVec3::new(1.3, 1.7, 0.1),
        emission,
        flux: 1000.0,
    }
}

fn closed_forms(c: &mut Criterion) {
    let receivers = receivers();
    for emission in [Emission::Diffuse, Emission::Isotropic] {
        let light = light(emission);
        let lines: Vec<_> = receivers.iter().map(|r| LineIrradiance::new(r, &light)).collect();
        let mut group = c.benchmark_group(format!("1024 receivers, {emission:?}"));
        group.bench_function("prepare", |b| {
            b.iter(|| {
                receivers
                    .iter()
                    .map(|r| black_box(LineIrradiance::new(r, &light)).density(0.5))
                    .sum::<f64>()
            });
        });
        for (name, t0, t1) in [("wide panel", 0.1, 0.9), ("narrow panel", 0.4, 0.45)] {
            group.bench_function(name, |b| {
                b.iter(|| {
                    lines
                        .iter()
                        .map(|l| l.panel(black_box(t0), black_box(t1)))
                        .sum::<f64>()
                });
            });
        }
        let rule = GaussRule::new(2);
        group.bench_function("2-point Gauss", |b| {
            b.iter(|| {
                let panel = |l: &LineIrradiance| rule.integrate(black_box(0.1), 0.9, |t| l.density(t));
                lines.iter().map(panel).sum::<f64>()
            });
        });
        group.finish();
    }
}

fn glossy_panels(c: &mut Criterion) {
    let (receivers, light) = (receivers(), light(Emission::Diffuse));
    let view = |r: &Receiver| (DVec3::new(0.5, 1.6, -5.0) - r.position).normalize();
    let mut group = c.benchmark_group("1024 glossy receivers");
    for roughness in [0.05, 0.3, 0.8] {
        group.bench_function(format!("roughness {roughness}"), |b| {
            b.iter(|| {
                let panel = |r: &Receiver| {
                    let glossy = LineGlossy::new(r, &light, view(r), roughness);
                    glossy
                        .panel(black_box(0.1), 0.9, &GlossyOptions::default())
                        .lobes
                        .f0
                };
                receivers.iter().map(panel).sum::<f64>()
            });
        });
    }
    group.finish();
}

fn stacks(c: &mut Criterion) {
    let (receivers, line) = (receivers(), light(Emission::Diffuse));
    let tube = TubeLight {
        a: line.a,
        b: line.b,
        radius: 0.05,
        flux: line.flux,
    };
    let rule = GaussRule::new(4);
    c.bench_function("1024 receivers, tube of 4 lines", |b| {
        b.iter(|| {
            let stack = |r: &Receiver| {
                let lines = tube.lines(r.position, rule.iter());
                lines
                    .map(|l| LineIrradiance::new(r, &l).panel(black_box(0.1), 0.9))
                    .sum::<f64>()
            };
            receivers.iter().map(stack).sum::<f64>()
        });
    });
}

fn patterns(c: &mut Criterion) {
    let mut group = c.benchmark_group("sample pattern");
    for pattern in Pattern::ALL {
        for n in [4, 16] {
            let (mut random, mut points) = (Pcg64Mcg::new(1), vec![0.0; n]);
            group.bench_function(format!("{pattern:?}, {n} points"), |b| {
                b.iter(|| {
                    pattern.fill(&mut random, &mut points);
                    points[n - 1]
                });
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(1))
        .warm_up_time(std::time::Duration::from_millis(300));
    targets = closed_forms, glossy_panels, stacks, patterns
}
criterion_main!(benches);
