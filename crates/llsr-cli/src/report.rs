//! JSON reports and warnings.

use std::path::Path;

use llsr_epr::DroppedContrast;
use serde_json::{Value, json};

use crate::failure::Failure;

/// Writes a report, whole or not at all.
pub(crate) fn write_json(path: &Path, value: &Value) -> Result<(), Failure> {
    let mut text = serde_json::to_string_pretty(value).expect("a report holds strings and numbers only");
    text.push('\n');
    Ok(llsr_io::write_file(path, text.as_bytes())?)
}

/// What leaving out shadow edges does to the picture.
pub(crate) fn contrast_json(contrast: &DroppedContrast) -> Value {
    json!({
        "threshold": contrast.threshold,
        "measured": contrast.measured,
        "mean": contrast.mean,
        "largest": contrast.largest,
        "above_threshold": contrast.above,
    })
}

/// Says the same, and how many edges were left out; nothing if none were.
pub(crate) fn print_contrast(dropped: usize, contrast: &DroppedContrast) {
    if dropped == 0 {
        return;
    }
    let percent = 100.0 * contrast.threshold;
    println!("{dropped} shadow edges left out: their lights give less than {percent:.0}% of the light there");
    if contrast.measured > 0 {
        println!(
            "  measured at {} of them: these shadows change the light by {:.2}% on average, {:.2}% at most, by more than {percent:.0}% at {}",
            contrast.measured,
            100.0 * contrast.mean,
            100.0 * contrast.largest,
            contrast.above
        );
    }
}

/// The first `most` warnings on standard error, and how to see the rest.
pub(crate) fn print_warnings(warnings: &[String], most: usize, scene: &str) {
    for warning in warnings.iter().take(most) {
        eprintln!("warning: {warning}");
    }
    if warnings.len() > most {
        eprintln!(
            "warning: {} more; `llsr info {scene}` lists them",
            warnings.len() - most
        );
    }
}

/// Names with commas, at most `most` of them.
pub(crate) fn shortened(names: &[&str], most: usize) -> String {
    let shown: Vec<String> = names.iter().take(most).map(|name| format!("'{name}'")).collect();
    let rest = names.len().saturating_sub(most);
    if rest > 0 {
        format!("{} and {rest} more", shown.join(", "))
    } else {
        shown.join(", ")
    }
}
