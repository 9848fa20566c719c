//! Pictures by the optimised program, as anybody would make them.

use std::fs;
use std::process::Command;

use llsr_io::{Image, read_image};
use serde_json::Value;

use crate::run::{root, run};

/// A picture and the program's report of it.
pub(super) struct Shot {
    pub(super) picture: Image,
    pub(super) report: Value,
    /// CPU seconds of rendering: the median of three runs, or of one if that took long.
    pub(super) seconds: f64,
}

/// From this on one run is enough (CPU seconds).
const LONG: f64 = 2.0;

/// `llsr render` on one thread with the layers that the comparisons want, square pictures `size` pixels wide.
pub(super) fn render(size: u32, arguments: &[&str]) -> Result<Shot, String> {
    let folder = root().join("target/accuracy");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    // Two tasks may run at a time.
    let file = |extension: &str| folder.join(format!("shot-{}.{extension}", std::process::id()));
    let (picture, report) = (file("exr"), file("json"));
    let mut seconds = Vec::new();
    let mut value = Value::Null;
    while seconds.len() < 3 && seconds.first().is_none_or(|&first| first < LONG) {
        let mut command = Command::new(root().join("target/release/llsr"));
        command
            .arg("render")
            .args(arguments)
            .args(["--size", &format!("{size}x{size}")])
            .args([
                "--threads",
                "1",
                "--quiet",
                "--aov",
                "irradiance,discontinuities",
                "-o",
            ])
            .arg(&picture)
            .arg("--report")
            .arg(&report);
        run(&mut command)?;
        let text = fs::read_to_string(&report).map_err(|e| format!("{}: {e}", report.display()))?;
        value = serde_json::from_str(&text).map_err(|e| format!("{}: {e}", report.display()))?;
        seconds.push(number(&value, "/cpu_seconds/render")?);
    }
    seconds.sort_unstable_by(f64::total_cmp);
    let image = read_image(&picture).map_err(|e| e.to_string())?;
    for path in [&picture, &report] {
        fs::remove_file(path).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(Shot {
        picture: image,
        report: value,
        seconds: seconds[seconds.len() / 2],
    })
}

/// A number of a report, by JSON pointer.
pub(super) fn number(report: &Value, pointer: &str) -> Result<f64, String> {
    report
        .pointer(pointer)
        .and_then(Value::as_f64)
        .ok_or_else(|| format!("the report has no number {pointer}"))
}

/// A channel of a picture.
pub(super) fn channel<'a>(picture: &'a Image, name: &str) -> Result<&'a [f32], String> {
    picture
        .channels
        .iter()
        .find(|(channel, _)| channel == name)
        .map(|(_, values)| values.as_slice())
        .ok_or_else(|| format!("the picture has no channel {name}"))
}

/// Root mean square error of the irradiance relative to its mean, over the pixels of `truth` that `counts` says to take.
pub(super) fn rel_rmse(test: &Image, truth: &Image, counts: impl Fn(usize) -> bool) -> Result<f64, String> {
    let (test, truth) = (channel(test, "irradiance.Y")?, channel(truth, "irradiance.Y")?);
    let (mut square, mut sum, mut count) = (0.0, 0.0, 0.0);
    for (index, (&a, &b)) in test.iter().zip(truth).enumerate() {
        if counts(index) {
            square += (f64::from(a) - f64::from(b)).powi(2);
            sum += f64::from(b);
            count += 1.0;
        }
    }
    Ok(if count == 0.0 {
        0.0
    } else {
        f64::sqrt(square / count) / (sum / count)
    })
}
