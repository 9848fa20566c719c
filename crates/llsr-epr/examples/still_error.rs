//! Error and cost of a still picture from few samples against many subsamples in every pixel, without rendering the latter: a random
//! set of pixels is shaded in full.
//!
//! `cargo run --release -p llsr-epr --example still_error -- [SCENE.glb MATERIAL=FLUX | demo:NAME] [WIDTH] [DENSITY] [ROUNDS] [PIXELS] [SUBSAMPLES]`
//! prints PSNR with the interval in which it lies with 95% probability, where the error sits, and CPU times.

use std::path::Path;
use std::process::ExitCode;

use cpu_time::ThreadTime;
use glam::{DVec3, Vec3};
use llsr_epr::{StillLayer, StillSettings, render_still};
use llsr_io::{LoadOptions, load_scene};
use llsr_metrics::{Image, percentile};
use llsr_scene::{Camera, Scene, Viewport, demo, linear_to_srgb};
use llsr_shading::{DirectLight, Pixel, Scratch, Settings, Statistics, SurfacePoint};
use llsr_tracer::Tracer;

/// The seed of the choice of pixels.
const SEED: u64 = 20_030_727;

struct Truth<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer,
    camera: &'a Camera,
    viewport: Viewport,
    direct: DirectLight<'a>,
}

impl Truth<'_> {
    /// Radiance at subsample `index` of `count` of a pixel.
    fn radiance(&self, x: u32, y: u32, index: u32, count: u32, scratch: &mut Scratch) -> Vec3 {
        let u = (f64::from(index) + 0.5) / f64::from(count);
        let v = f64::from(index.reverse_bits()) / (1u64 << 32) as f64 + 0.5 / f64::from(count);
        let place = (f64::from(x) + u, f64::from(y) + v.fract());
        let (origin, direction) = self.camera.ray(self.viewport, place.0, place.1);
        let Some(hit) = self.tracer.closest(origin, direction, f64::INFINITY) else {
            return Vec3::ZERO;
        };
        let point = SurfacePoint::new(self.scene, &hit, direction);
        let at = Pixel {
            x,
            y,
            index: u64::from(y) * u64::from(self.viewport.width) + u64::from(x),
            subsample: index,
        };
        let mut light = DVec3::ZERO;
        let (mut states, mut statistics) = (Vec::new(), Statistics::default());
        self.direct
            .shade_point(&point, at, &mut states, scratch, &mut statistics, |id, answer| {
                light += self.scene.lights[id.index()].color().as_dvec3() * answer.irradiance;
            });
        point.emission + point.albedo * light.as_vec3() * std::f32::consts::FRAC_1_PI
    }
}

/// Sum of squares, of their squares, and their number.
#[derive(Clone, Copy, Default)]
struct Squares(f64, f64, f64);

impl Squares {
    fn add(&mut self, square: f64) {
        self.0 += square;
        self.1 += square * square;
        self.2 += 1.0;
    }

    fn psnr(&self) -> String {
        let mean = self.0 / self.2;
        let deviation = ((self.1 / self.2 - mean * mean).max(0.0) / self.2).sqrt();
        let decibel = |mean: f64| -10.0 * mean.log10();
        format!(
            "{:5.2} dB ({:.2} to {:.2})",
            decibel(mean),
            decibel(mean + 1.96 * deviation),
            decibel((mean - 1.96 * deviation).max(1e-12))
        )
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut arguments = arguments.iter().map(String::as_str).peekable();
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
        arguments
            .next()
            .and_then(|text| text.parse().ok())
            .unwrap_or(otherwise)
    };
    let (width, density, rounds) = (number(512.0) as u32, number(0.05), number(3.0) as u32);
    let (pixels, subsamples) = (number(1000.0) as usize, number(256.0) as u32);
    let Some(scene) = scene.filter(|scene| !scene.cameras.is_empty()) else {
        eprintln!("{name}: no scene with a camera");
        return ExitCode::FAILURE;
    };
    let viewport = Viewport { width, height: width };
    let (tracer, _) = Tracer::new(&scene);
    let camera = &scene.cameras[0];
    let settings = StillSettings {
        density,
        rounds,
        layers: vec![StillLayer::Edges, StillLayer::Samples],
        ..StillSettings::default()
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let Ok(pool) = pool else { return ExitCode::FAILURE };
    let still = pool.install(|| {
        let start = ThreadTime::now();
        let made = render_still(&scene, &tracer, camera, viewport, &settings, &[], &|| true);
        (made, start.elapsed().as_secs_f64())
    });
    let (Ok(still), seconds) = still else {
        return ExitCode::FAILURE;
    };
    println!("{name} at {width}x{width}: {:?}", still.counts);
    let picture: Vec<[f32; 3]> = still.film.pixels().collect();
    let (Some(edges), Some(samples)) = (still.film.channel("edges.Y"), still.film.channel("samples.Y"))
    else {
        return ExitCode::FAILURE;
    };
    let Ok(image) = Image::new(width as usize, width as usize, &picture) else {
        return ExitCode::FAILURE;
    };
    let white = percentile(image, 98.0);
    let shading = Settings::default();
    let truth = Truth {
        scene: &scene,
        tracer: &tracer,
        camera,
        viewport,
        direct: DirectLight::new(&scene, &tracer, &shading),
    };
    let shown = |colour: Vec3| {
        colour
            .to_array()
            .map(|c| f64::from(linear_to_srgb((c / white).clamp(0.0, 1.0))))
    };
    let classes = ["all", "shaded", "no edge", "one edge", "complex"];
    let mut found = [Squares::default(); 5];
    let mut sixteen = [Squares::default(); 5];
    let mut scratch = Scratch::default();
    let mut state = SEED;
    let mut worst = Vec::new();
    let start = ThreadTime::now();
    for _ in 0..pixels {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let index = ((state >> 33) % (u64::from(width) * u64::from(width))) as usize;
        let (x, y) = (index as u32 % width, index as u32 / width);
        let mean = |count: u32, scratch: &mut Scratch| {
            let sum: Vec3 = (0..count).map(|i| truth.radiance(x, y, i, count, scratch)).sum();
            shown(sum / count as f32)
        };
        let expected = mean(subsamples, &mut scratch);
        let usual = mean(16, &mut scratch);
        let square = |a: [f64; 3]| (0..3).map(|i| (a[i] - expected[i]).powi(2)).sum::<f64>() / 3.0;
        let class = match (edges[index], samples[index]) {
            (1.0, _) => 4,
            (0.5, _) => 3,
            (_, shaded) if shaded > 0.0 => 1,
            _ => 2,
        };
        let here = square(shown(picture[index].into()));
        worst.push((here, x, y, class));
        for class in [0, class] {
            found[class].add(here);
            sixteen[class].add(square(usual));
        }
    }
    let point = start.elapsed().as_secs_f64() / (pixels as f64 * f64::from(subsamples + 16));
    println!("PSNR against {subsamples} subsamples in {pixels} random pixels, and of 16 subsamples:");
    for (i, class) in classes.iter().enumerate().filter(|&(i, _)| found[i].2 > 0.0) {
        println!(
            "  {class:<9} {:5.1}% of the pixels, {:5.1}% of the square error: {}; 16 subsamples {}",
            100.0 * found[i].2 / found[0].2,
            100.0 * found[i].0 / found[0].0,
            found[i].psnr(),
            sixteen[i].psnr()
        );
    }
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    let worst: Vec<String> = worst
        .iter()
        .take(8)
        .map(|&(square, x, y, class)| format!("({x},{y}) {} {:.3}", classes[class], square.sqrt()))
        .collect();
    println!("  worst: {}", worst.join(", "));
    let full = point * 16.0 * f64::from(width) * f64::from(width);
    println!(
        "CPU: {seconds:.2} s; 16 subsamples in all pixels, at {:.1} us a subsample: {full:.1} s; {:.1} times as much",
        point * 1e6,
        full / seconds
    );
    ExitCode::SUCCESS
}
