//! What a sample of each shader costs, and what it costs to move an object.
//!
//! ```text
//! cargo run --release -p llsr-shading --example shader_cost -- [SCENE [--tube MATERIAL=FLUX]]...
//! ```
//!
//! SCENE is a file or `demo:NAME`; without one, `demo:rooms`. One thread; rays are spread over a picture of 512 x 512 pixels.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::{Affine3A, Vec3};
use llsr_io::{LoadOptions, TubeRequest, load_scene};
use llsr_scene::{ObjectId, Scene, Viewport, demo};
use llsr_shading::{
    DirectShader, Encounters, GiSettings, GiShader, GlossySettings, GlossyShader, Place, ShadeRequest,
    Shader, ShaderScratch, World,
};

const SIZE: Viewport = Viewport {
    width: 512,
    height: 512,
};
/// Rays of a round; the second round has others.
const RAYS: u64 = 8192;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut scenes: Vec<(String, Vec<TubeRequest>)> = Vec::new();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        if argument == "--tube" {
            let request = rest
                .next()
                .ok_or("--tube MATERIAL=FLUX")?
                .parse::<TubeRequest>()?;
            scenes
                .last_mut()
                .ok_or("--tube comes after its scene")?
                .1
                .push(request);
        } else {
            scenes.push((argument.clone(), Vec::new()));
        }
    }
    if scenes.is_empty() {
        scenes.push(("demo:rooms".into(), Vec::new()));
    }
    for (name, tubes) in scenes {
        let scene = match name.strip_prefix("demo:") {
            Some(demo) => demo::build(demo).ok_or_else(|| format!("no demo {demo}"))?,
            None => {
                let options = LoadOptions {
                    tubes,
                    ..LoadOptions::default()
                };
                load_scene(Path::new(&name), &options)?.scene
            }
        };
        measure(&name, scene)?;
    }
    Ok(())
}

fn measure(name: &str, scene: Scene) -> Result<(), Box<dyn Error>> {
    let camera = scene.cameras.first().cloned().unwrap_or_else(|| {
        let bounds = scene.bounds();
        llsr_scene::Camera::outside(bounds.center(), 0.5 * bounds.diagonal(), SIZE)
    });
    println!(
        "{name}: {} triangles, {} objects, {} lights",
        scene.triangle_count(),
        scene.objects.len(),
        scene.lights.len()
    );
    let rays = |round: u64| -> Vec<ShadeRequest> {
        (0..RAYS)
            .map(|id| {
                // Points of a lattice of rank one.
                let number = (round * RAYS + id) as f64;
                let (x, y) = (
                    (number * 0.754_877_666_246_693).fract(),
                    (number * 0.569_840_290_998_053).fract(),
                );
                let (origin, direction) = camera.ray(SIZE, x * 512.0, y * 512.0);
                ShadeRequest {
                    id,
                    origin,
                    direction,
                }
            })
            .collect()
    };
    let movable: Vec<ObjectId> = (0..scene.objects.len().min(40)).map(ObjectId::from).collect();
    let (world, _) = World::new(Arc::new(scene), &[]);
    let world = Arc::new(world);
    let ambient = world.suggested_ambient();
    let direct = DirectShader::new(Arc::clone(&world), ambient);
    let glossy = GlossyShader::new(
        Arc::clone(&world),
        &GlossySettings {
            ambient,
            ..GlossySettings::default()
        },
    );
    let gi = GiShader::new(Arc::clone(&world), &GiSettings::default());
    for shader in [&direct as &dyn Shader, &glossy, &gi] {
        let mut scratch = ShaderScratch::default();
        let mut cost = Vec::new();
        let (mut points, mut met) = (Vec::new(), Encounters::default());
        for round in 0..3 {
            let rays = rays(round);
            points.clear();
            let start = Instant::now();
            for batch in rays.chunks(32) {
                shader.shade(batch, 0, &mut scratch, &mut points, &mut met)?;
            }
            cost.push(start.elapsed().as_secs_f64() * 1e6 / RAYS as f64);
        }
        println!(
            "  {:7} {:8.1} us a sample at first, {:8.1} and {:8.1} later; {} shadows, {} objects met",
            shader.name(),
            cost[0],
            cost[1],
            cost[2],
            met.triples.len(),
            met.objects.len(),
        );
        if shader.name() == "gi" {
            println!("          {:?}", gi.counts());
        }
    }
    let (mut world, _) = World::new(Arc::clone(world.scene()), &movable);
    let mut times: Vec<f64> = (0..201)
        .map(|step| {
            let object = movable[step % movable.len()];
            let by = Affine3A::from_translation(Vec3::new(0.001 * step as f32, 0.0, 0.0));
            let to = by * *world.transform(object);
            let start = Instant::now();
            if let Ok(change) = world.moved(&[Place::Object(object, to)]) {
                world = Arc::unwrap_or_clone(change.world);
            }
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!(
        "  moving one of {} objects: {:.3} ms (median)",
        movable.len(),
        times[100]
    );
    Ok(())
}
