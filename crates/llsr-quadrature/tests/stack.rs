//! Area lights as stacks of lines, against the double integral over their surface.

use glam::DVec3;
use llsr_quadrature::{
    DiscLight, GaussRule, LineIrradiance, LineLight, Pattern, Receiver, RectLight, TubeLight, horizon_clip,
    sampled_nodes,
};
use llsr_testkit::quadrature::{Element, area_irradiance, cylinder, ellipse, parallelogram};
use rand_pcg::Pcg64Mcg;

/// A half-plane whose edge and the receiver span a plane of this normal: it hides what lies behind.
type Occluder = Option<DVec3>;

fn irradiance(receiver: &Receiver, lines: impl Iterator<Item = LineLight>, occluder: Occluder) -> f64 {
    let one = |light: LineLight| {
        let line = LineIrradiance::new(receiver, &light);
        let beside = |normal| {
            // The horizon of the occluder's plane cuts the line like a receiver's.
            let plane = Receiver {
                position: receiver.position,
                normal,
            };
            horizon_clip(&plane, light.a, light.b).map_or(0.0, |(t0, t1)| line.panel(t0, t1))
        };
        occluder.map_or_else(|| line.panel(0.0, 1.0), beside)
    };
    lines.map(one).sum()
}

#[derive(Clone, Copy, Debug)]
enum Light {
    Tube(TubeLight),
    Rect(RectLight),
    Disc(DiscLight),
}

impl Light {
    fn estimate(self, receiver: &Receiver, nodes: &[(f64, f64)], occluder: Occluder) -> f64 {
        let (at, nodes) = (receiver.position, nodes.to_vec());
        match self {
            Self::Tube(light) => irradiance(receiver, light.lines(at, nodes), occluder),
            Self::Rect(light) => irradiance(receiver, light.lines(at, nodes), occluder),
            Self::Disc(light) => irradiance(receiver, light.lines(at, nodes), occluder),
        }
    }

    fn gauss(self, receiver: &Receiver, n: usize, occluder: Occluder) -> f64 {
        self.estimate(receiver, &GaussRule::new(n).iter().collect::<Vec<_>>(), occluder)
    }

    fn truth(self, receiver: &Receiver, occluder: Occluder) -> f64 {
        let visible = |y: DVec3| occluder.is_none_or(|normal| normal.dot(y - receiver.position) > 0.0);
        let at = (receiver.position, receiver.normal);
        fn solve(
            at: (DVec3, DVec3),
            (area, surface): (f64, impl Fn(f64, f64) -> Element),
            visible: impl Fn(DVec3) -> bool,
        ) -> f64 {
            area_irradiance(at, area, surface, visible)
        }
        match self {
            Self::Tube(l) => l.flux * solve(at, cylinder(l.a, l.b, l.radius), visible),
            Self::Rect(l) => l.flux * solve(at, parallelogram(l.corner, l.along, l.across), visible),
            Self::Disc(l) => l.flux * solve(at, ellipse(l.center, l.u, l.v), visible),
        }
    }

    /// The direction of its lines.
    fn along(self) -> DVec3 {
        match self {
            Self::Tube(l) => (l.b - l.a).normalize(),
            Self::Rect(l) => l.along.normalize(),
            Self::Disc(l) => l.u.normalize(),
        }
    }
}

fn lights() -> [Light; 3] {
    let (a, b) = (DVec3::new(-0.7, 1.5, 0.1), DVec3::new(0.6, 1.7, -0.2));
    let tube = TubeLight {
        a,
        b,
        radius: 0.2,
        flux: 1.0,
    };
    // A parallelogram, leaning.
    let corner = DVec3::new(-0.5, 1.5, -0.4);
    let (along, across) = (DVec3::new(1.0, 0.1, 0.1), DVec3::new(0.2, 0.1, 0.7));
    let rect = RectLight {
        corner,
        along,
        across,
        flux: 1.0,
    };
    let disc = DiscLight::new(
        DVec3::new(0.2, 1.6, 0.1),
        DVec3::new(0.2, -0.9, 0.3).normalize(),
        0.5,
        1.0,
    );
    [Light::Tube(tube), Light::Rect(rect), Light::Disc(disc)]
}

fn receivers() -> [Receiver; 4] {
    let up = |x, y, z| Receiver {
        position: DVec3::new(x, y, z),
        normal: DVec3::Y,
    };
    [
        up(0.0, 0.0, 0.0),
        up(1.0, 0.5, 1.0),
        up(0.1, 1.2, 0.0),
        up(-2.0, 0.0, 0.5),
    ]
}

#[test]
fn without_occluders_convergence_is_exponential() {
    for light in lights() {
        for receiver in receivers() {
            let truth = light.truth(&receiver, None);
            let error = |n| (light.gauss(&receiver, n, None) / truth - 1.0).abs();
            let errors = [2, 4, 8, 16].map(error);
            assert!(
                errors[0] < 0.2 && errors[1] < 0.02 && errors[2] < 3e-4 && errors[3] < 1e-7,
                "{errors:?} {light:?} {receiver:?}"
            );
        }
    }
}

/// Root mean square over occluders that hide from little to nearly all.
fn occluded_error(light: Light, across: bool, mut estimate: impl FnMut(&Receiver, Occluder) -> f64) -> f64 {
    let receiver = Receiver {
        position: DVec3::new(0.3, 0.0, 0.4),
        normal: DVec3::Y,
    };
    let along = light.along();
    let whole = light.truth(&receiver, None);
    let (mut sum, mut count) = (0.0, 0);
    for i in 0..12 {
        let turn = (f64::from(i) - 5.5) * 0.04;
        // Planes through the receiver: through a direction along the lines, or slanting over them.
        let edge = if across {
            DVec3::new(0.45, 0.05, 0.9) - along * along.dot(DVec3::Z) * 0.1
        } else {
            along
        };
        let toward = DVec3::new(-0.25 + turn, 1.6, -0.35 - turn);
        let normal = edge.cross(toward).normalize();
        let error = estimate(&receiver, Some(normal)) - light.truth(&receiver, Some(normal));
        sum += (error / whole).powi(2);
        count += 1;
    }
    (sum / f64::from(count)).sqrt()
}

#[test]
fn an_edge_over_the_lines_leaves_second_order() {
    for light in lights() {
        let error = |n| occluded_error(light, true, |r, o| light.gauss(r, n, o));
        let (coarse, fine) = (error(4), error(32));
        let order = (coarse / fine).log2() / 3.0;
        assert!(order > 1.7, "order {order}, {coarse:e} to {fine:e}: {light:?}");
    }
}

#[test]
fn an_edge_along_the_lines_leaves_first_order_and_jitter_makes_it_noise() {
    for light in lights() {
        let gauss = |n| occluded_error(light, false, |r, o| light.gauss(r, n, o));
        let (coarse, fine) = (gauss(4), gauss(32));
        let order = (coarse / fine).log2() / 3.0;
        assert!(
            order > 0.7 && order < 1.5,
            "order {order}, {coarse:e} to {fine:e}: {light:?}"
        );
        let mut random = Pcg64Mcg::new(9);
        let mut jittered = |n: usize| {
            let mut points = vec![0.0; n];
            occluded_error(light, false, |r, o| {
                Pattern::Stratified.fill(&mut random, &mut points);
                light.estimate(r, &sampled_nodes(&points).collect::<Vec<_>>(), o)
            })
        };
        let (coarse, fine) = (jittered(4), jittered(32));
        let order = (coarse / fine).log2() / 3.0;
        assert!(
            order > 0.8 && order < 2.0,
            "jittered: order {order}, {coarse:e} to {fine:e}: {light:?}"
        );
    }
}

/// Bias and rms error of jittered stacks of `n` lines, relative to the truth, over 4000 of them.
fn jittered(light: Light, n: usize) -> (f64, f64) {
    const TRIALS: u32 = 4000;
    let receiver = Receiver {
        position: DVec3::new(0.3, 0.0, 0.4),
        normal: DVec3::Y,
    };
    let truth = light.truth(&receiver, None);
    let (mut random, mut points) = (Pcg64Mcg::new(1), vec![0.0; n]);
    let (mut sum, mut square) = (0.0, 0.0);
    for _ in 0..TRIALS {
        Pattern::Stratified.fill(&mut random, &mut points);
        let error =
            light.estimate(&receiver, &sampled_nodes(&points).collect::<Vec<_>>(), None) / truth - 1.0;
        (sum, square) = (sum + error, square + error * error);
    }
    (sum / f64::from(TRIALS), (square / f64::from(TRIALS)).sqrt())
}

#[test]
fn jittered_stacks_have_little_noise_and_less_bias() {
    for light in lights() {
        let ((bias, error), (less, _)) = (jittered(light, 2), jittered(light, 8));
        assert!(
            bias.abs() < 0.01 && error < 0.03,
            "two lines: bias {bias}, rms {error}: {light:?}"
        );
        // Standard errors are below 1e-4.
        assert!(less.abs() < 5e-4, "eight lines: bias {less}: {light:?}");
    }
}

#[test]
fn receivers_close_to_the_surface_see_only_it() {
    // A receiver that faces and nearly touches a surface gets pi times its radiance, flux / area.
    let rule = GaussRule::new(8);
    for gap in [1e-3, 1e-5, 1e-7] {
        let tube = TubeLight {
            a: -DVec3::X,
            b: DVec3::X,
            radius: 0.1,
            flux: 1.0,
        };
        let receiver = Receiver {
            position: DVec3::new(0.3, 0.1 + gap, 0.0),
            normal: -DVec3::Y,
        };
        let found = irradiance(&receiver, tube.lines(receiver.position, rule.iter()), None);
        let exact = 1.0 / (std::f64::consts::TAU * 0.1 * 2.0);
        assert!(
            (found / exact - 1.0).abs() < 1e-3 + 20.0 * gap,
            "tube at {gap}: {found}, not {exact}"
        );
        let rect = RectLight {
            corner: DVec3::ZERO,
            along: 2.0 * DVec3::X,
            across: DVec3::Z,
            flux: 1.0,
        };
        let receiver = Receiver {
            position: DVec3::new(0.7, -gap, 0.4),
            normal: DVec3::Y,
        };
        let found = irradiance(&receiver, rect.lines(receiver.position, rule.iter()), None);
        assert!(
            (found / 0.5 - 1.0).abs() < 1e-3 + 20.0 * gap,
            "rectangle at {gap}: {found}, not 0.5"
        );
    }
}

#[test]
fn thin_and_far_lights_are_lines_and_points() {
    let receiver = Receiver {
        position: DVec3::ZERO,
        normal: DVec3::Y,
    };
    let rule = GaussRule::new(5);
    let (a, b) = (DVec3::new(-0.7, 1.5, 0.1), DVec3::new(0.6, 1.7, -0.2));
    let line = LineLight {
        a,
        b,
        emission: llsr_quadrature::Emission::Diffuse,
        flux: 7.0,
    };
    let expected = LineIrradiance::new(&receiver, &line).panel(0.0, 1.0);
    for radius in [0.0, 1e-12, 1e-4] {
        let tube = TubeLight {
            a,
            b,
            radius,
            flux: 7.0,
        };
        let found = irradiance(&receiver, tube.lines(DVec3::ZERO, rule.iter()), None);
        assert!(
            (found / expected - 1.0).abs() < 1e-6 + radius,
            "radius {radius}: {found}, not {expected}"
        );
    }
    let distance = 1e4;
    let rect = RectLight {
        corner: DVec3::Y * distance,
        along: DVec3::X,
        across: DVec3::Z,
        flux: 7.0,
    };
    let disc = DiscLight::new(DVec3::Y * distance, -DVec3::Y, 1.0, 7.0);
    let expected = 7.0 / (std::f64::consts::PI * distance * distance);
    for light in [Light::Rect(rect), Light::Disc(disc)] {
        let found = light.gauss(&receiver, 5, None);
        assert!(
            (found / expected - 1.0).abs() < 1e-6,
            "{found}, not {expected}: {light:?}"
        );
    }
}

#[test]
fn what_cannot_be_seen_has_no_lines() {
    let rule = GaussRule::new(3);
    let tube = TubeLight {
        a: -DVec3::X,
        b: DVec3::X,
        radius: 0.5,
        flux: 1.0,
    };
    assert_eq!(
        tube.lines(DVec3::new(0.2, 0.4, 0.0), rule.iter()).count(),
        0,
        "inside the tube"
    );
    assert_eq!(
        tube.lines(DVec3::new(5.0, 0.4, 0.0), rule.iter()).count(),
        0,
        "end-on, within the cylinder"
    );
    let rect = RectLight {
        corner: DVec3::ZERO,
        along: DVec3::X,
        across: DVec3::Z,
        flux: 1.0,
    };
    assert_eq!(rect.lines(DVec3::Y, rule.iter()).count(), 0, "behind");
    assert_eq!(
        rect.lines(DVec3::new(3.0, 0.0, 0.2), rule.iter()).count(),
        0,
        "in its plane"
    );
    assert_eq!(
        RectLight {
            across: DVec3::X,
            ..rect
        }
        .lines(-DVec3::Y, rule.iter())
        .count(),
        0,
        "no area"
    );
    let disc = DiscLight::new(DVec3::ZERO, DVec3::Y, 1.0, 1.0);
    assert_eq!(disc.lines(-DVec3::Y, rule.iter()).count(), 0, "behind");
    assert_eq!(
        DiscLight {
            u: DVec3::ZERO,
            ..disc
        }
        .lines(DVec3::Y, rule.iter())
        .count(),
        0,
        "no area"
    );
    // A tube without length is a point.
    let dot = TubeLight { b: -DVec3::X, ..tube };
    let flux: f64 = dot.lines(DVec3::Y, rule.iter()).map(|l| l.flux).sum();
    assert!((flux - 1.0).abs() < 1e-15, "all the flux in a point: {flux}");
    // Numbers that are none give lines that contribute nothing.
    let broken = TubeLight {
        a: DVec3::NAN,
        ..tube
    };
    let receiver = Receiver {
        position: DVec3::Y,
        normal: DVec3::Y,
    };
    assert_eq!(
        irradiance(&receiver, broken.lines(DVec3::Y, rule.iter()), None),
        0.0
    );
}
