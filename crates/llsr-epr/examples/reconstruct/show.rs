//! Pictures of what was made of edges and samples.

use std::path::Path;

use glam::Vec3;
use llsr_epi::{EdgePointImage, PixelClass};
use llsr_io::{Development, Tone, write_png};
use llsr_scene::linear_to_srgb;

/// Empty pixels white, simple ones purple, complex ones green; darker where there is a sample.
pub(crate) fn draw_edges(image: &EdgePointImage, prefix: &str) {
    let (width, height) = image.size();
    let colours: Vec<Vec3> = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let colour = match image.class(x, y) {
                PixelClass::Empty => Vec3::ONE,
                PixelClass::Simple => Vec3::new(0.5, 0.0, 0.8),
                PixelClass::Complex => Vec3::new(0.0, 0.8, 0.0),
            };
            if image.sample(x, y).is_some() {
                colour * 0.6
            } else {
                colour
            }
        })
        .collect();
    write(&colours, width as usize, 0.0, &format!("{prefix}-edges.png"));
}

/// Four times the difference on the screen.
pub(crate) fn draw_error(made: &[[f32; 3]], truth: &[[f32; 3]], width: usize, white: f32, file: &str) {
    let shown = |c: f32| linear_to_srgb((c / white).clamp(0.0, 1.0));
    let linear = |v: f32| {
        if v <= 0.04045 {
            v / 12.92
        } else {
            ((v + 0.055) / 1.055).powf(2.4)
        }
    };
    let colours: Vec<Vec3> = made
        .iter()
        .zip(truth)
        .map(|(a, b)| {
            Vec3::from_array(std::array::from_fn(|i| {
                linear((4.0 * (shown(a[i]) - shown(b[i])).abs()).min(1.0))
            }))
        })
        .collect();
    write(&colours, width, 0.0, file);
}

pub(crate) fn write(colours: &[Vec3], width: usize, exposure: f64, file: &str) {
    let picture = llsr_io::Image::from_rgb(width, colours.len() / width, colours);
    let development = Development {
        exposure,
        tone: Tone::Srgb,
    };
    if write_png(Path::new(file), &picture, development).is_err() {
        eprintln!("{file} cannot be written");
    }
}
