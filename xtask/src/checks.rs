//! The checks that other programs do.

use crate::run::{cargo, output, root, run};

pub(crate) fn test(extra: &[String]) -> Result<(), String> {
    let mut command = cargo(&["test", "--workspace", "--no-fail-fast"]);
    run(command.args(extra))
}

pub(crate) fn fmt() -> Result<(), String> {
    run(&mut cargo(&["fmt", "--all", "--check"]))
}

pub(crate) fn clippy() -> Result<(), String> {
    run(&mut cargo(&[
        "clippy",
        "--quiet",
        "--workspace",
        "--all-targets",
        "--",
        "-D",
        "warnings",
    ]))
}

pub(crate) fn doc() -> Result<(), String> {
    let mut command = cargo(&["doc", "--quiet", "--workspace", "--no-deps"]);
    run(command.env("RUSTDOCFLAGS", "-D warnings"))
}

/// The stated minimum version must be the one that the continuous integration builds with, and this build must
/// use it or a later one.
pub(crate) fn msrv() -> Result<(), String> {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).map_err(|e| e.to_string())?;
    let stated = manifest
        .lines()
        .find_map(|line| line.strip_prefix("rust-version = "))
        .ok_or("Cargo.toml states no rust-version")?
        .trim_matches('"')
        .to_owned();
    let workflow = std::fs::read_to_string(root().join(".github/workflows/ci.yml"))
        .map_err(|e| format!(".github/workflows/ci.yml: {e}"))?;
    if !workflow.contains(&format!("toolchain: \"{stated}\"")) {
        return Err(format!(
            ".github/workflows/ci.yml does not build with the stated toolchain \"{stated}\""
        ));
    }
    let version = output(&mut cargo(&["--version"]))?;
    let numbers = |text: &str| -> Vec<u32> { text.split('.').filter_map(|n| n.parse().ok()).collect() };
    let running = version.split_whitespace().nth(1).unwrap_or_default();
    if numbers(running) < numbers(&stated) {
        return Err(format!("this is cargo {running}; the workspace needs {stated}"));
    }
    println!("stated {stated}, running {running}");
    Ok(())
}

/// Licences, sources and bans, where the program for it is installed.
pub(crate) fn deny() -> Result<(), String> {
    if output(&mut cargo(&["deny", "--version"])).is_err() {
        println!("cargo-deny is not installed; skipped (`cargo install cargo-deny` adds it)");
        return Ok(());
    }
    run(&mut cargo(&[
        "deny",
        "--offline",
        "check",
        "licenses",
        "bans",
        "sources",
    ]))
}
