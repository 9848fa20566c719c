//! Rows of bit planes: one bit a pixel, 64 pixels a word, with guards all round.

/// Words of guard on each side of a row.
const GUARD: usize = 1;
/// Rows of guard above and below the picture: the reach of the 5x5 window.
const GUARD_ROWS: usize = 2;

/// `N` bit planes. A row holds its planes one after the other, so that a band of rows is one piece of memory.
#[derive(Clone, Debug)]
pub(crate) struct Planes<const N: usize> {
    /// Words of a row of one plane without the guards.
    pub(crate) words: usize,
    height: usize,
    bits: Vec<u64>,
}

impl<const N: usize> Planes<N> {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let words = width.div_ceil(64);
        Self {
            words,
            height,
            bits: vec![0; (height + 2 * GUARD_ROWS) * N * (words + 2 * GUARD)],
        }
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    fn row_len(&self) -> usize {
        N * (self.words + 2 * GUARD)
    }

    /// The planes of row `y`; two rows beyond the picture exist on either side and stay as they were made or filled.
    #[inline]
    pub(crate) fn row(&self, y: isize) -> PlaneRow<'_, N> {
        let start = (y + GUARD_ROWS as isize) as usize * self.row_len();
        PlaneRow {
            bits: &self.bits[start..start + self.row_len()],
        }
    }

    /// One bit, as [`PlaneRow::bit`] of [`row`](Self::row) gives it, for those who look at single pixels here and there.
    #[inline]
    pub(crate) fn bit(&self, plane: usize, x: isize, y: isize) -> bool {
        let row = (y + GUARD_ROWS as isize) as usize * self.row_len();
        let x = (x + 64) as usize;
        self.bits[row + plane * (self.words + 2 * GUARD) + x / 64] >> (x % 64) & 1 != 0
    }

    /// Sets the bit of a pixel of the picture.
    pub(crate) fn set(&mut self, plane: usize, x: usize, y: usize) {
        let start = (y + GUARD_ROWS) * self.row_len() + plane * (self.words + 2 * GUARD);
        self.bits[start + GUARD + x / 64] |= 1 << (x % 64);
    }

    /// Sets all bits of one plane outside the picture.
    pub(crate) fn fill_outside(&mut self, plane: usize, width: usize) {
        let (height, words, row_len) = (self.height, self.words, self.row_len());
        for (y, row) in self.bits.chunks_exact_mut(row_len).enumerate() {
            let plane = &mut row[plane * (words + 2)..][..words + 2];
            if y < GUARD_ROWS || y >= height + GUARD_ROWS {
                plane.fill(u64::MAX);
                continue;
            }
            plane[0] = u64::MAX;
            plane[words + 1] = u64::MAX;
            plane[words] |= outside_of_last_word(width);
        }
    }

    /// Splits the rows of the picture into bands.
    pub(crate) fn bands_mut(&mut self, rows: usize) -> impl Iterator<Item = BandPlanes<'_, N>> {
        let (row_len, height) = (self.row_len(), self.height);
        self.bits[GUARD_ROWS * row_len..(GUARD_ROWS + height) * row_len]
            .chunks_mut(rows.max(1) * row_len)
            .map(move |bits| BandPlanes { row_len, bits })
    }
}

/// The bits of the last word of a row that lie beyond the picture.
#[inline]
pub(crate) fn outside_of_last_word(width: usize) -> u64 {
    match width % 64 {
        0 => 0,
        rest => u64::MAX << rest,
    }
}

/// One row of all planes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneRow<'a, const N: usize> {
    bits: &'a [u64],
}

impl<'a, const N: usize> PlaneRow<'a, N> {
    /// A plane with one word of guard at each end: pixel x is bit x % 64 of word x / 64 + 1.
    #[inline]
    pub(crate) fn plane(self, plane: usize) -> &'a [u64] {
        let len = self.bits.len() / N;
        &self.bits[plane * len..(plane + 1) * len]
    }

    /// One bit; `x` may lie up to 64 pixels outside the picture.
    #[inline]
    pub(crate) fn bit(self, plane: usize, x: isize) -> bool {
        let x = (x + 64) as usize;
        self.plane(plane)[x / 64] >> (x % 64) & 1 != 0
    }
}

/// Rows of a band to write to.
#[derive(Debug)]
pub(crate) struct BandPlanes<'a, const N: usize> {
    row_len: usize,
    bits: &'a mut [u64],
}

impl<const N: usize> BandPlanes<'_, N> {
    /// Row `i` of the band, plane by plane, each with its guards.
    #[inline]
    pub(crate) fn row_mut(&mut self, i: usize) -> &mut [u64] {
        &mut self.bits[i * self.row_len..(i + 1) * self.row_len]
    }
}
