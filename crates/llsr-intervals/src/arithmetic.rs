//! Interval arithmetic with outward rounding.
//!
//! Every operation returns the set-based enclosure of IEEE 1788-2015 (section 10.5 and table 9.1: division by an
//! interval around 0 gives all numbers, the square root of a negative interval nothing), at most one unit in the
//! last place wider at each end than the tightest. The processor's rounding mode is never touched: a result is
//! rounded to nearest and then moved to the next number outwards, unless it is known to be exact.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::{Interval, Real};

/// The rounding error of `sum = a + b` (Knuth's two-sum), or NaN near overflow.
#[inline(always)]
fn sum_error<F: Real>(a: F, b: F, sum: F) -> F {
    let b_part = sum - a;
    let a_part = sum - b_part;
    (a - a_part) + (b - b_part)
}

/// A lower bound of `a + b`: exact sums stay, others move down if they were rounded up.
#[inline]
pub(crate) fn add_down<F: Real>(a: F, b: F) -> F {
    let sum = a + b;
    // Near overflow the parts of two-sum may overflow although the sum does not.
    if sum_error(a, b, sum) >= F::ZERO && sum.abs() < F::MAX * F::HALF {
        sum
    } else {
        sum.next_down()
    }
}

/// An upper bound of `a + b`.
#[inline]
pub(crate) fn add_up<F: Real>(a: F, b: F) -> F {
    -add_down(-a, -b)
}

/// An upper bound of `a - b`.
#[inline]
pub(crate) fn sub_up<F: Real>(a: F, b: F) -> F {
    -add_down(-a, b)
}

/// A lower bound of `a * b`, where an end 0 times an infinite end is 0: the infinite end is no number itself.
#[inline]
fn mul_down<F: Real>(a: F, b: F) -> F {
    let product = a * b;
    if a == F::ZERO || b == F::ZERO || (product == F::ZERO && (a > F::ZERO) == (b > F::ZERO)) {
        F::ZERO
    } else {
        product.next_down()
    }
}

#[inline]
fn mul_up<F: Real>(a: F, b: F) -> F {
    -mul_down(-a, b)
}

/// A lower bound of `a / b` for `b != 0`; a finite end over an infinite one tends to 0.
#[inline]
fn div_down<F: Real>(a: F, b: F) -> F {
    let quotient = a / b;
    if a == F::ZERO
        || (a.is_finite() && !b.is_finite())
        || (quotient == F::ZERO && (a > F::ZERO) == (b > F::ZERO))
    {
        F::ZERO
    } else {
        quotient.next_down()
    }
}

#[inline]
fn div_up<F: Real>(a: F, b: F) -> F {
    -div_down(-a, b)
}

impl<F: Real> Neg for Interval<F> {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self {
            lo: -self.hi,
            hi: -self.lo,
        }
    }
}

impl<F: Real> Add for Interval<F> {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        if self.is_empty() || other.is_empty() {
            return Self::EMPTY;
        }
        Self {
            lo: add_down(self.lo, other.lo),
            hi: add_up(self.hi, other.hi),
        }
    }
}

impl<F: Real> Sub for Interval<F> {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<F: Real> Mul for Interval<F> {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        if self.is_empty() || other.is_empty() {
            return Self::EMPTY;
        }
        let (a, b, c, d) = (self.lo, self.hi, other.lo, other.hi);
        // Each product is rounded by itself: one that underflows to 0 must not hide behind one that is 0.
        let lo = mul_down(a, c)
            .smaller(mul_down(a, d))
            .smaller(mul_down(b, c).smaller(mul_down(b, d)));
        let hi = mul_up(a, c)
            .larger(mul_up(a, d))
            .larger(mul_up(b, c).larger(mul_up(b, d)));
        Self { lo, hi }
    }
}

impl<F: Real> Div for Interval<F> {
    type Output = Self;

    /// All quotients with a divisor other than 0; nothing if there is none.
    fn div(self, other: Self) -> Self {
        if self.is_empty() || other.is_empty() || other == Self::ZERO {
            return Self::EMPTY;
        }
        if self == Self::ZERO {
            return Self::ZERO;
        }
        if other.lo < F::ZERO && other.hi > F::ZERO {
            return Self::ENTIRE;
        }
        if other.hi <= F::ZERO {
            return -(self / -other);
        }
        // From here 0 <= other.lo < other.hi or 0 < other.lo = other.hi.
        let (c, d) = (other.lo, other.hi);
        let lo = if self.lo >= F::ZERO {
            div_down(self.lo, d)
        } else if c == F::ZERO {
            F::NEG_INFINITY
        } else {
            div_down(self.lo, c)
        };
        let hi = if self.hi <= F::ZERO {
            div_up(self.hi, d)
        } else if c == F::ZERO {
            F::INFINITY
        } else {
            div_up(self.hi, c)
        };
        Self { lo, hi }
    }
}

impl<F: Real> Interval<F> {
    /// `1 / x` for every `x` other than 0; nothing if there is none.
    #[must_use]
    pub fn recip(self) -> Self {
        Self {
            lo: F::ONE,
            hi: F::ONE,
        } / self
    }

    /// `x * x` for every `x`, never negative.
    #[must_use]
    pub fn sqr(self) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        let (near, far) = (self.mignitude(), self.magnitude());
        Self {
            lo: mul_down(near, near),
            hi: mul_up(far, far),
        }
    }

    /// Square roots of the numbers that are not negative; nothing if there are none.
    #[must_use]
    pub fn sqrt(self) -> Self {
        if self.is_empty() || self.hi < F::ZERO {
            return Self::EMPTY;
        }
        let down = |x: F| {
            if x <= F::ZERO {
                F::ZERO
            } else {
                x.sqrt().next_down()
            }
        };
        let up = |x: F| {
            if x == F::ZERO { F::ZERO } else { x.sqrt().next_up() }
        };
        Self {
            lo: down(self.lo),
            hi: up(self.hi),
        }
    }

    /// Absolute values.
    #[inline]
    #[must_use]
    pub fn abs(self) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        Self {
            lo: self.mignitude(),
            hi: self.magnitude(),
        }
    }

    /// The smaller of `x` and `y`, for every `x` in `self` and `y` in `other`.
    #[inline]
    #[must_use]
    pub fn min(self, other: Self) -> Self {
        if self.is_empty() || other.is_empty() {
            return Self::EMPTY;
        }
        Self {
            lo: self.lo.smaller(other.lo),
            hi: self.hi.smaller(other.hi),
        }
    }

    /// The larger of `x` and `y`, for every `x` in `self` and `y` in `other`.
    #[inline]
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        if self.is_empty() || other.is_empty() {
            return Self::EMPTY;
        }
        Self {
            lo: self.lo.larger(other.lo),
            hi: self.hi.larger(other.hi),
        }
    }

    /// `x * y + z` with one rounding.
    ///
    /// Cost: eight fused operations, which are slow library calls where the processor has none.
    #[must_use]
    pub fn mul_add(self, y: Self, z: Self) -> Self {
        if self.is_empty() || y.is_empty() || z.is_empty() {
            return Self::EMPTY;
        }
        // A product that is 0 because one factor is leaves z exactly as it is.
        let fused = |a: F, b: F, c: F| {
            if a == F::ZERO || b == F::ZERO {
                (c, true)
            } else {
                (a.mul_add(b, c), false)
            }
        };
        let down = |a: F, b: F| match fused(a, b, z.lo) {
            (value, true) => value,
            // The product is -inf or z is: adding an overflowing positive product must not give NaN.
            (value, false) if value.is_nan() => F::NEG_INFINITY,
            (value, false) => value.next_down(),
        };
        let up = |a: F, b: F| match fused(a, b, z.hi) {
            (value, true) => value,
            (value, false) if value.is_nan() => F::INFINITY,
            (value, false) => value.next_up(),
        };
        let (a, b, c, d) = (self.lo, self.hi, y.lo, y.hi);
        Self {
            lo: down(a, c)
                .smaller(down(a, d))
                .smaller(down(b, c).smaller(down(b, d))),
            hi: up(a, c).larger(up(a, d)).larger(up(b, c).larger(up(b, d))),
        }
    }
}
