//! FLIP for images of low dynamic range.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Moller, M. Oskarsson, K. Astrom, M. D. Fairchild, "FLIP: A Difference
//! Evaluator for Alternating Images", Proceedings of the ACM on Computer Graphics and Interactive Techniques
//! 3(2), 2020. Section numbers below are of that paper.
//!
//! The two-dimensional filters of the paper are products of one-dimensional ones, so each scan line is filtered
//! once horizontally into seven planes, and the planes vertically where the result is needed. Beyond the border
//! the pixel at the border continues.

mod colour;
mod kernels;

use crate::image::check_pair;
use crate::{Error, Image, bands, heat_colour};
use colour::{Colours, hyab};
use kernels::{Kernel, Kernels};

/// Exponent on the colour difference, and the two points that the redistribution maps onto each other:
/// share of the largest difference, share of the result (section 4.1.3).
const COLOUR_EXPONENT: f32 = 0.7;
const KNEE: f32 = 0.4;
const KNEE_RESULT: f32 = 0.95;

/// Planes of one horizontally filtered image: Y for the achromatic filter, Cx, Cz for both blue-yellow terms,
/// then the luminance for the feature detectors: Gaussian, first and second derivative.
const PLANES: usize = 7;

/// FLIP at one number of pixels per degree.
///
/// ```
/// use llsr_metrics::{Flip, Image};
///
/// let flip = Flip::new(67.0)?;
/// let (white, black) = ([[1.0; 3]; 64], [[0.0; 3]; 64]);
/// let map = flip.map(Image::new(8, 8, &white)?, Image::new(8, 8, &black)?)?;
/// assert!(map.mean() > 0.95, "white for black is close to the largest difference there is");
/// # Ok::<(), llsr_metrics::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Flip {
    kernels: Kernels,
    colours: Colours,
    /// The largest colour difference to the power of [`COLOUR_EXPONENT`].
    largest: f32,
}

/// FLIP of each pixel: 0 (no visible difference) to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    width: usize,
    values: Vec<f32>,
}

impl Flip {
    /// Prepares the filters for a number of pixels per degree of visual angle, in [1, 1000].
    ///
    /// # Errors
    /// [`Error::PixelsPerDegree`] outside that range.
    pub fn new(pixels_per_degree: f64) -> Result<Self, Error> {
        if !(1.0..=1000.0).contains(&pixels_per_degree) {
            return Err(Error::PixelsPerDegree(pixels_per_degree));
        }
        let colours = Colours::new();
        let largest = colours.largest_difference().powf(COLOUR_EXPONENT);
        Ok(Self {
            kernels: Kernels::new(pixels_per_degree),
            colours,
            largest,
        })
    }

    /// FLIP of `a` against the reference `b`, both linear sRGB with white at 1 (values are clamped to [0, 1]).
    ///
    /// # Errors
    /// [`Error::Sizes`] for different sizes, [`Error::NonFinite`] if a pixel of either is NaN or infinite.
    ///
    /// # Cost
    /// Linear in pixels times pixels per degree; the scratch memory is a band of scan lines per thread.
    pub fn map(&self, a: Image<'_>, b: Image<'_>) -> Result<ErrorMap, Error> {
        check_pair(a, b)?;
        Ok(self.map_checked(a, b, 1.0))
    }

    /// As [`Self::map`] for images that [`check_pair`] accepts, with values over `white`.
    pub(crate) fn map_checked(&self, a: Image<'_>, b: Image<'_>, white: f32) -> ErrorMap {
        let width = a.width();
        // Tall enough that the scan lines filtered twice, above and below a band, are a minority.
        let band = (4 * self.kernels.radius()).max(64);
        let mut values = vec![0.0; a.pixels().len()];
        let init = || Band::new(width, self.kernels.radius());
        bands::for_each(&mut values, width, band, init, |scratch, first, out| {
            self.band(a, b, white, first, out, scratch);
        });
        ErrorMap { width, values }
    }

    fn band(
        &self,
        a: Image<'_>,
        b: Image<'_>,
        white: f32,
        first: usize,
        out: &mut [f32],
        scratch: &mut Band,
    ) {
        let width = a.width();
        let radius = self.kernels.radius();
        let rows = out.len() / width;
        // Filtered rows are kept for first - radius .. first + rows + radius, within the image.
        let top = first.saturating_sub(radius);
        let bottom = (first + rows + radius).min(a.height());
        for (image, side) in [a, b].into_iter().zip(&mut scratch.sides) {
            side.horizontal.resize((bottom - top) * PLANES * width, 0.0);
            for (y, planes) in (top..bottom).zip(side.horizontal.chunks_exact_mut(PLANES * width)) {
                self.horizontal(image.row(y), white, &mut scratch.padded, planes);
            }
        }
        for (y, line) in (first..).zip(out.chunks_exact_mut(width)) {
            for side in &mut scratch.sides {
                self.vertical(side, y, top, a.height(), width);
            }
            let [side_a, side_b] = &scratch.sides;
            for (x, value) in line.iter_mut().enumerate() {
                let colour = self.colour_difference(side_a.opponent(x, width), side_b.opponent(x, width));
                let feature = feature_difference(side_a.features(x, width), side_b.features(x, width));
                *value = colour.powf(1.0 - feature);
            }
        }
    }

    fn horizontal(&self, row: &[[f32; 3]], white: f32, padded: &mut [Vec<f32>; 3], planes: &mut [f32]) {
        let width = row.len();
        let pad = self.kernels.radius();
        for (x, &pixel) in row.iter().enumerate() {
            let opponent = self.colours.opponent(pixel.map(|v| (v / white).clamp(0.0, 1.0)));
            for (channel, value) in padded.iter_mut().zip(opponent) {
                channel[pad + x] = value;
            }
        }
        for channel in padded.iter_mut() {
            let (left, right) = (channel[pad], channel[pad + width - 1]);
            channel[..pad].fill(left);
            channel[pad + width..].fill(right);
        }
        let k = &self.kernels;
        let [y, cx, cz] = padded;
        let plan: [(&Kernel, &[f32]); PLANES] = [
            (&k.achromatic, y),
            (&k.red_green, cx),
            (&k.blue_yellow[0], cz),
            (&k.blue_yellow[1], cz),
            (&k.gaussian, y),
            (&k.edge, y),
            (&k.point, y),
        ];
        for ((kernel, channel), out) in plan.into_iter().zip(planes.chunks_exact_mut(width)) {
            out.fill(0.0);
            for (j, &tap) in kernel.taps().iter().enumerate() {
                add_scaled(out, &channel[pad - kernel.radius() + j..][..width], tap);
            }
        }
    }

    /// Filters vertically around row `y` into `side.line`.
    fn vertical(&self, side: &mut Side, y: usize, top: usize, height: usize, width: usize) {
        let k = &self.kernels;
        // Filter, plane it reads, line it adds to.
        let plan: [(&Kernel, usize, usize); 8] = [
            (&k.achromatic, 0, 0),
            (&k.red_green, 1, 1),
            (&k.blue_yellow_weighted[0], 2, 2),
            (&k.blue_yellow_weighted[1], 3, 2),
            (&k.gaussian, 5, 3),
            (&k.edge, 4, 4),
            (&k.gaussian, 6, 5),
            (&k.point, 4, 6),
        ];
        side.line.fill(0.0);
        for (kernel, plane, target) in plan {
            let out = &mut side.line[target * width..][..width];
            for (j, &tap) in kernel.taps().iter().enumerate() {
                let source = (y + j).saturating_sub(kernel.radius()).min(height - 1) - top;
                add_scaled(
                    out,
                    &side.horizontal[(source * PLANES + plane) * width..][..width],
                    tap,
                );
            }
        }
    }

    /// Sections 4.1.2 and 4.1.3: HyAB on Hunt-adjusted CIELAB, compressed and mapped to [0, 1].
    fn colour_difference(&self, a: [f32; 3], b: [f32; 3]) -> f32 {
        let difference = hyab(self.colours.hunt_lab(a), self.colours.hunt_lab(b)).powf(COLOUR_EXPONENT);
        let knee = KNEE * self.largest;
        let share = if difference < knee {
            KNEE_RESULT / knee * difference
        } else {
            KNEE_RESULT + (difference - knee) / (self.largest - knee) * (1.0 - KNEE_RESULT)
        };
        share.min(1.0)
    }
}

/// Section 4.2: the larger of the differences of edge and point content, as exponent of section 4.3.
fn feature_difference(a: [f32; 4], b: [f32; 4]) -> f32 {
    let length = |x: f32, y: f32| (x * x + y * y).sqrt();
    let edge = length(a[0], a[1]) - length(b[0], b[1]);
    let point = length(a[2], a[3]) - length(b[2], b[3]);
    // The detectors see the luminance in [0, 1], the planes hold 116 times it (and a constant that they ignore).
    let largest = edge.abs().max(point.abs()) / 116.0;
    (std::f32::consts::FRAC_1_SQRT_2 * largest).sqrt().min(1.0)
}

fn add_scaled(out: &mut [f32], source: &[f32], scale: f32) {
    for (o, s) in out.iter_mut().zip(source) {
        *o += scale * s;
    }
}

/// Scratch memory for one band.
struct Band {
    /// One scan line of each opponent channel, continued at both ends.
    padded: [Vec<f32>; 3],
    sides: [Side; 2],
}

/// Scratch memory for one of the two images.
struct Side {
    /// Horizontally filtered scan lines, `PLANES` each.
    horizontal: Vec<f32>,
    /// One fully filtered scan line: opponent channels, edge in x and y, point in x and y.
    line: Vec<f32>,
}

impl Band {
    fn new(width: usize, radius: usize) -> Self {
        let side = || Side {
            horizontal: Vec::new(),
            line: vec![0.0; PLANES * width],
        };
        Self {
            padded: [(); 3].map(|()| vec![0.0; width + 2 * radius]),
            sides: [side(), side()],
        }
    }
}

impl Side {
    fn opponent(&self, x: usize, width: usize) -> [f32; 3] {
        [0, 1, 2].map(|i| self.line[i * width + x])
    }

    fn features(&self, x: usize, width: usize) -> [f32; 4] {
        [3, 4, 5, 6].map(|i| self.line[i * width + x])
    }
}

impl ErrorMap {
    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.values.len() / self.width
    }

    /// The error of each pixel, 0 to 1, scan line by scan line.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The mean error, 0 to 1.
    pub fn mean(&self) -> f64 {
        let row_sum = |row: &[f32]| row.iter().map(|&v| f64::from(v)).sum::<f64>();
        self.values.chunks_exact(self.width).map(row_sum).sum::<f64>() / self.values.len() as f64
    }

    /// Column and row of the largest error; of several equal ones the first in scan-line order.
    pub fn largest(&self) -> (usize, usize) {
        let mut best = 0;
        for (i, value) in self.values.iter().enumerate() {
            if *value > self.values[best] {
                best = i;
            }
        }
        (best % self.width, best / self.width)
    }

    /// The map as sRGB colours, see [`heat_colour`].
    pub fn heat(&self) -> Vec<[u8; 3]> {
        self.values.iter().map(|&v| heat_colour(v)).collect()
    }
}
