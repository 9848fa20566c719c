//! Numbers of 106 bits as unevaluated sums of two doubles: enough that an oracle has no conditioning to excuse.

use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::DVec3;

/// The unevaluated sum `hi + lo` with `|lo|` at most half an ulp of `hi`; about 31 digits.
///
/// Relative error of each operation below 1e-31, for magnitudes between 1e-140 and 1e140.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleDouble {
    /// The value rounded to a double.
    pub hi: f64,
    /// What the rounding left.
    pub lo: f64,
}

/// Knuth's error-free sum.
fn two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    let of_b = hi - a;
    DoubleDouble {
        hi,
        lo: (a - (hi - of_b)) + (b - of_b),
    }
}

/// Error-free sum for `|a| >= |b|`.
fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let hi = a + b;
    DoubleDouble { hi, lo: b - (hi - a) }
}

/// Error-free product.
fn two_product(a: f64, b: f64) -> DoubleDouble {
    let hi = a * b;
    DoubleDouble {
        hi,
        lo: a.mul_add(b, -hi),
    }
}

impl DoubleDouble {
    /// Zero.
    pub const ZERO: Self = Self { hi: 0.0, lo: 0.0 };

    /// The exact difference of two doubles.
    pub fn difference(a: f64, b: f64) -> Self {
        two_sum(a, -b)
    }

    /// The square root; zero for anything not positive.
    pub fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::ZERO;
        }
        // One Newton step doubles the 53 bits of the hardware root.
        let root = self.hi.sqrt();
        let rest = self - two_product(root, root);
        quick_two_sum(root, rest.hi / (2.0 * root))
    }

    /// The value rounded to a double.
    pub fn to_f64(self) -> f64 {
        self.hi + self.lo
    }
}

impl From<f64> for DoubleDouble {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let high = two_sum(self.hi, other.hi);
        let low = two_sum(self.lo, other.lo);
        let sum = quick_two_sum(high.hi, high.lo + low.hi);
        quick_two_sum(sum.hi, sum.lo + low.lo)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = two_product(self.hi, other.hi);
        quick_two_sum(product.hi, product.lo + (self.hi * other.lo + self.lo * other.hi))
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.hi / other.hi;
        let rest = self - other * first.into();
        let second = rest.hi / other.hi;
        let rest = rest - other * second.into();
        quick_two_sum(first, second) + (rest.hi / other.hi).into()
    }
}

/// A vector of three such numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WideVec3(pub [DoubleDouble; 3]);

impl WideVec3 {
    /// The exact difference of two points.
    pub fn difference(a: DVec3, b: DVec3) -> Self {
        let (a, b) = (a.to_array(), b.to_array());
        Self(std::array::from_fn(|i| DoubleDouble::difference(a[i], b[i])))
    }

    /// Dot product.
    pub fn dot(self, other: Self) -> DoubleDouble {
        let [x, y, z] = std::array::from_fn(|i| self.0[i] * other.0[i]);
        x + y + z
    }

    /// Cross product.
    pub fn cross(self, other: Self) -> Self {
        let part = |i: usize, j: usize| self.0[i] * other.0[j] - self.0[j] * other.0[i];
        Self([part(1, 2), part(2, 0), part(0, 1)])
    }

    /// `self + k * other`.
    pub fn plus(self, k: DoubleDouble, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + k * other.0[i]))
    }

    /// Length.
    pub fn length(self) -> DoubleDouble {
        self.dot(self).sqrt()
    }
}

impl From<DVec3> for WideVec3 {
    fn from(v: DVec3) -> Self {
        Self(v.to_array().map(Into::into))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirds_and_roots_have_thirty_digits() {
        let third = DoubleDouble::from(1.0) / 3.0.into();
        let sum = third + third + third;
        assert!(
            (sum - 1.0.into()).hi.abs() < 1e-31,
            "three thirds are one: {sum:?}"
        );
        let root = DoubleDouble::from(2.0).sqrt();
        assert!(
            (root * root - 2.0.into()).hi.abs() < 1e-30,
            "the root of two squared: {root:?}"
        );
    }

    #[test]
    fn cancellation_is_exact() {
        let difference = DoubleDouble::from(1e16) + 1.0.into() - 1e16.into();
        assert_eq!(difference.to_f64(), 1.0, "doubles alone would lose the one");
    }
}
