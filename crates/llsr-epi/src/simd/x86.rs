//! The passes compiled for x86-64 with AVX2 and with AVX-512.
#![expect(
    unsafe_code,
    reason = "calls of functions for instructions that the level says are there"
)]

use std::arch::x86_64::{__m256, __m512};

use glam::{Mat4, Vec3};

use super::Level;
use super::avx2::{self, Avx2};
use super::avx512::{self, Avx512};
use super::strokes;
use super::world;
use crate::antialias;
use crate::classify::{self, CLASS_PLANES};
use crate::complex;
use crate::crossings::{BandCrossings, Crossings};
use crate::donors::{self, AlikeRows, SampleValues};
use crate::edges::EdgeList;
use crate::fill;
use crate::interpolate::{self, InterpolateScratch, Source};
use crate::load::{self, SamplePlanes};
use crate::occlusion::{BandLimits, LimitScratch, Occlusion};
use crate::patch::Patches;
use crate::picture::PictureBand;
use crate::pixels::Pixels;
use crate::planes::{BandPlanes, Planes};
use crate::raster;
use crate::reach::{self, REACH_PLANES, ReachScratch};

/// Defines a function that runs one generic pass at the level that it is given, which must not be portable.
macro_rules! by_level {
    ($name:ident $(<$generic:ident: $bound:path>)?, $avx2:path, $avx512:path, ($($argument:ident: $type:ty),*)) => {
        pub(crate) fn $name $(<$generic: $bound>)? (level: Level, $($argument: $type),*) {
            #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
            fn avx2 $(<$generic: $bound>)? ($($argument: $type),*) {
                $avx2($($argument),*);
            }
            #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
            fn avx512 $(<$generic: $bound>)? ($($argument: $type),*) {
                $avx512($($argument),*);
            }
            match level {
                Level::Portable => unreachable!("the portable form is called directly"),
                // SAFETY: a level other than the portable one comes from `Level::detect` or `Level::available`, which have
                // asked the CPU for its instructions.
                Level::Avx2 => unsafe { avx2 $(::<$generic>)? ($($argument),*) },
                // SAFETY: as above.
                Level::Avx512 => unsafe { avx512 $(::<$generic>)? ($($argument),*) },
            }
        }
    };
}

by_level!(classify, classify::classify::<Avx2>, classify::classify::<Avx512>, (
    crossings: &Crossings,
    first_row: usize,
    words: &mut [u16],
    planes: &mut BandPlanes<'_, CLASS_PLANES>
));

by_level!(load, load::load, load::load, (
    planes: SamplePlanes<'_>,
    with_colours: bool,
    pixels: &mut Pixels
));

by_level!(update_limits, BandLimits::update, BandLimits::update, (
    limits: &mut BandLimits<'_>,
    pixels: &Pixels,
    occlusion: Occlusion,
    scratch: &mut LimitScratch
));

by_level!(reach, reach::reach::<avx2::Words>, reach::reach::<avx512::Words>, (
    classes: &Planes<CLASS_PLANES>,
    width: usize,
    rows: (usize, usize),
    scratch: &mut ReachScratch,
    band: &mut BandPlanes<'_, REACH_PLANES>
));

by_level!(interpolate, interpolate::interpolate::<Avx2>, interpolate::interpolate::<Avx512>, (
    source: Source<'_>,
    scratch: &mut InterpolateScratch,
    band: &mut PictureBand<'_>
));

by_level!(donate, donors::donate::<Avx2, Avx2>, donors::donate::<Avx512, Avx512>, (
    source: Source<'_>,
    of_samples: SampleValues<'_>,
    y: usize,
    priorities: &[u8],
    scratch: (&mut [u32], &mut AlikeRows)
));

by_level!(fill, fill::fill::<[__m256; 2], avx2::Words>, fill::fill::<__m512, avx512::Words>, (
    source: fill::Source<'_>,
    wide: bool,
    rows: std::ops::Range<usize>,
    patches: &mut Patches
));

by_level!(antialias, antialias::antialias::<avx2::Words>, antialias::antialias::<avx512::Words>, (
    source: antialias::Source<'_>,
    rows: std::ops::Range<usize>,
    patches: &mut Patches
));

by_level!(filter_complex<F: Factor>, complex::filter::<Avx2, F>, complex::filter::<Avx512, F>, (
    source: complex::Source<'_>,
    rows: std::ops::Range<usize>,
    factor: &F,
    patches: &mut Patches
));

/// [`strokes::mark`] for [`Level::Avx512`]; larger bands than it can do are left to the plain form.
pub(crate) fn mark(edges: &EdgeList, limits: Option<&BandLimits<'_>>, band: &mut BandCrossings<'_>) {
    if band.horizontal.len().max(band.vertical.len()) > strokes::MOST_BYTES {
        return raster::mark(edges, limits, band);
    }
    // SAFETY: this is called for the level only, which comes from `Level::detect` or `Level::available`, as above.
    unsafe { strokes::mark(edges, limits, band) }
}

/// [`world::extend`] for [`Level::Avx512`].
pub(crate) fn extend_world(
    list: &mut EdgeList,
    matrix: &Mat4,
    frame: [f32; 2],
    segments: &[[Vec3; 2]],
    plain: impl Fn(&mut EdgeList, [Vec3; 2]),
) -> usize {
    // SAFETY: as for `mark`.
    unsafe { world::extend(list, matrix, frame, segments, plain) }
}

/// Names the type of the factor's closure for the macro.
pub(crate) trait Factor: Fn(u32, u32) -> Vec3 {}

impl<F: Fn(u32, u32) -> Vec3> Factor for F {}
