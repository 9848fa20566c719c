//! Textures: PNG and JPEG, with their size checked before they are decoded.

use std::io::Cursor;

use image::{ImageFormat, ImageReader, Limits};
use llsr_scene::{Texture, Wrap};

/// Most pixels of one texture: 8192 x 4096 fits.
const MOST_PIXELS: u64 = 40 << 20;

/// Most pixels of all textures of a scene together.
const MOST_PIXELS_TOGETHER: u64 = 100 << 20;

/// Most memory for decoding one texture (bytes).
const MOST_DECODING: u64 = 400 << 20;

/// Counts what a scene's textures take.
#[derive(Debug, Default)]
pub(crate) struct Decoder {
    pixels: u64,
}

impl Decoder {
    /// Decodes an image file; the error is half a sentence.
    pub(crate) fn decode(&mut self, name: &str, bytes: &[u8], wrap: [Wrap; 2]) -> Result<Texture, String> {
        let mut reader = ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|e| e.to_string())?;
        if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
            return Err("is neither PNG nor JPEG".to_owned());
        }
        let mut limits = Limits::default();
        limits.max_alloc = Some(MOST_DECODING);
        reader.limits(limits.clone());
        let format = reader.format();
        let (width, height) = reader.into_dimensions().map_err(|e| e.to_string())?;
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 {
            return Err("has no pixels".to_owned());
        }
        if pixels > MOST_PIXELS || self.pixels + pixels > MOST_PIXELS_TOGETHER {
            let limit = MOST_PIXELS >> 20;
            let together = MOST_PIXELS_TOGETHER >> 20;
            return Err(format!(
                "has {width} x {height} pixels: at most {limit} million each and {together} million in all are read"
            ));
        }
        // Before decoding: what fails late costs as much as what works.
        self.pixels += pixels;
        let mut reader = ImageReader::new(Cursor::new(bytes));
        if let Some(format) = format {
            reader.set_format(format);
        }
        reader.limits(limits);
        let image = reader.decode().map_err(|e| e.to_string())?.into_rgb8();
        let pixels = image
            .as_raw()
            .chunks_exact(3)
            .map(|p| [p[0], p[1], p[2]])
            .collect();
        Ok(Texture {
            name: name.to_owned(),
            width,
            height,
            pixels,
            wrap,
        })
    }
}

#[cfg(test)]
mod tests {
    use image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
    use image::{ExtendedColorType, ImageEncoder as _};

    use super::*;

    #[test]
    fn damaged_images_never_panic() {
        let pixels: Vec<u8> = (0..16 * 16 * 3).map(|i| (i * 7 % 251) as u8).collect();
        let (mut png, mut jpeg) = (Vec::new(), Vec::new());
        PngEncoder::new(&mut png)
            .write_image(&pixels, 16, 16, ExtendedColorType::Rgb8)
            .expect("a PNG");
        JpegEncoder::new(&mut jpeg)
            .write_image(&pixels, 16, 16, ExtendedColorType::Rgb8)
            .expect("a JPEG");
        for good in [png, jpeg] {
            let decode = |bytes: &[u8]| Decoder::default().decode("a", bytes, [Wrap::Repeat; 2]);
            let texture = decode(&good).expect("a texture");
            assert_eq!(
                (texture.width, texture.height, texture.pixels.len()),
                (16, 16, 256),
                "as written"
            );
            for bit in 0..8 * good.len() {
                let mut damaged = good.clone();
                damaged[bit / 8] ^= 1 << (bit % 8);
                if let Ok(texture) = decode(&damaged) {
                    let count = texture.width as usize * texture.height as usize;
                    assert_eq!(texture.pixels.len(), count, "bit {bit}");
                }
            }
            for length in 0..good.len() {
                let _ = decode(&good[..length]);
            }
        }
    }

    #[test]
    fn all_textures_together_have_a_limit() {
        let mut png = Vec::new();
        let pixels = vec![0; 2048 * 2048];
        PngEncoder::new(&mut png)
            .write_image(&pixels, 2048, 2048, ExtendedColorType::L8)
            .expect("a PNG");
        let mut decoder = Decoder::default();
        let read = (0..40)
            .filter(|_| decoder.decode("a", &png, [Wrap::Repeat; 2]).is_ok())
            .count();
        assert_eq!(read, 25, "25 times 4 million pixels");
    }
}
