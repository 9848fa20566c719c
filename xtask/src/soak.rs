//! Long walks with random motion: memory stays flat, nothing gets stuck, and they end.

use std::fs;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use crate::run::{cargo, root, run as run_command};

/// Frames of a walk.
const FRAMES: u32 = 20_000;
/// Growth that counts as none where all that is kept is soon there (bytes): pages that the allocator holds for
/// several threads, and lists that see a greater length once more.
const FLAT: u64 = 2 << 20;
/// A walk that uses no processor time for so long is stuck.
const STUCK: Duration = Duration::from_secs(60);
/// Time between two looks.
const LOOK: Duration = Duration::from_millis(100);

/// A walk; camera, objects and lights all move at random.
struct Endurance {
    name: &'static str,
    arguments: &'static [&'static str],
    /// Growth of resident memory from one half to the other that counts as none (bytes).
    flat: u64,
}

/// What the walks with global illumination allow its records, which fill up to that (MiB).
const RECORDS: &str = "4";
const RECORD_BYTES: u64 = 4 << 20;

const WALKS: [Endurance; 5] = [
    Endurance {
        name: "chains, direct, live",
        arguments: &["demo:chains", "--live"],
        flat: FLAT,
    },
    Endurance {
        name: "chains, direct, lockstep",
        arguments: &["demo:chains"],
        flat: FLAT,
    },
    Endurance {
        // Points enough for all shadows to be met in the first half, whose edges are kept.
        name: "rooms, direct, live",
        arguments: &["demo:rooms", "--live"],
        flat: FLAT,
    },
    Endurance {
        // Few objects, whose shadows are soon known, and so little memory that it is soon full.
        name: "chains, gi, live",
        arguments: &["demo:chains", "--live", "--shader", "gi", "--gi-memory", RECORDS],
        flat: FLAT,
    },
    Endurance {
        // Records and shadows are still being found in the second half.
        name: "rooms, gi, live",
        arguments: &["demo:rooms", "--live", "--shader", "gi", "--gi-memory", RECORDS],
        flat: FLAT + RECORD_BYTES,
    },
];

/// `cargo xtask soak [FRAMES]`
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let frames: u32 = match args {
        [] => FRAMES,
        [frames] => frames
            .parse()
            .map_err(|_| format!("soak: '{frames}' is not a number of frames"))?,
        _ => return Err("usage: cargo xtask soak [FRAMES]".to_owned()),
    };
    run_command(cargo(&["build", "-q", "--release", "-p", "llsr-cli"]).arg("--locked"))?;
    let grown: Vec<&str> = WALKS
        .iter()
        .map(|walk| Ok(soak(walk, frames)?.then_some(walk.name)))
        .collect::<Result<Vec<_>, String>>()?
        .into_iter()
        .flatten()
        .collect();
    if grown.is_empty() {
        Ok(())
    } else {
        Err(format!(
            "soak: memory grew in the second half: {}",
            grown.join("; ")
        ))
    }
}

/// One walk. Returns whether its memory grew more than it may.
fn soak(walk: &Endurance, frames: u32) -> Result<bool, String> {
    let Endurance {
        name,
        arguments,
        flat,
    } = *walk;
    let mut command = Command::new(root().join("target/release/llsr"));
    // No report: it would hold a line for each frame, and the walk's own memory is the question.
    command
        .arg("walk")
        .args(arguments)
        .args(["--size", "128x96", "--wander", "--every", "1000000", "--frames"])
        .arg(frames.to_string());
    let start = Instant::now();
    let child = command.spawn().map_err(|e| format!("{command:?}: {e}"))?;
    let samples = watch(child).map_err(|error| format!("soak: {name}: {error}"))?;
    let seconds = start.elapsed().as_secs_f64();
    let quarters: Vec<u64> = samples
        .chunks(samples.len().div_ceil(4).max(1))
        .map(|quarter| quarter.iter().copied().max().unwrap_or(0))
        .collect();
    let shown: Vec<String> = quarters
        .iter()
        .map(|&bytes| format!("{:.1}", bytes as f64 / f64::from(1 << 20)))
        .collect();
    println!(
        "{name}: {frames} frames in {seconds:.0} s; most memory in each quarter: {} MiB\n",
        shown.join(", ")
    );
    let half = samples.len() / 2;
    let most = |part: &[u64]| part.iter().copied().max().unwrap_or(0);
    Ok(most(&samples[half..]) > most(&samples[..half]) + flat)
}

/// Waits for the end. Returns resident memory (bytes) in the order of time.
fn watch(mut child: Child) -> Result<Vec<u64>, String> {
    let mut samples = Vec::new();
    let (mut worked, mut since) = (0, Instant::now());
    loop {
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            return if status.success() {
                Ok(samples)
            } else {
                Err(format!("the walk ended with {status}"))
            };
        }
        samples.extend(resident(child.id()));
        match processor_ticks(child.id()) {
            Some(ticks) if ticks == worked => {}
            Some(ticks) => (worked, since) = (ticks, Instant::now()),
            // No such file on this system: the walk is trusted.
            None => since = Instant::now(),
        }
        if since.elapsed() > STUCK {
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("nothing happened for {} s", STUCK.as_secs()));
        }
        std::thread::sleep(LOOK);
    }
}

/// Resident bytes of a process, where the system tells.
fn resident(process: u32) -> Option<u64> {
    let text = fs::read_to_string(format!("/proc/{process}/statm")).ok()?;
    let pages: u64 = text.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * 4096)
}

/// Processor time of a process in the system's ticks.
fn processor_ticks(process: u32) -> Option<u64> {
    let text = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name of the program, in brackets, may hold spaces.
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let user: u64 = fields.get(11)?.parse().ok()?;
    let system: u64 = fields.get(12)?.parse().ok()?;
    Some(user + system)
}
