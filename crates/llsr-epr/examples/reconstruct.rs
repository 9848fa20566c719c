//! The same samples, put together in three ways (BWG03 figure 11): with the edge-and-point image, by a filter that knows no edges as in
//! the render cache, and over a constrained Delaunay triangulation of samples and visible edges.
//!
//! `cargo run --release -p llsr-epr --example reconstruct -- [SCENE.glb MATERIAL=FLUX | demo:NAME] [WIDTH] [DENSITY] [SUBSAMPLES] [PREFIX]`
//! prints PSNR and FLIP against SUBSAMPLES a pixel, times, and how simple and complex pixels fare; with PREFIX it writes the pictures.

use std::path::Path;
use std::process::ExitCode;

use cpu_time::ThreadTime;
use glam::{DVec3, Vec2, Vec3};
use llsr_edges::{SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView};
use llsr_epi::{EdgeList, EdgePointImage, Occlusion, Picture, PixelClass, Point, Settings as EpiSettings};
use llsr_epr::narrow_shadow_edges;
use llsr_io::{Development, LoadOptions, Tone, load_scene, write_png};
use llsr_metrics::{Image, Options, compare, percentile, srgb_encode};
use llsr_scene::{Camera, Scene, Triple, Viewport, demo};
use llsr_shading::{DirectLight, Pixel, Scratch, Settings, Statistics, SurfacePoint, render};
use llsr_testkit::epi::blind::{ScreenSample, edge_blind};
use llsr_testkit::epi::triangulation::Triangulated;
use llsr_testkit::epi::windows::Stream;
use llsr_tracer::Tracer;

struct View<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer,
    camera: &'a Camera,
    viewport: Viewport,
}

/// Samples in a share `density` of the pixels, and the triples of light, blocker and receiver that they met.
fn samples(view: &View<'_>, density: f32) -> (Vec<(ScreenSample, f32)>, Vec<Triple>) {
    let View {
        scene,
        tracer,
        camera,
        viewport,
    } = *view;
    let settings = Settings::default();
    let direct = DirectLight::new(scene, tracer, &settings);
    let mut stream = Stream::new(11);
    let (mut samples, mut triples) = (Vec::new(), Vec::new());
    let (mut states, mut scratch, mut statistics) = (Vec::new(), Scratch::default(), Statistics::default());
    let mut blockers = Vec::new();
    for y in 0..viewport.height {
        for x in 0..viewport.width {
            let position = [x as f32 + stream.unit(), y as f32 + stream.unit()];
            if stream.unit() >= density {
                continue;
            }
            let (origin, direction) = camera.ray(viewport, f64::from(position[0]), f64::from(position[1]));
            let Some(hit) = tracer.closest(origin, direction, f64::INFINITY) else {
                let colour = [0.0; 3];
                samples.push((ScreenSample { position, colour }, f32::INFINITY));
                continue;
            };
            let point = SurfacePoint::new(scene, &hit, direction);
            let at = Pixel {
                x,
                y,
                index: u64::from(y * viewport.width + x),
                subsample: 0,
            };
            let mut light = DVec3::ZERO;
            direct.shade_point_and_blockers(
                &point,
                at,
                &mut states,
                &mut scratch,
                &mut statistics,
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
    }
    triples.sort_unstable();
    triples.dedup();
    (samples, triples)
}

/// The visible pieces of edges on the screen: each edge in pieces of at most four pixels, of which rays say whether they are seen.
fn visible(view: &View<'_>, segments: &[[Vec3; 2]]) -> Vec<[Vec2; 2]> {
    let View {
        tracer,
        camera,
        viewport,
        ..
    } = *view;
    let mut out = Vec::new();
    let on_screen = |p: DVec3| {
        camera
            .project(viewport, p)
            .map(|(x, y, _)| Vec2::new(x as f32, y as f32))
    };
    let (width, height) = (viewport.width as f32, viewport.height as f32);
    let inside = |p: Vec2| p.x > -4.0 && p.y > -4.0 && p.x < width + 4.0 && p.y < height + 4.0;
    for &[a, b] in segments {
        let (a, b) = (a.as_dvec3(), b.as_dvec3());
        let (Some(p), Some(q)) = (on_screen(a), on_screen(b)) else {
            continue;
        };
        let pieces = (p.distance(q).min(1e4) / 4.0).ceil().max(1.0) as usize;
        for i in 0..pieces {
            let at = |i: f64| a + (b - a) * (i / pieces as f64);
            let (from, to, middle) = (at(i as f64), at(i as f64 + 1.0), at(i as f64 + 0.5));
            let (Some(p), Some(q)) = (on_screen(from), on_screen(to)) else {
                continue;
            };
            let direction = (middle - camera.position).normalize();
            let distance = middle.distance(camera.position);
            if inside(p)
                && inside(q)
                && tracer
                    .closest(camera.position, direction, 0.995 * distance)
                    .is_none()
            {
                out.push([p, q]);
            }
        }
    }
    out
}

/// Root mean square error on the screen, of the pixels that `of` names.
fn error(picture: &[[f32; 3]], truth: &[[f32; 3]], white: f32, of: impl Fn(usize) -> bool) -> f64 {
    let shown = |c: f32| f64::from(srgb_encode((c / white).clamp(0.0, 1.0)));
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
    let (width, density, subsamples) = (number(512.0) as u32, number(0.2) as f32, number(64.0) as u32);
    let prefix = arguments.next();
    let Some(scene) = scene.filter(|scene| !scene.cameras.is_empty()) else {
        eprintln!("{name}: no scene with a camera");
        return ExitCode::FAILURE;
    };
    let viewport = Viewport { width, height: width };
    let (tracer, _) = Tracer::new(&scene);
    let view = View {
        scene: &scene,
        tracer: &tracer,
        camera: &scene.cameras[0],
        viewport,
    };
    let full = |spp: u32| -> Option<Vec<[f32; 3]>> {
        let settings = Settings {
            spp,
            ..Settings::default()
        };
        let made = render(&scene, &tracer, view.camera, viewport, &settings, &|| true).ok()?;
        Some(made.film.pixels().collect())
    };
    let (Some(truth), Some(sixteen)) = (full(subsamples), full(16)) else {
        return ExitCode::FAILURE;
    };

    let (samples, triples) = samples(&view, density);
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::with_crease_degrees(30.0));
    let mut found = SceneFound::default();
    let picture_of = SceneView::Picture {
        camera: view.camera,
        viewport,
    };
    edges.find(picture_of, None, &mut SceneScratch::default(), &mut found);
    let mut segments = found.segments().to_vec();
    let seen = segments.len();
    segments.extend(narrow_shadow_edges(&scene, &tracer, &edges, triples, view.camera, viewport).segments);
    println!(
        "{name} at {width}x{width}: {} samples, {seen} edges of surfaces, {} of shadows",
        samples.len(),
        segments.len() - seen
    );

    let Ok(mut image) = EdgePointImage::new(width, width, EpiSettings::default()) else {
        return ExitCode::FAILURE;
    };
    let start = ThreadTime::now();
    for (sample, depth) in &samples {
        image.insert(&Point {
            position: Vec2::from(sample.position),
            depth: *depth,
            colour: Vec3::from(sample.colour),
            tag: 0,
        });
    }
    let mut list = EdgeList::new(width, width);
    list.extend_world(&view.camera.view_projection(viewport, 1e-3), &segments);
    image.rasterize(&list, Some(Occlusion::default()));
    let mut picture = Picture::new(width, width);
    image.classify();
    image.reach();
    image.interpolate(&mut picture);
    image.fill(&mut picture, 4);
    let interpolated = pixels(&picture);
    image.filter_complex(&mut picture, |_, _| Vec3::ONE);
    image.antialias(&mut picture);
    let epi_time = start.elapsed();
    let epi = pixels(&picture);

    let plain: Vec<ScreenSample> = samples.iter().map(|(sample, _)| *sample).collect();
    let start = ThreadTime::now();
    let blind = edge_blind(width as usize, width as usize, &plain, [18.0, 6.0, 1.0]);
    let blind_time = start.elapsed();
    let pieces = visible(&view, &segments);
    let start = ThreadTime::now();
    let mesh = Triangulated::new(&plain, &pieces);
    let triangulated = mesh.picture(width as usize, width as usize);
    let mesh_time = start.elapsed();
    let triangulated: Vec<[f32; 3]> = triangulated.into_iter().map(Option::unwrap_or_default).collect();

    let (w, h) = (width as usize, width as usize);
    let Ok(reference) = Image::new(w, h, &truth) else {
        return ExitCode::FAILURE;
    };
    println!("{:<34}{:>8} {:>7} {:>9}", "", "PSNR dB", "FLIP", "CPU ms");
    for (what, made, time) in [
        ("edge-and-point image", &epi, Some(epi_time)),
        ("without edges", &blind, Some(blind_time)),
        (
            "constrained Delaunay triangulation",
            &triangulated,
            Some(mesh_time),
        ),
        ("16 subsamples in every pixel", &sixteen, None),
    ] {
        let result = Image::new(w, h, made).and_then(|image| compare(image, reference, &Options::default()));
        let Ok(result) = result else {
            return ExitCode::FAILURE;
        };
        let time = time.map_or(String::new(), |time| format!("{:9.1}", time.as_secs_f64() * 1e3));
        println!("{what:<34}{:8.2} {:7.4} {time}", result.psnr, result.flip);
        if let Some(prefix) = prefix {
            let colours: Vec<Vec3> = made.iter().map(|&c| Vec3::from(c)).collect();
            let file = format!("{prefix}-{}.png", what.replace(' ', "-"));
            let development = Development {
                exposure: -f64::from(percentile(reference, 98.0)).log2(),
                tone: Tone::Srgb,
            };
            let picture = llsr_io::Image::from_rgb(w, h, &colours);
            if write_png(Path::new(&file), &picture, development).is_err() {
                eprintln!("{file} cannot be written");
            }
        }
    }
    let white = percentile(reference, 98.0);
    let class = |i: usize| image.class(i as u32 % width, i as u32 / width);
    let counts = image.class_counts();
    println!(
        "{counts:?}; {} triangles of {} pieces of edges",
        mesh.triangles(),
        pieces.len()
    );
    let decibel = |error: f64| -20.0 * error.log10();
    for (what, wanted) in [
        ("empty", PixelClass::Empty),
        ("simple", PixelClass::Simple),
        ("complex", PixelClass::Complex),
    ] {
        let of = |made: &[[f32; 3]]| decibel(error(made, &truth, white, |i| class(i) == wanted));
        println!(
            "  {what:<8} pixels: {:.2} dB, before filter and blending {:.2}, without edges {:.2}, triangulated {:.2}, 16 subsamples {:.2}",
            of(&epi),
            of(&interpolated),
            of(&blind),
            of(&triangulated),
            of(&sixteen)
        );
    }
    ExitCode::SUCCESS
}
