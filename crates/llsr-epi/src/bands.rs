//! The passes in bands of rows, for callers with several threads.
//!
//! Each function splits a pass into about as many bands as asked for. Run them all, in any order or at once, then go on to
//! the next pass; the result has the same bits for any number of bands.

use glam::Vec3;

use crate::classify::CLASS_PLANES;
use crate::crossings::{BandCrossings, Crossings};
use crate::donors::{self, DonorRow, DonorScratch, SampleValues};
use crate::edges::EdgeList;
use crate::image::{EdgePointImage, Scratch, Settings};
use crate::interpolate::{InterpolateScratch, Source};
use crate::kernel::Kernel;
use crate::occlusion::{BandLimits, LimitScratch, Occlusion, SHARED};
use crate::patch::Patches;
use crate::picture::{Picture, PictureBand};
use crate::pixels::Pixels;
use crate::planes::{BandPlanes, Planes};
use crate::reach::{REACH_PLANES, ReachScratch};
use crate::simd::{self, Level};
use crate::{antialias, complex, fill};

impl EdgePointImage {
    /// [`rasterize`](Self::rasterize) in about `bands` bands.
    ///
    /// Each band looks at all edges, which is a small part of the work as long as there are no more bands than threads.
    ///
    /// ```
    /// # use llsr_epi::*;
    /// # fn main() -> Result<(), SizeError> {
    /// # let (edges, mut image) = (EdgeList::new(99, 77), EdgePointImage::new(99, 77, Settings::default())?);
    /// # let mut picture = Picture::new(99, 77);
    /// std::thread::scope(|scope| {
    ///     for band in image.rasterize_bands(&edges, None, 2) {
    ///         scope.spawn(move || band.run());
    ///     }
    /// });
    /// image.classify_bands(2).for_each(|band| band.run());
    /// image.reach_bands(2).for_each(|band| band.run());
    /// image.interpolate_bands(&mut picture, 2).for_each(|band| band.run());
    /// image.fill_bands(&picture, 2).for_each(|band| band.run());
    /// image.apply(&mut picture);
    /// image.complex_bands(&picture, 2).for_each(|band| band.run(|_, _| glam::Vec3::ONE));
    /// image.apply(&mut picture);
    /// image.antialias_bands(&picture, 2).for_each(|band| band.run());
    /// image.apply(&mut picture);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Panics
    /// If the list was made for another size.
    pub fn rasterize_bands<'a>(
        &'a mut self,
        edges: &'a EdgeList,
        occlusion: Option<Occlusion>,
        bands: usize,
    ) -> impl Iterator<Item = RasterizeBand<'a>> {
        assert_eq!(
            edges.size(),
            self.size(),
            "the edges were clipped to a picture of another size"
        );
        let rows = self.prepare(bands);
        let (level, pixels) = (self.level, &self.pixels);
        let scratch = self.scratch.iter_mut().map(|scratch| &mut scratch.limits);
        let bands = self.crossings.bands_mut(rows).zip(self.limits.bands_mut(rows));
        bands
            .zip(scratch)
            .map(move |((crossings, limits), scratch)| RasterizeBand {
                level,
                edges,
                occlusion,
                pixels,
                limits,
                scratch,
                crossings,
                whole: false,
            })
    }

    /// [`classify`](Self::classify) in about `bands` bands.
    pub fn classify_bands(&mut self, bands: usize) -> impl Iterator<Item = ClassifyBand<'_>> {
        let rows = self.prepare(bands);
        let (level, crossings) = (self.level, &self.crossings);
        let words = self.pixels.words.chunks_mut(rows * self.pixels.stride);
        let bands = words.zip(self.classes.bands_mut(rows)).enumerate();
        bands.map(move |(i, (words, planes))| ClassifyBand {
            level,
            crossings,
            first_row: i * rows,
            words,
            planes,
        })
    }

    /// [`reach`](Self::reach) in about `bands` bands.
    pub fn reach_bands(&mut self, bands: usize) -> impl Iterator<Item = ReachBand<'_>> {
        let rows = self.prepare(bands);
        let (level, classes) = (self.level, &self.classes);
        let (width, height) = (self.pixels.width, self.pixels.height);
        let scratch = self.scratch.iter_mut().map(|scratch| &mut scratch.reach);
        let bands = self.reach.bands_mut(rows).zip(scratch).enumerate();
        bands.map(move |(i, (planes, scratch))| ReachBand {
            level,
            classes,
            width,
            rows: (i * rows, (i * rows + rows).min(height)),
            scratch,
            planes,
        })
    }

    /// [`interpolate`](Self::interpolate) in about `bands` bands.
    ///
    /// # Panics
    /// If the picture has another size, as in all passes that take one.
    pub fn interpolate_bands<'a>(
        &'a mut self,
        picture: &'a mut Picture,
        bands: usize,
    ) -> impl Iterator<Item = InterpolateBand<'a>> {
        self.check(picture);
        let rows = self.prepare(bands);
        let level = self.level;
        let source = reaching(&self.pixels, &self.classes, &self.reach, &self.settings);
        let scratch = self.scratch.iter_mut().map(|scratch| &mut scratch.interpolate);
        picture
            .bands_mut(rows)
            .zip(scratch)
            .map(move |(picture, scratch)| InterpolateBand {
                level,
                source,
                scratch,
                picture,
            })
    }

    /// Rows of a picture to be multiplied by something that depends on the surface that each pixel shows, say a texture, in about
    /// `bands` bands; `of_samples` says on which surface each sample lies. Between [`fill`](Self::fill) and
    /// [`filter_complex`](Self::filter_complex): see [`Picture::multiply`].
    ///
    /// # Panics
    /// If there are fewer values than pixels.
    pub fn donor_bands<'a>(
        &'a mut self,
        picture: &'a mut Picture,
        of_samples: SampleValues<'a>,
        bands: usize,
    ) -> impl Iterator<Item = DonorBand<'a>> {
        self.check(picture);
        let (width, height) = (self.pixels.width, self.pixels.height);
        assert!(
            of_samples.stride >= width && of_samples.values.len() >= of_samples.stride * (height - 1) + width,
            "{} values, {} a row, for a picture of {width}x{height}",
            of_samples.values.len(),
            of_samples.stride
        );
        let rows = self.prepare(bands);
        let level = self.level;
        let source = reaching(&self.pixels, &self.classes, &self.reach, &self.settings);
        let scratch = self.scratch.iter_mut().map(|scratch| &mut scratch.donors);
        picture
            .bands_mut(rows)
            .zip(scratch)
            .map(move |(picture, scratch)| DonorBand {
                level,
                source,
                of_samples,
                scratch,
                picture,
            })
    }

    /// One pass of [`fill`](Self::fill) in about `bands` bands; call [`apply`](Self::apply) after it.
    pub fn fill_bands<'a>(
        &'a mut self,
        picture: &'a Picture,
        bands: usize,
    ) -> impl Iterator<Item = FillBand<'a>> {
        self.check(picture);
        let rows = self.prepare(bands);
        let level = self.level;
        let (reach, kept) = (&self.reach, self.kept.as_ref());
        let source = fill::Source {
            classes: &self.classes,
            reach,
            kernel: &self.settings.kernel,
            picture,
            blind: false,
        };
        by_rows(&mut self.scratch, rows, self.pixels.height).map(move |(rows, patches)| FillBand {
            level,
            source,
            kept: kept.unwrap_or(reach),
            rows,
            patches,
        })
    }

    /// [`filter_complex`](Self::filter_complex) in about `bands` bands, none without
    /// [`Settings::half_lines`](crate::Settings::half_lines); call [`apply`](Self::apply) after it.
    pub fn complex_bands<'a>(
        &'a mut self,
        picture: &'a Picture,
        bands: usize,
    ) -> impl Iterator<Item = ComplexBand<'a>> {
        self.check(picture);
        let rows = self.prepare(bands);
        let level = self.level;
        let source = complex::Source {
            crossings: &self.crossings,
            pixels: &self.pixels,
            classes: &self.classes,
            picture,
        };
        let height = if self.settings.half_lines {
            self.pixels.height
        } else {
            0
        };
        by_rows(&mut self.scratch, rows, height).map(move |(rows, patches)| ComplexBand {
            level,
            source,
            rows,
            patches,
        })
    }

    /// [`antialias`](Self::antialias) in about `bands` bands; call [`apply`](Self::apply) after it.
    pub fn antialias_bands<'a>(
        &'a mut self,
        picture: &'a Picture,
        bands: usize,
    ) -> impl Iterator<Item = AntialiasBand<'a>> {
        self.check(picture);
        let rows = self.prepare(bands);
        let level = self.level;
        let source = antialias::Source {
            pixels: &self.pixels,
            classes: &self.classes,
            picture,
        };
        by_rows(&mut self.scratch, rows, self.pixels.height).map(move |(rows, patches)| AntialiasBand {
            level,
            source,
            rows,
            patches,
        })
    }

    /// Puts what [`fill_bands`](Self::fill_bands), [`complex_bands`](Self::complex_bands) or
    /// [`antialias_bands`](Self::antialias_bands) found into the picture; returns the number of pixels that changed.
    pub fn apply(&mut self, picture: &mut Picture) -> usize {
        self.check(picture);
        let mut count = 0;
        for scratch in &mut self.scratch {
            count += scratch.patches.len();
            picture.apply(&scratch.patches);
            scratch.patches.clear();
        }
        count
    }

    /// Rows in each of about `bands` bands; the last one may have fewer.
    pub fn rows_in_band(&self, bands: usize) -> usize {
        let height = self.pixels.height;
        // A multiple of the rows that share a depth limit.
        height.div_ceil(bands.clamp(1, height)).next_multiple_of(SHARED)
    }

    /// Rows in a band, and scratch memory for all bands.
    fn prepare(&mut self, bands: usize) -> usize {
        let height = self.pixels.height;
        let rows = self.rows_in_band(bands);
        let count = height.div_ceil(rows);
        if self.scratch.len() < count {
            self.scratch.resize_with(count, Scratch::default);
        }
        rows
    }

    #[track_caller]
    fn check(&self, picture: &Picture) {
        assert_eq!(
            picture.size(),
            self.size(),
            "the picture has another size than the image"
        );
    }
}

/// What knows of the samples in reach of each pixel.
fn reaching<'a>(
    pixels: &'a Pixels,
    classes: &'a Planes<CLASS_PLANES>,
    reach: &'a Planes<REACH_PLANES>,
    settings: &Settings,
) -> Source<'a> {
    Source {
        pixels,
        classes,
        reach,
        kernel: settings.kernel,
        fallback: settings.fallback.into(),
        linear: settings.linear,
    }
}

/// Bands of `rows` rows with their emptied patches.
fn by_rows(
    scratch: &mut [Scratch],
    rows: usize,
    height: usize,
) -> impl Iterator<Item = (std::ops::Range<usize>, &mut Patches)> {
    let starts = (0..height).step_by(rows);
    starts.zip(scratch).map(move |(start, scratch)| {
        scratch.patches.clear();
        (start..(start + rows).min(height), &mut scratch.patches)
    })
}

/// Rows whose edges are to be drawn; see [`EdgePointImage::rasterize_bands`].
#[derive(Debug)]
pub struct RasterizeBand<'a> {
    level: Level,
    edges: &'a EdgeList,
    occlusion: Option<Occlusion>,
    pixels: &'a Pixels,
    limits: BandLimits<'a>,
    scratch: &'a mut LimitScratch,
    crossings: BandCrossings<'a>,
    whole: bool,
}

impl RasterizeBand<'_> {
    /// Leaves out the half-pixel lines ([`Settings::half_lines`](crate::Settings::half_lines)): classes and reachability do without.
    #[must_use]
    pub fn whole_lines(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Does this part of the work.
    pub fn run(mut self) {
        if let Some(occlusion) = self.occlusion {
            simd::update_limits(self.level, &mut self.limits, self.pixels, occlusion, self.scratch);
        }
        self.crossings.clear();
        if self.whole {
            self.crossings = self.crossings.whole_lines();
        }
        let limits = self.occlusion.map(|_| &self.limits);
        simd::mark(self.level, self.edges, limits, &mut self.crossings);
    }
}

/// Rows to be classified; see [`EdgePointImage::classify_bands`].
#[derive(Debug)]
pub struct ClassifyBand<'a> {
    level: Level,
    crossings: &'a Crossings,
    first_row: usize,
    words: &'a mut [u16],
    planes: BandPlanes<'a, CLASS_PLANES>,
}

impl ClassifyBand<'_> {
    /// Does this part of the work.
    pub fn run(mut self) {
        simd::classify(
            self.level,
            self.crossings,
            self.first_row,
            self.words,
            &mut self.planes,
        );
    }
}

/// Rows whose reachability is to be found; see [`EdgePointImage::reach_bands`].
#[derive(Debug)]
pub struct ReachBand<'a> {
    level: Level,
    classes: &'a Planes<CLASS_PLANES>,
    width: usize,
    rows: (usize, usize),
    scratch: &'a mut ReachScratch,
    planes: BandPlanes<'a, REACH_PLANES>,
}

impl ReachBand<'_> {
    /// Does this part of the work.
    pub fn run(mut self) {
        simd::reach(
            self.level,
            self.classes,
            self.width,
            self.rows,
            self.scratch,
            &mut self.planes,
        );
    }
}

/// Rows to be interpolated; see [`EdgePointImage::interpolate_bands`].
#[derive(Debug)]
pub struct InterpolateBand<'a> {
    level: Level,
    source: Source<'a>,
    scratch: &'a mut InterpolateScratch,
    picture: PictureBand<'a>,
}

impl InterpolateBand<'_> {
    /// Does this part of the work.
    pub fn run(mut self) {
        simd::interpolate(self.level, self.source, self.scratch, &mut self.picture);
    }
}

/// Rows to be multiplied; see [`EdgePointImage::donor_bands`].
#[derive(Debug)]
pub struct DonorBand<'a> {
    level: Level,
    source: Source<'a>,
    of_samples: SampleValues<'a>,
    scratch: &'a mut DonorScratch,
    picture: PictureBand<'a>,
}

impl DonorBand<'_> {
    /// Hands out all rows.
    pub fn run(mut self, each: impl FnMut(DonorRow<'_>)) {
        let picture = &mut self.picture;
        donors::rows(
            self.level,
            self.source,
            self.of_samples,
            picture,
            self.scratch,
            each,
        );
    }
}

/// Rows whose gaps are to be filled; see [`EdgePointImage::fill_bands`].
#[derive(Debug)]
pub struct FillBand<'a> {
    level: Level,
    source: fill::Source<'a>,
    kept: &'a Planes<REACH_PLANES>,
    rows: std::ops::Range<usize>,
    patches: &'a mut Patches,
}

impl FillBand<'_> {
    /// Makes the pass one over edges, too: see [`EdgePointImage::fill_blindly`].
    #[must_use]
    pub fn blind(mut self) -> Self {
        self.source.blind = true;
        self
    }

    /// Makes the pass one over what was reachable when it was [kept](EdgePointImage::keep_reach), if ever it was.
    #[must_use]
    pub fn kept(mut self) -> Self {
        self.source.reach = self.kept;
        self
    }

    /// Makes the pass one over edges that takes the mean of the eight pixels around: see [`EdgePointImage::fill_evenly`].
    #[must_use]
    pub fn evenly(mut self) -> Self {
        self.source.kernel = &Kernel::EVEN;
        self.blind()
    }

    /// Does this part of the work.
    pub fn run(self) {
        simd::fill(self.level, self.source, self.rows, self.patches);
    }
}

/// Rows whose complex pixels are to be filtered; see [`EdgePointImage::complex_bands`].
#[derive(Debug)]
pub struct ComplexBand<'a> {
    level: Level,
    source: complex::Source<'a>,
    rows: std::ops::Range<usize>,
    patches: &'a mut Patches,
}

impl ComplexBand<'_> {
    /// Does this part of the work; for `factor` see [`EdgePointImage::filter_complex`].
    pub fn run(self, factor: impl Fn(u32, u32) -> Vec3) {
        simd::filter_complex(self.level, self.source, self.rows, &factor, self.patches);
    }
}

/// Rows whose simple pixels are to be blended; see [`EdgePointImage::antialias_bands`].
#[derive(Debug)]
pub struct AntialiasBand<'a> {
    level: Level,
    source: antialias::Source<'a>,
    rows: std::ops::Range<usize>,
    patches: &'a mut Patches,
}

impl AntialiasBand<'_> {
    /// Does this part of the work.
    pub fn run(self) {
        simd::antialias(self.level, self.source, self.rows, self.patches);
    }
}
