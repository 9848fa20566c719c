//! Lanes as plain arrays.

use super::Simd;
use crate::build::ChildRef;

/// The instructions that every processor has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

#[inline(always)]
fn zip(a: [f32; 8], b: [f32; 8], f: impl Fn(f32, f32) -> f32) -> [f32; 8] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn zip3(a: [f32; 8], b: [f32; 8], c: [f32; 8], f: impl Fn(f32, f32, f32) -> f32) -> [f32; 8] {
    std::array::from_fn(|i| f(a[i], b[i], c[i]))
}

#[inline(always)]
fn bits(a: [f32; 8], b: [f32; 8], f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..8).fold(0, |mask, i| mask | u32::from(f(a[i], b[i])) << i)
}

impl Simd for Portable {
    type F = [f32; 8];

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        [x; 8]
    }
    #[inline(always)]
    fn load(self, from: &[f32; 8]) -> Self::F {
        *from
    }
    #[inline(always)]
    fn store(self, x: Self::F) -> [f32; 8] {
        x
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        zip3(a, b, c, |a, b, c| a * b + c)
    }
    #[inline(always)]
    fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        zip3(a, b, c, |a, b, c| a * b - c)
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        zip3(a, b, c, |a, b, c| c - a * b)
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        a.map(f32::abs)
    }
    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> u32 {
        bits(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> u32 {
        bits(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn compress(self, from: &[ChildRef; 8], mask: u32, to: &mut [ChildRef; 8]) {
        let mut mask = mask & 0xff;
        for slot in to {
            if mask == 0 {
                break;
            }
            *slot = from[(mask.trailing_zeros() & 7) as usize];
            mask &= mask - 1;
        }
    }
}
