//! Exact binary fractions of any size.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// The number ± magnitude × 2^exponent, exactly; slow and simple, for checking.
#[derive(Clone, Debug)]
pub struct Dyadic {
    negative: bool,
    /// Limbs of 32 bits, lowest first, without zeros at the top.
    magnitude: Vec<u32>,
    exponent: i32,
}

impl Dyadic {
    /// 0.
    pub fn zero() -> Self {
        Self {
            negative: false,
            magnitude: Vec::new(),
            exponent: 0,
        }
    }

    /// The exact value of a number; `None` if it is infinite or NaN.
    pub fn new(x: f64) -> Option<Self> {
        if !x.is_finite() {
            return None;
        }
        let bits = x.to_bits();
        let biased = (bits >> 52 & 0x7ff) as i32;
        let fraction = bits & ((1 << 52) - 1);
        let (mantissa, exponent) = if biased == 0 {
            (fraction, -1074)
        } else {
            (fraction | 1 << 52, biased - 1075)
        };
        if mantissa == 0 {
            return Some(Self::zero());
        }
        // An odd mantissa keeps the limbs few.
        let shift = mantissa.trailing_zeros();
        let mantissa = mantissa >> shift;
        Some(Self {
            negative: x < 0.0,
            magnitude: trimmed(vec![mantissa as u32, (mantissa >> 32) as u32]),
            exponent: exponent + shift as i32,
        })
    }

    /// The sign: -1, 0 or 1.
    pub fn signum(&self) -> i32 {
        match (self.magnitude.is_empty(), self.negative) {
            (true, _) => 0,
            (false, true) => -1,
            (false, false) => 1,
        }
    }

    /// The limbs for a lower exponent.
    fn aligned(&self, exponent: i32) -> Vec<u32> {
        let shift = (self.exponent - exponent) as u32;
        let mut limbs = vec![0; (shift / 32) as usize];
        let bits = shift % 32;
        let mut carry = 0u64;
        for &limb in &self.magnitude {
            let value = (u64::from(limb) << bits) | carry;
            limbs.push(value as u32);
            carry = value >> 32;
        }
        limbs.push(carry as u32);
        trimmed(limbs)
    }
}

fn trimmed(mut limbs: Vec<u32>) -> Vec<u32> {
    while limbs.last() == Some(&0) {
        limbs.pop();
    }
    limbs
}

fn compare(a: &[u32], b: &[u32]) -> Ordering {
    a.len()
        .cmp(&b.len())
        .then_with(|| a.iter().rev().cmp(b.iter().rev()))
}

fn sum(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut carry = 0u64;
    let mut limbs = Vec::with_capacity(a.len().max(b.len()) + 1);
    for i in 0..a.len().max(b.len()) {
        let limb = |s: &[u32]| u64::from(s.get(i).copied().unwrap_or(0));
        carry += limb(a) + limb(b);
        limbs.push(carry as u32);
        carry >>= 32;
    }
    limbs.push(carry as u32);
    trimmed(limbs)
}

/// `a - b` for `a >= b`.
fn difference(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut borrow = 0i64;
    let mut limbs = Vec::with_capacity(a.len());
    for (i, &limb) in a.iter().enumerate() {
        let value = i64::from(limb) - i64::from(b.get(i).copied().unwrap_or(0)) + borrow;
        limbs.push(value as u32);
        borrow = value >> 32;
    }
    trimmed(limbs)
}

impl Add<&Dyadic> for &Dyadic {
    type Output = Dyadic;

    fn add(self, other: &Dyadic) -> Dyadic {
        if self.signum() == 0 {
            return other.clone();
        }
        if other.signum() == 0 {
            return self.clone();
        }
        let exponent = self.exponent.min(other.exponent);
        let (a, b) = (self.aligned(exponent), other.aligned(exponent));
        let (negative, magnitude) = if self.negative == other.negative {
            (self.negative, sum(&a, &b))
        } else if compare(&a, &b) == Ordering::Less {
            (other.negative, difference(&b, &a))
        } else {
            (self.negative, difference(&a, &b))
        };
        Dyadic {
            negative,
            magnitude,
            exponent,
        }
    }
}

impl Neg for &Dyadic {
    type Output = Dyadic;

    fn neg(self) -> Dyadic {
        Dyadic {
            negative: !self.negative,
            ..self.clone()
        }
    }
}

impl Sub<&Dyadic> for &Dyadic {
    type Output = Dyadic;

    fn sub(self, other: &Dyadic) -> Dyadic {
        self + &-other
    }
}

impl Mul<&Dyadic> for &Dyadic {
    type Output = Dyadic;

    fn mul(self, other: &Dyadic) -> Dyadic {
        let (a, b) = (&self.magnitude, &other.magnitude);
        let mut limbs = vec![0u32; a.len() + b.len()];
        for (i, &x) in a.iter().enumerate() {
            let mut carry = 0u64;
            for (j, &y) in b.iter().enumerate() {
                let value = u64::from(limbs[i + j]) + u64::from(x) * u64::from(y) + carry;
                limbs[i + j] = value as u32;
                carry = value >> 32;
            }
            limbs[i + b.len()] = carry as u32;
        }
        Dyadic {
            negative: self.negative != other.negative,
            magnitude: trimmed(limbs),
            exponent: self.exponent + other.exponent,
        }
    }
}

impl PartialEq for Dyadic {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Dyadic {}

impl PartialOrd for Dyadic {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Dyadic {
    fn cmp(&self, other: &Self) -> Ordering {
        (self - other).signum().cmp(&0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_integers_agree_with_the_processor() {
        for a in -40i32..40 {
            for b in -40i32..40 {
                let exact = |x: i32| Dyadic::new(f64::from(x)).expect("finite");
                assert_eq!(&exact(a) + &exact(b), exact(a + b), "{a} + {b}");
                assert_eq!(&exact(a) - &exact(b), exact(a - b), "{a} - {b}");
                assert_eq!(&exact(a) * &exact(b), exact(a * b), "{a} * {b}");
                assert_eq!(exact(a).cmp(&exact(b)), a.cmp(&b), "{a} against {b}");
            }
        }
    }

    #[test]
    fn distant_exponents_do_not_absorb() {
        let exact = |x: f64| Dyadic::new(x).expect("finite");
        let sum = &exact(f64::MAX) + &exact(5e-324);
        assert!(sum > exact(f64::MAX), "the smallest number counts");
        assert_eq!(&sum - &exact(f64::MAX), exact(5e-324), "and comes back");
    }
}
