//! The jumps of the expected estimate.

use crate::Method;

/// A place where the expected estimate jumps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// The place of the change, as a fraction of the first bracket.
    pub lambda: f64,
    /// The expected estimate for changes just below, as a fraction of the first bracket.
    pub below: f64,
    /// The same for changes at and just above.
    pub above: f64,
}

/// The jumps of the expected estimate of `method` after `tests` tests, in ascending order.
///
/// Pure and jittered bisection have 2<sup>tests</sup> - 1 of them, each 2<sup>-tests</sup> high (OF99
/// section 3.1, whose `n` is `tests + 1`): in a penumbra each is the border of a band. The other methods have
/// none. More than 52 tests count as 52, where neighbouring jumps are still distinct numbers.
///
/// ```
/// use llsr_rsb::{Method, jumps};
///
/// let bands: Vec<f64> = jumps(Method::Bisection, 2).map(|jump| jump.lambda).collect();
/// assert_eq!(bands, [0.25, 0.5, 0.75]);
/// assert_eq!(jumps(Method::RandomSeed, 2).count(), 0);
/// ```
pub fn jumps(method: Method, tests: u32) -> impl Iterator<Item = Jump> {
    let cells = match method {
        Method::Bisection | Method::Jittered => 1u64 << tests.min(52),
        _ => 1,
    };
    (1..cells).map(move |k| {
        let (k, height) = (k as f64, 1.0 / cells as f64);
        Jump {
            lambda: k * height,
            below: (k - 0.5) * height,
            above: (k + 0.5) * height,
        }
    })
}
