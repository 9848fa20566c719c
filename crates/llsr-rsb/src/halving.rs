//! The searches that cut the bracket they have: pure, jittered and random seed bisection, random cut.

use llsr_visibility::{Bracket, Visibility};
use rand_core::Rng;

use crate::{Found, Stop, uniform};

/// Pure bisection (OF99 section 3.1): tests the midpoint of the bracket, again and again.
///
/// After `n` tests the bracket has 2<sup>-n</sup> of its length. Equation 2 of the paper counts one more: its
/// `n` is our `n + 1`.
pub fn pure_bisection<V: Visibility + ?Sized>(oracle: &mut V, bracket: Bracket, stop: Stop) -> Found {
    halve(oracle, bracket, stop, 0)
}

/// Jittered bisection (OF99 section 3.2): pure bisection whose estimate is uniform in the last bracket.
pub fn jittered_bisection<V, R>(oracle: &mut V, bracket: Bracket, stop: Stop, rng: &mut R) -> Found
where
    V: Visibility + ?Sized,
    R: Rng + ?Sized,
{
    let found = halve(oracle, bracket, stop, 0);
    let estimate = between(&found.bracket, uniform(rng));
    Found { estimate, ..found }
}

/// Random cut (OF99 section 3.3): tests a point uniform in the bracket, again and again.
pub fn random_cut<V, R>(oracle: &mut V, mut bracket: Bracket, stop: Stop, rng: &mut R) -> Found
where
    V: Visibility + ?Sized,
    R: Rng + ?Sized,
{
    let mut tests = 0;
    while !stop.reached(&bracket, tests) {
        let Some(t) = interior(&bracket, between(&bracket, uniform(rng))) else {
            break;
        };
        bracket = bracket.narrowed(t, oracle.visible(t));
        tests += 1;
    }
    Found::at_midpoint(bracket, tests)
}

/// Random seed bisection (OF99 section 3.4): tests one point uniform in the bracket, then midpoints.
pub fn random_seed_bisection<V, R>(oracle: &mut V, bracket: Bracket, stop: Stop, rng: &mut R) -> Found
where
    V: Visibility + ?Sized,
    R: Rng + ?Sized,
{
    if stop.reached(&bracket, 0) {
        return Found::at_midpoint(bracket, 0);
    }
    let Some(seed) = interior(&bracket, between(&bracket, uniform(rng))) else {
        return Found::at_midpoint(bracket, 0);
    };
    let narrowed = bracket.narrowed(seed, oracle.visible(seed));
    halve(oracle, narrowed, stop, 1)
}

/// Tests midpoints until `stop`, `tests` tests having been made.
fn halve<V: Visibility + ?Sized>(oracle: &mut V, mut bracket: Bracket, stop: Stop, mut tests: u32) -> Found {
    while !stop.reached(&bracket, tests) {
        let Some(t) = interior(&bracket, bracket.midpoint()) else {
            break;
        };
        bracket = bracket.narrowed(t, oracle.visible(t));
        tests += 1;
    }
    Found::at_midpoint(bracket, tests)
}

/// The point that divides the bracket in the ratio `u` : 1 - `u`.
fn between(bracket: &Bracket, u: f64) -> f64 {
    bracket.lo + u * bracket.len()
}

/// `t` if it lies strictly inside the bracket, else its midpoint, else (no number inside) nothing.
///
/// Rounding can put a point that divides a bracket of a few ulps onto one of its ends; testing there would
/// not narrow anything, and the search would not end.
fn interior(bracket: &Bracket, t: f64) -> Option<f64> {
    let inside = |t: f64| bracket.lo < t && t < bracket.hi;
    let t = if inside(t) { t } else { bracket.midpoint() };
    inside(t).then_some(t)
}
