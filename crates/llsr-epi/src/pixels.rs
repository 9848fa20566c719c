//! The pixels of the edge-and-point image: ten bytes each.

use glam::{Vec2, Vec3};

use crate::code::EdgeCode;
use crate::colour::{Packed, pack_colour, pack_depth, unpack_colour, unpack_depth};

/// Lowest bit of the sample's position in a pixel word; the edge code lies below.
pub(crate) const POSITION_SHIFT: u32 = 10;
/// Set if the pixel has a sample.
pub(crate) const SAMPLE: u16 = 1 << 14;
/// Bit number in a word that says that the sample lies in the right half of its region, and that in the low bits of colours that says that it
/// lies in the lower half.
pub(crate) const HALF_SHIFT: u32 = 15;
/// Bit number of [`SAMPLE`].
pub(crate) const SAMPLE_SHIFT: u32 = 14;

/// A shaded point on its way into the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Where it projects to, in pixels from the top left corner, y downwards.
    pub position: Vec2,
    /// Distance from the eye along the view axis (the w of clip space), positive; infinite for the background.
    pub depth: f32,
    /// What is to be interpolated, linear, components in [0, [`MAX_COMPONENT`](crate::MAX_COMPONENT)]: radiance, or
    /// irradiance if the picture is multiplied by an albedo afterwards.
    pub colour: Vec3,
}

/// The sample of a pixel as it is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Quarter-pixel region in which it lies: 4 * row + column, each 0..4.
    pub position: u8,
    /// Where within that region: bit 0 in its right half, bit 1 in its lower half.
    pub eighth: u8,
    /// Depth, rounded up by at most 1/1023.
    pub depth: f32,
    /// Colour with 14 bits to the largest component.
    pub colour: Vec3,
}

/// Structure of arrays: 2 + 4 + 4 bytes a pixel.
#[derive(Clone, Debug)]
pub(crate) struct Pixels {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Pixels from one row to the next: a multiple of 64.
    pub(crate) stride: usize,
    /// Bits 0-9 edge code, 10-13 position of the sample, 14 has a sample, 15 it lies in the right half of its quarter.
    pub(crate) words: Vec<u16>,
    /// High bits of shared-exponent colours; 0 without a sample.
    pub(crate) colours: Vec<u32>,
    /// Depth in the high half, low bits of the colour in the low one, whose bit 15 says that the sample lies in the lower half of its quarter;
    /// 0 without a sample.
    pub(crate) cache: Vec<u32>,
}

impl Pixels {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let stride = width.next_multiple_of(64);
        let count = stride * height;
        Self {
            width,
            height,
            stride,
            words: vec![0; count],
            colours: vec![0; count],
            cache: vec![0; count],
        }
    }

    pub(crate) fn clear_samples(&mut self) {
        self.words.fill(0);
        self.colours.fill(0);
        self.cache.fill(0);
    }

    /// Puts a point into its pixel unless it lies outside, is not finite, or the pixel has a nearer one.
    pub(crate) fn insert(&mut self, point: &Point) -> bool {
        let Vec2 { x, y } = point.position;
        // Comparisons that are false for NaN.
        if !(x >= 0.0 && y >= 0.0 && x < self.width as f32 && y < self.height as f32 && point.depth > 0.0) {
            return false;
        }
        let (column, row) = (x as usize, y as usize);
        let eighth = |v: f32| ((v - v.floor()) * 8.0) as u16;
        let (right, down) = (eighth(x), eighth(y));
        let position = 4 * (down >> 1) + (right >> 1);
        let index = row * self.stride + column;
        let depth = pack_depth(point.depth);
        let word = self.words[index];
        if word & SAMPLE != 0 && depth >= (self.cache[index] >> 16) as u16 {
            return false;
        }
        self.words[index] = word & EdgeCode::BITS | position << POSITION_SHIFT | SAMPLE | right << HALF_SHIFT;
        let colour = pack_colour(point.colour);
        self.colours[index] = colour.coarse;
        self.cache[index] = u32::from(depth) << 16 | u32::from(colour.fine | down << HALF_SHIFT);
        true
    }

    pub(crate) fn remove(&mut self, x: usize, y: usize) {
        let index = y * self.stride + x;
        self.words[index] &= EdgeCode::BITS;
        self.colours[index] = 0;
        self.cache[index] = 0;
    }

    pub(crate) fn sample(&self, x: usize, y: usize) -> Option<Sample> {
        let index = y * self.stride + x;
        let word = self.words[index];
        (word & SAMPLE != 0).then(|| Sample {
            position: (word >> POSITION_SHIFT & 15) as u8,
            eighth: (word >> HALF_SHIFT) as u8 | ((self.cache[index] >> HALF_SHIFT & 1) as u8) << 1,
            depth: unpack_depth((self.cache[index] >> 16) as u16),
            colour: self.colour(index),
        })
    }

    /// The colour of the sample of a pixel; black without one.
    #[inline]
    pub(crate) fn colour(&self, index: usize) -> Vec3 {
        unpack_colour(Packed {
            coarse: self.colours[index],
            fine: self.cache[index] as u16,
        })
    }

    #[inline]
    pub(crate) fn code(&self, x: usize, y: usize) -> EdgeCode {
        EdgeCode::from_word(self.words[y * self.stride + x])
    }
}
