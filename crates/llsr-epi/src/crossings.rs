//! Where edges cross the boundaries of pixels, to an eighth of a pixel.

/// Crossings of pixel boundaries and, for the complex filter, of the lines through the middle of the pixels.
///
/// Each boundary is kept once, as an 8-bit mask of its eighths, so that the two pixels beside it always agree: two bytes
/// a pixel, four with the half-pixel lines (BWG03 sections 4.5, 5.4, 7.4).
#[derive(Clone, Debug)]
pub(crate) struct Crossings {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Lines to a pixel: 1, or 2 with the half-pixel lines.
    pub(crate) lines: usize,
    /// Bytes from one horizontal line to the next; a multiple of 64, not less than the width.
    pub(crate) stride: usize,
    /// Horizontal lines from top to bottom, a mask for each pixel column; bit i: eighth i from the left.
    pub(crate) horizontal: Vec<u8>,
    /// For each row of pixels the whole-pixel vertical lines from left to right, one more than columns, then
    /// the half-pixel ones; bit i: eighth i from the top.
    pub(crate) vertical: Vec<u8>,
}

impl Crossings {
    pub(crate) fn new(width: usize, height: usize, half_lines: bool) -> Self {
        let lines = if half_lines { 2 } else { 1 };
        let stride = width.next_multiple_of(64);
        Self {
            width,
            height,
            lines,
            stride,
            horizontal: vec![0; (lines * height + 1) * stride],
            vertical: vec![0; lines * height * (stride + 1)],
        }
    }

    /// The horizontal line above row `y` (the lower border of the picture for `y` = height).
    #[inline]
    pub(crate) fn above(&self, y: usize) -> &[u8] {
        let start = y * self.lines * self.stride;
        &self.horizontal[start..start + self.stride]
    }

    /// The horizontal line through the middle of row `y`.
    #[inline]
    pub(crate) fn through(&self, y: usize) -> &[u8] {
        let start = (y * self.lines + 1) * self.stride;
        &self.horizontal[start..start + self.stride]
    }

    /// The left sides of the pixels of row `y`; entry x + 1 is the right side of pixel x.
    #[inline]
    pub(crate) fn left(&self, y: usize) -> &[u8] {
        let start = y * self.lines * (self.stride + 1);
        &self.vertical[start..start + self.stride + 1]
    }

    /// The vertical lines through the middle of the pixels of row `y`.
    #[inline]
    pub(crate) fn middle(&self, y: usize) -> &[u8] {
        let start = (y * self.lines + 1) * (self.stride + 1);
        &self.vertical[start..start + self.stride + 1]
    }

    /// Splits the crossings into bands of `rows` rows of pixels; the lower border goes with the last band.
    pub(crate) fn bands_mut(&mut self, rows: usize) -> impl Iterator<Item = BandCrossings<'_>> {
        let rows = rows.max(1);
        let (width, height, lines, stride) = (self.width, self.height, self.lines, self.stride);
        let mut horizontal = self.horizontal.as_mut_slice();
        let vertical = self.vertical.chunks_mut(rows * lines * (stride + 1));
        vertical.enumerate().map(move |(i, vertical)| {
            let first_row = i * rows;
            let end_row = (first_row + rows).min(height);
            let border = usize::from(end_row == height);
            let count = ((end_row - first_row) * lines + border) * stride;
            let band = horizontal.split_off_mut(..count).unwrap_or_default();
            BandCrossings {
                width,
                lines,
                stride,
                pitch: stride + 1,
                first_row,
                end_row,
                horizontal: band,
                vertical,
            }
        })
    }
}

/// The crossings of some rows, to write to.
#[derive(Debug)]
pub(crate) struct BandCrossings<'a> {
    pub(crate) width: usize,
    pub(crate) lines: usize,
    /// Bytes from one horizontal line to the next, and from one row of vertical lines to the next.
    pub(crate) stride: usize,
    pub(crate) pitch: usize,
    pub(crate) first_row: usize,
    pub(crate) end_row: usize,
    /// Horizontal lines of the rows, from the one above the first; in the last band also the lower border of the picture.
    pub(crate) horizontal: &'a mut [u8],
    pub(crate) vertical: &'a mut [u8],
}

impl BandCrossings<'_> {
    /// Number of horizontal lines.
    pub(crate) fn horizontal_lines(&self) -> usize {
        // Where half-pixel lines are left out, the border of the picture has no other line behind it.
        self.horizontal.len().div_ceil(self.stride)
    }

    /// The same without the half-pixel lines.
    pub(crate) fn whole_lines(self) -> Self {
        Self {
            stride: self.lines * self.stride,
            pitch: self.lines * self.pitch,
            lines: 1,
            ..self
        }
    }

    pub(crate) fn clear(&mut self) {
        self.horizontal.fill(0);
        self.vertical.fill(0);
    }
}
