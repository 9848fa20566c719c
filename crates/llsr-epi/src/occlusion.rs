//! Conservative depth limits from the samples, to cull hidden edges (BWG03 section 4.5).

use crate::colour::unpack_depth;
use crate::image::EdgePointImage;
use crate::pixels::{Pixels, SAMPLE_SHIFT};

/// How careful occlusion culling is.
///
/// An edge is hidden where its depth exceeds the largest depth of the samples in the 4x4 pixels around, times
/// `1 + slack + sparse_slack * (16 / n - 1)` with n the number of those samples. Without any sample nothing is hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occlusion {
    /// Relative offset where every pixel has a sample; not negative.
    pub slack: f32,
    /// Growth of the offset as samples get sparse; not negative.
    pub sparse_slack: f32,
}

impl Default for Occlusion {
    /// 1% at full density, 16% for a single sample.
    fn default() -> Self {
        Self {
            slack: 0.01,
            sparse_slack: 0.01,
        }
    }
}

/// Rows and columns of pixels in a cell of [`EdgePointImage::bound_depths`].
pub const CELL: usize = 4;

/// Rows and columns of pixels that share a limit.
pub(crate) const SHARED: usize = 2;

/// For each 2x2 pixels the depth key beyond which edges in them are hidden: half a byte a pixel.
///
/// The window of 4x4 pixels lies evenly about the 2x2. A key is the upper half of a float: keys are not positive, so that what
/// is cut off moves the limit away from the eye, by less than 1%.
#[derive(Clone, Debug)]
pub(crate) struct DepthLimits {
    columns: usize,
    keys: Vec<u16>,
    /// Columns of cells of 4x4 pixels.
    cells: usize,
    /// A bound for each cell in the form of a key, 0 for none; no cells at all where no bounds were given.
    bounds: Vec<u16>,
}

/// Scratch memory of one worker: largest depth code and number of samples in four rows, with padding.
#[derive(Clone, Debug, Default)]
pub(crate) struct LimitScratch {
    depth: Vec<u16>,
    count: Vec<u16>,
}

impl DepthLimits {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let columns = width.div_ceil(SHARED);
        Self {
            columns,
            keys: vec![0; columns * height.div_ceil(SHARED)],
            cells: width.div_ceil(CELL),
            bounds: Vec::new(),
        }
    }

    /// Takes depths over as keys.
    fn bound(&mut self, depths: &[f32]) {
        self.bounds.clear();
        self.bounds.extend(depths.iter().map(|&depth| {
            let key = if depth > 0.0 { -1.0 / depth } else { 0.0 };
            (key.to_bits() >> 16) as u16
        }));
    }

    /// Splits the limits into bands of `rows` rows of pixels, which must be even.
    pub(crate) fn bands_mut(&mut self, rows: usize) -> impl Iterator<Item = BandLimits<'_>> {
        let (columns, cells) = (self.columns, self.cells);
        let rows = rows / SHARED;
        let bounds = &self.bounds[..];
        let bands = self.keys.chunks_mut(rows * columns).enumerate();
        bands.map(move |(i, keys)| BandLimits {
            columns,
            first: i * rows,
            keys,
            cells,
            bounds,
        })
    }
}

impl EdgePointImage {
    /// Says from elsewhere how far one sees: edges behind these depths are left out by the next
    /// [`rasterize`](Self::rasterize) with an [`Occlusion`], whatever the samples say.
    ///
    /// `depths` holds one depth for each cell of 4x4 pixels, row by row, as many as cover the picture; an infinite one
    /// says nothing. Without any, as in the beginning, there are no bounds.
    ///
    /// # Panics
    /// If there are neither none nor as many as cells.
    pub fn bound_depths(&mut self, depths: &[f32]) {
        let cells = self.pixels.width.div_ceil(CELL) * self.pixels.height.div_ceil(CELL);
        assert!(
            depths.is_empty() || depths.len() == cells,
            "{} depths for {cells} cells",
            depths.len()
        );
        self.limits.bound(depths);
    }
}

/// The limits of some rows.
#[derive(Debug)]
pub(crate) struct BandLimits<'a> {
    columns: usize,
    /// First row of limits.
    first: usize,
    keys: &'a mut [u16],
    cells: usize,
    bounds: &'a [u16],
}

impl BandLimits<'_> {
    /// Columns of limits, and the upper halves of their keys row by row.
    pub(crate) fn columns_and_keys(&self) -> (usize, &[u16]) {
        (self.columns, self.keys)
    }

    /// The limit at a pixel of the band; at the lower border of the picture that of the last row.
    #[inline(always)]
    pub(crate) fn at(&self, x: usize, y: usize) -> f32 {
        let index = (y / SHARED - self.first) * self.columns + x / SHARED;
        // Only the lower border, one row beyond, leaves the band.
        let key = match self.keys.get(index) {
            Some(&key) => key,
            None => self.keys[index - self.columns],
        };
        f32::from_bits(u32::from(key) << 16)
    }

    /// Works the limits out anew.
    #[inline(always)]
    pub(crate) fn update(&mut self, pixels: &Pixels, occlusion: Occlusion, scratch: &mut LimitScratch) {
        let sparse = occlusion.sparse_slack.max(0.0);
        let base = 1.0 + occlusion.slack.max(0.0) - sparse;
        let len = SHARED * self.columns + 2;
        for (i, keys) in self.keys.chunks_exact_mut(self.columns).enumerate() {
            let row = SHARED * (self.first + i);
            scratch.load(pixels, row.saturating_sub(1)..(row + 3).min(pixels.height), len);
            let (depths, counts) = (&scratch.depth[..len], &scratch.count[..len]);
            for (x, key) in keys.iter_mut().enumerate() {
                let at = SHARED * x;
                let depth = depths[at]
                    .max(depths[at + 1])
                    .max(depths[at + 2])
                    .max(depths[at + 3]);
                let count = counts[at] + counts[at + 1] + counts[at + 2] + counts[at + 3];
                let count = f32::from(count);
                // -1 / (depth * (base + 16 * sparse / count)).
                let limit = -count / (unpack_depth(depth) * (base * count + 16.0 * sparse));
                let limit = if count == 0.0 { f32::INFINITY } else { limit };
                *key = (limit.to_bits() >> 16) as u16;
            }
            let Some(bounds) = self.bounds.get(row / CELL * self.cells..) else {
                continue;
            };
            // Keys of numbers that are not positive grow towards the eye; without a limit the key is below them all. Two keys at a time, so
            // that many are done at once; the last column may have but one.
            let (pairs, last) = keys.as_chunks_mut::<{ CELL / SHARED }>();
            for ([left, right], &bound) in pairs.iter_mut().zip(bounds) {
                *left = (*left).max(bound);
                *right = (*right).max(bound);
            }
            if let (Some(key), Some(&bound)) = (last.first_mut(), bounds.get(self.columns / 2)) {
                *key = (*key).max(bound);
            }
        }
    }
}

impl LimitScratch {
    /// Takes the largest depth and the number of samples of each column in some rows; entry x + 1 stands for column x.
    #[inline(always)]
    fn load(&mut self, pixels: &Pixels, rows: std::ops::Range<usize>, len: usize) {
        for plane in [&mut self.depth, &mut self.count] {
            plane.clear();
            plane.resize(len, 0);
        }
        let width = pixels.width;
        let depths = &mut self.depth[1..width + 1];
        let counts = &mut self.count[1..width + 1];
        for y in rows {
            let start = y * pixels.stride;
            let words = &pixels.words[start..start + width];
            let cache = &pixels.cache[start..start + width];
            for x in 0..width {
                // The cache word of a pixel without a sample is 0.
                depths[x] = depths[x].max((cache[x] >> 16) as u16);
                counts[x] += words[x] >> SAMPLE_SHIFT & 1;
            }
        }
    }
}
