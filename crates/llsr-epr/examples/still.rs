//! How far still pictures from few samples are from one in which every pixel is shaded: `still`.

use llsr_epr::{StillSettings, render_still};
use llsr_scene::{Viewport, demo};
use llsr_tracer::Tracer;

fn main() {
    let Some(scene) = demo::build("subway") else {
        return;
    };
    let (tracer, _) = Tracer::new(&scene);
    let viewport = Viewport {
        width: 160,
        height: 160,
    };
    let render = |density: f64| {
        let settings = StillSettings {
            density,
            ..StillSettings::default()
        };
        render_still(
            &scene,
            &tracer,
            &scene.cameras[0],
            viewport,
            &settings,
            &[],
            &|| true,
        )
    };
    let Ok(full) = render(1.0) else { return };
    let mean = |still: &llsr_epr::Still| {
        let sum: f32 = still.film.pixels().flatten().sum();
        sum / (3 * viewport.pixels()) as f32
    };
    println!("density  shaded  rmse relative to the mean");
    for density in [0.4, 0.2, 0.1, 0.05] {
        let Ok(still) = render(density) else { return };
        let square: f32 = still
            .film
            .pixels()
            .zip(full.film.pixels())
            .flat_map(|(a, b)| [0, 1, 2].map(|i| (a[i] - b[i]).powi(2)))
            .sum();
        let rmse = (square / (3 * viewport.pixels()) as f32).sqrt();
        let shaded: usize = still.counts.rounds.iter().sum();
        println!("{density:7.2}  {shaded:6}  {:.4}", rmse / mean(&full));
    }
}
