//! The tile renderer.

use llsr_scene::{Camera, Scene, Viewport};
use llsr_tracer::Tracer;
use rayon::prelude::*;

use crate::paint::{Brush, Painter, Tile};
use crate::{DirectLight, Film, Layer, Settings, Statistics};

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
        rays: camera.rays(viewport),
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
            let (x, y) = ((index % w) as u32, (index / w) as u32);
            let values = painter.lone_pixel(x, y, film.channels.len(), brush, &mut counts);
            (values, counts)
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
