//! JSON reports and warnings.

use std::path::Path;

use serde_json::Value;

use crate::failure::Failure;

/// Writes a report, whole or not at all.
pub(crate) fn write_json(path: &Path, value: &Value) -> Result<(), Failure> {
    let mut text = serde_json::to_string_pretty(value).expect("a report holds strings and numbers only");
    text.push('\n');
    Ok(llsr_io::write_file(path, text.as_bytes())?)
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
