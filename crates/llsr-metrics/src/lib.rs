//! How far apart two linear RGB images are: one number each way, and a map of where.
//!
//! A is the image under test, B the reference. [`compare`] answers in the two ways that matter for rendered
//! images:
//!
//! - on the **linear** values, in the unit of the image (lux, W/m2, radiance): root mean square error and the
//!   same relative to the mean of B. These say whether the light is right.
//! - on the **display form** of both: values divided by a common white (98th percentile of B unless given),
//!   clamped to [0, 1] and sRGB-encoded. Largest difference, PSNR with peak 1, and FLIP, which says what a
//!   person would see when flipping between the two on a screen at a stated number of pixels per degree.
//!
//! Pixels that are not finite make the comparison an [`Error::NonFinite`] that counts them: no measure of a
//! picture with NaNs in it means anything.
//!
//! ```
//! use llsr_metrics::{Image, Options, compare};
//!
//! let reference = vec![[0.2, 0.4, 0.6]; 32 * 24];
//! let mut test = reference.clone();
//! test[5 * 32 + 7] = [0.6, 0.4, 0.2];
//!
//! let a = Image::new(32, 24, &test)?;
//! let b = Image::new(32, 24, &reference)?;
//! let comparison = compare(a, b, &Options::default())?;
//! assert!(comparison.rmse > 0.0 && comparison.flip > 0.0);
//! // The map says where: the error is largest at the pixel that changed.
//! assert_eq!(comparison.map.largest(), (7, 5));
//! # Ok::<(), llsr_metrics::Error>(())
//! ```
//!
//! With the feature `rayon` the FLIP map is computed on rayon's threads, to the same bits.

mod bands;
mod display;
mod error;
mod flip;
mod heat;
mod image;
mod measures;

pub use display::percentile;
pub use error::Error;
pub use flip::{ErrorMap, Flip};
pub use heat::heat_colour;
pub use image::Image;
pub use measures::{Comparison, Options, compare, linear_rmse};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
