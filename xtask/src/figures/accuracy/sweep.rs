//! `llsr bench` on a scene, and the CPU time that each method takes to an error.

use std::fmt::Write as _;
use std::process::Command;

use crate::run::{root, run};

const METHODS: [&str; 9] = [
    "auto",
    "exact",
    "finder",
    "tdf",
    "rsb",
    "gauss",
    "hpd",
    "stratified",
    "uniform",
];

/// Small, so that all methods are done in minutes; what an answer costs hardly depends on it.
const SIZE: &str = "128x128";

/// The relative error that finished pictures have.
const GOAL: f64 = 1e-3;

/// Measures the methods; leaves docs/performance/NAME.svg and NAME.csv.
pub(super) fn bench(name: &str) -> Result<(), String> {
    let file = |extension: &str| root().join(format!("docs/performance/{name}.{extension}"));
    let mut command = Command::new(root().join("target/release/llsr"));
    command
        .args(["bench", &format!("demo:{name}"), "--methods", &METHODS.join(",")])
        .args(["--size", SIZE, "--threads", "1", "--quiet", "-o"])
        .arg(file("svg"))
        .arg("--report")
        .arg(file("csv"));
    run(&mut command)
}

/// One measurement.
struct Point {
    parameter: f64,
    seconds: f64,
    error: f64,
}

/// When a method reaches an error.
enum Reached {
    /// Between two measurements, along the line through both in logarithms.
    Between(f64),
    /// By going on along the last two measurements.
    Beyond(f64),
    /// The last two measurements do not come closer, or not within [`FARTHEST`] times the longer of them.
    Never,
}

/// How many times the longest measurement a time may lie beyond it and still be told.
const FARTHEST: f64 = 100.0;

/// A table of the CPU seconds to an error of 0.1%, and of the best that a method did.
pub(super) fn time_to_error(csv: &str) -> Result<String, String> {
    let auto = points(csv, "auto")?;
    let auto = auto.first().ok_or("auto was not measured")?;
    let mut text = format!(
        "| method | CPU s to a relative RMSE of 0.1% | times `auto` | closest: error, parameter, CPU s |\n|---|---|---|---|\n\
         | auto | {:.3} | 1 | {}, |\n",
        auto.seconds,
        small(auto.error)
    );
    for method in METHODS.into_iter().filter(|&method| method != "auto") {
        let points = points(csv, method)?;
        let Some(best) = points.iter().min_by(|a, b| a.error.total_cmp(&b.error)) else {
            return Err(format!("{method} was not measured"));
        };
        let (shown, ratio) = match reached(&points) {
            Reached::Between(seconds) => (format!("{seconds:.3}"), format!("{:.1}", seconds / auto.seconds)),
            Reached::Beyond(seconds) => (
                format!("{seconds:.1} (extrapolated)"),
                format!("{:.0}", seconds / auto.seconds),
            ),
            Reached::Never => ("never".to_owned(), "-".to_owned()),
        };
        let _ = writeln!(
            text,
            "| {method} | {shown} | {ratio} | {}, {}, {:.3} |",
            small(best.error),
            best.parameter,
            best.seconds
        );
    }
    Ok(text)
}

fn small(error: f64) -> String {
    if error == 0.0 {
        "0".to_owned()
    } else {
        format!("{error:.1e}")
    }
}

fn points(csv: &str, method: &str) -> Result<Vec<Point>, String> {
    csv.lines()
        .skip(1)
        .filter(|line| line.split(',').next() == Some(method))
        .map(|line| {
            let fields: Vec<Option<f64>> = line.split(',').map(|field| field.parse().ok()).collect();
            match fields.as_slice() {
                [_, Some(parameter), Some(seconds), _, _, Some(error), ..] => Ok(Point {
                    parameter: *parameter,
                    seconds: *seconds,
                    error: *error,
                }),
                _ => Err(format!("cannot read '{line}'")),
            }
        })
        .collect()
}

fn reached(points: &[Point]) -> Reached {
    let along = |a: &Point, b: &Point| {
        let slope = (b.seconds / a.seconds).ln() / (b.error / a.error).ln();
        a.seconds * (slope * (GOAL / a.error).ln()).exp()
    };
    match points {
        [first, ..] if first.error <= GOAL => Reached::Between(first.seconds),
        _ => match points.windows(2).find(|pair| pair[1].error <= GOAL) {
            Some([a, b]) if b.error > 0.0 => Reached::Between(along(a, b)),
            Some([_, b]) => Reached::Between(b.seconds),
            _ => match points {
                [.., a, b] if b.error < a.error && along(a, b) <= FARTHEST * b.seconds => {
                    Reached::Beyond(along(a, b))
                }
                _ => Reached::Never,
            },
        },
    }
}
