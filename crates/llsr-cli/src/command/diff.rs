//! `llsr diff`: two pictures compared.

use std::path::Path;

use glam::Vec3;
use llsr_io::{Development, Image, Tone, read_image, write_png};
use llsr_metrics::{Options, compare, heat_colour};
use llsr_scene::srgb_to_linear;
use serde_json::json;

use crate::args::{Common, DiffArgs};
use crate::failure::Failure;
use crate::report;

pub(crate) fn run(args: &DiffArgs, common: &Common) -> Result<(), Failure> {
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let (pixels_a, pixels_b) = (rgb(&a, &args.a)?, rgb(&b, &args.b)?);
    let failed = |error: llsr_metrics::Error| {
        Failure::Work(format!("{} and {}: {error}", args.a.display(), args.b.display()))
    };
    let image_a = llsr_metrics::Image::new(a.width, a.height, &pixels_a).map_err(failed)?;
    let image_b = llsr_metrics::Image::new(b.width, b.height, &pixels_b).map_err(failed)?;
    let result = compare(image_a, image_b, &Options::default()).map_err(failed)?;
    let measures = [
        ("rmse", result.rmse),
        ("rel_rmse", result.rel_rmse),
        ("max", result.max),
        ("psnr", result.psnr),
        ("flip", result.flip),
    ];
    if let Some(path) = &args.output {
        // The writer encodes linear colours; the map's are encoded already.
        let linear = |value: u8| srgb_to_linear(f32::from(value) / 255.0);
        let pixels: Vec<Vec3> = result
            .map
            .values()
            .iter()
            .map(|&value| Vec3::from(heat_colour(value).map(linear)))
            .collect();
        let heat = Image::from_rgb(a.width, a.height, &pixels);
        write_png(
            path,
            &heat,
            Development {
                exposure: 0.0,
                tone: Tone::Srgb,
            },
        )?;
    }
    if let Some(path) = &common.report {
        // JSON has no infinity: equal pictures have a psnr of null.
        let mut value = json!({ "a": args.a, "b": args.b, "size": [a.width, a.height] });
        for (name, measure) in measures {
            value[name] = json!(measure);
        }
        report::write_json(path, &value)?;
    }
    if !common.quiet {
        for (name, measure) in measures {
            println!("{name:<9} {measure:.6}");
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Image, Failure> {
    Ok(read_image(path)?)
}

fn rgb(image: &Image, path: &Path) -> Result<Vec<[f32; 3]>, Failure> {
    let pixels = image.rgb().ok_or_else(|| {
        let names: Vec<&str> = image.channels.iter().map(|(name, _)| name.as_str()).collect();
        Failure::Work(format!(
            "{}: the picture has no channels R, G and B; it has {}",
            path.display(),
            report::shortened(&names, 8)
        ))
    })?;
    Ok(pixels.iter().map(|p| p.to_array()).collect())
}
