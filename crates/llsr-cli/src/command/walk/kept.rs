//! Frames that are kept as pictures and measured.

use std::path::PathBuf;

use glam::Vec3;
use llsr_epi::{Picture, PixelClass};
use llsr_epr::{BlindInterpolation, FrameRenderer, ray_trace};
use llsr_io::{Development, Image, Tone, exposure_for, write_png};
use llsr_metrics::{Options, compare};
use llsr_scene::Camera;
use llsr_shading::Shader;
use serde_json::{Value, json};

use crate::args::WalkArgs;
use crate::command::walk::shader_failed;
use crate::failure::Failure;

/// Rays along each side of a pixel of the reference: 64 a pixel.
const REFERENCE_SIDE: u32 = 8;

/// Keeps and measures frames.
pub(crate) struct Keeper {
    folder: Option<PathBuf>,
    reference: bool,
    blind: BlindInterpolation,
    exposure: Option<f64>,
    written: usize,
}

impl Keeper {
    pub(crate) fn new(args: &WalkArgs, renderer: &FrameRenderer) -> Result<Self, Failure> {
        if let Some(folder) = &args.keep_frames {
            std::fs::create_dir_all(folder)
                .map_err(|error| Failure::Work(format!("--keep-frames {}: {error}", folder.display())))?;
        }
        Ok(Self {
            folder: args.keep_frames.clone(),
            reference: args.reference,
            blind: BlindInterpolation::new(renderer).map_err(|error| Failure::Usage(error.to_string()))?,
            exposure: None,
            written: 0,
        })
    }

    /// Writes and measures the frame that was drawn last. Returns its errors, if there is a reference.
    pub(crate) fn keep(
        &mut self,
        frame: usize,
        renderer: &FrameRenderer,
        shader: &dyn Shader,
        camera: &Camera,
    ) -> Result<Option<Value>, Failure> {
        if self.folder.is_none() && !self.reference {
            return Ok(None);
        }
        self.write("frame", frame, renderer.picture())?;
        if self.folder.is_some() {
            let edges = edge_picture(renderer);
            self.write_image("edges", frame, &edges, 0.0, Tone::Srgb)?;
        }
        if !self.reference {
            return Ok(None);
        }
        let (viewport, seed) = (renderer.viewport(), renderer.settings().seed);
        let truth = ray_trace(shader, camera, viewport, REFERENCE_SIDE, seed).map_err(shader_failed)?;
        let traced = ray_trace(shader, camera, viewport, 1, seed).map_err(shader_failed)?;
        let mut error = errors(renderer.picture(), &truth)?;
        error["raytrace"] = errors(&traced, &truth)?;
        error["blind"] = errors(self.blind.draw(renderer), &truth)?;
        self.write("reference", frame, &truth)?;
        self.write("raytrace", frame, &traced)?;
        let blind = self.blind.draw(renderer).clone();
        self.write("blind", frame, &blind)?;
        Ok(Some(error))
    }

    pub(crate) fn print(&self) {
        if let Some(folder) = &self.folder {
            println!("wrote {} pictures to {}", self.written, folder.display());
        }
    }

    /// All pictures of a walk get the exposure of the first.
    fn write(&mut self, name: &str, frame: usize, picture: &Picture) -> Result<(), Failure> {
        if self.folder.is_none() {
            return Ok(());
        }
        let (width, height) = picture.size();
        let pixels: Vec<Vec3> = pixels(picture).map(Vec3::from).collect();
        let exposure = *self.exposure.get_or_insert_with(|| exposure_for(&pixels));
        let image = Image::from_rgb(width as usize, height as usize, &pixels);
        self.write_image(name, frame, &image, exposure, Tone::Filmic)
    }

    fn write_image(
        &mut self,
        name: &str,
        frame: usize,
        image: &Image,
        exposure: f64,
        tone: Tone,
    ) -> Result<(), Failure> {
        if let Some(folder) = &self.folder {
            let path = folder.join(format!("{name}-{frame:05}.png"));
            write_png(&path, image, Development { exposure, tone })?;
            self.written += 1;
        }
        Ok(())
    }
}

fn pixels(picture: &Picture) -> impl Iterator<Item = [f32; 3]> + '_ {
    (0..picture.size().1).flat_map(move |y| {
        let [r, g, b] = picture.row(y);
        r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b])
    })
}

/// Simple pixels purple and complex ones green, as in figure 7 of BWG03; points grey.
fn edge_picture(renderer: &FrameRenderer) -> Image {
    let image = renderer.image();
    let (width, height) = image.size();
    let colour = |x: u32, y: u32| match image.class(x, y) {
        PixelClass::Simple => Vec3::new(0.45, 0.1, 0.6),
        PixelClass::Complex => Vec3::new(0.1, 0.6, 0.1),
        PixelClass::Empty if image.sample(x, y).is_some() => Vec3::splat(0.6),
        PixelClass::Empty => Vec3::ONE,
    };
    let all: Vec<Vec3> = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| colour(x, y))
        .collect();
    Image::from_rgb(width as usize, height as usize, &all)
}

/// Errors of a picture against the truth.
fn errors(picture: &Picture, truth: &Picture) -> Result<Value, Failure> {
    let (width, height) = picture.size();
    let (test, truth): (Vec<_>, Vec<_>) = (pixels(picture).collect(), pixels(truth).collect());
    let failed = |error: llsr_metrics::Error| Failure::Work(format!("--reference: {error}"));
    let a = llsr_metrics::Image::new(width as usize, height as usize, &test).map_err(failed)?;
    let b = llsr_metrics::Image::new(width as usize, height as usize, &truth).map_err(failed)?;
    let result = compare(a, b, &Options::default()).map_err(failed)?;
    Ok(json!({ "flip": result.flip, "rmse": result.rmse, "rel_rmse": result.rel_rmse, "psnr": result.psnr }))
}
