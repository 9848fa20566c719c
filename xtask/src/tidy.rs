//! Habits of the house that a program can check.

use std::fs;
use std::path::{Path, PathBuf};

use crate::run::{cargo, output, root};

/// Lines that a source file may have.
const MAX_LINES: usize = 1000;
/// Bytes that one committed binary file may have.
const MAX_BINARY: u64 = 200_000;
/// Bytes that all fixtures and goldens may have together.
const MAX_FIXTURES: u64 = 4_000_000;

pub(crate) fn run() -> Result<(), String> {
    let root = root();
    let mut faults = Vec::new();
    let mut fixtures = 0;
    for path in committed_files(&root)? {
        let shown = path.display().to_string();
        let full = root.join(&path);
        let Ok(bytes) = fs::read(&full) else { continue };
        if shown.starts_with("fixtures/") {
            fixtures += bytes.len() as u64;
        }
        let Ok(text) = String::from_utf8(bytes.clone()) else {
            if bytes.len() as u64 > MAX_BINARY {
                faults.push(format!(
                    "{shown}: {} bytes; a binary file has at most {MAX_BINARY}",
                    bytes.len()
                ));
            }
            continue;
        };
        if path.extension().is_some_and(|e| e == "rs") {
            source(&shown, &text, &mut faults);
        }
        if path
            .extension()
            .is_some_and(|e| e == "rs" || e == "md" || e == "toml")
        {
            words(&shown, &text, &mut faults);
        }
    }
    if fixtures > MAX_FIXTURES {
        faults.push(format!(
            "fixtures: {fixtures} bytes; the budget is {MAX_FIXTURES}"
        ));
    }
    manifests(&root, &mut faults)?;
    if faults.is_empty() {
        Ok(())
    } else {
        Err(faults.join("\n"))
    }
}

fn committed_files(root: &Path) -> Result<Vec<PathBuf>, String> {
    let mut git = std::process::Command::new("git");
    git.current_dir(root)
        .args(["ls-files", "--cached", "--others", "--exclude-standard"]);
    Ok(output(&mut git)?.lines().map(PathBuf::from).collect())
}

fn source(shown: &str, text: &str, faults: &mut Vec<String>) {
    if !text.starts_with("//! ") {
        faults.push(format!(
            "{shown}: the first line does not say what the file is for (`//! ...`)"
        ));
    }
    let lines = text.lines().count();
    if lines > MAX_LINES {
        faults.push(format!("{shown}: {lines} lines; at most {MAX_LINES}"));
    }
    if shown.ends_with("/src/lib.rs") && lines > 150 {
        faults.push(format!("{shown}: {lines} lines; a lib.rs has at most 150"));
    }
    // Split so that this file does not accuse itself.
    for forbidden in [
        concat!("#[ig", "nore"),
        concat!("to", "do!("),
        concat!("unimple", "mented!("),
        concat!("dbg", "!("),
    ] {
        if text.contains(forbidden) {
            faults.push(format!("{shown}: contains {forbidden}"));
        }
    }
    if text.contains(concat!("allow", "(unsafe_code")) {
        faults.push(format!(
            "{shown}: unsafe code is expected with a reason, not allowed"
        ));
    }
}

/// The project speaks of itself alone: no paths of one machine.
fn words(shown: &str, text: &str, faults: &mut Vec<String>) {
    for forbidden in [
        concat!("/wo", "rk/"),
        concat!("/ro", "ot/"),
        concat!("../sha", "red"),
    ] {
        if text.contains(forbidden) {
            faults.push(format!("{shown}: names {forbidden}"));
        }
    }
}

fn manifests(root: &Path, faults: &mut Vec<String>) -> Result<(), String> {
    let metadata = output(&mut cargo(&["metadata", "--no-deps", "--format-version", "1"]))?;
    let metadata: serde_json::Value = serde_json::from_str(&metadata).map_err(|e| e.to_string())?;
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let name = package["name"].as_str().unwrap_or_default();
        let published = package["publish"].is_null();
        if package["license"] != "MIT OR Apache-2.0" {
            faults.push(format!("{name}: the licence is not MIT OR Apache-2.0"));
        }
        if package["description"].as_str().is_none_or(str::is_empty) {
            faults.push(format!("{name}: no description"));
        }
        let folder = root.join("crates").join(name);
        if published {
            if !folder.join("README.md").is_file() {
                faults.push(format!("{name}: no README.md"));
            }
            let example = fs::read_dir(folder.join("examples")).is_ok_and(|mut d| d.next().is_some());
            if !example && name != "llsr-cli" {
                faults.push(format!("{name}: no runnable example"));
            }
        }
        let manifest = package["manifest_path"].as_str().unwrap_or_default();
        let text = fs::read_to_string(manifest).map_err(|e| format!("{manifest}: {e}"))?;
        if !text.contains("[lints]\nworkspace = true") {
            faults.push(format!("{name}: the workspace's lints are not on"));
        }
    }
    for file in [
        "README.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "LICENSE-MIT",
        "LICENSE-APACHE",
    ] {
        if !root.join(file).is_file() {
            faults.push(format!("{file} is missing"));
        }
    }
    Ok(())
}
