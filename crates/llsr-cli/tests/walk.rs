//! `llsr walk` as a user meets it.

use std::fs;

use llsr_testkit::program::{Program, parsed};
use serde_json::Value;
use tempfile::TempDir;

const LLSR: Program = Program::new(env!("CARGO_BIN_EXE_llsr"), &[]);

const SMALL: [&str; 6] = ["walk", "--size", "96x72", "--frames", "6", "--quiet"];

fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SMALL[..], more].concat()
}

#[test]
fn a_report_has_the_promised_keys() {
    let folder = TempDir::new().expect("a folder");
    let args = small(&[
        "--report",
        "r.json",
        "--compare",
        "raytrace",
        "--reference",
        "--keep-frames",
        "kept",
        "--every",
        "4",
    ]);
    LLSR.ok(folder.path(), &args);
    let report = parsed::<Value>(&folder.path().join("r.json"));
    let frames = report["frames"].as_array().expect("frames");
    assert_eq!(frames.len(), 6, "one entry a frame");
    for (number, frame) in frames.iter().enumerate() {
        let stages = [
            "edges",
            "rasterize",
            "points",
            "reach",
            "interpolate",
            "antialias",
            "complex",
        ];
        let sum: f64 = stages.iter().map(|s| frame["ms"][s].as_f64().expect(s)).sum();
        let total = frame["ms"]["total"].as_f64().expect("total");
        assert!(sum > 0.0 && sum <= total, "frame {number}: {sum} of {total} ms");
        let pixels: u64 = ["empty", "simple", "complex"]
            .iter()
            .map(|class| frame["pixels"][class].as_u64().expect(class))
            .sum();
        assert_eq!(pixels, 96 * 72, "every pixel has a class");
        assert!(frame["edges"]["silhouette"].as_u64() > Some(0), "{frame}");
        assert!(frame["edges"]["shadow"].is_u64(), "{frame}");
        assert_eq!(frame["holes"], 0, "frame {number}");
        // One pixel in a hundred, but for the first and for points that look away.
        let new = frame["new_samples"].as_u64().expect("new samples");
        let expected = if number == 0 { 432 } else { 69 };
        assert!(
            new <= expected && new + 8 >= expected,
            "frame {number}: {new} new samples"
        );
        assert_eq!(
            frame["error"].is_object(),
            number == 3 || number == 5,
            "frame {number}"
        );
    }
    let error = &frames[5]["error"];
    for measure in [
        &error["flip"],
        &error["raytrace"]["flip"],
        &error["blind"]["flip"],
    ] {
        let flip = measure.as_f64().expect("FLIP");
        assert!(flip > 0.0 && flip < 1.0, "{error}");
    }
    let summary = &report["summary"];
    for key in ["fps", "sparseness", "raytrace_seconds", "speedup"] {
        assert!(summary[key].as_f64().expect(key) > 0.0, "{key}: {summary}");
    }
    assert!(summary["median_ms"]["total"].as_f64() > Some(0.0), "{summary}");
    for name in ["frame", "edges", "reference", "raytrace", "blind"] {
        for number in ["00003", "00005"] {
            let file = folder.path().join(format!("kept/{name}-{number}.png"));
            let bytes = fs::read(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
            assert!(bytes.starts_with(b"\x89PNG"), "{}", file.display());
        }
    }
    assert_eq!(
        fs::read_dir(folder.path().join("kept")).expect("kept").count(),
        10,
        "nothing else"
    );
}

#[test]
fn lockstep_has_the_same_bits_for_one_thread_and_two() {
    let folder = TempDir::new().expect("a folder");
    let hash = |threads: &str, shader: &str, seed: &str| {
        let args = small(&[
            "--report",
            "r.json",
            "--threads",
            threads,
            "--shader",
            shader,
            "--seed",
            seed,
            "--add-grid",
            "--move",
        ]);
        LLSR.ok(folder.path(), &args);
        parsed::<Value>(&folder.path().join("r.json"))["summary"]["last_frame_hash"].clone()
    };
    for shader in ["direct", "glossy", "gi"] {
        let first = hash("1", shader, "3");
        assert!(first.is_string(), "{first}");
        assert_eq!(first, hash("2", shader, "3"), "{shader}");
        assert_eq!(first, hash("2", shader, "3"), "{shader}, again");
    }
    assert_ne!(
        hash("2", "direct", "3"),
        hash("2", "direct", "4"),
        "the seed matters"
    );
}

#[test]
fn live_walks_end_and_report() {
    let folder = TempDir::new().expect("a folder");
    LLSR.ok(
        folder.path(),
        &small(&["--live", "--report", "r.json", "--add-grid", "--move"]),
    );
    let report = parsed::<Value>(&folder.path().join("r.json"));
    assert!(report["live"]["shaded"].as_u64() > Some(0), "{}", report["live"]);
    assert_eq!(report["summary"]["holes"], 0, "no holes");
}

/// Frames drawn beside the shader have the same bits every time too, those of answers that come a frame later.
#[test]
fn overlapping_walks_do_not_depend_on_threads() {
    let folder = TempDir::new().expect("a folder");
    let hash = |more: &[&str]| {
        let report = ["--overlap", "--move", "--add-grid", "--report", "r.json"];
        LLSR.ok(folder.path(), &small(&[&report, more].concat()));
        let report = parsed::<Value>(&folder.path().join("r.json"));
        for frame in report["frames"].as_array().expect("frames") {
            let [all, drawn] = ["seconds", "draw_seconds"].map(|key| frame[key].as_f64());
            assert!(drawn > Some(0.0) && all >= drawn, "{frame}");
        }
        report["summary"]["last_frame_hash"].clone()
    };
    let gi = ["--shader", "gi", "--gi-memory", "1"];
    for shader in [&[][..], &gi] {
        let [one, two] = ["1", "2"].map(|threads| hash(&[shader, &["--threads", threads]].concat()));
        assert_eq!(one, two, "{shader:?}");
    }
}

#[test]
fn a_path_is_followed() {
    let folder = TempDir::new().expect("a folder");
    let line = |x: f64| format!("{x} 1.6 0  0 0 -1  0 1 0  60\n");
    fs::write(
        folder.path().join("p.txt"),
        format!("# llsr camera path 1\n{}{}", line(0.0), line(0.1)),
    )
    .expect("a file");
    let args = [
        "walk", "--size", "64x48", "--path", "p.txt", "--report", "r.json", "--quiet",
    ];
    LLSR.ok(folder.path(), &args);
    assert_eq!(
        parsed::<Value>(&folder.path().join("r.json"))["frames"]
            .as_array()
            .map(Vec::len),
        Some(2),
        "two cameras"
    );
    fs::write(folder.path().join("p.txt"), "0 0 0  0 0 -1\n").expect("a file");
    let said = LLSR.fails(folder.path(), &args, 1);
    assert!(
        said.contains("p.txt") && said.contains("line 1") && said.contains("6 numbers"),
        "{said}"
    );
}

#[test]
fn mistakes_are_named() {
    let folder = TempDir::new().expect("a folder");
    for (args, code, problem) in [
        (vec!["--move"], 2, "--add-grid"),
        (vec!["--move=nothing"], 2, "no such object"),
        (vec!["--path", "missing.txt"], 1, "missing.txt"),
        (
            vec!["--look-from", "0,1e300,0"],
            2,
            "--look-from: more than 1e15 m",
        ),
        (vec!["--look-at", "0,1e300,0"], 2, "--look-at: more than 1e15 m"),
        (vec!["--samples-per-frame", "0"], 2, "--samples-per-frame"),
        (vec!["--gi-memory", "0"], 2, "--gi-memory"),
        (vec!["--overlap", "--live"], 2, "--live"),
        (vec!["--shader", "radiosity"], 2, "direct, glossy, gi"),
        (
            vec!["--shader-cmd", "no-such-program-anywhere"],
            1,
            "no-such-program-anywhere",
        ),
        (vec!["demo:nowhere"], 2, "demo:nowhere"),
    ] {
        let said = LLSR.fails(folder.path(), &small(&args), code);
        let found = said.contains(problem) || problem.strip_prefix("demo:").is_some_and(|p| said.contains(p));
        assert!(found, "{args:?}: {said}");
    }
    fs::write(folder.path().join("file"), "").expect("a file");
    let said = LLSR.fails(folder.path(), &small(&["--keep-frames", "file"]), 1);
    assert!(said.contains("--keep-frames") && said.contains("file"), "{said}");
}

/// What cannot be written is said before any work, which leaves pictures otherwise.
#[test]
fn files_that_cannot_be_written_are_named_before_the_walk() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("file"), "old").expect("a file");
    for report in ["nowhere/r.json", ".", "file/r.json"] {
        let args = small(&["--keep-frames", "kept", "--report", report]);
        let said = LLSR.fails(folder.path(), &args, 1);
        assert!(said.contains("--report") && said.contains(report), "{said}");
    }
    let names = || -> Vec<_> {
        let entries = fs::read_dir(folder.path()).expect("a folder");
        entries
            .map(|entry| entry.expect("an entry").file_name())
            .collect()
    };
    assert_eq!(names(), ["file"], "no frame was made");
    LLSR.fails(
        folder.path(),
        &small(&["--keep-frames", "kept", "--report", "file", "--path", "missing"]),
        1,
    );
    assert_eq!(
        fs::read_to_string(folder.path().join("file")).expect("there"),
        "old",
        "a walk that fails later leaves the report of before"
    );
    assert_eq!(names(), ["file"]);
}
