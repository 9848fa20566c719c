//! Means of samples, and how far from a claim they may lie.

use std::fmt;

use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::SEED;

/// A claim about an expected value, with what was measured.
pub(super) struct Claim {
    /// The setting, for a reader.
    pub(super) place: String,
    claimed: f64,
    mean: f64,
    /// Standard deviation of the mean.
    deviation: f64,
}

impl Claim {
    /// Draws `samples` values from the stream number `number` and compares their mean with `claimed`.
    pub(super) fn new(
        place: String,
        number: u64,
        samples: u32,
        claimed: f64,
        mut draw: impl FnMut(&mut Pcg64Mcg) -> f64,
    ) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(SEED + number);
        // Sums of differences from the claim: nothing cancels if it is right.
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..samples {
            let difference = draw(&mut rng) - claimed;
            sum += difference;
            squares += difference * difference;
        }
        let samples = f64::from(samples);
        let variance = (squares - sum * sum / samples) / (samples - 1.0);
        Self {
            place,
            claimed,
            mean: claimed + sum / samples,
            deviation: (variance.max(0.0) / samples).sqrt(),
        }
    }

    /// How many standard deviations the mean lies from the claim.
    pub(super) fn deviations(&self) -> f64 {
        let distance = (self.mean - self.claimed).abs();
        // What does not vary has only the rounding of its sums.
        if distance <= 1e-12 {
            0.0
        } else {
            distance / self.deviation.max(1e-13)
        }
    }
}

impl fmt::Display for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: claimed {:.6}, measured {:.6}, {:.1} deviations",
            self.place,
            self.claimed,
            self.mean,
            self.deviations()
        )
    }
}

/// The number of deviations that the means of `count` true claims all keep to with probability 1 - `level`.
///
/// Sidak: each claim alone may then fail with probability 1 - (1 - level)^(1 / count).
pub(super) fn limit(level: f64, count: usize) -> f64 {
    let each = -f64::exp_m1(f64::ln_1p(-level) / count as f64);
    let (mut low, mut high) = (2.0, 40.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if two_sided(middle) > each {
            low = middle
        } else {
            high = middle
        }
    }
    high
}

/// Probability that a standard normal variable lies beyond `z` or -`z`; `z` at least 2.
///
/// Twice the tail of the density by Laplace's continued fraction, from the 200th partial denominator up.
fn two_sided(z: f64) -> f64 {
    let fraction = (1..=200).rev().fold(z, |rest, k| z + f64::from(k) / rest);
    2.0 * (-0.5 * z * z).exp() / (std::f64::consts::TAU.sqrt() * fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_tail_agrees_with_tables() {
        for (z, probability) in [(2.0, 0.045_500_26), (3.0, 0.002_699_796), (5.0, 5.733_031e-7)] {
            let ours = two_sided(z);
            assert!((ours / probability - 1.0).abs() < 1e-6, "{z}: {ours}");
        }
        assert!(
            (limit(0.01, 1) - 2.575_829).abs() < 1e-5,
            "one claim: {}",
            limit(0.01, 1)
        );
        assert!(limit(0.01, 1000) > limit(0.01, 100), "more claims, wider limits");
    }

    #[test]
    fn a_wrong_claim_is_rejected_and_a_right_one_kept() {
        let draw = |rng: &mut Pcg64Mcg| llsr_rsb::uniform(rng);
        let claim = |claimed: f64| Claim::new(String::new(), 1, 1 << 16, claimed, draw).deviations();
        assert!(claim(0.5) < 4.0, "the mean of uniform numbers");
        assert!(claim(0.51) > 5.0, "one hundredth off");
        let constant = |claimed: f64| Claim::new(String::new(), 1, 1 << 16, claimed, |_| 0.25).deviations();
        assert_eq!(constant(0.25), 0.0, "what does not vary");
        assert!(
            constant(0.25 + 1e-9) > 1000.0,
            "what does not vary must hold to rounding"
        );
    }
}
