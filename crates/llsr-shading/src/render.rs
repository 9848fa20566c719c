//! The tile renderer.

use std::f64::consts::PI;

use llsr_quadrature::MetalRough;
use llsr_scene::{Camera, LightId, Scene, Viewport};
use llsr_tracer::Tracer;
use rayon::prelude::*;

use crate::direct::{Pixel, Work};
use crate::random::{mix, stream};
use crate::share::{representative, split_surface};
use crate::{DirectLight, Film, Layer, LightAnswer, LightState, Scratch, Settings, Statistics, SurfacePoint};

/// Width and height of a tile in pixels. Large, because coherence starts anew at each tile.
pub const TILE: (u32, u32) = (64, 32);

/// A finished picture.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture and its layers.
    pub film: Film,
    /// What it took.
    pub statistics: Statistics,
}

/// The caller's progress function asked to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interrupted;

/// Number of tiles of a picture, each of which is one step of progress.
pub fn tile_count(viewport: Viewport) -> u64 {
    u64::from(viewport.width.div_ceil(TILE.0)) * u64::from(viewport.height.div_ceil(TILE.1))
}

/// Renders a picture with the threads of the current rayon pool.
///
/// `progress` is called after each finished tile, from any thread; if it returns false the rendering stops.
/// The bits of the result depend on the arguments alone, not on the number of threads.
///
/// # Errors
/// [`Interrupted`] if `progress` returned false.
///
/// # Panics
/// If `settings` asks for no samples or for a light that the scene does not have.
pub fn render(
    scene: &Scene,
    tracer: &Tracer,
    camera: &Camera,
    viewport: Viewport,
    settings: &Settings,
    progress: &(dyn Fn() -> bool + Sync),
) -> Result<Rendered, Interrupted> {
    assert!(
        settings.spp > 0 && settings.samples > 0,
        "a picture needs at least one sample"
    );
    // The refinement looks at the irradiance, whether or not it was asked for.
    let asked = settings.layers.len();
    let mut with_irradiance = settings.clone();
    if settings.refine && !settings.layers.contains(&Layer::Irradiance) {
        with_irradiance.layers.push(Layer::Irradiance);
    }
    let settings = &with_irradiance;
    let direct = DirectLight::new(scene, tracer, settings);
    let columns = viewport.width.div_ceil(TILE.0);
    let tiles: Vec<Tile> = (0..tile_count(viewport))
        .map(|i| {
            Tile::new(
                viewport,
                (i % u64::from(columns)) as u32,
                (i / u64::from(columns)) as u32,
            )
        })
        .collect();
    let painter = Painter {
        scene,
        tracer,
        camera,
        viewport,
        settings,
        direct: &direct,
        split: 1,
    };
    let parts: Result<Vec<_>, Interrupted> = tiles
        .par_iter()
        .map_init(Brush::default, |brush, tile| {
            let part = painter.tile(tile, brush);
            if progress() { Ok(part) } else { Err(Interrupted) }
        })
        .collect();
    let mut film = Film::new(viewport, &settings.layers, scene);
    let mut statistics = Statistics::default();
    for (tile, (values, counts)) in tiles.iter().zip(parts?) {
        statistics.add(&counts);
        for ((_, channel), values) in film.channels.iter_mut().zip(values.chunks(tile.pixels())) {
            for (row, values) in values.chunks(tile.width as usize).enumerate() {
                let start = (tile.y as usize + row) * viewport.width as usize + tile.x as usize;
                channel[start..start + values.len()].copy_from_slice(values);
            }
        }
    }
    if settings.refine {
        refine(
            &Painter {
                split: SPLIT,
                ..painter
            },
            &mut film,
            &mut statistics,
        );
        film.channels.truncate(
            3 + settings.layers[..asked]
                .iter()
                .map(|layer| layer.channel_count())
                .sum::<usize>(),
        );
    }
    Ok(Rendered { film, statistics })
}

/// Parts of each light that a refined pixel searches on their own.
const SPLIT: u32 = 4;
/// Standard deviation of the irradiance in a 3x3 neighbourhood, relative to its mean, from which a pixel is rendered
/// again. A penumbra that a picture resolves changes less from pixel to pixel; speckle and edges change more.
const VARIATION: f64 = 0.06;

/// Renders pixels again around which the irradiance varies much, with each light in parts (Ouellette & Fiume 1999,
/// section 6, where it is a suggestion).
fn refine(painter: &Painter<'_>, film: &mut Film, statistics: &mut Statistics) {
    let Viewport { width, height } = film.viewport;
    let (w, h) = (width as usize, height as usize);
    let uneven: Vec<usize> = {
        let irradiance = film.channel("irradiance.Y").unwrap_or_default();
        (0..w * h)
            .filter(|&index| {
                let (x, y) = (index % w, index / w);
                let (mut sum, mut square, mut count) = (0.0, 0.0, 0.0);
                for v in y.saturating_sub(1)..(y + 2).min(h) {
                    for u in x.saturating_sub(1)..(x + 2).min(w) {
                        let value = f64::from(irradiance[v * w + u]);
                        sum += value;
                        square += value * value;
                        count += 1.0;
                    }
                }
                let mean = sum / count;
                (square / count - mean * mean).max(0.0).sqrt() > VARIATION * mean
            })
            .collect()
    };
    let again: Vec<(Vec<f64>, Statistics)> = uneven
        .par_iter()
        .map_init(Brush::default, |brush, &index| {
            let mut counts = Statistics::default();
            brush.states.iter_mut().for_each(LightState::clear);
            brush
                .states
                .resize(painter.scene.lights.len(), LightState::default());
            brush.pixel.clear();
            brush.pixel.resize(film.channels.len(), 0.0);
            painter.pixel((index % w) as u32, (index / w) as u32, brush, &mut counts);
            (brush.pixel.clone(), counts)
        })
        .collect();
    for (&index, (values, counts)) in uneven.iter().zip(&again) {
        for ((_, channel), &value) in film.channels.iter_mut().zip(values) {
            channel[index] = value as f32;
        }
        statistics.primary_rays += counts.primary_rays;
        statistics.visibility_tests += counts.visibility_tests;
        statistics.end_tests += counts.end_tests;
    }
    statistics.refined += uneven.len() as u64;
}

/// A rectangle of pixels.
struct Tile {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

impl Tile {
    fn new(viewport: Viewport, column: u32, row: u32) -> Self {
        let (x, y) = (column * TILE.0, row * TILE.1);
        Self {
            x,
            y,
            width: TILE.0.min(viewport.width - x),
            height: TILE.1.min(viewport.height - y),
        }
    }

    fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// Memory that one worker keeps from tile to tile.
#[derive(Default)]
struct Brush {
    scratch: Scratch,
    states: Vec<LightState>,
    /// The states after each pixel of the row above, column by column.
    above: Vec<LightState>,
    surfaces: Vec<SurfacePoint>,
    pixel: Vec<f64>,
}

struct Painter<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer,
    camera: &'a Camera,
    viewport: Viewport,
    settings: &'a Settings,
    direct: &'a DirectLight<'a>,
    /// Parts of each light that are searched on their own.
    split: u32,
}

impl Painter<'_> {
    /// All channels of a tile, one after the other, and what it took.
    fn tile(&self, tile: &Tile, brush: &mut Brush) -> (Vec<f32>, Statistics) {
        let channels = 3 + self
            .settings
            .layers
            .iter()
            .map(|layer| layer.channel_count())
            .sum::<usize>();
        let mut values = vec![0f32; channels * tile.pixels()];
        let mut statistics = Statistics::default();
        let lights = self.scene.lights.len();
        brush.states.iter_mut().for_each(LightState::clear);
        brush.states.resize(lights, LightState::default());
        brush.above.iter_mut().for_each(LightState::clear);
        brush
            .above
            .resize(lights * tile.width as usize, LightState::default());
        for row in 0..tile.height {
            for step in 0..tile.width {
                // In serpentine order every pixel but the first follows a neighbour.
                let column = if row % 2 == 0 { step } else { tile.width - 1 - step };
                brush.pixel.clear();
                brush.pixel.resize(channels, 0.0);
                let in_column = column as usize * lights..(column as usize + 1) * lights;
                for (state, above) in brush.states.iter_mut().zip(&brush.above[in_column.clone()]) {
                    state.prefer_richer(above);
                }
                self.pixel(tile.x + column, tile.y + row, brush, &mut statistics);
                for (state, above) in brush.states.iter().zip(&mut brush.above[in_column]) {
                    above.copy_changes(state);
                }
                let index = (row * tile.width + column) as usize;
                for (channel, &value) in brush.pixel.iter().enumerate() {
                    values[channel * tile.pixels() + index] = value as f32;
                }
            }
        }
        (values, statistics)
    }

    /// Adds up all subsamples of one pixel in `brush.pixel`.
    fn pixel(&self, x: u32, y: u32, brush: &mut Brush, statistics: &mut Statistics) {
        let spp = self.settings.spp;
        let weight = 1.0 / f64::from(spp);
        let index = u64::from(y) * u64::from(self.viewport.width) + u64::from(x);
        let seed = mix(self.settings.seed ^ mix(index));
        let mut surfaces = std::mem::take(&mut brush.surfaces);
        surfaces.clear();
        for subsample in 0..spp {
            let (dx, dy) = subpixel(spp, subsample, seed);
            let (origin, direction) = self
                .camera
                .ray(self.viewport, f64::from(x) + dx, f64::from(y) + dy);
            let hit = self.tracer.closest(origin, direction, f64::INFINITY);
            let surface = hit.map(|hit| SurfacePoint::new(self.scene, &hit, direction));
            self.geometry_layers(surface.as_ref(), weight, &mut brush.pixel);
            surfaces.extend(surface);
        }
        statistics.primary_rays += u64::from(spp);
        statistics.hits += surfaces.len() as u64;
        if self.settings.share && spp > 1 {
            surfaces.sort_by_key(|surface| surface.object);
            let mut rest = surfaces.as_mut_slice();
            let mut subsample = 0;
            while !rest.is_empty() {
                let (same, others) = split_surface(rest);
                let at = Pixel {
                    x,
                    y,
                    index,
                    subsample,
                };
                self.surface(same, at, weight, brush, statistics);
                subsample += 1;
                rest = others;
            }
        } else {
            for (subsample, surface) in surfaces.iter().enumerate() {
                let at = Pixel {
                    x,
                    y,
                    index,
                    subsample: subsample as u32,
                };
                self.surface(std::slice::from_ref(surface), at, weight, brush, statistics);
            }
        }
        brush.surfaces = surfaces;
    }

    /// Light on points of one surface, added to the picture and to the layers that concern light; `weight` is that of
    /// one point.
    fn surface(
        &self,
        points: &[SurfacePoint],
        at: Pixel,
        weight: f64,
        brush: &mut Brush,
        statistics: &mut Statistics,
    ) {
        let surface = &representative(points);
        let weight = weight * points.len() as f64;
        let mut radiance = surface.emission.as_dvec3();
        let mut sum = LightAnswer::default();
        let Brush {
            scratch,
            states,
            pixel,
            ..
        } = brush;
        let material = &self.scene.materials[surface.material.index()];
        let reflection = MetalRough {
            base_color: surface.albedo.as_dvec3(),
            metallic: f64::from(material.metallic),
            roughness: f64::from(material.roughness),
        };
        for (index, light) in self.scene.lights.iter().enumerate() {
            let id = LightId::from(index);
            let rng = stream(self.settings.seed, at.index, at.subsample, index as u32);
            let mut work = Work {
                at,
                split: self.split,
                rng,
                blockers: None,
                scratch: &mut *scratch,
                statistics: &mut *statistics,
            };
            let answer = self.direct.shade(surface, id, &mut states[index], &mut work);
            radiance += light.color().as_dvec3()
                * if self.settings.glossy {
                    reflection.radiance(&answer.lobes)
                } else {
                    reflection.base_color * (answer.irradiance / PI)
                };
            sum.add(&answer);
            let mut channel = 3;
            for &layer in &self.settings.layers {
                if layer == Layer::IrradianceOf(id) {
                    pixel[channel] += weight * answer.irradiance;
                }
                channel += layer.channel_count();
            }
        }
        for (i, value) in radiance.to_array().into_iter().enumerate() {
            brush.pixel[i] += weight * value;
        }
        let mut channel = 3;
        for &layer in &self.settings.layers {
            let value = match layer {
                Layer::Irradiance => Some(sum.irradiance),
                Layer::Discontinuities => Some(f64::from(sum.discontinuities)),
                Layer::Tests => Some(f64::from(sum.tests)),
                Layer::Certificate => Some(f64::from(sum.certificate.level())),
                _ => None,
            };
            if let Some(value) = value {
                brush.pixel[channel] += weight * value;
            }
            channel += layer.channel_count();
        }
    }

    /// Layers that do not depend on light.
    fn geometry_layers(&self, surface: Option<&SurfacePoint>, weight: f64, pixel: &mut [f64]) {
        let mut channel = 3;
        for &layer in &self.settings.layers {
            match (layer, surface) {
                (Layer::Albedo, Some(s)) => {
                    for (i, value) in s.albedo.to_array().into_iter().enumerate() {
                        pixel[channel + i] += weight * f64::from(value);
                    }
                }
                (Layer::Normal, Some(s)) => {
                    for (i, value) in s.shading_normal.to_array().into_iter().enumerate() {
                        pixel[channel + i] += weight * value;
                    }
                }
                (Layer::Depth, surface) => {
                    pixel[channel] += weight * surface.map_or(f64::INFINITY, |s| s.distance);
                }
                _ => {}
            }
            channel += layer.channel_count();
        }
    }
}

/// Where subsample `index` of `count` lies in its pixel: the centre if it is alone, else one random point in
/// each of `count` cells of equal area, in rows.
fn subpixel(count: u32, index: u32, pixel_seed: u64) -> (f64, f64) {
    if count == 1 {
        return (0.5, 0.5);
    }
    let columns = f64::from(count).sqrt().ceil() as u32;
    let (row, in_row) = (index / columns, index % columns);
    // The last row may hold fewer cells; rows are as high as their cells are many, so that areas are equal.
    let cells = columns.min(count - row * columns);
    let bits = mix(pixel_seed ^ u64::from(index + 1));
    let unit = |bits: u64| (bits >> 40) as f64 / (1u64 << 24) as f64;
    let dx = (f64::from(in_row) + unit(bits)) / f64::from(cells);
    let dy = (f64::from(row * columns) + unit(bits << 24) * f64::from(cells)) / f64::from(count);
    (dx, dy)
}

#[cfg(test)]
mod tests {
    use super::subpixel;

    #[test]
    fn subsamples_stay_in_the_pixel_and_average_to_its_centre() {
        assert_eq!(subpixel(1, 0, 7), (0.5, 0.5), "one ray goes through the centre");
        for count in [2, 3, 5, 16, 17, 64] {
            let (mut sx, mut sy) = (0.0, 0.0);
            let pixels = 400;
            for pixel in 0..pixels {
                for index in 0..count {
                    let (x, y) = subpixel(count, index, super::mix(pixel));
                    assert!(
                        (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y),
                        "({x}, {y}) of {count}"
                    );
                    sx += x;
                    sy += y;
                }
            }
            let n = f64::from(count) * pixels as f64;
            assert!((sx / n - 0.5).abs() < 0.02, "{count}: mean x {}", sx / n);
            assert!((sy / n - 0.5).abs() < 0.02, "{count}: mean y {}", sy / n);
        }
    }
}
