//! Many changes of visibility: exact queries in every pixel, and what the finder misses.

use std::fmt::Write as _;

use llsr_scene::{Light, Scene, Viewport, demo};
use llsr_shading::{Film, Layer, Method, Settings, SurfacePoint, render};
use llsr_testkit::tracer::{AxisBox, PastBoxes, light_past_boxes};
use llsr_tracer::Tracer;

const VIEW: Viewport = Viewport {
    width: 256,
    height: 256,
};

/// Largest difference of the irradiance, relative to it and the picture's mean together, that counts as agreement.
const TOLERANCE: f64 = 1e-6;

fn picture(scene: &Scene, tracer: &Tracer, method: Method, nu: f64, epsilon: f64) -> Result<Film, String> {
    let settings = Settings {
        method,
        nu,
        epsilon,
        layers: vec![Layer::Irradiance, Layer::Discontinuities],
        ..Settings::default()
    };
    let camera = scene.cameras.first().ok_or("the scene has no camera")?;
    render(scene, tracer, camera, VIEW, &settings, &|| true)
        .map(|rendered| rendered.film)
        .map_err(|_| "interrupted".to_owned())
}

/// The closed form of what each pixel sees of the tube past the bars.
fn truth(scene: &Scene, tracer: &Tracer) -> Result<Vec<PastBoxes>, String> {
    let bars: Vec<AxisBox> = scene
        .meshes
        .iter()
        .filter(|mesh| mesh.name.starts_with("bar "))
        .map(AxisBox::of)
        .collect();
    let Some(Light::Linear(light)) = scene.lights.first() else {
        return Err("the bars have no tube".to_owned());
    };
    let rays = scene.cameras[0].rays(VIEW);
    let pixels = (0..VIEW.width * VIEW.height).map(|i| {
        let (x, y) = (i % VIEW.width, i / VIEW.width);
        let (eye, direction) = rays.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
        tracer.closest(eye, direction, f64::INFINITY).map_or(
            PastBoxes {
                irradiance: 0.0,
                changes: Some(0),
            },
            |hit| {
                let point = SurfacePoint::new(scene, &hit, direction);
                light_past_boxes(&bars, point.position, point.origin, point.geometric_normal, light)
            },
        )
    });
    Ok(pixels.collect())
}

/// The section about many changes.
pub(super) fn many_changes() -> Result<String, String> {
    let scene = demo::build("bars").ok_or("no scene bars")?;
    let (tracer, _) = Tracer::new(&scene);
    let truth = truth(&scene, &tracer)?;
    let mean = truth.iter().map(|pixel| pixel.irradiance).sum::<f64>() / truth.len() as f64;
    let exact = picture(&scene, &tracer, Method::Exact, 0.25, 0.05)?;
    let (irradiance, changes) = layers(&exact)?;
    let (mut wrong, mut wrong_counts, mut unsure, mut total, mut most) = (0, 0, 0, 0usize, 0);
    for ((&irradiance, &changes), truth) in irradiance.iter().zip(changes).zip(&truth) {
        let difference = (f64::from(irradiance) - truth.irradiance).abs();
        wrong += usize::from(difference > TOLERANCE * (truth.irradiance + mean));
        match truth.changes {
            Some(count) => {
                wrong_counts += usize::from(changes as usize != count);
                total += count;
                most = most.max(count);
            }
            None => unsure += 1,
        }
    }
    let pixels = truth.len();
    let mut text = format!(
        "\n## Many changes: 64 bars, `demo:bars`\n\n\
         The light that passes the bars has a closed form. In {} of {pixels} pixels the irradiance of `exact` is that within 1e-6, \
         and in {} of {} the number of changes is (in {unsure} pixels two of them lie within 1e-6 of each other); there are {:.1} \
         changes a pixel, at most {most}.\n\n\
         The finder, which only tests, misses by nu (epsilon 0.001; errors are those of the irradiance):\n\n\
         | nu | changes missed | pixels with a miss | relative RMSE |\n|---|---|---|---|\n",
        pixels - wrong,
        pixels - unsure - wrong_counts,
        pixels - unsure,
        total as f64 / pixels as f64
    );
    if wrong + wrong_counts > 0 {
        return Err(format!(
            "exact differs from the closed form of the bars: {wrong} irradiances, {wrong_counts} counts"
        ));
    }
    for nu in [0.25, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002] {
        let film = picture(&scene, &tracer, Method::Finder, nu, 1e-3)?;
        let (irradiance, changes) = layers(&film)?;
        let (mut found, mut incomplete, mut square) = (0, 0, 0.0);
        for ((&irradiance, &changes), truth) in irradiance.iter().zip(changes).zip(&truth) {
            square += (f64::from(irradiance) - truth.irradiance).powi(2);
            if let Some(count) = truth.changes {
                found += changes as usize;
                incomplete += usize::from((changes as usize) < count);
            }
        }
        let _ = writeln!(
            text,
            "| {nu} | {:.2}% | {:.2}% | {:.1e} |",
            100.0 * (1.0 - found as f64 / total as f64),
            100.0 * incomplete as f64 / pixels as f64,
            (square / pixels as f64).sqrt() / mean
        );
    }
    Ok(text)
}

fn layers(film: &Film) -> Result<(&[f32], &[f32]), String> {
    let channel = |name: &str| film.channel(name).ok_or_else(|| format!("no layer {name}"));
    Ok((channel("irradiance.Y")?, channel("discontinuities.Y")?))
}
