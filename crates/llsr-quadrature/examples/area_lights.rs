//! How the irradiance from tubes, rectangles and discs converges with the number of lines.
//!
//! `cargo run --release -p llsr-quadrature --example area_lights`

use glam::DVec3;
use llsr_quadrature::{
    DiscLight, GaussRule, LineIrradiance, LineLight, Pattern, Receiver, RectLight, TubeLight, horizon_clip,
    sampled_nodes,
};
use rand_pcg::Pcg64Mcg;

/// Irradiance from lines behind a half-plane whose edge and the receiver span a plane of this normal.
fn irradiance(receiver: &Receiver, lines: impl Iterator<Item = LineLight>, occluder: Option<DVec3>) -> f64 {
    let one = |light: LineLight| {
        let line = LineIrradiance::new(receiver, &light);
        let Some(normal) = occluder else {
            return line.panel(0.0, 1.0);
        };
        let beside = horizon_clip(&Receiver { normal, ..*receiver }, light.a, light.b);
        beside.map_or(0.0, |(t0, t1)| line.panel(t0, t1))
    };
    lines.map(one).sum()
}

type Stack = Box<dyn Fn(&[(f64, f64)], Option<DVec3>) -> f64>;

fn main() {
    let receiver = Receiver {
        position: DVec3::new(0.3, 0.0, 0.4),
        normal: DVec3::Y,
    };
    let (a, b) = (DVec3::new(-0.6, 1.5, 0.0), DVec3::new(0.6, 1.5, 0.0));
    let tube = TubeLight {
        a,
        b,
        radius: 0.15,
        flux: 3000.0,
    };
    let corner = DVec3::new(-0.5, 1.5, -0.3);
    let rect = RectLight {
        corner,
        along: DVec3::X,
        across: 0.6 * DVec3::Z,
        flux: 3000.0,
    };
    let disc = DiscLight {
        center: 1.5 * DVec3::Y,
        u: 0.4 * DVec3::X,
        v: 0.4 * DVec3::Z,
        flux: 3000.0,
    };
    let lights: [(&str, Stack); 3] = [
        (
            "tube",
            Box::new(move |n, o| irradiance(&receiver, tube.lines(receiver.position, n.to_vec()), o)),
        ),
        (
            "rectangle",
            Box::new(move |n, o| irradiance(&receiver, rect.lines(receiver.position, n.to_vec()), o)),
        ),
        (
            "disc",
            Box::new(move |n, o| irradiance(&receiver, disc.lines(receiver.position, n.to_vec()), o)),
        ),
    ];
    println!("rms error relative to the unoccluded irradiance, over 24 positions of the occluder's edge");
    println!(
        "light      occluder          nodes            1 line    2 lines   4 lines   8 lines  16 lines  32 lines"
    );
    for (name, stack) in &lights {
        let open = stack(&GaussRule::new(64).iter().collect::<Vec<_>>(), None);
        for occluder in ["none", "edge over lines", "edge along lines"] {
            for kind in ["Gauss", "stratified"] {
                let mut random = Pcg64Mcg::new(1);
                let mut row = format!("{name:10} {occluder:17} {kind:12}");
                for lines in [1, 2, 4, 8, 16, 32] {
                    let mut sum = 0.0;
                    for i in 0..24 {
                        let aside = (f64::from(i) - 11.5) / 24.0 * 0.5;
                        // Seen from the receiver, the edge passes the light's middle at this distance.
                        let toward = DVec3::new(0.0, 1.5, aside) - receiver.position;
                        let edge = match occluder {
                            "edge over lines" => Some(DVec3::new(1.0, 0.0, 1.3)),
                            "edge along lines" => Some(DVec3::X),
                            _ => None,
                        };
                        let plane = edge.map(|edge| edge.cross(toward).normalize());
                        let dense: Vec<_> = (0..2048)
                            .map(|k| ((f64::from(k) + 0.5) / 2048.0, 1.0 / 2048.0))
                            .collect();
                        let truth = stack(&dense, plane);
                        let nodes: Vec<_> = if kind == "Gauss" {
                            GaussRule::new(lines).iter().collect()
                        } else {
                            let mut points = vec![0.0; lines];
                            Pattern::Stratified.fill(&mut random, &mut points);
                            sampled_nodes(&points).collect()
                        };
                        sum += ((stack(&nodes, plane) - truth) / open).powi(2);
                    }
                    row += &format!(" {:9.1e}", (sum / 24.0).sqrt());
                }
                println!("{row}");
            }
        }
    }
}
