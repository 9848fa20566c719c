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

#[cfg(test)]
mod tests {
    use glam::{Mat4, Vec3, Vec4};

    use super::*;
    use crate::{DepthFilter, Point, PointImage, PointStore, Replacement, View};

    #[test]
    fn same_bits_for_every_instruction_set() {
        let mut store = PointStore::new(5000).expect("capacity");
        let mut image = PointImage::new(67, 41).expect("size");
        let mut state = 1u64;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        for i in 0..5000 {
            let position =
                Vec3::new(4.0 * next() - 2.0, 4.0 * next() - 2.0, -1.0 - next()) * (1.0 + 2.0 * next());
            let point = Point {
                position,
                colour: Vec3::splat(next()),
                surface: 0,
                object: i,
                lights: 0,
            };
            store
                .insert(&point, &image, &Replacement::default())
                .expect("finite");
            if i == 4500 {
                store.advance(3, 255);
            }
        }
        let matrix = Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::new(0.0, 0.0, 0.0, -1.0), Vec4::ZERO);
        let view = View::new(&matrix, 67, 41).expect("size");
        for reach in [0, 1, 2, 3, 4, 5, 8] {
            let filter = DepthFilter {
                reach,
                ..DepthFilter::default()
            };
            image
                .project_chunks(&store, &view, &filter, 1)
                .for_each(|chunk| chunk.run());
            image.resolve_bands(1).for_each(|band| band.run());
            let mut run = |level| {
                image
                    .finish_bands(&store, 3)
                    .for_each(|mut band| finish(level, &mut band));
                (image.planes.clone(), image.counts())
            };
            let expected = run(Level::Scalar);
            assert!(
                reach == 0 || expected.1.hidden > 20,
                "something is hidden: {:?}",
                expected.1
            );
            for level in Level::all() {
                assert_eq!(run(level), expected, "{level:?} at reach {reach}");
            }
        }
    }
}
