//! Illuminance along a line on the floor under a half-hidden tube: closed form against the 2-point rule.
//!
//! `cargo run -p llsr-quadrature --example panels`

use glam::DVec3;
use llsr_quadrature::{Emission, GaussRule, LineIrradiance, LineLight, Receiver, gauss};
use llsr_visibility::{Panel, Partition};

fn main() {
    let light = LineLight {
        a: DVec3::new(-0.6, 2.5, 0.0),
        b: DVec3::new(0.6, 2.5, 0.0),
        emission: Emission::Diffuse,
        flux: 3000.0,
    };
    let two_points = GaussRule::new(2);
    println!("     x  visible    closed form    2 points   error");
    for i in 0..=10 {
        let x = -1.0 + 0.2 * f64::from(i);
        // A wall at x = 0 from 1 m to 2 m high hides what lies behind it.
        let visible_to = ((1.0 - x) / 1.2).clamp(0.0, 1.0);
        let mut visible = Partition::dark();
        visible.insert(Panel::exact(0.0, visible_to));
        let receiver = Receiver {
            position: DVec3::new(x, 0.0, 0.0),
            normal: DVec3::Y,
        };
        let line = LineIrradiance::new(&receiver, &light);
        let exact = line.partition(&visible);
        let estimate = gauss(&two_points, &visible, |t| line.density(t));
        let error = if exact > 0.0 {
            100.0 * (estimate / exact - 1.0)
        } else {
            0.0
        };
        println!("{x:6.1} {visible_to:8.3} {exact:11.4} lx {estimate:8.4} lx {error:6.3}%");
    }
}
