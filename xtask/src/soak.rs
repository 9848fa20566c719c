//! A long walk in live mode: memory stays flat, nothing gets stuck, and it ends.

use std::process::{Child, Command};
use std::time::{Duration, Instant};

use crate::run::{cargo, root, run as run_command};

/// Growth of resident memory that counts as flat (bytes): what the allocator may keep.
const FLAT: u64 = 24 << 20;
/// Longest time without an end (s).
const PATIENCE: u64 = 3600;

/// `cargo xtask soak [FRAMES]`
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let frames: u32 = match args {
        [] => 20_000,
        [frames] => frames
            .parse()
            .map_err(|_| format!("soak: '{frames}' is not a number of frames"))?,
        _ => return Err("usage: cargo xtask soak [FRAMES]".to_owned()),
    };
    run_command(cargo(&["build", "-q", "--release", "-p", "llsr-cli"]).arg("--locked"))?;
    let program = root().join("target/release/llsr");
    let folder = std::env::temp_dir().join(format!("llsr-soak-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let path = folder.join("path.txt");
    std::fs::write(&path, circle(frames)).map_err(|e| format!("{}: {e}", path.display()))?;
    for mode in [&["--live"][..], &[]] {
        let mut command = Command::new(&program);
        command
            .args([
                "walk",
                "demo:chains",
                "--size",
                "128x96",
                "--add-grid",
                "--move",
                "--quiet",
                "--path",
            ])
            .arg(&path)
            .args(["--every", "1000000"])
            .args(mode);
        let name = if mode.is_empty() { "lockstep" } else { "live" };
        let child = command.spawn().map_err(|e| format!("{command:?}: {e}"))?;
        let (early, late, seconds) = watch(child)?;
        println!(
            "{name}: {frames} frames in {seconds:.0} s; resident {:.1} MiB after a tenth, {:.1} MiB at the end",
            early as f64 / (1 << 20) as f64,
            late as f64 / (1 << 20) as f64
        );
        if late > early + FLAT {
            return Err(format!("soak: {name}: memory grew by {} bytes", late - early));
        }
    }
    std::fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))
}

/// Round and round the chains, in 600 frames.
fn circle(frames: u32) -> String {
    use std::fmt::Write as _;
    let mut text = String::from("# llsr camera path 1\n");
    for frame in 0..frames {
        let angle = f64::from(frame) * std::f64::consts::TAU / 600.0;
        let (s, c) = angle.sin_cos();
        let _ = writeln!(text, "{} 1.5 {}  {} -0.2 {}  0 1 0  55", 4.0 * c, 4.0 * s, -c, -s);
    }
    text
}

/// Waits for the end. Returns resident memory early and late, and the seconds it took.
fn watch(mut child: Child) -> Result<(u64, u64, f64), String> {
    let start = Instant::now();
    let mut samples = Vec::new();
    loop {
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            if !status.success() {
                return Err(format!("soak: the walk ended with {status}"));
            }
            break;
        }
        if start.elapsed() > Duration::from_secs(PATIENCE) {
            let _ = child.kill();
            return Err(format!("soak: no end after {PATIENCE} s"));
        }
        samples.extend(resident(child.id()));
        std::thread::sleep(Duration::from_millis(100));
    }
    // The first tenth is for growing.
    let early = samples.get(samples.len() / 10).copied().unwrap_or(0);
    let late = samples[samples.len() * 9 / 10..]
        .iter()
        .copied()
        .max()
        .unwrap_or(0);
    Ok((early, late, start.elapsed().as_secs_f64()))
}

/// Resident bytes of a process, where the system tells.
fn resident(process: u32) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/statm")).ok()?;
    let pages: u64 = text.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * 4096)
}
