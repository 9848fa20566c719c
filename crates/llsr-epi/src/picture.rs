//! What comes out: linear colours, and where samples are wanted.

use glam::Vec3;

use crate::planes::{BandPlanes, Planes, outside_of_last_word};

/// Priority of a pixel that reaches no sample.
pub const UNREACHED: u8 = 255;

/// A picture of linear colours with the sampling priority of each pixel.
///
/// Keep one and reuse it. Rows are padded to 64 pixels inside; [`row`](Self::row) shows the picture only.
#[derive(Clone, Debug)]
pub struct Picture {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) stride: usize,
    pub(crate) red: Vec<f32>,
    pub(crate) green: Vec<f32>,
    pub(crate) blue: Vec<f32>,
    pub(crate) priority: Vec<u8>,
    /// Bit set: the pixel has a colour made of reachable samples.
    pub(crate) coloured: Planes<1>,
}

impl Picture {
    /// A black picture. See [`EdgePointImage::new`](crate::EdgePointImage::new) for the sizes that fit together.
    pub fn new(width: u32, height: u32) -> Self {
        let (width, height) = (width as usize, height as usize);
        let stride = width.next_multiple_of(64);
        let plane = vec![0.0; stride * height];
        Self {
            width,
            height,
            stride,
            red: plane.clone(),
            green: plane.clone(),
            blue: plane,
            priority: vec![UNREACHED; stride * height],
            coloured: Planes::new(width, height),
        }
    }

    /// Size in pixels: width, height.
    pub fn size(&self) -> (u32, u32) {
        (self.width as u32, self.height as u32)
    }

    /// The colour of a pixel, linear, in the unit of the samples.
    ///
    /// # Panics
    /// If the pixel lies outside the picture.
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> Vec3 {
        let i = self.index(x, y);
        Vec3::new(self.red[i], self.green[i], self.blue[i])
    }

    /// Sets the colour of a pixel and marks it as coloured.
    ///
    /// # Panics
    /// If the pixel lies outside the picture.
    pub fn set_pixel(&mut self, x: u32, y: u32, colour: Vec3) {
        let i = self.index(x, y);
        (self.red[i], self.green[i], self.blue[i]) = colour.into();
        self.coloured.set(0, x as usize, y as usize);
    }

    /// The red, green and blue components of a row from left to right.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, y: u32) -> [&[f32]; 3] {
        let range = y as usize * self.stride..y as usize * self.stride + self.width;
        [
            &self.red[range.clone()],
            &self.green[range.clone()],
            &self.blue[range],
        ]
    }

    /// Sampling priorities of a row: 0 for a pixel with a sample of its own, 1..=254 the higher the less filter weight
    /// fell on reachable samples, [`UNREACHED`] where there was none (BWG03 section 5.3).
    ///
    /// # Panics
    /// If there is no such row.
    pub fn priorities(&self, y: u32) -> &[u8] {
        &self.priority[y as usize * self.stride..][..self.width]
    }

    /// Does the pixel have a colour made of samples, its own, reachable ones or ones passed on by
    /// [`fill`](crate::EdgePointImage::fill)? False where only the fallback colour stands.
    ///
    /// # Panics
    /// If the pixel lies outside the picture.
    pub fn is_coloured(&self, x: u32, y: u32) -> bool {
        self.index(x, y);
        self.coloured.row(y as isize).bit(0, x as isize)
    }

    /// Number of pixels without a colour, as [`is_coloured`](Self::is_coloured) tells them.
    pub fn uncoloured(&self) -> usize {
        let words = self.coloured.words;
        let row = |y: usize| {
            let coloured = &self.coloured.row(y as isize).plane(0)[1..=words];
            let zeros: usize = coloured.iter().map(|bits| bits.count_zeros() as usize).sum();
            // Beyond the picture all count as without.
            let last = coloured[words - 1] | !outside_of_last_word(self.width);
            zeros - last.count_zeros() as usize
        };
        (0..self.height).map(row).sum()
    }

    /// Multiplies each pixel by `factor(x, y)`, row by row: for a picture of irradiance, albedo / pi gives radiance.
    ///
    /// Do this between interpolation and anti-aliasing, with the albedo of the pixel's primary region
    /// ([`EdgePointImage::primary_position`](crate::EdgePointImage::primary_position) is a point of it), so that
    /// textures stay as sharp as the pixels and edges between materials are blended with the right colours on both sides.
    pub fn multiply(&mut self, mut factor: impl FnMut(u32, u32) -> Vec3) {
        for y in 0..self.height {
            for x in 0..self.width {
                let i = y * self.stride + x;
                let factor = factor(x as u32, y as u32);
                self.red[i] *= factor.x;
                self.green[i] *= factor.y;
                self.blue[i] *= factor.z;
            }
        }
    }

    #[track_caller]
    fn index(&self, x: u32, y: u32) -> usize {
        let (x, y) = (x as usize, y as usize);
        assert!(
            x < self.width && y < self.height,
            "pixel ({x}, {y}) outside {}x{}",
            self.width,
            self.height
        );
        y * self.stride + x
    }

    pub(crate) fn bands_mut(&mut self, rows: usize) -> impl Iterator<Item = PictureBand<'_>> {
        let rows = rows.max(1);
        let (stride, height) = (self.stride, self.height);
        let pixels = rows * stride;
        self.red
            .chunks_mut(pixels)
            .zip(self.green.chunks_mut(pixels))
            .zip(self.blue.chunks_mut(pixels))
            .zip(self.priority.chunks_mut(pixels))
            .zip(self.coloured.bands_mut(rows))
            .enumerate()
            .map(
                move |(i, ((((red, green), blue), priority), coloured))| PictureBand {
                    first_row: i * rows,
                    end_row: (i * rows + rows).min(height),
                    stride,
                    red,
                    green,
                    blue,
                    priority,
                    coloured,
                },
            )
    }
}

/// Rows of a picture to write to.
#[derive(Debug)]
pub(crate) struct PictureBand<'a> {
    pub(crate) first_row: usize,
    pub(crate) end_row: usize,
    pub(crate) stride: usize,
    pub(crate) red: &'a mut [f32],
    pub(crate) green: &'a mut [f32],
    pub(crate) blue: &'a mut [f32],
    pub(crate) priority: &'a mut [u8],
    pub(crate) coloured: BandPlanes<'a, 1>,
}
