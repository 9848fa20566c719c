//! The one-dimensional filters of FLIP. All of its two-dimensional filters are products of these or, for blue
//! against yellow, the sum of two products.

use std::f64::consts::PI;

/// Gaussian terms (a, b) of the contrast sensitivity functions (Andersson et al. 2020, table 1); the second
/// term of the first two channels has weight 0 there.
const ACHROMATIC: (f64, f64) = (1.0, 0.0047);
const RED_GREEN: (f64, f64) = (1.0, 0.0053);
const BLUE_YELLOW: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];
/// Width of the feature detectors in degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Taps below this share of the largest one are below the rounding of f32 sums.
const NEGLIGIBLE: f64 = 1e-10;

/// An odd number of taps around the pixel.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    taps: Vec<f32>,
}

impl Kernel {
    /// Drops pairs of negligible taps at both ends.
    fn new(taps: &[f64]) -> Self {
        let largest = taps.iter().fold(0f64, |m, t| m.max(t.abs()));
        let kept = |t: &f64| t.abs() > NEGLIGIBLE * largest;
        let left = taps.iter().position(kept).unwrap_or(0);
        let right = taps.iter().rev().position(kept).unwrap_or(0);
        let skip = left.min(right);
        Self {
            taps: taps[skip..taps.len() - skip].iter().map(|&t| t as f32).collect(),
        }
    }

    pub(super) fn radius(&self) -> usize {
        self.taps.len() / 2
    }

    pub(super) fn taps(&self) -> &[f32] {
        &self.taps
    }
}

/// All filters for one number of pixels per degree.
#[derive(Clone, Debug)]
pub(super) struct Kernels {
    pub(super) achromatic: Kernel,
    pub(super) red_green: Kernel,
    /// Horizontal filters of the two terms.
    pub(super) blue_yellow: [Kernel; 2],
    /// The same as vertical filters, multiplied by the weights of the terms.
    pub(super) blue_yellow_weighted: [Kernel; 2],
    pub(super) gaussian: Kernel,
    /// First derivative of the Gaussian; positive taps sum to 1, negative ones to -1.
    pub(super) edge: Kernel,
    /// Second derivative of the Gaussian; positive taps sum to 1, negative ones to -1.
    pub(super) point: Kernel,
}

impl Kernels {
    pub(super) fn new(pixels_per_degree: f64) -> Self {
        let widest = BLUE_YELLOW[0].1;
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
        let degrees = |i: i32| f64::from(i) / pixels_per_degree;
        let gaussian = |b: f64| -> Vec<f64> {
            let taps = (-radius..=radius).map(|i| (-PI * PI / b * degrees(i).powi(2)).exp());
            taps.collect()
        };
        let unit = |taps: Vec<f64>, weight: f64| {
            let sum: f64 = taps.iter().sum();
            Kernel::new(&taps.iter().map(|t| weight * t / sum).collect::<Vec<_>>())
        };
        // Weight of a two-dimensional term: the sum of its taps over the square window.
        let weights = BLUE_YELLOW.map(|(a, b)| {
            let sum: f64 = gaussian(b).iter().sum();
            a * (PI / b).sqrt() * sum * sum
        });
        let total: f64 = weights.iter().sum();

        let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let radius = (3.0 * sigma).ceil() as i32;
        let feature = |factor: fn(f64) -> f64| -> Vec<f64> {
            let taps = (-radius..=radius).map(|i| {
                let x = f64::from(i) / sigma;
                factor(x) * (-0.5 * x * x).exp()
            });
            taps.collect()
        };
        Self {
            achromatic: unit(gaussian(ACHROMATIC.1), ACHROMATIC.0),
            red_green: unit(gaussian(RED_GREEN.1), RED_GREEN.0),
            blue_yellow: BLUE_YELLOW.map(|(_, b)| unit(gaussian(b), 1.0)),
            blue_yellow_weighted: [0, 1].map(|i| unit(gaussian(BLUE_YELLOW[i].1), weights[i] / total)),
            gaussian: unit(feature(|_| 1.0), 1.0),
            edge: balanced(feature(|x| -x)),
            point: balanced(feature(|x| x * x - 1.0)),
        }
    }

    /// The largest radius of any filter, in pixels.
    pub(super) fn radius(&self) -> usize {
        let colour = self.blue_yellow[0].radius().max(self.blue_yellow[1].radius());
        let colour = colour.max(self.achromatic.radius()).max(self.red_green.radius());
        let feature = self.gaussian.radius().max(self.edge.radius());
        colour.max(feature).max(self.point.radius())
    }
}

/// Scales positive and negative taps so that they sum to 1 and -1.
fn balanced(taps: Vec<f64>) -> Kernel {
    let positive: f64 = taps.iter().filter(|&&t| t > 0.0).sum();
    let negative: f64 = -taps.iter().filter(|&&t| t < 0.0).sum::<f64>();
    let scaled = taps
        .iter()
        .map(|&t| if t > 0.0 { t / positive } else { t / negative });
    Kernel::new(&scaled.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_hold_at_any_resolution() {
        for ppd in [1.0, 5.5, 24.0, 67.0, 250.0, 1000.0] {
            let kernels = Kernels::new(ppd);
            let sum = |kernel: &Kernel| kernel.taps().iter().map(|&t| f64::from(t)).sum::<f64>();
            for kernel in [&kernels.achromatic, &kernels.red_green, &kernels.gaussian] {
                assert!((sum(kernel) - 1.0).abs() < 1e-5, "{ppd}: {}", sum(kernel));
            }
            let weighted: f64 = kernels.blue_yellow_weighted.iter().map(sum).sum();
            assert!((weighted - 1.0).abs() < 1e-5, "{ppd}: {weighted}");
            for kernel in [&kernels.edge, &kernels.point] {
                assert!(sum(kernel).abs() < 1e-5, "{ppd}: {}", sum(kernel));
                let positive: f64 = kernel.taps().iter().map(|&t| f64::from(t.max(0.0))).sum();
                assert!((positive - 1.0).abs() < 1e-5, "{ppd}: {positive}");
            }
        }
    }

    #[test]
    fn blue_yellow_is_widest() {
        let kernels = Kernels::new(67.0);
        assert_eq!(
            kernels.radius(),
            10,
            "3 standard deviations of 0.045 degrees at 67 pixels a degree"
        );
        assert!(
            kernels.achromatic.radius() < kernels.blue_yellow[0].radius(),
            "narrower filters are cut"
        );
    }
}
