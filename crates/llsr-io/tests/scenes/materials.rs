//! MTL libraries, glTF materials and textures.

use glam::{Vec2, Vec3};
use llsr_io::{Development, Image, Loaded, WarningKind, write_png};
use llsr_scene::{Material, Texture, Wrap};
use serde_json::json;

use crate::support::{Document, Folder, assert_no_warnings, count, try_load};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";

/// A 2 x 2 picture: red, green above blue, white.
fn png(folder: &Folder, name: &str) -> Vec<u8> {
    let image = Image::from_rgb(2, 2, &[Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE]);
    let path = folder.path(name);
    write_png(&path, &image, Development::default()).expect("a picture");
    std::fs::read(path).expect("its bytes")
}

fn with_library(folder: &Folder, library: &str) -> Loaded {
    folder.put("lib.mtl", library);
    let path = folder.put(
        "scene.obj",
        format!("mtllib lib.mtl\n{TRIANGLE}usemtl a\nf 1/1 2/2 3/3\n"),
    );
    try_load(&path).expect("a readable file")
}

fn material(loaded: &Loaded) -> &Material {
    loaded
        .scene
        .materials
        .iter()
        .find(|m| m.name == "a")
        .expect("material a")
}

fn texture(loaded: &Loaded) -> &Texture {
    let used = material(loaded).base_color_texture.expect("a texture");
    &loaded.scene.textures[used.texture.index()]
}

/// The colour at a mesh coordinate.
fn color_at(loaded: &Loaded, uv: Vec2) -> Vec3 {
    let used = material(loaded).base_color_texture.expect("a texture");
    texture(loaded).sample(used.coordinates(uv))
}

#[test]
fn statements_of_libraries_are_translated() {
    let folder = Folder::new();
    let loaded = with_library(
        &folder,
        "newmtl a\nKa 1 1 1\nKd 0.1 0.2 0.3\nKs 0.5 0.5 0.5\nNs 30\nillum 2\nKe 2 3 4\n",
    );
    let a = material(&loaded);
    assert_eq!(a.base_color, Vec3::new(0.1, 0.2, 0.3), "Kd");
    assert_eq!(a.emission, Vec3::new(2.0, 3.0, 4.0), "Ke");
    assert!(
        (a.roughness - 0.5).abs() < 1e-6,
        "(2 / 32)^(1/4) is a half: {}",
        a.roughness
    );
    assert_eq!(a.metallic, 0.0, "no metal");
    let matte = with_library(&folder, "newmtl a\nKd 0.5\nNs 100\nKs 0 0 0\n");
    assert_eq!(
        material(&matte).roughness,
        1.0,
        "without specular reflection the exponent says nothing"
    );
    assert_eq!(
        material(&matte).base_color,
        Vec3::splat(0.5),
        "one number for three"
    );
    let metal = with_library(&folder, "newmtl a\nPr 0.25\nPm 1\n");
    assert_eq!(
        (material(&metal).roughness, material(&metal).metallic),
        (0.25, 1.0),
        "the later extension"
    );
}

#[test]
fn bad_statements_spoil_neither_material_nor_library() {
    let folder = Folder::new();
    let library = "Kd 1 1 1\nnewmtl a\nKd\nKd 1\nKd 0.5 0.5\nKd spectral file.rfl 1\nNs\nNs x\nillum\nillum 300\nKs nan 0 0\nKd 0.25 7 -1\nd\nmap_Kd\nnewmtl b\nKd 0 1 0\n";
    let loaded = with_library(&folder, library);
    assert_eq!(
        material(&loaded).base_color,
        Vec3::new(0.25, 1.0, 0.0),
        "the last good one, clamped"
    );
    assert!(
        count(&loaded, WarningKind::BadStatement) >= 8,
        "{:?}",
        loaded.warnings
    );
    assert!(
        count(&loaded, WarningKind::ClampedMaterial) >= 4,
        "{:?}",
        loaded.warnings
    );
    let transparent = with_library(&folder, "newmtl a\nd 0.5\nTr 0\n");
    assert_eq!(
        count(&transparent, WarningKind::Transparency),
        1,
        "d but not Tr 0"
    );
}

#[test]
fn missing_libraries_and_materials_are_grey() {
    let folder = Folder::new();
    let path = folder.put(
        "scene.obj",
        format!("mtllib no.mtl\nmtllib ../../etc/passwd\n{TRIANGLE}usemtl a\nf 1 2 3\n"),
    );
    let loaded = try_load(&path).expect("a readable file");
    assert_eq!(
        count(&loaded, WarningKind::MissingMaterials),
        2,
        "one missing, one outside"
    );
    assert_eq!(count(&loaded, WarningKind::MissingMaterial), 1, "its material");
    assert_eq!(material(&loaded).base_color, Vec3::splat(0.8), "grey");
    let text = loaded
        .warnings
        .iter()
        .map(ToString::to_string)
        .collect::<String>();
    assert!(
        text.contains("no.mtl: not found") && text.contains("outside the folder"),
        "{text}"
    );
}

#[test]
fn several_libraries_and_blanks_in_names() {
    let folder = Folder::new();
    folder.put("one.mtl", "newmtl a\nKd 1 0 0\n");
    folder.put("my lib.mtl", "newmtl b\nKd 0 1 0\n");
    for names in ["one.mtl my\\ lib.mtl", "one.mtl\nmtllib my lib.mtl"] {
        let text = format!("mtllib {names}\n{TRIANGLE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 2\n");
        let loaded = try_load(&folder.put("scene.obj", text)).expect("a readable file");
        assert_no_warnings(&loaded);
        assert_eq!(
            loaded.scene.materials[1].base_color,
            Vec3::Y,
            "{names:?}: the second library"
        );
    }
}

#[test]
fn obj_textures_stand_upright_and_follow_their_options() {
    let folder = Folder::new();
    png(&folder, "wood 1.png");
    let loaded = with_library(&folder, "newmtl a\nKd 1 1 1\nmap_Kd wood 1.png\n");
    assert_no_warnings(&loaded);
    let uvs = &loaded.scene.meshes[0].uvs;
    // The corner (0, 0) of the file is the lower left of the picture, which is blue.
    let lower_left = uvs[0] + Vec2::new(0.25, -0.25);
    assert!(
        color_at(&loaded, lower_left).distance(Vec3::Z) < 0.01,
        "{}",
        color_at(&loaded, lower_left)
    );
    let options = "-clamp on -bm 2 -s 2 2 1 -o 0.5 0 -mm 0 1";
    let loaded = with_library(&folder, &format!("newmtl a\nmap_Kd {options} wood 1.png\n"));
    assert_eq!(texture(&loaded).wrap, [Wrap::Clamp; 2], "clamped");
    // In the file's coordinates (0.125, 0.125) -> (0.25 + 0.5, 0.25): lower right, white.
    let uv = Vec2::new(0.125, 1.0 - 0.125);
    assert!(
        color_at(&loaded, uv).distance(Vec3::ONE) < 0.01,
        "{}",
        color_at(&loaded, uv)
    );
}

#[test]
fn missing_and_broken_textures_leave_the_plain_colour() {
    let folder = Folder::new();
    let bytes = png(&folder, "good.png");
    folder.put("cut.png", &bytes[..bytes.len() / 2]);
    folder.put("text.png", "not a picture");
    for name in ["none.png", "cut.png", "text.png", "../good.png/x.png"] {
        let loaded = with_library(&folder, &format!("newmtl a\nKd 0.5 0.5 0.5\nmap_Kd {name}\n"));
        assert_eq!(
            count(&loaded, WarningKind::MissingTexture),
            1,
            "{name}: {:?}",
            loaded.warnings
        );
        assert_eq!(material(&loaded).base_color_texture, None, "{name}: no texture");
    }
    let elsewhere = with_library(&folder, "newmtl a\nmap_Kd C:\\Users\\me\\good.png\n");
    assert_no_warnings(&elsewhere);
    assert_eq!(
        texture(&elsewhere).width,
        2,
        "a file of that name beside the scene is taken"
    );
}

#[test]
fn textures_that_claim_to_be_huge_are_not_decoded() {
    let folder = Folder::new();
    let mut bytes = png(&folder, "good.png");
    // Width and height stand behind the signature and the chunk's head; the checksum no longer matters.
    bytes[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
    let end = 8 + 8 + 13;
    let crc = crc32(&bytes[12..end]);
    bytes[end..end + 4].copy_from_slice(&crc.to_be_bytes());
    folder.put("huge.png", &bytes);
    let loaded = with_library(&folder, "newmtl a\nmap_Kd huge.png\n");
    let text = loaded.warnings[0].to_string();
    assert!(text.contains("30000 x 30000"), "{text}");
}

/// The checksum of PNG chunks, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 {
                crc >> 1 ^ 0xedb8_8320
            } else {
                crc >> 1
            };
        }
    }
    !crc
}

/// A glTF triangle with this material and extra top-level parts.
fn with_material(material: serde_json::Value, finish: impl FnOnce(&mut Document)) -> Loaded {
    let mut document = Document::new();
    let mesh = document.triangle();
    let uvs = document.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let far = document.floats("VEC2", &[5.0; 6]);
    let attributes = &mut document.json["meshes"][mesh]["primitives"][0]["attributes"];
    attributes["TEXCOORD_0"] = json!(far);
    attributes["TEXCOORD_1"] = json!(uvs);
    document.json["meshes"][mesh]["primitives"][0]["material"] = json!(0);
    document.push("materials", material);
    document.push("nodes", json!({ "mesh": mesh }));
    finish(&mut document);
    document.load()
}

#[test]
fn gltf_materials_are_read_and_clamped() {
    let loaded = with_material(
        json!({
            "name": "a",
            "pbrMetallicRoughness": { "baseColorFactor": [0.1, 2.0, 0.3, 1.0], "metallicFactor": 0.25, "roughnessFactor": -1.0 },
            "emissiveFactor": [1.0, 0.5, 0.25],
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8.0 } },
            "alphaMode": "BLEND",
        }),
        |_| {},
    );
    let a = material(&loaded);
    assert_eq!(a.base_color, Vec3::new(0.1, 1.0, 0.3), "clamped");
    assert_eq!((a.metallic, a.roughness), (0.25, 0.0), "clamped");
    assert_eq!(a.emission, Vec3::new(8.0, 4.0, 2.0), "factor times strength");
    assert_eq!(count(&loaded, WarningKind::ClampedMaterial), 2, "two numbers");
    assert_eq!(count(&loaded, WarningKind::Transparency), 1, "opaque here");
    let unnamed = with_material(json!({}), |_| {});
    assert_eq!(unnamed.scene.materials[0].name, "material-0", "a name to ask for");
}

#[test]
fn the_older_surface_model_is_translated() {
    let loaded = with_material(
        json!({ "name": "a", "extensions": { "KHR_materials_pbrSpecularGlossiness": {
            "diffuseFactor": [0.1, 0.2, 0.3, 1.0], "specularFactor": [0.2, 0.2, 0.2], "glossinessFactor": 0.75,
        }}}),
        |document| document.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]),
    );
    assert_no_warnings(&loaded);
    let a = material(&loaded);
    assert_eq!(
        (a.base_color, a.metallic, a.roughness),
        (Vec3::new(0.1, 0.2, 0.3), 0.0, 0.25),
        "no metal"
    );
}

#[test]
fn gltf_textures_use_their_set_and_transform() {
    let folder = Folder::new();
    let bytes = png(&folder, "a.png");
    let info = json!({ "index": 0, "texCoord": 0, "extensions": { "KHR_texture_transform": {
        "offset": [0.25, 0.5], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.25], "texCoord": 1,
    }}});
    let loaded = with_material(
        json!({ "name": "a", "pbrMetallicRoughness": { "baseColorTexture": info } }),
        |document| {
            let view = document.view(&bytes);
            document.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
            document.push("samplers", json!({ "wrapS": 33071, "wrapT": 33648 }));
            document.push("textures", json!({ "source": 0, "sampler": 0 }));
        },
    );
    assert_no_warnings(&loaded);
    assert_eq!(
        texture(&loaded).wrap,
        [Wrap::Clamp, Wrap::Mirror],
        "the sampler's ways"
    );
    let used = material(&loaded).base_color_texture.expect("a texture");
    assert_eq!(loaded.scene.meshes[0].uvs[1], Vec2::X, "the second set");
    // Scaled to (0.5, 0) and (0, 0.25), turned by a quarter: u -> -v, v -> u; then moved.
    assert!(
        used.coordinates(Vec2::X).distance(Vec2::new(0.25, 0.0)) < 1e-6,
        "{}",
        used.coordinates(Vec2::X)
    );
    assert!(
        used.coordinates(Vec2::Y).distance(Vec2::new(0.5, 0.5)) < 1e-6,
        "{}",
        used.coordinates(Vec2::Y)
    );
}

#[test]
fn gltf_textures_that_cannot_be_had_leave_the_plain_colour() {
    for (images, textures) in [
        (json!([]), json!([])),
        (json!([]), json!([{ "source": 3 }])),
        (json!([{ "uri": "../secret.png" }]), json!([{ "source": 0 }])),
        (
            json!([{ "uri": "data:image/png;base64,!!!!" }]),
            json!([{ "source": 0 }]),
        ),
        (
            json!([{ "bufferView": 99, "mimeType": "image/png" }]),
            json!([{ "source": 0 }]),
        ),
        (json!([{}]), json!([{ "source": 0, "sampler": 9 }])),
        (
            json!([]),
            json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]),
        ),
    ] {
        let description = format!("{images} {textures}");
        let material_json =
            json!({ "name": "a", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
        let loaded = with_material(material_json, |document| {
            document.json["images"] = images;
            document.json["textures"] = textures;
        });
        assert_eq!(
            count(&loaded, WarningKind::MissingTexture),
            1,
            "{description}: {:?}",
            loaded.warnings
        );
        assert_eq!(
            loaded.scene.triangle_count(),
            1,
            "{description}: the mesh is there"
        );
    }
}
