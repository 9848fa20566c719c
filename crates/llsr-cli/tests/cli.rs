//! The program as a user meets it: exit codes, files, reports and messages.

use std::fs;

use llsr_testkit::program::{Ended, Program, parsed};
use serde_json::Value;
use tempfile::TempDir;

const LLSR: Program = Program::new(env!("CARGO_BIN_EXE_llsr"), &[]);

#[test]
fn without_a_command_the_subway_is_rendered_and_the_newcomer_told_what_is_next() {
    let folder = TempDir::new().expect("a folder");
    let said = LLSR.ok(folder.path(), &[]);
    assert!(
        said.contains("demo:subway") && said.contains("Try next"),
        "{said}"
    );
    let png = fs::read(folder.path().join("llsr.png")).expect("the picture");
    assert!(
        png.starts_with(b"\x89PNG") && png.len() > 20_000,
        "{} bytes",
        png.len()
    );
}

#[test]
fn a_picture_does_not_depend_on_the_number_of_threads() {
    let folder = TempDir::new().expect("a folder");
    let mut files = Vec::new();
    for method in ["auto", "tdf", "hpd"] {
        for threads in ["1", "2", "3"] {
            let name = format!("{method}-{threads}.exr");
            let aov = "irradiance:*,tests,discontinuities,certificate,albedo,normal,depth";
            let args = [
                "render",
                "demo:subway",
                "--size",
                "150x90",
                "--seed",
                "5",
                "-m",
                method,
                "--aov",
                aov,
            ];
            LLSR.ok(
                folder.path(),
                &[&args[..], &["-o", &name, "--threads", threads]].concat(),
            );
            files.push(fs::read(folder.path().join(name)).expect("the picture"));
        }
        assert!(
            files.windows(2).all(|pair| pair[0] == pair[1]),
            "{method}: the files differ"
        );
        files.clear();
    }
}

#[test]
fn the_seed_matters_to_a_random_method() {
    let folder = TempDir::new().expect("a folder");
    let render = |seed: &str| {
        let args = [
            "render",
            "demo:wall",
            "--size",
            "64x64",
            "-m",
            "rsb",
            "-o",
            "a.exr",
            "--seed",
            seed,
        ];
        LLSR.ok(folder.path(), &args);
        fs::read(folder.path().join("a.exr")).expect("the picture")
    };
    assert_ne!(render("1"), render("2"), "two seeds give two pictures");
}

#[test]
fn a_report_has_the_stated_keys_and_adds_up() {
    let folder = TempDir::new().expect("a folder");
    let args = [
        "render",
        "demo:cylinder-2",
        "--size",
        "80x60",
        "-m",
        "tdf",
        "-o",
        "a.png",
        "--report",
        "r.json",
    ];
    LLSR.ok(folder.path(), &args);
    let report = parsed::<Value>(&folder.path().join("r.json"));
    for key in [
        "triangles",
        "lights",
        "size",
        "method",
        "epsilon",
        "nu",
        "seconds",
        "cpu_seconds",
        "rays",
    ] {
        assert!(!report[key].is_null(), "{key} is missing");
    }
    for part in ["load", "build", "render"] {
        assert!(
            report["seconds"][part].is_f64() && report["cpu_seconds"][part].is_f64(),
            "{part}"
        );
    }
    let share = |name: &str| report["share"][name].as_f64().expect("a share");
    assert!(
        (share("lit") + share("penumbra") + share("umbra") - 1.0).abs() < 1e-12,
        "shares add up"
    );
    assert!(share("penumbra") > 0.02, "a cylinder casts a penumbra");
    let (all, inner) = (
        &report["tests_per_pixel_light"],
        &report["tests_per_pixel_light_inner"],
    );
    assert!(
        all.as_f64() > inner.as_f64() && inner.as_f64() > Some(0.0),
        "end tests are apart"
    );
    let histogram = report["discontinuity_histogram"].as_array().expect("a list");
    let pairs: u64 = histogram.iter().filter_map(Value::as_u64).sum();
    assert_eq!(
        Some(pairs),
        report["hits"].as_u64(),
        "one light: a pair for each hit pixel"
    );
    assert_eq!(report["rays"]["primary"], 80 * 60, "one ray a pixel");
    assert!(
        report["skipped"].is_object() && report["warnings"].is_array(),
        "lists that may be empty"
    );
}

#[test]
fn equal_pictures_differ_by_nothing_and_a_heat_map_is_written() {
    let folder = TempDir::new().expect("a folder");
    for (name, method) in [("a.exr", "rsb"), ("b.exr", "hpd")] {
        LLSR.ok(
            folder.path(),
            &["render", "demo:wall", "--size", "48x48", "-m", method, "-o", name],
        );
    }
    LLSR.ok(
        folder.path(),
        &["diff", "a.exr", "a.exr", "--report", "same.json", "--quiet"],
    );
    let same = parsed::<Value>(&folder.path().join("same.json"));
    for key in ["rmse", "rel_rmse", "max", "flip"] {
        assert_eq!(same[key], 0.0, "{key}");
    }
    LLSR.ok(
        folder.path(),
        &[
            "diff",
            "a.exr",
            "b.exr",
            "-o",
            "heat.png",
            "--report",
            "other.json",
        ],
    );
    let other = parsed::<Value>(&folder.path().join("other.json"));
    assert!(
        other["rel_rmse"].as_f64() > Some(0.001) && other["psnr"].as_f64() > Some(10.0),
        "{other}"
    );
    assert!(
        fs::read(folder.path().join("heat.png")).is_ok_and(|b| b.starts_with(b"\x89PNG")),
        "a map"
    );
}

#[test]
fn wrong_command_lines_exit_with_two_and_say_what_is_wrong() {
    let folder = TempDir::new().expect("a folder");
    let cases: &[(&[&str], &str)] = &[
        (&["render", "--method", "psychic"], "stratified"),
        (&["render", "--size", "0x5"], "32768"),
        (&["render", "--size", "32768x32768"], "2^28"),
        (&["render", "--epsilon", "0"], "above 0"),
        (&["render", "--threads", "0"], "--threads"),
        (&["render", "-o", "picture.bmp"], ".png or .exr"),
        (&["render", "-o", "a.png", "--aov", "depth"], "no layers"),
        (&["render", "-o", "a.exr", "--aov", "colour"], "irradiance"),
        (&["render", "demo:nowhere"], "subway"),
        (&["render", "--camera", "sideways"], "default"),
        (&["render", "--look-from", "1,2"], "three numbers"),
        (
            &["render", "--look-from", "1,1,1", "--look-at", "1,1,1"],
            "same point",
        ),
        (&["render", "--fov", "180"], "180"),
        (&["render", "--line-light", "0,0,0:1,1,1=5"], "unit"),
        (&["render", "--line-light", "0,0,0:1,1,1=5W"], "lm"),
        (&["render", "--tube", "Steel=5lm"], "--line-light"),
        (&["demo", "nowhere"], "subway"),
        (&["frobnicate"], "frobnicate"),
    ];
    for (args, wanted) in cases {
        let message = LLSR.fails(folder.path(), args, 2);
        assert!(message.contains(wanted), "{args:?}: {message}");
    }
    let left: Vec<_> = fs::read_dir(folder.path()).expect("a folder").collect();
    assert!(left.is_empty(), "nothing was written: {left:?}");
}

#[test]
fn work_that_fails_exits_with_one_and_leaves_nothing_behind() {
    let folder = TempDir::new().expect("a folder");
    let dark = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    fs::write(folder.path().join("dark.obj"), dark).expect("a file");
    let message = LLSR.fails(folder.path(), &["render", "dark.obj"], 1);
    assert!(
        message.contains("no light") && message.contains("--line-light"),
        "{message}"
    );
    assert!(
        LLSR.fails(folder.path(), &["render", "missing.glb"], 1)
            .contains("missing.glb"),
        "the file is named"
    );
    let message = LLSR.fails(
        folder.path(),
        &["render", "--size", "8x8", "-o", "no/such/folder/a.png"],
        1,
    );
    assert!(message.contains("no/such/folder"), "{message}");
    assert_eq!(
        fs::read_dir(folder.path()).expect("a folder").count(),
        1,
        "only the scene is there"
    );
}

#[test]
fn a_light_from_the_command_line_lights_a_file() {
    let folder = TempDir::new().expect("a folder");
    let floor = "v -2 0 -2\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nf 1 2 3 4\n";
    fs::write(folder.path().join("floor.obj"), floor).expect("a file");
    let light = "-1,2,0:1,2,0=3000lm";
    let args = [
        "render",
        "floor.obj",
        "--line-light",
        light,
        "-o",
        "a.exr",
        "--size",
        "33x33",
        "--aov",
        "irradiance",
    ];
    LLSR.ok(
        folder.path(),
        &[
            &args[..],
            &[
                "--look-from",
                "0,5,0.01",
                "--look-at",
                "0,0,0",
                "--report",
                "r.json",
            ],
        ]
        .concat(),
    );
    let report = parsed::<Value>(&folder.path().join("r.json"));
    assert_eq!(report["share"]["lit"], 1.0, "nothing is in the way");
    // Below the middle, from the stated law: E = integral of Phi / (pi^2 L) sin(phi) cos(theta) / r^2 dl.
    let (flux, length, height, steps) = (3000.0, 2.0, 2.0f64, 20_000);
    let pi = std::f64::consts::PI;
    let expected: f64 = (0..steps)
        .map(|i| {
            let x = -1.0 + length * (f64::from(i) + 0.5) / f64::from(steps);
            let r = height.hypot(x);
            flux / (pi * pi * length) * (height / r) * (height / r) / (r * r) * length / f64::from(steps)
        })
        .sum();
    let image = llsr_io::read_image(&folder.path().join("a.exr")).expect("the picture");
    let irradiance = image.channel("irradiance.Y").expect("the layer");
    let seen = f64::from(irradiance[16 * 33 + 16]);
    assert!(
        (seen / expected - 1.0).abs() < 1e-4,
        "{seen} lux, expected {expected}"
    );
}

#[test]
fn info_lists_what_was_read() {
    let folder = TempDir::new().expect("a folder");
    let said = LLSR.ok(folder.path(), &["info", "demo:subway", "--report", "info.json"]);
    for wanted in ["tube far", "tube near", "camera", "metres", "lux", "seat"] {
        assert!(said.contains(wanted), "{wanted}: {said}");
    }
    let report = parsed::<Value>(&folder.path().join("info.json"));
    assert_eq!(report["lights"], 2, "two tubes");
}

#[test]
fn every_demo_is_listed_and_survives_a_trip_through_gltf() {
    let folder = TempDir::new().expect("a folder");
    let listed = LLSR.ok(folder.path(), &["demo"]);
    for demo in llsr_scene::demo::DEMOS
        .iter()
        .filter(|demo| demo.build().triangle_count() < 5000)
    {
        assert!(listed.contains(demo.name), "{}: {listed}", demo.name);
        LLSR.ok(folder.path(), &["demo", demo.name, "-o", "demo.gltf"]);
        let name = format!("demo:{}", demo.name);
        for (scene, out) in [(name.as_str(), "direct.exr"), ("demo.gltf", "file.exr")] {
            LLSR.ok(
                folder.path(),
                &["render", scene, "--size", "64x64", "-o", out, "--quiet"],
            );
        }
        LLSR.ok(
            folder.path(),
            &["diff", "file.exr", "direct.exr", "--report", "d.json", "--quiet"],
        );
        let difference = parsed::<Value>(&folder.path().join("d.json"))["rel_rmse"]
            .as_f64()
            .expect("a number");
        // The file stores single precision: a few pixels may see an edge from the other side.
        assert!(difference < 0.02, "{}: {difference}", demo.name);
    }
}

#[test]
fn quiet_says_nothing() {
    let folder = TempDir::new().expect("a folder");
    let ended = LLSR.run(
        folder.path(),
        &["render", "demo:wall", "--size", "16x16", "-q", "-o", "a.png"],
    );
    let silent = Ended {
        code: Some(0),
        out: String::new(),
        err: String::new(),
    };
    assert_eq!(ended, silent, "quiet");
}
