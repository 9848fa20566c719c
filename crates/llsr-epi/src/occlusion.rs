//! Conservative depth limits from the samples, to cull hidden edges (BWG03 section 4.5).

use crate::colour::unpack_depth;
use crate::pixels::{Pixels, SAMPLE};

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
    /// Scratch of one row: largest depth code and number of samples in a column of four.
    column_depth: Vec<u16>,
    column_count: Vec<u16>,
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
    pub(crate) fn update(&mut self, pixels: &Pixels, occlusion: Occlusion) {
        let (width, height, stride) = (pixels.width, pixels.height, pixels.stride);
        (self.width, self.height) = (width, height);
        self.keys.clear();
        self.keys.resize(width * height, 0.0);
        // Two columns of padding on the left, one on the right, all without samples.
        self.column_depth.clear();
        self.column_depth.resize(width + 3, 0);
        self.column_count.clear();
        self.column_count.resize(width + 3, 0);
        let base = 1.0 + occlusion.slack.max(0.0) - occlusion.sparse_slack.max(0.0);
        let growth = 16.0 * occlusion.sparse_slack.max(0.0);
        for y in 0..height {
            self.column_depth.fill(0);
            self.column_count.fill(0);
            for row in y.saturating_sub(2)..(y + 2).min(height) {
                let words = &pixels.words[row * stride..][..width];
                let cache = &pixels.cache[row * stride..][..width];
                let depth = &mut self.column_depth[2..width + 2];
                let count = &mut self.column_count[2..width + 2];
                for x in 0..width {
                    // The cache word of a pixel without a sample is 0.
                    depth[x] = depth[x].max((cache[x] >> 16) as u16);
                    count[x] += (words[x] & SAMPLE) / SAMPLE;
                }
            }
            let (d, c) = (&self.column_depth[..width + 3], &self.column_count[..width + 3]);
            for (x, key) in self.keys[y * width..][..width].iter_mut().enumerate() {
                let depth = d[x].max(d[x + 1]).max(d[x + 2]).max(d[x + 3]);
                let count = c[x] + c[x + 1] + c[x + 2] + c[x + 3];
                let far = unpack_depth(depth) * (base + growth / f32::from(count));
                *key = if count == 0 { f32::INFINITY } else { -1.0 / far };
            }
        }
    }
}
