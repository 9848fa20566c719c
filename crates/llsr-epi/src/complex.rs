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
use crate::classify::{self, CLASS_PLANES, COMPLEX, CROSSED, HAS_SAMPLE, Masks};
use crate::code::EdgeCode;
use crate::crossings::Crossings;
use crate::lanes::Lanes;
use crate::patch::Patches;
use crate::picture::Picture;
use crate::pixels::{POSITION_SHIFT, Pixels};
use crate::planes::Planes;
use crate::tables;

/// Regions of the four cells in the middle: lane 2 * cell + region.
pub(crate) const LANES: usize = 8;
/// All cells.
const CELLS: u64 = 0x0000_3f3f_3f3f_3f3f;
/// Columns 0 to 4, whose cells have one to the right.
const NOT_LAST_COLUMN: u64 = 0x0000_1f1f_1f1f_1f1f;
/// Cells at the upper left corner of their pixel; shifted by 1, 8 and 9 the other three.
const UPPER_LEFT: u64 = 0x0000_0015_0015_0015;
/// The four cells in the middle, row by row.
const MIDDLE: [u32; 4] = [18, 19, 26, 27];
/// The 5x5 cells around that of each lane.
const WINDOWS: [u64; LANES] = {
    let [a, b, c, d] = [0x1f_1f1f_1f1f, 0x3e_3e3e_3e3e, 0x1f1f_1f1f_1f00, 0x3e3e_3e3e_3e00];
    [a, a, b, b, c, c, d, d]
};
/// Weight of the colour of each of the 3x3 pixels for each lane: falls by an eighth with the square of the distance, in pixels, from
/// the centre of the cell to that of the pixel. As peaked as the interpolation filter; the result hardly depends on it.
const WEIGHTS: [[f32; LANES]; 9] = weights();

/// The parts that SIMD modules replace.
pub(crate) trait Cells: Masks {
    /// Lanes side by side.
    type Lanes: Lanes;
    /// Adds a lender's weighted colour and weight to the sums (red, green, blue, weight) of the lanes that reach it.
    fn lend(reached: &Reached, lender: (u64, u64), colour: Vec3, weights: &[f32; LANES], sums: &mut Sums);
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
            while complex != 0 {
                let x = (word - 1) * 64 + complex.trailing_zeros() as usize;
                complex &= complex - 1;
                if let Some(found) = pixel::<C>(source, x, y, factor) {
                    patches.push(y * source.pixels.stride + x, found);
                }
            }
        }
    }
}

/// The new colour of a complex pixel; none if it had none and reaches nothing.
#[inline(always)]
fn pixel<C: Cells>(
    source: Source<'_>,
    x: usize,
    y: usize,
    factor: &impl Fn(u32, u32) -> Vec3,
) -> Option<Vec3> {
    let sides = Sides::around(source.crossings, x, y);
    let board = Board::new::<C>(&sides);
    let (starts, shares) = middle(&board, &sides);
    if starts.iter().all(|&start| start == 0) {
        return None;
    }
    let reached = spread::<C::Lanes>(&board, &starts);
    let sums = gather::<C>(source, &board, &sides, &reached, x, y, factor);

    let index = y * source.pixels.stride + x;
    let own = source
        .picture
        .coloured
        .row(y as isize)
        .bit(0, x as isize)
        .then(|| colour(source.picture, index));
    // Without branches: which lanes reach something is hard to predict.
    let (mut scales, mut share) = ([0.0; LANES], 0.0);
    for (lane, scale) in scales.iter_mut().enumerate() {
        let weight = sums[3][lane];
        let reached = if weight > 0.0 { shares[lane] } else { 0.0 };
        *scale = reached / if weight > 0.0 { weight } else { 1.0 };
        share += reached;
    }
    let total = [0, 1, 2].map(|channel| {
        (0..LANES)
            .map(|lane| sums[channel][lane] * scales[lane])
            .sum::<f32>()
    });
    let total = Vec3::from_array(total);
    match own {
        _ if share == 0.0 => None,
        // What is still complex or reaches nothing keeps the simple interpolation.
        Some(own) => Some(total + own * (1.0 - share)),
        None => Some(total / share),
    }
}

/// Crossings of the sides of the 6x6 cells.
struct Sides {
    /// Seven horizontal half-pixel lines from above row 0 to below row 5, each with the three pixels' masks, a byte each.
    horizontal: [u32; 7],
    /// For each of the three rows of pixels the seven vertical half-pixel lines, a byte each.
    vertical: [u64; 3],
    /// Boards of cells outside the picture.
    outside: u64,
}

impl Sides {
    #[inline(always)]
    fn around(crossings: &Crossings, x: usize, y: usize) -> Self {
        let (width, height) = (crossings.width, crossings.height);
        let mut sides = Self {
            horizontal: [0; 7],
            vertical: [0; 3],
            outside: 0,
        };
        if x >= 1 && y >= 1 && x + 1 < width && y + 1 < height {
            let start = 2 * (y - 1) * crossings.stride + x - 1;
            for (line, masks) in sides.horizontal.iter_mut().enumerate() {
                let at = start + line * crossings.stride;
                let three = &crossings.horizontal[at..at + 3];
                *masks = u32::from_le_bytes([three[0], three[1], three[2], 0]);
            }
            let pitch = crossings.stride + 1;
            let start = 2 * (y - 1) * pitch + x - 1;
            for (row, masks) in sides.vertical.iter_mut().enumerate() {
                let at = start + 2 * row * pitch;
                let whole = &crossings.vertical[at..at + 4];
                let half = &crossings.vertical[at + pitch..at + pitch + 3];
                *masks = u64::from_le_bytes([
                    whole[0], half[0], whole[1], half[1], whole[2], half[2], whole[3], 0,
                ]);
            }
            return sides;
        }
        // At the border: pixel by pixel.
        for row in 0..3 {
            for column in 0..3 {
                let (px, py) = ((x + column).wrapping_sub(1), (y + row).wrapping_sub(1));
                if px >= width || py >= height {
                    sides.outside |= 0x0303 << (16 * row + 2 * column);
                    continue;
                }
                let byte = |mask: u8, place: usize| u64::from(mask) << (8 * place);
                sides.horizontal[2 * row] |= byte(crossings.above(py)[px], column) as u32;
                sides.horizontal[2 * row + 1] |= byte(crossings.through(py)[px], column) as u32;
                sides.horizontal[2 * row + 2] |= byte(crossings.above(py + 1)[px], column) as u32;
                sides.vertical[row] |= byte(crossings.left(py)[px], 2 * column)
                    | byte(crossings.middle(py)[px], 2 * column + 1)
                    | byte(crossings.left(py)[px + 1], 2 * column + 2);
            }
        }
        sides
    }

    /// Half-pixel edge code of a simple cell, lower segment first: the primary region of the tables is then region A. Any
    /// number below 256 for other cells.
    #[inline(always)]
    fn code(&self, cell: u32) -> usize {
        let (row, column) = ((cell / 8) as usize, cell % 8);
        let top = self.horizontal[row] >> (4 * column) & 15;
        let bottom = self.horizontal[row + 1] >> (4 * column) & 15;
        let half = 4 * (row % 2);
        let side = |line: u32| (self.vertical[row / 2] >> (8 * line as usize + half) & 15) as u32;
        let mask = top | side(column + 1) << 4 | bottom << 8 | side(column) << 12;
        // The added bits are beyond or at the ends of those of a simple cell, and keep both numbers in range for others.
        let (first, second) = ((mask | 1 << 15).trailing_zeros(), 31 - (mask | 1).leading_zeros());
        (first * 16 + second) as usize
    }
}

/// The classes of the cells and the links between them. Region A of a cell holds its upper left corner, region B is the rest.
struct Board {
    simple: u64,
    complex: u64,
    /// Board of cells whose outer corner (the one they share with their pixel) is in region B.
    outer_b: u64,
    /// From a cell to the right neighbour: A to A, A to B, B to A, B to B.
    right: [u64; 4],
    /// From a cell to the one below.
    down: [u64; 4],
}

impl Board {
    #[inline(always)]
    fn new<M: Masks>(sides: &Sides) -> Self {
        // The half bytes of each line, one to a byte, so that the masks of bytes come out as boards. Whether a half byte stays in the
        // upper half of its byte does not matter to the question how many bits are set.
        let (mut horizontal, mut vertical) = ([0; 64], [0; 64]);
        for (line, &masks) in sides.horizontal.iter().enumerate() {
            let m = u64::from(masks & 0xff | (masks & 0xff00) << 8) | u64::from(masks & 0xff_0000) << 16;
            let halves = (m | m << 8) & 0xf00f_f00f_f00f;
            horizontal[8 * line..8 * line + 8].copy_from_slice(&halves.to_le_bytes());
        }
        for (row, &masks) in sides.vertical.iter().enumerate() {
            let (upper, lower) = (masks & 0x000f_0f0f_0f0f_0f0f, masks & 0x00f0_f0f0_f0f0_f0f0);
            vertical[16 * row..16 * row + 8].copy_from_slice(&upper.to_le_bytes());
            vertical[16 * row + 8..16 * row + 16].copy_from_slice(&lower.to_le_bytes());
        }
        let (lines, columns) = (M::nonzero(&horizontal), M::nonzero(&vertical));
        let (many_lines, many_columns) = (M::multiple(&horizontal), M::multiple(&vertical));
        let (top, bottom) = (lines & CELLS, lines >> 8 & CELLS);
        let (left, right) = (columns & CELLS, columns >> 1 & CELLS);
        let multiple = (many_lines | many_lines >> 8 | many_columns | many_columns >> 1) & CELLS;
        let (low_a, high_a, low_b, high_b) = (top ^ right, top & right, bottom ^ left, bottom & left);
        let two = (high_a & !low_b & !high_b) | (high_b & !low_a & !high_a) | (low_a & low_b);
        let simple = two & !multiple;
        let complex = ((top | right | bottom | left) & !simple) | sides.outside;

        // The corners of a cell that are in region B: walking round from the upper left one, each crossing changes the region.
        let upper_right = top & simple;
        let lower_right = (top ^ right) & simple;
        let lower_left = left & simple;
        let free = CELLS & !complex;
        let joined = free & free >> 1 & NOT_LAST_COLUMN;
        let b_lower = lower_left >> 1;
        let to_right = [
            joined & (!upper_right | !lower_right & !b_lower),
            joined & !lower_right & b_lower,
            joined & (upper_right | lower_right & !b_lower),
            joined & lower_right & b_lower,
        ];
        let joined = free & free >> 8;
        let b_right = upper_right >> 8;
        let to_below = [
            joined & (!lower_left | !lower_right & !b_right),
            joined & !lower_right & b_right,
            joined & (lower_left | lower_right & !b_right),
            joined & lower_right & b_right,
        ];
        let outer_b =
            upper_right & UPPER_LEFT << 1 | lower_right & UPPER_LEFT << 9 | lower_left & UPPER_LEFT << 8;
        Self {
            simple,
            complex,
            outer_b,
            right: to_right,
            down: to_below,
        }
    }
}

/// Start boards of the eight lanes and their shares of the pixel.
#[inline(always)]
fn middle(board: &Board, sides: &Sides) -> ([u64; LANES], [f32; LANES]) {
    let (mut starts, mut shares) = ([0; LANES], [0.0; LANES]);
    for (i, cell) in MIDDLE.into_iter().enumerate() {
        // Without branches, as above; the code of a cell that is not simple means nothing, and is not used.
        let simple = board.simple >> cell & 1;
        let free = !board.complex >> cell & 1;
        let area = f32::from(tables::HALF_AREA[sides.code(cell)]) / 512.0;
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

/// Spreads from the starts over links that lead away from them, up to two cells in each direction.
#[inline(always)]
fn spread<W: Lanes>(board: &Board, starts: &[u64; LANES]) -> Reached {
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

/// Adds up what the 3x3 pixels lend to the lanes that reach them.
#[inline(always)]
fn gather<C: Cells>(
    source: Source<'_>,
    board: &Board,
    sides: &Sides,
    reached: &Reached,
    x: usize,
    y: usize,
    factor: &impl Fn(u32, u32) -> Vec3,
) -> Sums {
    let Source {
        pixels,
        classes,
        picture,
        ..
    } = source;
    // Bits 3 * row + column of the pixels that lend their colour, and of the complex ones that lend a sample's.
    let (mut colours, mut samples) = (0u32, 0u32);
    for row in 0..3 {
        let class = classes.row((y + row) as isize - 1);
        let coloured = picture.coloured.row((y + row) as isize - 1).plane(0);
        let complex = three_bits(class.plane(COMPLEX), x);
        colours |= (three_bits(coloured, x) & !complex) << (3 * row);
        samples |= (three_bits(class.plane(HAS_SAMPLE), x) & complex) << (3 * row);
    }
    let mut sums = [[0.0; LANES]; 4];
    let (mut colours, mut samples) = (u64::from(colours), u64::from(samples));
    while colours != 0 {
        let i = colours.trailing_zeros() as usize;
        colours &= colours - 1;
        let index = (y + i / 3 - 1) * pixels.stride + x + i % 3 - 1;
        let code = usize::from(pixels.words[index] & EdgeCode::BITS);
        // The cells at primary corners; the corners go round, the cells row by row.
        let c = u64::from(!tables::CORNERS[code]);
        let cells = (c & 1 | c & 2 | (c & 8) << 5 | (c & 4) << 7) << (16 * (i / 3) + 2 * (i % 3));
        let lender = (cells & !board.outer_b, cells & board.outer_b);
        C::lend(reached, lender, colour(picture, index), &WEIGHTS[i], &mut sums);
    }
    while samples != 0 {
        let i = samples.trailing_zeros() as usize;
        samples &= samples - 1;
        let (px, py) = (x + i % 3 - 1, y + i / 3 - 1);
        let index = py * pixels.stride + px;
        let position = u32::from(pixels.words[index] >> POSITION_SHIFT & 15);
        let (column, row) = (position % 4, position / 4);
        let cell = (16 * (i / 3) + 2 * (i % 3)) as u32 + 8 * (row / 2) + column / 2;
        let lender = sample_region(board, sides, cell, 2 * (row % 2) + column % 2);
        let colour = pixels.colour(index) * factor(px as u32, py as u32);
        C::lend(reached, lender, colour, &WEIGHTS[i], &mut sums);
    }
    sums
}

/// The bits of pixels x - 1, x and x + 1 of a plane with guards.
#[inline(always)]
fn three_bits(plane: &[u64], x: usize) -> u32 {
    // Pixel x - 1 is bit x + 63 of the row, which begins with a guard word.
    let first = x + 63;
    let (word, bit) = (first / 64, first % 64);
    // The word beyond matters for the last two bits only; two shifts, for one by 64 would be none.
    let bits = plane[word] >> bit | (plane[word + 1] << 1) << (63 - bit);
    bits as u32 & 7
}

/// The region of a cell in which the sample at `position` (row * 2 + column) of it lies; none if complex or ambiguous.
#[inline(always)]
fn sample_region(board: &Board, sides: &Sides, cell: u32, position: u32) -> (u64, u64) {
    let bit = 1u64 << cell;
    if board.complex & bit != 0 {
        return (0, 0);
    }
    if board.simple & bit == 0 {
        return (bit, 0);
    }
    match tables::HALF_SIDE[sides.code(cell)] >> (2 * position) & 3 {
        1 => (bit, 0),
        2 => (0, bit),
        _ => (0, 0),
    }
}

/// The form that runs anywhere.
impl Cells for classify::Portable {
    type Lanes = u64;

    #[inline(always)]
    fn lend(reached: &Reached, (a, b): (u64, u64), colour: Vec3, weights: &[f32; LANES], sums: &mut Sums) {
        for lane in 0..LANES {
            let hit = reached.a[lane] & a | reached.b[lane] & b;
            let weight = if hit != 0 { weights[lane] } else { 0.0 };
            sums[0][lane] += weight * colour.x;
            sums[1][lane] += weight * colour.y;
            sums[2][lane] += weight * colour.z;
            sums[3][lane] += weight;
        }
    }
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
