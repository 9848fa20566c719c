//! Eight lanes of double precision, and the bytes and bits that go with them.
//!
//! Decisions are made in these lanes, so there is no fused multiply-add: every instruction set gives the same bits.

use super::Portable;

/// Eight doubles.
pub(crate) trait Doubles: Copy {
    /// The token that makes them.
    type Token: Copy;

    fn splat(token: Self::Token, x: f64) -> Self;
    /// Eight floats, exactly.
    fn widen(token: Self::Token, from: &[f32; 8]) -> Self;
    fn load(token: Self::Token, from: &[f64; 8]) -> Self;
    fn store(self) -> [f64; 8];
    fn add(self, b: Self) -> Self;
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    fn div(self, b: Self) -> Self;
    fn abs(self) -> Self;
    /// One bit a lane, lane 0 lowest; false for NaN.
    fn lt(self, b: Self) -> u32;
    fn le(self, b: Self) -> u32;
    /// This where the bit of `mask` is set, else `other`.
    fn or_else(self, mask: u32, other: Self) -> Self;
}

/// What a set of instructions offers besides [`Simd`](super::Simd).
pub(crate) trait DoubleLanes: Copy {
    type D: Doubles<Token = Self>;

    /// Bit `indices[i]` of `bits` in bit `i`; only the low four bits of an index count.
    fn permute_bits(self, bits: u32, indices: &[u8; 16]) -> u32;

    /// The bytes selected by `mask`, of which at most eight low bits are set, moved to the front; zero behind them.
    fn compress_bytes(self, from: &[u8; 16], mask: u32) -> u64;

    /// The bits of `from` selected by `mask`, moved to the front.
    fn compress_bits(self, from: u32, mask: u32) -> u32;

    /// The low eight bits, each as a byte of ones or zeros.
    fn spread(self, bits: u32) -> u64;

    /// Lane `indices[i]` of the sixteen of `table` in lane `i`, for the bytes `indices[i]`, whose low four bits count.
    fn pick(self, table: &[Self::D; 2], indices: u64) -> Self::D;

    /// Says that `at` will be needed soon.
    fn prefetch<T>(self, at: &T);
}

/// Eight doubles in an array.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eight([f64; 8]);

impl Eight {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }

    #[inline(always)]
    fn bits(self, b: Self, f: impl Fn(f64, f64) -> bool) -> u32 {
        (0..8).fold(0, |mask, i| mask | u32::from(f(self.0[i], b.0[i])) << i)
    }
}

impl Doubles for Eight {
    type Token = Portable;

    #[inline(always)]
    fn splat(_: Portable, x: f64) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    fn widen(_: Portable, from: &[f32; 8]) -> Self {
        Self(from.map(f64::from))
    }
    #[inline(always)]
    fn load(_: Portable, from: &[f64; 8]) -> Self {
        Self(*from)
    }
    #[inline(always)]
    fn store(self) -> [f64; 8] {
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
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        self.bits(b, |a, b| a < b)
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        self.bits(b, |a, b| a <= b)
    }
    #[inline(always)]
    fn or_else(self, mask: u32, other: Self) -> Self {
        Self(std::array::from_fn(|i| {
            if mask >> i & 1 == 1 { self.0[i] } else { other.0[i] }
        }))
    }
}

impl DoubleLanes for Portable {
    type D = Eight;

    #[inline(always)]
    fn permute_bits(self, bits: u32, indices: &[u8; 16]) -> u32 {
        (0..16).fold(0, |mask, i| mask | (bits >> (indices[i] & 15) & 1) << i)
    }

    #[inline(always)]
    fn compress_bytes(self, from: &[u8; 16], mask: u32) -> u64 {
        let (mut mask, mut to, mut shift) = (mask & 0xffff, 0, 0);
        while mask != 0 && shift < 64 {
            to |= u64::from(from[(mask.trailing_zeros() & 15) as usize]) << shift;
            mask &= mask - 1;
            shift += 8;
        }
        to
    }

    #[inline(always)]
    fn compress_bits(self, from: u32, mask: u32) -> u32 {
        let (mut mask, mut to, mut shift) = (mask, 0, 0);
        while mask != 0 {
            to |= (from >> mask.trailing_zeros() & 1) << shift;
            mask &= mask - 1;
            shift += 1;
        }
        to
    }

    #[inline(always)]
    fn spread(self, bits: u32) -> u64 {
        (0..8).fold(0, |bytes, i| bytes | (0xff * u64::from(bits >> i & 1)) << (8 * i))
    }

    #[inline(always)]
    fn pick(self, table: &[Eight; 2], indices: u64) -> Eight {
        Eight(indices.to_le_bytes().map(|i| {
            let i = usize::from(i & 15);
            table[i >> 3].0[i & 7]
        }))
    }

    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
}
