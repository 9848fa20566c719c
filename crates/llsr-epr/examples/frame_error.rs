//! Where the error of interactive frames sits: FLIP of the last frame of a walk in lockstep, of edge-blind interpolation of the same
//! points and of one ray a pixel, against 64 rays a pixel, for pixels without an edge, with one, for complex ones and for all that
//! reached no point.
//!
//! `cargo run --release -p llsr-epr --example frame_error -- SCENE.glb|demo:NAME [KEY=VALUE]...`; keys: `tube` (MATERIAL=FLUX), `size` (256),
//! `frames` (60), `samples` (a frame; 1% of the pixels), `stand` (1: the camera stays where the walk ends), `shader` (direct, glossy), `path` (a camera path), `contrast`
//! (`FrameSettings::shadow_least_contrast`), `linear` (0: means in place of fits), `near` and `far` (taps of
//! the filter beside 36 in the middle; 8, 1), `points` (a pixel, 1), `ahead`, `ahead_frames`,
//! `ages` (highest priority by age), `calm` (`FrameSettings::calm_priority`), `textures` (0: without them), `lookup` (0: textures interpolated with the light),
//! `cull` (0: edges behind points are drawn too), `references` (a folder that keeps the
//! reference pictures for the next run), `out` (a folder for pictures and heat maps).

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use glam::Vec3;
use llsr_epi::{Kernel, Picture, PixelClass, UNREACHED};
use llsr_epr::{BlindInterpolation, CameraPath, FrameRenderer, FrameSettings, LockstepRenderer, ray_trace};
use llsr_io::{Development, Image, LoadOptions, Tone, exposure_for, load_scene, write_png};
use llsr_metrics::{Options, compare};
use llsr_render_cache::AgeRule;
use llsr_scene::{Camera, Scene, Viewport, demo};
use llsr_shading::{DirectShader, GlossySettings, GlossyShader, Shader, World};

/// Rays along each side of a pixel of the reference.
const SIDE: u32 = 8;
/// Classes of pixels, in the order of the table.
const CLASSES: [&str; 4] = ["empty", "simple", "complex", "unreached"];

struct Arguments(Vec<(String, String)>);

impl Arguments {
    fn text(&self, key: &str) -> Option<&str> {
        let found = self.0.iter().find(|(known, _)| known == key);
        found.map(|(_, value)| value.as_str())
    }

    fn number(&self, key: &str, otherwise: f64) -> f64 {
        self.text(key)
            .and_then(|text| text.parse().ok())
            .unwrap_or(otherwise)
    }
}

fn scene_of(name: &str, tube: Option<&str>) -> Option<Scene> {
    match name.strip_prefix("demo:") {
        Some(demo) => demo::build(demo),
        None => {
            let options = LoadOptions {
                tubes: tube.and_then(|tube| tube.parse().ok()).into_iter().collect(),
                ..LoadOptions::default()
            };
            load_scene(Path::new(name), &options)
                .map(|loaded| loaded.scene)
                .ok()
        }
    }
}

fn pixels(picture: &Picture) -> Vec<[f32; 3]> {
    let rows = (0..picture.size().1).map(|y| picture.row(y));
    rows.flat_map(|[r, g, b]| (0..r.len()).map(move |x| [r[x], g[x], b[x]]))
        .collect()
}

/// The reference, from `folder` if an earlier run left it there.
fn reference(folder: Option<&Path>, key: &str, make: impl Fn() -> Option<Picture>) -> Option<Vec<[f32; 3]>> {
    let path: Option<PathBuf> = folder.map(|folder| folder.join(format!("{key}.f32")));
    if let Some(bytes) = path.as_ref().and_then(|path| std::fs::read(path).ok()) {
        let floats: Vec<f32> = bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|bytes| f32::from_le_bytes(*bytes))
            .collect();
        return Some(floats.as_chunks::<3>().0.to_vec());
    }
    let picture = pixels(&make()?);
    if let Some(path) = path {
        let bytes: Vec<u8> = picture
            .as_flattened()
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        std::fs::write(path, bytes).ok()?;
    }
    Some(picture)
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "demo:rooms".to_owned());
    let pairs = arguments.filter_map(|pair| {
        let (key, value) = pair.split_once('=')?;
        Some((key.to_owned(), value.to_owned()))
    });
    if run(&name, &Arguments(pairs.collect())).is_some() {
        ExitCode::SUCCESS
    } else {
        eprintln!("{name}: cannot be loaded, drawn or compared");
        ExitCode::FAILURE
    }
}

fn run(name: &str, arguments: &Arguments) -> Option<()> {
    let mut scene = scene_of(name, arguments.text("tube"))?;
    let textured = arguments.number("textures", 1.0) != 0.0;
    if !textured {
        for material in &mut scene.materials {
            material.base_color_texture = None;
        }
    }
    let size = arguments.number("size", 256.0) as u32;
    let viewport = Viewport {
        width: size,
        height: size,
    };
    let bounds = scene.bounds();
    let camera = scene.cameras.first().cloned();
    let camera =
        camera.unwrap_or_else(|| Camera::outside(bounds.center(), 0.5 * bounds.diagonal(), viewport));
    let frames = (arguments.number("frames", 60.0) as usize).max(1);
    let path = match arguments.text("path") {
        Some(path) => CameraPath::parse(&std::fs::read_to_string(path).ok()?, scene.origin).ok()?,
        None => CameraPath::default_walk(&camera, frames, f64::from(bounds.diagonal())),
    };
    let last = path.cameras.len().min(frames) - 1;
    let (world, _) = World::new(Arc::new(scene), &[]);
    let world = Arc::new(world);
    let scene = Arc::clone(world.scene());
    let ambient = world.suggested_ambient();
    let shader: Arc<dyn Shader> = match arguments.text("shader") {
        Some("glossy") => {
            let settings = GlossySettings {
                ambient,
                ..GlossySettings::default()
            };
            Arc::new(GlossyShader::new(Arc::clone(&world), &settings))
        }
        _ => Arc::new(DirectShader::new(Arc::clone(&world), ambient)),
    };
    let default = FrameSettings::default();
    let settings = FrameSettings {
        shadows_apart: true,
        shadow_least_contrast: arguments.number("contrast", default.shadow_least_contrast),
        points_per_pixel: arguments.number("points", default.points_per_pixel.into()) as f32,
        linear: arguments.number("linear", 1.0) != 0.0,
        textures: arguments.number("lookup", 1.0) != 0.0,
        occlusion: default.occlusion.filter(|_| arguments.number("cull", 1.0) != 0.0),
        kernel: Kernel::new(
            36.0,
            arguments.number("near", 8.0) as f32,
            arguments.number("far", 1.0) as f32,
        )?,
        ahead_share: arguments.number("ahead", default.ahead_share.into()) as f32,
        ahead_frames: arguments.number("ahead_frames", default.ahead_frames.into()) as u32,
        calm_priority: arguments.number("calm", default.calm_priority.into()) as f32,
        ages: AgeRule {
            highest: arguments.number("ages", default.ages.highest.into()) as u8,
            ..default.ages
        },
        ..default
    };
    let samples = arguments.number("samples", (viewport.pixels() / 100) as f64) as usize;
    let renderer = FrameRenderer::new(&scene, viewport, settings).ok()?;
    let mut blind = BlindInterpolation::new(&renderer).ok()?;
    let mut lockstep = LockstepRenderer::new(renderer, samples);
    let standing = arguments.number("stand", 0.0) != 0.0;
    let seen = |frame: usize| &path.cameras[if standing { last } else { frame.min(last) }];
    let (mut drawing, mut interpolating) = (Vec::new(), Vec::new());
    for frame in 0..frames {
        if frame == 0 {
            lockstep.warm_up(&*shader, seen(0));
        } else {
            lockstep.shade(&*shader);
        }
        lockstep.draw(seen(frame));
        let ms = lockstep.renderer.report().ms;
        drawing.push(ms.total);
        interpolating.push(ms.interpolate);
    }
    drawing.sort_by(f64::total_cmp);
    interpolating.sort_by(f64::total_cmp);

    let camera = seen(frames - 1);
    let folder = arguments.text("references").map(Path::new);
    let stem = Path::new(name)
        .file_stem()
        .map_or(name, |stem| stem.to_str().unwrap_or(name));
    let stem = stem.trim_start_matches("demo:");
    let plain = if textured { "" } else { "-plain" };
    let key = format!("{stem}-{}-{size}-{last}{plain}", shader.name());
    let trace = |side| ray_trace(&*shader, camera, viewport, side, 0).ok();
    let truth = reference(folder, &key, || trace(SIDE))?;
    let traced = reference(folder, &format!("{key}-1"), || trace(1))?;
    let renderer = &lockstep.renderer;
    let frame = pixels(renderer.picture());
    let blind = pixels(blind.draw(renderer));

    let image = renderer.image();
    let side = size as usize;
    let class: Vec<usize> = (0..side * side)
        .map(|i| {
            let (x, y) = ((i % side) as u32, (i / side) as u32);
            match image.class(x, y) {
                _ if renderer.picture().priorities(y)[i % side] == UNREACHED => 3,
                PixelClass::Empty => 0,
                PixelClass::Simple => 1,
                PixelClass::Complex => 2,
            }
        })
        .collect();
    let report = renderer.report();
    println!(
        "{key}: {:.1}% of the pixels with a point; medians: {:.2} ms a frame, {:.2} ms of it for interpolation",
        100.0 * report.points.occupied as f64 / class.len() as f64,
        drawing[drawing.len() / 2],
        interpolating[interpolating.len() / 2]
    );
    let exposure = exposure_for(&truth.iter().map(|&p| Vec3::from(p)).collect::<Vec<_>>());
    let b = llsr_metrics::Image::new(side, side, &truth).ok()?;
    for (what, picture) in [("frame", &frame), ("blind", &blind), ("raytrace", &traced)] {
        let a = llsr_metrics::Image::new(side, side, picture).ok()?;
        let found = compare(a, b, &Options::default()).ok()?;
        let mut line = format!("  {what:<8} FLIP {:.4}  PSNR {:5.2}", found.flip, found.psnr);
        for (number, label) in CLASSES.iter().enumerate() {
            let of = || {
                class
                    .iter()
                    .zip(found.map.values())
                    .filter(|(c, _)| **c == number)
            };
            let (count, sum) = (
                of().count(),
                of().map(|(_, &value)| f64::from(value)).sum::<f64>(),
            );
            // What the class adds to the whole.
            line += &format!(
                " | {label} {:4.1}% of pixels, {:.4}",
                100.0 * count as f64 / class.len() as f64,
                sum / class.len() as f64
            );
        }
        println!("{line}");
        if let Some(out) = arguments.text("out") {
            let heat: Vec<Vec3> = found
                .map
                .heat()
                .iter()
                .map(|rgb| Vec3::from(rgb.map(|c| llsr_scene::srgb_to_linear(f32::from(c) / 255.0))))
                .collect();
            let shown: Vec<Vec3> = picture.iter().map(|&p| p.into()).collect();
            let write = |kind: &str, pixels: &[Vec3], exposure: f64, tone: Tone| {
                let path = Path::new(out).join(format!("{stem}-{what}{kind}.png"));
                write_png(
                    &path,
                    &Image::from_rgb(side, side, pixels),
                    Development { exposure, tone },
                )
                .ok()
            };
            write("", &shown, exposure, Tone::Filmic)?;
            write("-heat", &heat, 0.0, Tone::Srgb)?;
        }
    }
    Some(())
}
