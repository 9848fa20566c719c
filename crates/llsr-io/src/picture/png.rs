//! PNG for looking at.

use std::io::Cursor;
use std::path::Path;

use glam::Vec3;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _, ImageFormat, ImageReader, Limits};
use llsr_scene::srgb_to_linear;

use super::{Image, Tone, decoded_limit};
use crate::error::Error;
use crate::files;

/// How a linear picture is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Development {
    /// Exposure in stops: values are multiplied by 2^exposure.
    pub exposure: f64,
    /// Tone curve.
    pub tone: Tone,
}

/// Writes the channels `R`, `G`, `B` (or `Y`) of `image` as 8-bit sRGB.
///
/// The file takes its name only when it is complete.
///
/// # Errors
/// If the picture has none of these channels or no pixels, or the file cannot be written.
pub fn write_png(path: &Path, image: &Image, development: Development) -> Result<(), Error> {
    if let Some(fault) = image.fault() {
        return Err(Error::unwritable(path, fault));
    }
    let pixels = image
        .rgb()
        .ok_or_else(|| Error::unwritable(path, "it has neither channels R, G, B nor Y"))?;
    let gain = development.exposure.exp2() as f32;
    let bytes: Vec<u8> = pixels
        .into_iter()
        .flat_map(|color| {
            let display = development.tone.encode(color * gain);
            display.to_array().map(|x| (x * 255.0).round() as u8)
        })
        .collect();
    let (width, height) = (image.width as u32, image.height as u32);
    files::write_atomically(path, |writer| {
        PngEncoder::new_with_quality(writer, CompressionType::Default, FilterType::Adaptive)
            .write_image(&bytes, width, height, ExtendedColorType::Rgb8)
            .map_err(|error| match error {
                image::ImageError::IoError(error) => error,
                other => std::io::Error::other(other.to_string()),
            })
    })
}

/// Reads a PNG as linear `R`, `G`, `B`.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Image, Error> {
    let fail = |error: image::ImageError| Error::malformed(path, "PNG data", error.to_string());
    let limit = decoded_limit(bytes.len());
    let mut limits = Limits::default();
    limits.max_alloc = Some(limit);
    let reader = || {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
        reader.limits(limits.clone());
        reader
    };
    let (width, height) = reader().into_dimensions().map_err(fail)?;
    // Three floats a pixel here, besides what the decoder holds.
    let needed = (u64::from(width) * u64::from(height)).saturating_mul(12);
    if needed > limit {
        let element = "the picture".to_owned();
        return Err(Error::TooLarge {
            path: path.to_owned(),
            element,
            needed: needed >> 20,
            limit: limit >> 20,
        });
    }
    let decoded = reader().decode().map_err(fail)?;
    let pixels: Vec<Vec3> = if decoded.color().bytes_per_pixel() / decoded.color().channel_count() > 1 {
        let decode = |v: u16| srgb_to_linear(f32::from(v) / 65535.0);
        decoded
            .into_rgb16()
            .pixels()
            .map(|p| Vec3::from_array(p.0.map(decode)))
            .collect()
    } else {
        let table: Vec<f32> = (0..=255u8)
            .map(|v| srgb_to_linear(f32::from(v) / 255.0))
            .collect();
        decoded
            .into_rgb8()
            .pixels()
            .map(|p| Vec3::from_array(p.0.map(|v| table[v as usize])))
            .collect()
    };
    Ok(Image::from_rgb(width as usize, height as usize, &pixels))
}
