//! Eight lanes of single precision, by the instructions that the machine has.
//!
//! A kernel is written once, generic over a [`Simd`] token, and compiled for each instruction set. Tokens of the
//! vector sets can only be had from a run-time check, so holding one is the proof that its instructions exist.
//! Kernels use the lanes only to *filter* with stated error bounds; decisions are made in double precision, so
//! that all instruction sets, with and without fused multiply-add, answer alike.

mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

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

/// Operations on eight lanes. Comparisons give one bit a lane, lane 0 lowest, and are false for NaN.
pub(crate) trait Simd: Copy {
    /// Eight `f32`.
    type F: Copy;

    fn splat(self, x: f32) -> Self::F;
    fn load(self, from: &[f32; 8]) -> Self::F;
    fn store(self, x: Self::F) -> [f32; 8];
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a * b + c`, rounded once or twice.
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `a * b - c`, rounded once or twice.
    fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `c - a * b`, rounded once or twice.
    fn neg_mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// The smaller; `b` if either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// The larger; `b` if either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    fn abs(self, a: Self::F) -> Self::F;
    fn le(self, a: Self::F, b: Self::F) -> u32;
    fn lt(self, a: Self::F, b: Self::F) -> u32;
    /// Writes the references selected by `mask` to the front of `to`; what lies behind them there is lost.
    fn compress(self, from: &[ChildRef; 8], mask: u32, to: &mut [ChildRef; 8]);
}

#[cfg(test)]
mod tests;
