//! Picks the widest form of each pass that the CPU can run.
//!
//! The passes are generic over their innermost parts. Here they are compiled once for each instruction set. No form fuses operations or changes
//! their order within a pixel, so all give the same bits.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod cells512;
#[cfg(target_arch = "x86_64")]
mod strokes;
#[cfg(test)]
mod tests;
#[cfg(target_arch = "x86_64")]
mod world;
#[cfg(target_arch = "x86_64")]
mod x86;

use glam::{Mat4, Vec3};

use crate::antialias;
use crate::classify::{self, CLASS_PLANES};
use crate::complex;
use crate::crossings::{BandCrossings, Crossings};
use crate::donors::{self, AlikeRows, SampleValues};
use crate::edges::EdgeList;
use crate::fill;
use crate::interpolate::{self, BLOCK, InterpolateScratch, Source};
use crate::load::{self, SamplePlanes};
use crate::occlusion::{BandLimits, LimitScratch, Occlusion};
use crate::patch::Patches;
use crate::picture::PictureBand;
use crate::pixels::Pixels;
use crate::planes::{BandPlanes, Planes};
use crate::raster;
use crate::reach::{self, REACH_PLANES, ReachScratch};

/// A set of instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    /// What every CPU of the target has.
    Portable,
    /// AVX2 and bit manipulation.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 F, BW, DQ and VL.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// The widest level of this CPU.
    pub(crate) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if Self::has_avx512() {
                return Self::Avx512;
            }
            if Self::has_avx2() {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// All levels of this CPU, the portable one first.
    #[cfg(test)]
    pub(crate) fn available() -> Vec<Self> {
        let mut levels = vec![Self::Portable];
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(Self::has_avx2().then_some(Self::Avx2));
            levels.extend(Self::has_avx512().then_some(Self::Avx512));
        }
        levels
    }

    #[cfg(target_arch = "x86_64")]
    fn has_avx2() -> bool {
        is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt")
    }

    #[cfg(target_arch = "x86_64")]
    fn has_avx512() -> bool {
        Self::has_avx2()
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
    }
}

/// [`classify::classify`] for the given level.
pub(crate) fn classify(
    level: Level,
    crossings: &Crossings,
    first_row: usize,
    words: &mut [u16],
    planes: &mut BandPlanes<'_, CLASS_PLANES>,
) {
    match level {
        Level::Portable => classify::classify::<classify::Portable>(crossings, first_row, words, planes),
        #[cfg(target_arch = "x86_64")]
        wide => x86::classify(wide, crossings, first_row, words, planes),
    }
}

/// [`load::load`] for the given level.
pub(crate) fn load(level: Level, planes: SamplePlanes<'_>, with_colours: bool, pixels: &mut Pixels) {
    match level {
        Level::Portable => load::load(planes, with_colours, pixels),
        #[cfg(target_arch = "x86_64")]
        wide => x86::load(wide, planes, with_colours, pixels),
    }
}

/// Adds projected edges as [`EdgeList::extend_world`] does, as many from the first on as there are wide forms for on this CPU; returns
/// their number. `plain` adds a single one.
pub(crate) fn extend_world(
    list: &mut EdgeList,
    matrix: &Mat4,
    frame: [f32; 2],
    segments: &[[Vec3; 2]],
    plain: impl Fn(&mut EdgeList, [Vec3; 2]),
) -> usize {
    match Level::detect() {
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => x86::extend_world(list, matrix, frame, segments, plain),
        _ => {
            // The plain form does them all.
            let _ = (list, matrix, frame, segments, plain);
            0
        }
    }
}

/// [`raster::mark`] for the given level.
pub(crate) fn mark(
    level: Level,
    edges: &EdgeList,
    limits: Option<&BandLimits<'_>>,
    band: &mut BandCrossings<'_>,
) {
    match level {
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => x86::mark(edges, limits, band),
        _ => raster::mark(edges, limits, band),
    }
}

/// [`BandLimits::update`] for the given level.
pub(crate) fn update_limits(
    level: Level,
    limits: &mut BandLimits<'_>,
    pixels: &Pixels,
    occlusion: Occlusion,
    scratch: &mut LimitScratch,
) {
    match level {
        Level::Portable => limits.update(pixels, occlusion, scratch),
        #[cfg(target_arch = "x86_64")]
        wide => x86::update_limits(wide, limits, pixels, occlusion, scratch),
    }
}

/// [`reach::reach`] for the given level.
pub(crate) fn reach(
    level: Level,
    classes: &Planes<CLASS_PLANES>,
    width: usize,
    rows: (usize, usize),
    scratch: &mut ReachScratch,
    band: &mut BandPlanes<'_, REACH_PLANES>,
) {
    match level {
        Level::Portable => reach::reach::<u64>(classes, width, rows, scratch, band),
        #[cfg(target_arch = "x86_64")]
        wide => x86::reach(wide, classes, width, rows, scratch, band),
    }
}

/// [`fill::fill`] for the given level.
pub(crate) fn fill(
    level: Level,
    source: fill::Source<'_>,
    rows: std::ops::Range<usize>,
    patches: &mut Patches,
) {
    match level {
        Level::Portable => fill::fill::<[f32; BLOCK], u64>(source, false, rows, patches),
        #[cfg(target_arch = "x86_64")]
        wide => x86::fill(wide, source, true, rows, patches),
    }
}

/// [`complex::filter`] for the given level.
pub(crate) fn filter_complex<F: Fn(u32, u32) -> Vec3>(
    level: Level,
    source: complex::Source<'_>,
    rows: std::ops::Range<usize>,
    factor: &F,
    patches: &mut Patches,
) {
    match level {
        Level::Portable => complex::filter::<classify::Portable, F>(source, rows, factor, patches),
        #[cfg(target_arch = "x86_64")]
        wide => x86::filter_complex::<F>(wide, source, rows, factor, patches),
    }
}

/// [`interpolate::interpolate`] for the given level.
pub(crate) fn interpolate(
    level: Level,
    source: Source<'_>,
    scratch: &mut InterpolateScratch,
    band: &mut PictureBand<'_>,
) {
    match level {
        Level::Portable => interpolate::interpolate::<interpolate::Portable>(source, scratch, band),
        #[cfg(target_arch = "x86_64")]
        wide => x86::interpolate(wide, source, scratch, band),
    }
}

/// [`donors::donate`] for the given level.
pub(crate) fn donate(
    level: Level,
    source: Source<'_>,
    of_samples: SampleValues<'_>,
    y: usize,
    priorities: &[u8],
    scratch: (&mut [u32], &mut AlikeRows),
) {
    match level {
        Level::Portable => donors::donate::<interpolate::Portable, classify::Portable>(
            source, of_samples, y, priorities, scratch,
        ),
        #[cfg(target_arch = "x86_64")]
        wide => x86::donate(wide, source, of_samples, y, priorities, scratch),
    }
}

/// [`antialias::antialias`] for the given level.
pub(crate) fn antialias(
    level: Level,
    source: antialias::Source<'_>,
    rows: std::ops::Range<usize>,
    patches: &mut Patches,
) {
    match level {
        Level::Portable => antialias::antialias::<u64>(source, rows, patches),
        #[cfg(target_arch = "x86_64")]
        wide => x86::antialias(wide, source, rows, patches),
    }
}
