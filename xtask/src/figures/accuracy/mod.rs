//! Error against run time on the built-in scenes, with a truth that brute force checks, and what each economy is worth.

mod bars;
mod economies;
mod program;
mod sweep;
mod truth;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use llsr_scene::demo;

use crate::run::{cargo, root, run as run_command};

const SCENES: [&str; 5] = ["wall", "cylinder-2", "cylinder-0.4", "subway", "bars"];

/// `cargo xtask figures accuracy`
pub(crate) fn run() -> Result<(), String> {
    let folder = prepare()?;
    let mut text = String::from(
        "# Error against run time\n\n\
         Written by `cargo xtask figures accuracy`, with the plots and tables beside this file: 128x128 pixels, one \
         thread, CPU seconds of rendering alone. The truth is `exact`, which brute force checks: from up to 256 points of each scene all \
         triangles are cut in exact arithmetic and primitives are found by their distances, and the irradiance of what remains is \
         integrated adaptively.\n",
    );
    for name in SCENES {
        let scene = demo::build(name).ok_or_else(|| format!("no scene {name}"))?;
        let checked = truth::check(&scene)?;
        let _ = writeln!(
            text,
            "\n## `demo:{name}`\n\n\
             From {} points `exact` sees what brute force sees, at {} places of the lights; its irradiance differs by a relative \
             RMSE of {:.0e}, at most {:.0e} of the mean.\n\n![{name}]({name}.svg) ([all rows]({name}.csv))\n",
            checked.points, checked.places, checked.rel_rmse, checked.largest
        );
        sweep::bench(name)?;
        let csv = folder.join(format!("{name}.csv"));
        let csv = fs::read_to_string(&csv).map_err(|e| format!("{}: {e}", csv.display()))?;
        text.push_str(&sweep::time_to_error(&csv)?);
        eprintln!("{name} done");
    }
    text.push_str(&bars::many_changes()?);
    text.push_str(&economies::refinement(&SCENES)?);
    let path = folder.join("README.md");
    fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
}

/// `cargo xtask figures economies [--data FOLDER]`
pub(crate) fn run_economies(data: Option<&Path>) -> Result<(), String> {
    let folder = prepare()?;
    let text = format!(
        "# What economies are worth\n\n\
         Written by `cargo xtask figures economies --data FOLDER`: one thread, CPU seconds of rendering alone (the \
         median of three runs, or one of two seconds and more).\n{}{}",
        economies::skips(data)?,
        economies::antialiasing()?
    );
    let path = folder.join("economies.md");
    fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
}

/// Builds the optimised program; gives the folder for what it measures.
fn prepare() -> Result<PathBuf, String> {
    run_command(&mut cargo(&[
        "build",
        "--quiet",
        "--release",
        "--package",
        "llsr-cli",
    ]))?;
    let folder = root().join("docs/performance");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    Ok(folder)
}
