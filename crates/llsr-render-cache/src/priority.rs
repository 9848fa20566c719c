//! How badly each pixel wants a sample.

use crate::Error;
use crate::hilbert::TILE;
use crate::image::{OCCUPIED, PointImage};
use crate::view::check_size;

/// How age turns into priority, in pixels that have a usable point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AgeRule {
    /// Up to this age in ticks the priority is 0.
    pub young: u8,
    /// From this age on the priority is `highest`; linear between.
    pub old: u8,
    /// Priority of old points; compare with 255 of a pixel that reaches no point.
    pub highest: u8,
}

impl Default for AgeRule {
    fn default() -> Self {
        Self {
            young: 8,
            old: 136,
            highest: 128,
        }
    }
}

/// [`AgeRule`] as arithmetic on small numbers, for whole vectors at a time.
#[derive(Clone, Copy, Debug)]
struct Slope {
    young: u8,
    span: u8,
    /// In 1/256, at most 255 * 256 / span + 1: times the span it fits 16 bits.
    slope: u16,
}

impl From<AgeRule> for Slope {
    fn from(rule: AgeRule) -> Self {
        let span = rule.old.saturating_sub(rule.young).max(1);
        Self {
            young: rule.young,
            span,
            slope: u16::from(rule.highest) * 256 / u16::from(span) + 1,
        }
    }
}

impl Slope {
    #[inline(always)]
    fn priority(self, age: u8) -> u8 {
        let beyond = age.saturating_sub(self.young).min(self.span);
        (u16::from(beyond).wrapping_mul(self.slope) >> 8) as u8
    }
}

/// The priority of each pixel, 0 (wants nothing) to 255 (knows nothing).
#[derive(Clone, Debug)]
pub struct Priorities {
    width: usize,
    height: usize,
    stride: usize,
    /// Whole tiles; 0 outside the picture.
    values: Vec<u8>,
    /// Frames for which a pixel that was asked for is not asked for again.
    pending: Vec<u8>,
    /// Scratch of [`Self::update_by_gaps`]: three rows after the horizontal filter.
    across: [Vec<u8>; 3],
}

impl Priorities {
    /// All priorities 0, for a picture of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`Error::Size`] if a side is 0 or above [`MAX_SIDE`](crate::MAX_SIDE).
    pub fn new(width: u32, height: u32) -> Result<Self, Error> {
        check_size(width, height)?;
        let (width, height) = (width as usize, height as usize);
        let stride = width.next_multiple_of(64);
        let pixels = stride * height.next_multiple_of(TILE);
        Ok(Self {
            width,
            height,
            stride,
            values: vec![0; pixels],
            pending: vec![0; pixels],
            across: Default::default(),
        })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width as u32, self.height as u32)
    }

    /// The priorities of a row, from left to right.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, y: u32) -> &[u8] {
        assert!((y as usize) < self.height, "row {y} of {}", self.height);
        &self.values[y as usize * self.stride..][..self.width]
    }

    /// The priorities of a row, to be written to. Takes no notice of requests under way.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row_mut(&mut self, y: u32) -> &mut [u8] {
        assert!((y as usize) < self.height, "row {y} of {}", self.height);
        &mut self.values[y as usize * self.stride..][..self.width]
    }

    /// Sets all priorities from what the interpolation missed and from the ages of points (BWG03 section 5.3).
    ///
    /// `missing` gives for each row how much filter weight found no point, for each pixel: 0 for a pixel with a usable
    /// point of its own, 1 to 254 the more the less weight there was, 255 for none. Where it is 0 the age of the point
    /// decides. Pixels that were asked for lately have priority 0.
    ///
    /// # Panics
    /// If the size of `image` is another one, or a row is shorter than the width.
    pub fn update<'a>(
        &mut self,
        image: &PointImage,
        rule: AgeRule,
        mut missing: impl FnMut(u32) -> &'a [u8],
    ) {
        assert_eq!(
            image.size(),
            self.size(),
            "sizes of the points and the priorities"
        );
        let (width, stride, rule) = (self.width, self.stride, Slope::from(rule));
        for y in 0..self.height {
            let at = y * stride..y * stride + width;
            let missing = &missing(y as u32)[..width];
            let ages = &image.age_plane()[at.clone()][..width];
            let values = &mut self.values[at.clone()][..width];
            let pending = &mut self.pending[at][..width];
            for x in 0..width {
                let by_age = rule.priority(ages[x]);
                let wanted = if missing[x] == 0 { by_age } else { missing[x] };
                values[x] = if pending[x] == 0 { wanted } else { 0 };
                pending[x] = pending[x].saturating_sub(1);
            }
        }
    }

    /// The same for those who do not interpolate, or not by edges: the missing weight is what a 3x3 filter
    /// ((1 2 1) both ways) finds empty around a pixel without a point.
    ///
    /// # Panics
    /// If the size of `image` is another one.
    pub fn update_by_gaps(&mut self, image: &PointImage, rule: AgeRule) {
        assert_eq!(
            image.size(),
            self.size(),
            "sizes of the points and the priorities"
        );
        let (width, stride, rule) = (self.width, self.stride, Slope::from(rule));
        let [above, here, below] = &mut self.across;
        for row in [&mut *above, here, below] {
            row.clear();
            row.resize(width, 0);
        }
        let across = |y: usize, out: &mut [u8]| match image.region_plane().get(y * stride..y * stride + width)
        {
            Some(regions) => filter_across(regions, out),
            None => out.fill(0),
        };
        across(0, below);
        for y in 0..self.height {
            std::mem::swap(above, here);
            std::mem::swap(here, below);
            across(y + 1, below);
            let at = y * stride..y * stride + width;
            let regions = &image.region_plane()[at.clone()][..width];
            let ages = &image.age_plane()[at.clone()][..width];
            let values = &mut self.values[at.clone()][..width];
            let pending = &mut self.pending[at][..width];
            let (above, here, below) = (&above[..width], &here[..width], &below[..width]);
            for x in 0..width {
                // Without a point here at most 12 of 16: the pixel's own weight of 4 is missing.
                let weight = above[x].wrapping_add(2 * here[x]).wrapping_add(below[x]);
                let gap = 255u8.wrapping_sub(20u8.wrapping_mul(weight));
                let by_age = rule.priority(ages[x]);
                let wanted = if regions[x] == 0 { gap } else { by_age };
                values[x] = if pending[x] == 0 { wanted } else { 0 };
                pending[x] = pending[x].saturating_sub(1);
            }
        }
    }

    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// All priorities, whole tiles, `stride` apart.
    pub(crate) fn values(&self) -> &[u8] {
        &self.values
    }

    pub(crate) fn set_pending(&mut self, i: usize, frames: u8) {
        self.pending[i] = frames;
    }
}

/// Weights (1 2 1) on the pixels that have a point.
fn filter_across(regions: &[u8], out: &mut [u8]) {
    let there = |region: u8| (region / OCCUPIED) & 1;
    let count = regions.len();
    for (o, r) in out.iter_mut().zip(regions) {
        *o = 2 * there(*r);
    }
    for (o, left) in out[1..].iter_mut().zip(regions) {
        *o += there(*left);
    }
    for (o, right) in out[..count - 1].iter_mut().zip(&regions[1..]) {
        *o += there(*right);
    }
}
