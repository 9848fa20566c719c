//! Exact dyadic numbers and the containment trials of interval arithmetic.
//!
//! The trials follow pbrt-v4's habit (`math_test.cpp`): the trial's index is its seed, two thirds of the witnesses
//! sit on an end of their interval, widths range from nothing to many times the value. The witnesses' result is
//! computed exactly, so nothing is checked against a number that was itself rounded.

mod containment;
mod dyadic;

pub use containment::{Failure, OPERATIONS, Operation, containment, run_trial};
pub use dyadic::Dyadic;
