//! Exact sums and products of doubles.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

use glam::DVec3;

/// A number held as an unevaluated sum of doubles that do not overlap, smallest first.
///
/// Sums, differences and products are exact, unless they leave the range of a double (about 1e-300 to 1e300).
#[derive(Clone, Debug, Default)]
pub struct Exact(Vec<f64>);

fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let virtual_b = sum - a;
    let error = (a - (sum - virtual_b)) + (b - virtual_b);
    (sum, error)
}

impl Exact {
    /// Zero.
    pub fn zero() -> Self {
        Self::default()
    }

    /// The sign against zero.
    pub fn sign(&self) -> Ordering {
        // Parts do not overlap, so the largest decides.
        self.0.last().map_or(Ordering::Equal, |x| {
            x.partial_cmp(&0.0).unwrap_or(Ordering::Equal)
        })
    }

    /// The nearest double, up to a few units in the last place.
    pub fn approximate(&self) -> f64 {
        self.0.iter().sum()
    }

    fn add_double(mut self, x: f64) -> Self {
        let mut carry = x;
        let mut parts = Vec::with_capacity(self.0.len() + 1);
        for part in self.0.drain(..) {
            let (sum, error) = two_sum(carry, part);
            carry = sum;
            if error != 0.0 {
                parts.push(error);
            }
        }
        if carry != 0.0 {
            parts.push(carry);
        }
        Self(parts)
    }

    /// The exact determinant of three vectors.
    pub fn determinant(a: &[Self; 3], b: &[Self; 3], c: &[Self; 3]) -> Self {
        let minor = |i: usize, j: usize| &b[i] * &c[j] - &b[j] * &c[i];
        &a[0] * &minor(1, 2) + &a[1] * &minor(2, 0) + &a[2] * &minor(0, 1)
    }

    /// The exact difference of two points.
    pub fn difference(a: DVec3, b: DVec3) -> [Self; 3] {
        [0, 1, 2].map(|i| Self::from(a[i]) - Self::from(b[i]))
    }

    /// Positive if `d` is on the side of the plane `a`, `b`, `c` from which they run clockwise.
    pub fn orientation(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Self {
        Self::determinant(
            &Self::difference(a, d),
            &Self::difference(b, d),
            &Self::difference(c, d),
        )
    }
}

impl From<f64> for Exact {
    fn from(x: f64) -> Self {
        if x == 0.0 { Self(Vec::new()) } else { Self(vec![x]) }
    }
}

impl Add for Exact {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        other.0.iter().fold(self, |sum, &x| sum.add_double(x))
    }
}

impl Neg for Exact {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.iter().map(|x| -x).collect())
    }
}

impl Sub for Exact {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for &Exact {
    type Output = Exact;
    fn mul(self, other: Self) -> Exact {
        let mut product = Exact::zero();
        for &x in &self.0 {
            for &y in &other.0 {
                let high = x * y;
                let low = x.mul_add(y, -high);
                product = product.add_double(low).add_double(high);
            }
        }
        product
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cancellation_is_exact() {
        let tiny = 2f64.powi(-80);
        let sum = Exact::from(1.0) + Exact::from(tiny) - Exact::from(1.0);
        assert_eq!(sum.approximate(), tiny, "what is left of 1 + tiny - 1");
        let product = &Exact::from(1.0 + 2f64.powi(-52)) * &Exact::from(1.0 - 2f64.powi(-52));
        let rest = product - Exact::from(1.0);
        assert_eq!(rest.approximate(), -(2f64.powi(-104)), "(1 + e)(1 - e) - 1");
        assert_eq!(rest.sign(), Ordering::Less, "its sign");
    }
}
