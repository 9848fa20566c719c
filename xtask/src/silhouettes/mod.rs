//! Silhouettes of real meshes: the tree against brute force, and against a linear scan.

mod check;
mod time;

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use llsr_intervals::Viewpoint;
use llsr_io::{LoadOptions, load_scene};
use llsr_scene::{Bounds, Mesh};
use llsr_testkit::edges::View;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const USAGE: &str = "usage: cargo run --release -p xtask -- silhouettes check FOLDER [VIEWS]\n   \
                     or: cargo run --release -p xtask -- silhouettes time [FOLDER] [VIEWS]";

/// `silhouettes check FOLDER [VIEWS]`: none missed and none extra, on every mesh below the folder from random views.
/// `silhouettes time [FOLDER] [VIEWS]`: how fast, on the large ones, or without a folder on meshes made to be easy and hard.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let views = |text: Option<&String>, default: usize| match text {
        None => Ok(default),
        Some(text) => text
            .parse()
            .map_err(|_| format!("'{text}' is no number of views")),
    };
    match args {
        [what, folder, rest @ ..] if what == "check" => {
            check::run(&files(folder)?, views(rest.first(), 1000)?)
        }
        [what, rest @ ..] if what == "time" => {
            let files = rest.first().map_or(Ok(Vec::new()), |folder| files(folder))?;
            time::run(&files, views(rest.get(1), 40)?)
        }
        _ => Err(USAGE.to_owned()),
    }
}

/// All scene files below a folder, in order.
fn files(folder: &str) -> Result<Vec<PathBuf>, String> {
    let mut waiting = vec![PathBuf::from(folder)];
    let mut found = Vec::new();
    while let Some(folder) = waiting.pop() {
        let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        for path in entries.flatten().map(|entry| entry.path()) {
            let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            if path.is_dir() {
                waiting.push(path);
            } else if ["obj", "gltf", "glb"].contains(&ending.to_ascii_lowercase().as_str()) {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// The meshes of a file; none if it is refused, which is said.
fn meshes(path: &Path) -> Vec<Mesh> {
    match load_scene(path, &LoadOptions::default()) {
        Ok(loaded) => loaded.scene.meshes,
        Err(error) => {
            println!("refused: {error}");
            Vec::new()
        }
    }
}

fn name(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// Views from around, near, inside and infinitely far away, and a few special ones.
fn views(mesh: &Mesh, bounds: Bounds, count: usize, seed: u64) -> Vec<View> {
    let random = &mut Pcg64Mcg::seed_from_u64(seed);
    let mut uniform = || f64::from(random.next_u32() >> 8) / f64::from(1 << 23) - 1.0;
    let (center, size) = (bounds.center().as_dvec3(), f64::from(bounds.diagonal()));
    (0..count)
        .map(|i| {
            let direction = DVec3::new(uniform(), uniform(), uniform());
            match i % 8 {
                0..3 => View::At(center + size * direction),
                3 | 4 => View::At(center + 3.0 * size * direction),
                5 => View::At(center + 0.3 * size * direction),
                6 if i % 16 == 6 && !mesh.positions.is_empty() => {
                    // At a vertex, edge-on to all faces there.
                    let at = (0.5 + 0.5 * uniform()) * mesh.positions.len() as f64;
                    View::At(mesh.positions[(at as usize).min(mesh.positions.len() - 1)].as_dvec3())
                }
                7 if i % 64 == 7 => View::Towards(DVec3::AXES[i / 64 % 3]),
                _ => View::Towards(direction),
            }
        })
        .collect()
}

fn viewpoint(view: View) -> Option<Viewpoint> {
    match view {
        View::At(eye) => Viewpoint::at(eye),
        View::Towards(direction) => Viewpoint::towards(direction),
    }
}
