//! The closed forms against brute force on random, extreme and degenerate geometry.

use glam::DVec3;
use llsr_quadrature::{Emission, LineIrradiance, LineLight, Receiver, horizon_clip};
use llsr_testkit::quadrature::{Law, line_irradiance};
use llsr_visibility::{Panel, Partition};
use proptest::prelude::*;

const LAWS: [(Emission, Law); 2] = [
    (Emission::Diffuse, Law::Diffuse),
    (Emission::Isotropic, Law::Isotropic),
];

fn light(a: DVec3, b: DVec3, emission: Emission) -> LineLight {
    LineLight {
        a,
        b,
        emission,
        flux: 1.0,
    }
}

/// The documented bound on the relative error.
fn bound(receiver: &Receiver, light: &LineLight, (t0, t1): (f64, f64)) -> f64 {
    let e = f64::EPSILON / 2.0;
    let (to_a, to_b) = (light.a - receiver.position, light.b - receiver.position);
    let axis = (light.b - light.a).normalize();
    let near = if to_a.length() < to_b.length() { to_a } else { to_b };
    let h = near.cross(axis).length();
    let ends = [t0, t1].map(|t| light.point(t) - receiver.position);
    let reach = ends[0].length().max(ends[1].length());
    let height = ends[0].dot(receiver.normal).max(ends[1].dot(receiver.normal));
    let low = reach / height;
    // The width itself rounds relative to its ends; a step of e in t moves by e L, against the distance.
    let nearest = ends[0]
        .length()
        .min(ends[1].length())
        .min(if along_spans(&ends, axis) { h } else { f64::MAX });
    let step = 8.0 * e * (1.0 / (t1 - t0) + light.length() / nearest);
    step + match light.emission {
        Emission::Diffuse => 100.0 * e * (1.0 + near.length() / h + low),
        Emission::Isotropic => 50.0 * e * (1.0 + low),
    }
}

fn along_spans(ends: &[DVec3; 2], axis: DVec3) -> bool {
    ends[0].dot(axis) * ends[1].dot(axis) < 0.0
}

fn check(receiver: &Receiver, a: DVec3, b: DVec3, (t0, t1): (f64, f64), strict: Option<f64>) {
    for (emission, law) in LAWS {
        let light = light(a, b, emission);
        let value = LineIrradiance::new(receiver, &light).panel(t0, t1);
        let truth = line_irradiance(receiver.position, receiver.normal, (a, b), law, (t0, t1));
        if truth == 0.0 {
            assert_eq!(value, 0.0, "below the horizon: {receiver:?} {light:?}");
            continue;
        }
        let tolerance = strict.unwrap_or_else(|| bound(receiver, &light, (t0, t1)));
        assert!(
            (value - truth).abs() <= tolerance * truth,
            "{emission:?}, [{t0}, {t1}]: {value} against {truth}, off by {:e}, bound {tolerance:e}: {receiver:?} {light:?}",
            (value - truth).abs() / truth
        );
    }
}

fn unit() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0f64, 0.0..std::f64::consts::TAU).prop_map(|(z, phi)| {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * phi.cos(), r * phi.sin(), z)
    })
}

fn point() -> impl Strategy<Value = DVec3> {
    (-2.0..2.0f64, -2.0..2.0f64, -2.0..2.0f64).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

/// Panels of any width, down to 1e-12 of the light.
fn panel() -> impl Strategy<Value = (f64, f64)> {
    let wide = (0.0..1.0f64, 0.0..1.0f64).prop_map(|(s, t)| (s.min(t), s.max(t)));
    let narrow = (0.0..1.0f64, -12.0..0.0f64).prop_map(|(t, e)| (t, (t + 10f64.powf(e)).min(1.0)));
    prop_oneof![2 => wide, 2 => narrow, 1 => Just((0.0, 1.0))].prop_filter("a width", |(s, t)| s < t)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn any_geometry_matches_brute_force(
        position in point(), normal in unit(), a in point(), b in point(), range in panel(), size in -3.0..5.0f64,
    ) {
        let scale = 10f64.powf(size);
        let receiver = Receiver { position: position * scale, normal };
        check(&receiver, a * scale, b * scale, range, None);
    }

    /// The receiver a little off the light's line: beside the light, or seen nearly end-on.
    #[test]
    fn receivers_near_the_line_match_brute_force(
        a in point(), b in point(), t in -2.0..3.0f64, off in unit(), nearness in -7.0..-1.0f64,
        normal in unit(), range in panel(),
    ) {
        prop_assume!(a.distance(b) > 0.1 && off.cross(b - a).length() > 1e-3);
        let position = a + (b - a) * t + off * 10f64.powf(nearness);
        check(&Receiver { position, normal }, a, b, range, None);
    }

    /// On axes along which the projection is exact, no precision may be lost however extreme the numbers are.
    #[test]
    fn exact_projections_give_full_precision(
        s in -3.0..3.0f64, h in -5.5..8.0f64, length in -20..17i32, t0 in 0.0..0.9f64, width in 0.001..1.0f64,
        tilt in 0.0..1.5f64,
    ) {
        // A micrometre to 100 km; a power of two keeps the coordinates exact when they are subtracted.
        let length = 2f64.powi(length);
        let (s, h) = ((s * 1024.0).round() / 1024.0 * length, 10f64.powf(h) * length);
        let (a, b) = (DVec3::new(s, h, 0.0), DVec3::new(s + length, h, 0.0));
        // A light overhead, its line parallel to the floor or tilted out of the plane of the normal.
        let receiver = Receiver { position: DVec3::ZERO, normal: DVec3::new(0.0, tilt.cos(), tilt.sin()) };
        let near = if s < 0.0 && s + length > 0.0 { length / h } else { length / s.abs().max(h) };
        check(&receiver, a, b, (t0, (t0 + width).min(1.0)), Some(1e-13 + 1e-15 * near));
    }

    #[test]
    fn panels_add_up(position in point(), normal in unit(), a in point(), b in point(), cut in 0.0..1.0f64) {
        let receiver = Receiver { position, normal };
        for (emission, _) in LAWS {
            let line = LineIrradiance::new(&receiver, &light(a, b, emission));
            let whole = line.panel(0.0, 1.0);
            let parts = line.panel(0.0, cut) + line.panel(cut, 1.0);
            prop_assert!((parts - whole).abs() <= 1e-11 * whole, "{parts} against {whole}");
            let mut partition = Partition::dark();
            partition.insert(Panel::exact(0.0, cut / 2.0));
            partition.insert(Panel::exact(cut, 1.0));
            let sum = line.panel(0.0, cut / 2.0) + line.panel(cut, 1.0);
            prop_assert!((line.partition(&partition) - sum).abs() <= 1e-15 * sum, "a partition is a sum");
        }
    }

    #[test]
    fn the_direction_of_the_light_does_not_matter(
        position in point(), normal in unit(), a in point(), b in point(), (t0, t1) in panel(),
    ) {
        let receiver = Receiver { position, normal };
        for (emission, _) in LAWS {
            let line = LineIrradiance::new(&receiver, &light(a, b, emission));
            let reversed = LineIrradiance::new(&receiver, &light(b, a, emission));
            let (one, other) = (line.panel(t0, t1), reversed.panel(1.0 - t1, 1.0 - t0));
            let tolerance = bound(&receiver, &light(a, b, emission), (t0, t1));
            prop_assert!((one - other).abs() <= 2.0 * tolerance * one + 1e-300, "{one} against {other}");
        }
    }

    #[test]
    fn the_clipped_part_is_above_the_horizon(position in point(), normal in unit(), a in point(), b in point()) {
        let receiver = Receiver { position, normal };
        let line = LineIrradiance::new(&receiver, &light(a, b, Emission::Diffuse));
        let height = |t: f64| normal.dot(a + (b - a) * t - position);
        let range = horizon_clip(&receiver, a, b);
        prop_assert_eq!(range, line.lit_range(), "both clip alike");
        for i in 0..=20 {
            let t = f64::from(i) / 20.0;
            let inside = range.is_some_and(|(t0, t1)| t0 <= t && t <= t1);
            prop_assert!(height(t).abs() < 1e-12 || inside == (height(t) > 0.0), "t = {} of {:?}", t, range);
        }
    }

    #[test]
    fn the_density_is_the_slope_of_the_panel(
        position in point(), normal in unit(), a in point(), b in point(), t in 0.0..0.999f64,
    ) {
        // Turned towards the light, so that there is something to compare.
        let normal = if normal.dot(a + (b - a) * t - position) > 0.0 { normal } else { -normal };
        let receiver = Receiver { position, normal };
        for (emission, _) in LAWS {
            let light = light(a, b, emission);
            let line = LineIrradiance::new(&receiver, &light);
            // Short against the distance to the light, and away from the horizon, where the density has a kink.
            let step = 1e-5 * light.point(t).distance(position).min(1.0);
            let (start, end) = (line.density(t), line.density(t + step));
            if end > 0.0 && (end / start - 1.0).abs() < 1e-3 {
                let slope = line.panel(t, t + step) / step;
                let middle = line.density(t + 0.5 * step);
                prop_assert!((slope - middle).abs() <= 1e-6 * middle, "{} against {}", slope, middle);
            }
        }
    }

    /// Whatever the numbers are, the answer is finite and not negative.
    #[test]
    fn anything_gives_a_finite_answer(v in prop::array::uniform12(prop_oneof![
        any::<f64>(), -1.0..1.0f64, Just(0.0), Just(1.0), Just(f64::NAN), Just(f64::INFINITY), Just(1e-200),
    ]), t0 in any::<f64>(), t1 in any::<f64>()) {
        let receiver = Receiver { position: DVec3::from_slice(&v[0..3]), normal: DVec3::from_slice(&v[3..6]).normalize_or_zero() };
        let (a, b) = (DVec3::from_slice(&v[6..9]), DVec3::from_slice(&v[9..12]));
        for (emission, _) in LAWS {
            let line = LineIrradiance::new(&receiver, &light(a, b, emission));
            for value in [line.panel(0.0, 1.0), line.panel(t0, t1), line.density(t0), line.density(0.5)] {
                prop_assert!(value.is_finite() && value >= 0.0, "{} for {:?} {:?} {:?}", value, receiver, a, b);
            }
        }
    }
}

#[test]
fn named_degenerate_cases() {
    let up = Receiver {
        position: DVec3::ZERO,
        normal: DVec3::Y,
    };
    let irradiance = |receiver: &Receiver, a: [f64; 3], b: [f64; 3], emission| {
        LineIrradiance::new(receiver, &light(a.into(), b.into(), emission)).panel(0.0, 1.0)
    };
    for (emission, _) in LAWS {
        // In the receiver's plane, below it, touching it from below.
        assert_eq!(
            irradiance(&up, [1.0, 0.0, 0.0], [2.0, 0.0, 1.0], emission),
            0.0,
            "in the plane"
        );
        assert_eq!(
            irradiance(&up, [1.0, -1.0, 0.0], [2.0, -1e-9, 1.0], emission),
            0.0,
            "below"
        );
        // A zero-length light is a point light, the limit of short lights averaged over their directions.
        let point = irradiance(&up, [0.0, 2.0, 0.0], [0.0, 2.0, 0.0], emission);
        assert!(
            (point - 0.25 / (4.0 * std::f64::consts::PI)).abs() < 1e-17,
            "point light: {point}"
        );
    }
    // End-on: the diffuse law sends nothing along the axis, the isotropic one as its points do.
    assert_eq!(
        irradiance(&up, [0.0, 1.0, 0.0], [0.0, 2.0, 0.0], Emission::Diffuse),
        0.0,
        "end-on"
    );
    let end_on = irradiance(&up, [0.0, 1.0, 0.0], [0.0, 2.0, 0.0], Emission::Isotropic);
    assert!(
        (end_on - 0.5 / (4.0 * std::f64::consts::PI)).abs() < 1e-16,
        "integral of 1/s^2: {end_on}"
    );
    // Through the receiver's plane: only the upper half counts, as if the light were half as long.
    let (a, b) = (DVec3::new(1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0));
    for (emission, _) in LAWS {
        let through = LineIrradiance::new(&up, &light(a, b, emission));
        let half = LineLight {
            flux: 0.5,
            ..light(DVec3::X, b, emission)
        };
        let upper = LineIrradiance::new(&up, &half).panel(0.0, 1.0);
        assert!(
            (through.panel(0.0, 1.0) - upper).abs() < 1e-15,
            "through the plane"
        );
        assert_eq!(through.lit_range(), Some((0.5, 1.0)), "cut at the crossing");
    }
}

#[test]
fn on_the_light_the_irradiance_is_large_but_finite() {
    let (a, b) = (DVec3::new(-1.0, 0.0, 0.0), DVec3::new(1.0, 0.0, 0.0));
    for (emission, _) in LAWS {
        for normal in [DVec3::X, DVec3::new(0.6, 0.8, 0.0)] {
            let mut last = 0.0;
            for h in [1e-2, 1e-4, 1e-6, 1e-8, 0.0] {
                let receiver = Receiver {
                    position: DVec3::new(0.25, -h, 0.0),
                    normal,
                };
                let value = LineIrradiance::new(&receiver, &light(a, b, emission)).panel(0.0, 1.0);
                assert!(
                    value.is_finite() && value > last,
                    "{emission:?} at {h}: {value} after {last}"
                );
                last = value;
            }
        }
        // The surface along which the light lies sees it edge-on.
        let along = Receiver {
            position: DVec3::ZERO,
            normal: DVec3::Y,
        };
        let value = LineIrradiance::new(&along, &light(a, b, emission)).panel(0.0, 1.0);
        assert_eq!(value, 0.0, "lying on the surface");
    }
}

#[test]
fn far_away_a_light_is_a_point() {
    let light = LineLight {
        a: DVec3::new(-0.5, 0.0, 0.0),
        b: DVec3::new(0.5, 0.0, 0.0),
        emission: Emission::Diffuse,
        flux: 1.0,
    };
    for angle in [0.3f64, 1.0, 1.5] {
        let direction = DVec3::new(angle.cos(), angle.sin(), 0.0);
        for r in [1e2, 1e4, 1e5] {
            let receiver = Receiver {
                position: r * direction,
                normal: -direction,
            };
            let diffuse = LineIrradiance::new(&receiver, &light).panel(0.0, 1.0);
            let expected = angle.sin() / (std::f64::consts::PI.powi(2) * r * r);
            assert!(
                (diffuse / expected - 1.0).abs() < 1.0 / (r * r),
                "diffuse at {r}: {diffuse}, {expected}"
            );
            let isotropic = LineLight {
                emission: Emission::Isotropic,
                ..light
            };
            let isotropic = LineIrradiance::new(&receiver, &isotropic).panel(0.0, 1.0);
            let expected = 1.0 / (4.0 * std::f64::consts::PI * r * r);
            assert!(
                (isotropic / expected - 1.0).abs() < 1.0 / (r * r),
                "isotropic at {r}: {isotropic}, {expected}"
            );
        }
    }
}

/// All flux arrives at a closed surface about the light: here a sphere, by a product rule in angles. The light
/// lies on the polar axis, off the centre, since the diffuse law is not smooth where it is seen end-on.
#[test]
fn a_sphere_around_the_light_receives_its_flux() {
    let rule = llsr_quadrature::GaussRule::new(60);
    let azimuths = 8;
    for (emission, _) in LAWS {
        let light = LineLight {
            flux: 700.0,
            ..light(DVec3::new(0.0, 0.0, -0.4), DVec3::new(0.0, 0.0, 1.1), emission)
        };
        let mut flux = 0.0;
        for (x, w) in rule.iter() {
            let theta = std::f64::consts::PI * x;
            for k in 0..azimuths {
                let phi = std::f64::consts::TAU * f64::from(k) / f64::from(azimuths);
                let out = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                let receiver = Receiver {
                    position: 2.0 * out,
                    normal: -out,
                };
                let area = 4.0 * std::f64::consts::TAU * std::f64::consts::PI * theta.sin() * w
                    / f64::from(azimuths);
                flux += area * LineIrradiance::new(&receiver, &light).panel(0.0, 1.0);
            }
        }
        assert!(
            (flux / 700.0 - 1.0).abs() < 1e-11,
            "{emission:?}: {flux} of 700 arrive"
        );
    }
}

#[test]
fn uncertain_ends_bound_the_change() {
    let receiver = Receiver {
        position: DVec3::ZERO,
        normal: DVec3::Y,
    };
    let line = LineIrradiance::new(
        &receiver,
        &light(
            DVec3::new(-1.0, 1.0, 0.0),
            DVec3::new(1.0, 2.0, 0.0),
            Emission::Diffuse,
        ),
    );
    let mut partition = Partition::dark();
    partition.insert(Panel {
        start: 0.2,
        end: 0.7,
        start_uncertainty: 1e-3,
        end_uncertainty: 2e-3,
    });
    let change = line.panel(0.199, 0.702) - line.partition(&partition);
    assert!(
        (line.uncertainty(&partition) - change).abs() < 1e-2 * change,
        "first order: {change}"
    );
}
