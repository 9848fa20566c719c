//! Sixty-four bars between a tube and a floor, against their closed form in every pixel.

use llsr_scene::{Light, Scene, Viewport, demo};
use llsr_shading::{Film, Layer, Method, Settings, SurfacePoint, render};
use llsr_testkit::tracer::{AxisBox, PastBoxes, light_past_boxes};
use llsr_tracer::Tracer;

const VIEW: Viewport = Viewport {
    width: 72,
    height: 64,
};

/// What every pixel sees.
fn truth(scene: &Scene, tracer: &Tracer) -> Vec<PastBoxes> {
    let bars: Vec<AxisBox> = scene
        .meshes
        .iter()
        .filter(|mesh| mesh.name.starts_with("bar "))
        .map(AxisBox::of)
        .collect();
    assert_eq!(bars.len(), 64, "bars");
    let Light::Linear(light) = &scene.lights[0] else {
        panic!("a linear light")
    };
    let rays = scene.cameras[0].rays(VIEW);
    (0..VIEW.width * VIEW.height)
        .map(|i| {
            let (x, y) = (i % VIEW.width, i / VIEW.width);
            let (eye, direction) = rays.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            match tracer.closest(eye, direction, f64::INFINITY) {
                Some(hit) => {
                    let point = SurfacePoint::new(scene, &hit, direction);
                    light_past_boxes(&bars, point.position, point.origin, point.geometric_normal, light)
                }
                None => PastBoxes {
                    irradiance: 0.0,
                    changes: Some(0),
                },
            }
        })
        .collect()
}

fn picture(scene: &Scene, tracer: &Tracer, method: Method, nu: f64) -> Film {
    let settings = Settings {
        method,
        nu,
        epsilon: 1e-3,
        layers: vec![Layer::Irradiance, Layer::Discontinuities, Layer::Certificate],
        ..Settings::default()
    };
    render(scene, tracer, &scene.cameras[0], VIEW, &settings, &|| true)
        .expect("nobody interrupts")
        .film
}

fn layer<'a>(film: &'a Film, name: &str) -> &'a [f32] {
    film.channel(name).expect("the layer was asked for")
}

#[test]
fn exact_queries_are_right_in_every_pixel_and_the_finder_misses_less_for_smaller_nu() {
    let scene = demo::build("bars").expect("built in");
    let (tracer, warnings) = Tracer::new(&scene);
    assert!(warnings.is_empty(), "{warnings:?}");
    let truth = truth(&scene, &tracer);
    let total: usize = truth.iter().filter_map(|pixel| pixel.changes).sum();
    let unsure = truth.iter().filter(|pixel| pixel.changes.is_none()).count();
    let most = truth.iter().filter_map(|pixel| pixel.changes).max();
    assert!(
        unsure < 20 && most > Some(30),
        "{unsure} unsure pixels, at most {most:?} changes"
    );
    let mean = truth.iter().map(|pixel| pixel.irradiance).sum::<f64>() / truth.len() as f64;
    for method in [Method::Exact, Method::Auto] {
        let film = picture(&scene, &tracer, method, 0.25);
        let found = layer(&film, "irradiance.Y")
            .iter()
            .zip(layer(&film, "discontinuities.Y"));
        for (index, ((&irradiance, &changes), expected)) in found.zip(&truth).enumerate() {
            let (x, y) = (index as u32 % VIEW.width, index as u32 / VIEW.width);
            assert!(
                (f64::from(irradiance) - expected.irradiance).abs() < 1e-6 * (expected.irradiance + mean),
                "{method} at {x},{y}: {irradiance}, not {expected:?}"
            );
            if let Some(count) = expected.changes {
                assert_eq!(changes as usize, count, "{method}: changes at {x},{y}");
            }
        }
        assert!(
            layer(&film, "certificate.Y").iter().all(|&level| level == 0.0),
            "{method} promises exactness"
        );
    }
    let missed = [0.25, 0.05, 0.01].map(|nu| {
        let film = picture(&scene, &tracer, Method::Finder, nu);
        let found: f64 = layer(&film, "discontinuities.Y")
            .iter()
            .map(|&n| f64::from(n))
            .sum();
        1.0 - found / total as f64
    });
    assert!(
        missed[0] > 0.2 && missed[0] > 1.5 * missed[1] && missed[1] > 2.0 * missed[2],
        "shares of changes missed: {missed:?}"
    );
}
