//! `llsr render --reconstruct` as a user meets it.

use std::fs;
use std::path::Path;

use llsr_testkit::program::{Program, parsed};
use serde_json::Value;
use tempfile::TempDir;

const LLSR: Program = Program::new(env!("CARGO_BIN_EXE_llsr"), &[]);

/// The subway in a size, and what else is asked for.
fn subway<'a>(size: &'a str, args: &[&'a str]) -> Vec<&'a str> {
    [&["render", "demo:subway", "--quiet", "--size", size], args].concat()
}

fn ok(folder: &Path, args: &[&str]) {
    LLSR.ok(folder, &subway("128x96", args));
}

/// Sum of the pixels shaded in all rounds.
fn shaded(report: &Value) -> u64 {
    let rounds = report["reconstruct"]["shaded"].as_array().expect("a list");
    rounds.iter().map(|round| round.as_u64().expect("a count")).sum()
}

#[test]
fn density_and_rounds_say_how_many_pixels_are_shaded_and_how_often_it_is_looked() {
    let folder = TempDir::new().expect("a folder");
    let pixels = 128 * 96;
    let mut counts = Vec::new();
    for (density, rounds) in [("0.05", "3"), ("0.2", "3"), ("0.2", "1")] {
        let args = ["--reconstruct", "epi", "--density", density, "--rounds", rounds];
        ok(
            folder.path(),
            &[&args[..], &["-o", "a.exr", "--report", "r.json"]].concat(),
        );
        let report = parsed::<Value>(&folder.path().join("r.json"));
        let made = report["reconstruct"]["shaded"].as_array().expect("a list").len();
        assert_eq!(made.to_string(), rounds, "rounds");
        // Small regions without a sample get one on top.
        let wanted = (density.parse::<f64>().expect("a number") * f64::from(pixels)) as u64;
        let count = shaded(&report);
        let missed = report["reconstruct"]["regions_missed"].as_u64().expect("a count");
        assert!(
            count >= wanted * 4 / 5 && count <= wanted * 6 / 5 + missed,
            "density {density}, {rounds} rounds: {count} of {wanted}, {missed} regions missed"
        );
        counts.push(count);
    }
    assert!(counts[1] > 2 * counts[0], "four times the density: {counts:?}");
}

#[test]
fn a_png_has_pictures_of_edges_reach_and_samples_beside_it() {
    let folder = TempDir::new().expect("a folder");
    let args = ["--reconstruct", "epi", "--aov", "edges,reach,samples"];
    ok(
        folder.path(),
        &[&args[..], &["-o", "a.png", "--report", "r.json"]].concat(),
    );
    let colours = |name: &str| {
        let image = llsr_io::read_image(&folder.path().join(name)).expect("a picture");
        image.rgb().expect("colours")
    };
    let report = parsed::<Value>(&folder.path().join("r.json"));
    let counted = |of: &str| report["reconstruct"]["pixels"][of].as_u64().expect("a count") as usize;
    let edges = colours("a-edges.png");
    let purple = edges.iter().filter(|c| c.x > 0.0 && c.y == 0.0 && c.z > c.x);
    assert_eq!(purple.count(), counted("simple"));
    let green = edges.iter().filter(|c| c.x == 0.0 && c.y > 0.0 && c.z == 0.0);
    assert_eq!(green.count(), counted("complex"));
    let free = colours("a-reach.png")
        .iter()
        .filter(|c| c.min_element() > 0.999)
        .count();
    assert!(
        free > counted("empty") / 2 && free < 128 * 96,
        "{free} pixels reach all around"
    );
    let lit = colours("a-samples.png").iter().filter(|c| c.x > 0.9).count() as u64;
    assert_eq!(
        lit,
        shaded(&report),
        "white, yellow and red pixels were shaded in a round"
    );
}

#[test]
fn layers_show_edges_reach_and_samples() {
    let folder = TempDir::new().expect("a folder");
    let aov = "edges,reach,samples,irradiance,albedo,normal,depth";
    let args = [
        "--reconstruct",
        "epi",
        "--density",
        "0.1",
        "--aov",
        aov,
        "-o",
        "a.exr",
    ];
    ok(folder.path(), &[&args[..], &["--report", "r.json"]].concat());
    let image = llsr_io::read_image(&folder.path().join("a.exr")).expect("the picture");
    let channel = |name: &str| {
        let found = image.channels.iter().find(|channel| channel.0 == name);
        &found.unwrap_or_else(|| panic!("no channel {name}")).1
    };
    let report = parsed::<Value>(&folder.path().join("r.json"));
    let pixels = &report["reconstruct"]["pixels"];
    let edges = channel("edges.Y");
    for (name, value) in [("empty", 0.0), ("simple", 0.5), ("complex", 1.0)] {
        let count = edges.iter().filter(|&&edge| edge == value).count() as u64;
        assert_eq!(
            Some(count),
            pixels[name].as_u64(),
            "{name} pixels in the layer and the report"
        );
        assert!(count > 0, "the subway has {name} pixels");
    }
    let samples = channel("samples.Y");
    let rounds = samples.iter().filter(|&&round| round > 0.0).count() as u64;
    assert_eq!(rounds, shaded(&report), "pixels shaded in some round");
    assert!(samples.iter().all(|&round| round <= 3.0), "at most three rounds");
    let reach = channel("reach.Y");
    let whole = ((1u32 << 24) - 1) as f32;
    for (index, (&edge, &mask)) in edges.iter().zip(reach).enumerate() {
        assert!(
            (0.0..=whole).contains(&mask) && mask.fract() == 0.0,
            "24 bits at {index}: {mask}"
        );
        assert!(
            edge < 1.0 || mask == 0.0,
            "a complex pixel reaches nothing: {mask}"
        );
    }
    let open = reach.iter().filter(|&&mask| mask == whole).count();
    let cut = reach.iter().filter(|&&mask| mask > 0.0 && mask < whole).count();
    assert!(
        open > edges.len() / 4 && cut > edges.len() / 50,
        "{open} pixels reach all around them, {cut} some"
    );
    for name in ["R", "irradiance.Y", "albedo.G", "normal.Z", "depth.Z"] {
        assert!(channel(name).iter().any(|&v| v != 0.0), "{name} holds something");
    }
}

#[test]
fn the_bits_are_the_same_for_any_number_of_threads() {
    let folder = TempDir::new().expect("a folder");
    let args = [
        "--reconstruct",
        "epi",
        "--density",
        "0.1",
        "--seed",
        "9",
        "--aov",
        "edges,reach,samples",
    ];
    let files: Vec<Vec<u8>> = ["1", "2", "3"]
        .into_iter()
        .map(|threads| {
            ok(
                folder.path(),
                &[&args[..], &["-o", "a.exr", "--threads", threads]].concat(),
            );
            fs::read(folder.path().join("a.exr")).expect("the picture")
        })
        .collect();
    assert!(files[0].len() > 10_000, "{} bytes", files[0].len());
    assert!(
        files.iter().all(|file| *file == files[0]),
        "one, two and three threads"
    );
    ok(
        folder.path(),
        &[&args[..5], &["10", "-o", "b.exr"], &args[6..]].concat(),
    );
    let other = fs::read(folder.path().join("b.exr")).expect("the picture");
    assert!(other != files[0], "another seed shades other pixels");
}

#[test]
fn few_samples_with_edges_are_nearer_to_the_full_picture_than_without() {
    let folder = TempDir::new().expect("a folder");
    // Each subsample with light of its own: shadows may end inside a pixel.
    ok(
        folder.path(),
        &["--spp", "32", "--no-skip", "share", "-o", "full.exr"],
    );
    let [[psnr, flip], [blind_psnr, blind_flip]] = ["epi", "blind"].map(|how| {
        ok(
            folder.path(),
            &["--reconstruct", how, "--density", "0.2", "-o", "few.exr"],
        );
        let args = ["diff", "few.exr", "full.exr", "--quiet", "--report", "d.json"];
        LLSR.ok(folder.path(), &args);
        let report = parsed::<Value>(&folder.path().join("d.json"));
        ["psnr", "flip"].map(|name| report[name].as_f64().expect("a number"))
    });
    assert!(
        psnr > 29.0 && psnr > blind_psnr,
        "PSNR {psnr} against {blind_psnr}"
    );
    assert!(flip < 0.85 * blind_flip, "FLIP {flip} against {blind_flip}");
}

#[test]
fn wrong_values_are_refused_with_a_reason() {
    let folder = TempDir::new().expect("a folder");
    let refused = |size: &str, args: &[&str], reason: &str| {
        let message = LLSR.fails(folder.path(), &subway(size, args), 2);
        assert!(message.contains(reason), "{args:?}: {message}");
        assert_eq!(
            fs::read_dir(folder.path()).expect("a folder").count(),
            0,
            "{args:?} leaves no file"
        );
    };
    refused("16385x2", &["--reconstruct", "epi"], "16384");
    for (args, reason) in [
        (
            &["--reconstruct", "epi", "--density", "0"][..],
            "share of the pixels",
        ),
        (
            &["--reconstruct", "epi", "--density", "1.5"],
            "share of the pixels",
        ),
        (&["--reconstruct", "epi", "--density", "-0.1"], "--density"),
        (
            &["--reconstruct", "epi", "--density", "nan"],
            "share of the pixels",
        ),
        (&["--reconstruct", "epi", "--rounds", "0"], "1..=64"),
        (&["--reconstruct", "epi", "--rounds", "65"], "1..=64"),
        (&["--reconstruct", "mesh"], "epi"),
        (&["--density", "0.1"], "--reconstruct"),
        (&["--rounds", "2"], "--reconstruct"),
        (&["--reconstruct", "epi", "--spp", "4"], "--spp"),
        (
            &["--reconstruct", "epi", "--aov", "tests", "-o", "a.exr"],
            "edges, reach, samples",
        ),
        (&["--reconstruct", "epi", "--aov", "depth", "-o", "a.png"], ".exr"),
    ] {
        refused("128x96", args, reason);
    }
}
