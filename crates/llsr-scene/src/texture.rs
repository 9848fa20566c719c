//! Eight-bit textures, looked up bilinearly in linear RGB.

use std::sync::LazyLock;

use glam::{Vec2, Vec3};

/// What happens to texture coordinates outside [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The texture repeats.
    #[default]
    Repeat,
    /// It repeats and every second copy is mirrored.
    Mirror,
    /// The border goes on.
    Clamp,
}

/// Texels along each side that [`Texture::typical`] looks at, at most.
pub const TYPICAL_TEXELS: u32 = 64;

/// An sRGB-encoded image; row 0 is at v = 0 (glTF's convention: the top).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// Name in the file; may be empty.
    pub name: String,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// `width * height` sRGB pixels, row by row.
    pub pixels: Vec<[u8; 3]>,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
}

impl Texture {
    /// A colour that stands for the whole texture: the mean of up to [`TYPICAL_TEXELS`] x [`TYPICAL_TEXELS`] texels, evenly spread, linear RGB;
    /// no component is below 1/256, so that one can divide by it.
    pub fn typical(&self) -> Vec3 {
        if self.pixels.is_empty() {
            return Vec3::ONE;
        }
        let along = |size: u32| {
            let count = size.clamp(1, TYPICAL_TEXELS);
            (0..count)
                .map(move |i| ((2 * u64::from(i) + 1) * u64::from(size) / (2 * u64::from(count))) as usize)
        };
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for y in along(self.height) {
            for x in along(self.width) {
                let p = self.pixels[y * self.width as usize + x];
                sum += Vec3::from(p.map(|c| SRGB[usize::from(c)]));
                count += 1.0;
            }
        }
        (sum / count).max(Vec3::splat(1.0 / 256.0))
    }

    /// The colour at `uv`, bilinear, linear RGB.
    pub fn sample(&self, uv: Vec2) -> Vec3 {
        if !uv.is_finite() || self.pixels.is_empty() {
            return Vec3::ZERO;
        }
        let x = uv.x * self.width as f32 - 0.5;
        let y = uv.y * self.height as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let texel = |dx: f32, dy: f32| {
            let i = wrapped(x0 + dx, self.width, self.wrap[0]);
            let j = wrapped(y0 + dy, self.height, self.wrap[1]);
            let p = self.pixels[j * self.width as usize + i];
            Vec3::new(SRGB[p[0] as usize], SRGB[p[1] as usize], SRGB[p[2] as usize])
        };
        let top = texel(0.0, 0.0).lerp(texel(1.0, 0.0), fx);
        let bottom = texel(0.0, 1.0).lerp(texel(1.0, 1.0), fx);
        top.lerp(bottom, fy)
    }
}

fn wrapped(i: f32, size: u32, wrap: Wrap) -> usize {
    let n = i64::from(size);
    // Saturating: a coordinate of 1e30 lands on some texel, not outside.
    let i = i as i64;
    let i = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Mirror => {
            let m = i.rem_euclid(2 * n);
            if m < n { m } else { 2 * n - 1 - m }
        }
        Wrap::Clamp => i.clamp(0, n - 1),
    };
    i as usize
}

static SRGB: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)));

/// Decodes an sRGB value in [0, 1] (IEC 61966-2-1).
pub fn srgb_to_linear(value: f32) -> f32 {
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

/// Encodes a linear value in [0, 1] as sRGB (IEC 61966-2-1).
pub fn linear_to_srgb(value: f32) -> f32 {
    if value <= 0.003_130_8 {
        value * 12.92
    } else {
        1.055 * value.powf(1.0 / 2.4) - 0.055
    }
}

/// Luminance of a linear RGB colour with Rec. 709 primaries.
pub fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
