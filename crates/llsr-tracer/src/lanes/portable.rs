//! Lanes as plain arrays.

use super::{Floats, Simd};
use crate::build::ChildRef;

/// The instructions that every processor has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

/// `N` lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes<const N: usize>([f32; N]);

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }

    #[inline(always)]
    fn zip3(self, b: Self, c: Self, f: impl Fn(f32, f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i], c.0[i])))
    }

    #[inline(always)]
    fn bits(self, b: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        (0..N).fold(0, |mask, i| mask | u32::from(f(self.0[i], b.0[i])) << i)
    }
}

impl<const N: usize> Floats for Lanes<N> {
    type Token = Portable;
    type Array = [f32; N];

    #[inline(always)]
    fn splat(_: Portable, x: f32) -> Self {
        Self([x; N])
    }
    #[inline(always)]
    fn load(_: Portable, from: &[f32; N]) -> Self {
        Self(*from)
    }
    #[inline(always)]
    fn store(self) -> [f32; N] {
        self.0
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        self.zip(b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self.zip(b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self.zip(b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        self.zip(b, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self.zip3(b, c, |a, b, c| a * b + c)
    }
    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        self.zip3(b, c, |a, b, c| a * b - c)
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        self.zip3(b, c, |a, b, c| c - a * b)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        self.zip(b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn min_bits(self, b: Self) -> Self {
        self.zip(b, |a, b| {
            if (a.to_bits() as i32) < b.to_bits() as i32 {
                a
            } else {
                b
            }
        })
    }
    #[inline(always)]
    fn max_bits(self, b: Self) -> Self {
        self.zip(b, |a, b| {
            if a.to_bits() as i32 > b.to_bits() as i32 {
                a
            } else {
                b
            }
        })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        self.zip(sign, f32::copysign)
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        self.bits(b, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        self.bits(b, |a, b| a < b)
    }
}

impl Simd for Portable {
    type F = Lanes<8>;
    type W = Lanes<16>;

    #[inline(always)]
    fn compress(self, from: &[ChildRef; 8], mask: u32) -> [ChildRef; 8] {
        let mut mask = mask & 0xff;
        let mut to = *from;
        for slot in &mut to {
            if mask == 0 {
                break;
            }
            *slot = from[(mask.trailing_zeros() & 7) as usize];
            mask &= mask - 1;
        }
        to
    }

    #[inline(always)]
    fn bits_to_bytes(self, mask: u32) -> u64 {
        (0..8).fold(0, |bytes, i| bytes | u64::from(mask >> i & 1) << (8 * i))
    }

    #[inline(always)]
    fn compress_byte_lanes(self, from: u64, mask: u32) -> u64 {
        let (mut mask, mut to, mut place) = (mask & 0xff, 0, 0);
        while mask != 0 {
            to |= (from >> (8 * mask.trailing_zeros()) & 0xff) << place;
            place += 8;
            mask &= mask - 1;
        }
        to
    }

    #[inline(always)]
    fn permute(self, from: Lanes<16>, indices: &[u8; 16]) -> Lanes<16> {
        Lanes(indices.map(|i| from.0[usize::from(i & 15)]))
    }
}
