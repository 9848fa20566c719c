//! Exact queries against brute force.

use glam::DVec3;
use llsr_scene::{EmissionLaw, Light, LinearLight, Scene, Viewport};
use llsr_shading::{Layer, Method, Settings, SurfacePoint, render};
use llsr_testkit::quadrature::{Law, line_irradiance};
use llsr_testkit::tracer::{fan_cells, primitive_shadows, world_triangles};
use llsr_tracer::{FanQuery, FanScratch, Tracer};
use llsr_visibility::Partition;

/// The pixels that are checked.
const VIEW: Viewport = Viewport {
    width: 16,
    height: 16,
};

/// What was compared.
pub(super) struct Checked {
    pub(super) points: usize,
    /// Places on lights whose visibility was compared.
    pub(super) places: usize,
    /// Of the irradiance, relative to its mean.
    pub(super) rel_rmse: f64,
    pub(super) largest: f64,
}

/// Compares exact queries and the irradiance of `exact` with brute force.
///
/// # Errors
/// If visibility differs anywhere.
pub(super) fn check(scene: &Scene) -> Result<Checked, String> {
    let (tracer, _) = Tracer::new(scene);
    let triangles = world_triangles(scene);
    let camera = scene.cameras.first().ok_or("the scene has no camera")?;
    let settings = Settings {
        method: Method::Exact,
        layers: vec![Layer::Irradiance],
        ..Settings::default()
    };
    let rendered =
        render(scene, &tracer, camera, VIEW, &settings, &|| true).map_err(|_| "interrupted".to_owned())?;
    let rendered = rendered.film.channel("irradiance.Y").unwrap_or_default();
    let rays = camera.rays(VIEW);
    let mut scratch = FanScratch::default();
    let mut visible = Partition::default();
    let (mut points, mut places) = (0, 0);
    let (mut sum, mut square, mut largest) = (0.0, 0.0, 0f64);
    for (i, &found) in (0..VIEW.width * VIEW.height).zip(rendered) {
        let (x, y) = (i % VIEW.width, i / VIEW.width);
        let (eye, direction) = rays.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let Some(hit) = tracer.closest(eye, direction, f64::INFINITY) else {
            continue;
        };
        let point = SurfacePoint::new(scene, &hit, direction);
        points += 1;
        let mut irradiance = 0.0;
        for light in &scene.lights {
            let Light::Linear(light) = light else {
                return Err(format!("{} is not a line", light.name()));
            };
            let Some(stretch) = above_horizon(&point, light) else {
                continue;
            };
            let query = FanQuery::new(point.origin, light.a, light.b);
            tracer.fan(&query, &mut scratch, &mut visible);
            for (from, to, blocked) in stretches(scene, &triangles, point.origin, light, stretch) {
                if to - from < 1e-9 {
                    continue;
                }
                let t = 0.5 * (from + to);
                places += 1;
                // An end within what the oracle of primitives can tell is not a difference.
                let unsure = to - from < 2e-6 || visible.changes().any(|change| (change.t - t).abs() < 1e-6);
                if blocked == visible.contains(t) && !unsure {
                    return Err(format!(
                        "{}: exact and brute force differ from {} at {t} of {}, in {from} to {to}: {visible:?} {stretch:?} {blocked}",
                        scene.name, point.origin, light.name
                    ));
                }
                if !blocked {
                    irradiance += light.flux * panel(&point, light, (from, to));
                }
            }
        }
        let error = f64::from(found) - irradiance;
        sum += irradiance;
        square += error * error;
        largest = largest.max(error.abs());
    }
    let mean = sum / points as f64;
    Ok(Checked {
        points,
        places,
        rel_rmse: (square / points as f64).sqrt() / mean,
        largest: largest / mean,
    })
}

/// The part of a light above the planes of the face and of the shading normal.
fn above_horizon(point: &SurfacePoint, light: &LinearLight) -> Option<(f64, f64)> {
    let (mut lo, mut hi) = (0f64, 1f64);
    for (from, normal) in [
        (point.origin, point.geometric_normal),
        (point.position, point.shading_normal),
    ] {
        let (at_a, at_b) = (normal.dot(light.a - from), normal.dot(light.b - from));
        if at_a <= 0.0 && at_b <= 0.0 {
            return None;
        }
        let crossing = at_a / (at_a - at_b);
        if at_a < 0.0 {
            lo = lo.max(crossing);
        }
        if at_b < 0.0 {
            hi = hi.min(crossing);
        }
    }
    (lo < hi).then_some((lo, hi))
}

/// A part of the light in stretches of one visibility, by brute force: cells of the triangles without what primitives hide.
fn stretches(
    scene: &Scene,
    triangles: &[[glam::Vec3; 3]],
    p: DVec3,
    light: &LinearLight,
    part: (f64, f64),
) -> Vec<(f64, f64, bool)> {
    let shadows = primitive_shadows(scene, p, light.a, light.b);
    let mut all = Vec::new();
    for cell in fan_cells(triangles, p, light.a, light.b) {
        let (first, last) = (cell.lo.max(part.0), cell.hi.min(part.1));
        if first >= last {
            continue;
        }
        let mut ends = vec![first, last];
        ends.extend(
            shadows
                .iter()
                .flat_map(|&(lo, hi)| [lo, hi])
                .filter(|&t| first < t && t < last),
        );
        ends.sort_unstable_by(f64::total_cmp);
        for pair in ends.windows(2) {
            let t = 0.5 * (pair[0] + pair[1]);
            let hidden = shadows.iter().any(|&(lo, hi)| lo <= t && t <= hi);
            all.push((pair[0], pair[1], cell.blocked || hidden));
        }
    }
    all
}

/// Irradiance of a stretch for a flux of 1.
fn panel(point: &SurfacePoint, light: &LinearLight, stretch: (f64, f64)) -> f64 {
    let law = match light.emission {
        EmissionLaw::Diffuse => Law::Diffuse,
        EmissionLaw::Isotropic => Law::Isotropic,
    };
    line_irradiance(
        point.position,
        point.shading_normal,
        (light.a, light.b),
        law,
        stretch,
    )
}
