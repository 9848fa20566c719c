//! The edge-and-point image.

use glam::{Vec2, Vec3};

use crate::classify::{CLASS_PLANES, COMPLEX, CROSSED};
use crate::code::{EdgeCode, PixelClass};
use crate::crossings::Crossings;
use crate::donors::DonorScratch;
use crate::edges::EdgeList;
use crate::interpolate::InterpolateScratch;
use crate::kernel::Kernel;
use crate::occlusion::{DepthLimits, LimitScratch, Occlusion};
use crate::patch::Patches;
use crate::picture::Picture;
use crate::pixels::{Pixels, Point, Sample};
use crate::planes::Planes;
use crate::reach::{self, REACH_PLANES, ReachScratch};
use crate::simd::Level;

/// Largest width and height.
pub const MAX_SIZE: u32 = 16_384;

/// How an image is rebuilt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The interpolation filter.
    pub kernel: Kernel,
    /// Take the mean of the samples in reach, which lies somewhere beside the pixel's centre, to the centre along slope and curvature of the means
    /// two pixels away: slopes of brightness come out smooth, for about 1.6 times the time of interpolation. Complex pixels keep the mean.
    pub linear: bool,
    /// Keep crossings of the half-pixel lines, which [`EdgePointImage::filter_complex`] needs: two bytes a pixel more.
    pub half_lines: bool,
    /// Colour of pixels that reach no sample, until [`EdgePointImage::fill`] finds them one.
    pub fallback: Vec3,
}

impl Default for Settings {
    /// The peaked filter of means, half-pixel lines, black.
    fn default() -> Self {
        Self {
            kernel: Kernel::PEAKED,
            linear: false,
            half_lines: true,
            fallback: Vec3::ZERO,
        }
    }
}

/// Why an image cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SizeError {
    /// Width or height is 0.
    Zero,
    /// Width or height exceeds [`MAX_SIZE`].
    TooLarge,
}

impl std::fmt::Display for SizeError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Zero => f.write_str("an edge-and-point image needs at least one pixel"),
            Self::TooLarge => write!(
                f,
                "an edge-and-point image has at most {MAX_SIZE} x {MAX_SIZE} pixels"
            ),
        }
    }
}

impl std::error::Error for SizeError {}

/// Where edges cross the lines of a pixel: masks of eighths, from left to right or from top to bottom.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelCrossings {
    /// The upper boundary.
    pub above: u8,
    /// The left boundary.
    pub left: u8,
    /// The horizontal line through the middle; 0 without [`Settings::half_lines`].
    pub through: u8,
    /// The vertical line through the middle, likewise.
    pub middle: u8,
}

/// How many pixels of each class an image has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClassCounts {
    /// Pixels without an edge.
    pub empty: usize,
    /// Pixels with one edge.
    pub simple: usize,
    /// The others.
    pub complex: usize,
}

/// Scratch memory of one band.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    pub(crate) limits: LimitScratch,
    pub(crate) reach: ReachScratch,
    pub(crate) interpolate: InterpolateScratch,
    pub(crate) donors: DonorScratch,
    pub(crate) patches: Patches,
}

/// Edges and samples of a picture, at most one of each in a pixel, and the picture that follows from them.
///
/// The passes in their order, each of which reads what the earlier ones left:
/// [`rasterize`](Self::rasterize), [`classify`](Self::classify), [`reach`](Self::reach),
/// [`interpolate`](Self::interpolate), [`fill`](Self::fill), [`filter_complex`](Self::filter_complex),
/// [`antialias`](Self::antialias). [`reconstruct`](Self::reconstruct) runs all after the first.
/// Each has a `_bands` form for several threads. After the first picture nothing is allocated.
#[derive(Clone, Debug)]
pub struct EdgePointImage {
    pub(crate) settings: Settings,
    pub(crate) level: Level,
    pub(crate) crossings: Crossings,
    pub(crate) pixels: Pixels,
    pub(crate) classes: Planes<CLASS_PLANES>,
    pub(crate) reach: Planes<REACH_PLANES>,
    /// What was reachable when [`keep_reach`](Self::keep_reach) was called.
    pub(crate) kept: Option<Planes<REACH_PLANES>>,
    pub(crate) limits: DepthLimits,
    /// One for each band.
    pub(crate) scratch: Vec<Scratch>,
}

impl EdgePointImage {
    /// An image without edges and samples, of `width` x `height` pixels, each in 1..=[`MAX_SIZE`].
    pub fn new(width: u32, height: u32, settings: Settings) -> Result<Self, SizeError> {
        Self::with_level(width, height, settings, Level::detect())
    }

    /// As [`new`](Self::new), with a level that the CPU must have.
    pub(crate) fn with_level(
        width: u32,
        height: u32,
        settings: Settings,
        level: Level,
    ) -> Result<Self, SizeError> {
        if width == 0 || height == 0 {
            return Err(SizeError::Zero);
        }
        if width > MAX_SIZE || height > MAX_SIZE {
            return Err(SizeError::TooLarge);
        }
        let (w, h) = (width as usize, height as usize);
        let mut classes = Planes::new(w, h);
        classes.fill_outside(COMPLEX, w);
        Ok(Self {
            settings,
            level,
            crossings: Crossings::new(w, h, settings.half_lines),
            pixels: Pixels::new(w, h),
            classes,
            reach: Planes::new(w, h),
            kept: None,
            limits: DepthLimits::new(w, h),
            scratch: Vec::new(),
        })
    }

    /// Size in pixels: width, height.
    pub fn size(&self) -> (u32, u32) {
        (self.pixels.width as u32, self.pixels.height as u32)
    }

    /// How the image is rebuilt.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Takes all samples out.
    pub fn clear_samples(&mut self) {
        self.pixels.clear_samples();
    }

    /// Puts a point into its pixel, where it becomes the sample unless a nearer one is there; of equally near ones the
    /// first stays. Returns whether it did. A point outside, or with a depth that is not positive, does not.
    pub fn insert(&mut self, point: &Point) -> bool {
        self.pixels.insert(point)
    }

    /// Takes the sample of a pixel out.
    ///
    /// # Panics
    /// If the pixel lies outside the image, as in all functions that take one.
    pub fn remove_sample(&mut self, x: u32, y: u32) {
        let (x, y) = self.checked(x, y);
        self.pixels.remove(x, y);
    }

    /// The sample of a pixel.
    pub fn sample(&self, x: u32, y: u32) -> Option<Sample> {
        let (x, y) = self.checked(x, y);
        self.pixels.sample(x, y)
    }

    /// Replaces the edges of the image. With `occlusion`, edges behind the samples are left out.
    ///
    /// # Panics
    /// If the list was made for another size.
    pub fn rasterize(&mut self, edges: &EdgeList, occlusion: Option<Occlusion>) {
        self.rasterize_bands(edges, occlusion, 1)
            .for_each(|band| band.run());
    }

    /// Takes all edges out.
    pub fn clear_edges(&mut self) {
        for mut band in self.crossings.bands_mut(self.pixels.height) {
            band.clear();
        }
    }

    /// Adds a crossing of the boundary above pixel (x, y), in eighth 0..8 from the left; y = height is the lower border. For
    /// edges that come from elsewhere than [`rasterize`](Self::rasterize).
    ///
    /// # Panics
    /// If there is no such boundary or eighth.
    pub fn mark_above(&mut self, x: u32, y: u32, eighth: u8) {
        let (width, height) = self.size();
        assert!(
            x < width && y <= height && eighth < 8,
            "no eighth {eighth} above ({x}, {y}) in {width}x{height}"
        );
        let start = y as usize * self.crossings.lines * self.crossings.stride;
        self.crossings.horizontal[start + x as usize] |= 1 << eighth;
    }

    /// Adds a crossing of the boundary left of pixel (x, y), in eighth 0..8 from the top; x = width is the right border.
    ///
    /// # Panics
    /// If there is no such boundary or eighth.
    pub fn mark_left(&mut self, x: u32, y: u32, eighth: u8) {
        let (width, height) = self.size();
        assert!(
            x <= width && y < height && eighth < 8,
            "no eighth {eighth} left of ({x}, {y}) in {width}x{height}"
        );
        let start = y as usize * self.crossings.lines * (self.crossings.stride + 1);
        self.crossings.vertical[start + x as usize] |= 1 << eighth;
    }

    /// Classifies all pixels, rebuilds their edges and decides which region of each is primary.
    pub fn classify(&mut self) {
        self.classify_bands(1).for_each(|band| band.run());
    }

    /// Works out what is reachable.
    pub fn reach(&mut self) {
        self.reach_bands(1).for_each(|band| band.run());
    }

    /// Keeps what is reachable now for passes over [kept](crate::FillBand::kept) reach, until this is called again;
    /// [`reach`](Self::reach) has to be called anew.
    ///
    /// For images that are drawn twice, with some of the edges first: what is cut off by all of them may take its colour from where only
    /// the others lie between. Three bytes a pixel from the first call on.
    pub fn keep_reach(&mut self) {
        let (width, height) = (self.pixels.width, self.pixels.height);
        let kept = self.kept.get_or_insert_with(|| Planes::new(width, height));
        std::mem::swap(&mut self.reach, kept);
    }

    /// Interpolates the samples that each pixel reaches.
    ///
    /// # Panics
    /// If the picture has another size, as in all passes that take one.
    pub fn interpolate(&mut self, picture: &mut Picture) {
        self.interpolate_bands(picture, 1).for_each(|band| band.run());
    }

    /// Gives pixels that reach no sample the filtered colours of neighbours that they reach, up to `passes` times:
    /// each pass goes two pixels farther. Returns the number of pixels filled.
    ///
    /// What no sample reaches keeps [`Settings::fallback`]. Priorities stay, so that new samples still go there first.
    pub fn fill(&mut self, picture: &mut Picture, passes: usize) -> usize {
        let mut filled = 0;
        for _ in 0..passes {
            self.fill_bands(picture, 1).for_each(|band| band.run());
            let count = self.apply(picture);
            if count == 0 {
                break;
            }
            filled += count;
        }
        filled
    }

    /// Gives pixels that are still without a colour that of the pixels around, whatever edges lie between, until all have one. Returns
    /// the number of pixels filled; without any sample nothing happens.
    ///
    /// For pictures that get no further samples: regions cut off by edges with no sample in them then blur into what is around them
    /// instead of showing [`Settings::fallback`]. Call it after [`fill`](Self::fill). Priorities stay.
    pub fn fill_blindly(&mut self, picture: &mut Picture) -> usize {
        let mut filled = 0;
        loop {
            self.fill_bands(picture, 1).for_each(|band| band.blind().run());
            match self.apply(picture) {
                0 => return filled,
                count => filled += count,
            }
        }
    }

    /// Gives pixels that are still without a colour the mean of those of the eight pixels around that have one, whatever edges lie
    /// between. Returns the number of pixels filled; each call goes one pixel farther. Priorities stay.
    pub fn fill_evenly(&mut self, picture: &mut Picture) -> usize {
        self.fill_bands(picture, 1).for_each(|band| band.evenly().run());
        self.apply(picture)
    }

    /// Blends the two sides of the edge in each simple pixel. The last pass: the others want unblended colours.
    pub fn antialias(&mut self, picture: &mut Picture) {
        self.antialias_bands(picture, 1).for_each(|band| band.run());
        self.apply(picture);
    }

    /// Improves complex pixels by edges and reachability in quarters of a pixel; does nothing without
    /// [`Settings::half_lines`].
    ///
    /// `factor(x, y)` takes the colour of the sample of that pixel to colours of the picture: 1 unless the picture was
    /// [multiplied](Picture::multiply).
    pub fn filter_complex(&mut self, picture: &mut Picture, factor: impl Fn(u32, u32) -> Vec3) {
        self.complex_bands(picture, 1).for_each(|band| band.run(&factor));
        self.apply(picture);
    }

    /// Everything after rasterising, with one pass of [`fill`](Self::fill), for samples that are colours to be shown.
    pub fn reconstruct(&mut self, picture: &mut Picture) {
        self.reconstruct_modulated(picture, |_, _| Vec3::ONE);
    }

    /// As [`reconstruct`](Self::reconstruct) for samples of irradiance: see [`Picture::multiply`].
    pub fn reconstruct_modulated(&mut self, picture: &mut Picture, factor: impl Fn(u32, u32) -> Vec3) {
        self.classify();
        self.reach();
        self.interpolate(picture);
        self.fill(picture, 1);
        picture.multiply(&factor);
        self.filter_complex(picture, factor);
        self.antialias(picture);
    }

    /// The crossings of the upper and the left boundary of pixel (x, y) and of the lines through its middle; x = width and
    /// y = height stand for the right and the lower border.
    ///
    /// # Panics
    /// If x or y lies beyond these.
    pub fn crossings(&self, x: u32, y: u32) -> PixelCrossings {
        let (width, height) = self.size();
        assert!(
            x <= width && y <= height,
            "no boundaries at ({x}, {y}) in {width}x{height}"
        );
        let (column, row) = (x as usize, y as usize);
        let (inside_x, inside_y) = (x < width, y < height);
        let at = |there: bool, line: &dyn Fn() -> u8| if there { line() } else { 0 };
        let half = self.settings.half_lines && inside_x && inside_y;
        PixelCrossings {
            above: at(inside_x, &|| self.crossings.above(row)[column]),
            left: at(inside_y, &|| self.crossings.left(row)[column]),
            through: at(half, &|| self.crossings.through(row)[column]),
            middle: at(half, &|| self.crossings.middle(row)[column]),
        }
    }

    /// The edge of a pixel; needs [`classify`](Self::classify).
    pub fn edge(&self, x: u32, y: u32) -> EdgeCode {
        let (x, y) = self.checked(x, y);
        self.pixels.code(x, y)
    }

    /// The class of a pixel; needs [`classify`](Self::classify).
    pub fn class(&self, x: u32, y: u32) -> PixelClass {
        self.edge(x, y).class()
    }

    /// The 24-bit mask of a pixel: bit i is set if its primary region reaches that of neighbour i of the 5x5 window in scan
    /// order, without the centre. Needs [`reach`](Self::reach).
    pub fn reach_mask(&self, x: u32, y: u32) -> u32 {
        let (x, y) = self.checked(x, y);
        reach::mask(&self.reach, x, y)
    }

    /// The bits of [`reach_mask`](Self::reach_mask) that are also in `wanted`; cheaper where these are few.
    ///
    /// # Panics
    /// If the pixel lies outside the picture, or `wanted` has more than 24 bits.
    pub fn reach_mask_among(&self, x: u32, y: u32, wanted: u32) -> u32 {
        assert!(wanted < 1 << 24, "a mask of 24 bits");
        let (x, y) = self.checked(x, y);
        reach::mask_among(&self.reach, x, y, wanted)
    }

    /// Counts the classes.
    pub fn class_counts(&self) -> ClassCounts {
        let mut counts = ClassCounts::default();
        for y in 0..self.pixels.height as isize {
            let row = self.classes.row(y);
            let words = row
                .plane(CROSSED)
                .iter()
                .zip(row.plane(COMPLEX))
                .skip(1)
                .take(self.classes.words);
            for (crossed, complex) in words {
                counts.simple += (crossed & !complex).count_ones() as usize;
                counts.complex += (crossed & complex).count_ones() as usize;
            }
        }
        counts.empty = self.pixels.width * self.pixels.height - counts.simple - counts.complex;
        counts
    }

    /// A point of the primary region of a pixel, in pixels from the top left corner of the picture: its sample's position
    /// to a quarter of a pixel, without a usable sample the centre of the pixel, which always lies in the larger region.
    pub fn primary_position(&self, x: u32, y: u32) -> Vec2 {
        let corner = Vec2::new(x as f32, y as f32);
        let code = self.edge(x, y);
        match self.sample(x, y) {
            Some(sample) if code.side(sample.position) == crate::RegionSide::Primary => {
                let quarter = |i: u8| (f32::from(i) + 0.5) / 4.0;
                corner + Vec2::new(quarter(sample.position % 4), quarter(sample.position / 4))
            }
            _ => corner + 0.5,
        }
    }

    /// The complex pixels from top to bottom, for a renderer that supersamples them (BWG03 section 5.4) and hands the result
    /// to [`Picture::set_pixel`].
    pub fn complex_pixels(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let words = self.classes.words;
        (0..self.pixels.height).flat_map(move |y| {
            let row = self.classes.row(y as isize);
            (0..words).flat_map(move |word| {
                let bits = row.plane(COMPLEX)[word + 1] & row.plane(CROSSED)[word + 1];
                (0..64)
                    .filter(move |bit| bits >> bit & 1 != 0)
                    .map(move |bit| (word as u32 * 64 + bit, y as u32))
            })
        })
    }

    #[track_caller]
    fn checked(&self, x: u32, y: u32) -> (usize, usize) {
        let (width, height) = self.size();
        assert!(
            x < width && y < height,
            "pixel ({x}, {y}) outside {width}x{height}"
        );
        (x as usize, y as usize)
    }
}
