//! Where points fall: a view-projection and the size of the picture.

use glam::{Mat4, Vec3, Vec4};

use crate::Error;

/// The largest width and height of a picture in pixels.
pub const MAX_SIDE: u32 = 16_384;

/// Eighths of a pixel, each way.
pub(crate) const EIGHTHS: f32 = 8.0;

/// A camera and a picture: maps points to pixel, position within the pixel and depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Over the point (x, y, z, 1): column and row in eighths of a pixel, both before the division, the divisor w, and the
    /// depth.
    pub(crate) rows: [Vec4; 4],
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// The error of a size that no picture can have.
pub(crate) fn check_size(width: u32, height: u32) -> Result<(), Error> {
    if (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height) {
        Ok(())
    } else {
        Err(Error::Size { width, height })
    }
}

/// Where a point falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Column of the pixel, 0 at the left.
    pub x: u32,
    /// Row of the pixel, 0 at the top.
    pub y: u32,
    /// Quarter-pixel region: `4 * row + column` within the pixel, 0 at the top left, below 16 (BWG03 section 4.3).
    pub region: u8,
    /// Where within that region: bit 0 in its right half, bit 1 in its lower half.
    pub eighth: u8,
    /// Depth along the view, in the unit of the scene; above 0.
    pub depth: f32,
}

impl View {
    /// A view by a 4x4 matrix to clip space (x, y, z, w): the picture is x and y in [-w, w] with y up, and w is the
    /// depth. z is not looked at, so any depth range will do.
    ///
    /// Under a matrix with NaNs no point falls into the picture.
    ///
    /// # Errors
    /// [`Error::Size`] if a side is 0 or above [`MAX_SIDE`].
    pub fn new(view_projection: &Mat4, width: u32, height: u32) -> Result<Self, Error> {
        check_size(width, height)?;
        let (x, y, w) = (
            view_projection.row(0),
            view_projection.row(1),
            view_projection.row(3),
        );
        let half = |side: u32| 0.5 * EIGHTHS * side as f32;
        Ok(Self {
            rows: [(x + w) * half(width), (w - y) * half(height), w, w],
            width,
            height,
        })
    }

    /// The same view with another depth: the dot product of `depth` and (x, y, z, 1), above 0 in front of the eye.
    ///
    /// Parallel projections need it, for their w is 1 everywhere.
    #[must_use]
    pub fn with_depth(mut self, depth: Vec4) -> Self {
        self.rows[3] = depth;
        self
    }

    /// Width and height of the picture in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Where `position` falls; `None` outside the picture, behind the eye, or if it is not finite.
    #[inline]
    pub fn project(&self, position: Vec3) -> Option<Projected> {
        let [x, y, z] = position.to_array();
        // The order of these operations is that of the SIMD kernels.
        let [across, down, w, depth] = self.rows.map(|r| (r.x * x + r.y * y) + (r.z * z + r.w));
        let inverse = 1.0 / w;
        let (across, down) = (across * inverse, down * inverse);
        let inside = w > 0.0
            && depth > 0.0
            && depth < f32::INFINITY
            && across >= 0.0
            && down >= 0.0
            && across < EIGHTHS * self.width as f32
            && down < EIGHTHS * self.height as f32;
        if !inside {
            return None;
        }
        let (across, down) = (across as u32, down as u32);
        Some(Projected {
            x: across >> 3,
            y: down >> 3,
            region: ((down & 6) << 1 | (across & 6) >> 1) as u8,
            eighth: ((down & 1) << 1 | across & 1) as u8,
            depth,
        })
    }
}
