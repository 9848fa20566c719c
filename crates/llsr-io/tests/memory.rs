//! Small files that ask for much: whatever they claim, the process stays below one GiB. One test in a process of its own,
//! since the peak is the process's.
#![cfg(target_os = "linux")]

use std::fmt::Write as _;
use std::path::Path;

use base64::Engine as _;
use llsr_io::{LoadOptions, read_image, read_scene};

/// A kibibyte figure of this process, in bytes.
fn status(name: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").expect("the kernel's figures");
    let line = text
        .lines()
        .find(|line| line.starts_with(name))
        .expect("the figure");
    let number = line.split_whitespace().nth(1).expect("a number");
    1024 * number.parse::<u64>().expect("a number")
}

fn gltf(parts: &str) -> String {
    format!(r#"{{"asset":{{"version":"2.0"}},{parts}}}"#)
}

/// A chunk of a PNG file.
fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let mut crc = u32::MAX;
    for &byte in kind.iter().chain(data) {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 {
                crc >> 1 ^ 0xedb8_8320
            } else {
                crc >> 1
            };
        }
    }
    let mut bytes = (data.len() as u32).to_be_bytes().to_vec();
    bytes.extend(kind);
    bytes.extend(data);
    bytes.extend((!crc).to_be_bytes());
    bytes
}

/// A PNG of this size without its pixels.
fn hollow_png(width: u32, height: u32, depth: u8) -> Vec<u8> {
    let mut header = [width.to_be_bytes(), height.to_be_bytes()].concat();
    header.extend([depth, 6, 0, 0, 0]);
    [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        chunk(b"IHDR", &header),
        chunk(b"IDAT", &[0x78, 0x9c]),
    ]
    .concat()
}

fn hostile_scenes() -> Vec<(&'static str, &'static str, String)> {
    let mut list = Vec::new();
    let mut gltf_case = |name, parts: String| list.push((name, "a.gltf", gltf(&parts)));
    for kind in [
        "nodes",
        "materials",
        "meshes",
        "accessors",
        "scenes",
        "textures",
        "cameras",
        "animations",
        "skins",
    ] {
        // Just below the number that is refused.
        gltf_case(kind, format!(r#""{kind}":[{}{{}}]"#, "{},".repeat(299_000)));
    }
    gltf_case(
        "materials of some size",
        format!(
            r#""materials":[{}{{}}]"#,
            r#"{"name":"0123456789"},"#.repeat(700_000)
        ),
    );
    gltf_case(
        "lists in lists",
        format!(
            r#""accessors":[{{"count":1,"componentType":5126,"type":"VEC3","min":[{}0]}}]"#,
            "[],".repeat(280_000)
        ),
    );
    gltf_case(
        "names",
        format!(r#""extensionsUsed":[{}""]"#, r#""","#.repeat(3_000_000)),
    );
    gltf_case(
        "a node again and again",
        format!(r#""nodes":[{{"children":[{}0]}}]"#, "0,".repeat(3_000_000)),
    );
    let sparse = r#"{"componentType":5126,"count":16777216,"type":"VEC3","sparse":{"count":1,
        "indices":{"bufferView":0,"componentType":5125},"values":{"bufferView":0}}}"#;
    let primitives = r#"{"attributes":{"POSITION":0}},"#.repeat(1000);
    gltf_case(
        "zeros that are not there",
        format!(
            r#""buffers":[{{"byteLength":12,"uri":"data:;base64,AAAAAAAAAAAAAAAA"}}],"bufferViews":[{{"buffer":0,"byteLength":12}}],
        "accessors":[{sparse}],"meshes":[{{"primitives":[{primitives}{{"attributes":{{"POSITION":0}}}}]}}],"nodes":[{{"mesh":0}}]"#
        ),
    );
    for (name, width, height, depth) in [
        ("a picture of a terapixel", 1_000_000, 1_000_000, 8),
        ("40 million pixels of 8 bytes", 8192, 5100, 16),
        ("a strip", 40_000_000, 1, 8),
    ] {
        let png = base64::engine::general_purpose::STANDARD.encode(hollow_png(width, height, depth));
        let images = format!(r#"{{"uri":"data:image/png;base64,{png}"}}"#);
        gltf_case(
            name,
            format!(
                r#""images":[{images}],"textures":[{{"source":0}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}]"#
            ),
        );
    }
    let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    for i in 0..150_000 {
        writeln!(text, "g {i}\nf 1 2 3").expect("writing to a string");
    }
    list.push(("a group a face", "a.obj", text));
    let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    for i in 0..150_000 {
        writeln!(text, "usemtl {i}\nf 1 2 3").expect("writing to a string");
    }
    list.push(("a material a face", "a.obj", text));
    let circle: String = (0..200_000).map(|i| format!("v {i} {} 0\n", i % 17)).collect();
    let corners: String = (1..=200_000).map(|i| format!(" {i}")).collect();
    list.push((
        "a polygon of 200000 corners",
        "a.obj",
        format!("{circle}f{corners}\n"),
    ));
    list.push((
        "references far away",
        "a.obj",
        "v 0 0 0\nf 1 4000000000 -4000000000\n".repeat(50_000),
    ));
    list
}

#[test]
fn no_small_file_takes_a_gibibyte() {
    let start = status("VmPeak");
    for (name, path, text) in hostile_scenes() {
        let length = text.len();
        assert!(length < 17 << 20, "{name}: {length} bytes are a small file");
        let outcome = match read_scene(Path::new(path), text.into_bytes(), &LoadOptions::default()) {
            Ok(loaded) => format!("{} triangles", loaded.scene.triangle_count()),
            Err(error) => error.to_string(),
        };
        let peak = status("VmPeak") - start;
        assert!(peak < 1 << 30, "{name}: {} MiB; {outcome}", peak >> 20);
    }
    let folder = tempfile::tempdir().expect("a temporary directory");
    let path = folder.path().join("a.png");
    for (width, height, depth) in [(1 << 20, 1 << 20, 8), (6000, 6000, 16), (11_000, 12_000, 8)] {
        std::fs::write(&path, hollow_png(width, height, depth)).expect("a file");
        assert!(
            read_image(&path).is_err(),
            "{width} x {height} pixels that are not there"
        );
        let peak = status("VmPeak") - start;
        assert!(peak < 1 << 30, "{width} x {height}: {} MiB", peak >> 20);
    }
}
