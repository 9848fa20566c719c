//! Visibility along a light with known answers: step functions, a corpus, rows of pixels, strategies, brute force.
//!
//! Nothing here uses the searches it is meant to check.

mod brute;
mod corpus;
mod rows;
mod steps;
mod strategies;

pub use brute::brute_force;
pub use corpus::{Case, corpus};
pub use rows::{Row, rows};
pub use steps::Steps;
pub use strategies::{any_steps, steps_with};
