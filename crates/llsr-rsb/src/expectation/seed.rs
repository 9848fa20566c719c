//! Random seed bisection: bias and mean square error for any number of tests in constant time.
//!
//! With n tests a seed s above lambda leaves [0, s], which midpoints divide into N = 2^(n-1) cells; the change
//! is in cell k = floor(N lambda / s) and the estimate is c s with c = (k + 1/2) / N. For k above
//! K = floor(N lambda) the cell is chosen by s from N lambda / (k + 1) to N lambda / k, over which the error
//! c s - lambda runs from -lambda / (2 (k + 1)) to lambda / (2 k); for k = K, s ends at 1 already. Integrating
//! powers of the error over s, cell by cell, gives sums over k = K + 1 .. N - 1 of
//! 1 / (k (k + 1))^2 for the bias and of (1/k^3 + 1/(k + 1)^3) / (k + 1/2) for the square: all terms positive
//! and of the size of the result, so nothing cancels. Seeds below lambda are the mirror image.

/// Expected estimate minus `lambda`; `tests` in 1..=50.
pub(super) fn bias(tests: u32, lambda: f64) -> f64 {
    one_sided_bias(tests, lambda) - one_sided_bias(tests, 1.0 - lambda)
}

/// Expected square of estimate minus `lambda`; `tests` in 1..=50.
pub(super) fn mean_square_error(tests: u32, lambda: f64) -> f64 {
    one_sided_square(tests, lambda) + one_sided_square(tests, 1.0 - lambda)
}

/// Mean square of the length at which a search stops that stops at `width`, below 1.
///
/// The bracket that the seed leaves has length x with density 2 x; halving it k times while it is wider than
/// `width` divides the square by 4^k.
pub(super) fn mean_square_length(width: f64) -> f64 {
    let (mut sum, mut from, mut scale) = (0.5 * width.powi(4), width, 1.0);
    while from < 1.0 {
        let to = (2.0 * from).min(1.0);
        scale *= 0.25;
        sum += 0.5 * scale * (to.powi(4) - from.powi(4));
        from = to;
    }
    sum
}

/// The integral of the error over the seeds above `lambda`.
fn one_sided_bias(tests: u32, lambda: f64) -> f64 {
    let Cells {
        count,
        first,
        scale,
        top,
        bottom,
    } = Cells::new(tests, lambda);
    // 1 / (k (k + 1))^2 = x^-4 (1 - 1 / (4 x^2))^-2 with x = k + 1/2.
    let sum = sum(first + 1.0, count, |k| (k * (k + 1.0)).powi(-2), |j| j + 1.0);
    count * lambda * lambda / 4.0 * sum + (top + bottom) * (top - bottom) / (2.0 * scale)
}

/// The integral of the squared error over the seeds above `lambda`.
fn one_sided_square(tests: u32, lambda: f64) -> f64 {
    let Cells {
        count,
        first,
        scale,
        top,
        bottom,
    } = Cells::new(tests, lambda);
    // 1 / (x - 1/2)^3 + 1 / (x + 1/2)^3 = 2 x^-3 (1 + 6 y^2 + 15 y^4 + ...) with y = 1 / (2 x).
    let sum = sum(
        first + 1.0,
        count,
        |k| (k.powi(-3) + (k + 1.0).powi(-3)) / (k + 0.5),
        |j| 2.0 * (j + 1.0) * (2.0 * j + 1.0),
    );
    let uncut = (top + bottom) * (top * top - top * bottom + bottom * bottom) / (3.0 * scale);
    count * lambda.powi(3) / 24.0 * sum + uncut
}

/// The cells of the interval below a seed, seen from the change.
struct Cells {
    /// Number of cells N.
    count: f64,
    /// Number K of the cell that holds the change if the seed is 1.
    first: f64,
    /// The estimate in cell K as a multiple of the seed.
    scale: f64,
    /// The error in cell K at the largest seed, 1.
    top: f64,
    /// Minus the error in cell K at its smallest seed.
    bottom: f64,
}

impl Cells {
    fn new(tests: u32, lambda: f64) -> Self {
        let count = 2f64.powi(tests as i32 - 1);
        let first = if lambda < 1.0 {
            (count * lambda).floor()
        } else {
            count * lambda - 1.0
        };
        let scale = (first + 0.5) / count;
        Self {
            count,
            first,
            scale,
            top: scale - lambda,
            bottom: lambda / (2.0 * (first + 1.0)),
        }
    }
}

/// From here on the asymptotic series are exact to the last bit.
const ASYMPTOTIC: f64 = 40.0;

/// The sum of `term(k)` over whole k from `from` up to but not including `to`.
///
/// `term(k)` = x^-4 sum over j of `weight(j)` / (4 x^2)^j, with x = k + 1/2.
fn sum(from: f64, to: f64, term: impl Fn(f64) -> f64, weight: impl Fn(f64) -> f64) -> f64 {
    let mut k = from;
    let mut sum = 0.0;
    while k < to && (k < ASYMPTOTIC || to - k <= ASYMPTOTIC) {
        sum += term(k);
        k += 1.0;
    }
    if k < to {
        sum + tail(k, &weight) - tail(to, &weight)
    } else {
        sum
    }
}

/// The sum of the series of [`sum`] over all whole k from `from` on.
fn tail(from: f64, weight: &impl Fn(f64) -> f64) -> f64 {
    (0..5)
        .map(|j| weight(f64::from(j)) * 0.25f64.powi(j) * half_zeta(4 + 2 * j, from))
        .sum()
}

/// The sum of (k + 1/2)^-s over all whole k from `from` on, by the Euler-Maclaurin formula for midpoints.
fn half_zeta(s: i32, from: f64) -> f64 {
    /// Coefficients of the odd derivatives at the lower end.
    const MIDPOINT: [f64; 5] = [
        1.0 / 24.0,
        -7.0 / 5760.0,
        31.0 / 967_680.0,
        -127.0 / 154_828_800.0,
        73.0 / 3_503_554_560.0,
    ];
    let power = f64::from(s);
    let mut sum = from.powi(1 - s) / (power - 1.0);
    // Minus the derivative of x^-s, then every second one after it.
    let (mut derivative, mut order) = (power * from.powi(-s - 1), power + 1.0);
    for coefficient in MIDPOINT {
        sum -= coefficient * derivative;
        derivative *= order * (order + 1.0) / (from * from);
        order += 2.0;
    }
    sum
}
