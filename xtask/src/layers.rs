//! Which crate may use which, and what the lower layers do without.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::run::{cargo, output, root};

/// Members of the workspace that a crate may depend on; crates not named here may use everything.
const MAY_USE: &[(&str, &[&str])] = &[
    ("llsr-intervals", &[]),
    ("llsr-visibility", &[]),
    ("llsr-epi-tables", &[]),
    ("llsr-metrics", &[]),
    ("llsr-scene", &["llsr-visibility"]),
    ("llsr-rsb", &["llsr-visibility"]),
    ("llsr-quadrature", &["llsr-visibility"]),
    ("llsr-epi", &["llsr-epi-tables"]),
    ("llsr-render-cache", &[]),
    ("llsr-tdf", &["llsr-visibility", "llsr-rsb"]),
    ("llsr-io", &["llsr-scene", "llsr-visibility"]),
    ("llsr-tracer", &["llsr-scene", "llsr-visibility"]),
    ("llsr-edges", &["llsr-intervals", "llsr-scene", "llsr-visibility"]),
    (
        "llsr-shading",
        &[
            "llsr-tracer",
            "llsr-tdf",
            "llsr-rsb",
            "llsr-quadrature",
            "llsr-scene",
            "llsr-visibility",
        ],
    ),
    (
        "llsr-epr",
        &[
            "llsr-shading",
            "llsr-edges",
            "llsr-epi",
            "llsr-render-cache",
            "llsr-tracer",
            "llsr-quadrature",
            "llsr-intervals",
            "llsr-scene",
            "llsr-visibility",
        ],
    ),
    (
        "llsr-viewer",
        &[
            "llsr-epr",
            "llsr-shading",
            "llsr-epi",
            "llsr-render-cache",
            "llsr-tracer",
            "llsr-io",
            "llsr-scene",
        ],
    ),
];

/// Libraries that appear in exactly one shipped crate.
const ONLY_IN: &[(&str, &str)] = &[
    ("obvhs", "llsr-tracer"),
    ("spade", "llsr-io"),
    ("tobj", "llsr-io"),
    ("gltf", "llsr-io"),
    ("image", "llsr-io"),
    ("exr", "llsr-io"),
    ("winit", "llsr-viewer"),
    ("softbuffer", "llsr-viewer"),
];

/// Crates without input and output, clock, global randomness or threads of their own.
const PURE: &[&str] = &[
    "llsr-intervals",
    "llsr-visibility",
    "llsr-epi-tables",
    "llsr-metrics",
    "llsr-scene",
    "llsr-rsb",
    "llsr-quadrature",
    "llsr-epi",
    "llsr-render-cache",
    "llsr-tdf",
];

const IMPURE: &[&str] = &[
    "std::fs",
    "std::io",
    "std::net",
    "std::time",
    "std::thread",
    "std::env::var",
    "println!(",
];

pub(crate) fn run() -> Result<(), String> {
    let metadata = output(&mut cargo(&["metadata", "--no-deps", "--format-version", "1"]))?;
    let metadata: serde_json::Value = serde_json::from_str(&metadata).map_err(|e| e.to_string())?;
    let may_use: BTreeMap<_, _> = MAY_USE.iter().copied().collect();
    let mut faults = Vec::new();
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let name = package["name"].as_str().unwrap_or_default();
        let shipped = package["publish"].is_null();
        for dependency in package["dependencies"].as_array().into_iter().flatten() {
            let used = dependency["name"].as_str().unwrap_or_default();
            if dependency["kind"] == "dev" {
                continue;
            }
            let member = used.starts_with("llsr-");
            if member && may_use.get(name).is_some_and(|allowed| !allowed.contains(&used)) {
                faults.push(format!("{name} uses {used}, which its layer may not"));
            }
            let only = ONLY_IN.iter().find(|(library, _)| *library == used);
            if let Some((library, home)) = only
                && shipped
                && name != *home
            {
                faults.push(format!("{name} uses {library}, which belongs to {home} alone"));
            }
        }
    }
    for name in PURE {
        scan(&root().join("crates").join(name).join("src"), name, &mut faults);
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(faults.join("\n"))
    }
}

fn scan(folder: &Path, name: &str, faults: &mut Vec<String>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() {
            scan(&path, name, faults);
            continue;
        }
        // Tests may print what they measured.
        if path.file_name().is_some_and(|name| name == "tests.rs") {
            continue;
        }
        let Ok(text) = fs::read_to_string(&path) else {
            continue;
        };
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        for (number, line) in code.enumerate() {
            if let Some(word) = IMPURE.iter().find(|word| line.contains(**word)) {
                faults.push(format!(
                    "{} (code line {}): {name} does without {word}",
                    path.display(),
                    number + 1
                ));
            }
        }
    }
}
