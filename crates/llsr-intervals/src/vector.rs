//! Vectors of three intervals; dot and cross products with one error bound at the end.

use std::ops::{Add, Neg, Sub};

use crate::{Interval, Real};

/// A box of vectors: one interval for each axis (Bala et al. 2003, section 6.4, footnote 1).
#[derive(Clone, Copy, PartialEq)]
pub struct IntervalVec3<F> {
    /// Range of the first coordinate.
    pub x: Interval<F>,
    /// Range of the second coordinate.
    pub y: Interval<F>,
    /// Range of the third coordinate.
    pub z: Interval<F>,
}

impl<F: Real> std::fmt::Debug for IntervalVec3<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries([self.x, self.y, self.z]).finish()
    }
}

impl<F: Real> Default for IntervalVec3<F> {
    /// No vector.
    fn default() -> Self {
        Self::EMPTY
    }
}

/// A sum of products of interval ends in round-to-nearest, and the sum of the products' largest magnitudes.
#[derive(Clone, Copy)]
struct Sum<F> {
    lo: F,
    hi: F,
    magnitude: F,
}

/// Smallest and largest product of two bounded intervals, rounded to nearest.
#[inline(always)]
fn product<F: Real>(a_lo: F, a_hi: F, b_lo: F, b_hi: F) -> Sum<F> {
    let (p, q, r, s) = (a_lo * b_lo, a_lo * b_hi, a_hi * b_lo, a_hi * b_hi);
    Sum {
        lo: p.smaller(q).smaller(r.smaller(s)),
        hi: p.larger(q).larger(r.larger(s)),
        magnitude: a_lo.abs().larger(a_hi.abs()) * b_lo.abs().larger(b_hi.abs()),
    }
}

impl<F: Real> Sum<F> {
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self {
            lo: self.lo + other.lo,
            hi: self.hi + other.hi,
            magnitude: self.magnitude + other.magnitude,
        }
    }

    /// Ends that enclose the exact sum of at most three products; everything if a number overflowed.
    ///
    /// With u the unit roundoff, η the smallest subnormal number and M the exact sum of magnitudes: each end is
    /// off by at most (3u + 3u² + u³) M from three roundings (one product, two sums) and 2η from underflowing
    /// products. The padded end is rounded once more, by at most u (1 + 10u) M + η. The computed magnitude is at
    /// least (1 - 3u) M - 2η. So 5u times the computed magnitude and a normal number cover
    /// (4u + 20u²) M + 4η with 0.9u M to spare.
    #[inline(always)]
    fn padded(self) -> (F, F) {
        let five = F::ONE + F::ONE + F::ONE + F::ONE + F::ONE;
        let pad = self.magnitude * (five * F::UNIT_ROUNDOFF) + F::MIN_POSITIVE;
        let (lo, hi) = (self.lo - pad, self.hi + pad);
        // Written so that NaN (infinity minus infinity, zero times infinity) gives everything too.
        if lo.abs() <= F::MAX && hi.abs() <= F::MAX {
            (lo, hi)
        } else {
            (F::NEG_INFINITY, F::INFINITY)
        }
    }
}

/// Ends of the dot product of two boxes, given as [x, y, z] lower and upper ends.
#[inline(always)]
pub(crate) fn dot_ends<F: Real>(a_lo: [F; 3], a_hi: [F; 3], b_lo: [F; 3], b_hi: [F; 3]) -> (F, F) {
    let term = |i: usize| product(a_lo[i], a_hi[i], b_lo[i], b_hi[i]);
    term(0).plus(term(1)).plus(term(2)).padded()
}

impl<F: Real> IntervalVec3<F> {
    /// No vector.
    pub const EMPTY: Self = Self {
        x: Interval::EMPTY,
        y: Interval::EMPTY,
        z: Interval::EMPTY,
    };

    /// A box from its ranges.
    pub fn new(x: Interval<F>, y: Interval<F>, z: Interval<F>) -> Self {
        Self { x, y, z }
    }

    /// Only the vector (`x`, `y`, `z`); empty if a coordinate is infinite or NaN.
    pub fn point(x: F, y: F, z: F) -> Self {
        Self::new(Interval::point(x), Interval::point(y), Interval::point(z))
    }

    /// The smallest box that holds all of `points`.
    pub fn of(points: impl IntoIterator<Item = [F; 3]>) -> Self {
        points
            .into_iter()
            .fold(Self::EMPTY, |hull, [x, y, z]| hull.hull(Self::point(x, y, z)))
    }

    /// Holds no vector: some range is empty.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty() || self.y.is_empty() || self.z.is_empty()
    }

    /// Holds the vector (`x`, `y`, `z`).
    pub fn contains(&self, x: F, y: F, z: F) -> bool {
        self.x.contains(x) && self.y.contains(y) && self.z.contains(z)
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self::new(self.x.hull(other.x), self.y.hull(other.y), self.z.hull(other.z))
    }

    /// The vectors in both.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self::new(
            self.x.intersection(other.x),
            self.y.intersection(other.y),
            self.z.intersection(other.z),
        )
    }

    #[inline]
    pub(crate) fn lo(&self) -> [F; 3] {
        [self.x.lo, self.y.lo, self.z.lo]
    }

    #[inline]
    pub(crate) fn hi(&self) -> [F; 3] {
        [self.x.hi, self.y.hi, self.z.hi]
    }

    /// An interval that holds `a · b` for all `a` in `self` and `b` in `other`.
    ///
    /// Computed in round-to-nearest with one proved error bound at the end, so wider than the tightest by at
    /// most 10 unit roundoffs of Σ max|aᵢ| max|bᵢ|, and many times faster than rounding outwards at each step.
    /// Where a range is unbounded or a product overflows the result is everything; where one is empty, nothing.
    #[inline]
    #[must_use]
    pub fn dot(&self, other: &Self) -> Interval<F> {
        if self.is_empty() || other.is_empty() {
            return Interval::EMPTY;
        }
        let (lo, hi) = dot_ends(self.lo(), self.hi(), other.lo(), other.hi());
        Interval { lo, hi }
    }

    /// A box that holds `a × b` for all `a` in `self` and `b` in `other`; the error bound is that of
    /// [`dot`](Self::dot), for each coordinate.
    #[must_use]
    pub fn cross(&self, other: &Self) -> Self {
        if self.is_empty() || other.is_empty() {
            return Self::EMPTY;
        }
        let coordinate = |a: Interval<F>, b: Interval<F>, c: Interval<F>, d: Interval<F>| {
            let subtracted = product(-c.hi, -c.lo, d.lo, d.hi);
            let (lo, hi) = product(a.lo, a.hi, b.lo, b.hi).plus(subtracted).padded();
            Interval { lo, hi }
        };
        Self::new(
            coordinate(self.y, other.z, self.z, other.y),
            coordinate(self.z, other.x, self.x, other.z),
            coordinate(self.x, other.y, self.y, other.x),
        )
    }
}

impl<F: Real> Neg for IntervalVec3<F> {
    type Output = Self;

    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<F: Real> Add for IntervalVec3<F> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<F: Real> Sub for IntervalVec3<F> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl From<glam::Vec3> for IntervalVec3<f32> {
    /// Only `v`.
    fn from(v: glam::Vec3) -> Self {
        Self::point(v.x, v.y, v.z)
    }
}

impl From<glam::DVec3> for IntervalVec3<f64> {
    /// Only `v`.
    fn from(v: glam::DVec3) -> Self {
        Self::point(v.x, v.y, v.z)
    }
}

impl IntervalVec3<f64> {
    /// The smallest box with `f32` ends that holds this one.
    pub fn narrow(self) -> IntervalVec3<f32> {
        IntervalVec3::new(self.x.narrow(), self.y.narrow(), self.z.narrow())
    }
}

impl IntervalVec3<f32> {
    /// The same box with `f64` ends.
    pub fn widen(self) -> IntervalVec3<f64> {
        IntervalVec3::new(self.x.widen(), self.y.widen(), self.z.widen())
    }
}
