//! Boards: the classes of the 6x6 half-pixel cells around a complex pixel, and what links them.

use crate::classify::Masks;
use crate::crossings::Crossings;

/// All cells.
pub(crate) const CELLS: u64 = 0x0000_3f3f_3f3f_3f3f;
/// Columns 0 to 4, whose cells have one to the right.
const NOT_LAST_COLUMN: u64 = 0x0000_1f1f_1f1f_1f1f;
/// Cells at the upper left corner of their pixel; shifted by 1, 8 and 9 the other three.
const UPPER_LEFT: u64 = 0x0000_0015_0015_0015;

/// Crossings of the sides of the 6x6 cells around a pixel, as bytes.
struct Window {
    /// Seven horizontal half-pixel lines from above row 0 to below row 5, each with the three pixels' masks, a byte each.
    horizontal: [u32; 7],
    /// For each of the three rows of pixels the seven vertical half-pixel lines, a byte each.
    vertical: [u64; 3],
    /// Board of cells outside the picture.
    outside: u64,
}

impl Window {
    #[inline(always)]
    fn around(crossings: &Crossings, x: usize, y: usize) -> Self {
        let (width, height) = (crossings.width, crossings.height);
        let mut window = Self {
            horizontal: [0; 7],
            vertical: [0; 3],
            outside: 0,
        };
        if x >= 1 && y >= 1 && x + 1 < width && y + 1 < height {
            let start = 2 * (y - 1) * crossings.stride + x - 1;
            for (line, masks) in window.horizontal.iter_mut().enumerate() {
                let at = start + line * crossings.stride;
                let three = &crossings.horizontal[at..at + 3];
                *masks = u32::from_le_bytes([three[0], three[1], three[2], 0]);
            }
            let pitch = crossings.stride + 1;
            let start = 2 * (y - 1) * pitch + x - 1;
            for (row, masks) in window.vertical.iter_mut().enumerate() {
                let at = start + 2 * row * pitch;
                let whole = &crossings.vertical[at..at + 4];
                let half = &crossings.vertical[at + pitch..at + pitch + 3];
                *masks = u64::from_le_bytes([
                    whole[0], half[0], whole[1], half[1], whole[2], half[2], whole[3], 0,
                ]);
            }
            return window;
        }
        // At the border: pixel by pixel.
        for row in 0..3 {
            for column in 0..3 {
                let (px, py) = ((x + column).wrapping_sub(1), (y + row).wrapping_sub(1));
                if px >= width || py >= height {
                    window.outside |= 0x0303 << (16 * row + 2 * column);
                    continue;
                }
                let byte = |mask: u8, place: usize| u64::from(mask) << (8 * place);
                window.horizontal[2 * row] |= byte(crossings.above(py)[px], column) as u32;
                window.horizontal[2 * row + 1] |= byte(crossings.through(py)[px], column) as u32;
                window.horizontal[2 * row + 2] |= byte(crossings.above(py + 1)[px], column) as u32;
                window.vertical[row] |= byte(crossings.left(py)[px], 2 * column)
                    | byte(crossings.middle(py)[px], 2 * column + 1)
                    | byte(crossings.left(py)[px + 1], 2 * column + 2);
            }
        }
        window
    }
}

/// Which sides of the 6x6 cells around a pixel are crossed: bit 8 * line + column for horizontal lines, counted from above row 0,
/// bit 8 * row + line for vertical ones.
pub(crate) struct Sides {
    pub(crate) lines: u64,
    pub(crate) columns: u64,
    /// Those crossed more than once; bits of others may be missing or not.
    pub(crate) many_lines: u64,
    pub(crate) many_columns: u64,
    /// Board of cells outside the picture.
    pub(crate) outside: u64,
}

impl Sides {
    /// The form that runs anywhere, for any pixel of the picture.
    #[inline(always)]
    pub(crate) fn around<M: Masks>(crossings: &Crossings, x: usize, y: usize) -> Self {
        let window = Window::around(crossings, x, y);
        // The half bytes of each line, one to a byte, so that the masks of bytes come out as boards. Whether a half byte stays in the
        // upper half of its byte does not matter to the question how many bits are set.
        let (mut horizontal, mut vertical) = ([0; 64], [0; 64]);
        for (line, &masks) in window.horizontal.iter().enumerate() {
            let m = u64::from(masks & 0xff | (masks & 0xff00) << 8) | u64::from(masks & 0xff_0000) << 16;
            let halves = (m | m << 8) & 0xf00f_f00f_f00f;
            horizontal[8 * line..8 * line + 8].copy_from_slice(&halves.to_le_bytes());
        }
        for (row, &masks) in window.vertical.iter().enumerate() {
            let (upper, lower) = (masks & 0x000f_0f0f_0f0f_0f0f, masks & 0x00f0_f0f0_f0f0_f0f0);
            vertical[16 * row..16 * row + 8].copy_from_slice(&upper.to_le_bytes());
            vertical[16 * row + 8..16 * row + 16].copy_from_slice(&lower.to_le_bytes());
        }
        Self {
            lines: M::nonzero(&horizontal),
            columns: M::nonzero(&vertical),
            many_lines: M::multiple(&horizontal),
            many_columns: M::multiple(&vertical),
            outside: window.outside,
        }
    }
}

/// Crossings of the three horizontal and the three vertical half-pixel lines of one pixel.
pub(crate) struct CellSides {
    horizontal: [u8; 3],
    vertical: [u8; 3],
}

impl CellSides {
    #[inline(always)]
    pub(crate) fn of(crossings: &Crossings, x: usize, y: usize) -> Self {
        let left = crossings.left(y);
        Self {
            horizontal: [
                crossings.above(y)[x],
                crossings.through(y)[x],
                crossings.above(y + 1)[x],
            ],
            vertical: [left[x], crossings.middle(y)[x], left[x + 1]],
        }
    }

    /// Half-pixel edge code of a cell (column and row below 2) if it is simple, lower segment first: the primary region of the
    /// tables is then region A. Any number below 256 for other cells.
    #[inline(always)]
    pub(crate) fn code(&self, column: usize, row: usize) -> usize {
        let across = |line: u8| u32::from(line >> (4 * column) & 15);
        let along = |line: u8| u32::from(line >> (4 * row) & 15);
        let mask = across(self.horizontal[row])
            | along(self.vertical[column + 1]) << 4
            | across(self.horizontal[row + 1]) << 8
            | along(self.vertical[column]) << 12;
        // The added bits are beyond or at the ends of those of a simple cell, and keep both numbers in range for others. Exponents
        // of floats are had for several cells at once, counts of zeros are not.
        let lowest = mask | 1 << 15;
        let lowest = lowest & lowest.wrapping_neg();
        let exponent = |bits: u32| ((bits as f32).to_bits() >> 23) - 127;
        (exponent(lowest) * 16 + exponent(mask | 1)) as usize & 0xff
    }
}

/// The classes of the cells and the links between them. Region A of a cell holds its upper left corner, region B is the rest.
pub(crate) struct Board {
    pub(crate) simple: u64,
    pub(crate) complex: u64,
    /// Board of cells whose outer corner (the one they share with their pixel) is in region B.
    pub(crate) outer_b: u64,
    /// From a cell to the right neighbour: A to A, A to B, B to A, B to B.
    pub(crate) right: [u64; 4],
    /// From a cell to the one below.
    pub(crate) down: [u64; 4],
}

impl Board {
    #[inline(always)]
    pub(crate) fn new(sides: &Sides) -> Self {
        let &Sides {
            lines,
            columns,
            many_lines,
            many_columns,
            outside,
        } = sides;
        let (top, bottom) = (lines & CELLS, lines >> 8 & CELLS);
        let (left, right) = (columns & CELLS, columns >> 1 & CELLS);
        let multiple = (many_lines | many_lines >> 8 | many_columns | many_columns >> 1) & CELLS;
        let (low_a, high_a, low_b, high_b) = (top ^ right, top & right, bottom ^ left, bottom & left);
        let two = (high_a & !low_b & !high_b) | (high_b & !low_a & !high_a) | (low_a & low_b);
        let simple = two & !multiple;
        let complex = ((top | right | bottom | left) & !simple) | outside;

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
