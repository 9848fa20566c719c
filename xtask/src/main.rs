//! Tasks of the workspace: `cargo xtask` lists them.

mod checks;
mod figures;
mod golden;
mod layers;
mod run;
mod silhouettes;
mod soak;
mod stats;
mod stress;
mod tables;
mod tidy;
mod view_test;

use std::process::ExitCode;

const HELP: &str = "\
cargo xtask TASK

  test       all tests (unit, property, corpus, documentation)
  checks     everything else that must hold: fmt tidy layers msrv golden tables stats clippy doc deny view-test
  ci         test, then checks

  golden [--bless NAME]   compare the golden pictures, or write one anew
  stress [SHARE]          exact visibility and intervals against exact arithmetic, millions of cases
  silhouettes check FOLDER [VIEWS]   silhouettes of all meshes there against brute force
  silhouettes time [FOLDER] [VIEWS]  how fast they are found; build with --release
  figures of99            the figures and tables of the 1999 paper, into docs/papers/of99
  figures accuracy        error against run time on the built-in scenes, into docs/performance
  figures economies [--data FOLDER]   what each kind of work left out is worth, there too; FOLDER may hold classroom.glb
  figures bwg03 [--data FOLDER] [NAME]   those of the 2003 paper, into docs/papers/bwg03, or the table or figure of that
                          name; FOLDER may hold classroom.glb, igea.glb and dragon_vrip.glb
  soak [FRAMES]           a live walk with moving things, 20000 frames: memory and end

  view-test [FOLDER]      the window of llsr view on a virtual screen, where Xvfb and xdotool are installed

  fmt clippy doc msrv tidy layers stats deny     one check alone

  tables [--check]      digest of the lookup tables of the edge-and-point image
";

/// A task without arguments.
type Check = fn() -> Result<(), String>;

/// The checks beside the tests, in the order in which they run: quick ones first.
const CHECKS: &[(&str, Check)] = &[
    ("fmt", checks::fmt),
    ("tidy", tidy::run),
    ("layers", layers::run),
    ("msrv", checks::msrv),
    ("golden", || golden::run(&[])),
    ("tables", || tables::run(&["--check".to_owned()])),
    ("clippy", checks::clippy),
    ("doc", checks::doc),
    ("stats", stats::run),
    ("deny", checks::deny),
    ("view-test", || view_test::run_with(&[])),
];

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let rest = args.get(1..).unwrap_or_default();
    let result = match args.first().map(String::as_str) {
        Some("test") => checks::test(rest),
        Some("checks") => all_checks(),
        Some("tables") => tables::run(rest),
        Some("ci") => checks::test(rest).and_then(|()| all_checks()),
        Some("golden") => golden::run(rest),
        Some("figures") => figures::run(rest),
        Some("silhouettes") => silhouettes::run(rest),
        Some("soak") => soak::run(rest),
        Some("view-test") => view_test::run_with(rest),
        Some("stress") => stress::run(rest),
        Some(name) => match CHECKS.iter().find(|check| check.0 == name) {
            Some((_, check)) => check(),
            None => Err(format!("there is no task '{name}'\n\n{HELP}")),
        },
        None => {
            print!("{HELP}");
            Ok(())
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}

/// Runs every check, also after one has failed, and says which failed.
fn all_checks() -> Result<(), String> {
    let mut failed = Vec::new();
    for (name, check) in CHECKS {
        let start = std::time::Instant::now();
        println!("== {name}");
        if let Err(message) = check() {
            eprintln!("{message}");
            failed.push(*name);
        }
        println!("== {name}: {:.1} s", start.elapsed().as_secs_f64());
    }
    println!("{} passed, {} failed", CHECKS.len() - failed.len(), failed.len());
    if failed.is_empty() {
        Ok(())
    } else {
        Err(format!("failed: {}", failed.join(", ")))
    }
}
