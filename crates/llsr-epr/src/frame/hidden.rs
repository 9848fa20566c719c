//! Points that shine through a nearer surface, found by what they reach.
//!
//! The filter of the cache knows no edges: it must spare points beside a silhouette, and so spares those that the nearer
//! object has just moved over too; they fray its outline. With the edges known the question is simple: what a point
//! reaches without crossing an edge lies on the same piece of surface. If such a point is clearly nearer, the farther one is
//! hidden.

use llsr_epi::{CELL, EdgePointImage};
use llsr_render_cache::{OCCUPIED, PointImage, PointStore};

/// How much nearer, as a share of the depth, a point of another object must be: an object may run into another without an
/// edge.
const OTHER_OBJECT: f32 = 0.03;
/// The same for points of one object and for each pixel between them: a surface seen at a grazing angle is that steep.
const SAME_OBJECT: f32 = 0.06;
/// Pixels that a point looks around, each way: those of the masks of reachability.
const REACH: usize = 2;

/// A region near the middle of a pixel.
const MIDDLE: u8 = 5;

/// Working memory of the search for hidden points.
#[derive(Clone, Debug, Default)]
pub(crate) struct HiddenScratch {
    /// For each pixel the least depth of the points in the 5x5 pixels around it, in the layout of the planes of points.
    least: Vec<f32>,
    /// A point in every pixel that has one around it.
    region: Vec<u8>,
    /// Least depth of five columns, for five rows in a ring.
    across: [Vec<f32>; 5],
    padded: Vec<f32>,
    /// For each pixel of a row the depth beyond which everything is hidden.
    limits: Vec<f32>,
    hidden: Vec<(u32, u32)>,
}

impl HiddenScratch {
    /// Works out the least depths around each pixel, and regions that say that there is a point where one is around.
    ///
    /// In place of those of the points they make occlusion culling of edges stricter: a far point among near ones no longer
    /// lets the far edges around it through, nor does a gap, which would wall it in and keep it from being found.
    pub(crate) fn least_depths(&mut self, points: &PointImage) -> (&[f32], &[u8]) {
        let (width, height) = points.size();
        let (columns, rows, stride) = (width as usize, height as usize, points.stride());
        let depths = points.depth_plane();
        let fill = |v: &mut Vec<f32>, len: usize| {
            v.clear();
            v.resize(len, f32::INFINITY);
        };
        self.across.iter_mut().for_each(|row| fill(row, columns));
        fill(&mut self.padded, columns + 2 * REACH);
        if self.least.len() != depths.len() {
            fill(&mut self.least, depths.len());
            self.region.clear();
            self.region.resize(depths.len(), 0);
        }
        let padded = &mut self.padded;
        let mut load = |y: usize, across: &mut [Vec<f32>; 5]| {
            let row = &mut across[y % 5][..columns];
            if y >= rows {
                row.fill(f32::INFINITY);
                return;
            }
            padded[REACH..REACH + columns].copy_from_slice(&depths[y * stride..][..columns]);
            let shifted: [&[f32]; 5] = std::array::from_fn(|i| &padded[i..i + columns]);
            least_of(shifted, row);
        };
        for y in 0..REACH {
            load(y, &mut self.across);
        }
        for y in 0..rows {
            load(y + REACH, &mut self.across);
            let five = self.across.each_ref().map(|row| &row[..columns]);
            let least = &mut self.least[y * stride..][..columns];
            least_of(five, least);
            let from = &points.region_plane()[y * stride..][..columns];
            let region = &mut self.region[y * stride..][..columns];
            for x in 0..columns {
                let made = if least[x] < f32::INFINITY {
                    OCCUPIED | MIDDLE
                } else {
                    0
                };
                region[x] = if from[x] == 0 { made } else { from[x] };
            }
        }
        (&self.least, &self.region)
    }

    /// Takes points that lie beyond the depths of the cells of 4x4 pixels (see [`Occluders`](super::occluders::Occluders)) out of the
    /// picture; the cache keeps them. Returns how many.
    pub(crate) fn hide_beyond(&mut self, depths: &[f32], points: &mut PointImage) -> usize {
        let (width, height) = points.size();
        let (columns, stride) = (width as usize, points.stride());
        self.hidden.clear();
        self.limits.clear();
        self.limits.resize(columns, f32::INFINITY);
        let mut bounded = false;
        for y in 0..height as usize {
            if y.is_multiple_of(CELL) {
                // One limit for each pixel, so that many are compared at once.
                let cells = &depths[y / CELL * columns.div_ceil(CELL)..][..columns.div_ceil(CELL)];
                bounded = cells.iter().any(|&limit| limit < f32::INFINITY);
                for (limits, &limit) in self.limits.chunks_mut(CELL).zip(cells) {
                    limits.fill(limit);
                }
            }
            if !bounded {
                continue;
            }
            let row = &points.depth_plane()[y * stride..][..columns];
            let beyond = |depth: f32, limit: f32| (depth > limit) & (depth < f32::INFINITY);
            for (block, (row, limits)) in row.chunks(64).zip(self.limits.chunks(64)).enumerate() {
                let pairs = || row.iter().zip(limits);
                if !pairs().fold(false, |any, (&depth, &limit)| any | beyond(depth, limit)) {
                    continue;
                }
                let found = pairs()
                    .enumerate()
                    .filter(|&(_, (&depth, &limit))| beyond(depth, limit));
                self.hidden
                    .extend(found.map(|(i, _)| ((block * 64 + i) as u32, y as u32)));
            }
        }
        for &(x, y) in &self.hidden {
            points.hide(x, y);
        }
        self.hidden.len()
    }

    /// Takes the points that are hidden behind what they reach out of picture and cache; the edge-and-point image keeps them.
    /// Returns how many.
    ///
    /// The image must know what is reachable, and [`least_depths`](Self::least_depths) must be those of `points`.
    pub(crate) fn discard(
        &mut self,
        image: &EdgePointImage,
        points: &mut PointImage,
        store: &mut PointStore,
    ) -> usize {
        let (width, height) = points.size();
        let (columns, stride) = (width as usize, points.stride());
        self.hidden.clear();
        for y in 0..height as usize {
            let own = &points.depth_plane()[y * stride..][..columns];
            let least = &self.least[y * stride..][..columns];
            for (block, (own, least)) in own.chunks(64).zip(least.chunks(64)).enumerate() {
                let jump =
                    |own: f32, least: f32| (own < f32::INFINITY) & (own * (1.0 - OTHER_OBJECT) > least);
                // Most pixels see no jump of depth: asked for many at once, and where there is one for few.
                let any = |own: &[f32], least: &[f32]| {
                    let pairs = own.iter().zip(least);
                    pairs.fold(false, |any, (&own, &least)| any | jump(own, least))
                };
                if !any(own, least) {
                    continue;
                }
                for (part, (own, least)) in own.chunks(8).zip(least.chunks(8)).enumerate() {
                    if !any(own, least) {
                        continue;
                    }
                    for (i, (&own, &least)) in own.iter().zip(least).enumerate() {
                        let x = block * 64 + part * 8 + i;
                        if jump(own, least) && is_hidden(image, points, store, (x, y), own) {
                            self.hidden.push((x as u32, y as u32));
                        }
                    }
                }
            }
        }
        for &(x, y) in &self.hidden {
            points.discard(store, x, y);
        }
        self.hidden.len()
    }
}

/// The least of five values, for each column.
#[inline(always)]
fn least_of([a, b, c, d, e]: [&[f32]; 5], out: &mut [f32]) {
    let n = out.len();
    let (a, b, c, d, e) = (&a[..n], &b[..n], &c[..n], &d[..n], &e[..n]);
    let less = |a: f32, b: f32| if a < b { a } else { b };
    for x in 0..n {
        out[x] = less(less(a[x], b[x]), less(less(c[x], d[x]), e[x]));
    }
}

/// Does the point of a pixel reach one that is clearly nearer?
fn is_hidden(
    image: &EdgePointImage,
    points: &PointImage,
    store: &PointStore,
    (x, y): (usize, usize),
    depth: f32,
) -> bool {
    let (stride, (width, height)) = (points.stride(), points.size());
    let (depths, slots) = (points.depth_plane(), points.slot_plane());
    // Bits as in the masks of reachability: the window in scan order without its centre.
    let limit = depth * (1.0 - OTHER_OBJECT);
    let mut nearer = 0u32;
    for v in y.saturating_sub(REACH)..(y + REACH + 1).min(height as usize) {
        let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(width as usize);
        let first = (v + REACH - y) * 5 + columns.start + REACH - x;
        for (i, &near) in depths[v * stride..][columns].iter().enumerate() {
            nearer |= u32::from(near < limit) << (first + i);
        }
    }
    let nearer = nearer & 0xfff | nearer >> 1 & 0xfff000;
    if nearer == 0 {
        return false;
    }
    // Whose they are is looked up all over the cache, so only for those that are reached.
    let mut reached = image.reach_mask_among(x as u32, y as u32, nearer);
    let object = store.object(slots[y * stride + x]);
    while reached != 0 {
        let bit = reached.trailing_zeros() as usize;
        reached &= reached - 1;
        let tap = bit + usize::from(bit >= 12);
        let (u, v) = (x + tap % 5 - REACH, y + tap / 5 - REACH);
        let at = v * stride + u;
        let steps = u.abs_diff(x).max(v.abs_diff(y)) as f32;
        if depths[at] < depth * (1.0 - SAME_OBJECT * steps) || store.object(slots[at]) != object {
            return true;
        }
    }
    false
}
