//! Global illumination beside a display while a light is dragged: points a frame and the error of frames, with records renewed at once
//! and gradually.
//!
//! `cargo run --release -p llsr-epr --example gi_motion -- [SCENE.glb|demo:NAME] [KEY=VALUE]...`; keys: `tube` (MATERIAL=FLUX), `size` (192),
//! `drag` (seconds, 3), `every` (seconds between two moves, 1/30), `reach` (how far, as a share of the scene's diagonal, 0.05), `light` (its number, 0).
//!
//! A frame each 1/60 s, one shader thread. Errors are the median relative error of pixels and mean FLIP against four rays a pixel of a shader that never saw a move.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use llsr_epi::Picture;
use llsr_epr::{FrameRenderer, FrameSettings, Harvest, PoolSettings, ShaderPool, ShadowThread, ray_trace};
use llsr_io::{LoadOptions, load_scene};
use llsr_metrics::{Image, Options, compare};
use llsr_scene::{Camera, LightId, Scene, Viewport, demo};
use llsr_shading::{GiSettings, GiShader, Place, Renewal, World};

/// Between the beginnings of two frames.
const FRAME: Duration = Duration::from_micros(16_667);
/// Times (s) at which frames are compared: in the drag and after its end.
const DRAGGED: [f64; 2] = [1.0, 2.5];
const LET_GO: [f64; 5] = [0.1, 0.5, 1.0, 3.0, 8.0];

struct Arguments {
    scene: Scene,
    size: u32,
    drag: f64,
    every: f64,
    reach: f64,
    light: u32,
}

fn arguments() -> Option<Arguments> {
    let mut values: Vec<(String, String)> = Vec::new();
    let mut name = "demo:rooms".to_owned();
    for argument in std::env::args().skip(1) {
        match argument.split_once('=') {
            Some((key, value)) => values.push((key.to_owned(), value.to_owned())),
            None => name = argument,
        }
    }
    let text = |key: &str| values.iter().find(|(known, _)| known == key).map(|(_, v)| v);
    let number = |key: &str, otherwise: f64| text(key).map_or(Some(otherwise), |v| v.parse().ok());
    let scene = match name.strip_prefix("demo:") {
        Some(demo) => demo::build(demo)?,
        None => {
            let options = LoadOptions {
                tubes: text("tube").and_then(|t| t.parse().ok()).into_iter().collect(),
                ..LoadOptions::default()
            };
            load_scene(Path::new(&name), &options).ok()?.scene
        }
    };
    Some(Arguments {
        scene,
        size: number("size", 192.0)? as u32,
        drag: number("drag", 3.0)?,
        every: number("every", 1.0 / 30.0)?,
        reach: number("reach", 0.05)?,
        light: number("light", 0.0)? as u32,
    })
}

/// A frame to be compared when the run is over.
struct Kept {
    what: String,
    picture: Picture,
    world: Arc<World>,
    points: f64,
}

fn run(args: &Arguments, world: &Arc<World>, camera: &Camera, renewal: Renewal) -> Option<Vec<Kept>> {
    let viewport = Viewport {
        width: args.size,
        height: args.size,
    };
    let settings = FrameSettings {
        shadows_apart: true,
        ..FrameSettings::default()
    };
    let mut renderer = FrameRenderer::new(world.scene(), viewport, settings).ok()?;
    let gi = GiSettings {
        renewal,
        ..GiSettings::default()
    };
    let samples = viewport.pixels() / 50;
    let pool_settings = PoolSettings {
        queue: 2 * samples,
        ..PoolSettings::default()
    };
    let shader = Arc::new(GiShader::new(Arc::clone(world), &gi));
    let pool = ShaderPool::new(shader, &pool_settings).ok()?;
    let mut shadows = ShadowThread::start().ok()?;
    let mut harvest = Harvest::default();
    let mut world = Arc::clone(world);
    let light = LightId(args.light);
    let home = world.lights().get(light.index())?.clone();
    let diagonal = f64::from(world.bounds().diagonal());
    let mut kept = Vec::new();
    let (mut came, mut frames) = (0, 0);
    // All begin with a picture that has come to rest.
    let warm = 4.0;
    let start = Instant::now();
    let mut moves = 0.0;
    let mut times = vec![(0.0, "before".to_owned())];
    times.extend(DRAGGED.map(|t| (t, format!("drag {t} s"))));
    times.extend(LET_GO.map(|t| (args.drag + t, format!("let go {t} s"))));
    let mut times = times.into_iter().peekable();
    while let Some((time, _)) = times.peek() {
        let began = Instant::now();
        let now = start.elapsed().as_secs_f64() - warm;
        if now > 0.0 && now < args.drag && now > moves * args.every {
            moves = (now / args.every).floor() + 1.0;
            let mut at = home.clone();
            let offset = DVec3::new((2.0 * now).sin(), 0.2 * (3.0 * now).cos(), (1.4 * now).sin());
            at.translate(offset * args.reach * diagonal);
            let change = world.moved(&[Place::Light(light, at)]).ok()?;
            pool.changed(&change);
            renderer.changed(&change);
            world = change.world;
        }
        pool.collect(&mut harvest);
        came += harvest.fresh.len();
        renderer.take(&harvest.fresh, &harvest.met);
        shadows.tend(&mut renderer);
        renderer.draw(camera, samples);
        pool.submit(renderer.requests());
        frames += 1;
        if now >= *time {
            let (_, what) = times.next()?;
            kept.push(Kept {
                what,
                picture: renderer.picture().clone(),
                world: Arc::clone(&world),
                points: came as f64 / f64::from(frames),
            });
            (came, frames) = (0, 0);
        }
        std::thread::sleep(FRAME.saturating_sub(began.elapsed()));
    }
    Some(kept)
}

fn pixels(picture: &Picture) -> Vec<[f32; 3]> {
    let rows = (0..picture.size().1).map(|y| picture.row(y));
    rows.flat_map(|[r, g, b]| (0..r.len()).map(move |x| [r[x], g[x], b[x]]))
        .collect()
}

fn table() -> Option<()> {
    let args = arguments()?;
    let movable = llsr_epr::movable_objects(&args.scene);
    let world = Arc::new(World::new(Arc::new(args.scene.clone()), &movable).0);
    let size = Viewport {
        width: args.size,
        height: args.size,
    };
    let outside = |scene: &Scene| {
        let bounds = scene.bounds();
        Camera::outside(bounds.center(), 0.5 * bounds.diagonal(), size)
    };
    let camera = args
        .scene
        .cameras
        .first()
        .cloned()
        .unwrap_or_else(|| outside(&args.scene));
    println!("| renewed | frame | points a frame since the last row | median error % | FLIP |");
    println!("|---|---|---|---|---|");
    for (name, renewal) in [("at once", Renewal::AtOnce), ("gradually", Renewal::Gradual)] {
        let mut truth: Option<(Arc<World>, Vec<[f32; 3]>)> = None;
        for kept in run(&args, &world, &camera, renewal)? {
            if !truth.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, &kept.world)) {
                let exact = GiShader::new(Arc::clone(&kept.world), &GiSettings::default());
                let picture = ray_trace(&exact, &camera, size, 2, 0).ok()?;
                truth = Some((Arc::clone(&kept.world), pixels(&picture)));
            }
            let (side, shown) = (args.size as usize, pixels(&kept.picture));
            let truth = &truth.as_ref()?.1;
            let mut shares: Vec<f32> = shown
                .iter()
                .zip(truth)
                .filter(|(_, truth)| truth[1] > 0.0)
                .map(|(shown, truth)| (shown[1] / truth[1] - 1.0).abs())
                .collect();
            shares.sort_unstable_by(f32::total_cmp);
            let test = Image::new(side, side, &shown).ok()?;
            let truth = Image::new(side, side, truth).ok()?;
            let errors = compare(test, truth, &Options::default()).ok()?;
            println!(
                "| {name} | {} | {:.1} | {:.2} | {:.4} |",
                kept.what,
                kept.points,
                100.0 * shares[shares.len() / 2],
                errors.flip
            );
        }
    }
    Some(())
}

fn main() -> ExitCode {
    if table().is_some() {
        return ExitCode::SUCCESS;
    }
    eprintln!("usage: gi_motion [SCENE.glb|demo:NAME] [KEY=VALUE]...");
    ExitCode::FAILURE
}
