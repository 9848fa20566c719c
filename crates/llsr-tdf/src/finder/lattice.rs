//! The shifted lattice of tests.

use crate::voronoi::supported_nu;

/// Halvings from an ordinary cell to the finest.
const LEVELS: u32 = 4;
/// Ordinary cells are not narrower than 2 to the minus this.
const MAX_HALVINGS: u32 = 43;

/// Points at (`shift` + i) `spacing` for whole i from 0 to `end` - 1, all in [0, 1).
///
/// The coarser lattices are nested in it: that of step s, a power of two up to `coarse`, has the points whose
/// index leaves the same rest as `phase` when divided by s. If the shift of the coarsest is uniform, so is
/// that of every other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    spacing: f64,
    shift: f64,
    phase: i64,
    /// Step of the ordinary lattice, the one with cells of at most twice the tolerance.
    pub(super) coarse: i64,
    /// Number of points; `end` - `shift` is the place of t = 1 in steps.
    pub(super) end: i64,
    /// The widest stretch allowed without a test, in steps.
    pub(super) gap: f64,
}

impl Lattice {
    pub(super) fn new(epsilon: f64, nu: f64, shift: f64) -> Self {
        // Wider than the light is wide enough.
        let nu = supported_nu(nu).min(2.0);
        let (mut halvings, mut cell) = (0, 1.0);
        // Negated, so that a tolerance that is no number asks for the finest.
        let fits = |cell: f64| 0.5 * cell <= epsilon && cell <= nu;
        while halvings < MAX_HALVINGS && !fits(cell) {
            halvings += 1;
            cell *= 0.5;
        }
        let coarse = 1i64 << LEVELS;
        let end = 1i64 << (halvings + LEVELS);
        let steps = fraction(shift) * coarse as f64;
        Self {
            spacing: cell / coarse as f64,
            shift: steps - (steps as i64) as f64,
            phase: steps as i64,
            coarse,
            end,
            gap: nu * end as f64,
        }
    }

    /// The light parameter of a lattice point. Outside [0, 1] for indices below 0 and from `end` on.
    pub(super) fn place(&self, index: i64) -> f64 {
        (self.shift + index as f64) * self.spacing
    }

    /// The width of so many steps, in light parameters.
    pub(super) fn width(&self, steps: i64) -> f64 {
        steps as f64 * self.spacing
    }

    /// The place of `t` in steps: lattice points are whole numbers.
    pub(super) fn steps(&self, t: f64) -> f64 {
        t * self.end as f64 - self.shift
    }

    /// The last point of the lattice of `step`, a power of two, at or below `index`.
    pub(super) fn at_or_below(&self, index: i64, step: i64) -> i64 {
        index - ((index - self.phase) & (step - 1))
    }

    /// The first point of the lattice of `step`, a power of two, at or above `index`.
    pub(super) fn at_or_above(&self, index: i64, step: i64) -> i64 {
        index + ((self.phase - index) & (step - 1))
    }

    /// The step fit for a change between runs of the given widths (light parameters): the largest power of
    /// two of at most half the narrower run.
    pub(super) fn step_for(&self, narrower: f64) -> i64 {
        let room = 0.5 * narrower * self.end as f64;
        let mut step = self.coarse;
        while step > 1 && step as f64 > room {
            step /= 2;
        }
        step
    }
}

/// `x` modulo 1, in [0, 1); 1/2 for what is not finite.
pub(super) fn fraction(x: f64) -> f64 {
    if (0.0..1.0).contains(&x) {
        return x;
    }
    let fraction = if x.is_finite() { x.rem_euclid(1.0) } else { 0.5 };
    if fraction < 1.0 { fraction } else { 0.0 }
}
