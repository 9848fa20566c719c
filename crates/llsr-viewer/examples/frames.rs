//! A view without a window: flies, turns, drags an object and a light, a few seconds each, and says what frames took.
//!
//! `cargo run --release -p llsr-viewer --example frames -- [SCENE [MATERIAL=FLUX]]`, SCENE being a file or the name of a built-in scene.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use llsr_epr::{FrameReport, movable_objects};
use llsr_io::{LoadOptions, load_scene};
use llsr_scene::{Camera, Scene, Viewport, demo};
use llsr_shading::{DirectShader, Shader, World};
use llsr_viewer::{Button, Engine, Grip, ShaderChoice, ViewSettings};

const VIEWPORT: Viewport = Viewport {
    width: 512,
    height: 512,
};
/// How long each thing is done.
const LENGTH: Duration = Duration::from_secs(4);
/// Between the beginnings of two frames, as in the window.
const FRAME: Duration = Duration::from_micros(16_667);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "rooms".to_owned());
    let started = Instant::now();
    let scene = match demo::build(&name) {
        Some(scene) => scene,
        None => {
            let mut options = LoadOptions::default();
            for tube in args {
                options.tubes.push(tube.parse()?);
            }
            load_scene(Path::new(&name), &options)?.scene
        }
    };
    let movable = movable_objects(&scene);
    let (world, _) = World::new(Arc::new(scene), &movable);
    let camera = start(world.scene());
    let direct = ShaderChoice {
        name: "direct".to_owned(),
        make: Box::new(|world| {
            let ambient = world.suggested_ambient();
            Ok(Arc::new(DirectShader::new(world, ambient)) as Arc<dyn Shader>)
        }),
    };
    let settings = ViewSettings {
        samples: VIEWPORT.pixels() / 50,
        ..ViewSettings::default()
    };
    let mut engine = Engine::new(Arc::new(world), camera, VIEWPORT, vec![direct], settings)?;
    engine.frame(0.0);
    println!("first picture after {:.2} s", started.elapsed().as_secs_f64());

    run(&mut engine, "standing", |_, _| {});
    engine.key("KeyW", true);
    run(&mut engine, "flying ahead", |_, _| {});
    engine.key("KeyW", false);
    engine.key("Home", true);
    let middle = (256.0, 256.0);
    engine.pointer(middle.0, middle.1);
    engine.button(Button::Left, true);
    run(&mut engine, "turning", |engine, t| {
        engine.pointer(middle.0 + 120.0 * (2.0 * t).sin(), middle.1);
    });
    engine.button(Button::Left, false);
    engine.key("Home", true);
    for light in [false, true] {
        let what = if light {
            "dragging a light"
        } else {
            "dragging an object"
        };
        let Some((x, y)) = handle(&engine, light) else {
            println!("{what:18} there is none in view");
            continue;
        };
        if light {
            engine.key("KeyL", true);
        }
        engine.pointer(x, y);
        engine.button(Button::Right, true);
        run(&mut engine, what, |engine, t| {
            engine.pointer(x + 60.0 * (2.0 * t).sin(), y + 20.0 * (3.0 * t).sin());
        });
        engine.button(Button::Right, false);
    }
    let report = engine.report();
    println!("{} samples, {} moves", report.samples, report.moves);
    Ok(())
}

/// The scene's camera, or one that sees all of it.
fn start(scene: &Scene) -> Camera {
    let bounds = scene.bounds();
    let outside = || Camera::outside(bounds.center(), 0.5 * bounds.diagonal(), VIEWPORT);
    scene.cameras.first().cloned().unwrap_or_else(outside)
}

/// Draws frames for a while, before each of which `act` hears how many seconds have passed, and prints their times.
fn run(engine: &mut Engine, what: &str, act: impl Fn(&mut Engine, f64)) {
    let (start, mut last) = (Instant::now(), Instant::now());
    let (mut times, mut drawn) = (Vec::new(), Vec::new());
    let before = on_processor();
    while start.elapsed() < LENGTH {
        let now = Instant::now();
        act(engine, (now - start).as_secs_f64());
        engine.frame((now - last).as_secs_f64());
        times.push(now.elapsed().as_secs_f64() * 1e3);
        drawn.push(*engine.last_frame());
        last = now;
        std::thread::sleep(FRAME.saturating_sub(now.elapsed()));
    }
    let used = on_processor()
        .zip(before)
        .map(|(now, before)| (now - before) * 1e3 / times.len() as f64);
    let rate = times.len() as f64 / start.elapsed().as_secs_f64();
    times.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!(
        "{what:18} {rate:5.1} frames/s, display thread ms: median {:5.1}, 95% {:5.1}, most {:6.1}; {} ms of processor",
        at(0.5),
        at(0.95),
        at(1.0),
        used.map_or("?".to_owned(), |ms| format!("{ms:.1}"))
    );
    let median = |of: &dyn Fn(&FrameReport) -> f64| {
        let mut values: Vec<f64> = drawn.iter().map(of).collect();
        values.sort_unstable_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let stages = drawn[0].ms.named().map(|(name, _)| name);
    let stages = stages
        .iter()
        .enumerate()
        .map(|(i, name)| format!("{name} {:.1}", median(&|frame| frame.ms.named()[i].1)));
    println!(
        "{:18} {}; {:.0} edges, {} shadows to find",
        "",
        stages.collect::<Vec<_>>().join(", "),
        median(&|frame| (frame.silhouette_edges + frame.shadow_edges) as f64),
        engine.shadows_waiting()
    );
}

/// Seconds that this thread has been on a processor, where the system says so (Linux): what frames cost beside other work.
fn on_processor() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}

/// Where in the picture something can be taken hold of, as near to its middle as there is.
fn handle(engine: &Engine, light: bool) -> Option<(f64, f64)> {
    let (world, camera) = (engine.world(), engine.camera());
    let fits = |&(x, y): &(f64, f64)| {
        let grip = Grip::take(world, camera, VIEWPORT, (x, y), light);
        grip.is_some_and(|grip| grip.is_light() == light && grip.can_move(world))
    };
    let places =
        (0..64).flat_map(|y| (0..64).map(move |x| (f64::from(x) * 8.0 + 4.0, f64::from(y) * 8.0 + 4.0)));
    places.filter(fits).min_by(|a, b| {
        let away = |p: &(f64, f64)| (p.0 - 256.0).hypot(p.1 - 256.0);
        away(a).total_cmp(&away(b))
    })
}
