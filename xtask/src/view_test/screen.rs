//! A virtual screen: Xvfb with its pixels in a file.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use llsr_io::{Development, Image};
use llsr_scene::srgb_to_linear;

use crate::run::output;

/// A running Xvfb.
pub(crate) struct Screen {
    server: Child,
    display: String,
    pixels: PathBuf,
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Screen {
    /// Starts a server on a free display; it keeps its pixels in `folder`.
    pub(crate) fn start(folder: &Path) -> Result<Self, String> {
        let mut server = Command::new("Xvfb")
            .args([
                // A server that resets when its last window closes loses the next program.
                "-noreset",
                "-displayfd",
                "1",
                "-screen",
                "0",
                "640x480x24",
                "-nolisten",
                "tcp",
            ])
            .arg("-fbdir")
            .arg(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|e| format!("Xvfb: {e}"))?;
        let mut number = String::new();
        if let Some(out) = server.stdout.take() {
            let _ = BufReader::new(out).read_line(&mut number);
        }
        let screen = Self {
            server,
            display: format!(":{}", number.trim()),
            pixels: folder.join("Xvfb_screen0"),
        };
        if number.trim().is_empty() {
            return Err("Xvfb does not start".to_owned());
        }
        Ok(screen)
    }

    /// What DISPLAY is to be.
    pub(crate) fn display(&self) -> &str {
        &self.display
    }

    /// What is on the screen now.
    pub(crate) fn picture(&self) -> Result<Picture, String> {
        let bytes = std::fs::read(&self.pixels).map_err(|e| format!("{}: {e}", self.pixels.display()))?;
        Picture::from_xwd(&bytes).ok_or_else(|| "the screen's file is not as expected".to_owned())
    }

    /// Asks a window to close as a window manager does when its button is pressed; false if this xdotool cannot.
    ///
    /// Destroying the window instead is another thing, which the window library does not survive.
    pub(crate) fn close(&self, window: &str) -> bool {
        output(
            Command::new("xdotool")
                .args(["windowquit", window])
                .env("DISPLAY", &self.display),
        )
        .is_ok()
    }
}

/// Pixels, 0xRRGGBB.
pub(crate) struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<u32>,
}

/// Number and middle of some pixels.
pub(crate) struct Blob {
    pub(crate) count: usize,
    pub(crate) x: f64,
    pub(crate) y: f64,
}

impl Picture {
    /// An X window dump of 32 bits a pixel (the header of XWDFile.h: big-endian words).
    fn from_xwd(bytes: &[u8]) -> Option<Self> {
        let word = |i: usize| Some(u32::from_be_bytes(bytes.get(4 * i..4 * i + 4)?.try_into().ok()?));
        let (header, width, height) = (word(0)?, word(4)?, word(5)?);
        let (order, bits, row, colors) = (word(7)?, word(11)?, word(12)?, word(19)?);
        if bits != 32 || width > 1 << 14 || height > 1 << 14 {
            return None;
        }
        let mut pixels = Vec::with_capacity((width * height) as usize);
        let start = header as usize + colors as usize * 12;
        for y in 0..height as usize {
            let line = bytes.get(start + y * row as usize..)?.get(..4 * width as usize)?;
            pixels.extend(line.chunks_exact(4).map(|p| {
                let p = [p[0], p[1], p[2], p[3]];
                0xff_ffff
                    & if order == 0 {
                        u32::from_le_bytes(p)
                    } else {
                        u32::from_be_bytes(p)
                    }
            }));
        }
        Some(Self {
            width,
            height,
            pixels,
        })
    }

    /// A picture file, placed at the upper left corner as windows are.
    pub(crate) fn read(path: &Path) -> Result<Self, String> {
        let image = llsr_io::read_image(path).map_err(|e| e.to_string())?;
        let colors = image.rgb().ok_or("no colours")?;
        let pixels = colors.into_iter().map(|c| {
            c.to_array().into_iter().fold(0, |pixel, x| {
                pixel << 8 | (llsr_scene::linear_to_srgb(x) * 255.0).round() as u32
            })
        });
        Ok(Self {
            width: image.width as u32,
            height: image.height as u32,
            pixels: pixels.collect(),
        })
    }

    pub(crate) fn write(&self, path: &Path) -> Result<(), String> {
        let linear = |level: u32| srgb_to_linear((level & 255) as f32 / 255.0);
        let colors: Vec<glam::Vec3> = self
            .pixels
            .iter()
            .map(|p| glam::Vec3::new(linear(p >> 16), linear(p >> 8), linear(*p)))
            .collect();
        let image = Image::from_rgb(self.width as usize, self.height as usize, &colors);
        llsr_io::write_png(path, &image, Development::default()).map_err(|e| e.to_string())
    }

    pub(crate) fn at(&self, x: u32, y: u32) -> u32 {
        if x < self.width && y < self.height {
            self.pixels[(y * self.width + x) as usize]
        } else {
            0
        }
    }

    pub(crate) fn count(&self, is: impl Fn(u32) -> bool) -> usize {
        self.pixels.iter().filter(|&&p| is(p)).count()
    }

    /// Pixels below row `top` that differ clearly, of those that both have.
    pub(crate) fn difference(&self, other: &Self, top: u32) -> usize {
        let far = |a: u32, b: u32| (0..3).any(|i| (a >> (8 * i) & 255).abs_diff(b >> (8 * i) & 255) > 32);
        let (width, height) = (self.width.min(other.width), self.height.min(other.height));
        (top..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .filter(|&(x, y)| far(self.at(x, y), other.at(x, y)))
            .count()
    }

    /// Are all pixels below row `top` the same to the bit?
    pub(crate) fn same_below(&self, other: &Self, top: u32) -> bool {
        let from = (top * self.width) as usize;
        self.pixels.len() == other.pixels.len() && self.pixels[from..] == other.pixels[from..]
    }

    fn is_red(pixel: u32) -> bool {
        let (r, g, b) = (pixel >> 16 & 255, pixel >> 8 & 255, pixel & 255);
        r > 70 && r > g + g / 3 && r > b + b / 3 && r > g + 30
    }

    /// The torus: red pixels, those in the light.
    pub(crate) fn red(&self) -> Blob {
        self.blob(0, Self::is_red)
    }

    /// The whole torus below row `top`, whatever the exposure.
    pub(crate) fn reddish(&self, top: u32) -> Blob {
        self.blob(top, |pixel| {
            let (r, g, b) = (pixel >> 16 & 255, pixel >> 8 & 255, pixel & 255);
            r > 12 && 2 * r > 3 * g && 2 * r > 3 * b
        })
    }

    fn blob(&self, top: u32, is: impl Fn(u32) -> bool) -> Blob {
        let mut blob = Blob {
            count: 0,
            x: 0.0,
            y: 0.0,
        };
        for y in top..self.height {
            for x in (0..self.width).filter(|&x| is(self.at(x, y))) {
                blob.count += 1;
                blob.x += f64::from(x);
                blob.y += f64::from(y);
            }
        }
        let count = blob.count.max(1) as f64;
        (blob.x, blob.y) = (blob.x / count, blob.y / count);
        blob
    }

    /// The middle of the longest row of red pixels.
    pub(crate) fn red_run(&self) -> Option<(i32, i32)> {
        let mut best = (0, None);
        for y in 0..self.height {
            let mut start = 0;
            for x in 0..=self.width {
                if x < self.width && Self::is_red(self.at(x, y)) {
                    continue;
                }
                let length = x - start;
                if length > best.0 {
                    best = (length, Some(((start + length / 2) as i32, y as i32)));
                }
                start = x + 1;
            }
        }
        best.1
    }
}
