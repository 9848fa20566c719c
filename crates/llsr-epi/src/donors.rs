//! Which sample speaks for the surface of each pixel.
//!
//! Colours come from all samples in reach, but a texture has to be looked up on one surface: that of the nearest of them. Where all samples
//! around a word of pixels have one value, as on a wall, nothing is searched.

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

/// Is `values[from + i]` equal to `value` for each bit i that is set? `from` may lie before the first value, if such bits are not set.
#[inline(always)]
pub(crate) fn all_of(mut bits: u64, values: &[u32], from: usize, value: u32) -> bool {
    let mut all = true;
    while bits != 0 {
        all &= values[from.wrapping_add(bits.trailing_zeros() as usize)] == value;
        bits &= bits - 1;
    }
    all
}

/// Scratch memory of a band.
#[derive(Clone, Debug, Default)]
pub(crate) struct DonorScratch {
    donated: Vec<u32>,
    alike: AlikeRows,
}

/// Whether all samples that the windows of a word of pixels see in a row have one value: for five rows in a ring.
#[derive(Clone, Debug, Default)]
pub(crate) struct AlikeRows {
    rows: [Vec<Alike>; 5],
    /// The row after the last of them.
    next: usize,
}

/// The values of some samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Alike {
    /// There are none.
    Nothing,
    /// One value.
    One(u32),
    /// Several.
    Several,
}

impl Alike {
    fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Nothing, one) | (one, Self::Nothing) => one,
            (one, other) if one == other => one,
            _ => Self::Several,
        }
    }
}

impl AlikeRows {
    /// Begins with row `first`.
    fn start(&mut self, first: usize, words: usize) {
        self.next = first;
        for row in &mut self.rows {
            row.clear();
            row.resize(words, Alike::Nothing);
        }
    }

    /// Makes sure that the rows up to `y` are there.
    #[inline(always)]
    fn fill<B: Blocks>(&mut self, source: Source<'_>, of_samples: SampleValues<'_>, y: usize) {
        for y in self.next..=y {
            let row = &mut self.rows[y % 5];
            if y >= source.pixels.height {
                row.fill(Alike::Nothing);
                continue;
            }
            let samples = source.classes.row(y as isize).plane(HAS_SAMPLE);
            let start = y * of_samples.stride;
            for (word, alike) in row.iter_mut().enumerate() {
                let here = samples[word + 1];
                // Two columns on either side belong to the windows too.
                let beside = [samples[word] & 3 << 62, samples[word + 2] & 3];
                let from = start + word * 64;
                let places = [
                    (here, from),
                    (beside[0], from.wrapping_sub(64)),
                    (beside[1], from + 64),
                ];
                let Some((bits, first)) = places.into_iter().find(|(bits, _)| *bits != 0) else {
                    *alike = Alike::Nothing;
                    continue;
                };
                let value = of_samples.values[first.wrapping_add(bits.trailing_zeros() as usize)];
                let [(_, from), (left, from_left), (right, from_right)] = places;
                let same = B::all_are(here, of_samples.values, from, value)
                    && all_of(left, of_samples.values, from_left, value)
                    && all_of(right, of_samples.values, from_right, value);
                *alike = if same { Alike::One(value) } else { Alike::Several };
            }
        }
        self.next = self.next.max(y + 1);
    }

    /// What all windows of a word see.
    #[inline(always)]
    fn of_word(&self, word: usize) -> Alike {
        let [a, b, c, d, e] = &self.rows;
        a[word].and(b[word]).and(c[word]).and(d[word]).and(e[word])
    }
}

/// Hands out the rows of a band.
pub(crate) fn rows(
    level: Level,
    source: Source<'_>,
    of_samples: SampleValues<'_>,
    band: &mut PictureBand<'_>,
    scratch: &mut DonorScratch,
    mut each: impl FnMut(DonorRow<'_>),
) {
    let width = source.pixels.width;
    let DonorScratch { donated, alike } = scratch;
    donated.clear();
    donated.resize(source.classes.words * 64, NO_DONOR);
    alike.start(band.first_row.saturating_sub(2), source.classes.words);
    for y in band.first_row..band.end_row {
        let start = (y - band.first_row) * band.stride;
        let priorities = &band.priority[start..start + band.stride];
        simd::donate(
            level,
            source,
            of_samples,
            y,
            priorities,
            (&mut *donated, &mut *alike),
        );
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
    (donated, alike): (&mut [u32], &mut AlikeRows),
) {
    let SampleValues { values, stride } = of_samples;
    alike.fill::<B>(source, of_samples, y + 2);
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
        match alike.of_word(word) {
            Alike::Nothing => continue,
            Alike::One(value) => {
                // Whichever is nearest.
                let mut donors = reached;
                if donors != inside {
                    donors |= inside & samples_around(source, word + 1, y);
                }
                if donors == u64::MAX {
                    *donated = [value; 64];
                } else {
                    for (i, donated) in donated.iter_mut().enumerate() {
                        if donors >> i & 1 != 0 {
                            *donated = value;
                        }
                    }
                }
                continue;
            }
            Alike::Several => {}
        }
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
