//! Rows of textures, compiled once for each instruction set: rounding and conversions are function calls without one.
#![expect(
    unsafe_code,
    reason = "calls of functions compiled for instruction sets that were detected"
)]

use glam::DMat4;
use llsr_scene::ObjectId;

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

    /// [`Painter::row`] as compiled for this instruction set. It is the same code, so the same bits.
    pub(crate) fn row<M: Fn(ObjectId) -> DMat4>(
        self,
        painter: &Painter<'_, M>,
        scratch: &mut BandScratch,
        row: &mut Row<'_>,
    ) {
        match self {
            Self::Portable => painter.row(scratch, row),
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
    painter.row(scratch, row);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn avx512<M: Fn(ObjectId) -> DMat4>(painter: &Painter<'_, M>, scratch: &mut BandScratch, row: &mut Row<'_>) {
    painter.row(scratch, row);
}
