//! Figures 2 and 4 to 7 and tables 1 and 2 of Ouellette & Fiume 1999.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use glam::Vec3;
use llsr_io::{Development, Image, Tone, exposure_for, write_png};
use llsr_rsb::{Method as Bisection, expected_estimate};
use llsr_scene::{Scene, Viewport, demo};
use llsr_shading::{Film, Layer, Method, Rendered, Settings, Statistics, render};
use llsr_tracer::Tracer;

use crate::golden::picture;
use crate::run::root;

const SIZE: u32 = 360;

pub(crate) fn run() -> Result<(), String> {
    let folder = root().join("docs/papers/of99");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    super::curves::draw(&folder.join("fig4.svg"))?;
    let mut text = String::from(
        "# Tables of Ouellette & Fiume 1999, made anew\n\n\
         Written by `cargo xtask figures of99`, with the figures beside this file.\n\n",
    );
    table1(&mut text);
    figure5(&folder, &mut text)?;
    figure6(&folder, &mut text)?;
    figures2and7(&folder, &mut text)?;
    let path = folder.join("README.md");
    fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
}

/// Table 1 from the closed form: the quadratic through three points of each piece.
fn table1(text: &mut String) {
    text.push_str("## Table 1: expected estimate of random seed bisection\n\n");
    text.push_str("| n | range of lambda | constant | linear | quadratic |\n|---|---|---|---|---|\n");
    for n in 1..=4u32 {
        let pieces = 1u32 << (n - 1);
        for piece in 0..pieces {
            let (lo, hi) = (
                f64::from(piece) / f64::from(pieces),
                f64::from(piece + 1) / f64::from(pieces),
            );
            let mid = 0.5 * (lo + hi);
            let value = |lambda| expected_estimate(Bisection::RandomSeed, n, lambda);
            let (y0, y1, y2) = (value(lo), value(mid), value(hi));
            let h = mid - lo;
            let quadratic = (y0 - 2.0 * y1 + y2) / (2.0 * h * h);
            let linear = (y2 - y0) / (2.0 * h) - 2.0 * quadratic * mid;
            let constant = y1 - linear * mid - quadratic * mid * mid;
            let _ = writeln!(
                text,
                "| {n} | [{lo}, {hi}] | {constant:+.6} | {linear:+.6} | {quadratic:+.6} |"
            );
        }
    }
    text.push('\n');
}

struct Stage {
    scene: Scene,
    tracer: Tracer,
}

impl Stage {
    fn new(name: &str) -> Result<Self, String> {
        let scene = demo::build(name).ok_or_else(|| format!("no scene {name}"))?;
        let (tracer, _) = Tracer::new(&scene);
        Ok(Self { scene, tracer })
    }

    fn render(&self, settings: &Settings) -> Result<Rendered, String> {
        let viewport = Viewport {
            width: SIZE,
            height: SIZE,
        };
        let camera = self.scene.cameras.first().ok_or("the scene has no camera")?;
        render(&self.scene, &self.tracer, camera, viewport, settings, &|| true)
            .map_err(|_| "interrupted".to_owned())
    }
}

fn irradiance_settings(method: Method, epsilon: f64, samples: u32) -> Settings {
    Settings {
        method,
        epsilon,
        samples,
        layers: vec![Layer::Irradiance],
        ..Settings::default()
    }
}

/// A picture with a common exposure, so that the methods can be compared by eye.
fn save(path: &Path, film: &Film, exposure: f64) -> Result<(), String> {
    write_png(
        path,
        &picture(film),
        Development {
            exposure,
            tone: Tone::Srgb,
        },
    )
    .map_err(|e| e.to_string())
}

/// Stops that bring the brightest parts just below white.
fn exposure(film: &Film) -> f64 {
    exposure_for(&picture(film).rgb().unwrap_or_default())
}

/// Root mean square difference of the irradiance over penumbra pixels of `truth`, relative to its mean there.
fn penumbra_error(film: &Film, truth: &Film) -> f64 {
    let channel = |film: &Film, name: &str| film.channel(name).map(<[f32]>::to_vec).unwrap_or_default();
    let (test, exact) = (channel(film, "irradiance.Y"), channel(truth, "irradiance.Y"));
    let changes = channel(truth, "discontinuities.Y");
    let (mut square, mut sum, mut count) = (0.0, 0.0, 0.0);
    for ((&a, &b), &changes) in test.iter().zip(&exact).zip(&changes) {
        if changes > 0.0 {
            square += (f64::from(a) - f64::from(b)).powi(2);
            sum += f64::from(b);
            count += 1.0;
        }
    }
    if count == 0.0 {
        0.0
    } else {
        (square / count).sqrt() / (sum / count)
    }
}

/// The exact answer.
fn truth(stage: &Stage) -> Result<Rendered, String> {
    let settings = Settings {
        method: Method::Exact,
        layers: vec![Layer::Irradiance, Layer::Discontinuities],
        ..Settings::default()
    };
    stage.render(&settings)
}

fn penumbra_share(statistics: &Statistics) -> f64 {
    statistics.penumbra as f64 / statistics.pairs().max(1) as f64
}

fn tests_per_pair(statistics: &Statistics) -> (f64, f64) {
    let pairs = statistics.pairs().max(1) as f64;
    let inner = statistics.visibility_tests - statistics.end_tests;
    (statistics.visibility_tests as f64 / pairs, inner as f64 / pairs)
}

fn figure5(folder: &Path, text: &mut String) -> Result<(), String> {
    let stage = Stage::new("wall")?;
    let truth = truth(&stage)?;
    let stops = exposure(&truth.film);
    let _ = writeln!(
        text,
        "## Figure 5 and table 2: `wall`, {SIZE}x{SIZE}\n\n\
         {:.1}% of the lit pixels are in penumbra. Both ends of the light are tested; where they differ, a \
         bisection stops as soon as half its bracket is at most epsilon. Tests count the two end tests; error is \
         the root mean square difference in penumbra pixels, relative to their mean.\n\n\
         | figure | method | epsilon or samples | tests a pixel | tests a penumbra pixel besides the ends | error |\n\
         |---|---|---|---|---|---|",
        100.0 * penumbra_share(&truth.statistics)
    );
    let methods = [
        ("a", Method::Bisection, 0.25, 1),
        ("b", Method::Bisection, 0.05, 1),
        ("c", Method::JitteredBisection, 0.25, 1),
        ("d", Method::JitteredBisection, 0.05, 1),
        ("e", Method::RandomCut, 0.25, 1),
        ("f", Method::RandomCut, 0.05, 1),
        ("g", Method::Rsb, 0.25, 1),
        ("h", Method::Rsb, 0.05, 1),
        ("i", Method::Hpd, 0.05, 4),
        ("j", Method::Hpd, 0.05, 6),
        ("k", Method::Dithered, 0.25, 1),
        ("l", Method::Dithered, 0.05, 1),
    ];
    for (letter, method, epsilon, samples) in methods {
        let rendered = stage.render(&irradiance_settings(method, epsilon, samples))?;
        let (all, inner) = tests_per_pair(&rendered.statistics);
        let sampled = method == Method::Hpd;
        let inner = if sampled {
            all
        } else {
            inner / penumbra_share(&truth.statistics)
        };
        let parameter = if sampled { f64::from(samples) } else { epsilon };
        let error = penumbra_error(&rendered.film, &truth.film);
        let _ = writeln!(
            text,
            "| [5{letter}](fig5{letter}.png) | {method} | {parameter} | {all:.2} | {inner:.2} | {error:.4} |"
        );
        save(&folder.join(format!("fig5{letter}.png")), &rendered.film, stops)?;
    }
    text.push_str(
        "\nFigures 5k and 5l are not in the paper: dithered bisection, which has no bias at all.\n\n",
    );
    Ok(())
}

fn figure6(folder: &Path, text: &mut String) -> Result<(), String> {
    text.push_str(
        "## Figure 6: a cylinder before a long light\n\n\
         | figure | scene | method | tests a pixel | besides the two end tests | in state 0 / 1 / 2 | \
         coherence answers | error in penumbra |\n|---|---|---|---|---|---|---|---|\n",
    );
    let rows = [
        ("a", "cylinder-2", Method::Tdf, 1),
        ("b", "cylinder-0.4", Method::Tdf, 1),
        ("c", "cylinder-0.4", Method::Gauss, 7),
        ("d", "cylinder-0.4", Method::Hpd, 7),
    ];
    for (letter, scene, method, samples) in rows {
        let stage = Stage::new(scene)?;
        let truth = truth(&stage)?;
        let rendered = stage.render(&irradiance_settings(method, 0.05, samples))?;
        let (all, inner) = tests_per_pair(&rendered.statistics);
        let tdf = &rendered.statistics.tdf;
        let by_state: Vec<String> = (0..3)
            .map(|s| format!("{:.2}", tdf.inner_tests[s] as f64 / tdf.searches[s].max(1) as f64))
            .collect();
        let is_tdf = method == Method::Tdf;
        let states = if is_tdf {
            by_state.join(" / ")
        } else {
            "-".to_owned()
        };
        let coherence = if is_tdf {
            format!("{:.2}%", 100.0 * tdf.coherence_share())
        } else {
            "-".to_owned()
        };
        let error = penumbra_error(&rendered.film, &truth.film);
        let _ = writeln!(
            text,
            "| [6{letter}](fig6{letter}.png) | {scene} | {method} | {all:.2} | {inner:.2} | {states} | {coherence} \
             | {error:.4} |"
        );
        save(
            &folder.join(format!("fig6{letter}.png")),
            &rendered.film,
            exposure(&truth.film),
        )?;
    }
    text.push('\n');
    Ok(())
}

fn figures2and7(folder: &Path, text: &mut String) -> Result<(), String> {
    let stage = Stage::new("subway")?;
    let exact = truth(&stage)?;
    let stops = exposure(&exact.film);
    text.push_str(
        "## Figures 2 and 7: `subway`\n\n\
         Share of the pixels by number of discontinuities along each light (figure 2: black 0, then ever \
         brighter up to 4 and more):\n\n| light | 0 | 1 | 2 | 3 | 4 and more |\n|---|---|---|---|---|---|\n",
    );
    for (index, light) in stage.scene.lights.iter().enumerate() {
        let mut alone = Stage::new("subway")?;
        alone.scene.lights = vec![light.clone()];
        let counted = truth(&alone)?;
        let counts = counted.film.channel("discontinuities.Y").unwrap_or_default();
        let mut shares = [0usize; 5];
        for &n in counts {
            shares[(n as usize).min(4)] += 1;
        }
        let percent: Vec<String> = shares
            .iter()
            .map(|&n| format!("{:.1}%", 100.0 * n as f64 / counts.len() as f64))
            .collect();
        let _ = writeln!(text, "| {} | {} |", light.name(), percent.join(" | "));
        let grey: Vec<Vec3> = counts.iter().map(|&n| Vec3::splat((n / 4.0).min(1.0))).collect();
        let picture = Image::from_rgb(SIZE as usize, SIZE as usize, &grey);
        let name = ["fig2b.png", "fig2c.png"]
            .get(index)
            .copied()
            .unwrap_or("fig2x.png");
        let plain = Development {
            exposure: 0.0,
            tone: Tone::Srgb,
        };
        write_png(&folder.join(name), &picture, plain).map_err(|e| e.to_string())?;
    }
    save(&folder.join("fig2a.png"), &exact.film, stops)?;
    text.push_str(
        "\n| figure | method | tests a light and pixel | besides the two end tests | relative error |\n\
         |---|---|---|---|---|\n",
    );
    for (name, method) in [("fig7.png", Method::Tdf), ("fig7-any-number.png", Method::Finder)] {
        let rendered = stage.render(&irradiance_settings(method, 0.05, 1))?;
        let (all, inner) = tests_per_pair(&rendered.statistics);
        let error = penumbra_error(&rendered.film, &exact.film);
        let _ = writeln!(
            text,
            "| [{name}]({name}) | {method} | {all:.2} | {inner:.2} | {error:.4} |"
        );
        save(&folder.join(name), &rendered.film, stops)?;
    }
    text.push_str("\nTwo lights, epsilon 0.05, nu 0.25.\n");
    Ok(())
}
