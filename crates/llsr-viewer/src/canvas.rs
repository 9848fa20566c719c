//! The pixels of a window, and how linear colours become them.

use glam::Vec3;
use llsr_epi::Picture;
use llsr_io::Tone;

/// Display pixels, 0x00RRGGBB, row by row from the top.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Canvas {
    width: u32,
    height: u32,
    pixels: Vec<u32>,
}

impl Canvas {
    /// A black canvas.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            pixels: vec![0; width as usize * height as usize],
        }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// All pixels.
    pub fn pixels(&self) -> &[u32] {
        &self.pixels
    }

    /// Makes the canvas that large; it is black then if it was not.
    pub fn resize(&mut self, width: u32, height: u32) {
        if (width, height) != (self.width, self.height) {
            *self = Self::new(width, height);
        }
    }

    /// The pixel at (`x`, `y`), if it lies inside.
    pub fn get(&self, x: i32, y: i32) -> Option<u32> {
        self.index(x, y).map(|i| self.pixels[i])
    }

    fn index(&self, x: i32, y: i32) -> Option<usize> {
        let inside = x >= 0 && y >= 0 && x < self.width as i32 && y < self.height as i32;
        inside.then(|| y as usize * self.width as usize + x as usize)
    }

    /// Sets one pixel, if it lies inside.
    pub fn set(&mut self, x: i32, y: i32, color: u32) {
        if let Some(i) = self.index(x, y) {
            self.pixels[i] = color;
        }
    }

    /// Mixes one pixel with `color`, of which the share in [0, 256] is taken.
    pub fn mix(&mut self, x: i32, y: i32, color: u32, share: u32) {
        if let Some(i) = self.index(x, y) {
            self.pixels[i] = mixed(self.pixels[i], color, share);
        }
    }

    /// Fills a rectangle, as far as it lies inside.
    pub fn fill(&mut self, x: i32, y: i32, width: i32, height: i32, color: u32) {
        self.rows(x, y, width, height, |row| row.fill(color));
    }

    /// Darkens a rectangle to a quarter, so that text can be read on it.
    pub fn shade(&mut self, x: i32, y: i32, width: i32, height: i32) {
        self.rows(x, y, width, height, |row| {
            row.iter_mut()
                .for_each(|pixel| *pixel = (*pixel >> 2) & 0x003f_3f3f);
        });
    }

    fn rows(&mut self, x: i32, y: i32, width: i32, height: i32, mut f: impl FnMut(&mut [u32])) {
        let clip = |from: i32, extent: i32, size: u32| {
            let size = i64::from(size);
            let from = i64::from(from);
            let range = from.clamp(0, size)..(from + i64::from(extent)).clamp(0, size);
            range.start as usize..range.end.max(range.start) as usize
        };
        let columns = clip(x, width, self.width);
        if columns.is_empty() {
            return;
        }
        for row in clip(y, height, self.height) {
            let start = row * self.width as usize;
            f(&mut self.pixels[start + columns.start..start + columns.end]);
        }
    }

    /// Draws a straight line of single pixels between two places.
    pub fn line(&mut self, (x0, y0): (f64, f64), (x1, y1): (f64, f64), color: u32) {
        let margin = 2.0 * f64::from(self.width.max(self.height));
        // Far ends are cut first: a line may leave the canvas by millions of pixels.
        let Some([(x0, y0), (x1, y1)]) = clipped(
            (x0, y0),
            (x1, y1),
            -margin,
            margin + f64::from(self.width.max(self.height)),
        ) else {
            return;
        };
        let steps = (x1 - x0).abs().max((y1 - y0).abs()).ceil().max(1.0);
        for i in 0..=steps as u32 {
            let s = f64::from(i) / steps;
            let (x, y) = (x0 + (x1 - x0) * s, y0 + (y1 - y0) * s);
            self.set(x.floor() as i32, y.floor() as i32, color);
        }
    }

    /// Develops a picture into the canvas, which takes its size.
    pub fn develop(&mut self, picture: &Picture, table: &ToneTable) {
        let (width, height) = picture.size();
        self.resize(width, height);
        for (y, row) in self.pixels.chunks_exact_mut(width as usize).enumerate() {
            let [red, green, blue] = picture.row(y as u32);
            for (((pixel, &r), &g), &b) in row.iter_mut().zip(red).zip(green).zip(blue) {
                *pixel = table.pixel(r, g, b);
            }
        }
    }
}

/// The part of a line within a square (Liang & Barsky 1984).
fn clipped(a: (f64, f64), b: (f64, f64), low: f64, high: f64) -> Option<[(f64, f64); 2]> {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (start, delta) in [(a.0, b.0 - a.0), (a.1, b.1 - a.1)] {
        if !(start.is_finite() && delta.is_finite()) {
            return None;
        }
        if delta == 0.0 {
            if start < low || start > high {
                return None;
            }
            continue;
        }
        let (t, u) = ((low - start) / delta, (high - start) / delta);
        from = from.max(t.min(u));
        to = to.min(t.max(u));
    }
    let at = |t: f64| (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t);
    (from <= to).then(|| [at(from), at(to)])
}

fn mixed(below: u32, above: u32, share: u32) -> u32 {
    let part = |mask: u32, shift: u32| {
        let (a, b) = ((below & mask) >> shift, (above & mask) >> shift);
        ((a * (256 - share) + b * share) >> 8) << shift
    };
    part(0xff_0000, 16) | part(0xff00, 8) | part(0xff, 0)
}

/// Bits of a float's mantissa that the table looks at.
const MANTISSA: u32 = 10;
/// Smallest and largest exponents that are not black and white.
const EXPONENTS: (i32, i32) = (-40, 40);

/// A tone curve with an exposure, as a table over the leading bits of a float: a step of 0.1% of the value, which is
/// less than one display level.
#[derive(Clone, Debug)]
pub struct ToneTable {
    levels: Vec<u8>,
    first: u32,
}

impl ToneTable {
    /// For an exposure in stops.
    pub fn new(tone: Tone, exposure: f64) -> Self {
        let key = |exponent: i32| ((exponent + 127) as u32) << MANTISSA;
        let gain = exposure.clamp(-100.0, 100.0).exp2() as f32;
        let (first, last) = (key(EXPONENTS.0), key(EXPONENTS.1));
        let levels = (first..last).map(|index| {
            // The middle of the values that share these bits.
            let value = f32::from_bits((index << (23 - MANTISSA)) | (1 << (22 - MANTISSA)));
            (tone.encode(Vec3::splat(value * gain)).x * 255.0).round() as u8
        });
        Self {
            levels: levels.collect(),
            first,
        }
    }

    /// The display level of a linear value; negative values and not-a-number are black.
    #[inline]
    pub fn level(&self, value: f32) -> u8 {
        // Also false for not-a-number.
        if value > 0.0 {
            let index = (value.to_bits() >> (23 - MANTISSA)).saturating_sub(self.first);
            self.levels[(index as usize).min(self.levels.len() - 1)]
        } else {
            0
        }
    }

    /// A display pixel of linear components.
    #[inline]
    pub fn pixel(&self, red: f32, green: f32, blue: f32) -> u32 {
        let [r, g, b] = [red, green, blue].map(|x| u32::from(self.level(x)));
        r << 16 | g << 8 | b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_curve_to_one_level() {
        for tone in [Tone::Srgb, Tone::Filmic] {
            for exposure in [-12.0, 0.0, 7.5] {
                let table = ToneTable::new(tone, exposure);
                for i in 0..20_000u16 {
                    let value = (f32::from(i) / 1000.0 - 15.0).exp2() * (-exposure).exp2() as f32;
                    let exact = tone.encode(Vec3::splat(value * exposure.exp2() as f32)).x * 255.0;
                    let level = f32::from(table.level(value));
                    assert!(
                        (level - exact).abs() <= 0.75,
                        "{tone:?} {exposure}: {value} is {level}, not {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn odd_values_have_a_level() {
        let table = ToneTable::new(Tone::Filmic, 0.0);
        for (value, level) in [
            (f32::NAN, 0),
            (f32::NEG_INFINITY, 0),
            (-1.0, 0),
            (0.0, 0),
            (f32::MIN_POSITIVE / 16.0, 0),
            (f32::MAX, 255),
            (f32::INFINITY, 255),
        ] {
            assert_eq!(table.level(value), level, "{value}");
        }
    }

    #[test]
    fn shapes_are_cut_at_the_border() {
        let mut canvas = Canvas::new(4, 3);
        canvas.fill(-5, 1, 100, 1, 7);
        canvas.fill(2, -100, 1, i32::MAX, 9);
        canvas.fill(3, 0, -2, 5, 1);
        canvas.fill(i32::MAX, i32::MAX, i32::MAX, i32::MAX, 1);
        assert_eq!(canvas.pixels(), [0, 0, 9, 0, 7, 7, 9, 7, 0, 0, 9, 0], "rows");
        canvas.set(4, 0, 1);
        canvas.set(0, -1, 1);
        assert!(!canvas.pixels().contains(&1), "outside");
        assert_eq!((canvas.get(2, 0), canvas.get(0, 3)), (Some(9), None), "looked up");
    }

    #[test]
    fn lines_reach_both_ends_whatever_their_length() {
        let mut canvas = Canvas::new(8, 8);
        canvas.line((0.5, 0.5), (7.5, 7.5), 1);
        assert!((0..8).all(|i| canvas.get(i, i) == Some(1)), "the diagonal");
        let mut canvas = Canvas::new(8, 8);
        canvas.line((-1e9, 4.5), (1e9, 4.5), 1);
        assert!((0..8).all(|i| canvas.get(i, 4) == Some(1)), "a row");
        canvas.line((f64::NAN, 0.0), (4.0, 4.0), 2);
        canvas.line((0.0, f64::INFINITY), (4.0, 4.0), 2);
        assert!(!canvas.pixels().contains(&2), "no line without ends");
    }

    #[test]
    fn mixing_and_shading_keep_components_apart() {
        let mut canvas = Canvas::new(1, 1);
        canvas.set(0, 0, 0x80_40_ff);
        canvas.mix(0, 0, 0x00_ff_01, 128);
        assert_eq!(canvas.get(0, 0), Some(0x40_9f_80), "half of each");
        canvas.shade(0, 0, 1, 1);
        assert_eq!(canvas.get(0, 0), Some(0x10_27_20), "a quarter of each");
    }
}
