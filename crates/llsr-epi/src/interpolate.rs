//! Interpolation of the samples in reach (BWG03 section 5.3).
//!
//! Works in tiles of columns, row by row: samples are unpacked once a row into planes of floats, of which the last five rows
//! are kept. Sixteen pixels at a time take one of two ways: where no window has an edge the filter runs as two passes
//! of five taps, elsewhere as 24 taps under the masks of reachability.

use crate::classify::{CLASS_PLANES, COMPLEX, CROSSED, USABLE};
use crate::kernel::Kernel;
use crate::lanes::Lanes;
use crate::picture::{PictureBand, UNREACHED};
use crate::pixels::{Pixels, SAMPLE_SHIFT};
use crate::planes::{PlaneRow, Planes};
use crate::reach::{FORWARD, REACH_PLANES};

/// Pixels handled at once.
pub(crate) const BLOCK: usize = 16;
/// Words of 64 pixels in a tile: what keeps five rows of it in the first-level cache.
const TILE_WORDS: usize = 4;
const TILE: usize = TILE_WORDS * 64;
/// Pixels on each side of the tile that its windows look at, a whole block of them.
const MARGIN: usize = BLOCK;
/// Red, green, blue, and 1 where there is a sample.
const CHANNELS: usize = 4;
/// Floats of one unpacked row.
const ROW: usize = TILE + 2 * MARGIN;

/// One row of the tile.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct TileRow {
    /// Unpacked samples with margins.
    pub(crate) raw: [[f32; ROW]; CHANNELS],
    /// The same after the horizontal filter, for windows without edges.
    pub(crate) across: [[f32; TILE]; CHANNELS],
}

/// Scratch memory of [`interpolate`]: the last five rows.
#[derive(Clone, Debug)]
pub(crate) struct InterpolateScratch {
    rows: Box<[TileRow; 5]>,
}

impl Default for InterpolateScratch {
    fn default() -> Self {
        let row = TileRow {
            raw: [[0.0; ROW]; CHANNELS],
            across: [[0.0; TILE]; CHANNELS],
        };
        Self {
            rows: Box::new(std::array::from_fn(|_| row.clone())),
        }
    }
}

/// Sums of one block: weighted red, green, blue, and weight.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Sums(pub(crate) [[f32; BLOCK]; CHANNELS]);

/// Masks of a word of 64 pixels for the 25 taps of the window in scan order.
pub(crate) type TapMasks = [u64; 25];

/// The parts that SIMD modules replace.
pub(crate) trait Blocks {
    /// Words of a bit plane handled at once.
    type Lanes: Lanes;
    /// Unpacks 16 pixels into `raw[..][at..]`.
    fn unpack(words: &[u16; BLOCK], colours: &[u32; BLOCK], raw: &mut [[f32; ROW]; CHANNELS], at: usize);
    /// Horizontal filter of the 16 pixels at column `x` of the tile.
    fn across(row: &mut TileRow, x: usize, taps: [f32; 3]);
    /// Vertical filter of the 16 pixels at column `x` of the tile.
    fn down(rows: [&TileRow; 5], x: usize, taps: [f32; 3]) -> Sums;
    /// All 25 taps, each under 16 bits of its mask from bit `shift`.
    fn masked(rows: [&TileRow; 5], x: usize, masks: &TapMasks, shift: usize, kernel: &Kernel) -> Sums;
    /// Divides by the weight, turns it into a priority and stores both; returns the bits of pixels with a colour.
    ///
    /// `own` has the bits of pixels with a sample of their own. Pixels without any get `fallback`.
    fn finish(sums: &Sums, own: u16, out: Output<'_>, scale: f32, fallback: [f32; 3]) -> u16;
}

/// Where a block goes.
#[derive(Debug)]
pub(crate) struct Output<'a> {
    pub(crate) red: &'a mut [f32; BLOCK],
    pub(crate) green: &'a mut [f32; BLOCK],
    pub(crate) blue: &'a mut [f32; BLOCK],
    pub(crate) priority: &'a mut [u8; BLOCK],
}

/// What interpolation reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'a> {
    pub(crate) pixels: &'a Pixels,
    pub(crate) classes: &'a Planes<CLASS_PLANES>,
    pub(crate) reach: &'a Planes<REACH_PLANES>,
    pub(crate) kernel: Kernel,
    pub(crate) fallback: [f32; 3],
}

/// Interpolates the rows of a band.
#[inline(always)]
pub(crate) fn interpolate<B: Blocks>(
    source: Source<'_>,
    scratch: &mut InterpolateScratch,
    band: &mut PictureBand<'_>,
) {
    let words = source.classes.words;
    for first_word in (0..words).step_by(TILE_WORDS) {
        let tile = first_word..(first_word + TILE_WORDS).min(words);
        for y in band.first_row as isize - 2..band.first_row as isize + 2 {
            load_row::<B>(source, tile.clone(), y, &mut scratch.rows);
        }
        for y in band.first_row..band.end_row {
            load_row::<B>(source, tile.clone(), y as isize + 2, &mut scratch.rows);
            let rows = std::array::from_fn(|i| &scratch.rows[slot(y as isize + i as isize - 2)]);
            for word in tile.clone() {
                word_of_pixels::<B>(source, rows, (word, first_word), y, band);
            }
        }
    }
}

/// Rows live in slots by their number.
fn slot(y: isize) -> usize {
    y.rem_euclid(5) as usize
}

/// Unpacks and filters one row of a tile; a row outside the picture has no samples.
#[inline(always)]
fn load_row<B: Blocks>(source: Source<'_>, tile: std::ops::Range<usize>, y: isize, rows: &mut [TileRow; 5]) {
    let Source { pixels, kernel, .. } = source;
    let row = &mut rows[slot(y)];
    if y < 0 || y >= pixels.height as isize {
        row.raw = [[0.0; ROW]; CHANNELS];
        row.across = [[0.0; TILE]; CHANNELS];
        return;
    }
    let start = y as usize * pixels.stride;
    let words = &pixels.words[start..start + pixels.stride];
    let colours = &pixels.colours[start..start + pixels.stride];
    let columns = tile.len() * 64;
    for at in (0..columns + 2 * MARGIN).step_by(BLOCK) {
        // The column in the picture, plus the margin.
        let x = tile.start * 64 + at;
        let block = x.checked_sub(MARGIN).and_then(|x| {
            let words: &[u16; BLOCK] = words.get(x..x + BLOCK)?.try_into().ok()?;
            let colours: &[u32; BLOCK] = colours.get(x..x + BLOCK)?.try_into().ok()?;
            Some((words, colours))
        });
        match block {
            Some((words, colours)) => B::unpack(words, colours, &mut row.raw, at),
            None => row
                .raw
                .iter_mut()
                .for_each(|channel| channel[at..at + BLOCK].fill(0.0)),
        }
    }
    for x in (0..columns).step_by(BLOCK) {
        B::across(row, x, kernel.taps);
    }
}

/// The 64 pixels of one word.
#[inline(always)]
fn word_of_pixels<B: Blocks>(
    source: Source<'_>,
    rows: [&TileRow; 5],
    (word, first_word): (usize, usize),
    y: usize,
    band: &mut PictureBand<'_>,
) {
    let near = near_edges(source.classes, word + 1, y);
    let class = source.classes.row(y as isize);
    let own = class.plane(crate::classify::HAS_SAMPLE)[word + 1]
        & (class.plane(USABLE)[word + 1] | class.plane(COMPLEX)[word + 1]);
    let mut masks = None;
    let mut coloured = 0u64;
    // Weight of a pixel without a sample of its own whose other 24 are all there, to the priority 1.
    let scale = 253.0 / (1.0 - source.kernel.weight(0, 0));
    for block in 0..64 / BLOCK {
        let shift = block * BLOCK;
        let x = (word - first_word) * 64 + shift;
        let sums = if (near >> shift) as u16 == 0 {
            B::down(rows, x, source.kernel.taps)
        } else {
            let masks = masks.get_or_insert_with(|| tap_masks(source, word + 1, y));
            B::masked(rows, x, masks, shift, &source.kernel)
        };
        let start = (y - band.first_row) * band.stride + word * 64 + shift;
        let out = Output {
            red: block_mut(band.red, start),
            green: block_mut(band.green, start),
            blue: block_mut(band.blue, start),
            priority: block_mut(band.priority, start),
        };
        let bits = B::finish(&sums, (own >> shift) as u16, out, scale, source.fallback);
        coloured |= u64::from(bits) << shift;
    }
    band.coloured.row_mut(y - band.first_row)[word + 1] = coloured;
}

#[inline(always)]
fn block_mut<T>(plane: &mut [T], start: usize) -> &mut [T; BLOCK] {
    let Ok(block) = (&mut plane[start..start + BLOCK]).try_into() else {
        unreachable!("the slice has the length of a block");
    };
    block
}

/// Bits of the pixels of a word with an edge anywhere in their window.
#[inline(always)]
fn near_edges(classes: &Planes<CLASS_PLANES>, at: usize, y: usize) -> u64 {
    let mut column = [0u64; 3];
    for dy in -2..=2 {
        let row = classes.row(y as isize + dy).plane(CROSSED);
        for (column, word) in column.iter_mut().zip(&row[at - 1..=at + 1]) {
            *column |= word;
        }
    }
    let [left, here, right] = column;
    here | here << 1 | here << 2 | here >> 1 | here >> 2 | left >> 63 | left >> 62 | right << 63 | right << 62
}

/// For each tap of the window the bits of the pixels that use it.
///
/// A neighbour counts if it is in reach and its sample can be used; a complex pixel takes every sample (BWG03 section 5.4).
#[inline(always)]
fn tap_masks(source: Source<'_>, at: usize, y: usize) -> TapMasks {
    let class = |dy: isize| source.classes.row(y as isize + dy);
    let complex = class(0).plane(COMPLEX)[at];
    let mut masks = [0; 25];
    masks[12] = class(0).plane(USABLE)[at] | complex;
    for (plane, (dx, dy)) in FORWARD.into_iter().enumerate() {
        let forward = source.reach.row(y as isize).plane(plane)[at];
        let usable = load_at(class(dy).plane(USABLE), at, dx);
        masks[13 + plane] = forward & usable | complex;
        // The opposite neighbour holds the bit of the pair.
        let backward = load_at(reach_row(source, y as isize - dy).plane(plane), at, -dx);
        let usable = load_at(class(-dy).plane(USABLE), at, -dx);
        masks[11 - plane] = backward & usable | complex;
    }
    masks
}

#[inline(always)]
fn reach_row(source: Source<'_>, y: isize) -> PlaneRow<'_, REACH_PLANES> {
    source.reach.row(y)
}

/// Bit x holds pixel x + dx.
#[inline(always)]
fn load_at(plane: &[u64], at: usize, dx: isize) -> u64 {
    match dx {
        -2 => u64::load_left_2(plane, at),
        -1 => u64::load_left_1(plane, at),
        0 => plane[at],
        1 => u64::load_right_1(plane, at),
        _ => u64::load_right_2(plane, at),
    }
}

/// The form that runs anywhere.
#[derive(Debug)]
pub(crate) struct Portable;

impl Blocks for Portable {
    type Lanes = u64;

    #[inline(always)]
    fn unpack(words: &[u16; BLOCK], colours: &[u32; BLOCK], raw: &mut [[f32; ROW]; CHANNELS], at: usize) {
        for i in 0..BLOCK {
            let colour = crate::colour::unpack_colour(colours[i]);
            raw[0][at + i] = colour.x;
            raw[1][at + i] = colour.y;
            raw[2][at + i] = colour.z;
            raw[3][at + i] = f32::from(words[i] >> SAMPLE_SHIFT & 1);
        }
    }

    #[inline(always)]
    fn across(row: &mut TileRow, x: usize, [centre, near, far]: [f32; 3]) {
        for (raw, across) in row.raw.iter().zip(&mut row.across) {
            let raw = &raw[x + MARGIN - 2..x + MARGIN + BLOCK + 2];
            for (i, across) in across[x..x + BLOCK].iter_mut().enumerate() {
                *across =
                    centre * raw[i + 2] + near * (raw[i + 1] + raw[i + 3]) + far * (raw[i] + raw[i + 4]);
            }
        }
    }

    #[inline(always)]
    fn down(rows: [&TileRow; 5], x: usize, [centre, near, far]: [f32; 3]) -> Sums {
        let mut sums = Sums([[0.0; BLOCK]; CHANNELS]);
        for (channel, sums) in sums.0.iter_mut().enumerate() {
            let r = rows.map(|row| &row.across[channel][x..x + BLOCK]);
            for i in 0..BLOCK {
                sums[i] = centre * r[2][i] + near * (r[1][i] + r[3][i]) + far * (r[0][i] + r[4][i]);
            }
        }
        sums
    }

    #[inline(always)]
    fn masked(rows: [&TileRow; 5], x: usize, masks: &TapMasks, shift: usize, kernel: &Kernel) -> Sums {
        let mut sums = Sums([[0.0; BLOCK]; CHANNELS]);
        for (tap, &mask) in masks.iter().enumerate() {
            let bits = (mask >> shift) as u16;
            let (dx, row) = (tap % 5, tap / 5);
            let weight = kernel.weight(dx as isize - 2, row as isize - 2);
            let weights: [f32; BLOCK] = std::array::from_fn(|i| f32::from(bits >> i & 1) * weight);
            for (channel, sums) in sums.0.iter_mut().enumerate() {
                let raw = &rows[row].raw[channel][x + MARGIN + dx - 2..][..BLOCK];
                for i in 0..BLOCK {
                    sums[i] += weights[i] * raw[i];
                }
            }
        }
        sums
    }

    #[inline(always)]
    fn finish(sums: &Sums, own: u16, out: Output<'_>, scale: f32, fallback: [f32; 3]) -> u16 {
        let [red, green, blue, weight] = &sums.0;
        let mut coloured = 0;
        for i in 0..BLOCK {
            if weight[i] > 0.0 {
                let inverse = 1.0 / weight[i];
                out.red[i] = red[i] * inverse;
                out.green[i] = green[i] * inverse;
                out.blue[i] = blue[i] * inverse;
                let priority = (254.0 - scale * weight[i]).max(1.0) as u8;
                out.priority[i] = if own >> i & 1 != 0 { 0 } else { priority };
                coloured |= 1 << i;
            } else {
                (out.red[i], out.green[i], out.blue[i]) = fallback.into();
                out.priority[i] = UNREACHED;
            }
        }
        coloured
    }
}
