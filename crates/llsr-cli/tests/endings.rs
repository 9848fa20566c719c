//! However a walk ends, it ends soon, says why, and leaves nothing behind.
#![cfg(unix)]

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::Duration;

use llsr_testkit::program::{Program, parsed};
use serde_json::Value;
use tempfile::TempDir;

const LLSR: Program = Program::new(env!("CARGO_BIN_EXE_llsr"), &[]);

/// Between two looks at a walk, and after how many of them it hangs: far more than anything here takes. Looks are counted, not
/// seconds, for on a busy machine they are farther apart, and while everything is stopped there are none.
const LOOK: Duration = Duration::from_millis(2);
const LOOKS: u32 = 60_000;

/// A camera that stands still, for walks whose shader is away: one that goes on leaves behind all that is known.
const STILL: &str = "0 1.6 4  0 -0.2 -1  0 1 0  60\n";

/// A walk that is under way, killed if the test fails.
struct Walk {
    child: Child,
    folder: PathBuf,
}

impl Drop for Walk {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Walk {
    /// Starts a walk that keeps frames in `kept`.
    fn start(folder: &Path, args: &[&str]) -> Self {
        let child = LLSR
            .command(
                folder,
                &[&["walk"], args, &["--quiet", "--keep-frames", "kept"]].concat(),
            )
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program was built with this test");
        Self {
            child,
            folder: folder.to_owned(),
        }
    }

    /// Waits until `done`.
    fn wait(&mut self, what: &str, mut done: impl FnMut(&Path) -> bool) {
        let mut looks = 0;
        while !done(&self.folder) {
            let over = self.child.try_wait().expect("it is our child");
            assert!(over.is_none(), "{what}: the walk ended with {over:?}");
            assert!(looks < LOOKS, "{what}: not within {LOOKS} looks");
            looks += 1;
            sleep(LOOK);
        }
    }

    fn wait_for_frame(&mut self, frame: u32) {
        self.wait(&format!("frame {frame}"), |folder| {
            frame_file(folder, frame).exists()
        });
    }

    /// Waits for the end; returns how it ended and what it said on standard error.
    fn end(mut self) -> (ExitStatus, String) {
        let mut looks = 0;
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("it is our child") {
                break status;
            }
            let kept = || fs::read_dir(self.folder.join("kept")).map_or(0, Iterator::count);
            assert!(
                looks < LOOKS,
                "no end within {LOOKS} looks; {} pictures kept",
                kept()
            );
            looks += 1;
            sleep(LOOK);
        };
        let mut said = String::new();
        let error = self.child.stderr.as_mut().expect("it is piped");
        error.read_to_string(&mut said).expect("it is text");
        assert!(!said.contains("panicked"), "{said}");
        (status, said)
    }
}

fn frame_file(folder: &Path, frame: u32) -> PathBuf {
    folder.join(format!("kept/frame-{frame:05}.png"))
}

fn signal(name: &str, process: &str) {
    let status = Command::new("kill").args([name, process]).status();
    assert!(
        status.is_ok_and(|status| status.success()),
        "kill {name} {process}"
    );
}

/// A command for `--shader-cmd`: the reference client, which leaves its process number in the file `client` and does as
/// `first` says before it begins.
fn client(first: &str) -> Option<String> {
    let works = |name: &&str| {
        let mut run = Command::new(name);
        run.args(["-c", "import sys; sys.exit(sys.version_info < (3, 6))"]);
        run.stderr(Stdio::null()).status().is_ok_and(|s| s.success())
    };
    let Some(python) = ["python3", "python"].into_iter().find(works) else {
        println!("skipped: there is no Python 3 here");
        return None;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/shader/wall.py");
    Some(format!(
        "sh -c \"{first} echo $$ > client.new; mv client.new client; exec {python} '{}'\"",
        script.display()
    ))
}

fn client_number(folder: &Path) -> Option<String> {
    Some(fs::read_to_string(folder.join("client")).ok()?.trim().to_owned())
}

fn is_running(process: &str) -> bool {
    let mut run = Command::new("kill");
    run.args(["-0", process]).stderr(Stdio::null());
    run.status().is_ok_and(|status| status.success())
}

#[test]
fn signals_end_a_walk_at_the_next_frame() {
    for mode in [&["--live"][..], &[]] {
        for name in ["-INT", "-TERM"] {
            let folder = TempDir::new().expect("a folder");
            let long = [
                "--size", "64x48", "--frames", "100000", "--every", "5", "--wander",
            ];
            let args = [&long[..], &["--report", "r.json"], mode].concat();
            let mut walk = Walk::start(folder.path(), &args);
            walk.wait_for_frame(9);
            signal(name, &walk.child.id().to_string());
            let (status, said) = walk.end();
            assert_eq!(status.code(), Some(1), "{mode:?} {name}: {said}");
            assert!(said.contains("interrupted"), "{mode:?} {name}: {said}");
            assert!(!folder.path().join("r.json").exists(), "no half a report");
        }
    }
}

#[test]
fn a_program_that_shades_goes_with_the_walk() {
    for name in ["-INT", "-TERM"] {
        let folder = TempDir::new().expect("a folder");
        let Some(client) = client("") else { return };
        let long = [
            "demo:wall",
            "--size",
            "32x24",
            "--frames",
            "100000",
            "--every",
            "5",
        ];
        let args = [&long[..], &["--live", "--shader-cmd", &client]].concat();
        let mut walk = Walk::start(folder.path(), &args);
        walk.wait_for_frame(9);
        let process = client_number(folder.path()).expect("it has begun");
        signal(name, &walk.child.id().to_string());
        let (status, said) = walk.end();
        assert_eq!(status.code(), Some(1), "{name}: {said}");
        assert!(said.contains("interrupted"), "{name}: {said}");
        assert!(!is_running(&process), "{name}: the shader still runs");
    }
}

#[test]
fn a_program_that_is_silent_does_not_hold_up_the_end() {
    // Without a greeting, and with one but no answer.
    for first in ["", "echo llsr-shader 1 silent;"] {
        for mode in [&["--live"][..], &[]] {
            let folder = TempDir::new().expect("a folder");
            let silent =
                format!("sh -c \"{first} echo $$ > client.new; mv client.new client; exec sleep 1000\"");
            let long = ["demo:wall", "--size", "32x24", "--frames", "100000"];
            let args = [&long[..], mode, &["--shader-cmd", &silent]].concat();
            let mut walk = Walk::start(folder.path(), &args);
            walk.wait("the program begins", |folder| folder.join("client").exists());
            let process = client_number(folder.path()).expect("it has begun");
            signal("-INT", &walk.child.id().to_string());
            let (status, said) = walk.end();
            assert_eq!(status.code(), Some(1), "{first} {mode:?}: {said}");
            assert!(said.contains("interrupted"), "{first} {mode:?}: {said}");
            assert!(!is_running(&process), "{first} {mode:?}: the program still runs");
        }
    }
}

#[test]
fn a_walk_without_a_single_sample_has_failed() {
    let folder = TempDir::new().expect("a folder");
    let echo = [
        "demo:wall",
        "--size",
        "32x24",
        "--frames",
        "5",
        "--shader-cmd",
        "cat",
    ];
    let (status, said) = Walk::start(folder.path(), &echo).end();
    assert_eq!(status.code(), Some(1), "{said}");
    assert!(
        said.contains("no sample at all") && said.contains("makes no sense"),
        "what happened: {said}"
    );
}

#[test]
fn a_shader_killed_in_mid_walk_is_told_and_counted_and_comes_back() {
    for (mode, frames) in [(&["--live"][..], "20000"), (&[], "600")] {
        let folder = TempDir::new().expect("a folder");
        let Some(client) = client("") else { return };
        let long = [
            "demo:wall",
            "--size",
            "48x32",
            "--frames",
            frames,
            "--every",
            "10",
            "--path",
            "still.txt",
        ];
        fs::write(folder.path().join("still.txt"), STILL).expect("a file");
        let args = [&long[..], &["--shader-cmd", &client, "--report", "r.json"], mode].concat();
        let mut walk = Walk::start(folder.path(), &args);
        walk.wait_for_frame(19);
        let first = client_number(folder.path()).expect("it has begun");
        signal("-KILL", &first);
        let other = |folder: &Path| client_number(folder).is_some_and(|number| number != first);
        walk.wait("it is started again", other);
        // Frames drawn by then, rounded down to those that were kept.
        let drawn = 10
            * (0..)
                .take_while(|i| frame_file(folder.path(), 10 * i + 9).exists())
                .count();
        let (status, said) = walk.end();
        assert_eq!(status.code(), Some(0), "{mode:?}: {said}");
        assert!(said.contains("the shader lost"), "{mode:?}: {said}");
        let report = parsed::<Value>(&folder.path().join("r.json"));
        assert!(report["shader_errors"].as_u64() > Some(0), "{mode:?}: counted");
        let last = report["frames"].as_array().expect("frames");
        // A live walk draws from the start, also while the program is still on its way.
        let mut whole = last.iter().skip_while(|line| line["holes"] != 0).peekable();
        assert!(whole.peek().is_some(), "{mode:?}: a whole picture");
        assert!(
            whole.all(|line| line["holes"] == 0),
            "{mode:?}: the picture stays"
        );
        let new = |line: &Value| line["new_samples"].as_u64() > Some(0);
        assert!(last[drawn..].iter().any(new), "{mode:?}: it shades again");
    }
}

#[test]
fn the_picture_outlives_a_shader_that_is_given_up() {
    let folder = TempDir::new().expect("a folder");
    // Comes once and never again.
    let Some(client) = client("test -e client && exit 3;") else {
        return;
    };
    fs::write(folder.path().join("still.txt"), STILL).expect("a file");
    let long = ["demo:wall", "--size", "48x32", "--frames", "400", "--every", "10"];
    let more = [
        "--path",
        "still.txt",
        "--shader-cmd",
        &client,
        "--report",
        "r.json",
    ];
    let args = [&long[..], &more].concat();
    let mut walk = Walk::start(folder.path(), &args);
    walk.wait_for_frame(19);
    signal("-KILL", &client_number(folder.path()).expect("it has begun"));
    let (status, said) = walk.end();
    assert_eq!(status.code(), Some(0), "{said}");
    assert!(said.contains("given up"), "{said}");
    let report = parsed::<Value>(&folder.path().join("r.json"));
    let frames = report["frames"].as_array().expect("frames");
    assert_eq!(frames.len(), 400, "the walk went on to its end");
    let last = &frames[399];
    assert_eq!(last["new_samples"], 0, "nobody shades any more");
    assert!(last["points"]["shown"].as_u64() > Some(0), "what is known stays");
    assert_eq!(report["summary"]["holes"], 0, "no frame has holes");
}

#[test]
fn a_frame_that_cannot_be_written_ends_the_walk() {
    for mode in [&["--live"][..], &[]] {
        let folder = TempDir::new().expect("a folder");
        fs::create_dir_all(folder.path().join("kept/frame-00009.png/full")).expect("a folder");
        let long = [
            "--size", "64x48", "--frames", "100000", "--every", "5", "--wander",
        ];
        let (status, said) = Walk::start(folder.path(), &[&long[..], mode].concat()).end();
        assert_eq!(status.code(), Some(1), "{mode:?}: {said}");
        assert!(said.contains("frame-00009.png"), "{mode:?}: {said}");
    }
}

#[test]
fn a_reader_that_has_gone_does_no_harm() {
    let folder = TempDir::new().expect("a folder");
    for args in [
        &["info", "demo:rooms"][..],
        &["demo"],
        &["walk", "--size", "64x48", "--frames", "3", "--report", "r.json"],
    ] {
        let mut child = LLSR
            .command(folder.path(), args)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program was built with this test");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{args:?}: {said}");
        assert!(said.is_empty(), "{args:?}: {said}");
    }
    assert!(
        folder.path().join("r.json").exists(),
        "files are written all the same"
    );
}
