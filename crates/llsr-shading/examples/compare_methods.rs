//! Renders a built-in scene by several methods and prints what each costs and how far it is off.
//!
//! `cargo run --release -p llsr-shading --example compare_methods -- cylinder-2`

use llsr_scene::{Viewport, demo};
use llsr_shading::{Film, Layer, Method, Rendered, Settings, render};
use llsr_tracer::Tracer;

fn main() -> Result<(), String> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "wall".to_owned());
    let scene = demo::build(&name).ok_or_else(|| format!("there is no built-in scene '{name}'"))?;
    let (tracer, _) = Tracer::new(&scene);
    let camera = scene.cameras.first().ok_or("the scene has no camera")?;
    let viewport = Viewport {
        width: 160,
        height: 120,
    };
    let picture = |settings: Settings| -> Result<Rendered, String> {
        render(&scene, &tracer, camera, viewport, &settings, &|| true).map_err(|_| "stopped".to_owned())
    };
    let layers = vec![Layer::Irradiance];
    let careful = Settings {
        epsilon: 1e-7,
        nu: 0.02,
        layers: layers.clone(),
        ..Settings::default()
    };
    let truth = picture(careful)?;
    println!("{:<20} {:>14} {:>16}", "method", "tests a pixel", "relative rmse");
    for method in Method::ALL {
        let settings = Settings {
            method,
            samples: 6,
            layers: layers.clone(),
            ..Settings::default()
        };
        let rendered = picture(settings)?;
        let tests = rendered.statistics.visibility_tests as f64 / rendered.statistics.hits as f64;
        println!(
            "{method:<20} {tests:>14.2} {:>16.5}",
            relative_error(&rendered.film, &truth.film)
        );
    }
    Ok(())
}

fn relative_error(film: &Film, truth: &Film) -> f64 {
    let channel = |film: &Film| film.channel("irradiance.Y").unwrap_or_default().to_vec();
    let (a, b) = (channel(film), channel(truth));
    let mean = b.iter().sum::<f32>() / b.len() as f32;
    let square: f32 = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum();
    f64::from((square / b.len() as f32).sqrt() / mean)
}
