//! Bisection over a randomly shifted lattice.

use llsr_visibility::{Bracket, Visibility};

use crate::{Found, Stop};

/// Lattices are not finer than 2^-48 of the bracket: index plus shift stay well inside an f64.
const MAX_TESTS: u32 = 48;

/// Dithered bisection: finds the cell of a shifted lattice that holds the change, and returns its midpoint.
///
/// The lattice has its points at `bracket.lo + (shift + j) h` for whole `j`; `stop` sets the spacing h. Its
/// outermost cells stick out of the bracket and are kept whole. If `shift` is uniform on [0, 1), estimate
/// minus change is uniform on [-h/2, h/2], wherever the change lies (subtractive dither; see
/// `docs/papers/of99.md`): no bias, and a mean square error of h²/12. Clamping the estimate to the bracket
/// brings back a bias of at most h/8 within half a cell of its ends.
///
/// `shift` may come from a stream or from a blue-noise mask over the pixels. It counts modulo 1; a shift that
/// is not finite counts as 1/2.
///
/// # Cost
/// With `Stop::Tests(n)` and `Stop::Tolerance` (where n is the least number of halvings that reaches it)
/// h = length / 2<sup>n</sup>: n tests, and one more if the change lies in one of the two outermost cells on
/// the side where less of the lattice sticks in, 1.25 x 2<sup>-n</sup> of all searches. With
/// `Stop::Budget(n)` h = length / (2<sup>n</sup> - 1): at most n tests. The lattice is never finer than
/// 2<sup>-48</sup> of the bracket or eight units in the last place of its larger end.
pub fn dithered_bisection<V: Visibility + ?Sized>(
    oracle: &mut V,
    bracket: Bracket,
    stop: Stop,
    shift: f64,
) -> Found {
    let shift = fraction(shift);
    let Some(spacing) = spacing(&bracket, stop) else {
        return Found::at_midpoint(bracket, 0);
    };
    let point = |j: i64| bracket.lo + (shift + j as f64) * spacing;

    // Points number 0..=last lie inside the bracket; those at below and above are known without a test.
    let (mut below, mut above) = (-1, (bracket.len() / spacing - shift).ceil() as i64);
    while above > 0 && point(above - 1) >= bracket.hi {
        above -= 1;
    }
    while below + 1 < above && point(below + 1) <= bracket.lo {
        below += 1;
    }
    let extra_below = shift < 0.5;
    let mut tests = 0;
    while above - below > 1 {
        let cells = above - below;
        // An odd number of cells holds an end that sticks out. Its deeper side is the one where the change
        // is less likely to be: that of the end cell of which less lies inside.
        let middle = below + if extra_below { (cells + 1) / 2 } else { cells / 2 };
        let t = point(middle);
        if oracle.visible(t) == bracket.visible_at_lo {
            below = middle;
        } else {
            above = middle;
        }
        tests += 1;
    }
    let cell = Bracket::new(point(below), point(below + 1), bracket.visible_at_lo);
    Found::at_midpoint(cell, tests)
}

/// The distance of lattice points, or nothing if `stop` is reached at once or the bracket is too short for
/// a lattice of distinct numbers.
fn spacing(bracket: &Bracket, stop: Stop) -> Option<f64> {
    let length = bracket.len();
    let cells = match stop {
        Stop::Tests(0) | Stop::Budget(0) => return None,
        Stop::Tests(n) => 2f64.powi(n.min(MAX_TESTS) as i32),
        Stop::Budget(n) => 2f64.powi(n.min(MAX_TESTS) as i32) - 1.0,
        Stop::Tolerance(_) if stop.reached(bracket, 0) => return None,
        Stop::Tolerance(tolerance) => {
            let tolerance = tolerance.max(0.0);
            let mut cells = 2.0;
            while cells < 2f64.powi(MAX_TESTS as i32) && 0.5 * length / cells > tolerance {
                cells *= 2.0;
            }
            cells
        }
    };
    // Neighbouring points must be distinct numbers, with room for the rounding of each.
    let largest = bracket.lo.abs().max(bracket.hi.abs()).max(f64::MIN_POSITIVE);
    let resolution = 8.0 * f64::EPSILON * largest;
    let spacing = (length / cells).max(resolution);
    (length > spacing || (cells == 1.0 && length > resolution)).then_some(spacing)
}

/// `x` modulo 1, in [0, 1); 1/2 for what is not finite.
fn fraction(x: f64) -> f64 {
    if (0.0..1.0).contains(&x) {
        return x;
    }
    let fraction = if x.is_finite() { x.rem_euclid(1.0) } else { 0.5 };
    // A number just below zero rounds up to a whole cell.
    if fraction < 1.0 { fraction } else { 0.0 }
}
