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

/// Largest depth code and number of samples of each column in some rows, with padding: entry x + 1 stands for column x.
#[derive(Clone, Debug, Default)]
struct Columns {
    depth: Vec<u16>,
    count: Vec<u16>,
}

/// Scratch memory of one worker: the two upper rows of a window, the two lower ones, which are the upper ones of the next, and all four.
#[derive(Clone, Debug, Default)]
pub(crate) struct LimitScratch {
    upper: Columns,
    lower: Columns,
    all: Columns,
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
    #[cfg(target_arch = "x86_64")]
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
        let LimitScratch { upper, lower, all } = scratch;
        for columns in [&mut *upper, &mut *lower, &mut *all] {
            columns.prepare(len);
        }
        let first = SHARED * self.first;
        upper.load(pixels, first.saturating_sub(1)..first + 1);
        for (i, keys) in self.keys.chunks_exact_mut(self.columns).enumerate() {
            let row = SHARED * (self.first + i);
            lower.load(pixels, (row + 1).min(pixels.height)..(row + 3).min(pixels.height));
            all.join(upper, lower);
            std::mem::swap(upper, lower);
            let (depths, counts) = (&all.depth[..len], &all.count[..len]);
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

impl Columns {
    fn prepare(&mut self, len: usize) {
        for plane in [&mut self.depth, &mut self.count] {
            plane.clear();
            plane.resize(len, 0);
        }
    }

    /// Takes those of at most two rows.
    #[inline(always)]
    fn load(&mut self, pixels: &Pixels, mut rows: std::ops::Range<usize>) {
        let width = pixels.width;
        let depths = &mut self.depth[1..width + 1];
        let counts = &mut self.count[1..width + 1];
        let row = |y: usize| {
            let start = y * pixels.stride;
            (
                &pixels.words[start..start + width],
                &pixels.cache[start..start + width],
            )
        };
        // The cache word of a pixel without a sample is 0.
        let Some(y) = rows.next() else {
            depths.fill(0);
            counts.fill(0);
            return;
        };
        let (words, cache) = row(y);
        for x in 0..width {
            depths[x] = (cache[x] >> 16) as u16;
            counts[x] = words[x] >> SAMPLE_SHIFT & 1;
        }
        for y in rows {
            let (words, cache) = row(y);
            for x in 0..width {
                depths[x] = depths[x].max((cache[x] >> 16) as u16);
                counts[x] += words[x] >> SAMPLE_SHIFT & 1;
            }
        }
    }

    /// Makes these the columns of the rows of both.
    #[inline(always)]
    fn join(&mut self, a: &Self, b: &Self) {
        let len = self.depth.len();
        let (depths, counts) = (&mut self.depth[..len], &mut self.count[..len]);
        let (a, b) = (
            (&a.depth[..len], &a.count[..len]),
            (&b.depth[..len], &b.count[..len]),
        );
        for x in 0..len {
            depths[x] = a.0[x].max(b.0[x]);
            counts[x] = a.1[x] + b.1[x];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EdgePointImage, Point, Settings};

    #[test]
    fn limits_are_those_of_the_window_around() {
        // By the definition, pixel by pixel, for sizes that are no multiple of anything and for bands.
        let occlusion = Occlusion {
            slack: 0.03,
            sparse_slack: 0.02,
        };
        let mut state = 3u32;
        let mut unit = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1u32 << 24) as f32
        };
        let mut hidden = 0;
        for (width, height) in [(1u32, 1u32), (2, 3), (37, 18), (70, 31), (129, 8)] {
            let mut image = EdgePointImage::new(width, height, Settings::default()).expect("size");
            for i in 0..width * height {
                if unit() < 0.3 {
                    image.insert(&Point {
                        position: glam::Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5),
                        depth: if unit() < 0.1 { f32::INFINITY } else { 0.1 + unit() },
                        colour: glam::Vec3::ONE,
                    });
                }
            }
            let cells = (width.div_ceil(4) * height.div_ceil(4)) as usize;
            let bounds: Vec<f32> = (0..cells)
                .map(|_| [f32::INFINITY, 0.3 + unit()][usize::from(unit() < 0.4)])
                .collect();
            image.bound_depths(&bounds);
            for rows in [height.next_multiple_of(2) as usize, 4] {
                let mut scratch = LimitScratch::default();
                for (i, mut band) in image.limits.bands_mut(rows).enumerate() {
                    band.update(&image.pixels, occlusion, &mut scratch);
                    for y in i * rows..((i + 1) * rows).min(height as usize) {
                        for x in 0..width as usize {
                            let (left, top) = (x as isize / 2 * 2 - 1, y as isize / 2 * 2 - 1);
                            let window = (0..16).map(|k| (left + k % 4, top + k / 4));
                            let inside = window.filter(|&(x, y)| {
                                x >= 0 && y >= 0 && x < width as isize && y < height as isize
                            });
                            let samples =
                                inside.filter_map(|(x, y)| image.pixels.sample(x as usize, y as usize));
                            let depths: Vec<f32> = samples.map(|sample| sample.depth).collect();
                            let far = depths.iter().fold(0.0, |far: f32, &depth| far.max(depth));
                            let sparse = occlusion.sparse_slack * (16.0 / depths.len() as f32 - 1.0);
                            let by_samples = match depths.len() {
                                0 => f32::INFINITY,
                                _ => far * (1.0 + occlusion.slack + sparse),
                            };
                            let bound = bounds[y / 4 * (width.div_ceil(4) as usize) + x / 4];
                            let expected = by_samples.min(bound);
                            let limit = band.at(x, y);
                            hidden += usize::from(expected < f32::INFINITY);
                            if expected == f32::INFINITY {
                                assert!(limit >= 0.0, "({x}, {y}) of {width}x{height}: {limit}");
                            } else {
                                // Cut off to the upper half of a float, away from the eye.
                                let ratio = -1.0 / limit / expected;
                                assert!(
                                    (0.999_99..1.01).contains(&ratio),
                                    "({x}, {y}) of {width}x{height}: {limit} for {expected}"
                                );
                            }
                        }
                    }
                }
            }
        }
        assert!(hidden > 3000, "only {hidden} pixels with a limit");
    }
}
