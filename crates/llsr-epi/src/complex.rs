//! The filter for complex pixels: edges and reachability in quarters of a pixel (BWG03 section 5.4).
//!
//! The 3x3 pixels around a complex one are 6x6 *cells* of half a pixel. Their edges follow from the half-pixel
//! lines just as those of pixels from whole ones. They live in *boards*: bit 8 * row + column of a word. The pixel's own
//! four cells have up to eight regions; what each reaches is worked out side by side, in lanes.
//!
//! Where the paper interpolates samples only, a neighbouring pixel that is not complex lends its interpolated colour, through
//! the cells at the corners of its primary region: at low densities few of nine pixels have a sample, but nearly all have
//! a colour. A complex pixel's own sample counts where it lies.

use glam::Vec3;

use crate::antialias::colour;
use crate::board::{Board, CellSides, Sides};
use crate::classify::{self, CLASS_PLANES, COMPLEX, CORNER, CROSSED, HAS_SAMPLE, Masks};
use crate::crossings::Crossings;
use crate::lanes::Lanes;
use crate::patch::Patches;
use crate::picture::Picture;
use crate::pixels::{POSITION_SHIFT, Pixels};
use crate::planes::Planes;
use crate::tables;

/// Regions of the four cells in the middle: lane 2 * cell + region.
pub(crate) const LANES: usize = 8;
/// The four cells in the middle, row by row.
const MIDDLE: [u32; 4] = [18, 19, 26, 27];
const MIDDLE_CELLS: u64 = 0x0c0c_0000;
/// The 5x5 cells around that of each lane.
const WINDOWS: [u64; LANES] = {
    let [a, b, c, d] = [0x1f_1f1f_1f1f, 0x3e_3e3e_3e3e, 0x1f1f_1f1f_1f00, 0x3e3e_3e3e_3e00];
    [a, a, b, b, c, c, d, d]
};
/// Weight of the colour of each of the 3x3 pixels for each lane: falls by an eighth with the square of the distance, in pixels, from
/// the centre of the cell to that of the pixel. As peaked as the interpolation filter; the result hardly depends on it.
pub(crate) const WEIGHTS: [[f32; LANES]; 9] = weights();
/// The upper left cell of each of the 3x3 pixels, and the board of all four.
const UPPER_LEFT_CELLS: [u32; 9] = [0, 2, 4, 16, 18, 20, 32, 34, 36];
pub(crate) const BLOCKS: [u64; 9] = blocks();

/// The parts that SIMD modules replace.
pub(crate) trait Cells: Masks + Sized {
    /// What the lanes reach.
    type Reached: Copy;
    /// The cells that lend among those, for each lane.
    type Met: Copy;
    /// [`Sums`] where they are added up.
    type Sums: Copy;
    /// Which sides of the cells around a pixel are crossed.
    #[inline(always)]
    fn sides(crossings: &Crossings, x: usize, y: usize) -> Sides {
        Sides::around::<Self>(crossings, x, y)
    }
    /// Spreads from the starts over links that lead away from them, up to two cells in each direction. Even lanes start in region A,
    /// odd ones in region B.
    fn spread(board: &Board, starts: &[u64; LANES]) -> Self::Reached;
    /// Which of the lending regions (boards of A and B) are reached.
    fn meet(reached: Self::Reached, lending: (u64, u64)) -> Self::Met;
    /// Sums of nothing.
    fn nothing() -> Self::Sums;
    /// Adds the weighted colour and the weight of one of the 3x3 pixels (3 * row + column) to the sums of the lanes that reach what it
    /// lends; the colour may be anything if none does.
    fn lend(met: Self::Met, pixel: usize, colour: Vec3, sums: &mut Self::Sums);
    /// The sums.
    fn sums(sums: Self::Sums) -> Sums;
    /// The colours of the lanes, weighted with their shares of the pixel and added up, and the share of those that reach something.
    #[inline(always)]
    fn blend(sums: Self::Sums, shares: &[f32; LANES]) -> (Vec3, f32) {
        let sums = Self::sums(sums);
        // Without branches: which lanes reach something is hard to predict.
        let (mut scales, mut share) = ([0.0; LANES], 0.0);
        for (lane, scale) in scales.iter_mut().enumerate() {
            let weight = sums[3][lane];
            let reached = if weight > 0.0 { shares[lane] } else { 0.0 };
            *scale = reached / if weight > 0.0 { weight } else { 1.0 };
            share += reached;
        }
        let mut total = [0.0; 3];
        for (total, sums) in total.iter_mut().zip(&sums) {
            for (sum, scale) in sums.iter().zip(&scales) {
                *total += sum * scale;
            }
        }
        (Vec3::from_array(total), share)
    }
}

/// Weighted red, green, blue and weight of each lane.
pub(crate) type Sums = [[f32; LANES]; 4];

/// What complex filtering reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'a> {
    pub(crate) crossings: &'a Crossings,
    pub(crate) pixels: &'a Pixels,
    pub(crate) classes: &'a Planes<CLASS_PLANES>,
    pub(crate) picture: &'a Picture,
}

/// Filters the complex pixels of some rows. `factor(x, y)` takes the colour of the sample in (x, y) to that of the picture.
#[inline(always)]
pub(crate) fn filter<C: Cells, F: Fn(u32, u32) -> Vec3>(
    source: Source<'_>,
    rows: std::ops::Range<usize>,
    factor: &F,
    patches: &mut Patches,
) {
    for y in rows {
        let row = source.classes.row(y as isize);
        for word in 1..=source.classes.words {
            let mut complex = row.plane(COMPLEX)[word] & row.plane(CROSSED)[word];
            if complex == 0 {
                continue;
            }
            let lenders = Lenders::around(source, word, y);
            while complex != 0 {
                let bit = complex.trailing_zeros();
                complex &= complex - 1;
                let x = (word - 1) * 64 + bit as usize;
                if let Some(found) = pixel::<C>(source, (x, y), &lenders, bit, factor) {
                    patches.push(y * source.pixels.stride + x, found);
                }
            }
        }
    }
}

/// The bits of pixels -1 to 62 of a word and, in a second one, of 63 and 64.
type Around = [u64; 2];

/// What is lent around the pixels of a word, for each of three rows.
struct Lenders {
    /// Pixels that lend their colour, through the cells at each corner (top left, top right, bottom right, bottom left).
    corners: [[Around; 4]; 3],
    /// Complex ones that lend that of their sample.
    samples: [Around; 3],
    /// The pixels of the word that have a colour.
    coloured: u64,
}

impl Lenders {
    #[inline(always)]
    fn around(source: Source<'_>, word: usize, y: usize) -> Self {
        let mut lenders = Self {
            corners: [[[0; 2]; 4]; 3],
            samples: [[0; 2]; 3],
            coloured: source.picture.coloured.row(y as isize).plane(0)[word],
        };
        for row in 0..3 {
            let class = source.classes.row((y + row) as isize - 1);
            let coloured = source.picture.coloured.row((y + row) as isize - 1).plane(0);
            let complex = class.plane(COMPLEX);
            for (corner, around) in lenders.corners[row].iter_mut().enumerate() {
                let secondary = class.plane(CORNER + corner);
                *around = shifted(word, |at| coloured[at] & !complex[at] & !secondary[at]);
            }
            let sampled = class.plane(HAS_SAMPLE);
            lenders.samples[row] = shifted(word, |at| sampled[at] & complex[at]);
        }
        lenders
    }

    /// The cells through which the 3x3 pixels around that of a bit lend their colours.
    #[inline(always)]
    fn cells(&self, bit: u32) -> u64 {
        let mut cells = 0;
        for (row, corners) in self.corners.iter().enumerate() {
            for (corner, around) in corners.iter().enumerate() {
                let bits = u64::from(three(around, bit));
                // Every second column, and for the corners of the right or the lower cells one more. Not from a table: gathering is slow.
                let columns = bits & 1 | (bits & 2) << 1 | (bits & 4) << 2;
                cells |= columns << (16 * row + [0, 1, 9, 8][corner]);
            }
        }
        cells
    }

    /// Bit 3 * row + column of those of the 3x3 pixels around that of a bit that lend their samples.
    #[inline(always)]
    fn samples(&self, bit: u32) -> u32 {
        let [above, here, below] = &self.samples;
        three(above, bit) | three(here, bit) << 3 | three(below, bit) << 6
    }
}

#[inline(always)]
fn shifted(word: usize, bits: impl Fn(usize) -> u64) -> Around {
    let (before, here, after) = (bits(word - 1), bits(word), bits(word + 1));
    [here << 1 | before >> 63, here >> 63 | after << 1]
}

/// The bits before, at and after a bit.
#[inline(always)]
fn three([low, high]: &Around, bit: u32) -> u32 {
    // Two shifts, for one by 64 would be none.
    ((low >> bit | (high << 1) << (63 - bit)) & 7) as u32
}

/// The new colour of a complex pixel, which is that of a bit of the word of `lenders`; none if it had none and reaches nothing.
#[inline(always)]
fn pixel<C: Cells>(
    source: Source<'_>,
    (x, y): (usize, usize),
    lenders: &Lenders,
    bit: u32,
    factor: &impl Fn(u32, u32) -> Vec3,
) -> Option<Vec3> {
    let board = Board::new(&C::sides(source.crossings, x, y));
    // Where all four cells are complex there is nothing to start from.
    if board.complex & MIDDLE_CELLS == MIDDLE_CELLS {
        return None;
    }
    let (starts, shares) = middle(&board, &CellSides::of(source.crossings, x, y));
    let reached = C::spread(&board, &starts);
    let lent = (lenders.cells(bit), lenders.samples(bit));
    let sums = gather::<C>(source, &board, reached, (x, y), lent, factor);
    let index = y * source.pixels.stride + x;
    let own = (lenders.coloured >> bit & 1 != 0).then(|| colour(source.picture, index));
    let (total, share) = C::blend(sums, &shares);
    match own {
        _ if share == 0.0 => None,
        // What is still complex or reaches nothing keeps the simple interpolation.
        Some(own) => Some(total + own * (1.0 - share)),
        None => Some(total / share),
    }
}

/// Start boards of the eight lanes and their shares of the pixel.
#[inline(always)]
fn middle(board: &Board, sides: &CellSides) -> ([u64; LANES], [f32; LANES]) {
    let (mut starts, mut shares) = ([0; LANES], [0.0; LANES]);
    for (i, cell) in MIDDLE.into_iter().enumerate() {
        // Without branches, as above; the code of a cell that is not simple means nothing, and is not used.
        let simple = board.simple >> cell & 1;
        let free = !board.complex >> cell & 1;
        let area = f32::from(tables::HALF_AREA[sides.code(i % 2, i / 2)]) / 512.0;
        let a_share = if simple != 0 { area } else { 1.0 };
        starts[2 * i] = free << cell;
        starts[2 * i + 1] = simple << cell;
        shares[2 * i] = if free != 0 { 0.25 * a_share } else { 0.0 };
        shares[2 * i + 1] = 0.25 * (1.0 - a_share);
    }
    (starts, shares)
}

/// What the lanes reach: boards of regions A and B.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reached {
    pub(crate) a: [u64; LANES],
    pub(crate) b: [u64; LANES],
}

/// [`Cells::spread`] over words of some width.
#[inline(always)]
pub(crate) fn spread<W: Lanes>(board: &Board, starts: &[u64; LANES]) -> Reached {
    // Even lanes start in region A, odd ones in region B.
    let [a0, b0, a1, b1, a2, b2, a3, b3] = *starts;
    let starts = Reached {
        a: [a0, 0, a1, 0, a2, 0, a3, 0],
        b: [0, b0, 0, b1, 0, b2, 0, b3],
    };
    let mut reached = starts;
    let links = Links {
        right: board.right.map(W::splat),
        down: board.down.map(W::splat),
    };
    for lane in (0..LANES).step_by(W::WORDS) {
        let window = W::load(&WINDOWS, lane);
        let start = (W::load(&starts.a, lane), W::load(&starts.b, lane));
        let quadrants = [
            links.quadrant::<true, true>(start, window),
            links.quadrant::<true, false>(start, window),
            links.quadrant::<false, true>(start, window),
            links.quadrant::<false, false>(start, window),
        ];
        let [p, q, r, s] = quadrants;
        p.0.or(q.0).or(r.0.or(s.0)).store(&mut reached.a, lane);
        p.1.or(q.1).or(r.1.or(s.1)).store(&mut reached.b, lane);
    }
    reached
}

/// The links of a board, for all lanes: A to A, A to B, B to A, B to B.
struct Links<W> {
    right: [W; 4],
    down: [W; 4],
}

impl<W: Lanes> Links<W> {
    /// Regions A and B reached in one quadrant; four steps lead to its far corner.
    #[inline(always)]
    fn quadrant<const RIGHT: bool, const DOWN: bool>(&self, start: (W, W), window: W) -> (W, W) {
        let (mut a, mut b) = start;
        for _ in 0..4 {
            let beside = if RIGHT {
                let (a, b) = forward(&self.right, a, b);
                (a.up::<1>(), b.up::<1>())
            } else {
                backward(&self.right, a.down::<1>(), b.down::<1>())
            };
            let beyond = if DOWN {
                let (a, b) = forward(&self.down, a, b);
                (a.up::<8>(), b.up::<8>())
            } else {
                backward(&self.down, a.down::<8>(), b.down::<8>())
            };
            a = a.or(beside.0.or(beyond.0).and(window));
            b = b.or(beside.1.or(beyond.1).and(window));
        }
        (a, b)
    }
}

/// What the regions lead to over links, at the place of the cells that are left.
#[inline(always)]
fn forward<W: Lanes>([aa, ab, ba, bb]: &[W; 4], a: W, b: W) -> (W, W) {
    (a.and(*aa).or(b.and(*ba)), a.and(*ab).or(b.and(*bb)))
}

/// The regions from which links lead to regions a and b, all at the place of the cells that are reached.
#[inline(always)]
fn backward<W: Lanes>([aa, ab, ba, bb]: &[W; 4], a: W, b: W) -> (W, W) {
    (a.and(*aa).or(b.and(*ab)), a.and(*ba).or(b.and(*bb)))
}

/// Adds up what the 3x3 pixels around (x, y) lend to the lanes that reach it: colours through some cells, and the samples of some
/// complex ones (bit 3 * row + column).
#[inline(always)]
fn gather<C: Cells>(
    source: Source<'_>,
    board: &Board,
    reached: C::Reached,
    (x, y): (usize, usize),
    (cells, samples): (u64, u32),
    factor: &impl Fn(u32, u32) -> Vec3,
) -> C::Sums {
    let Source { pixels, picture, .. } = source;
    let stride = pixels.stride;
    let met = C::meet(reached, (cells & !board.outer_b, cells & board.outer_b));
    let mut sums = C::nothing();
    // The first pixel of each row; what lies outside the picture lends nothing.
    let first = [y.saturating_sub(1), y, (y + 1).min(picture.height - 1)].map(|y| y * stride + x);
    if x >= 1 && x + 1 < stride {
        let planes = [&picture.red, &picture.green, &picture.blue];
        for (row, first) in first.into_iter().enumerate() {
            let three = |plane: usize| planes[plane][first - 1..].first_chunk::<3>();
            let (Some(red), Some(green), Some(blue)) = (three(0), three(1), three(2)) else {
                unreachable!("the row has a pixel on either side")
            };
            for column in 0..3 {
                let colour = Vec3::new(red[column], green[column], blue[column]);
                C::lend(met, 3 * row + column, colour, &mut sums);
            }
        }
    } else {
        for (i, block) in BLOCKS.iter().enumerate() {
            if cells & block != 0 {
                C::lend(met, i, colour(picture, first[i / 3] + i % 3 - 1), &mut sums);
            }
        }
    }
    if samples != 0 {
        let index = |i: usize| (y + i / 3 - 1) * stride + x + i % 3 - 1;
        let place = |i: usize| {
            let position = u32::from(pixels.words[index(i)] >> POSITION_SHIFT & 15);
            (position % 4, position / 4)
        };
        let cell = |i: usize, (column, row): (u32, u32)| UPPER_LEFT_CELLS[i] + 8 * (row / 2) + column / 2;
        // Most lie in cells that are complex themselves, and lend nothing.
        let all = bits(samples).fold(0, |all, i| all | 1u64 << cell(i, place(i)));
        let usable = all & !board.complex;
        if usable == 0 {
            return sums;
        }
        let mut lending = (usable & !board.simple, 0);
        if usable & board.simple != 0 {
            for i in bits(samples) {
                let (column, row) = place(i);
                let bit = usable & board.simple & 1 << cell(i, (column, row));
                let sides = CellSides::of(source.crossings, x + i % 3 - 1, y + i / 3 - 1);
                let code = sides.code((column / 2) as usize, (row / 2) as usize);
                match tables::HALF_SIDE[code] >> (2 * (2 * (row % 2) + column % 2)) & 3 {
                    1 => lending.0 |= bit,
                    2 => lending.1 |= bit,
                    _ => {}
                }
            }
        }
        let met = C::meet(reached, lending);
        for i in bits(samples) {
            if (lending.0 | lending.1) & BLOCKS[i] != 0 {
                let factor = factor((x + i % 3 - 1) as u32, (y + i / 3 - 1) as u32);
                C::lend(met, i, pixels.colour(index(i)) * factor, &mut sums);
            }
        }
    }
    sums
}

/// The numbers of the bits that are set.
#[inline(always)]
fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        bit
    })
}

/// The form that runs anywhere.
impl Cells for classify::Portable {
    type Reached = Reached;
    type Met = [u64; LANES];
    type Sums = Sums;

    #[inline(always)]
    fn spread(board: &Board, starts: &[u64; LANES]) -> Reached {
        spread::<u64>(board, starts)
    }

    #[inline(always)]
    fn meet(reached: Reached, (a, b): (u64, u64)) -> [u64; LANES] {
        let mut met = [0; LANES];
        for ((met, in_a), in_b) in met.iter_mut().zip(reached.a).zip(reached.b) {
            *met = in_a & a | in_b & b;
        }
        met
    }

    #[inline(always)]
    fn nothing() -> Sums {
        [[0.0; LANES]; 4]
    }

    #[inline(always)]
    fn lend(met: [u64; LANES], pixel: usize, colour: Vec3, sums: &mut Sums) {
        for lane in 0..LANES {
            if met[lane] & BLOCKS[pixel] != 0 {
                let weight = WEIGHTS[pixel][lane];
                sums[0][lane] += weight * colour.x;
                sums[1][lane] += weight * colour.y;
                sums[2][lane] += weight * colour.z;
                sums[3][lane] += weight;
            }
        }
    }

    #[inline(always)]
    fn sums(sums: Sums) -> Sums {
        sums
    }
}

/// The four cells of each of the 3x3 pixels.
const fn blocks() -> [u64; 9] {
    let mut blocks = [0; 9];
    let mut pixel = 0;
    while pixel < 9 {
        blocks[pixel] = 0x0303 << UPPER_LEFT_CELLS[pixel];
        pixel += 1;
    }
    blocks
}

/// 8^-(squared distance), by the distances that occur: offsets of a quarter, three quarters and five quarters along each axis.
const fn weights() -> [[f32; LANES]; 9] {
    // 8^-(1/16), 8^-(9/16), 8^-(25/16).
    const ALONG: [f32; 3] = [0.878_126_1, 0.310_464_45, 0.038_808_06];
    let mut weights = [[0.0; LANES]; 9];
    let mut pixel = 0;
    while pixel < 9 {
        let mut lane = 0;
        while lane < LANES {
            let cell = lane / 2;
            let x = along(pixel % 3, cell % 2);
            let y = along(pixel / 3, cell / 2);
            weights[pixel][lane] = ALONG[x] * ALONG[y];
            lane += 1;
        }
        pixel += 1;
    }
    weights
}

/// Distance class between pixel column 0..3 and cell column 0..2 of the pixel in the middle.
const fn along(pixel: usize, cell: usize) -> usize {
    match (pixel, cell) {
        (1, _) => 0,
        (0, 0) | (2, 1) => 1,
        _ => 2,
    }
}
