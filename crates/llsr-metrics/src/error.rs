//! Why two images cannot be compared.

use std::fmt;

/// Why two images cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// An image has no pixels.
    Empty {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
    /// The number of pixels given is not width times height.
    PixelCount {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Number of pixels given.
        found: usize,
    },
    /// The two images have different sizes (width, height).
    Sizes {
        /// Size of the image under test.
        a: (usize, usize),
        /// Size of the reference.
        b: (usize, usize),
    },
    /// Pixels with a NaN or infinite channel.
    NonFinite {
        /// How many pixels of the image under test.
        a: usize,
        /// How many pixels of the reference.
        b: usize,
        /// Column and row of the first of them, in scan-line order.
        first: (usize, usize),
    },
    /// Pixels per degree outside [1, 1000] or not a number.
    PixelsPerDegree(f64),
    /// A white that is not finite and above 0.
    White(f32),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Empty { width, height } => write!(f, "an image of {width} x {height} has no pixels"),
            Self::PixelCount { width, height, found } => {
                write!(f, "{found} pixels were given for an image of {width} x {height}")
            }
            Self::Sizes { a, b } => {
                write!(
                    f,
                    "the images differ in size: {} x {} against {} x {}",
                    a.0, a.1, b.0, b.1
                )
            }
            Self::NonFinite { a, b, first } => write!(
                f,
                "{a} pixels of the first and {b} of the second image are NaN or infinite, the first of them at \
                 column {}, row {}",
                first.0, first.1
            ),
            Self::PixelsPerDegree(value) => write!(f, "{value} pixels per degree is not in [1, 1000]"),
            Self::White(value) => write!(f, "a white of {value} is not a finite number above 0"),
        }
    }
}

impl std::error::Error for Error {}
