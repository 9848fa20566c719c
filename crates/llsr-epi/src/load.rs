//! Samples taken over from planes of projected points, a whole picture at a time.

use crate::code::EdgeCode;
use crate::colour::pack_depth;
use crate::image::EdgePointImage;
use crate::pixels::{HALF_SHIFT, POSITION_SHIFT, Pixels};
use crate::simd;

/// Projected points of a picture in planes, rows `stride` pixels apart: what a cache of points has anyway.
#[derive(Clone, Copy, Debug)]
pub struct SamplePlanes<'a> {
    /// Pixels from one row to the next, at least the width of the picture.
    pub stride: usize,
    /// Bits 0-3 the quarter-pixel region 4 * row + column, bit 4 set if there is a point, bit 5 if it lies in the right half of its region, bit 6
    /// if in the lower half; bit 7 is ignored.
    pub region: &'a [u8],
    /// Distance along the view axis, as [`Point::depth`](crate::Point::depth); read only where there is a point.
    pub depth: &'a [f32],
    /// Colours with mantissas of 14 bits: component = mantissa * 2^(exponent - 25). The nine high bits of the mantissas, bits 0-8 red,
    /// 9-17 green, 18-26 blue, and the exponent in bits 27-31.
    pub colour: &'a [u32],
    /// The five low bits of the mantissas: bits 0-4 red, 5-9 green, 10-14 blue; bit 15 is ignored.
    pub fine: &'a [u16],
}

/// Bits of a region byte that go into the word of a pixel.
const REGION: u8 = 0x3f;
/// Of these the one that goes with the low bits of colours, and how far.
const LOWER: u8 = 0x40;
const LOWER_SHIFT: u32 = HALF_SHIFT - LOWER.trailing_zeros();
/// Set in a region byte if there is a point.
const OCCUPIED: u8 = 0x10;
/// Bits of the low parts of mantissas that mean something.
const FINE_BITS: u16 = 0x7fff;

impl EdgePointImage {
    /// Replaces all samples by those of `planes`. The same samples as [`insert`](Self::insert) makes of
    /// points in these regions, several times faster.
    ///
    /// # Panics
    /// If the planes are smaller than the picture.
    pub fn load_samples(&mut self, planes: SamplePlanes<'_>) {
        self.load(planes, true);
    }

    /// The same for places and depths alone, for an image that is drawn to find what is hidden and reachable: the colours of its samples are
    /// anything until they are loaded whole.
    ///
    /// # Panics
    /// If the planes are smaller than the picture.
    pub fn load_places(&mut self, planes: SamplePlanes<'_>) {
        self.load(planes, false);
    }

    fn load(&mut self, planes: SamplePlanes<'_>, colours: bool) {
        let (width, height) = (self.pixels.width, self.pixels.height);
        let needed = planes.stride * (height - 1) + width;
        let shortest = planes
            .region
            .len()
            .min(planes.depth.len())
            .min(planes.colour.len())
            .min(planes.fine.len());
        assert!(
            planes.stride >= width && shortest >= needed,
            "planes of {shortest} samples, {} a row, for a picture of {width}x{height}",
            planes.stride
        );
        simd::load(self.level, planes, colours, &mut self.pixels);
    }
}

/// Takes over all rows.
#[inline(always)]
pub(crate) fn load(planes: SamplePlanes<'_>, with_colours: bool, pixels: &mut Pixels) {
    let width = pixels.width;
    for y in 0..pixels.height {
        let from = y * planes.stride..y * planes.stride + width;
        let to = y * pixels.stride..y * pixels.stride + width;
        let region = &planes.region[from.clone()][..width];
        let depth = &planes.depth[from.clone()][..width];
        let colour = &planes.colour[from.clone()][..width];
        let fine = &planes.fine[from][..width];
        let words = &mut pixels.words[to.clone()][..width];
        let colours = &mut pixels.colours[to.clone()][..width];
        let cache = &mut pixels.cache[to][..width];
        for (word, region) in words.iter_mut().zip(region) {
            // The mark of a point lies right above the region and right below that of its right half, as in the word of a pixel.
            *word = *word & EdgeCode::BITS | u16::from(region & REGION) << POSITION_SHIFT;
        }
        if !with_colours {
            for x in 0..width {
                let there = if region[x] & OCCUPIED == 0 { 0 } else { u32::MAX };
                cache[x] = u32::from(pack_depth(depth[x])) << 16 & there;
            }
            continue;
        }
        for x in 0..width {
            let there = if region[x] & OCCUPIED == 0 { 0 } else { u32::MAX };
            colours[x] = colour[x] & there;
            let low = fine[x] & FINE_BITS | u16::from(region[x] & LOWER) << LOWER_SHIFT;
            cache[x] = (u32::from(pack_depth(depth[x])) << 16 | u32::from(low)) & there;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::colour::pack_colour;
    use crate::pixels::SAMPLE;
    use crate::{EdgePointImage, Point, Settings};

    #[test]
    fn loading_is_inserting() {
        let (width, height, stride) = (150u32, 7u32, 160usize);
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 8
        };
        let pixels = stride * height as usize;
        let (mut region, mut depth) = (vec![0u8; pixels], vec![0.0; pixels]);
        let (mut colour, mut fine) = (vec![0; pixels], vec![0; pixels]);
        for level in simd::Level::available() {
            let image =
                || EdgePointImage::with_level(width, height, Settings::default(), level).expect("size");
            let (mut inserted, mut loaded) = (image(), image());
            // What was there before goes.
            loaded.insert(&Point {
                position: Vec2::new(0.5, 0.5),
                depth: 1e-6,
                colour: Vec3::X,
            });
            for y in 0..height {
                for x in 0..width {
                    let i = y as usize * stride + x as usize;
                    let there = next() % 3 > 0;
                    let value = (next() % 100_000) as f32 / 6400.0;
                    let far = if next() % 9 == 0 {
                        f32::INFINITY
                    } else {
                        value + 0.1
                    };
                    let quarter = (next() % 16) as u8;
                    let half = (next() % 4) as u8;
                    // Garbage beside a point that is not there must not show.
                    region[i] = quarter | half << 5 | if there { 16 } else { 0 } | 0x80;
                    depth[i] = far;
                    let packed = pack_colour(Vec3::new(value, 1.0, 3.0 * value));
                    (colour[i], fine[i]) = (packed.coarse, packed.fine | 0x8000);
                    let at = |q: u8, half: u8, corner: u32| {
                        corner as f32 + (f32::from(q) + 0.25 + 0.5 * f32::from(half)) / 4.0
                    };
                    if there {
                        inserted.insert(&Point {
                            position: Vec2::new(at(quarter % 4, half & 1, x), at(quarter / 4, half >> 1, y)),
                            depth: far,
                            colour: Vec3::new(value, 1.0, 3.0 * value),
                        });
                    }
                }
            }
            loaded.load_samples(SamplePlanes {
                stride,
                region: &region,
                depth: &depth,
                colour: &colour,
                fine: &fine,
            });
            let stored = |image: &EdgePointImage, index: usize| {
                let there = image.pixels.words[index] & SAMPLE != 0;
                there.then(|| (image.pixels.words[index], image.pixels.cache[index]))
            };
            for index in 0..inserted.pixels.words.len() {
                assert_eq!(
                    stored(&loaded, index),
                    stored(&inserted, index),
                    "bits of {index}"
                );
            }
            let mut places = image();
            places.load_places(SamplePlanes {
                stride,
                region: &region,
                depth: &depth,
                colour: &colour,
                fine: &fine,
            });
            for y in 0..height {
                for x in 0..width {
                    let [a, b] = [&places, &inserted].map(|image| image.sample(x, y));
                    let place = |sample: crate::Sample| (sample.position, sample.depth);
                    assert_eq!(a.map(place), b.map(place), "place ({x}, {y}) at {level:?}");
                    assert_eq!(
                        loaded.sample(x, y),
                        inserted.sample(x, y),
                        "({x}, {y}) at {level:?}"
                    );
                }
            }
        }
    }
}
