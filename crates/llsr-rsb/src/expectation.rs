//! Closed forms for the estimate, its error and the length of the last bracket.
//!
//! One change at `lambda` in the bracket [0, 1], visible below it; `tests` tests inside the bracket. For
//! another bracket map it to [0, 1]: places and lengths scale with its length. `lambda` is clamped to [0, 1].

mod cut;
mod seed;

use crate::{Method, Stop};

/// Finer than this no estimate in an `f64` differs from the change: more tests count as so many.
const MAX_TESTS: u32 = 50;

/// The expected estimate of a change at `lambda` after `tests` tests.
///
/// * `Bisection`, `Jittered`: the middle of the cell of 2<sup>-tests</sup> that holds `lambda` (OF99 Eq. 2,
///   whose `n` is `tests + 1`).
/// * `RandomCut`: (1/2 + lambda (2<sup>n</sup> - 1)) / 2<sup>n</sup> (OF99 Eq. 3, corrected).
/// * `RandomSeed`: continuous, quadratic between the multiples of 2<sup>-(n-1)</sup> (OF99 Table 1 for n up
///   to 3).
/// * `Dithered`: `lambda`.
///
/// Without a test it is 1/2 for all. More than 50 tests count as 50.
///
/// # Cost and error
/// Constant time, for `RandomSeed` at most about 160 additions; the error is a few units of 2<sup>-53</sup>,
/// that of the bias `expected_estimate - lambda` relative to the bias.
///
/// ```
/// use llsr_rsb::{Method, expected_estimate};
///
/// // OF99 Table 1, n = 2: 1/8 + lambda / 4 + lambda^2 on [0, 1/2].
/// let lambda = 0.375;
/// let expected = expected_estimate(Method::RandomSeed, 2, lambda);
/// assert!((expected - (0.125 + 0.25 * lambda + lambda * lambda)).abs() < 1e-15);
/// ```
pub fn expected_estimate(method: Method, tests: u32, lambda: f64) -> f64 {
    let lambda = lambda.clamp(0.0, 1.0);
    let tests = tests.min(MAX_TESTS);
    match method {
        _ if tests == 0 => 0.5,
        Method::Bisection | Method::Jittered => cell_midpoint(tests, lambda),
        Method::RandomCut => {
            let length = power_of_half(tests);
            0.5 * length + lambda * (1.0 - length)
        }
        Method::RandomSeed => lambda + seed::bias(tests, lambda),
        Method::Dithered | Method::DitheredAt(_) => lambda,
    }
}

/// The expected square of estimate minus change, for a change at `lambda` after `tests` tests.
///
/// Bias included. `DitheredAt` stands for a shift uniform over the pixels, as from a mask. Derived here, not
/// in the paper; cost and error as for [`expected_estimate`].
///
/// ```
/// use llsr_rsb::{Method, mean_square_error};
///
/// let rms = |method, lambda| mean_square_error(method, 4, lambda).sqrt();
/// assert!(rms(Method::RandomSeed, 0.5) > 1.5 * rms(Method::Dithered, 0.5));
/// ```
pub fn mean_square_error(method: Method, tests: u32, lambda: f64) -> f64 {
    let lambda = lambda.clamp(0.0, 1.0);
    let tests = tests.min(MAX_TESTS);
    let length = power_of_half(tests);
    match method {
        Method::Bisection => (cell_midpoint(tests, lambda) - lambda).powi(2),
        Method::Jittered => (cell_midpoint(tests, lambda) - lambda).powi(2) + length * length / 12.0,
        Method::RandomCut => cut::mean_square_error(tests, lambda),
        _ if tests == 0 => (0.5 - lambda).powi(2),
        Method::RandomSeed => seed::mean_square_error(tests, lambda),
        Method::Dithered | Method::DitheredAt(_) => length * length / 12.0,
    }
}

/// The mean square error of a search that stops by `stop`, for changes uniform in the bracket [0, 1].
///
/// Derived here, not in the paper. A change uniform in the bracket is uniform in the last bracket, whatever the
/// cuts, so the error is a twelfth of the mean square length of the last bracket (a sixth with jitter).
/// Tolerances below 2<sup>-51</sup> count as that.
///
/// ```
/// use llsr_rsb::{Method, Stop, average_mean_square_error};
///
/// let rms = |method| average_mean_square_error(method, Stop::Tolerance(0.05)).sqrt();
/// assert!((rms(Method::RandomSeed) - 0.0207).abs() < 1e-4);
/// assert!((rms(Method::Dithered) - 0.0180).abs() < 1e-4);
/// ```
pub fn average_mean_square_error(method: Method, stop: Stop) -> f64 {
    let square = match (method, width(stop)) {
        (_, Err(width)) if width >= 1.0 => 1.0,
        (Method::RandomCut, Ok(tests)) => power_of_half(tests),
        // The last cut overshoots the width by a factor whose square is uniform on [0, 1].
        (Method::RandomCut, Err(width)) => 0.5 * width * width,
        (Method::RandomSeed, Ok(tests)) if tests > 0 => 2.0 * power_of_half(tests).powi(2),
        (Method::RandomSeed, Err(width)) => seed::mean_square_length(width),
        (Method::Dithered | Method::DitheredAt(_), Ok(tests))
            if tests > 0 && matches!(stop, Stop::Budget(_)) =>
        {
            (2f64.powi(tests as i32) - 1.0).powi(-2)
        }
        (_, Ok(tests)) => power_of_half(tests).powi(2),
        (_, Err(width)) => power_of_half(halvings(width)).powi(2),
    };
    square / if method == Method::Jittered { 6.0 } else { 12.0 }
}

/// The mean number of tests of a search that stops by `stop`, for changes uniform in the bracket [0, 1].
///
/// To a tolerance e, with w = 2 e: ceil(log2(1 / w)) for `Bisection` and `Jittered`, 1 + 2 ln(1 / w) for
/// `RandomCut`, 1 + the sum of 1 - (2<sup>k</sup> w)<sup>2</sup> over its positive terms, k from 0, for
/// `RandomSeed`; n + 1.25 x 2<sup>-n</sup> for `Dithered`, where n is that of `Bisection`. Tolerances below
/// 2<sup>-51</sup> count as that.
///
/// ```
/// use llsr_rsb::{Method, Stop, average_tests};
///
/// let tests = |method| average_tests(method, Stop::Tolerance(0.05));
/// assert_eq!(tests(Method::Bisection), 4.0);
/// assert!((tests(Method::RandomSeed) - 4.15).abs() < 1e-12);
/// ```
pub fn average_tests(method: Method, stop: Stop) -> f64 {
    let lattice = |n: u32| f64::from(n) + if n > 0 { 1.25 * power_of_half(n) } else { 0.0 };
    match (method, width(stop)) {
        (_, Err(width)) if width >= 1.0 => 0.0,
        (Method::RandomCut, Err(width)) => 1.0 - 2.0 * width.ln(),
        (Method::RandomSeed, Err(width)) => {
            let terms = (0..=MAX_TESTS as i32).map(|k| 1.0 - (2f64.powi(k) * width).powi(2));
            1.0 + terms.take_while(|&term| term > 0.0).sum::<f64>()
        }
        (Method::Dithered | Method::DitheredAt(_), Ok(tests)) if matches!(stop, Stop::Tests(_)) => {
            lattice(tests)
        }
        (Method::Dithered | Method::DitheredAt(_), Err(width)) => lattice(halvings(width)),
        (_, Ok(tests)) => f64::from(tests),
        (_, Err(width)) => f64::from(halvings(width)),
    }
}

/// The number of tests after which `stop` ends a search, or else the width of bracket at which it does.
fn width(stop: Stop) -> Result<u32, f64> {
    match stop {
        Stop::Tests(n) | Stop::Budget(n) => Ok(n.min(MAX_TESTS)),
        Stop::Tolerance(tolerance) => Err((2.0 * tolerance).max(power_of_half(MAX_TESTS))),
    }
}

/// The number of halvings that bring [0, 1] down to `width`.
fn halvings(width: f64) -> u32 {
    (0..MAX_TESTS)
        .find(|&n| power_of_half(n) <= width)
        .unwrap_or(MAX_TESTS)
}

/// The expected length of the last bracket around a change at `lambda` after `tests` tests.
///
/// * `Bisection`, `Jittered`, `Dithered`: 2<sup>-tests</sup>, for certain.
/// * `RandomSeed`: (1/2 + lambda (1 - lambda)) / 2<sup>tests - 1</sup>.
/// * `RandomCut`: no closed form in elementary functions (polylogarithms of growing weight), so the integral
///   equation between successive `tests` is solved on graded Chebyshev panels; error below 1e-12 of the
///   value, about 30 000 multiplications a test, more than 1000 tests count as 1000.
pub fn expected_bracket_length(method: Method, tests: u32, lambda: f64) -> f64 {
    let lambda = lambda.clamp(0.0, 1.0);
    match method {
        Method::RandomCut => cut::expected_length(tests.min(1000), lambda),
        Method::RandomSeed if tests > 0 => (1.0 + 2.0 * lambda * (1.0 - lambda)) * power_of_half(tests),
        _ => power_of_half(tests),
    }
}

/// The mean of [`expected_bracket_length`] over changes uniform in the bracket (OF99 sections 3.3 and 3.4).
///
/// (2/3)<sup>n</sup> for `RandomCut`, (2/3) 2<sup>-(n-1)</sup> for `RandomSeed`, 2<sup>-n</sup> for the others,
/// with n = `tests`.
pub fn average_bracket_length(method: Method, tests: u32) -> f64 {
    match method {
        Method::RandomCut => (2.0f64 / 3.0).powi(tests.min(i32::MAX as u32) as i32),
        Method::RandomSeed if tests > 0 => 4.0 / 3.0 * power_of_half(tests),
        _ => power_of_half(tests),
    }
}

/// 2 to the minus `tests`.
fn power_of_half(tests: u32) -> f64 {
    0.5f64.powi(tests.min(2000) as i32)
}

/// The midpoint of the cell that holds `lambda`, of 2<sup>tests</sup> equal ones; a change on a cell's border
/// is in the cell above it.
fn cell_midpoint(tests: u32, lambda: f64) -> f64 {
    let cells = 2f64.powi(tests as i32);
    let cell = if lambda < 1.0 {
        (lambda * cells).floor()
    } else {
        (lambda * cells) - 1.0
    };
    (cell + 0.5) / cells
}

#[cfg(test)]
mod tests;
