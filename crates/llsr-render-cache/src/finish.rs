//! The filter and the filling of planes, compiled once for each instruction set.
#![expect(
    unsafe_code,
    reason = "calls of functions compiled for instruction sets that were detected"
)]

use crate::image::FinishBand;
use crate::project::Level;

/// Runs [`FinishBand::rows`] as compiled for `level`. It is the same code, so the same bits.
pub(crate) fn finish(level: Level, band: &mut FinishBand<'_>) {
    match level {
        Level::Scalar => band.rows(),
        // SAFETY: `Level::detect` has found AVX2.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { avx2(band) },
        // SAFETY: `Level::detect` has found AVX-512F.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512(band) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2(band: &mut FinishBand<'_>) {
    band.rows();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn avx512(band: &mut FinishBand<'_>) {
    band.rows();
}
