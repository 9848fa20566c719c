//! Files that were cut, flipped or made up: an answer always, a panic never.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::LazyLock;

use glam::{DVec3, Vec3};
use llsr_io::{Development, Image, LoadOptions, read_scene, write_gltf, write_png};
use llsr_scene::{
    Camera, FieldOfView, LinearLight, Material, Mesh, Primitive, Scene, Shape, Texture, TextureUse, Wrap,
};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::support::{Document, Folder, glb};

/// Loads what may be anything; what comes back must fit together.
fn survive(path: impl AsRef<Path>, bytes: &[u8]) {
    let Ok(loaded) = read_scene(path.as_ref(), bytes.to_vec(), &LoadOptions::default()) else {
        return;
    };
    let scene = &loaded.scene;
    for mesh in &scene.meshes {
        assert!(mesh.is_valid(), "mesh {:?} fits together", mesh.name);
        assert!(
            mesh.materials.iter().all(|m| m.index() < scene.materials.len()),
            "materials exist"
        );
        assert!(
            mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3),
            "normals are units"
        );
    }
    for material in &scene.materials {
        let texture = material
            .base_color_texture
            .is_none_or(|t| t.texture.index() < scene.textures.len());
        assert!(
            texture && material.emission.is_finite(),
            "material {:?} fits together",
            material.name
        );
    }
    for object in &scene.objects {
        assert!(
            object.transform.is_finite() && object.transform.inverse().is_finite(),
            "object {:?}",
            object.name
        );
    }
    assert!(
        scene.bounds().is_empty() || scene.bounds().size().is_finite(),
        "finite bounds"
    );
    for light in &scene.lights {
        let (a, b) = light.ends();
        assert!(
            a.is_finite() && b.is_finite() && light.flux() >= 0.0 && light.color().is_finite(),
            "{light:?}"
        );
    }
    for camera in &scene.cameras {
        assert!(
            camera.position.is_finite() && camera.axes.determinant() > 0.9,
            "{camera:?}"
        );
    }
}

/// A small file in which every kind of thing occurs once.
static SPECIMEN: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut scene = Scene::new("s");
    let texture = scene.add_texture(Texture {
        name: "t".to_owned(),
        width: 1,
        height: 1,
        pixels: vec![[9; 3]],
        wrap: [Wrap::Repeat; 2],
    });
    let material = scene.add_material(Material {
        base_color_texture: Some(TextureUse::plain(texture)),
        emission: Vec3::splat(5.0),
        ..Material::diffuse("m", Vec3::ONE)
    });
    let mut mesh = Mesh::quad("q", [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y], material);
    mesh.normals = vec![Vec3::Z; 4];
    mesh.uvs = vec![glam::Vec2::ZERO; 4];
    scene.add_mesh(mesh);
    scene.add_light(LinearLight::new("l", DVec3::ZERO, DVec3::ONE, 1.0));
    scene.cameras.push(Camera::look_at(
        "c",
        DVec3::ONE,
        DVec3::ZERO,
        DVec3::Y,
        FieldOfView::Horizontal(1.0),
    ));
    let folder = Folder::new();
    let path = folder.path("a.glb");
    write_gltf(&path, &scene).expect("a written file");
    std::fs::read(path).expect("its bytes")
});

#[test]
fn every_single_bit_of_a_small_file() {
    let bytes = &*SPECIMEN;
    assert!(
        bytes.len() < 4000,
        "{} bytes are few enough for this",
        bytes.len()
    );
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        survive("nowhere/a.glb", &damaged);
    }
}

#[test]
fn every_length_of_a_small_file() {
    let bytes = &*SPECIMEN;
    for length in 0..bytes.len() {
        survive("nowhere/a.glb", &bytes[..length]);
        // The same with a header that agrees.
        let mut damaged = bytes[..length].to_vec();
        if length >= 12 {
            damaged[8..12].copy_from_slice(&(length as u32).to_le_bytes());
        }
        survive("nowhere/a.glb", &damaged);
    }
}

/// Every number of the document replaced by unlikely ones, one at a time.
#[test]
fn every_number_of_a_document() {
    let bytes = &*SPECIMEN;
    let json_length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let json: Value = serde_json::from_slice(&bytes[20..20 + json_length]).expect("JSON");
    let binary = &bytes[20 + json_length + 8..];
    let mut paths = Vec::new();
    collect_numbers(&json, String::new(), &mut paths);
    assert!(paths.len() > 60, "{} numbers", paths.len());
    for path in paths {
        for value in [
            json!(0),
            json!(-1),
            json!(1),
            json!(7),
            json!(255),
            json!(65_536),
            json!(u32::MAX),
            json!(u64::MAX),
            json!(1e300),
            json!(-1e-300),
            json!(0.5),
            json!(null),
            json!("x"),
            json!([]),
            json!({}),
        ] {
            let mut changed = json.clone();
            *changed.pointer_mut(&path).expect("a path of the document") = value;
            survive("nowhere/a.glb", &glb(changed.to_string().as_bytes(), binary));
        }
    }
}

fn collect_numbers(value: &Value, path: String, paths: &mut Vec<String>) {
    match value {
        Value::Number(_) => paths.push(path),
        Value::Array(list) => {
            for (index, value) in list.iter().enumerate() {
                collect_numbers(value, format!("{path}/{index}"), paths);
            }
        }
        Value::Object(map) => {
            for (key, value) in map {
                collect_numbers(value, format!("{path}/{key}"), paths);
            }
        }
        _ => {}
    }
}

/// Each entry of the document taken away, one at a time.
#[test]
fn every_part_of_a_document_missing() {
    let bytes = &*SPECIMEN;
    let json_length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let json: Value = serde_json::from_slice(&bytes[20..20 + json_length]).expect("JSON");
    let binary = &bytes[20 + json_length + 8..];
    let mut paths = Vec::new();
    collect_entries(&json, String::new(), &mut paths);
    for (parent, key) in paths {
        let mut changed = json.clone();
        match changed.pointer_mut(&parent).expect("a path of the document") {
            Value::Object(map) => drop(map.remove(&key)),
            Value::Array(list) => drop(list.remove(key.parse().expect("a position"))),
            _ => unreachable!("only containers have entries"),
        }
        survive("nowhere/a.glb", &glb(changed.to_string().as_bytes(), binary));
    }
}

fn collect_entries(value: &Value, path: String, paths: &mut Vec<(String, String)>) {
    let entries: Vec<(String, &Value)> = match value {
        Value::Array(list) => list.iter().enumerate().map(|(i, v)| (i.to_string(), v)).collect(),
        Value::Object(map) => map.iter().map(|(k, v)| (k.clone(), v)).collect(),
        _ => return,
    };
    for (key, value) in entries {
        collect_entries(value, format!("{path}/{key}"), paths);
        paths.push((path.clone(), key));
    }
}

#[test]
fn primitives_with_unusable_numbers_are_left_out() {
    let mut scene = Scene::new("s");
    let material = scene.add_material(Material::diffuse("m", Vec3::ONE));
    let shape = Shape::Cylinder {
        a: Vec3::ZERO,
        b: Vec3::Y,
        radius: 0.5,
        capped: true,
    };
    scene.add_primitive("p", Primitive { shape, material });
    let folder = Folder::new();
    write_gltf(&folder.path("a.gltf"), &scene).expect("a written file");
    let text = std::fs::read_to_string(folder.path("a.gltf")).expect("text");
    for (from, to) in [
        ("\"radius\": 0.5", "\"radius\": -1"),
        ("\"cylinder\"", "\"banana\""),
        ("\"capped\": true", "\"capped\": 3"),
    ] {
        assert!(text.contains(from), "{from} is there");
        survive("nowhere/a.gltf", text.replace(from, to).as_bytes());
    }
}

#[test]
fn damaged_text_of_obj_files() {
    let folder = Folder::new();
    let image = Image::from_rgb(2, 1, &[Vec3::ONE, Vec3::X]);
    write_png(&folder.path("a.png"), &image, Development::default()).expect("a picture");
    folder.put(
        "a.mtl",
        "newmtl m\nKd 0.5 0.5 0.5\nNs 10\nmap_Kd -s 1 1 a.png\nKe 1 1 1\n",
    );
    let text = b"mtllib a.mtl\no x\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0.2 0.1 0\nvt 0 0\nvn 0 0 1\nusemtl m\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -4//1 -3//1 -1//1\n";
    for bit in 0..8 * text.len() {
        let mut damaged = text.to_vec();
        damaged[bit / 8] ^= 1 << (bit % 8);
        survive(folder.path("a.obj"), &damaged);
    }
    let library = std::fs::read(folder.path("a.mtl")).expect("the library");
    for bit in 0..8 * library.len() {
        let mut damaged = library.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        folder.put("a.mtl", &damaged);
        survive(folder.path("a.obj"), text);
    }
}

#[test]
fn documents_of_empty_structures_are_refused_early() {
    for list in ["nodes", "materials", "accessors", "scenes"] {
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"{list}":[{}{{}}]}}"#,
            "{},".repeat(2_000_000)
        );
        let error = crate::support::try_text("a.gltf", text)
            .expect_err("refused")
            .to_string();
        assert!(error.contains("empty"), "{list}: {error}");
    }
    let deep = "[".repeat(100_000);
    assert!(crate::support::try_text("a.gltf", deep).is_err(), "deep nesting");
}

#[test]
fn buffers_that_are_shared_too_often_are_refused() {
    let mut document = Document::new();
    let positions: Vec<f32> = (0..30_000).map(|i| (i % 97) as f32).collect();
    let mesh = document.mesh(&positions, &(0..9_999).collect::<Vec<u32>>());
    let primitive = document.json["meshes"][mesh]["primitives"][0].clone();
    document.json["meshes"][mesh]["primitives"] = vec![primitive; 5000].into();
    document.push("nodes", json!({ "mesh": mesh }));
    let error = document
        .try_load()
        .expect_err("50 million vertices of 160 kB")
        .to_string();
    assert!(error.contains("share their buffers"), "{error}");
}

#[test]
fn tubes_in_shared_meshes_have_a_limit() {
    // A glowing blob shown 60000 times, and a bundle of 3000 rods that loses others of them wherever it stands.
    let mut document = Document::new();
    document.push(
        "materials",
        json!({ "name": "glow", "emissiveFactor": [1, 1, 1] }),
    );
    let positions: Vec<f32> = (0..6000).map(|i| (i * i % 97) as f32).collect();
    let indices: Vec<u32> = (0..6000).map(|i| i % 2000).collect();
    let mesh = document.mesh(&positions, &indices);
    document.json["meshes"][mesh]["primitives"][0]["material"] = json!(0);
    for i in 0..60_000 {
        document.push("nodes", json!({ "mesh": 0, "translation": [i, 0, 0] }));
    }
    let error = document
        .try_load()
        .expect_err("120 million triangles")
        .to_string();
    assert!(error.contains("looked at"), "{error}");

    let mut positions = Vec::new();
    for rod in 0..300 {
        let (x, length) = (rod as f32, 0.1 + 0.01 * rod as f32);
        for corner in [
            [0.0, 0.0, 0.0],
            [0.01, 0.0, 0.0],
            [0.005, 0.009, 0.0],
            [0.005, 0.003, length],
        ] {
            positions.extend([x + corner[0], corner[1], corner[2]]);
        }
    }
    let tetrahedron = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3];
    let indices: Vec<u32> = (0..300)
        .flat_map(|rod| tetrahedron.map(|i| 4 * rod + i))
        .collect();
    let mut document = Document::new();
    document.push(
        "materials",
        json!({ "name": "glow", "emissiveFactor": [1, 1, 1] }),
    );
    document.push("materials", json!({ "name": "rest" }));
    let mesh = document.mesh(&positions, &indices);
    let rest = document.indices(&tetrahedron.repeat(15_000));
    let mut primitive = document.json["meshes"][mesh]["primitives"][0].clone();
    primitive["indices"] = json!(rest);
    primitive["material"] = json!(1);
    document.json["meshes"][mesh]["primitives"][0]["material"] = json!(0);
    document.json["meshes"][mesh]["primitives"]
        .as_array_mut()
        .expect("primitives")
        .push(primitive);
    for i in 0..400 {
        document.push(
            "nodes",
            json!({ "mesh": 0, "scale": [1.0, 1.0, 1.0 / (1.0 + 0.075 * f64::from(i))] }),
        );
    }
    let error = document
        .try_load()
        .expect_err("more than 200 different rests")
        .to_string();
    assert!(error.contains("copied"), "{error}");
}

/// Words that mean something to the reader, and some that do not.
fn word() -> impl Strategy<Value = String> {
    prop_oneof![
        3 => prop::sample::select(vec!["v", "vt", "vn", "f", "o", "g", "s", "l", "usemtl", "mtllib", "#", "\\", "fo"]).prop_map(str::to_owned),
        4 => (-6i32..8).prop_map(|i| i.to_string()),
        2 => (-3.0f64..3.0).prop_map(|x| x.to_string()),
        2 => ((-4i32..6), (-4i32..6), (-4i32..6)).prop_map(|(a, b, c)| format!("{a}/{b}/{c}")),
        1 => ((-4i32..6), (-4i32..6)).prop_map(|(a, c)| format!("{a}//{c}")),
        1 => prop::sample::select(vec!["nan", "-inf", "1e999", "1e-999", "1e38", "/", "//", "0", "off", "\u{e9}"]).prop_map(str::to_owned),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn texts_of_plausible_words(lines in prop::collection::vec(prop::collection::vec(word(), 0..9), 0..30)) {
        let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\n");
        for line in lines {
            writeln!(text, "{}", line.join(" ")).expect("writing to a string");
        }
        survive("nowhere/a.obj", text.as_bytes());
    }

    #[test]
    fn several_bytes_of_a_small_file(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12)) {
        let mut bytes = SPECIMEN.clone();
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        survive("nowhere/a.glb", &bytes);
    }

    #[test]
    fn lists_of_any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        for name in ["a.obj", "a.gltf", "a.glb"] {
            survive(Path::new("nowhere").join(name), &bytes);
        }
    }
}
