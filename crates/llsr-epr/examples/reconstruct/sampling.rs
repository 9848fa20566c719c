//! Shaded samples, spread at random or where they are wanted.

use glam::{DVec3, Vec2, Vec3};
use llsr_epi::{EdgePointImage, Picture, Point};
use llsr_render_cache::{Chooser, Priorities};
use llsr_scene::{Scene, Triple};
use llsr_shading::{DirectLight, LightState, Pixel, Scratch, Settings, Statistics, SurfacePoint};
use llsr_testkit::epi::blind::ScreenSample;
use llsr_testkit::epi::windows::Stream;

use crate::View;

/// Shades pixels at random places in them.
pub(crate) struct Sampler<'a> {
    view: &'a View<'a>,
    direct: DirectLight<'a>,
    places: Vec<[f32; 2]>,
    states: Vec<LightState>,
    scratch: Scratch,
    statistics: Statistics,
}

/// Samples with their depths.
pub(crate) type Samples = Vec<(ScreenSample, f32)>;

impl<'a> Sampler<'a> {
    pub(crate) fn new(view: &'a View<'a>, settings: &'a Settings) -> Self {
        let mut stream = Stream::new(11);
        let viewport = view.viewport;
        let places = (0..viewport.height)
            .flat_map(|y| (0..viewport.width).map(move |x| [x as f32, y as f32]))
            .map(|[x, y]| [x + stream.unit(), y + stream.unit()])
            .collect();
        Self {
            view,
            direct: DirectLight::new(view.scene, view.tracer, settings),
            places,
            states: Vec::new(),
            scratch: Scratch::default(),
            statistics: Statistics::default(),
        }
    }

    /// A share `density` of the pixels, at random.
    pub(crate) fn scattered(&self, density: f32) -> Vec<u32> {
        let mut stream = Stream::new(12);
        (0..self.places.len() as u32)
            .filter(|_| stream.unit() < density)
            .collect()
    }

    /// `count` pixels where interpolation found few samples.
    pub(crate) fn wanted(&self, picture: &Picture, count: usize, phase: f64) -> Vec<u32> {
        let viewport = self.view.viewport;
        let (Ok(mut priorities), Ok(mut chooser)) = (
            Priorities::new(viewport.width, viewport.height),
            Chooser::new(viewport.width, viewport.height),
        ) else {
            return Vec::new();
        };
        for y in 0..viewport.height {
            priorities.row_mut(y).copy_from_slice(picture.priorities(y));
        }
        let mut requests = Vec::new();
        chooser.choose(&mut priorities, count, phase, 0, &mut requests);
        requests
            .iter()
            .map(|request| request.y * viewport.width + request.x)
            .collect()
    }

    /// Shades one sample in each of the pixels and notes who hides which light from it.
    pub(crate) fn shade(&mut self, pixels: &[u32], triples: &mut Vec<Triple>) -> Samples {
        let View {
            tracer,
            camera,
            viewport,
            ..
        } = *self.view;
        let scene: &Scene = self.view.scene;
        let mut blockers = Vec::new();
        let mut samples = Vec::new();
        for &index in pixels {
            let position = self.places[index as usize];
            let (origin, direction) = camera.ray(viewport, f64::from(position[0]), f64::from(position[1]));
            let Some(hit) = tracer.closest(origin, direction, f64::INFINITY) else {
                let colour = [0.0; 3];
                samples.push((ScreenSample { position, colour }, f32::INFINITY));
                continue;
            };
            let point = SurfacePoint::new(scene, &hit, direction);
            let at = Pixel {
                x: index % viewport.width,
                y: index / viewport.width,
                index: u64::from(index),
                subsample: 0,
            };
            let mut light = DVec3::ZERO;
            self.direct.shade_point_and_blockers(
                &point,
                at,
                &mut self.states,
                &mut self.scratch,
                &mut self.statistics,
                &mut blockers,
                |id, answer, blockers| {
                    light += scene.lights[id.index()].color().as_dvec3() * answer.irradiance;
                    triples.extend(blockers.iter().map(|&blocker| Triple {
                        light: id,
                        blocker,
                        receiver: point.object,
                    }));
                },
            );
            let colour = point.emission + point.albedo * light.as_vec3() * std::f32::consts::FRAC_1_PI;
            let depth = (point.position - camera.position).dot(camera.forward()) as f32;
            let colour = colour.to_array();
            samples.push((ScreenSample { position, colour }, depth));
        }
        triples.sort_unstable();
        triples.dedup();
        samples
    }
}

/// Puts samples into an image.
pub(crate) fn insert(image: &mut EdgePointImage, samples: &[(ScreenSample, f32)]) {
    for (sample, depth) in samples {
        image.insert(&Point {
            position: Vec2::from(sample.position),
            depth: *depth,
            colour: Vec3::from(sample.colour),
        });
    }
}
