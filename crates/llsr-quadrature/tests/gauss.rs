//! Gauss rules against identities, and the 2-point rule of the 1999 paper against the closed forms.

use glam::DVec3;
use llsr_quadrature::{Emission, GaussRule, LineIrradiance, LineLight, Receiver, gauss};
use llsr_visibility::{Panel, Partition};

#[test]
fn rules_are_exact_to_their_degree() {
    for order in [1, 2, 3, 4, 5, 7, 8, 15, 16, 31, 64] {
        let rule = GaussRule::new(order);
        for degree in 0..2 * order {
            let integral: f64 = rule.integrate(0.0, 1.0, |t| t.powi(degree as i32));
            let exact = 1.0 / (degree + 1) as f64;
            assert!(
                (integral - exact).abs() < 4e-15,
                "order {order}, degree {degree}: {integral}"
            );
        }
        // One degree more is not exact: the error of the monic polynomial on [0, 1] is known.
        let above = rule.integrate(0.0, 1.0, |t| t.powi(2 * order as i32));
        let n = order as f64;
        let error = (1..=order).fold(1.0 / (2.0 * n + 1.0), |e, k| {
            e * (k as f64 / (n + k as f64)).powi(2)
        });
        let found = 1.0 / (2.0 * n + 1.0) - above;
        assert!(
            (found - error).abs() < 4e-15,
            "order {order}: error {found:e}, not {error:e}"
        );
    }
}

#[test]
fn nodes_and_weights_are_those_of_the_tables() {
    let three = GaussRule::new(3);
    let x = 0.5 * 0.6f64.sqrt();
    for (found, exact) in three.nodes().iter().zip([0.5 - x, 0.5, 0.5 + x]) {
        assert!((found - exact).abs() < 2e-16, "node {found}, not {exact}");
    }
    for (found, exact) in three.weights().iter().zip([5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0]) {
        assert!((found - exact).abs() < 2e-16, "weight {found}, not {exact}");
    }
}

#[test]
fn large_rules_stay_accurate() {
    for order in [100, 501, 2000] {
        let rule = GaussRule::new(order);
        let sum: f64 = rule.weights().iter().sum();
        assert!((sum - 1.0).abs() < 1e-13, "order {order}: weights sum to {sum}");
        assert!(
            rule.nodes().windows(2).all(|w| w[0] < w[1]),
            "order {order}: nodes ascend"
        );
        // A wave of many periods, still resolved.
        let k = order as f64;
        let wave = rule.integrate(0.0, 1.0, |t| (k * t).cos());
        assert!((wave - k.sin() / k).abs() < 1e-14, "order {order}: {wave}");
    }
}

#[test]
fn an_order_of_nothing_is_the_midpoint_rule() {
    assert_eq!(GaussRule::new(0), GaussRule::new(1), "0 counts as 1");
    assert_eq!(GaussRule::new(1).nodes(), [0.5]);
}

/// The relative error of a rule on the light of the paper's figure 5 (a long light behind a floor), the
/// largest over receivers and panels.
fn worst_error(order: usize, emission: Emission) -> f64 {
    let rule = GaussRule::new(order);
    let light = LineLight {
        a: DVec3::new(-2.0, 1.5, 0.0),
        b: DVec3::new(2.0, 1.5, 0.0),
        emission,
        flux: 1.0,
    };
    let mut worst = 0.0f64;
    for i in 0..20 {
        for j in 1..=20 {
            let position = DVec3::new(f64::from(i) * 0.2 - 2.0, 0.0, f64::from(j) * 0.2);
            let line = LineIrradiance::new(
                &Receiver {
                    position,
                    normal: DVec3::Y,
                },
                &light,
            );
            for end in [0.25, 0.5, 0.75, 1.0] {
                let mut visible = Partition::dark();
                visible.insert(Panel::exact(0.0, end));
                let exact = line.partition(&visible);
                let estimate = gauss(&rule, &visible, |t| line.density(t));
                worst = worst.max((estimate / exact - 1.0).abs());
            }
        }
    }
    worst
}

#[test]
fn two_points_are_good_and_more_are_better() {
    for emission in [Emission::Diffuse, Emission::Isotropic] {
        let errors = [1, 2, 4, 8].map(|order| worst_error(order, emission));
        assert!(
            errors[0] > 0.5,
            "one point is no good under a long light: {errors:?}"
        );
        assert!(
            errors[1] < 0.35 && errors[2] < 0.05 && errors[3] < 2e-3,
            "{emission:?}: {errors:?}"
        );
        assert!(
            errors.windows(2).all(|e| e[1] < 0.5 * e[0]),
            "{emission:?} converges: {errors:?}"
        );
    }
}
