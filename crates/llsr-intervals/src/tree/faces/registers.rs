//! Sixteen numbers together, in one register, two, or an array.
//!
//! The methods are inlined into functions that are compiled for the instructions they need; nothing else may call
//! them.
#![cfg_attr(
    target_arch = "x86_64",
    expect(unsafe_code, reason = "intrinsics that load through pointers")
)]

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

use super::super::hierarchy::LANES;

/// Sixteen single-precision numbers. Each value is off by at most one rounding an operation; whether a product and
/// sum are rounded once or twice depends on the register.
pub(super) trait Register: Copy {
    /// Sixteen copies.
    fn splat(x: f32) -> Self;
    /// From memory.
    fn load(x: &[f32; LANES]) -> Self;
    /// self * factor + sum.
    fn mul_add(self, factor: Self, sum: Self) -> Self;
    /// A bit for each lane in which self > other.
    fn exceeds(self, other: Self) -> u16;
    /// Asks for memory that will be read soon.
    #[inline(always)]
    fn prefetch<T>(_: &T) {}
}

/// For any processor.
#[derive(Clone, Copy)]
pub(super) struct Portable([f32; LANES]);

impl Register for Portable {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; LANES])
    }

    #[inline(always)]
    fn load(x: &[f32; LANES]) -> Self {
        Self(*x)
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, sum: Self) -> Self {
        let mut result = sum.0;
        for (sum, (x, y)) in result.iter_mut().zip(self.0.iter().zip(&factor.0)) {
            *sum += x * y;
        }
        Self(result)
    }

    #[inline(always)]
    fn exceeds(self, other: Self) -> u16 {
        let mut bits = 0;
        for (i, (x, y)) in self.0.iter().zip(&other.0).enumerate() {
            bits |= u16::from(x > y) << i;
        }
        bits
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn prefetch_lines<T>(x: &T) {
    let start: *const i8 = std::ptr::from_ref(x).cast();
    for line in 0..size_of::<T>().div_ceil(64) {
        // SAFETY: the address is inside `x`; a prefetch reads nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.add(line * 64)) };
    }
}

/// With 512-bit instructions.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(super) struct Avx512(__m512);

#[cfg(target_arch = "x86_64")]
impl Register for Avx512 {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: only used in functions compiled for AVX-512.
        Self(unsafe { _mm512_set1_ps(x) })
    }

    #[inline(always)]
    fn load(x: &[f32; LANES]) -> Self {
        // SAFETY: as above; the array holds one register of numbers.
        Self(unsafe { _mm512_loadu_ps(x.as_ptr()) })
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, sum: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_fmadd_ps(self.0, factor.0, sum.0) })
    }

    #[inline(always)]
    fn exceeds(self, other: Self) -> u16 {
        // SAFETY: as above.
        unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, other.0) }
    }

    #[inline(always)]
    fn prefetch<T>(x: &T) {
        prefetch_lines(x);
    }
}

/// With 256-bit instructions.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(super) struct Avx2([__m256; 2]);

#[cfg(target_arch = "x86_64")]
impl Register for Avx2 {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: only used in functions compiled for AVX2 and FMA.
        Self([unsafe { _mm256_set1_ps(x) }; 2])
    }

    #[inline(always)]
    fn load(x: &[f32; LANES]) -> Self {
        // SAFETY: as above; the array holds two registers of numbers.
        Self(unsafe {
            [
                _mm256_loadu_ps(x.as_ptr()),
                _mm256_loadu_ps(x.as_ptr().add(LANES / 2)),
            ]
        })
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, sum: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe {
            [
                _mm256_fmadd_ps(self.0[0], factor.0[0], sum.0[0]),
                _mm256_fmadd_ps(self.0[1], factor.0[1], sum.0[1]),
            ]
        })
    }

    #[inline(always)]
    fn exceeds(self, other: Self) -> u16 {
        // SAFETY: as above.
        let (low, high) = unsafe {
            (
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(self.0[0], other.0[0])),
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(self.0[1], other.0[1])),
            )
        };
        u16::from(low as u8) | u16::from(high as u8) << (LANES / 2)
    }

    #[inline(always)]
    fn prefetch<T>(x: &T) {
        prefetch_lines(x);
    }
}
