//! The same samples, put together in three ways (BWG03 figure 11): with the edge-and-point image, by a filter that knows no edges as in
//! the render cache, and over a constrained Delaunay triangulation of samples and edges. The first and the last get the same
//! edges, those that the camera sees; a fourth row culls them by the depth of the samples instead, as frames do.
//!
//! `cargo run --release -p llsr-epr --example reconstruct -- [SCENE.glb MATERIAL=FLUX | demo:NAME] [WIDTH] [DENSITY] [SUBSAMPLES] [PREFIX]`
//! prints PSNR and FLIP against SUBSAMPLES a pixel, times, and how simple and complex pixels fare, for samples scattered at random
//! and for samples of which half go where interpolation wants them (section 5.3). With PREFIX it writes the pictures, and keeps the
//! reference, which takes longest, for the next time.

mod progress;
mod sampling;
mod show;
mod visible;

use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use cpu_time::ThreadTime;
use glam::{Vec2, Vec3};
use llsr_edges::{SceneEdgeOptions, SceneEdges};
use llsr_epi::{
    EdgeList, EdgePointImage, Occlusion, Picture, PixelClass, ScreenSegment, Settings as EpiSettings,
};
use llsr_epr::{narrow_shadow_edges, view_edges};
use llsr_io::{LoadOptions, load_scene};
use llsr_metrics::{Image, Options, compare, percentile};
use llsr_scene::{Camera, Scene, Triple, Viewport, demo, linear_to_srgb};
use llsr_shading::{Settings, render};
use llsr_testkit::epi::blind::{ScreenSample, edge_blind};
use llsr_testkit::epi::triangulation::Triangulated;
use llsr_tracer::Tracer;

use crate::progress::Progress;
use crate::sampling::{Sampler, Samples, insert};
use crate::show::{draw_edges, draw_error, write};
use crate::visible::visible;

struct View<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer,
    camera: &'a Camera,
    viewport: Viewport,
    progress: Progress,
}

impl View<'_> {
    /// A picture with `spp` shaded points in every pixel.
    fn full(&self, spp: u32) -> Option<Vec<[f32; 3]>> {
        let settings = Settings {
            spp,
            // Light may jump inside a surface.
            share: false,
            ..Settings::default()
        };
        let made = render(
            self.scene,
            self.tracer,
            self.camera,
            self.viewport,
            &settings,
            &|| true,
        )
        .ok()?;
        Some(made.film.pixels().collect())
    }

    /// The same, kept in a file of f32 if there is a prefix for its name.
    fn kept(&self, spp: u32, prefix: Option<&str>) -> Option<Vec<[f32; 3]>> {
        let Some(prefix) = prefix else {
            return self.full(spp);
        };
        let file = format!("{prefix}-{}-{spp}.f32", self.viewport.width);
        if let Ok(bytes) = std::fs::read(&file)
            && bytes.len() == 12 * self.viewport.pixels()
        {
            let (floats, _) = bytes.as_chunks::<4>();
            let (pixels, _) = floats.as_chunks::<3>();
            return Some(pixels.iter().map(|pixel| pixel.map(f32::from_le_bytes)).collect());
        }
        let made = self.full(spp)?;
        let bytes: Vec<u8> = made.as_flattened().iter().flat_map(|c| c.to_le_bytes()).collect();
        if std::fs::write(&file, bytes).is_err() {
            eprintln!("{file} cannot be written");
        }
        Some(made)
    }

    /// All edges of the view and, of `triples`, those of narrow shadows; the number of the former.
    fn edges(&self, triples: Vec<Triple>) -> (Vec<[Vec3; 2]>, usize) {
        let mut segments = view_edges(self.scene, self.camera, self.viewport, CREASE);
        let surfaces = segments.len();
        self.progress.ended("edges of surfaces");
        let edges = SceneEdges::new(self.scene, &SceneEdgeOptions::with_crease_degrees(CREASE));
        let shadows = narrow_shadow_edges(
            self.scene,
            self.tracer,
            &edges,
            triples,
            self.camera,
            self.viewport,
        );
        segments.extend(shadows.segments);
        self.progress.ended("edges of narrow shadows");
        (segments, surfaces)
    }
}

/// Angle (degrees) between two faces from which their common edge counts.
const CREASE: f64 = 30.0;

/// What one way made of the samples.
struct Made {
    what: &'static str,
    colours: Vec<[f32; 3]>,
    time: Duration,
}

/// Root mean square error on the screen, of the pixels that `of` names.
fn error(picture: &[[f32; 3]], truth: &[[f32; 3]], white: f32, of: impl Fn(usize) -> bool) -> f64 {
    let shown = |c: f32| f64::from(linear_to_srgb((c / white).clamp(0.0, 1.0)));
    let (mut sum, mut count) = (0.0, 0.0);
    for i in (0..truth.len()).filter(|&i| of(i)) {
        for channel in 0..3 {
            sum += (shown(picture[i][channel]) - shown(truth[i][channel])).powi(2);
            count += 1.0;
        }
    }
    (sum / count).sqrt()
}

fn pixels(picture: &Picture) -> Vec<[f32; 3]> {
    let (width, height) = picture.size();
    (0..height)
        .flat_map(|y| (0..width).map(move |x| picture.pixel(x, y).to_array()))
        .collect()
}

/// The edge-and-point image of samples and edges, before complex pixels are filtered and simple ones blended, and after.
fn edges_and_points(
    image: &mut EdgePointImage,
    samples: &Samples,
    list: &EdgeList,
    occlusion: Option<Occlusion>,
) -> (Vec<[f32; 3]>, Made, Picture) {
    let (width, height) = image.size();
    let mut picture = Picture::new(width, height);
    image.clear_samples();
    let start = ThreadTime::now();
    insert(image, samples);
    image.rasterize(list, occlusion);
    image.classify();
    image.reach();
    image.interpolate(&mut picture);
    image.fill(&mut picture, 4);
    image.fill_blindly(&mut picture);
    let interpolated = pixels(&picture);
    image.filter_complex(&mut picture, |_, _| Vec3::ONE);
    image.antialias(&mut picture);
    let made = Made {
        what: "edge-and-point image",
        time: start.elapsed(),
        colours: pixels(&picture),
    };
    (interpolated, made, picture)
}

/// All ways to put `samples` together, compared with `truth`.
fn report(
    view: &View<'_>,
    samples: &Samples,
    segments: &[[Vec3; 2]],
    [truth, sixteen]: [&[[f32; 3]]; 2],
    prefix: Option<&str>,
) -> Option<()> {
    let (w, h) = (view.viewport.width as usize, view.viewport.height as usize);
    let (width, height) = (view.viewport.width, view.viewport.height);
    let reference = Image::new(w, h, truth).ok()?;
    let white = percentile(reference, 98.0);
    let pieces = visible(view, segments);
    view.progress.ended("visible parts of edges");
    let mut image = EdgePointImage::new(width, height, EpiSettings::default()).ok()?;

    let mut all = EdgeList::new(width, height);
    all.extend_world(&view.camera.view_projection(view.viewport, NEAR), segments);
    let (_, mut culled, _) = edges_and_points(&mut image, samples, &all, Some(Occlusion::default()));
    culled.what = "its edges culled by samples";
    let mut list = EdgeList::new(width, height);
    list.extend(&pieces.iter().map(|&[a, b]| in_front(a, b)).collect::<Vec<_>>());
    let (interpolated, made, _) = edges_and_points(&mut image, samples, &list, None);

    view.progress.ended("edge-and-point images");
    let plain: Vec<ScreenSample> = samples.iter().map(|(sample, _)| *sample).collect();
    let start = ThreadTime::now();
    let blind = Made {
        what: "without edges",
        colours: edge_blind(w, h, &plain, [18.0, 6.0, 1.0]),
        time: start.elapsed(),
    };
    view.progress.ended("without edges");
    let start = ThreadTime::now();
    let mesh = Triangulated::new(&plain, &pieces);
    let colours = mesh.picture(w, h);
    let triangulated = Made {
        what: "constrained Delaunay triangulation",
        colours: colours.into_iter().map(Option::unwrap_or_default).collect(),
        time: start.elapsed(),
    };
    view.progress.ended("triangulation");
    let full = Made {
        what: "16 subsamples in every pixel",
        colours: sixteen.to_vec(),
        time: Duration::ZERO,
    };
    println!("{:<34}{:>8} {:>7} {:>9}", "", "PSNR dB", "FLIP", "CPU ms");
    for made in [&made, &culled, &blind, &triangulated, &full] {
        let result = Image::new(w, h, &made.colours)
            .and_then(|image| compare(image, reference, &Options::default()))
            .ok()?;
        let time = 1e3 * made.time.as_secs_f64();
        println!(
            "{:<34}{:8.2} {:7.4} {time:9.1}",
            made.what, result.psnr, result.flip
        );
        if let Some(prefix) = prefix {
            let name = format!("{prefix}-{}", made.what.replace(' ', "-"));
            let colours: Vec<Vec3> = made.colours.iter().map(|&c| Vec3::from(c)).collect();
            write(&colours, w, -f64::from(white).log2(), &format!("{name}.png"));
            draw_error(&made.colours, truth, w, white, &format!("{name}-error.png"));
        }
    }
    if let Some(prefix) = prefix {
        draw_edges(&image, prefix);
    }
    println!(
        "{:?}; {} triangles of {} pieces of edges, {} of which were refused",
        image.class_counts(),
        mesh.triangles(),
        pieces.len(),
        mesh.refused()
    );
    for (what, wanted) in [
        ("empty", PixelClass::Empty),
        ("simple", PixelClass::Simple),
        ("complex", PixelClass::Complex),
    ] {
        let of = |made: &[[f32; 3]]| {
            let class = |i: usize| image.class(i as u32 % width, i as u32 / width);
            -20.0 * error(made, truth, white, |i| class(i) == wanted).log10()
        };
        println!(
            "  {what:<8} pixels: {:.2} dB, before filter and blending {:.2}, without edges {:.2}, triangulated {:.2}, 16 subsamples {:.2}",
            of(&made.colours),
            of(&interpolated),
            of(&blind.colours),
            of(&triangulated.colours),
            of(sixteen)
        );
    }
    Some(())
}

/// An edge that nothing hides.
fn in_front(a: Vec2, b: Vec2) -> ScreenSegment {
    ScreenSegment {
        a,
        b,
        depth_a: 0.0,
        depth_b: 0.0,
    }
}

/// Depth (m) before which nothing is looked at.
const NEAR: f32 = 1e-3;

fn run(
    name: &str,
    scene: &Scene,
    (width, density, subsamples): (u32, f32, u32),
    prefix: Option<&str>,
) -> Option<()> {
    let viewport = Viewport { width, height: width };
    let (tracer, _) = Tracer::new(scene);
    let view = View {
        scene,
        tracer: &tracer,
        camera: scene.cameras.first()?,
        viewport,
        progress: Progress::start(),
    };
    let truth = view.kept(subsamples, prefix)?;
    let sixteen = view.kept(16, prefix)?;
    view.progress.ended("reference and 16 subsamples");
    let settings = Settings::default();
    let mut sampler = Sampler::new(&view, &settings);

    let mut triples = Vec::new();
    let scattered = sampler.scattered(density);
    let samples = sampler.shade(&scattered, &mut triples);
    view.progress.ended("samples");
    let (segments, surfaces) = view.edges(triples);
    println!(
        "{name} at {width}x{width}: {} samples, {surfaces} edges of surfaces, {} of shadows",
        samples.len(),
        segments.len() - surfaces
    );
    report(&view, &samples, &segments, [&truth, &sixteen], prefix)?;

    // The same number, half of them in three rounds of feedback.
    let mut triples = Vec::new();
    let first = sampler.scattered(0.5 * density);
    let mut samples = sampler.shade(&first, &mut triples);
    let rounds = 3;
    for round in 0..rounds {
        let (segments, _) = view.edges(triples.clone());
        let pieces: Vec<ScreenSegment> = visible(&view, &segments)
            .iter()
            .map(|&[a, b]| in_front(a, b))
            .collect();
        let mut list = EdgeList::new(width, width);
        list.extend(&pieces);
        let mut image = EdgePointImage::new(width, width, EpiSettings::default()).ok()?;
        let (_, _, picture) = edges_and_points(&mut image, &samples, &list, None);
        let count = (scattered.len() - samples.len()) / (rounds - round);
        let pixels = sampler.wanted(&picture, count, 0.618 * round as f64 % 1.0);
        samples.extend(sampler.shade(&pixels, &mut triples));
    }
    let (segments, _) = view.edges(triples);
    println!("half of {} samples placed by feedback:", samples.len());
    let prefix = prefix.map(|prefix| format!("{prefix}-feedback"));
    report(&view, &samples, &segments, [&truth, &sixteen], prefix.as_deref())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut arguments = arguments.iter().map(String::as_str);
    let name = arguments.next().unwrap_or("demo:subway");
    let scene = match name.strip_prefix("demo:") {
        Some(demo) => demo::build(demo),
        None => {
            let tube = arguments.next().and_then(|tube| tube.parse().ok());
            let options = LoadOptions {
                tubes: tube.into_iter().collect(),
                ..LoadOptions::default()
            };
            load_scene(Path::new(name), &options)
                .map(|loaded| loaded.scene)
                .ok()
        }
    };
    let mut number = |otherwise: f64| {
        let given = arguments.next().and_then(|text| text.parse().ok());
        given.unwrap_or(otherwise)
    };
    let numbers = (number(512.0) as u32, number(0.2) as f32, number(64.0) as u32);
    let done = scene.and_then(|scene| run(name, &scene, numbers, arguments.next()));
    if done.is_none() {
        eprintln!("{name}: no scene with a camera, or no picture of this size");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
