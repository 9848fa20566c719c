//! Lanes as AVX2 and AVX-512 registers.
#![expect(
    unsafe_code,
    reason = "vector instructions; their presence is proved by the token's existence"
)]

use std::arch::x86_64::*;

use super::{Kernel, Simd};
use crate::build::ChildRef;

/// Proof that AVX2 and FMA exist.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

/// Proof that AVX-512 F, VL, DQ, BW and AVX2, FMA exist.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512(());

impl Avx2 {
    pub(crate) fn detect() -> Option<Self> {
        let found = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        found.then_some(Self(()))
    }

    #[inline(always)]
    pub(crate) fn vectorize<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn inner<K: Kernel>(simd: Avx2, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: the token proves that the instructions exist.
        unsafe { inner(self, kernel) }
    }
}

impl Avx512 {
    pub(crate) fn detect() -> Option<Self> {
        let found = Avx2::detect().is_some()
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw");
        found.then_some(Self(()))
    }

    #[inline(always)]
    pub(crate) fn vectorize<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
        fn inner<K: Kernel>(simd: Avx512, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: the token proves that the instructions exist.
        unsafe { inner(self, kernel) }
    }
}

macro_rules! common {
    () => {
        type F = __m256;

        #[inline(always)]
        fn splat(self, x: f32) -> __m256 {
            // SAFETY: the token proves AVX2.
            unsafe { _mm256_set1_ps(x) }
        }
        #[inline(always)]
        fn load(self, from: &[f32; 8]) -> __m256 {
            // SAFETY: the token proves AVX2; the reference covers the eight floats that an unaligned load reads.
            unsafe { _mm256_loadu_ps(from.as_ptr()) }
        }
        #[inline(always)]
        fn store(self, x: __m256) -> [f32; 8] {
            let mut to = [0.0; 8];
            // SAFETY: the token proves AVX2; the array covers the eight floats that an unaligned store writes.
            unsafe { _mm256_storeu_ps(to.as_mut_ptr(), x) };
            to
        }
        #[inline(always)]
        fn add(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: the token proves AVX2.
            unsafe { _mm256_add_ps(a, b) }
        }
        #[inline(always)]
        fn sub(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: the token proves AVX2.
            unsafe { _mm256_sub_ps(a, b) }
        }
        #[inline(always)]
        fn mul(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: the token proves AVX2.
            unsafe { _mm256_mul_ps(a, b) }
        }
        #[inline(always)]
        fn div(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: the token proves AVX2.
            unsafe { _mm256_div_ps(a, b) }
        }
        #[inline(always)]
        fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
            // SAFETY: the token proves FMA.
            unsafe { _mm256_fmadd_ps(a, b, c) }
        }
        #[inline(always)]
        fn mul_sub(self, a: __m256, b: __m256, c: __m256) -> __m256 {
            // SAFETY: the token proves FMA.
            unsafe { _mm256_fmsub_ps(a, b, c) }
        }
        #[inline(always)]
        fn neg_mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
            // SAFETY: the token proves FMA.
            unsafe { _mm256_fnmadd_ps(a, b, c) }
        }
        #[inline(always)]
        fn min(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: the token proves AVX2.
            unsafe { _mm256_min_ps(a, b) }
        }
        #[inline(always)]
        fn max(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: the token proves AVX2.
            unsafe { _mm256_max_ps(a, b) }
        }
        #[inline(always)]
        fn abs(self, a: __m256) -> __m256 {
            // SAFETY: the token proves AVX2.
            unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
        }
    };
}

impl Simd for Avx2 {
    common!();

    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: the token proves AVX2.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
    }
    #[inline(always)]
    fn lt(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: the token proves AVX2.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) as u32 }
    }
    #[inline(always)]
    fn compress(self, from: &[ChildRef; 8], mask: u32, to: &mut [ChildRef; 8]) {
        // SAFETY: the token proves AVX2 and BMI2; both arrays are eight `u32` (`ChildRef` is transparent).
        unsafe {
            // The lane numbers selected by the mask, one a byte: expand the mask to bytes and pick.
            let bytes = _pdep_u64(u64::from(mask), 0x0101_0101_0101_0101).wrapping_mul(0xff);
            let lanes = _pext_u64(0x0706_0504_0302_0100, bytes);
            let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes as i64));
            let all = _mm256_loadu_si256(from.as_ptr().cast());
            _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(all, lanes));
        }
    }
}

impl Simd for Avx512 {
    common!();

    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: the token proves AVX-512 VL.
        unsafe { u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b)) }
    }
    #[inline(always)]
    fn lt(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: the token proves AVX-512 VL.
        unsafe { u32::from(_mm256_cmp_ps_mask::<_CMP_LT_OQ>(a, b)) }
    }
    #[inline(always)]
    fn compress(self, from: &[ChildRef; 8], mask: u32, to: &mut [ChildRef; 8]) {
        // SAFETY: the token proves AVX-512 VL; both arrays are eight `u32` (`ChildRef` is transparent).
        unsafe {
            // Compress in the register: the form that writes to memory is slow on some processors.
            let all = _mm256_loadu_si256(from.as_ptr().cast());
            _mm256_storeu_si256(
                to.as_mut_ptr().cast(),
                _mm256_maskz_compress_epi32(mask as u8, all),
            );
        }
    }
}
