//! Which search to run, when it stops and what it returns.

use llsr_visibility::{Bracket, Visibility};
use rand_core::Rng;

use crate::{
    dithered_bisection, jittered_bisection, pure_bisection, random_cut, random_seed_bisection, uniform,
};

/// A way to narrow a bracket around a change of visibility.
///
/// OF99 is Ouellette & Fiume 1999.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// Pure bisection: test midpoints (OF99 section 3.1). Best worst case; its expected estimate is a staircase.
    Bisection,
    /// Jittered bisection: as pure bisection, but the estimate is uniform in the last bracket (OF99 section 3.2).
    Jittered,
    /// Random cut: test a point uniform in the bracket (OF99 section 3.3).
    RandomCut,
    /// Random seed bisection: one test uniform in the bracket, then midpoints (OF99 section 3.4).
    RandomSeed,
    /// Dithered bisection, the shift of its lattice drawn from the stream.
    Dithered,
    /// Dithered bisection with the shift given in cells, in [0, 1): for a blue-noise mask over the pixels.
    ///
    /// Draws nothing from the stream.
    DitheredAt(f64),
}

impl Method {
    /// Every method that needs no parameter, in the order of the paper, dithered bisection last.
    pub const ALL: [Self; 5] = [
        Self::Bisection,
        Self::Jittered,
        Self::RandomCut,
        Self::RandomSeed,
        Self::Dithered,
    ];

    /// A short name in lower case: `bisection`, `jittered-bisection`, `random-cut`, `rsb` or `dithered`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bisection => "bisection",
            Self::Jittered => "jittered-bisection",
            Self::RandomCut => "random-cut",
            Self::RandomSeed => "rsb",
            Self::Dithered | Self::DitheredAt(_) => "dithered",
        }
    }
}

/// When a search stops.
///
/// Every search also stops where no representable number lies inside the bracket, so none is endless,
/// whatever is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// After this many tests inside the bracket (the `n` of [`expected_estimate`](crate::expected_estimate)).
    ///
    /// Dithered bisection spaces its lattice by 2<sup>-n</sup> brackets. That is one cell more than `n`
    /// answers can tell apart, so five searches in 4 x 2<sup>n</sup> take one test more. Where that matters
    /// ask for a [`Budget`](Self::Budget).
    Tests(u32),
    /// As `Tests`, but never more: dithered bisection spaces its lattice by 1 / (2<sup>n</sup> - 1) brackets
    /// and makes exactly `n` tests. The same as `Tests` for the other methods.
    Budget(u32),
    /// As soon as half the bracket is at most this, in light parameters; a bracket that is so short already
    /// is returned without a test. The estimate is then no further than this from a change, that of jittered
    /// bisection no further than twice this. Zero, negative and NaN ask for all the precision there is.
    Tolerance(f64),
}

impl Stop {
    /// True if a search that has made `tests` tests may return `bracket`.
    pub(crate) fn reached(self, bracket: &Bracket, tests: u32) -> bool {
        match self {
            Self::Tests(n) | Self::Budget(n) => tests >= n,
            Self::Tolerance(tolerance) => 0.5 * bracket.len() <= tolerance,
        }
    }
}

/// What a search found: where a change of visibility lies, and what that took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Encloses a change. Inside the first bracket, except that the outermost cells of a dithered search
    /// stick out of it by less than one cell.
    pub bracket: Bracket,
    /// The place of the change as a light parameter: the midpoint of the bracket, for jittered bisection a
    /// uniform point of it. Not clamped to the first bracket.
    pub estimate: f64,
    /// Tests made inside the first bracket; whatever told its ends apart is not counted.
    pub tests: u32,
}

impl Found {
    /// The estimate half way between the ends of `bracket`.
    pub(crate) fn at_midpoint(bracket: Bracket, tests: u32) -> Self {
        Self {
            bracket,
            estimate: bracket.midpoint(),
            tests,
        }
    }

    /// The largest possible distance between estimate and change, in light parameters.
    pub fn uncertainty(&self) -> f64 {
        (self.estimate - self.bracket.lo).max(self.bracket.hi - self.estimate)
    }
}

/// Narrows `bracket` by `method` until `stop`.
///
/// `bracket` is in light parameters and may be any part of the light; its two ends must answer differently,
/// and are not tested again. If several changes lie inside, one of them is found; which one depends on the
/// tests that happen to be made.
///
/// `rng` is drawn from once by `RandomSeed`, `Dithered` and `Jittered`, once a test by `RandomCut` and never
/// by the others.
///
/// # Cost
/// With `Stop::Tolerance(e)` and r = length / 2e: `Bisection` and `Jittered` make n = ceil(log2 r) tests,
/// `RandomSeed` and `Dithered` at most n + 1, `RandomCut` about 1 + 2 ln r; the means are
/// [`average_tests`](crate::average_tests).
pub fn bisect<V, R>(method: Method, oracle: &mut V, bracket: Bracket, stop: Stop, rng: &mut R) -> Found
where
    V: Visibility + ?Sized,
    R: Rng + ?Sized,
{
    match method {
        Method::Bisection => pure_bisection(oracle, bracket, stop),
        Method::Jittered => jittered_bisection(oracle, bracket, stop, rng),
        Method::RandomCut => random_cut(oracle, bracket, stop, rng),
        Method::RandomSeed => random_seed_bisection(oracle, bracket, stop, rng),
        Method::Dithered => dithered_bisection(oracle, bracket, stop, uniform(rng)),
        Method::DitheredAt(shift) => dithered_bisection(oracle, bracket, stop, shift),
    }
}
