//! The occlusion filter: points that shine through nearer surfaces are dropped.
//!
//! Points are sparse, so a far point can fall into a gap between points of a surface that hides it. It gives itself
//! away by being *surrounded*: there are clearly nearer points to the upper left, upper right, lower left and lower right
//! of it, in the four blocks of `reach` x `reach` pixels that touch its pixel at the corners.
//!
//! The four blocks leave out the pixel's own row and column, and that makes the test safe where it matters. If the nearer
//! surface lies on one side of some straight line through the point, however the line is turned, then one of the
//! blocks lies wholly on the other side: so neither a point beside a straight or convex silhouette nor a point of a
//! tilted plane (its depth falls towards one side only) can be surrounded, whatever the tolerance. What can be dropped
//! wrongly is a point seen through a hole or between two objects less than `2 reach + 1` pixels apart; that is why
//! fresh points are left alone.

/// How points that shine through nearer surfaces are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthFilter {
    /// Width of the four blocks in pixels, up to 8; 0 switches the filter off.
    pub reach: u8,
    /// By what share of its own depth a neighbour must be nearer to count, in [0, 1).
    pub tolerance: f32,
    /// Points of an age below this many ticks are never dropped: the shader has just seen them.
    pub fresh: u8,
}

impl Default for DepthFilter {
    fn default() -> Self {
        Self {
            reach: 3,
            tolerance: 0.02,
            fresh: 1,
        }
    }
}

impl DepthFilter {
    /// The largest reach.
    pub const MAX_REACH: u8 = 8;

    /// The filter with the reach that suits pictures in which the share `density` of the pixels has a point: the smallest
    /// one for which a block of a wholly covered region is empty in less than 5% of the cases, at least 2.
    #[must_use]
    pub fn for_density(mut self, density: f32) -> Self {
        let empty = (1.0 - density).clamp(0.0, 1.0);
        let small = |reach: &u8| empty.powi(i32::from(*reach).pow(2)) < 0.05;
        self.reach = (2..Self::MAX_REACH).find(small).unwrap_or(Self::MAX_REACH);
        self
    }

    pub(crate) fn reach(&self) -> usize {
        usize::from(self.reach.min(Self::MAX_REACH))
    }
}

/// Scratch memory for the filter over a band of rows.
///
/// Row y of `block` holds, for each column, the least depth in the `reach` x `reach` pixels to the right of and below it;
/// those rows are computed in order and kept in rings.
#[derive(Clone, Debug, Default)]
pub(crate) struct FilterScratch {
    /// Depths of one row with `reach` columns of infinity at both ends.
    line: Vec<f32>,
    /// Least depth of `reach` columns, for the last `reach` rows; column c is at c + reach.
    across: Vec<f32>,
    /// Least depth of the block, for the last `reach + 2` rows; columns likewise.
    block: Vec<f32>,
    /// Of the row at hand: the depth, infinite without a point, and the tag of each pixel; set by the caller.
    pub(crate) depth: Vec<f32>,
    pub(crate) tag: Vec<u32>,
    /// Not 0 where a point, should there be one, is surrounded.
    pub(crate) hidden: Vec<u32>,
    /// Columns in which a point is shown, from left to right; for the caller.
    pub(crate) shown: Vec<u32>,
    reach: usize,
    width: usize,
}

impl FilterScratch {
    /// Prepares for a picture of `width` columns and the rows from `first` on. `row` gives the keys of a row, `None`
    /// outside the picture.
    #[inline(always)]
    pub(crate) fn start<'k>(
        &mut self,
        reach: usize,
        width: usize,
        first: usize,
        row: impl Fn(isize) -> Option<&'k [u64]>,
    ) {
        (self.reach, self.width) = (reach, width);
        let columns = self.columns();
        let fill = |v: &mut Vec<f32>, len: usize| {
            v.clear();
            v.resize(len, f32::INFINITY);
        };
        fill(&mut self.line, width + 2 * reach);
        fill(&mut self.across, reach * columns);
        fill(&mut self.block, (reach + 2) * columns);
        fill(&mut self.depth, width);
        for row in [&mut self.tag, &mut self.hidden, &mut self.shown] {
            row.clear();
            row.resize(width, 0);
        }
        if reach > 0 {
            // The block row of `first - reach` needs the depth rows from there to `first - 1`.
            let first = first as isize;
            let reach = reach as isize;
            for y in first - reach..first {
                self.add_across(y, &row);
            }
            self.add_block(first - reach);
            for y in first - reach + 1..first + 1 {
                self.add_across(y + reach - 1, &row);
                self.add_block(y);
            }
        }
    }

    /// Fills `hidden` from `depth` for row `y`: the first one given to `start`, then one after the other. A neighbour counts
    /// as nearer below `keep` times the depth.
    #[inline(always)]
    pub(crate) fn row<'k>(&mut self, y: usize, keep: f32, row: impl Fn(isize) -> Option<&'k [u64]>) {
        if self.reach == 0 {
            return;
        }
        let (y, reach) = (y as isize, self.reach as isize);
        self.add_across(y + reach, &row);
        self.add_block(y + 1);
        let columns = self.columns();
        let above = &self.block[slot(y - reach, self.reach + 2) * columns..][..columns];
        let below = &self.block[slot(y + 1, self.reach + 2) * columns..][..columns];
        let width = self.width;
        // Column c of a block row is at c + reach: the blocks to the right start at x + 1, to the left at x - reach.
        let right = self.reach + 1;
        let (above_left, below_left) = (&above[..width], &below[..width]);
        let (above_right, below_right) = (&above[right..][..width], &below[right..][..width]);
        let hidden = &mut self.hidden[..width];
        let depth = &self.depth[..width];
        for x in 0..width {
            let farthest = larger(
                larger(above_left[x], above_right[x]),
                larger(below_left[x], below_right[x]),
            );
            hidden[x] = u32::from(farthest < depth[x] * keep);
        }
    }

    fn columns(&self) -> usize {
        self.width + self.reach + 1
    }

    #[inline(always)]
    fn add_across<'k>(&mut self, y: isize, row: impl Fn(isize) -> Option<&'k [u64]>) {
        let (reach, columns) = (self.reach, self.columns());
        let out = &mut self.across[slot(y, reach) * columns..][..columns];
        let Some(keys) = row(y) else {
            out.fill(f32::INFINITY);
            return;
        };
        for (d, key) in self.line[reach..][..self.width].iter_mut().zip(keys) {
            *d = f32::from_bits((key >> 32) as u32);
        }
        let line = &self.line;
        least(out, reach, |step| &line[step..]);
    }

    #[inline(always)]
    fn add_block(&mut self, y: isize) {
        let (reach, columns) = (self.reach, self.columns());
        let out = &mut self.block[slot(y, reach + 2) * columns..][..columns];
        let across = &self.across;
        least(out, reach, |step| {
            &across[slot(y + step as isize, reach) * columns..]
        });
    }
}

/// The least of `count` rows, element by element; two or three at a time.
#[inline(always)]
fn least<'a>(out: &mut [f32], count: usize, row: impl Fn(usize) -> &'a [f32]) {
    let columns = out.len();
    let row = |i: usize| &row(i)[..columns];
    if count < 3 {
        let (a, b) = (row(0), row(count - 1));
        for x in 0..columns {
            out[x] = smaller(a[x], b[x]);
        }
        return;
    }
    let (a, b, c) = (row(0), row(1), row(2));
    for x in 0..columns {
        out[x] = smaller(smaller(a[x], b[x]), c[x]);
    }
    for i in (3..count).step_by(2) {
        let (a, b) = (row(i), row((i + 1).min(count - 1)));
        for x in 0..columns {
            out[x] = smaller(out[x], smaller(a[x], b[x]));
        }
    }
}

/// Rows live in rings by their number.
#[inline(always)]
fn slot(y: isize, rows: usize) -> usize {
    y.rem_euclid(rows as isize) as usize
}

// One instruction each; `f32::min` and `max` take more to be right for NaN, which there is none of.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
