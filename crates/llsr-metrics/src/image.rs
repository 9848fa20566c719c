//! A borrowed linear RGB image.

use crate::Error;

/// A borrowed linear RGB image: scan lines from the top, the left pixel first.
///
/// A flat `&[f32]` becomes pixels by `flat.as_chunks::<3>().0`.
#[derive(Clone, Copy, Debug)]
pub struct Image<'a> {
    width: usize,
    pixels: &'a [[f32; 3]],
}

impl<'a> Image<'a> {
    /// Views `pixels` as an image of `width` x `height`.
    ///
    /// # Errors
    /// [`Error::Empty`] if a side is 0, [`Error::PixelCount`] if there are not `width * height` pixels.
    pub fn new(width: usize, height: usize, pixels: &'a [[f32; 3]]) -> Result<Self, Error> {
        if width == 0 || height == 0 {
            return Err(Error::Empty { width, height });
        }
        if width.checked_mul(height) != Some(pixels.len()) {
            return Err(Error::PixelCount {
                width,
                height,
                found: pixels.len(),
            });
        }
        Ok(Self { width, pixels })
    }

    /// Width in pixels, at least 1.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels, at least 1.
    pub fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    /// All pixels, scan line by scan line.
    pub fn pixels(&self) -> &'a [[f32; 3]] {
        self.pixels
    }

    /// One scan line; 0 is the top.
    pub(crate) fn row(&self, y: usize) -> &'a [[f32; 3]] {
        &self.pixels[y * self.width..][..self.width]
    }
}

/// Refuses images of different size or with pixels that are not finite.
pub(crate) fn check_pair(a: Image<'_>, b: Image<'_>) -> Result<(), Error> {
    let size = |image: Image<'_>| (image.width(), image.height());
    if size(a) != size(b) {
        return Err(Error::Sizes {
            a: size(a),
            b: size(b),
        });
    }
    let bad = |pixel: &[f32; 3]| !pixel.iter().all(|v| v.is_finite());
    let count = |image: Image<'_>| image.pixels.iter().filter(|&pixel| bad(pixel)).count();
    let (bad_a, bad_b) = (count(a), count(b));
    if bad_a + bad_b == 0 {
        return Ok(());
    }
    let mut pairs = a.pixels.iter().zip(b.pixels);
    let first = pairs.position(|(pa, pb)| bad(pa) || bad(pb)).unwrap_or(0);
    Err(Error::NonFinite {
        a: bad_a,
        b: bad_b,
        first: (first % a.width, first / a.width),
    })
}
