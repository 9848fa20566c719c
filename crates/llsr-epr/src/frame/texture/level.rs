//! Rows of textures for each instruction set: without one rounding and conversions are function calls.
#![expect(
    unsafe_code,
    reason = "intrinsics and calls of functions for instruction sets that were detected"
)]

use glam::DMat4;
use llsr_scene::ObjectId;

use crate::frame::texture::pyramid::Portable;
#[cfg(target_arch = "x86_64")]
use crate::frame::texture::pyramid::{Between, Texel};
use crate::frame::texture::{BandScratch, Painter, Row};

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// The best that this CPU has.
    pub(crate) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512vl")
            {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// All that this CPU has, the portable one first.
    #[cfg(test)]
    pub(crate) fn available() -> Vec<Self> {
        let mut levels = vec![Self::Portable];
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(is_x86_feature_detected!("avx2").then_some(Self::Avx2));
            levels.extend((Self::detect() == Self::Avx512).then_some(Self::Avx512));
        }
        levels
    }

    /// [`Painter::row`] as compiled for this instruction set. The bits are the same.
    pub(crate) fn row<M: Fn(ObjectId) -> DMat4>(
        self,
        painter: &Painter<'_, M>,
        scratch: &mut BandScratch,
        row: &mut Row<'_>,
    ) {
        match self {
            Self::Portable => painter.row::<Portable>(scratch, row),
            // SAFETY: `detect` has found AVX2.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { avx2(painter, scratch, row) },
            // SAFETY: `detect` has found these parts of AVX-512.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { avx512(painter, scratch, row) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2<M: Fn(ObjectId) -> DMat4>(painter: &Painter<'_, M>, scratch: &mut BandScratch, row: &mut Row<'_>) {
    painter.row::<Wide>(scratch, row);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn avx512<M: Fn(ObjectId) -> DMat4>(painter: &Painter<'_, M>, scratch: &mut BandScratch, row: &mut Row<'_>) {
    painter.row::<Wide>(scratch, row);
}

/// To be used only behind a level that has AVX2.
#[cfg(target_arch = "x86_64")]
struct Wide;

#[cfg(target_arch = "x86_64")]
impl Between for Wide {
    #[inline(always)]
    fn add(upper: &[Texel; 2], lower: &[Texel; 2], x: f32, y: f32, share: f32, sums: &mut [f32; 4]) {
        use std::arch::x86_64::*;
        // SAFETY: two texels are 16 bytes, sums 16; no load or store needs alignment. The CPU has AVX2 (see `Wide`).
        unsafe {
            let floats = |texels: &[Texel; 2]| {
                let components = _mm_loadu_si128(texels.as_ptr().cast());
                _mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(components))
            };
            let (above, below) = (floats(upper), floats(lower));
            let sides = _mm256_add_ps(
                above,
                _mm256_mul_ps(_mm256_sub_ps(below, above), _mm256_set1_ps(y)),
            );
            let (left, right) = (_mm256_castps256_ps128(sides), _mm256_extractf128_ps::<1>(sides));
            let between = _mm_add_ps(left, _mm_mul_ps(_mm_sub_ps(right, left), _mm_set1_ps(x)));
            let sum = _mm_loadu_ps(sums.as_ptr());
            let sum = _mm_add_ps(sum, _mm_mul_ps(between, _mm_set1_ps(share)));
            _mm_storeu_ps(sums.as_mut_ptr(), sum);
        }
    }
}
