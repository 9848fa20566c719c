//! Adaptive Gauss-Kronrod quadrature with compensated sums.

/// Nodes of the 15-point Kronrod rule on [-1, 1] that are not negative, from the outermost (QUADPACK, qk15).
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_56,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
/// Weights of the embedded 7-point Gauss rule, for the nodes of odd index.
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

/// Neumaier's compensated sum.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sum {
    sum: f64,
    rest: f64,
}

impl Sum {
    /// Adds a term.
    pub fn add(&mut self, term: f64) {
        let next = self.sum + term;
        self.rest += if self.sum.abs() >= term.abs() {
            (self.sum - next) + term
        } else {
            (term - next) + self.sum
        };
        self.sum = next;
    }

    /// The sum of all terms so far.
    pub fn value(self) -> f64 {
        self.sum + self.rest
    }
}

/// The Kronrod estimate on `[lo, hi]` and its distance to the Gauss estimate.
fn kronrod(f: &mut impl FnMut(f64) -> f64, lo: f64, hi: f64) -> (f64, f64) {
    let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
    let (mut fine, mut coarse) = (Sum::default(), Sum::default());
    for (i, &x) in NODES.iter().enumerate() {
        let value = if x == 0.0 {
            f(middle)
        } else {
            f(middle - half * x) + f(middle + half * x)
        };
        fine.add(KRONROD[i] * value);
        if i % 2 == 1 {
            coarse.add(GAUSS[i / 2] * value);
        }
    }
    (half * fine.value(), half * (fine.value() - coarse.value()).abs())
}

/// The integral of `f` from `lo` to `hi` by bisection until the rules of 7 and 15 points agree to `tolerance`
/// relative to the whole, and the sum of the pieces.
///
/// The estimate of the error is that of the 7-point rule, so the 15-point result is far better than asked.
/// `f` must be bounded and, between finitely many kinks, smooth. At most 20,000 pieces: after that the best
/// there is; a caller with kinks in known places should split there.
pub fn adaptive(mut f: impl FnMut(f64) -> f64, lo: f64, hi: f64, tolerance: f64) -> f64 {
    let mut total = Sum::default();
    let first = kronrod(&mut f, lo, hi);
    // A peak that the first look misses must not make the goal too strict: the goal follows what is found.
    let mut magnitude = first.0.abs();
    let mut pending = vec![(lo, hi, first.0, first.1)];
    let mut pieces = 0;
    while let Some((lo, hi, value, error)) = pending.pop() {
        pieces += 1;
        let middle = 0.5 * (lo + hi);
        let done = error <= tolerance * magnitude * 1e-2 || error <= tolerance * value.abs();
        if done || pieces > 20_000 || middle <= lo.min(hi) || middle >= lo.max(hi) {
            total.add(value);
            continue;
        }
        for (lo, hi) in [(lo, middle), (middle, hi)] {
            let (value, error) = kronrod(&mut f, lo, hi);
            magnitude = magnitude.max(value.abs());
            pending.push((lo, hi, value, error));
        }
    }
    total.value()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rules_are_exact_to_their_degree() {
        for degree in 0..=22 {
            let (fine, _) = kronrod(&mut |x: f64| x.powi(degree), 0.0, 1.0);
            let exact = 1.0 / f64::from(degree + 1);
            assert!(
                (fine - exact).abs() < 1e-15,
                "degree {degree}: {fine} against {exact}"
            );
        }
    }

    #[test]
    fn peaks_and_end_points_are_resolved() {
        let w = 1e-6;
        let peak = adaptive(|x| w / (w * w + x * x), 0.0, 1.0, 1e-13);
        assert!((peak - (1.0 / w).atan()).abs() < 1e-13, "arc tangent: {peak}");
        let exponential = adaptive(f64::exp, -30.0, 0.0, 1e-13);
        assert!(
            (exponential - (1.0 - (-30f64).exp())).abs() < 1e-14,
            "exponential: {exponential}"
        );
    }
}
