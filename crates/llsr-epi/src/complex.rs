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
use crate::classify::{CLASS_PLANES, COMPLEX, CROSSED};
use crate::classify::{decremented_bytes, nonzero_bytes};
use crate::colour::unpack_colour;
use crate::crossings::Crossings;
use crate::patch::Patches;
use crate::picture::Picture;
use crate::pixels::{POSITION_SHIFT, Pixels, SAMPLE};
use crate::planes::Planes;
use crate::tables;

/// Regions of the four cells in the middle: lane 2 * cell + region.
const LANES: usize = 8;
/// All cells.
const CELLS: u64 = 0x0000_3f3f_3f3f_3f3f;
/// Columns 0 to 4, whose cells have one to the right.
const NOT_LAST_COLUMN: u64 = 0x0000_1f1f_1f1f_1f1f;
/// Cells at the upper left corner of their pixel; shifted by 1, 8 and 9 the other three.
const UPPER_LEFT: u64 = 0x0000_0015_0015_0015;
/// The four cells in the middle, row by row.
const MIDDLE: [u32; 4] = [18, 19, 26, 27];
/// The 5x5 cells around each of them.
const WINDOWS: [u64; 4] = [0x1f_1f1f_1f1f, 0x3e_3e3e_3e3e, 0x1f1f_1f1f_1f00, 0x3e3e_3e3e_3e00];
/// Weight of the colour of each of the 3x3 pixels for each cell: falls by an eighth with the square of the distance, in pixels, from
/// the centre of the cell to that of the pixel. As peaked as the interpolation filter; the result hardly depends on it.
const WEIGHTS: [[f32; 4]; 9] = weights();

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
pub(crate) fn filter(
    source: Source<'_>,
    rows: std::ops::Range<usize>,
    factor: &impl Fn(u32, u32) -> Vec3,
    patches: &mut Patches,
) {
    for y in rows {
        let row = source.classes.row(y as isize);
        for word in 1..=source.classes.words {
            let mut complex = row.plane(COMPLEX)[word] & row.plane(CROSSED)[word];
            while complex != 0 {
                let x = (word - 1) * 64 + complex.trailing_zeros() as usize;
                complex &= complex - 1;
                if let Some(found) = pixel(source, x, y, factor) {
                    patches.push(y * source.pixels.stride + x, found);
                }
            }
        }
    }
}

/// The new colour of a complex pixel; none if it had none and reaches nothing.
#[inline(always)]
fn pixel(source: Source<'_>, x: usize, y: usize, factor: &impl Fn(u32, u32) -> Vec3) -> Option<Vec3> {
    let sides = Sides::around(source.crossings, x, y);
    let board = Board::new(&sides);
    let (starts, shares) = middle(&board, &sides);
    if starts.iter().all(|&start| start == 0) {
        return None;
    }
    let reached = spread(&board, &starts);
    let (lenders, colours) = lenders(source, &board, &sides, x, y, factor);
    let sums = gather(&reached, &lenders, &colours);

    let index = y * source.pixels.stride + x;
    let own = source
        .picture
        .coloured
        .row(y as isize)
        .bit(0, x as isize)
        .then(|| colour(source.picture, index));
    let (mut total, mut share) = (Vec3::ZERO, 0.0);
    let mut found = false;
    for lane in 0..LANES {
        let weight = sums[3][lane];
        if weight > 0.0 {
            let scale = shares[lane] / weight;
            total += Vec3::new(sums[0][lane], sums[1][lane], sums[2][lane]) * scale;
            share += shares[lane];
            found |= shares[lane] > 0.0;
        }
    }
    match own {
        // What is still complex or reaches nothing keeps the simple interpolation.
        Some(own) => found.then(|| total + own * (1.0 - share)),
        None => found.then(|| total / share),
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

    /// Half-pixel edge code of a simple cell, lower segment first: the primary region of the tables is then region A.
    #[inline(always)]
    fn code(&self, cell: u32) -> usize {
        let (row, column) = ((cell / 8) as usize, cell % 8);
        let top = self.horizontal[row] >> (4 * column) & 15;
        let bottom = self.horizontal[row + 1] >> (4 * column) & 15;
        let half = 4 * (row % 2);
        let side = |line: u32| (self.vertical[row / 2] >> (8 * line as usize + half) & 15) as u32;
        let mask = top | side(column + 1) << 4 | bottom << 8 | side(column) << 12;
        debug_assert_eq!(mask.count_ones(), 2, "a simple cell has two crossings");
        (mask.trailing_zeros() * 16 + 31 - mask.leading_zeros()) as usize
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
    fn new(sides: &Sides) -> Self {
        let (mut lines, mut lines_multiple) = (0u64, 0u64);
        for (line, &masks) in sides.horizontal.iter().enumerate() {
            let (crossed, multiple) = halves(masks);
            lines |= crossed << (8 * line);
            lines_multiple |= multiple << (8 * line);
        }
        let (top, bottom) = (lines & CELLS, lines >> 8 & CELLS);
        let mut multiple = (lines_multiple | lines_multiple >> 8) & CELLS;
        let (mut left, mut right) = (0u64, 0u64);
        for (row, &masks) in sides.vertical.iter().enumerate() {
            for half in 0..2 {
                let masks = masks >> (4 * half) & 0x0f0f_0f0f_0f0f_0f0f;
                let crossed = nonzero_bytes(masks);
                let several = nonzero_bytes(masks & decremented_bytes(masks));
                let place = 16 * row + 8 * half;
                left |= (crossed & 0x3f) << place;
                right |= (crossed >> 1) << place;
                multiple |= ((several | several >> 1) & 0x3f) << place;
            }
        }
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

/// For the six half bytes of three pixels: which have a bit set, and which more than one.
#[inline(always)]
fn halves(masks: u32) -> (u64, u64) {
    // Spread bytes to every other byte, then half bytes to bytes.
    let m = u64::from(masks & 0xff | (masks & 0xff00) << 8) | u64::from(masks & 0xff_0000) << 16;
    let m = (m | m << 4) & 0x0f0f_0f0f_0f0f_0f0f;
    (nonzero_bytes(m), nonzero_bytes(m & decremented_bytes(m)))
}

/// Start boards of the eight lanes and their shares of the pixel.
#[inline(always)]
fn middle(board: &Board, sides: &Sides) -> ([u64; LANES], [f32; LANES]) {
    let (mut starts, mut shares) = ([0; LANES], [0.0; LANES]);
    for (i, cell) in MIDDLE.into_iter().enumerate() {
        let bit = 1u64 << cell;
        if board.complex & bit != 0 {
            continue;
        }
        starts[2 * i] = bit;
        shares[2 * i] = 0.25;
        if board.simple & bit != 0 {
            starts[2 * i + 1] = bit;
            let a_share = f32::from(tables::HALF_AREA[sides.code(cell)]) / 512.0;
            shares[2 * i] = 0.25 * a_share;
            shares[2 * i + 1] = 0.25 * (1.0 - a_share);
        }
    }
    (starts, shares)
}

/// What the lanes reach: boards of regions A and B.
struct Reached {
    a: [u64; LANES],
    b: [u64; LANES],
}

/// Spreads from the starts over links that lead away from them, up to two cells in each direction.
#[inline(always)]
fn spread(board: &Board, starts: &[u64; LANES]) -> Reached {
    let mut reached = Reached {
        a: [0; LANES],
        b: [0; LANES],
    };
    let [raa, rab, rba, rbb] = board.right;
    let [daa, dab, dba, dbb] = board.down;
    for lane in 0..LANES {
        let window = WINDOWS[lane / 2];
        let (start_a, start_b) = if lane % 2 == 0 {
            (starts[lane], 0)
        } else {
            (0, starts[lane])
        };
        let (mut all_a, mut all_b) = (start_a, start_b);
        // Four quadrants; in each, four steps reach its far corner.
        for quadrant in 0..4 {
            let (mut a, mut b) = (start_a, start_b);
            for _ in 0..4 {
                let (beside_a, beside_b) = if quadrant & 1 == 0 {
                    ((a & raa | b & rba) << 1, (a & rab | b & rbb) << 1)
                } else {
                    // Backwards over the links: the cells whose link leads to a reached region.
                    let (a, b) = (a >> 1, b >> 1);
                    (a & raa | b & rab, a & rba | b & rbb)
                };
                let (beyond_a, beyond_b) = if quadrant & 2 == 0 {
                    ((a & daa | b & dba) << 8, (a & dab | b & dbb) << 8)
                } else {
                    let (a, b) = (a >> 8, b >> 8);
                    (a & daa | b & dab, a & dba | b & dbb)
                };
                a |= (beside_a | beyond_a) & window;
                b |= (beside_b | beyond_b) & window;
            }
            all_a |= a;
            all_b |= b;
        }
        reached.a[lane] = all_a;
        reached.b[lane] = all_b;
    }
    reached
}

/// Boards of the regions through which each of the 3x3 pixels lends its colour.
type Lenders = [(u64, u64); 9];

/// The cells and colours of the 3x3 pixels.
#[inline(always)]
fn lenders(
    source: Source<'_>,
    board: &Board,
    sides: &Sides,
    x: usize,
    y: usize,
    factor: &impl Fn(u32, u32) -> Vec3,
) -> (Lenders, [Vec3; 9]) {
    let Source { pixels, picture, .. } = source;
    let mut lenders = [(0, 0); 9];
    let mut colours = [Vec3::ZERO; 9];
    for (i, (lender, lent)) in lenders.iter_mut().zip(&mut colours).enumerate() {
        let (px, py) = ((x + i % 3).wrapping_sub(1), (y + i / 3).wrapping_sub(1));
        if px >= pixels.width || py >= pixels.height {
            continue;
        }
        let index = py * pixels.stride + px;
        let word = pixels.words[index];
        let first_cell = 16 * (i / 3) + 2 * (i % 3);
        let corners = tables::CORNERS[usize::from(word & crate::code::EdgeCode::BITS)];
        if corners != 0b1111 {
            if picture.coloured.row(py as isize).bit(0, px as isize) {
                // Cells at primary corners; the corners go round, the cells row by row.
                let c = u64::from(!corners);
                let cells = (c & 1 | c & 2 | (c & 8) << 5 | (c & 4) << 7) << first_cell;
                *lender = (cells & !board.outer_b, cells & board.outer_b);
                *lent = colour(picture, index);
            }
        } else if word & SAMPLE != 0 {
            let position = u32::from(word >> POSITION_SHIFT & 15);
            let (column, row) = (position % 4, position / 4);
            let cell = first_cell as u32 + 8 * (row / 2) + column / 2;
            *lender = sample_region(board, sides, cell, 2 * (row % 2) + column % 2);
            *lent = unpack_colour(pixels.colours[index]) * factor(px as u32, py as u32);
        }
    }
    (lenders, colours)
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

/// Weighted red, green, blue and weight of each lane.
#[inline(always)]
fn gather(reached: &Reached, lenders: &Lenders, colours: &[Vec3; 9]) -> [[f32; LANES]; 4] {
    let mut sums = [[0.0; LANES]; 4];
    for (i, (&(a, b), colour)) in lenders.iter().zip(colours).enumerate() {
        for lane in 0..LANES {
            let hit = reached.a[lane] & a | reached.b[lane] & b;
            let weight = if hit != 0 { WEIGHTS[i][lane / 2] } else { 0.0 };
            sums[0][lane] += weight * colour.x;
            sums[1][lane] += weight * colour.y;
            sums[2][lane] += weight * colour.z;
            sums[3][lane] += weight;
        }
    }
    sums
}

/// 8^-(squared distance), by the distances that occur: offsets of a quarter, three quarters and five quarters along each axis.
const fn weights() -> [[f32; 4]; 9] {
    // 8^-(1/16), 8^-(9/16), 8^-(25/16).
    const ALONG: [f32; 3] = [0.878_126_1, 0.310_464_45, 0.038_808_06];
    let mut weights = [[0.0; 4]; 9];
    let mut pixel = 0;
    while pixel < 9 {
        let mut cell = 0;
        while cell < 4 {
            let x = along(pixel % 3, cell % 2);
            let y = along(pixel / 3, cell / 2);
            weights[pixel][cell] = ALONG[x] * ALONG[y];
            cell += 1;
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
