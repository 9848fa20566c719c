//! A view without a window: flies ahead for a second and says how fast frames came.
//!
//! `cargo run --release -p llsr-viewer --example frames -- rooms`

use std::sync::Arc;
use std::time::Instant;

use llsr_epr::movable_objects;
use llsr_scene::{Viewport, demo};
use llsr_shading::{DirectShader, Shader, World};
use llsr_viewer::{Engine, ShaderChoice, ViewSettings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "rooms".to_owned());
    let scene = demo::build(&name).ok_or("there is no such built-in scene")?;
    let (camera, movable) = (scene.cameras[0].clone(), movable_objects(&scene));
    let (world, _) = World::new(Arc::new(scene), &movable);
    let direct = ShaderChoice {
        name: "direct".to_owned(),
        make: Box::new(|world| {
            let ambient = world.suggested_ambient();
            Ok(Arc::new(DirectShader::new(world, ambient)) as Arc<dyn Shader>)
        }),
    };
    let viewport = Viewport {
        width: 512,
        height: 512,
    };
    let settings = ViewSettings::default();
    let mut engine = Engine::new(Arc::new(world), camera, viewport, vec![direct], settings)?;
    engine.key("KeyW", true);
    let mut last = Instant::now();
    let end = last + std::time::Duration::from_secs(1);
    while last < end {
        let now = Instant::now();
        engine.frame((now - last).as_secs_f64());
        last = now;
    }
    let report = engine.report();
    println!(
        "{} frames, {:.1} ms of the display thread each, {} samples",
        report.frames, report.median_frame_ms, report.samples
    );
    Ok(())
}
