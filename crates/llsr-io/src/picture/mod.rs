//! Pictures in memory: named channels of 32-bit floats.

mod exr;
mod png;
mod tone;

use glam::Vec3;

pub use self::exr::write_exr;
pub use self::png::{Development, write_png};
pub use self::tone::{Tone, exposure_for};

use std::path::Path;

use crate::error::Error;
use crate::files;

/// A picture of named channels, all of one size; row 0 is at the top.
///
/// The picture itself is linear Rec. 709 `R`, `G`, `B`; further layers are named `LAYER.CHANNEL`, for example
/// `irradiance.Y` or `normal.X`.
///
/// ```
/// use llsr_io::Image;
///
/// let mut image = Image::new(2, 1);
/// image.push("depth.Z", vec![1.5, f32::INFINITY]);
/// assert_eq!(image.channel("depth.Z"), Some(&[1.5, f32::INFINITY][..]));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Names and values, each of `width * height` values, row by row.
    pub channels: Vec<(String, Vec<f32>)>,
}

impl Image {
    /// A picture without channels.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            channels: Vec::new(),
        }
    }

    /// A picture of the channels `R`, `G`, `B`.
    ///
    /// # Panics
    /// If there are not `width * height` pixels.
    pub fn from_rgb(width: usize, height: usize, pixels: &[Vec3]) -> Self {
        let mut image = Self::new(width, height);
        for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
            image.push(name, pixels.iter().map(|p| p[axis]).collect());
        }
        image
    }

    /// Adds a channel.
    ///
    /// # Panics
    /// If there are not `width * height` values.
    pub fn push(&mut self, name: impl Into<String>, values: Vec<f32>) {
        let name = name.into();
        assert_eq!(
            values.len(),
            self.width * self.height,
            "channel {name} has one value a pixel"
        );
        self.channels.push((name, values));
    }

    /// The values of a channel.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, values)| &values[..])
    }

    /// The channels `R`, `G`, `B` as pixels, or `Y` three times; `None` if there are neither.
    pub fn rgb(&self) -> Option<Vec<Vec3>> {
        if let (Some(r), Some(g), Some(b)) = (self.channel("R"), self.channel("G"), self.channel("B")) {
            let pixels = r.iter().zip(g).zip(b);
            return Some(pixels.map(|((&r, &g), &b)| Vec3::new(r, g, b)).collect());
        }
        self.channel("Y")
            .map(|y| y.iter().map(|&y| Vec3::splat(y)).collect())
    }

    /// Why the picture cannot be written, if so.
    fn fault(&self) -> Option<String> {
        if self.width == 0 || self.height == 0 || self.width.max(self.height) > 1 << 20 {
            return Some(format!("its size is {} x {} pixels", self.width, self.height));
        }
        if self.channels.is_empty() {
            return Some("it has no channels".to_owned());
        }
        let wrong = self
            .channels
            .iter()
            .find(|(_, values)| values.len() != self.width * self.height);
        wrong.map(|(name, values)| format!("channel {name} has {} values, not one a pixel", values.len()))
    }
}

/// Reads a PNG or EXR file.
///
/// PNG becomes linear `R`, `G`, `B`; transparency is ignored. EXR keeps its channels as they are, converted to 32-bit
/// floats; those of a part with a name, in a file of several parts, get that name and a dot in front. Channels are
/// sorted by name.
///
/// # Errors
/// If the file cannot be read, is damaged, or claims a size beyond what a file of its length deserves.
pub fn read_image(path: &Path) -> Result<Image, Error> {
    decode(path, &files::read(path, files::LARGEST_FILE)?)
}

/// Reads the bytes of a picture; `path` is for messages.
fn decode(path: &Path, bytes: &[u8]) -> Result<Image, Error> {
    let mut image = if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        exr::read(path, bytes)?
    } else if bytes.starts_with(b"\x89PNG") {
        png::read(path, bytes)?
    } else {
        return Err(Error::malformed(path, "the file", "is neither PNG nor EXR"));
    };
    image.channels.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(image)
}

/// Bytes that decoding a picture may take: a file of `length` bytes may honestly grow this much.
fn decoded_limit(length: usize) -> u64 {
    (length as u64).saturating_mul(32).max(512 << 20)
}

#[cfg(test)]
mod tests;
