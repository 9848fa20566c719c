//! Closed intervals: construction, sets and comparison.

use crate::Real;

/// A closed interval of real numbers: every number from `lo` to `hi`, or nothing.
///
/// Ends may be infinite; the interval holds real numbers only, so `[1, inf]` means all numbers from 1 up.
/// There is no order: comparison goes through [`certainly_lt`](Self::certainly_lt) and its kin, which say whether
/// they speak of all numbers of the intervals or of some.
///
/// ```
/// use llsr_intervals::Interval;
///
/// let third = Interval::point(1.0) / Interval::point(3.0);
/// assert!(third.lo() < third.hi(), "1/3 is not a binary fraction");
/// assert!((third * Interval::point(3.0)).contains(1.0));
/// ```
#[derive(Clone, Copy, PartialEq)]
pub struct Interval<F> {
    // The empty interval is [+inf, -inf], so that hull and intersection need no special case.
    pub(crate) lo: F,
    pub(crate) hi: F,
}

impl<F: Real> std::fmt::Debug for Interval<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.is_empty() {
            f.write_str("[empty]")
        } else {
            write!(f, "[{:?}, {:?}]", self.lo, self.hi)
        }
    }
}

impl<F: Real> Default for Interval<F> {
    /// Nothing.
    fn default() -> Self {
        Self::EMPTY
    }
}

impl<F: Real> Interval<F> {
    /// The interval that holds nothing.
    pub const EMPTY: Self = Self {
        lo: F::INFINITY,
        hi: F::NEG_INFINITY,
    };
    /// All real numbers.
    pub const ENTIRE: Self = Self {
        lo: F::NEG_INFINITY,
        hi: F::INFINITY,
    };
    /// Only 0.
    pub const ZERO: Self = Self {
        lo: F::ZERO,
        hi: F::ZERO,
    };

    /// All numbers from `lo` to `hi`; `None` if an end is NaN, the ends are out of order, or no real number lies
    /// between them (`lo` = +inf or `hi` = -inf).
    pub fn new(lo: F, hi: F) -> Option<Self> {
        (lo <= hi && lo < F::INFINITY && hi > F::NEG_INFINITY).then_some(Self { lo, hi })
    }

    /// Only `x`; empty if `x` is infinite or NaN, as no real number is.
    pub fn point(x: F) -> Self {
        if x.is_finite() {
            Self { lo: x, hi: x }
        } else {
            Self::EMPTY
        }
    }

    /// The smallest interval that holds all of `points`; infinite and NaN ones are left out.
    pub fn of(points: impl IntoIterator<Item = F>) -> Self {
        points
            .into_iter()
            .fold(Self::EMPTY, |hull, x| hull.hull(Self::point(x)))
    }

    /// Lower end; +inf if empty.
    pub fn lo(self) -> F {
        self.lo
    }

    /// Upper end; -inf if empty.
    pub fn hi(self) -> F {
        self.hi
    }

    /// Holds nothing.
    #[inline]
    pub fn is_empty(self) -> bool {
        self.lo > self.hi
    }

    /// Holds every real number.
    pub fn is_entire(self) -> bool {
        self.lo == F::NEG_INFINITY && self.hi == F::INFINITY
    }

    /// Is not empty and has two finite ends.
    #[inline]
    pub fn is_bounded(self) -> bool {
        self.lo.is_finite() && self.hi.is_finite()
    }

    /// Holds exactly one number.
    pub fn is_point(self) -> bool {
        self.lo == self.hi
    }

    /// Holds `x`.
    #[inline]
    pub fn contains(self, x: F) -> bool {
        self.lo <= x && x <= self.hi && x.is_finite()
    }

    /// Holds 0.
    #[inline]
    pub fn contains_zero(self) -> bool {
        self.lo <= F::ZERO && self.hi >= F::ZERO
    }

    /// Every number of `self` is in `other`; true if `self` is empty.
    pub fn is_subset(self, other: Self) -> bool {
        self.is_empty() || (other.lo <= self.lo && self.hi <= other.hi)
    }

    /// A finite number inside, half way between the ends up to rounding; of an unbounded interval 0 if it holds
    /// that, else the finite end. `None` if empty.
    pub fn midpoint(self) -> Option<F> {
        if self.is_empty() {
            return None;
        }
        if self.is_bounded() {
            return Some(self.lo * F::HALF + self.hi * F::HALF).map(|m| m.larger(self.lo).smaller(self.hi));
        }
        Some(if self.contains_zero() {
            F::ZERO
        } else if self.lo.is_finite() {
            self.lo
        } else {
            self.hi
        })
    }

    /// `hi - lo`, rounded up; infinite if unbounded, 0 if empty.
    pub fn width(self) -> F {
        if self.is_empty() {
            F::ZERO
        } else {
            crate::arithmetic::sub_up(self.hi, self.lo)
        }
    }

    /// The largest absolute value; 0 if empty.
    #[inline]
    pub fn magnitude(self) -> F {
        if self.is_empty() {
            F::ZERO
        } else {
            self.lo.abs().larger(self.hi.abs())
        }
    }

    /// The smallest absolute value; +inf if empty.
    pub fn mignitude(self) -> F {
        if self.is_empty() {
            F::INFINITY
        } else if self.contains_zero() {
            F::ZERO
        } else {
            self.lo.abs().smaller(self.hi.abs())
        }
    }

    /// The numbers in both.
    #[inline]
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        let both = Self {
            lo: self.lo.larger(other.lo),
            hi: self.hi.smaller(other.hi),
        };
        if both.is_empty() { Self::EMPTY } else { both }
    }

    /// The smallest interval that holds both.
    #[inline]
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self {
            lo: self.lo.smaller(other.lo),
            hi: self.hi.larger(other.hi),
        }
    }

    /// Every number of `self` is below every number of `other`. True, like all that is said of every number of
    /// nothing, if one is empty.
    pub fn certainly_lt(self, other: Self) -> bool {
        self.is_empty() || other.is_empty() || self.hi < other.lo
    }

    /// No number of `self` is above one of `other`; true if one is empty.
    pub fn certainly_le(self, other: Self) -> bool {
        self.is_empty() || other.is_empty() || self.hi <= other.lo
    }

    /// Some number of `self` is below some number of `other`; false if one is empty.
    pub fn possibly_lt(self, other: Self) -> bool {
        !self.is_empty() && !other.is_empty() && self.lo < other.hi
    }

    /// Some number of `self` is below some number of `other` or equal to it; false if one is empty.
    pub fn possibly_le(self, other: Self) -> bool {
        !self.is_empty() && !other.is_empty() && self.lo <= other.hi
    }

    /// Every number of `self` is above 0; true if empty.
    pub fn certainly_positive(self) -> bool {
        self.is_empty() || self.lo > F::ZERO
    }

    /// Every number of `self` is below 0; true if empty.
    pub fn certainly_negative(self) -> bool {
        self.is_empty() || self.hi < F::ZERO
    }

    /// Some number of `self` is above 0; false if empty.
    pub fn possibly_positive(self) -> bool {
        self.hi > F::ZERO
    }

    /// Some number of `self` is below 0; false if empty.
    pub fn possibly_negative(self) -> bool {
        self.lo < F::ZERO
    }
}

impl Interval<f32> {
    /// The same numbers with `f64` ends.
    pub fn widen(self) -> Interval<f64> {
        Interval {
            lo: f64::from(self.lo),
            hi: f64::from(self.hi),
        }
    }
}

impl Interval<f64> {
    /// The smallest interval with `f32` ends that holds all numbers of this one.
    pub fn narrow(self) -> Interval<f32> {
        if self.is_empty() {
            return Interval::EMPTY;
        }
        let (lo, hi) = (self.lo as f32, self.hi as f32);
        Interval {
            lo: if f64::from(lo) > self.lo {
                lo.next_down()
            } else {
                lo
            },
            hi: if f64::from(hi) < self.hi { hi.next_up() } else { hi },
        }
    }
}
