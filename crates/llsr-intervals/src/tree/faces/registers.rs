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
use super::{FaceHit, NOTHING};

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

    /// Appends the faces in the lanes of `mask` that hold one; `first` is the place of the first lane.
    #[inline(always)]
    fn push_hits(faces: &[u32; LANES], mask: u16, first: u32, found: &mut Vec<FaceHit>) {
        let mut hits = mask;
        while hits != 0 {
            let lane = hits.trailing_zeros();
            hits &= hits - 1;
            let face = faces[lane as usize];
            if face != NOTHING {
                let place = first + lane;
                found.push(FaceHit { face, place });
            }
        }
    }

    /// Writes the numbers in the lanes of `mask` one after the other, and anything behind them.
    #[inline(always)]
    fn compress(from: &[f32; LANES], mask: u16, to: &mut [f32; LANES]) {
        let (mut left, mut next) = (mask, 0);
        while left != 0 {
            to[next] = from[left.trailing_zeros() as usize];
            left &= left - 1;
            next += 1;
        }
    }
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

    #[inline(always)]
    fn push_hits(faces: &[u32; LANES], mask: u16, first: u32, found: &mut Vec<FaceHit>) {
        found.reserve(LANES);
        // SAFETY: as above. Sixteen hits, each two numbers and nothing else, are written into memory reserved behind the
        // list, and so many of them count as were asked for.
        unsafe {
            let faces = _mm512_loadu_si512(faces.as_ptr().cast());
            let mask = _mm512_mask_cmpneq_epi32_mask(mask, faces, _mm512_set1_epi32(NOTHING as i32));
            let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let places = _mm512_add_epi32(lanes, _mm512_set1_epi32(first as i32));
            let faces = _mm512_maskz_compress_epi32(mask, faces);
            let places = _mm512_maskz_compress_epi32(mask, places);
            let low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
            let high = _mm512_add_epi32(low, _mm512_set1_epi32(8));
            let end: *mut __m512i = found.as_mut_ptr().add(found.len()).cast();
            _mm512_storeu_si512(end, _mm512_permutex2var_epi32(faces, low, places));
            _mm512_storeu_si512(end.add(1), _mm512_permutex2var_epi32(faces, high, places));
            found.set_len(found.len() + mask.count_ones() as usize);
        }
    }

    #[inline(always)]
    fn compress(from: &[f32; LANES], mask: u16, to: &mut [f32; LANES]) {
        // SAFETY: as above; both arrays hold one register of numbers.
        unsafe {
            let packed = _mm512_maskz_compress_ps(mask, _mm512_loadu_ps(from.as_ptr()));
            _mm512_storeu_ps(to.as_mut_ptr(), packed);
        }
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
