//! What a constructor can refuse.

use std::fmt;

/// What a constructor refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// A picture with a side of 0 or of more than [`MAX_SIDE`](crate::MAX_SIDE) pixels.
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// A store of no points or of more than [`MAX_CAPACITY`](crate::MAX_CAPACITY).
    Capacity(usize),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Size { width, height } => {
                write!(
                    f,
                    "a picture of {width} x {height} pixels: sides must be 1 to {}",
                    crate::MAX_SIDE
                )
            }
            Self::Capacity(points) => {
                write!(
                    f,
                    "room for {points} points: it must be 1 to {}",
                    crate::MAX_CAPACITY
                )
            }
        }
    }
}

impl std::error::Error for Error {}
