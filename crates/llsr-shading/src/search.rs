//! The search methods, from "which part of the light can be seen" to a partition.

use llsr_rsb::{Method as Bisection, Stop, bisect};
use llsr_visibility::{Bracket, Certificate, Panel, Partition, Visibility};
use rand_pcg::Pcg64Mcg;

/// Both ends are tested; where they differ, one change is found by `bisection` (Ouellette & Fiume 1999,
/// section 4). Sees at most one change.
pub(crate) fn single_change(
    oracle: &mut impl Visibility,
    bisection: Bisection,
    epsilon: f64,
    rng: &mut Pcg64Mcg,
    visible: &mut Partition,
) {
    visible.clear();
    let mut ends = [false; 2];
    oracle.visible_each(&[0.0, 1.0], &mut ends);
    match ends {
        [true, true] => visible.fill(),
        [false, false] => {}
        [first, _] => {
            let unit = Bracket::new(0.0, 1.0, first);
            let found = bisect(bisection, oracle, unit, Stop::Tolerance(epsilon), rng);
            // Clamping where the lattice of a dithered search sticks out costs a bias of at most h/8 near the ends.
            let change = found.estimate.clamp(0.0, 1.0);
            let uncertainty = found.uncertainty();
            visible.push(if first {
                Panel {
                    start: 0.0,
                    end: change,
                    start_uncertainty: 0.0,
                    end_uncertainty: uncertainty,
                }
            } else {
                Panel {
                    start: change,
                    end: 1.0,
                    start_uncertainty: uncertainty,
                    end_uncertainty: 0.0,
                }
            });
        }
    }
    visible.set_certificate(Certificate::Sampled);
}

/// What tested points suggest: each answer holds half way to the next point.
pub(crate) fn samples_to_panels(samples: &mut [(f64, bool)], visible: &mut Partition) {
    visible.clear();
    samples.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut open: Option<(f64, f64)> = None;
    let mut before: Option<(f64, bool)> = None;
    for &(t, lit) in samples.iter() {
        let change = before.map_or((0.0, 0.0), |(from, _)| (0.5 * (from + t), 0.5 * (t - from)));
        match (open, lit) {
            (None, true) => open = Some(change),
            (Some((start, start_uncertainty)), false) => {
                let (end, end_uncertainty) = change;
                visible.push(Panel {
                    start,
                    end,
                    start_uncertainty,
                    end_uncertainty,
                });
                open = None;
            }
            _ => {}
        }
        before = Some((t, lit));
    }
    if let Some((start, start_uncertainty)) = open {
        visible.push(Panel {
            start,
            end: 1.0,
            start_uncertainty,
            end_uncertainty: 0.0,
        });
    }
    visible.set_certificate(Certificate::Sampled);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_hold_half_way_to_the_next_point() {
        let mut visible = Partition::dark();
        samples_to_panels(
            &mut [(0.5, true), (0.1, false), (0.9, false), (0.3, true)],
            &mut visible,
        );
        assert_eq!(visible.panels().len(), 1, "two neighbours make one panel");
        assert!(
            (visible.panels()[0].start - 0.2).abs() < 1e-15,
            "between 0.1 and 0.3"
        );
        assert!(
            (visible.panels()[0].end - 0.7).abs() < 1e-15,
            "between 0.5 and 0.9"
        );
        samples_to_panels(&mut [(0.2, true)], &mut visible);
        assert!(visible.is_lit(), "one visible sample stands for the whole light");
        samples_to_panels(&mut [(0.2, false)], &mut visible);
        assert!(visible.is_dark(), "one hidden sample too");
    }
}
