//! What leaving out the shadow edges of outshone lights does to a picture, measured.

use std::cell::Cell;

use glam::DVec3;
use llsr_edges::{DroppedEdge, ImportanceReport, ShadowEdges, ShadowScene};
use llsr_quadrature::Receiver;
use llsr_scene::{LightId, Scene};
use llsr_shading::{DirectLight, Pixel, PreparedLights, Scratch, Settings, Statistics, SurfacePoint};
use llsr_tracer::Tracer;
use rayon::prelude::*;

/// Drops the shadow edges of lights that together give less than `threshold` of the light there, judged by three rays to each
/// stronger light at most.
///
/// See [`ShadowEdges::drop_unimportant`]. Cost: for each edge one ray and some 60 nanoseconds for each light, and a few rays for
/// those that seem unimportant.
pub fn drop_outshone(
    scene: &Scene,
    tracer: &Tracer,
    prepared: &ShadowScene,
    shadows: &mut ShadowEdges,
    threshold: f64,
) -> ImportanceReport {
    let above = 1e-5 * f64::from(scene.bounds().diagonal());
    // Light falls on smooth meshes as their shading normal says, which may tell a grazing light from a strong one quite
    // differently than the face's; it is looked up once for each edge.
    let known = Cell::new((DVec3::NAN, DVec3::NAN));
    let shading_normal = |point: DVec3, normal: DVec3| {
        if known.get().0 != point {
            let hit = tracer.closest(point + normal * above, -normal, 2.0 * above);
            let shaded = hit.map(|hit| SurfacePoint::new(scene, &hit, -normal).shading_normal);
            known.set((point, shaded.unwrap_or(normal)));
        }
        known.get().1
    };
    let lights = PreparedLights::new(&scene.lights, &scene.materials, &Settings::default());
    let receiver = |point: DVec3, normal: DVec3| Receiver {
        position: point,
        normal: shading_normal(point, normal),
    };
    let free = |light: LightId, point: DVec3, normal: DVec3| {
        lights.free_irradiance(light, &receiver(point, normal), normal)
    };
    let received = |light: LightId, point: DVec3, normal: DVec3| {
        let from = point + normal * above;
        lights.irradiance_past(light, &receiver(point, normal), normal, |place| {
            !tracer.occluded(from, place)
        })
    };
    shadows.drop_unimportant(prepared, threshold, free, received)
}

/// How strong the shadows are whose edges were left out, where those lay.
///
/// The contrast of a shadow is the irradiance that its light gives if nothing hides it, as a share of that and of what all other
/// lights really give there: the relative change from outside the shadow to where its light is hidden whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DroppedContrast {
    /// Places at which it was measured.
    pub measured: usize,
    /// Its mean, in [0, 1].
    pub mean: f64,
    /// The largest, in [0, 1].
    pub largest: f64,
    /// What the edges were dropped by.
    pub threshold: f64,
    /// Places at which it is above that.
    pub above: usize,
}

/// Measures the contrast of shadows at dropped edges with the visibility that `settings` ask for, exact by default.
///
/// `sample` is that of [`ImportanceReport`](llsr_edges::ImportanceReport), `threshold` what was given to
/// [`drop_unimportant`](llsr_edges::ShadowEdges::drop_unimportant). Places that receive no light at all, or lie on no surface of
/// `tracer`, are not counted. Cost: two answers of each light at each place, some ten microseconds; the same for any number of
/// threads.
pub fn dropped_contrast(
    scene: &Scene,
    tracer: &Tracer,
    settings: &Settings,
    sample: &[DroppedEdge],
    threshold: f64,
) -> DroppedContrast {
    // Light that nothing hides, by the same formulas: of a scene without objects.
    let (nothing, _) = Tracer::new(&Scene::default());
    let hidden = DirectLight::new(scene, tracer, settings);
    let free = DirectLight::new(scene, &nothing, settings);
    let reach = 1e-5 * f64::from(scene.bounds().diagonal());
    let contrasts: Vec<Option<f64>> = sample
        .par_iter()
        .map_init(
            Default::default,
            |(states, scratch): &mut (Vec<_>, Scratch), edge| {
                let hit = tracer.closest(edge.point + edge.normal * reach, -edge.normal, 2.0 * reach)?;
                let surface = SurfacePoint::new(scene, &hit, -edge.normal);
                let mut irradiances = |light: &DirectLight, of: &dyn Fn(LightId) -> bool| {
                    let mut sum = 0.0;
                    let (at, statistics) = (Pixel::default(), &mut Statistics::default());
                    light.shade_point(&surface, at, states, scratch, statistics, |id, answer| {
                        if of(id) {
                            sum += answer.irradiance;
                        }
                    });
                    sum
                };
                let others = irradiances(&hidden, &|id| id != edge.light);
                let own = irradiances(&free, &|id| id == edge.light);
                (own + others > 0.0).then(|| own / (own + others))
            },
        )
        .collect();
    let mut result = DroppedContrast {
        threshold,
        ..DroppedContrast::default()
    };
    let mut sum = 0.0;
    for contrast in contrasts.into_iter().flatten() {
        result.measured += 1;
        result.largest = result.largest.max(contrast);
        result.above += usize::from(contrast > threshold);
        sum += contrast;
    }
    result.mean = sum / result.measured.max(1) as f64;
    result
}
