//! `llsr bench`: error against run time, for every method.

use std::fmt::Write as _;

use llsr_metrics::{Options, compare};
use llsr_scene::{Scene, Viewport};
use llsr_shading::{Film, Layer, Method, Rendered, Settings, render};
use llsr_tracer::Tracer;

use crate::args::{BenchArgs, Common};
use crate::camera;
use crate::clock::Stopwatch;
use crate::failure::Failure;
use crate::load::{load, need_light};
use crate::plot;
use crate::progress::{Progress, interrupted};

/// One method with one parameter, measured.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) method: Method,
    /// Epsilon of a search, or the number of samples of a light.
    pub(crate) parameter: f64,
    /// Rendering alone, on one thread or many: of one run if it is long, else the median of three.
    pub(crate) cpu_seconds: f64,
    pub(crate) rays: u64,
    pub(crate) tests_per_pixel: f64,
    /// Root mean square error of the irradiance, relative to its mean.
    pub(crate) rel_rmse: f64,
    /// The same over pixels in penumbra.
    pub(crate) rel_rmse_penumbra: f64,
    /// The error that 0.1% of the pixels exceed, relative to the mean.
    pub(crate) error_999: f64,
    pub(crate) flip: f64,
}

/// A run that takes this long is not disturbed by small things and is not repeated (CPU seconds).
const LONG: f64 = 0.7;

/// Widest gap that the searches may overlook, for each epsilon: both shrink together.
fn nu_for(epsilon: f64) -> f64 {
    (5.0 * epsilon).clamp(0.01, 0.25)
}

/// The parameters that a method is run with.
fn sweep(method: Method) -> &'static [f64] {
    match method {
        // Exact: the tolerances matter only where a fan's budget is spent.
        Method::Auto | Method::Exact => &[0.05],
        Method::Stratified => &[2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0],
        Method::Gauss | Method::Uniform => &[4.0, 16.0, 64.0, 256.0],
        // Choosing the points costs the square of their number.
        Method::Hpd => &[4.0, 16.0, 64.0],
        _ => &[0.25, 0.05, 0.01, 0.003, 0.001],
    }
}

fn settings(method: Method, parameter: f64, seed: u64) -> Settings {
    let layers = vec![Layer::Irradiance];
    let base = Settings {
        method,
        seed,
        layers,
        ..Settings::default()
    };
    if parameter >= 1.0 {
        Settings {
            samples: parameter as u32,
            ..base
        }
    } else {
        Settings {
            epsilon: parameter,
            nu: nu_for(parameter),
            ..base
        }
    }
}

pub(crate) fn run(args: &BenchArgs, common: &Common) -> Result<(), Failure> {
    let loaded = load(&args.scene)?;
    need_light(&loaded, &args.scene.scene)?;
    let scene = &loaded.scene;
    let (tracer, _) = Tracer::new(scene);
    let (width, height) = args.scene.size;
    let viewport = Viewport { width, height };
    let (camera, _) = camera::choose(&args.scene, scene, &tracer, viewport)?;
    let picture = |settings: &Settings| -> Result<Rendered, Failure> {
        render(scene, &tracer, &camera, viewport, settings, &|| !interrupted())
            .map_err(|_| Failure::Interrupted)
    };
    let truth_settings = Settings {
        method: Method::Exact,
        seed: common.seed,
        layers: vec![Layer::Irradiance, Layer::Discontinuities],
        ..Settings::default()
    };
    let truth = picture(&truth_settings)?.film;

    let methods: Vec<Method> = if args.methods.is_empty() {
        Method::ALL.to_vec()
    } else {
        args.methods.clone()
    };
    let steps: u64 = methods.iter().map(|&m| sweep(m).len() as u64).sum();
    let progress = Progress::new("measuring", steps, common.quiet);
    let mut rows = Vec::new();
    for &method in &methods {
        for &parameter in sweep(method) {
            let settings = settings(method, parameter, common.seed);
            let run = || -> Result<(Rendered, f64), Failure> {
                let watch = Stopwatch::start();
                let rendered = picture(&settings)?;
                Ok((rendered, watch.read().cpu))
            };
            // The first run warms caches up; the median of three is robust against one disturbance.
            let (rendered, mut seconds) = run()?;
            if seconds < LONG {
                let mut again = [run()?.1, run()?.1, run()?.1];
                again.sort_unstable_by(f64::total_cmp);
                seconds = again[1];
            }
            rows.push(measure(method, parameter, seconds, &rendered, &truth)?);
            progress.step();
        }
    }
    progress.finish();
    if let Some(path) = &common.report {
        llsr_io::write_file(path, csv(&rows).as_bytes())?;
    }
    if let Some(path) = &args.output {
        let title = format!("{}, {width}x{height}", args.scene.scene);
        llsr_io::write_file(path, plot::error_against_time(&title, &rows)?.as_bytes())?;
    }
    if !common.quiet {
        print(&rows, scene, args, width, height);
    }
    Ok(())
}

fn channel<'a>(film: &'a Film, name: &str) -> &'a [f32] {
    film.channel(name).unwrap_or_default()
}

fn measure(
    method: Method,
    parameter: f64,
    cpu_seconds: f64,
    rendered: &Rendered,
    truth: &Film,
) -> Result<Row, Failure> {
    let (test, exact) = (
        channel(&rendered.film, "irradiance.Y"),
        channel(truth, "irradiance.Y"),
    );
    let changes = channel(truth, "discontinuities.Y");
    let mean = exact.iter().map(|&v| f64::from(v)).sum::<f64>() / exact.len() as f64;
    let mut errors: Vec<f64> = Vec::with_capacity(exact.len());
    let (mut all, mut penumbra, mut penumbra_sum, mut penumbra_count) = (0.0, 0.0, 0.0, 0u64);
    for ((&a, &b), &changes) in test.iter().zip(exact).zip(changes) {
        let error = f64::from(a) - f64::from(b);
        errors.push(error.abs());
        all += error * error;
        if changes > 0.0 {
            penumbra += error * error;
            penumbra_sum += f64::from(b);
            penumbra_count += 1;
        }
    }
    let place = (errors.len() - 1) * 999 / 1000;
    let (_, &mut error_999, _) = errors.select_nth_unstable_by(place, f64::total_cmp);
    let count = penumbra_count.max(1) as f64;
    let rel_rmse_penumbra = if penumbra_sum > 0.0 {
        (penumbra / count).sqrt() / (penumbra_sum / count)
    } else {
        0.0
    };
    let pixels = |film: &Film| film.pixels().collect::<Vec<_>>();
    let (a, b) = (pixels(&rendered.film), pixels(truth));
    let (w, h) = (truth.viewport.width as usize, truth.viewport.height as usize);
    let failed = |error: llsr_metrics::Error| Failure::Work(format!("comparing pictures: {error}"));
    let (a, b) = (
        llsr_metrics::Image::new(w, h, &a),
        llsr_metrics::Image::new(w, h, &b),
    );
    let comparison = compare(a.map_err(failed)?, b.map_err(failed)?, &Options::default()).map_err(failed)?;
    let statistics = &rendered.statistics;
    Ok(Row {
        method,
        parameter,
        cpu_seconds,
        rays: statistics.primary_rays + statistics.visibility_tests,
        tests_per_pixel: statistics.visibility_tests as f64 / statistics.hits.max(1) as f64,
        rel_rmse: (all / exact.len() as f64).sqrt() / mean,
        rel_rmse_penumbra,
        error_999: error_999 / mean,
        flip: comparison.flip,
    })
}

fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "method,parameter,cpu_seconds,rays,tests_per_pixel,rel_rmse,rel_rmse_penumbra,error_99.9%,flip\n",
    );
    for r in rows {
        let _ = writeln!(
            text,
            "{},{},{:.5},{},{:.4},{:.4e},{:.4e},{:.4e},{:.5}",
            r.method,
            r.parameter,
            r.cpu_seconds,
            r.rays,
            r.tests_per_pixel,
            r.rel_rmse,
            r.rel_rmse_penumbra,
            r.error_999,
            r.flip
        );
    }
    text
}

fn print(rows: &[Row], scene: &Scene, args: &BenchArgs, width: u32, height: u32) {
    println!(
        "{}, {width}x{height}, {} lights",
        args.scene.scene,
        scene.lights.len()
    );
    println!(
        "{:<20} {:>10} {:>8} {:>10} {:>10} {:>10} {:>10} {:>8}",
        "method", "parameter", "CPU s", "tests/px", "rel_rmse", "penumbra", "99.9%", "flip"
    );
    for r in rows {
        println!(
            "{:<20} {:>10} {:>8.3} {:>10.2} {:>10.2e} {:>10.2e} {:>10.2e} {:>8.4}",
            r.method,
            r.parameter,
            r.cpu_seconds,
            r.tests_per_pixel,
            r.rel_rmse,
            r.rel_rmse_penumbra,
            r.error_999,
            r.flip
        );
    }
}
