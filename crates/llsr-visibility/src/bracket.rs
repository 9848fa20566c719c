//! An interval that encloses a change of visibility.

/// An interval of light parameters whose two ends answer differently, so that it encloses a change.
///
/// Brackets of a search on [0, 1] lie inside it, except those of dithered bisection, whose outermost cells
/// stick out by design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracket {
    /// Lower end, a light parameter.
    pub lo: f64,
    /// Upper end, a light parameter, not below `lo`.
    pub hi: f64,
    /// Whether the light is visible at the lower end; at the upper end it is the opposite.
    pub visible_at_lo: bool,
}

impl Bracket {
    /// A bracket from `lo` to `hi`.
    ///
    /// # Panics
    /// In debug builds, if `lo > hi` or an end is NaN.
    pub fn new(lo: f64, hi: f64, visible_at_lo: bool) -> Self {
        debug_assert!(lo <= hi, "bracket ends are out of order: {lo} > {hi}");
        Self {
            lo,
            hi,
            visible_at_lo,
        }
    }

    /// Width in light parameters.
    pub fn len(&self) -> f64 {
        self.hi - self.lo
    }

    /// True if the two ends coincide.
    pub fn is_empty(&self) -> bool {
        self.hi <= self.lo
    }

    /// The parameter half way between the ends.
    pub fn midpoint(&self) -> f64 {
        0.5 * (self.lo + self.hi)
    }

    /// True if `t` lies between the ends, ends included.
    pub fn contains(&self, t: f64) -> bool {
        self.lo <= t && t <= self.hi
    }

    /// The half of the bracket that still encloses a change, given the answer at `t` inside it.
    pub fn narrowed(self, t: f64, visible: bool) -> Self {
        if visible == self.visible_at_lo {
            Self { lo: t, ..self }
        } else {
            Self { hi: t, ..self }
        }
    }
}
