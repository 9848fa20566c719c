//! Lanes of single precision, by the instructions that the machine has.
//!
//! A kernel is written once, generic over a [`Simd`] token, and compiled for each instruction set. Tokens of the
//! vector sets can only be had from a run-time check, so holding one is the proof that its instructions exist.
//! Kernels use the lanes only to *filter* with stated error bounds; decisions are made in double precision, so
//! that all instruction sets, with and without fused multiply-add, answer alike.

mod double;
mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;
#[cfg(target_arch = "x86_64")]
mod x86_double;

pub(crate) use double::{DoubleLanes, Doubles};
pub(crate) use portable::Portable;

use crate::build::ChildRef;

/// Instructions that a [`Tracer`](crate::Tracer) may use. All of them give the same answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instructions {
    /// What every processor has.
    Portable,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 F, VL, DQ and BW, besides AVX2 and FMA.
    Avx512,
}

impl Instructions {
    /// The best that this machine has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if x86::Avx512::detect().is_some() {
                return Self::Avx512;
            }
            if x86::Avx2::detect().is_some() {
                return Self::Avx2;
            }
        }
        Self::Portable
    }
}

/// Something to run with the lanes of some instruction set.
pub(crate) trait Kernel {
    type Output;
    /// Must be `#[inline(always)]`, so that it is compiled with the caller's instructions.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Proof that the instructions of a set exist.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Level {
    Portable(Portable),
    #[cfg(target_arch = "x86_64")]
    Avx2(x86::Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(x86::Avx512),
}

impl Level {
    /// The given instructions, or portable ones where the machine lacks them.
    pub(crate) fn new(instructions: Instructions) -> Self {
        #[cfg(target_arch = "x86_64")]
        match instructions {
            Instructions::Avx512 => {
                if let Some(simd) = x86::Avx512::detect() {
                    return Self::Avx512(simd);
                }
            }
            Instructions::Avx2 => {
                if let Some(simd) = x86::Avx2::detect() {
                    return Self::Avx2(simd);
                }
            }
            Instructions::Portable => {}
        }
        let _ = instructions;
        Self::Portable(Portable)
    }

    /// Which set this is.
    pub(crate) fn instructions(self) -> Instructions {
        match self {
            Self::Portable(_) => Instructions::Portable,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => Instructions::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => Instructions::Avx512,
        }
    }

    /// Runs `kernel` with these instructions.
    #[inline(always)]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Self::Portable(simd) => kernel.run(simd),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => simd.vectorize(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => simd.vectorize(kernel),
        }
    }
}

/// Floating-point lanes of one width.
pub(crate) trait Floats: Copy {
    /// The token that makes them.
    type Token: Copy;
    /// An array of as many floats.
    type Array;

    fn splat(token: Self::Token, x: f32) -> Self;
    fn load(token: Self::Token, from: &Self::Array) -> Self;
    fn store(self) -> Self::Array;
    fn add(self, b: Self) -> Self;
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    fn div(self, b: Self) -> Self;
    /// `self * b + c`, rounded once or twice.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self * b - c`, rounded once or twice.
    fn mul_sub(self, b: Self, c: Self) -> Self;
    /// `c - self * b`, rounded once or twice.
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    /// The smaller; `b` if either is NaN.
    fn min(self, b: Self) -> Self;
    /// The larger; `b` if either is NaN.
    fn max(self, b: Self) -> Self;
    /// The smaller of the bit patterns as signed integers: that of the numbers unless both are negative. It has ports
    /// of its own on most processors, and half the latency.
    fn min_bits(self, b: Self) -> Self;
    /// The larger of the bit patterns as signed integers: that of the numbers unless both are negative.
    fn max_bits(self, b: Self) -> Self;
    fn abs(self) -> Self;
    /// The magnitude of `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// One bit a lane, lane 0 lowest; false for NaN.
    fn le(self, b: Self) -> u32;
    fn lt(self, b: Self) -> u32;
}

/// A token for an instruction set, with the lanes that it offers.
pub(crate) trait Simd: DoubleLanes {
    /// Eight lanes, for the children of a node.
    type F: Floats<Token = Self, Array = [f32; 8]>;
    /// Sixteen lanes, for the vertices and triangles of a block.
    type W: Floats<Token = Self, Array = [f32; 16]>;

    /// The references selected by the low eight bits of `mask`, moved to the front; what follows them has no meaning.
    fn compress(self, from: &[ChildRef; 8], mask: u32) -> [ChildRef; 8];

    /// Byte i is bit i of the low eight bits of `mask`.
    fn bits_to_bytes(self, mask: u32) -> u64;

    /// The bytes selected by the low eight bits of `mask`, moved to the low end; what follows them has no meaning.
    fn compress_byte_lanes(self, from: u64, mask: u32) -> u64;

    /// Lane `indices[i]` of `from` in lane `i`; only the low four bits of an index count.
    fn permute(self, from: Self::W, indices: &[u8; 16]) -> Self::W;
}

#[cfg(test)]
mod tests;
