//! Finished pictures from few shaded pixels.

mod edges;
mod paint;
mod sample;
mod shadows;
mod shown;
mod spread;
mod surface;

use std::f32::consts::FRAC_1_PI;

use glam::{Vec3, Vec3A};
use llsr_edges::{SceneEdgeOptions, SceneEdges};
use llsr_epi::{EdgeList, EdgePointImage, Occlusion, Picture, PixelClass, Point, SizeError};
use llsr_scene::{Camera, Projection, Scene, Viewport, luminance};
use llsr_shading::{DirectLight, Film, Settings, Statistics};
use llsr_tracer::Tracer;
use rayon::prelude::*;

pub use edges::view_edges;
pub use shadows::{NarrowShadows, narrow_shadow_edges};
pub use shown::layer_colours;

use crate::DroppedContrast;
use crate::still::paint::Painter;
use crate::still::sample::{Choice, Shaded};
use crate::still::spread::{AROUND, Links};
use crate::still::surface::{Seen, look_everywhere};

/// A layer beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StillLayer {
    /// `edges.Y`: 0 in pixels without an edge, 0.5 in those with one, 1 in complex ones.
    Edges,
    /// `reach.Y`: the 24-bit mask of neighbours that a pixel reaches, as a number (see
    /// [`EdgePointImage::reach_mask`]).
    Reach,
    /// `samples.Y`: the round (from 1) in which the pixel was shaded, 0 if it was interpolated; the negative number of
    /// subsamples shaded where surfaces mix in a pixel that no round shaded.
    Samples,
    /// `irradiance.Y`: luminance of the irradiance from all lights.
    Irradiance,
    /// `albedo.R/G/B` at the pixel's centre.
    Albedo,
    /// `normal.X/Y/Z`: shading normal at the pixel's centre.
    Normal,
    /// `depth.Z`: distance along the ray through the pixel's centre (m).
    Depth,
}

impl StillLayer {
    /// All layers, in the order of their names on the command line.
    pub const ALL: [(&'static str, Self); 7] = [
        ("edges", Self::Edges),
        ("reach", Self::Reach),
        ("samples", Self::Samples),
        ("irradiance", Self::Irradiance),
        ("albedo", Self::Albedo),
        ("normal", Self::Normal),
        ("depth", Self::Depth),
    ];

    /// The layer of that name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .find(|known| known.0 == name)
            .map(|known| known.1)
    }

    fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Edges => &["edges.Y"],
            Self::Reach => &["reach.Y"],
            Self::Samples => &["samples.Y"],
            Self::Irradiance => &["irradiance.Y"],
            Self::Albedo => &["albedo.R", "albedo.G", "albedo.B"],
            Self::Normal => &["normal.X", "normal.Y", "normal.Z"],
            Self::Depth => &["depth.Z"],
        }
    }
}

/// How a picture is made from few samples.
#[derive(Clone, Debug, PartialEq)]
pub struct StillSettings {
    /// Shaded pixels as a share of all, in (0, 1]. Complex pixels, and one pixel in each region that would have no sample,
    /// come on top.
    pub density: f64,
    /// Rounds in which samples are chosen, at least 1; each looks where the picture of the one before changes.
    pub rounds: u32,
    /// Rays through a complex pixel, at least 1.
    pub complex_samples: u32,
    /// Angle between the normals of two faces (degrees) above which their common edge counts.
    pub crease_degrees: f64,
    /// Whether shadow edges are sought where penumbrae take less than three pixels. They follow from what the samples of the
    /// first round met.
    pub shadow_edges: bool,
    /// Whether samples stop at edges; without, they spread over everything, for comparison.
    pub edges: bool,
    /// How surface points are shaded; rays a pixel, refinement and layers are not looked at.
    pub shading: Settings,
    /// Layers beside the picture.
    pub layers: Vec<StillLayer>,
}

impl Default for StillSettings {
    fn default() -> Self {
        Self {
            density: 0.05,
            rounds: 3,
            complex_samples: 16,
            crease_degrees: 30.0,
            shadow_edges: true,
            edges: true,
            shading: Settings::default(),
            layers: Vec::new(),
        }
    }
}

/// What a picture took, in pixels where nothing else is said.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StillCounts {
    /// Segments of edges before clipping and hiding.
    pub segments: usize,
    /// Those of them that are edges of shadows.
    pub shadow_segments: usize,
    /// Shadow edges that were left out because other lights outshine theirs.
    pub shadow_edges_dropped: usize,
    /// How strong the shadows of those are.
    pub dropped_contrast: DroppedContrast,
    /// Pixels without an edge.
    pub empty: usize,
    /// Pixels with one edge.
    pub simple: usize,
    /// The others, which are supersampled.
    pub complex: usize,
    /// Points shaded in complex pixels.
    pub complex_shaded: usize,
    /// Pixels shaded in each round; the first has those of small regions, too.
    pub rounds: Vec<usize>,
    /// Of the first round: pixels of regions that the pattern of samples missed.
    pub regions_missed: usize,
    /// Pixels whose albedo was supersampled because it changes around them.
    pub detailed: usize,
}

/// A finished picture.
#[derive(Clone, Debug)]
pub struct Still {
    /// The picture and its layers.
    pub film: Film,
    /// What the shading did.
    pub statistics: Statistics,
    /// What the rest did.
    pub counts: StillCounts,
}

/// Why there is no picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StillError {
    /// The size does not suit an edge-and-point image.
    Size(SizeError),
    /// The caller's progress function asked to stop.
    Interrupted,
}

impl std::fmt::Display for StillError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Size(error) => error.fmt(f),
            Self::Interrupted => f.write_str("interrupted"),
        }
    }
}

impl std::error::Error for StillError {}

/// How often [`render_still`] calls its progress function at most.
pub fn still_steps(viewport: Viewport, rounds: u32) -> u64 {
    // One round more for the regions that shadow edges cut off.
    3 * u64::from(viewport.height) + sample::CHUNKS as u64 * (u64::from(rounds) + 1)
}

/// Makes a picture from a few shaded pixels and the edges between them (BWG03, sections 4 and 5, for stills), with the
/// threads of the current rayon pool.
///
/// One ray through the centre of each pixel finds the surfaces. Irradiance is shaded in few pixels, spread over those that
/// they reach without crossing an edge, and multiplied by each pixel's own albedo, so that textures stay sharp. Pixels with
/// one edge are blended from both sides; complex ones are supersampled, with the light that pixels around have on the same
/// surface, or a point shaded for it where there are none. `shadow_edges` are further edges (m, recentred frame), say those of shadows.
///
/// `progress` is called from any thread, at most [`still_steps`] times; if it returns false the work stops. The bits of the result
/// depend on the other arguments alone.
///
/// # Errors
/// A size that is 0 or above [`llsr_epi::MAX_SIZE`], and interruption.
pub fn render_still(
    scene: &Scene,
    tracer: &Tracer,
    camera: &Camera,
    viewport: Viewport,
    settings: &StillSettings,
    shadow_edges: &[[Vec3; 2]],
    progress: &(dyn Fn() -> bool + Sync),
) -> Result<Still, StillError> {
    let (width, height) = (viewport.width, viewport.height);
    let mut image =
        EdgePointImage::new(width, height, llsr_epi::Settings::default()).map_err(StillError::Size)?;
    let mut counts = StillCounts::default();
    let mut statistics = Statistics::default();

    let seen = look_everywhere(scene, tracer, camera, viewport, progress).ok_or(StillError::Interrupted)?;
    statistics.primary_rays += seen.len() as u64;
    let scene_edges = SceneEdges::new(
        scene,
        &SceneEdgeOptions::with_crease_degrees(settings.crease_degrees),
    );
    let mut segments = edges::segments(&scene_edges, camera, viewport);
    segments.extend_from_slice(shadow_edges);
    draw_edges(&mut image, camera, viewport, &seen, &segments);
    let links = link(&image, &seen, settings.edges);
    let direct = DirectLight::new(scene, tracer, &settings.shading);
    let shaded = Shaded {
        scene,
        tracer,
        camera,
        viewport,
        direct: &direct,
        glossy: settings.shading.glossy,
    };
    let mut choice = Choice::new(&image, &seen, links, settings);
    let mut shadowed = vec![false; seen.len()];
    for round in 0..settings.rounds.max(1) {
        let pixels = choice.next(round, &seen, &mut counts);
        let mut met = Vec::new();
        let triples = (round == 0 && settings.shadow_edges).then_some(&mut met);
        let light = shaded
            .pixels(&pixels, triples, progress, &mut statistics)
            .ok_or(StillError::Interrupted)?;
        choice.take(round, &pixels, &light);
        counts.rounds.push(pixels.len());
        // What the first samples met says which shadows there are.
        let shadows = narrow_shadow_edges(scene, tracer, &scene_edges, met, camera, viewport);
        if round == 0 {
            counts.shadow_edges_dropped = shadows.dropped;
            counts.dropped_contrast = shadows.dropped_contrast;
        }
        let shadows = shadows.segments;
        if shadows.is_empty() {
            continue;
        }
        counts.shadow_segments = shadows.len();
        draw_edges(&mut image, camera, viewport, &seen, &shadows);
        for (index, shadowed) in shadowed.iter_mut().enumerate() {
            let (x, y) = (index as u32 % width, index as u32 / width);
            *shadowed = image.class(x, y) != PixelClass::Empty;
        }
        segments.extend_from_slice(&shadows);
        draw_edges(&mut image, camera, viewport, &seen, &segments);
        choice.relink(&image, &seen, link(&image, &seen, settings.edges));
        let missed = choice.missed(&mut counts);
        let light = shaded
            .pixels(&missed, None, progress, &mut statistics)
            .ok_or(StillError::Interrupted)?;
        choice.take(round, &missed, &light);
        counts.rounds[round as usize] += missed.len();
    }
    choice.finish();
    counts.segments = segments.len();
    let classes = image.class_counts();
    (counts.empty, counts.simple, counts.complex) = (classes.empty, classes.simple, classes.complex);
    let doubtful = doubt(&image, &seen);

    let mut picture = Picture::new(width, height);
    let mut painter = Painter {
        shaded: &shaded,
        image: &image,
        seen: &seen,
        shadowed: &shadowed,
        light: &choice.light,
        complex_samples: settings.complex_samples.max(1),
        progress,
        counts: &mut counts,
        statistics: &mut statistics,
    };
    painter.details(&mut picture).ok_or(StillError::Interrupted)?;
    image.antialias(&mut picture);
    // Last, for blending looks at colours of one side.
    let mut painter = Painter {
        shaded: &shaded,
        image: &image,
        seen: &seen,
        shadowed: &shadowed,
        light: &choice.light,
        complex_samples: settings.complex_samples.max(1),
        progress,
        counts: &mut counts,
        statistics: &mut statistics,
    };
    let complex = painter
        .mixed(&mut picture, &doubtful)
        .ok_or(StillError::Interrupted)?;
    statistics.hits += seen.iter().filter(|seen| seen.is_hit()).count() as u64;

    let film = develop(
        &image,
        &picture,
        &seen,
        &choice,
        &complex,
        viewport,
        &settings.layers,
    );
    Ok(Still {
        film,
        statistics,
        counts,
    })
}

/// Colour of a surface that receives `light`.
pub(crate) fn radiance(albedo: Vec3, emission: Vec3, light: Vec3A, glossy: bool) -> Vec3 {
    let light = Vec3::from(light);
    if glossy {
        emission + light
    } else {
        emission + albedo * light * FRAC_1_PI
    }
}

/// Rasterises the edges that the surfaces do not hide, classifies the pixels and finds what they reach. The image
/// keeps no samples: all light is known at the centres of pixels, which always lie in the primary region.
fn draw_edges(
    image: &mut EdgePointImage,
    camera: &Camera,
    viewport: Viewport,
    seen: &[Seen],
    segments: &[[Vec3; 2]],
) {
    let near = 1e-3; // not looked at
    let mut list = EdgeList::new(viewport.width, viewport.height);
    list.extend_world(&camera.view_projection(viewport, near), segments);
    let mut occlusion = None;
    if matches!(camera.projection, Projection::Perspective(_)) {
        for (index, seen) in seen.iter().enumerate() {
            let (x, y) = (index as u32 % viewport.width, index as u32 / viewport.width);
            let depth = if seen.is_hit() {
                (seen.position.as_dvec3() - camera.position).dot(camera.forward()) as f32
            } else {
                f32::INFINITY
            };
            image.insert(&Point {
                position: glam::Vec2::new(x as f32 + 0.5, y as f32 + 0.5),
                depth,
                colour: Vec3::ZERO,
            });
        }
        occlusion = Some(Occlusion::default());
    }
    image.rasterize(&list, occlusion);
    image.clear_samples();
    image.classify();
    image.reach();
}

/// Which neighbours pass light on to each other: those that reach each other and may lie on one smooth surface. The
/// second condition stands in for edges that no search for silhouettes finds, where two objects run into each other.
fn link(image: &EdgePointImage, seen: &[Seen], edges: bool) -> Links {
    let (width, height) = image.size();
    let at = |x: u32, y: u32| y as usize * width as usize + x as usize;
    Links::new(width as usize, height as usize, |x, y| {
        let reach = image.reach_mask(x, y);
        let mut mask = 0;
        for (i, &(dx, dy, _)) in AROUND.iter().enumerate() {
            let (u, v) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
            let bit = window_bit(dx, dy);
            let joined = || !edges || reach >> bit & 1 != 0 && seen[at(x, y)].is_near(&seen[at(u, v)]);
            if u < width && v < height && joined() {
                mask |= 1 << i;
            }
        }
        mask
    })
}

/// Which pixels have a neighbour that they reach though it lies on another surface: there is an edge between them that was not
/// found, or was hidden by mistake.
fn doubt(image: &EdgePointImage, seen: &[Seen]) -> Vec<bool> {
    let (width, height) = image.size();
    let pixel = |index: usize| {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let reach = image.reach_mask(x, y);
        AROUND.iter().any(|&(dx, dy, _)| {
            let (u, v) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
            let inside = u < width && v < height;
            inside && reach >> window_bit(dx, dy) & 1 != 0 && {
                let there = &seen[(v * width + u) as usize];
                !seen[index].is_near(there)
            }
        })
    };
    (0..seen.len()).into_par_iter().map(pixel).collect()
}

/// Bit of a reach mask: the 5x5 window in scan order, without the centre.
fn window_bit(dx: i32, dy: i32) -> i32 {
    let cell = (dy + 2) * 5 + dx + 2;
    if cell > 12 { cell - 1 } else { cell }
}

/// Puts the picture and its layers together.
fn develop(
    image: &EdgePointImage,
    picture: &Picture,
    seen: &[Seen],
    choice: &Choice,
    complex: &[(u32, u32, u32)],
    viewport: Viewport,
    layers: &[StillLayer],
) -> Film {
    let (width, height) = image.size();
    let pixels = || (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)));
    let mut channels: Vec<(String, Vec<f32>)> = (0..3)
        .map(|i| {
            let values = (0..height).flat_map(|y| picture.row(y)[i].iter().copied());
            (["R", "G", "B"][i].to_owned(), values.collect())
        })
        .collect();
    for &layer in layers {
        for (i, name) in layer.channels().iter().enumerate() {
            let mut values: Vec<f32> = match layer {
                StillLayer::Edges => pixels()
                    .map(|(x, y)| match image.class(x, y) {
                        PixelClass::Empty => 0.0,
                        PixelClass::Simple => 0.5,
                        PixelClass::Complex => 1.0,
                    })
                    .collect(),
                StillLayer::Reach => pixels().map(|(x, y)| image.reach_mask(x, y) as f32).collect(),
                StillLayer::Samples => choice.rounds.iter().map(|&round| f32::from(round)).collect(),
                StillLayer::Irradiance => choice
                    .light
                    .iter()
                    .map(|&light| luminance(light.into()))
                    .collect(),
                StillLayer::Albedo => seen.iter().map(|seen| seen.albedo[i]).collect(),
                StillLayer::Normal => seen.iter().map(|seen| seen.normal[i]).collect(),
                StillLayer::Depth => seen.iter().map(|seen| seen.distance).collect(),
            };
            if layer == StillLayer::Samples {
                for &(x, y, shaded) in complex {
                    let value = &mut values[y as usize * width as usize + x as usize];
                    if *value == 0.0 {
                        *value = -(shaded as f32);
                    }
                }
            }
            channels.push(((*name).to_owned(), values));
        }
    }
    Film { viewport, channels }
}
