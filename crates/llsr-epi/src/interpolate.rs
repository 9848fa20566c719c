//! Interpolation of the samples in reach (BWG03 section 5.3).
//!
//! Works in tiles of columns, row by row: samples are unpacked once a row into planes of floats, of which the last five rows
//! are kept. Sixteen pixels at a time take one of two ways: where no window has an edge the filter runs as two passes
//! of five taps, elsewhere as 24 taps under the masks of reachability.

use crate::classify::{CLASS_PLANES, COMPLEX, CROSSED, HAS_SAMPLE, USABLE};
use crate::colour::{Packed, unpack_colour};
use crate::donors::all_of;
use crate::fit::{self, FitScratch, Floats, MeanRow, Windows};
use crate::kernel::Kernel;
use crate::lanes::Lanes;
use crate::picture::{PictureBand, UNREACHED};
use crate::pixels::{Pixels, SAMPLE_SHIFT};
use crate::planes::{Planes, outside_of_last_word};
use crate::reach::{FORWARD, REACH_PLANES};

/// Pixels handled at once.
pub(crate) const BLOCK: usize = 16;
/// Words of 64 pixels in a tile: five rows of it and what is made of them fit the second-level cache. Narrower tiles fit the first
/// level, but read and write large pictures in short runs, each on other pages of memory, which costs much more.
pub(crate) const TILE_WORDS: usize = 32;
pub(crate) const TILE: usize = TILE_WORDS * 64;
/// Pixels on each side of the tile: a block whose means the slopes of the tile look at, and one that the windows of that one do.
pub(crate) const MARGIN: usize = 2 * BLOCK;
/// Red, green, blue, and 1 where there is a sample.
pub(crate) const CHANNELS: usize = 4;
/// Floats of one unpacked row.
pub(crate) const ROW: usize = TILE + 2 * MARGIN;

/// One row of a tile with margins, channel by channel.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct TileRow(pub(crate) [[f32; ROW]; CHANNELS]);

impl TileRow {
    /// 1 where there is a sample.
    pub(crate) fn there(&self) -> &[f32; ROW] {
        &self.0[CHANNELS - 1]
    }
}

/// Scratch memory of [`interpolate`].
#[derive(Clone, Debug)]
pub(crate) struct InterpolateScratch {
    /// The unpacked samples of the last five rows.
    rows: Box<[TileRow; 5]>,
    /// The same after the vertical filter, for windows without edges.
    down: Box<TileRow>,
    /// Where planes are fitted.
    fit: Option<FitScratch>,
}

impl Default for InterpolateScratch {
    fn default() -> Self {
        let row = TileRow([[0.0; ROW]; CHANNELS]);
        Self {
            rows: Box::new(std::array::from_fn(|_| row.clone())),
            down: Box::new(row),
            fit: None,
        }
    }
}

/// Masks of a word of 64 pixels for the 25 taps of the window in scan order.
pub(crate) type TapMasks = [u64; 25];

/// The taps of the window beside its centre in groups of equal weight, as (column, row): under masks what a group holds is added
/// up before it is weighted once. Groups are two by two, so that two sums grow side by side.
pub(crate) const TAP_GROUPS: [[[(usize, usize); 4]; 2]; 3] = [
    [[(2, 1), (1, 2), (3, 2), (2, 3)], [(1, 1), (3, 1), (1, 3), (3, 3)]],
    [[(2, 0), (0, 2), (4, 2), (2, 4)], [(0, 0), (4, 0), (0, 4), (4, 4)]],
    [[(1, 0), (0, 1), (4, 1), (3, 0)], [(1, 4), (0, 3), (4, 3), (3, 4)]],
];

/// The weights of a pair of [`TAP_GROUPS`].
#[inline(always)]
pub(crate) fn group_weights(kernel: &Kernel, pair: &[[(usize, usize); 4]; 2]) -> [f32; 2] {
    pair.map(|group| kernel.weight(group[0].0 as isize - 2, group[0].1 as isize - 2))
}

/// The parts that SIMD modules replace. Columns count from the left end of the margin.
pub(crate) trait Blocks {
    /// Sums of one block: weighted red, green, blue, and weight.
    type Sums: Copy;
    /// Sixteen floats.
    type Floats: Floats;
    /// Unpacks 16 pixels into `row` from column `at`: words, high and low bits of colours.
    fn unpack(packed: PackedBlock<'_>, row: &mut TileRow, at: usize);
    /// Vertical filter of the 16 pixels from column `at`.
    fn down(rows: [&TileRow; 5], at: usize, taps: [f32; 3], out: &mut TileRow);
    /// Horizontal filter of the 16 pixels from column `at`.
    fn across(row: &TileRow, at: usize, taps: [f32; 3]) -> Self::Sums;
    /// All 25 taps for the 16 pixels from column `at`, each under 16 bits of its mask from bit `shift`; a bit says that there is
    /// a sample.
    fn masked(rows: [&TileRow; 5], at: usize, masks: &TapMasks, shift: usize, kernel: &Kernel) -> Self::Sums;
    /// Divides by the weight, turns it into a priority and stores both; returns the bits of pixels with a colour.
    ///
    /// `own` has the bits of pixels with a sample of their own. Pixels without any get `fallback`.
    fn finish(sums: Self::Sums, own: u16, out: Output<'_>, scale: f32, fallback: [f32; 3]) -> u16;
    /// Copies `values[from + i]` to `out[i]` for each bit i that is set.
    ///
    /// # Panics
    /// If one of them is not there.
    #[inline(always)]
    fn take(mut bits: u64, values: &[u32], from: isize, out: &mut [u32; 64]) {
        while bits != 0 {
            let i = bits.trailing_zeros() as usize;
            out[i] = values[(from + i as isize) as usize];
            bits &= bits - 1;
        }
    }
    /// Is `values[from + i]` equal to `value` for each bit i that is set?
    ///
    /// # Panics
    /// If one of them is not there.
    #[inline(always)]
    fn all_are(bits: u64, values: &[u32], from: usize, value: u32) -> bool {
        all_of(bits, values, from, value)
    }
}

/// Words of a block, and the colours in `colours` and `cache` (see [`Pixels`]).
pub(crate) type PackedBlock<'a> = (&'a [u16; BLOCK], &'a [u32; BLOCK], &'a [u32; BLOCK]);

/// Where a block goes.
#[derive(Debug)]
pub(crate) struct Output<'a> {
    pub(crate) red: &'a mut [f32; BLOCK],
    pub(crate) green: &'a mut [f32; BLOCK],
    pub(crate) blue: &'a mut [f32; BLOCK],
    pub(crate) priority: &'a mut [u8; BLOCK],
    /// One over the weight of the samples; infinite where there is none.
    pub(crate) inverse: &'a mut [f32; BLOCK],
}

/// What interpolation reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'a> {
    pub(crate) pixels: &'a Pixels,
    pub(crate) classes: &'a Planes<CLASS_PLANES>,
    pub(crate) reach: &'a Planes<REACH_PLANES>,
    pub(crate) kernel: Kernel,
    pub(crate) fallback: [f32; 3],
    /// Fit planes to the samples.
    pub(crate) linear: bool,
}

/// Interpolates the rows of a band.
#[inline(always)]
pub(crate) fn interpolate<B: Blocks>(
    source: Source<'_>,
    scratch: &mut InterpolateScratch,
    band: &mut PictureBand<'_>,
) {
    let words = source.classes.words;
    let InterpolateScratch { rows, down, fit } = scratch;
    let mut fit = source.linear.then(|| fit.get_or_insert_default());
    // Slopes look at the means of two rows more on either side.
    let around = if fit.is_some() { 2 } else { 0 };
    let (height, first) = (source.pixels.height, band.first_row.saturating_sub(around));
    for first_word in (0..words).step_by(TILE_WORDS) {
        let tile = first_word..(first_word + TILE_WORDS).min(words);
        if let Some(fit) = &mut fit {
            fit.means.iter_mut().for_each(MeanRow::forget);
        }
        for y in first as isize - 2..first as isize + 2 {
            load_row::<B>(source, tile.clone(), y, rows, fit.as_deref_mut());
        }
        for y in first..band.end_row + around {
            if y < height {
                load_row::<B>(source, tile.clone(), y as isize + 2, rows, fit.as_deref_mut());
                row_of_means::<B>(source, (tile.clone(), y), rows, down, fit.as_deref_mut(), band);
            } else if let Some(fit) = &mut fit {
                fit.means[slot(y as isize)].forget();
            }
            if let Some(fit) = &fit
                && let Some(y) = y.checked_sub(around).filter(|&y| y >= band.first_row)
            {
                fit::put::<B::Floats>(source, &fit.means, slots_around(y), (tile.clone(), y), band);
            }
        }
    }
}

/// The means of one row of a tile, put into the picture or kept where slopes are to be taken from them.
#[inline(always)]
fn row_of_means<B: Blocks>(
    source: Source<'_>,
    (tile, y): (std::ops::Range<usize>, usize),
    rows: &[TileRow; 5],
    down: &mut TileRow,
    mut fit: Option<&mut FitScratch>,
    band: &mut PictureBand<'_>,
) {
    let slots = slots_around(y);
    let rows = slots.map(|slot| &rows[slot]);
    // One word more on either side, of which slopes need a block.
    let mut near = [u64::MAX; TILE_WORDS + 2];
    let beside = usize::from(fit.is_some());
    for (near, word) in near
        .iter_mut()
        .zip(tile.start..tile.end + 2)
        .skip(1 - beside)
        .take(tile.len() + 2 * beside)
    {
        // Words count from the one before the tile, which has the number of the guard before the first.
        if (1..=source.classes.words).contains(&word) {
            *near = near_edges(source.classes, word, y);
        }
    }
    let near = &near[..tile.len() + 2];
    // Blocks without edges ask for columns up to two beside them.
    let open = |block: usize| {
        near.get((block + 2) / 4)
            .is_some_and(|near| (near >> (BLOCK * ((block + 2) % 4))) as u16 == 0)
    };
    for block in 0..4 * tile.len() + 2 * MARGIN / BLOCK {
        if open(block) || open(block + 1) || block > 0 && open(block - 1) {
            B::down(rows, block * BLOCK, source.kernel.taps, down);
            if let Some(fit) = &mut fit {
                fit.sum_down::<B::Floats>(rows, slots, block * BLOCK, &source.kernel);
            }
        }
    }
    for (i, word) in (tile.start..tile.end + 2).enumerate() {
        let inside = (1..=tile.len()).contains(&i);
        // The word of guard before the first has number 0, as above.
        if !(inside || beside == 1 && (1..=source.classes.words).contains(&word)) {
            continue;
        }
        let near = near[i];
        let masks = if near == 0 {
            [0; 25]
        } else {
            tap_masks(source, word, y)
        };
        let windows = Windows {
            rows,
            down,
            near,
            slots,
            masks: &masks,
        };
        let shifts = match i {
            0 => 64 - BLOCK..64,
            _ if !inside => 0..BLOCK,
            _ => 0..64,
        };
        word_of_means::<B>(source, &windows, shifts, (word, y), (i, fit.as_deref_mut()), band);
    }
}

/// Where the rows around row `y` live.
#[inline(always)]
fn slots_around(y: usize) -> [usize; 5] {
    let y = y as isize;
    [slot(y - 2), slot(y - 1), slot(y), slot(y + 1), slot(y + 2)]
}

/// Rows live in slots by their number.
fn slot(y: isize) -> usize {
    y.rem_euclid(5) as usize
}

/// Unpacks one row of a tile; a row outside the picture has no samples.
#[inline(always)]
fn load_row<B: Blocks>(
    source: Source<'_>,
    tile: std::ops::Range<usize>,
    y: isize,
    rows: &mut [TileRow; 5],
    mut fit: Option<&mut FitScratch>,
) {
    let pixels = source.pixels;
    let slot = slot(y);
    let row = &mut rows[slot];
    if y < 0 || y >= pixels.height as isize {
        row.0 = [[0.0; ROW]; CHANNELS];
        if let Some(fit) = fit {
            (0..ROW).step_by(BLOCK).for_each(|at| fit.clear(slot, at));
        }
        return;
    }
    let start = y as usize * pixels.stride;
    let words = &pixels.words[start..start + pixels.stride];
    let colours = &pixels.colours[start..start + pixels.stride];
    let cache = &pixels.cache[start..start + pixels.stride];
    for at in (0..tile.len() * 64 + 2 * MARGIN).step_by(BLOCK) {
        // The column in the picture, plus the margin.
        let x = tile.start * 64 + at;
        let block = x.checked_sub(MARGIN).and_then(|x| {
            let words: &[u16; BLOCK] = words.get(x..x + BLOCK)?.try_into().ok()?;
            let colours: &[u32; BLOCK] = colours.get(x..x + BLOCK)?.try_into().ok()?;
            let cache: &[u32; BLOCK] = cache.get(x..x + BLOCK)?.try_into().ok()?;
            Some((words, colours, cache))
        });
        match block {
            Some(block) => {
                B::unpack(block, row, at);
                if let Some(fit) = &mut fit {
                    fit.unpack::<B::Floats>(slot, block.0, block.2, row, at);
                }
            }
            None => {
                let channels = row.0.iter_mut();
                channels.for_each(|channel| channel[at..at + BLOCK].fill(0.0));
                if let Some(fit) = &mut fit {
                    fit.clear(slot, at);
                }
            }
        }
    }
}

/// The pixels of one word from some bits on; `word` counts from the guard, `i` from the word before the tile.
#[inline(always)]
fn word_of_means<B: Blocks>(
    source: Source<'_>,
    windows: &Windows<'_>,
    shifts: std::ops::Range<usize>,
    (word, y): (usize, usize),
    (i, mut fit): (usize, Option<&mut FitScratch>),
    band: &mut PictureBand<'_>,
) {
    let class = source.classes.row(y as isize);
    let own = class.plane(HAS_SAMPLE)[word] & (class.plane(USABLE)[word] | class.plane(COMPLEX)[word]);
    let mut coloured = 0u64;
    // Weight of a pixel without a sample of its own whose other 24 are all there, to the priority 1.
    let scale = 253.0 / (1.0 - source.kernel.weight(0, 0));
    let shown = (band.first_row..band.end_row).contains(&y) && shifts.len() == 64;
    let mut unshown = [0; BLOCK];
    let mut inverse = [0.0; BLOCK];
    for shift in shifts.step_by(BLOCK) {
        let at = MARGIN + 64 * i + shift - 64;
        let sums = if (windows.near >> shift) as u16 == 0 {
            B::across(windows.down, at, source.kernel.taps)
        } else {
            B::masked(windows.rows, at, windows.masks, shift, &source.kernel)
        };
        let start = y
            .wrapping_sub(band.first_row)
            .wrapping_mul(band.stride)
            .wrapping_add((word - 1) * 64 + shift);
        let priority = if shown {
            block_mut(band.priority, start)
        } else {
            &mut unshown
        };
        let own = (own >> shift) as u16;
        let bits = match &mut fit {
            Some(fit) => {
                let means = &mut fit.means[windows.slots[2]];
                let out = Output {
                    red: block_mut(&mut means.red, at),
                    green: block_mut(&mut means.green, at),
                    blue: block_mut(&mut means.blue, at),
                    priority,
                    inverse: &mut inverse,
                };
                let bits = B::finish(sums, own, out, scale, source.fallback);
                fit.place_means::<B::Floats>(windows, &inverse, at, shift, &source.kernel);
                bits
            }
            None => {
                let out = Output {
                    red: block_mut(band.red, start),
                    green: block_mut(band.green, start),
                    blue: block_mut(band.blue, start),
                    priority,
                    inverse: &mut inverse,
                };
                B::finish(sums, own, out, scale, source.fallback)
            }
        };
        coloured |= u64::from(bits) << shift;
    }
    if word == source.classes.words {
        coloured &= !outside_of_last_word(source.pixels.width);
    }
    if let Some(fit) = &mut fit {
        fit.means[windows.slots[2]].set_usable(i, coloured, class.plane(COMPLEX)[word]);
    }
    if shown {
        band.coloured.row_mut(y - band.first_row)[word] = coloured;
    }
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
    widened(column)
}

/// The bits of pixels of the middle word of three that are set, or have one set up to two beside them.
#[inline(always)]
pub(crate) fn widened([left, here, right]: [u64; 3]) -> u64 {
    here | here << 1 | here << 2 | here >> 1 | here >> 2 | left >> 63 | left >> 62 | right << 63 | right << 62
}

/// For each tap of the window the bits of the pixels that use it.
///
/// A neighbour counts if it is in reach and its sample can be used; a complex pixel takes every sample (BWG03 section 5.4).
#[inline(always)]
fn tap_masks(source: Source<'_>, at: usize, y: usize) -> TapMasks {
    let class = |dy: isize| source.classes.row(y as isize + dy);
    let mut masks = [0; 25];
    masks[12] = class(0).plane(USABLE)[at];
    for (plane, (dx, dy)) in FORWARD.into_iter().enumerate() {
        let forward = source.reach.row(y as isize).plane(plane)[at];
        let usable = u64::load_beside(class(dy).plane(USABLE), at, dx);
        masks[13 + plane] = forward & usable;
        // The opposite neighbour holds the bit of the pair.
        let backward = u64::load_beside(source.reach.row(y as isize - dy).plane(plane), at, -dx);
        let usable = u64::load_beside(class(-dy).plane(USABLE), at, -dx);
        masks[11 - plane] = backward & usable;
    }
    let complex = class(0).plane(COMPLEX)[at];
    if complex != 0 {
        for (tap, mask) in masks.iter_mut().enumerate() {
            let (dx, dy) = (tap as isize % 5 - 2, tap as isize / 5 - 2);
            *mask |= complex & u64::load_beside(class(dy).plane(HAS_SAMPLE), at, dx);
        }
    }
    masks
}

/// One of the same masks.
#[inline(always)]
pub(crate) fn tap_mask(source: Source<'_>, at: usize, y: usize, tap: u8) -> u64 {
    let (dx, dy) = (tap as isize % 5 - 2, tap as isize / 5 - 2);
    let (here, there) = (
        source.classes.row(y as isize),
        source.classes.row(y as isize + dy),
    );
    let reach = |row: isize, plane: usize| source.reach.row(row).plane(plane);
    let mask = match tap {
        12 => here.plane(USABLE)[at],
        13.. => reach(y as isize, usize::from(tap) - 13)[at] & u64::load_beside(there.plane(USABLE), at, dx),
        // The opposite neighbour holds the bit of the pair.
        _ => {
            let backward = u64::load_beside(reach(y as isize + dy, 11 - usize::from(tap)), at, dx);
            backward & u64::load_beside(there.plane(USABLE), at, dx)
        }
    };
    mask | here.plane(COMPLEX)[at] & u64::load_beside(there.plane(HAS_SAMPLE), at, dx)
}

/// The bits of pixels with a sample at a tap, in reach or not.
#[inline(always)]
pub(crate) fn sample_mask(source: Source<'_>, at: usize, y: usize, tap: u8) -> u64 {
    let (dx, dy) = (tap as isize % 5 - 2, tap as isize / 5 - 2);
    let there = source.classes.row(y as isize + dy);
    u64::load_beside(there.plane(HAS_SAMPLE), at, dx)
}

/// The form that runs anywhere.
#[derive(Debug)]
pub(crate) struct Portable;

impl Blocks for Portable {
    type Sums = [[f32; BLOCK]; CHANNELS];
    type Floats = [f32; BLOCK];

    #[inline(always)]
    fn unpack((words, colours, cache): PackedBlock<'_>, row: &mut TileRow, at: usize) {
        let [red, green, blue, present] = &mut row.0;
        for i in 0..BLOCK {
            let colour = unpack_colour(Packed {
                coarse: colours[i],
                fine: cache[i] as u16,
            });
            red[at + i] = colour.x;
            green[at + i] = colour.y;
            blue[at + i] = colour.z;
            present[at + i] = f32::from(words[i] >> SAMPLE_SHIFT & 1);
        }
    }

    #[inline(always)]
    fn down(rows: [&TileRow; 5], at: usize, [centre, near, far]: [f32; 3], out: &mut TileRow) {
        for (channel, out) in out.0.iter_mut().enumerate() {
            let r = rows.map(|row| &row.0[channel][at..at + BLOCK]);
            for (i, out) in out[at..at + BLOCK].iter_mut().enumerate() {
                *out = centre * r[2][i] + near * (r[1][i] + r[3][i]) + far * (r[0][i] + r[4][i]);
            }
        }
    }

    #[inline(always)]
    fn across(row: &TileRow, at: usize, [centre, near, far]: [f32; 3]) -> Self::Sums {
        let mut sums = [[0.0; BLOCK]; CHANNELS];
        for (row, sums) in row.0.iter().zip(&mut sums) {
            let r = &row[at - 2..at + BLOCK + 2];
            for (i, sum) in sums.iter_mut().enumerate() {
                *sum = centre * r[i + 2] + near * (r[i + 1] + r[i + 3]) + far * (r[i] + r[i + 4]);
            }
        }
        sums
    }

    #[inline(always)]
    fn masked(rows: [&TileRow; 5], at: usize, masks: &TapMasks, shift: usize, kernel: &Kernel) -> Self::Sums {
        let add = |parts: &mut Self::Sums, (column, row): (usize, usize)| {
            let bits = (masks[5 * row + column] >> shift) as u16;
            let bit: [f32; BLOCK] = std::array::from_fn(|i| f32::from(bits >> i & 1));
            let [colours @ .., count] = parts;
            for (part, values) in colours.iter_mut().zip(&rows[row].0) {
                let values = &values[at + column - 2..][..BLOCK];
                for ((part, bit), value) in part.iter_mut().zip(&bit).zip(values) {
                    *part += bit * value;
                }
            }
            count.iter_mut().zip(&bit).for_each(|(count, bit)| *count += bit);
        };
        let weigh = |sums: &mut Self::Sums, weight: f32, parts: &Self::Sums| {
            for (sum, part) in sums.as_flattened_mut().iter_mut().zip(parts.as_flattened()) {
                *sum += weight * part;
            }
        };
        let nothing = [[0.0; BLOCK]; CHANNELS];
        let (mut sums, mut centre) = (nothing, nothing);
        add(&mut centre, (2, 2));
        weigh(&mut sums, kernel.weight(0, 0), &centre);
        for pair in &TAP_GROUPS {
            for (group, weight) in pair.iter().zip(group_weights(kernel, pair)) {
                let mut parts = nothing;
                group.iter().for_each(|&tap| add(&mut parts, tap));
                weigh(&mut sums, weight, &parts);
            }
        }
        sums
    }

    #[inline(always)]
    fn finish(sums: Self::Sums, own: u16, out: Output<'_>, scale: f32, fallback: [f32; 3]) -> u16 {
        let [red, green, blue, weight] = &sums;
        let mut coloured = 0;
        for i in 0..BLOCK {
            if weight[i] > 0.0 {
                let inverse = 1.0 / weight[i];
                out.inverse[i] = inverse;
                out.red[i] = red[i] * inverse;
                out.green[i] = green[i] * inverse;
                out.blue[i] = blue[i] * inverse;
                let priority = (254.0 - scale * weight[i]).max(1.0) as u8;
                out.priority[i] = if own >> i & 1 != 0 { 0 } else { priority };
                coloured |= 1 << i;
            } else {
                (out.red[i], out.green[i], out.blue[i]) = fallback.into();
                out.priority[i] = UNREACHED;
                out.inverse[i] = f32::INFINITY;
            }
        }
        coloured
    }
}
