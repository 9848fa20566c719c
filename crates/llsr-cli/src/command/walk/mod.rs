//! `llsr walk`: frames along a camera path, without a window.

mod course;
mod drive;
mod kept;
mod report;
mod stage;
mod wander;

use std::sync::Arc;

use llsr_epr::{ExternalSettings, ExternalShader, FrameRenderer, FrameSettings, dropped_contrast, ray_trace};
use llsr_scene::{Camera, Viewport};
use llsr_shading::{
    DirectShader, GiSettings, GiShader, GlossySettings, GlossyShader, Renewal, Settings, Shader, World,
};

use crate::args::{Common, Compare, WalkArgs, WalkShader};
use crate::camera;
use crate::clock::{Seconds, Stopwatch};
use crate::command::walk::course::Course;
use crate::command::walk::drive::Drive;
use crate::command::walk::kept::Keeper;
use crate::command::walk::report::{FrameLine, Walk};
use crate::command::walk::stage::{Motion, add_grid};
use crate::failure::Failure;
use crate::load::{load, need_light};
use crate::progress::{Progress, interrupted};
use crate::report as reports;

/// Pictures that `--compare raytrace` makes: the median of their times counts, without that of the first.
const TIMED_PICTURES: usize = 4;

pub(crate) fn run(args: &WalkArgs, common: &Common) -> Result<(), Failure> {
    let watch = Stopwatch::start();
    let mut loaded = load(&args.scene)?;
    need_light(&loaded, &args.scene.scene)?;
    let grid = args.add_grid.then(|| add_grid(&mut loaded.scene));
    let motion = args
        .moves
        .as_deref()
        .map(|name| Motion::of(name, grid, &loaded.scene))
        .transpose()?;
    let load_seconds = watch.read();

    let watch = Stopwatch::start();
    let movable = Course::movable(args, &loaded.scene, motion.as_ref());
    let (world, dropped) = World::new(Arc::new(loaded.scene), &movable);
    let scene = Arc::clone(world.scene());
    let (width, height) = args.scene.size;
    let viewport = Viewport { width, height };
    let (camera, _) = camera::choose(&args.scene, &scene, world.tracer(), viewport)?;
    let mut course = Course::new(args, &scene, &camera, motion, common.seed)?;
    let (mut camera, mut places) = course.step(0);
    let settings = FrameSettings {
        seed: common.seed,
        threads: usize::from(args.display_threads),
        shadows_apart: true,
        latency: u8::from(args.overlap),
        calm_priority: calm_priority(args),
        ..FrameSettings::default()
    };
    let renderer = FrameRenderer::new(&scene, viewport, settings)
        .map_err(|error| Failure::Usage(format!("--size: {error}")))?;
    let mut world = Arc::new(world);
    let shader = shader_of(args, &world, (&camera, viewport))?;
    // The ray tracer has a shader of its own, so that neither gains by what the other has learned. A program is there once.
    let compared = (args.compare == Some(Compare::Raytrace)).then(|| match &args.shader_cmd {
        None => make_shader(args.shader, &world, gi_settings(args.gi_memory, false)),
        Some(_) => Arc::clone(&shader),
    });
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

    let samples = args
        .samples_per_frame
        .map_or_else(|| (viewport.pixels() / 100).max(1), |n| n as usize);
    let frames = course.frames();
    let mut keeper = Keeper::new(args, &renderer)?;
    let mut drive = Drive::new(args, renderer, Arc::clone(&shader), samples)?;
    let mut walk = Walk {
        scene: args.scene.scene.clone(),
        triangles: scene.triangle_count(),
        mesh_edges: drive.renderer().mesh_edges(),
        primitives: scene.primitive_count(),
        lights: scene.lights.len(),
        size: args.scene.size,
        shader: shader.name().to_owned(),
        samples,
        seed: common.seed,
        seconds: vec![("load", load_seconds), ("build", build_seconds)],
        warnings,
        // All memory for the report now: that of a walk stays the same from here to its end.
        frames: vec![FrameLine::default(); frames],
        ..Walk::default()
    };
    let progress = Progress::new("walking", frames as u64, common.quiet);
    let kept = |frame: usize| (frame + 1).is_multiple_of(args.every as usize) || frame + 1 == frames;
    let mut raytraced: Vec<Seconds> = Vec::new();
    for frame in 0..frames {
        if frame > 0 {
            (camera, places) = course.step(frame);
        }
        let watch = Stopwatch::start();
        if !places.is_empty() {
            let change = world
                .moved(&places)
                .map_err(|error| Failure::Work(format!("moving: {error}")))?;
            drive.changed(&change);
            if let Some(compared) = &compared
                && args.shader_cmd.is_none()
            {
                compared.changed(&change);
            }
            world = change.world;
        }
        if frame == 0 {
            walk.warm_up_samples = drive.warm_up(&camera);
        }
        let watch = if frame == 0 { Stopwatch::start() } else { watch };
        drive.draw(&camera);
        let mut drawn = watch.read();
        let report = *drive.renderer().report();
        let mut error = None;
        if kept(frame) {
            if let Some(compared) = &compared
                && raytraced.len() < TIMED_PICTURES
            {
                let watch = Stopwatch::start();
                ray_trace(&**compared, &camera, viewport, 1, common.seed).map_err(shader_failed)?;
                raytraced.push(watch.read());
            }
            // Of a shader beside the display the truth is what one says that has not seen a move.
            let exact = (args.live && args.reference && args.shader_cmd.is_none())
                .then(|| make_shader(args.shader, &world, gi_settings(args.gi_memory, false)));
            error = keeper.keep(
                frame,
                drive.renderer(),
                exact.as_deref().unwrap_or(&*shader),
                &camera,
            )?;
        }
        let watch = Stopwatch::start();
        if frame + 1 < frames {
            drive.shade();
        }
        let mut shaded = watch.read();
        if args.overlap {
            // The display thread's own part, in which it never waits, and the rest.
            let display = (1e-3 * report.ms.total).min(drawn.wall).min(drawn.cpu);
            shaded.wall += drawn.wall - display;
            shaded.cpu += drawn.cpu - display;
            (drawn.wall, drawn.cpu) = (display, display);
        }
        walk.frames[frame] = FrameLine {
            report,
            drawn,
            shaded,
            error,
        };
        if !progress.step() {
            return Err(Failure::Interrupted);
        }
    }
    progress.finish();
    let trouble = drive.trouble();
    walk.shader_errors = trouble.errors;
    if let Some(error) = &trouble.last
        && walk.warm_up_samples == 0
        && walk.frames.iter().all(|frame| frame.report.new_points == 0)
    {
        return Err(Failure::Work(format!(
            "the shader gave no sample at all, so that all frames are empty: {error}"
        )));
    }
    if let Some(error) = &trouble.last {
        eprintln!(
            "warning: the shader lost {} samples; the last time: {error}",
            trouble.failed
        );
    }
    walk.live = trouble.live;
    walk.finish(drive.renderer(), &raytraced);
    walk.unmarked = dropped_contrast(
        world.scene(),
        world.tracer(),
        &Settings::default(),
        drive.renderer().dropped_shadow_edges(),
        drive.renderer().settings().shadow_least_share,
    );
    if let Some(path) = &common.report {
        reports::write_json(path, &walk.json())?;
    }
    if !common.quiet {
        walk.print();
        keeper.print();
    }
    Ok(())
}

/// The shader that the command line asks for.
fn shader_of(
    args: &WalkArgs,
    world: &Arc<World>,
    (camera, viewport): (&Camera, Viewport),
) -> Result<Arc<dyn Shader>, Failure> {
    let Some(command) = &args.shader_cmd else {
        let gi = gi_settings(args.gi_memory, args.live);
        return Ok(make_shader(args.shader, world, gi));
    };
    let settings = ExternalSettings {
        scene: args.scene.scene.clone(),
        view: Some((camera.clone(), viewport)),
        stop: Some(interrupted),
        ..ExternalSettings::default()
    };
    let shader = ExternalShader::spawn(command, Arc::clone(world), &settings).map_err(|error| {
        if interrupted() {
            Failure::Interrupted
        } else {
            Failure::Work(format!("--shader-cmd '{command}': {error}"))
        }
    })?;
    Ok(Arc::new(shader))
}

/// With global illumination samples go evenly wherever points lack: noise of its records would pass for surprises, and where there are none yet, which is where
/// pictures change most, a point costs many times as much. Errors are 6% larger for it, and a second brings a third more frames.
fn calm_priority(args: &WalkArgs) -> f32 {
    match args.shader {
        WalkShader::Gi if args.shader_cmd.is_none() => 1.0,
        _ => FrameSettings::default().calm_priority,
    }
}

/// Settings of global illumination with so much memory (MiB), beside a display or not.
pub(super) fn gi_settings(memory: u32, live: bool) -> GiSettings {
    GiSettings {
        memory: (memory as usize) << 20,
        renewal: if live { Renewal::Gradual } else { Renewal::AtOnce },
        ..GiSettings::default()
    }
}

/// The shader of that name for a world; `gi` is for global illumination.
pub(super) fn make_shader(shader: WalkShader, world: &Arc<World>, gi: GiSettings) -> Arc<dyn Shader> {
    let (world, ambient) = (Arc::clone(world), world.suggested_ambient());
    match shader {
        WalkShader::Direct => Arc::new(DirectShader::new(world, ambient)),
        WalkShader::Glossy => Arc::new(GlossyShader::new(
            world,
            &GlossySettings {
                ambient,
                ..GlossySettings::default()
            },
        )),
        WalkShader::Gi => Arc::new(GiShader::new(world, &gi)),
    }
}

fn shader_failed(error: String) -> Failure {
    Failure::Work(format!("the shader failed: {error}"))
}
