//! `llsr view`: a window.

use crate::args::{Common, ViewArgs};
use crate::failure::Failure;

#[cfg(not(feature = "view"))]
pub(crate) fn run(_: &ViewArgs, _: &Common) -> Result<(), Failure> {
    Err(Failure::Work(
        "this llsr was built without its window. This adds it:\n  \
         cargo install --path crates/llsr-cli --features view\n\
         `llsr walk` makes the same frames without one."
            .to_owned(),
    ))
}

#[cfg(feature = "view")]
pub(crate) use window::run;

#[cfg(feature = "view")]
mod window {
    use std::path::Path;
    use std::sync::Arc;
    use std::time::Instant;

    use llsr_epr::{FrameSettings, movable_objects};
    use llsr_scene::Viewport;
    use llsr_shading::World;
    use llsr_viewer::{PictureSettings, ShaderChoice, ViewError, ViewReport, ViewSettings, view};
    use serde_json::json;

    use super::{Common, Failure, ViewArgs};
    use crate::args::{Tone, WalkShader};
    use crate::camera;
    use crate::clock::Stopwatch;
    use crate::command::walk::{gi_settings, make_shader};
    use crate::load::{load, need_light};
    use crate::progress::interrupted;
    use crate::report as reports;

    /// Names of the shaders, in the order in which the window goes through them.
    const SHADERS: [(&str, WalkShader); 3] = [
        ("direct", WalkShader::Direct),
        ("glossy", WalkShader::Glossy),
        ("gi", WalkShader::Gi),
    ];

    pub(crate) fn run(args: &ViewArgs, common: &Common) -> Result<(), Failure> {
        let started = Instant::now();
        let watch = Stopwatch::start();
        if !args.folder.is_dir() {
            return Err(Failure::Usage(format!(
                "--folder {}: there is no such folder",
                args.folder.display()
            )));
        }
        let loaded = load(&args.scene)?;
        need_light(&loaded, &args.scene.scene)?;
        let load_seconds = watch.read();

        let watch = Stopwatch::start();
        let movable = movable_objects(&loaded.scene);
        let (world, dropped) = World::new(Arc::new(loaded.scene), &movable);
        let (width, height) = args.scene.size;
        let viewport = Viewport { width, height };
        let (camera, _) = camera::choose(&args.scene, world.scene(), world.tracer(), viewport)?;
        let build_seconds = watch.read();
        let warnings: Vec<String> = loaded
            .warnings
            .iter()
            .map(ToString::to_string)
            .chain(dropped.iter().map(ToString::to_string))
            .collect();
        if !common.quiet {
            reports::print_warnings(&warnings, 3, &args.scene.scene);
        }

        let first = SHADERS.iter().position(|(_, shader)| *shader == args.shader);
        let mut order = SHADERS;
        order.rotate_left(first.unwrap_or(0));
        let gi = gi_settings(args.gi_memory, true);
        let shaders = order.map(|(name, shader)| ShaderChoice {
            name: name.to_owned(),
            make: Box::new(move |world| Ok(make_shader(shader, &world, gi))),
        });
        let settings = view_settings(args, common, started);
        let world = Arc::new(world);
        let report = view(world, camera, viewport, shaders.into(), settings, &interrupted);
        let report = report.map_err(|error| match error {
            ViewError::Frame(error) => Failure::Usage(format!("--size: {error}")),
            ViewError::Window(_) => Failure::Work(format!(
                "{error}\n`llsr walk {}` makes the same frames without a window.",
                args.scene.scene
            )),
            error => Failure::Work(error.to_string()),
        })?;
        if let Some(error) = &report.last_error {
            eprintln!(
                "warning: the shader failed {} times; the last time: {error}",
                report.shader_errors
            );
        }
        if let Some(path) = &common.report {
            let mut value = json_of(&report);
            value["scene"] = json!(args.scene.scene);
            value["size"] = json!([width, height]);
            value["seconds"] = json!({
                "load": load_seconds.wall,
                "build": build_seconds.wall,
                "first_picture": report.first_picture_seconds,
            });
            value["warnings"] = json!(warnings);
            reports::write_json(path, &value)?;
        }
        if !common.quiet {
            print(&report);
        }
        Ok(())
    }

    /// The scene's name without its folder.
    fn title(scene: &str) -> String {
        let name = Path::new(scene)
            .file_name()
            .map(|name| name.to_string_lossy().into_owned());
        name.unwrap_or_else(|| scene.to_owned())
    }

    fn view_settings(args: &ViewArgs, common: &Common, started: Instant) -> ViewSettings {
        let mut settings = ViewSettings::default();
        if let Some(threads) = common.threads {
            // One of them is the display's.
            settings.shader_threads = usize::from(threads).saturating_sub(1).max(1);
        }
        let (width, height) = args.scene.size;
        let pixels = u64::from(width) * u64::from(height);
        let samples = args
            .samples_per_frame
            .map_or(pixels / 50, u64::from)
            .clamp(1, 1 << 18) as usize;
        ViewSettings {
            title: title(&args.scene.scene),
            frames: FrameSettings {
                seed: common.seed,
                ..settings.frames
            },
            samples,
            tone: match args.tone {
                Tone::Srgb => llsr_io::Tone::Srgb,
                Tone::Filmic => llsr_io::Tone::Filmic,
            },
            exposure: args.exposure,
            picture: PictureSettings {
                spp: args.spp,
                stem: args.folder.join("llsr-view"),
            },
            path_stem: args.folder.join("llsr-path"),
            started,
            ..settings
        }
    }

    fn json_of(report: &ViewReport) -> serde_json::Value {
        json!({
            "frames": report.frames,
            "fps": report.frames_per_second,
            "median_frame_ms": report.median_frame_ms,
            "samples": report.samples,
            "moves": report.moves,
            "files": report.files,
            "shader_errors": report.shader_errors,
            "last_error": report.last_error,
        })
    }

    fn print(report: &ViewReport) {
        println!(
            "{} frames, the last at {:.0} a second; first picture after {:.2} s",
            report.frames,
            report.frames_per_second,
            report.first_picture_seconds.unwrap_or(f64::NAN)
        );
        for path in &report.files {
            println!("wrote {}", path.display());
        }
    }
}
