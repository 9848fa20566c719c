//! Which sample speaks for the surface of each pixel.
//!
//! Colours come from all samples in reach, but a texture has to be looked up on one surface: that of the nearest of them.

use crate::classify::{COMPLEX, HAS_SAMPLE, Masks};
use crate::interpolate::{Blocks, Source, sample_mask, tap_mask, widened};
use crate::picture::{PictureBand, UNREACHED};
use crate::planes::outside_of_last_word;
use crate::simd::{self, Level};

/// For pixels without a sample around them.
pub const NO_DONOR: u32 = u32::MAX;

/// Taps of the window from near to far, those at equal distance turning round the pixel.
const NEAR_TO_FAR: [u8; 25] = [
    12, 11, 7, 13, 17, 6, 8, 18, 16, 10, 2, 14, 22, 5, 1, 3, 9, 19, 23, 21, 15, 0, 4, 24, 20,
];

/// Something that is known of the sample of each pixel, say a number of the surface that it lies on.
#[derive(Clone, Copy, Debug)]
pub struct SampleValues<'a> {
    /// Values in rows; those of pixels without a sample are not looked at.
    pub values: &'a [u32],
    /// Values from one row to the next, at least the width of the picture.
    pub stride: usize,
}

/// Colours of one row of the picture.
#[derive(Debug)]
pub struct ColourRow<'a> {
    /// Red components from left to right.
    pub red: &'a mut [f32],
    /// Green ones.
    pub green: &'a mut [f32],
    /// Blue ones.
    pub blue: &'a mut [f32],
}

/// One row of a picture that is to be multiplied.
#[derive(Debug)]
pub struct DonorRow<'a> {
    /// Its number.
    pub y: u32,
    /// For each pixel the value of the nearest sample of the 5x5 pixels around it that it reaches and that lies, so, on the surface that
    /// it shows. For complex pixels, and those that reach none, it is the nearest of all. [`NO_DONOR`] where there is none.
    pub values: &'a [u32],
    /// Bit i of word j is set if pixel 64 j + i is complex.
    pub complex: &'a [u64],
    /// What is to be multiplied.
    pub colours: ColourRow<'a>,
}

/// Hands out the rows of a band.
pub(crate) fn rows(
    level: Level,
    source: Source<'_>,
    of_samples: SampleValues<'_>,
    band: &mut PictureBand<'_>,
    donated: &mut Vec<u32>,
    mut each: impl FnMut(DonorRow<'_>),
) {
    let width = source.pixels.width;
    donated.clear();
    donated.resize(source.classes.words * 64, NO_DONOR);
    for y in band.first_row..band.end_row {
        let start = (y - band.first_row) * band.stride;
        let priorities = &band.priority[start..start + band.stride];
        simd::donate(level, source, of_samples, y, priorities, donated);
        let row = start..start + width;
        each(DonorRow {
            y: y as u32,
            values: &donated[..width],
            complex: &source.classes.row(y as isize).plane(COMPLEX)[1..=source.classes.words],
            colours: ColourRow {
                red: &mut band.red[row.clone()],
                green: &mut band.green[row.clone()],
                blue: &mut band.blue[row],
            },
        });
    }
}

/// The values of the donors of a row of pixels with these priorities.
#[inline(always)]
pub(crate) fn donate<B: Blocks, M: Masks>(
    source: Source<'_>,
    of_samples: SampleValues<'_>,
    y: usize,
    priorities: &[u8],
    donated: &mut [u32],
) {
    let SampleValues { values, stride } = of_samples;
    let words = donated.as_chunks_mut::<64>().0.iter_mut();
    for (word, (donated, priorities)) in words.zip(priorities.as_chunks::<64>().0).enumerate() {
        *donated = [NO_DONOR; 64];
        let inside = if word + 1 == source.classes.words {
            !outside_of_last_word(source.pixels.width)
        } else {
            u64::MAX
        };
        let mut others = *priorities;
        for priority in &mut others {
            *priority ^= UNREACHED;
        }
        let reached = M::nonzero(&others) & inside;
        let here = (y * stride + word * 64) as isize;
        let mut take = |found: u64, tap: u8| {
            let (row, column) = (tap as isize / 5 - 2, tap as isize % 5 - 2);
            // There are no samples outside the picture, so nothing is taken from there.
            B::take(found, values, here + row * stride as isize + column, donated);
        };
        let mut open = reached;
        for tap in NEAR_TO_FAR {
            if open == 0 {
                break;
            }
            let found = tap_mask(source, word + 1, y, tap) & open;
            open &= !found;
            take(found, tap);
        }
        // What reaches nothing takes what is nearest, as it does with colours.
        open = inside & !reached;
        if open != 0 {
            open &= samples_around(source, word + 1, y);
        }
        for tap in NEAR_TO_FAR {
            if open == 0 {
                break;
            }
            let found = sample_mask(source, word + 1, y, tap) & open;
            open &= !found;
            take(found, tap);
        }
    }
}

/// The bits of pixels of a word with a sample anywhere in their window.
#[inline(always)]
fn samples_around(source: Source<'_>, at: usize, y: usize) -> u64 {
    let mut column = [0u64; 3];
    for dy in -2..=2 {
        let row = source.classes.row(y as isize + dy).plane(HAS_SAMPLE);
        for (column, word) in column.iter_mut().zip(&row[at - 1..=at + 1]) {
            *column |= word;
        }
    }
    widened(column)
}
