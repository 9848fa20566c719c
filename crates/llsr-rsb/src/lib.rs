//! Random seed bisection and its relatives: bracket a visibility change with few tests.
//!
//! Given a [`Bracket`](llsr_visibility::Bracket) whose two ends answer differently, every method here narrows it around a change of
//! visibility and returns the last bracket, an estimate of the change and the number of tests it made:
//! [`Found`]. They differ in where they test, and so in how the *expected* estimate depends on the true place
//! of the change, which is what an eye sees in a penumbra:
//!
//! | [`Method`] | tests | expected estimate |
//! |---|---|---|
//! | `Bisection` | midpoints | a staircase: penumbrae show bands |
//! | `Jittered` | midpoints, estimate drawn from the last bracket | the same staircase, with noise |
//! | `RandomCut` | uniform cuts | a straight line of slope 1 - 2<sup>-n</sup>; converges slowly |
//! | `RandomSeed` | one uniform seed, then midpoints | continuous, piecewise quadratic |
//! | `Dithered` | a randomly shifted lattice | the change itself: no bias at all |
//!
//! All but the last are those of Ouellette & Fiume, "Approximating the Location of Integrand Discontinuities
//! for Penumbra Illumination with Linear Light Sources", Graphics Interface 1999 (section 3). Dithered
//! bisection applies subtractive dither to their problem. [`expected_estimate`] and its neighbours give the
//! curves in closed form.
//!
//! ```
//! use llsr_rsb::{Method, Stop, bisect};
//! use llsr_visibility::Bracket;
//! use rand_core::SeedableRng;
//! use rand_pcg::Pcg64Mcg;
//!
//! let mut rng = Pcg64Mcg::seed_from_u64(1);
//! let mut visible = |t: f64| t <= 0.3;
//! let unit = Bracket::new(0.0, 1.0, true);
//! let found = bisect(Method::RandomSeed, &mut visible, unit, Stop::Tolerance(0.01), &mut rng);
//! assert!(found.bracket.contains(0.3));
//! assert!((found.estimate - 0.3).abs() <= 0.01);
//! ```

mod dithered;
mod expectation;
mod halving;
mod method;
mod staircase;
mod uniform;

pub use dithered::dithered_bisection;
pub use expectation::{
    average_bracket_length, average_mean_square_error, average_tests, expected_bracket_length,
    expected_estimate, mean_square_error,
};
pub use halving::{jittered_bisection, pure_bisection, random_cut, random_seed_bisection};
pub use method::{Found, Method, Stop, bisect};
pub use staircase::{Jump, jumps};
pub use uniform::uniform;
