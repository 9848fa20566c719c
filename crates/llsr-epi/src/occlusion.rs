//! Conservative depth limits from the samples, to cull hidden edges (BWG03 section 4.5).

use crate::colour::unpack_depth;
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

/// For each pixel the depth key beyond which edges at its upper and left boundary are hidden.
#[derive(Clone, Debug, Default)]
pub(crate) struct DepthLimits {
    width: usize,
    height: usize,
    keys: Vec<f32>,
    /// Scratch: for four rows, by their number modulo 4, the largest depth code and the number of samples in four columns.
    rows: [Row; 4],
    /// Scratch of one row with padding: depth codes and presence.
    padded: Row,
}

#[derive(Clone, Debug, Default)]
struct Row {
    depth: Vec<u16>,
    count: Vec<u16>,
}

impl Row {
    fn resize(&mut self, len: usize) {
        for plane in [&mut self.depth, &mut self.count] {
            plane.clear();
            plane.resize(len, 0);
        }
    }
}

impl DepthLimits {
    /// The limit at a boundary above or to the left of the pixel, or inside it; beyond the last row that of the last row.
    #[inline]
    pub(crate) fn at(&self, x: usize, y: usize) -> f32 {
        self.keys[y.min(self.height - 1) * self.width + x]
    }

    /// Works the limits out anew. Keeps its memory.
    ///
    /// The window of four by four pixels reaches two pixels to the left and up and one to the right and down: it lies
    /// evenly about the upper left corner, and so about the boundaries that the pixel owns.
    #[inline(always)]
    pub(crate) fn update(&mut self, pixels: &Pixels, occlusion: Occlusion) {
        let (width, height) = (pixels.width, pixels.height);
        (self.width, self.height) = (width, height);
        self.keys.resize(width * height, 0.0);
        self.rows.iter_mut().for_each(|row| row.resize(width));
        // Two columns of padding on the left, one on the right, all without samples.
        self.padded.resize(width + 3);
        let sparse = occlusion.sparse_slack.max(0.0);
        let base = 1.0 + occlusion.slack.max(0.0) - sparse;
        self.load(pixels, 0);
        for y in 0..height {
            self.load(pixels, y + 1);
            let [a, b, c, d] = &self.rows;
            let depths = [
                &a.depth[..width],
                &b.depth[..width],
                &c.depth[..width],
                &d.depth[..width],
            ];
            let counts = [
                &a.count[..width],
                &b.count[..width],
                &c.count[..width],
                &d.count[..width],
            ];
            for (x, key) in self.keys[y * width..][..width].iter_mut().enumerate() {
                let depth = depths[0][x].max(depths[1][x]).max(depths[2][x]).max(depths[3][x]);
                let count = f32::from(counts[0][x] + counts[1][x] + counts[2][x] + counts[3][x]);
                // -1 / (depth * (base + 16 * sparse / count)).
                let limit = -count / (unpack_depth(depth) * (base * count + 16.0 * sparse));
                *key = if count == 0.0 { f32::INFINITY } else { limit };
            }
        }
    }

    /// Filters row `y` across and puts it into its slot; a row below the picture has no samples.
    #[inline(always)]
    fn load(&mut self, pixels: &Pixels, y: usize) {
        let (width, start) = (pixels.width, y * pixels.stride);
        let row = &mut self.rows[y % 4];
        if y >= pixels.height {
            row.resize(width);
            return;
        }
        let (words, cache) = (
            &pixels.words[start..start + width],
            &pixels.cache[start..start + width],
        );
        let depth = &mut self.padded.depth[2..width + 2];
        for (depth, cache) in depth.iter_mut().zip(cache) {
            // The cache word of a pixel without a sample is 0.
            *depth = (cache >> 16) as u16;
        }
        let count = &mut self.padded.count[2..width + 2];
        for (count, word) in count.iter_mut().zip(words) {
            *count = word >> SAMPLE_SHIFT & 1;
        }
        let (d, c) = (&self.padded.depth[..width + 3], &self.padded.count[..width + 3]);
        for (x, (depth, count)) in row.depth[..width]
            .iter_mut()
            .zip(&mut row.count[..width])
            .enumerate()
        {
            *depth = d[x].max(d[x + 1]).max(d[x + 2]).max(d[x + 3]);
            *count = c[x] + c[x + 1] + c[x + 2] + c[x + 3];
        }
    }
}
