//! Golden pictures: small linear EXR files, each with a tolerance and a reason for it.

use std::fs;
use std::path::{Path, PathBuf};

use llsr_io::Image;
use llsr_scene::{Viewport, demo};
use llsr_shading::{Film, Layer, Method, Settings, render};
use llsr_tracer::Tracer;

use crate::run::root;

/// A picture that must not change by more than its tolerance.
struct Golden {
    name: &'static str,
    scene: &'static str,
    method: Method,
    /// Largest root mean square difference of the irradiance, relative to its mean.
    tolerance: f64,
    /// Why it is not zero.
    reason: &'static str,
}

const SIZE: u32 = 96;

/// Rounding in the last place may move a shadow ray to the other side of an edge: a few pixels of such a picture
/// change by a light's share of the bracket.
const EDGES: &str = "a ray that grazes an edge may fall on the other side on another processor";
/// A random search shows the same with every bracket end.
const SEARCH: &str = "an answer that flips at an edge changes which bracket a random search returns";

const GOLDENS: &[Golden] = &[
    Golden {
        name: "wall-auto",
        scene: "wall",
        method: Method::Auto,
        tolerance: 0.004,
        reason: EDGES,
    },
    Golden {
        name: "wall-rsb",
        scene: "wall",
        method: Method::Rsb,
        tolerance: 0.01,
        reason: SEARCH,
    },
    Golden {
        name: "wall-hpd",
        scene: "wall",
        method: Method::Hpd,
        tolerance: 0.02,
        reason: SEARCH,
    },
    Golden {
        name: "cylinder-2-tdf",
        scene: "cylinder-2",
        method: Method::Tdf,
        tolerance: 0.01,
        reason: SEARCH,
    },
    Golden {
        name: "cylinder-0.4-auto",
        scene: "cylinder-0.4",
        method: Method::Auto,
        tolerance: 0.004,
        reason: EDGES,
    },
    Golden {
        name: "subway-auto",
        scene: "subway",
        method: Method::Auto,
        tolerance: 0.01,
        reason: EDGES,
    },
    Golden {
        name: "sphere-and-friends-auto",
        scene: "sphere-and-friends",
        method: Method::Auto,
        tolerance: 0.006,
        reason: EDGES,
    },
];

/// Compares every golden, or writes the one named after `--bless`; blessing always ends as failed, so that it
/// cannot pass as a check.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    match args {
        [] => check(),
        [flag, name] if flag == "--bless" => bless(name),
        _ => Err("usage: cargo xtask golden [--bless NAME]; one name at a time".to_owned()),
    }
}

fn folder() -> PathBuf {
    root().join("fixtures/golden")
}

fn film(golden: &Golden) -> Result<Film, String> {
    let scene = demo::build(golden.scene).ok_or_else(|| format!("{}: no such scene", golden.scene))?;
    let (tracer, _) = Tracer::new(&scene);
    let camera = scene
        .cameras
        .first()
        .ok_or_else(|| format!("{}: no camera", golden.scene))?;
    let settings = Settings {
        method: golden.method,
        layers: vec![Layer::Irradiance],
        ..Settings::default()
    };
    let viewport = Viewport {
        width: SIZE,
        height: SIZE,
    };
    render(&scene, &tracer, camera, viewport, &settings, &|| true)
        .map(|rendered| rendered.film)
        .map_err(|_| "interrupted".to_owned())
}

fn irradiance(film: &Film) -> &[f32] {
    film.channel("irradiance.Y").unwrap_or_default()
}

fn check() -> Result<(), String> {
    let mut faults = Vec::new();
    for golden in GOLDENS {
        let path = folder().join(format!("{}.exr", golden.name));
        let expected = match llsr_io::read_image(&path) {
            Ok(image) => image,
            Err(error) => {
                faults.push(format!("{}: {error}", golden.name));
                continue;
            }
        };
        let film = film(golden)?;
        let (new, old) = (
            irradiance(&film),
            expected.channel("irradiance.Y").unwrap_or_default(),
        );
        if new.len() != old.len() || old.is_empty() {
            faults.push(format!(
                "{}: the golden has another size or no layer irradiance.Y",
                golden.name
            ));
            continue;
        }
        let mean = old.iter().map(|&v| f64::from(v)).sum::<f64>() / old.len() as f64;
        let square: f64 = new
            .iter()
            .zip(old)
            .map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2))
            .sum();
        let difference = (square / old.len() as f64).sqrt() / mean;
        println!(
            "{:<26} {difference:.2e} of {:.1e} ({})",
            golden.name, golden.tolerance, golden.reason
        );
        if difference.is_nan() || difference > golden.tolerance {
            let seen = root().join("target/golden").join(format!("{}.exr", golden.name));
            write(&seen, &film)?;
            faults.push(format!(
                "{}: relative difference {difference:.2e}, allowed {:.1e}; the new picture is {}",
                golden.name,
                golden.tolerance,
                seen.display()
            ));
        }
    }
    // A golden that nobody renders any more proves nothing.
    for entry in fs::read_dir(folder()).map_err(|e| e.to_string())?.flatten() {
        let file = entry.file_name().to_string_lossy().into_owned();
        if !GOLDENS
            .iter()
            .any(|golden| format!("{}.exr", golden.name) == file)
        {
            faults.push(format!("fixtures/golden/{file}: no golden has this name"));
        }
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(faults.join("\n"))
    }
}

fn bless(name: &str) -> Result<(), String> {
    let golden = GOLDENS
        .iter()
        .find(|golden| golden.name == name)
        .ok_or_else(|| format!("there is no golden '{name}'"))?;
    let path = folder().join(format!("{name}.exr"));
    write(&path, &film(golden)?)?;
    Err(format!(
        "{} is written: look at it, then commit it with the reason",
        path.display()
    ))
}

/// The channels as a file holds them.
pub(crate) fn picture(film: &Film) -> Image {
    let Viewport { width, height } = film.viewport;
    Image {
        width: width as usize,
        height: height as usize,
        channels: film.channels.clone(),
    }
}

fn write(path: &Path, film: &Film) -> Result<(), String> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|e| e.to_string())?;
    }
    llsr_io::write_exr(path, &picture(film)).map_err(|e| e.to_string())
}
