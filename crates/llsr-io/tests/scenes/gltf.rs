//! glTF structure: buffers, accessors, meshes, nodes.

use base64::Engine as _;
use glam::{DVec3, Vec2, Vec3};
use llsr_io::{Error, WarningKind};
use llsr_scene::Geometry;
use serde_json::{Value, json};

use crate::support::{
    Document, Folder, area, area_vector, assert_no_warnings, count, glb, triangles, try_load, try_text,
};

/// A document with the unit triangle on one node.
fn triangle() -> Document {
    let mut document = Document::new();
    let mesh = document.triangle();
    document.push("nodes", json!({ "name": "node", "mesh": mesh }));
    document
}

fn data_uri(bytes: &[u8]) -> String {
    format!(
        "data:application/octet-stream;base64,{}",
        base64::engine::general_purpose::STANDARD.encode(bytes)
    )
}

#[test]
fn text_files_take_embedded_and_neighbouring_buffers_only() {
    let mut document = triangle();
    let folder = Folder::new();
    folder.put("parts/my buffer.bin", &document.bytes);
    folder.put("outside.bin", &document.bytes);
    let length = document.bytes.len();
    let mut load = |uri: &str| {
        document.json["buffers"] = json!([{ "byteLength": length, "uri": uri }]);
        try_load(&folder.put("scenes/a.gltf", document.json.to_string()))
    };
    folder.put("scenes/parts/my buffer.bin", &triangle().bytes);
    for uri in [
        data_uri(&triangle().bytes),
        "parts/my%20buffer.bin".to_owned(),
        "./parts/my buffer.bin".to_owned(),
    ] {
        let loaded = load(&uri).expect("a readable file");
        assert_no_warnings(&loaded);
        assert!((area(&loaded.scene) - 0.5).abs() < 1e-6, "{uri}");
    }
    let outside = folder.path("outside.bin");
    for uri in [
        "../outside.bin",
        "parts/../../outside.bin",
        "%2e%2e/outside.bin",
        outside.to_str().expect("a plain path"),
        "file:///etc/passwd",
        "http://localhost/a.bin",
        "missing.bin",
        "parts",
        "%zz",
        "",
        "data:text/plain,abc",
        "data:;base64,A",
    ] {
        let error = load(uri).expect_err("no geometry").to_string();
        assert!(error.contains("buffer 0"), "{uri}: {error}");
    }
}

#[test]
fn all_index_types_and_modes_are_read() {
    // A square as a list, a strip and a fan.
    let positions = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    for (mode, order) in [
        (4, vec![0u32, 1, 2, 2, 1, 3]),
        (5, vec![0, 1, 2, 3]),
        (6, vec![0, 1, 3, 2]),
    ] {
        for (component, size) in [(5121, 1), (5123, 2), (5125, 4)] {
            let mut document = Document::new();
            let positions = document.floats("VEC3", &positions);
            let bytes: Vec<u8> = order
                .iter()
                .flat_map(|i| i.to_le_bytes()[..size].to_vec())
                .collect();
            let view = document.view(&bytes);
            let accessor = json!({ "bufferView": view, "componentType": component, "count": order.len(), "type": "SCALAR" });
            let indices = document.push("accessors", accessor);
            let primitive =
                json!({ "attributes": { "POSITION": positions }, "indices": indices, "mode": mode });
            document.push("meshes", json!({ "primitives": [primitive] }));
            document.push("nodes", json!({ "mesh": 0 }));
            let loaded = document.load();
            assert_no_warnings(&loaded);
            assert!(
                (area_vector(&loaded.scene) - DVec3::Z).length() < 1e-6,
                "mode {mode}, type {component}"
            );
        }
    }
    let mut document = Document::new();
    let corners = document.floats("VEC3", &positions[..9]);
    document.push(
        "meshes",
        json!({ "primitives": [
            { "attributes": { "POSITION": corners } },
            { "attributes": { "POSITION": corners }, "mode": 1 },
            { "attributes": { "POSITION": corners }, "mode": 77 },
        ]}),
    );
    document.push("nodes", json!({ "mesh": 0 }));
    let loaded = document.load();
    assert_eq!(loaded.scene.triangle_count(), 1, "without indices, in order");
    assert_eq!(count(&loaded, WarningKind::Ignored), 1, "lines");
    assert_eq!(count(&loaded, WarningKind::BadPart), 1, "no such mode");
}

#[test]
fn interleaved_sparse_and_normalised_data_are_read() {
    let mut document = Document::new();
    // Position, normal and two normalised bytes of texture coordinates (and two of padding) for each vertex.
    let mut bytes = Vec::new();
    for (x, y, u, v) in [(0.0f32, 0.0f32, 0u8, 0u8), (1.0, 0.0, 255, 0), (0.0, 1.0, 0, 51)] {
        bytes.extend(
            [x, y, 0.0, 0.0, 0.0, 2.0]
                .iter()
                .flat_map(|f: &f32| f.to_le_bytes()),
        );
        bytes.extend([u, v, 0, 0]);
    }
    let view = document.view(&bytes);
    document.json["bufferViews"][view]["byteStride"] = json!(28);
    let mut accessor = |offset: usize, component: u32, shape: &str, normalized: bool| {
        document.push("accessors", json!({
            "bufferView": view, "byteOffset": offset, "componentType": component, "count": 3, "type": shape,
            "normalized": normalized,
        }))
    };
    let positions = accessor(0, 5126, "VEC3", false);
    let normals = accessor(12, 5126, "VEC3", false);
    let uvs = accessor(24, 5121, "VEC2", true);
    // The last corner moves to (0, 3, 0).
    let index = document.view(&2u16.to_le_bytes());
    let value = document.view(&[0.0f32, 3.0, 0.0].map(f32::to_le_bytes).concat());
    document.json["accessors"][positions]["sparse"] = json!({
        "count": 1, "indices": { "bufferView": index, "componentType": 5123 }, "values": { "bufferView": value },
    });
    // And one that is nothing but replaced zeros.
    let from_zero = document.push("accessors", json!({
        "componentType": 5126, "count": 3, "type": "VEC3",
        "sparse": { "count": 1, "indices": { "bufferView": index, "componentType": 5123 }, "values": { "bufferView": value } },
    }));
    document.push(
        "meshes",
        json!({ "primitives": [
            { "attributes": { "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs } },
            { "attributes": { "POSITION": from_zero } },
        ]}),
    );
    document.push("nodes", json!({ "mesh": 0 }));
    let loaded = document.load();
    assert_eq!(count(&loaded, WarningKind::CollapsedTriangle), 1, "two zeros");
    let mesh = loaded
        .scene
        .meshes
        .iter()
        .find(|m| !m.triangles.is_empty())
        .expect("a mesh");
    let moved = mesh.positions[2].as_dvec3() + loaded.scene.origin;
    assert!(
        (moved - DVec3::new(0.0, 3.0, 0.0)).length() < 1e-6,
        "replaced: {moved}"
    );
    assert_eq!(mesh.normals, [Vec3::Z; 3], "made unit");
    assert_eq!(
        mesh.uvs,
        [Vec2::ZERO, Vec2::X, Vec2::new(0.0, 0.2)],
        "bytes over 255"
    );
}

#[test]
fn a_bad_mesh_is_left_out_and_the_rest_stays() {
    // Each change makes the accessor of the second mesh's positions unreadable.
    type Damage = fn(&mut Document);
    let cases: &[(&str, Damage)] = &[
        ("view beyond the buffer", |d| {
            d.json["bufferViews"][2]["byteLength"] = json!(1 << 20)
        }),
        ("view at an overflowing offset", |d| {
            d.json["bufferViews"][2]["byteOffset"] = json!(u64::MAX)
        }),
        ("view of no buffer", |d| {
            d.json["bufferViews"][2]["buffer"] = json!(7)
        }),
        ("huge count", |d| {
            d.json["accessors"][2]["count"] = json!(u64::MAX)
        }),
        ("count beyond the view", |d| {
            d.json["accessors"][2]["count"] = json!(4)
        }),
        ("no elements", |d| d.json["accessors"][2]["count"] = json!(0)),
        ("no such view", |d| {
            d.json["accessors"][2]["bufferView"] = json!(99)
        }),
        ("bytes as positions", |d| {
            d.json["accessors"][2]["componentType"] = json!(5121)
        }),
        ("unknown type", |d| {
            d.json["accessors"][2]["componentType"] = json!(1)
        }),
        ("scalars as positions", |d| {
            d.json["accessors"][2]["type"] = json!("SCALAR")
        }),
        ("unknown shape", |d| {
            d.json["accessors"][2]["type"] = json!("VEC9")
        }),
        ("stride too small", |d| {
            d.json["bufferViews"][2]["byteStride"] = json!(4)
        }),
        ("stride too large", |d| {
            d.json["bufferViews"][2]["byteStride"] = json!(253)
        }),
        ("no such accessor", |d| {
            d.json["meshes"][1]["primitives"][0]["attributes"]["POSITION"] = json!(99)
        }),
        ("no positions", |d| {
            d.json["meshes"][1]["primitives"][0]["attributes"] = json!({})
        }),
        ("floats as indices", |d| {
            d.json["meshes"][1]["primitives"][0]["indices"] = json!(0)
        }),
        ("no such index accessor", |d| {
            d.json["meshes"][1]["primitives"][0]["indices"] = json!(99)
        }),
        ("no data", |d| {
            d.json["accessors"][2] = json!({ "componentType": 5126, "count": 3, "type": "VEC3" })
        }),
        ("sparse without elements", |d| {
            d.json["accessors"][2]["sparse"] = json!({
            "count": 0, "indices": { "bufferView": 3, "componentType": 5125 }, "values": { "bufferView": 2 } })
        }),
        ("sparse with more elements than there are", |d| {
            d.json["accessors"][2]["sparse"] = json!({
            "count": 4, "indices": { "bufferView": 3, "componentType": 5125 }, "values": { "bufferView": 2 } })
        }),
        ("sparse indices of floats", |d| {
            d.json["accessors"][2]["sparse"] = json!({
            "count": 1, "indices": { "bufferView": 3, "componentType": 5126 }, "values": { "bufferView": 2 } })
        }),
        ("sparse beyond its view", |d| {
            d.json["accessors"][2]["sparse"] = json!({
            "count": 3, "indices": { "bufferView": 3, "componentType": 5125 }, "values": { "bufferView": 3 } })
        }),
        ("billions of zeros", |d| {
            d.json["accessors"][2] = json!({
            "componentType": 5126, "count": 4_000_000_000u64, "type": "VEC3", "sparse": {
            "count": 1, "indices": { "bufferView": 3, "componentType": 5125 }, "values": { "bufferView": 2 } } })
        }),
    ];
    for (name, damage) in cases {
        let mut document = triangle();
        let second = document.triangle();
        document.push("nodes", json!({ "mesh": second }));
        damage(&mut document);
        let loaded = document.load();
        assert_eq!(loaded.scene.triangle_count(), 1, "{name}: the good mesh is there");
        assert_eq!(
            count(&loaded, WarningKind::BadPart),
            1,
            "{name}: {:?}",
            loaded.warnings
        );
        assert!(
            loaded.warnings[0].to_string().contains("mesh 1, primitive 0"),
            "{name}: {}",
            loaded.warnings[0]
        );
    }
}

#[test]
fn bad_indices_vertices_and_attributes_cost_only_themselves() {
    let mut document = Document::new();
    let nan = f32::NAN;
    let positions = [
        0.0,
        0.0,
        0.0,
        1.0,
        0.0,
        0.0,
        0.0,
        1.0,
        0.0,
        nan,
        0.0,
        0.0,
        0.0,
        f32::INFINITY,
        0.0,
        0.0,
        0.0,
        3e20,
    ];
    let mesh = document.mesh(
        &positions,
        &[0, 1, 2, 0, 1, 6, 0, 1, 3, 0, 1, 4, 0, 1, 5, 0, 1, u32::MAX, 0, 1],
    );
    let short_normals = document.floats("VEC3", &[0.0, 0.0, 1.0]);
    document.json["meshes"][mesh]["primitives"][0]["attributes"]["NORMAL"] = json!(short_normals);
    document.json["meshes"][mesh]["primitives"][0]["attributes"]["nonsense"] = json!(123);
    document.push("nodes", json!({ "mesh": mesh }));
    let loaded = document.load();
    assert_eq!(loaded.scene.triangle_count(), 1, "the good triangle");
    assert_eq!(count(&loaded, WarningKind::BadIndex), 2, "beyond the last vertex");
    assert_eq!(count(&loaded, WarningKind::BadVertex), 3, "not finite or too far");
    assert_eq!(count(&loaded, WarningKind::BadAttribute), 1, "too few normals");
    assert!(
        (area(&loaded.scene) - 0.5).abs() < 1e-6,
        "bad vertices do not move the middle"
    );
}

#[test]
fn nodes_place_meshes_in_double_precision() {
    let mut document = Document::new();
    let mesh = document.triangle();
    let turn = std::f64::consts::FRAC_1_SQRT_2;
    document.push(
        "nodes",
        json!({ "translation": [1e6 + 0.125, 0.0, -1e6], "children": [1, 2] }),
    );
    document.push(
        "nodes",
        json!({ "mesh": mesh, "translation": [0.0625, 0.0, 0.0], "rotation": [0.0, 0.0, turn, turn] }),
    );
    document.push("nodes", json!({ "mesh": mesh, "scale": [2.0, 2.0, 2.0] }));
    let loaded = document.load();
    assert_no_warnings(&loaded);
    let list = triangles(&loaded.scene);
    let origin = DVec3::new(1e6 + 0.125, 0.0, -1e6);
    let wants = [
        [
            DVec3::new(0.0625, 0.0, 0.0),
            DVec3::new(0.0625, 1.0, 0.0),
            DVec3::new(-0.9375, 0.0, 0.0),
        ],
        [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)],
    ];
    for ((_, got), want) in list.iter().zip(wants) {
        for (p, q) in got.iter().zip(want) {
            assert!((p - (origin + q)).length() < 1e-6, "{p} is {}", origin + q);
        }
    }
    assert_eq!(loaded.scene.meshes.len(), 1, "shared by two objects");
}

#[test]
fn a_matrix_with_a_mirror_keeps_fronts_in_front() {
    let mut document = triangle();
    document.json["nodes"][0]["matrix"] = json!([-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]);
    let loaded = document.load();
    assert!(
        (area_vector(&loaded.scene) - 0.5 * DVec3::Z).length() < 1e-6,
        "{}",
        area_vector(&loaded.scene)
    );
}

#[test]
fn meshes_far_from_their_own_origin_keep_their_detail() {
    let far = 4_194_304.0f32;
    let mut document = Document::new();
    let mesh = document.mesh(&[far, 0.0, 0.0, far + 1.0, 0.0, 0.0, far, 1.0, 0.0], &[0, 1, 2]);
    // Turned by 45 degrees, shared, and brought back.
    let s = (std::f64::consts::PI / 8.0).sin_cos();
    let half = f64::from(far) * std::f64::consts::FRAC_1_SQRT_2;
    let node = json!({ "mesh": mesh, "translation": [-half, -half, 0.0], "rotation": [0.0, 0.0, s.0, s.1] });
    document.push("nodes", node.clone());
    document.push("nodes", node);
    let loaded = document.load();
    for (_, [a, b, _]) in triangles(&loaded.scene) {
        assert!(
            (b - a).distance(DVec3::new(1.0, 1.0, 0.0) * std::f64::consts::FRAC_1_SQRT_2) < 1e-5,
            "{}",
            b - a
        );
        // The file's own number for the angle is good to 1e-16 of four million metres.
        assert!(a.length() < 1e-5, "back at the origin: {a}");
    }
}

#[test]
fn cycles_and_shared_children_are_walked_once() {
    let mut document = triangle();
    document.json["nodes"] = json!([
        { "children": [1, 1, 2] }, { "mesh": 0, "children": [0] }, { "children": [1, 2, 99] },
    ]);
    document.json["scenes"] = json!([{ "nodes": [0] }, { "nodes": [] }]);
    let loaded = document.load();
    assert_eq!(loaded.scene.objects.len(), 1, "one object");
    assert_eq!(
        count(&loaded, WarningKind::NodeGraph),
        4,
        "1 again, 0 inside 1, 1 and 2 inside 2"
    );
    assert_eq!(count(&loaded, WarningKind::BadPart), 1, "no node 99");
    assert_eq!(count(&loaded, WarningKind::OtherScenes), 1, "the second scene");
}

#[test]
fn long_chains_and_wide_graphs_of_nodes_end() {
    let mut chain = triangle();
    let nodes: Vec<Value> = (0..20_000)
        .map(|i| json!({ "children": [i + 1], "scale": [2.0, 1.0, 1.0] }))
        .collect();
    chain.json["nodes"] = nodes.into();
    chain.push("nodes", json!({ "mesh": 0 }));
    let error = chain.try_load().expect_err("2^20000 times as wide").to_string();
    assert!(error.contains("transform"), "{error}");
    // Each node twice the child of the one before: 2^200 paths.
    let mut graph = triangle();
    let nodes: Vec<Value> = (0..200).map(|i| json!({ "children": [i + 1, i + 1] })).collect();
    graph.json["nodes"] = nodes.into();
    graph.push("nodes", json!({ "mesh": 0 }));
    let loaded = graph.load();
    assert_eq!(
        (loaded.scene.objects.len(), count(&loaded, WarningKind::NodeGraph)),
        (1, 200),
        "once"
    );
}

#[test]
fn unusable_transforms_leave_the_object_out() {
    for transform in [
        json!({ "mesh": 0, "scale": [0.0, 1.0, 1.0] }),
        json!({ "mesh": 0, "translation": [0.0, 1e300, 0.0] }),
        json!({ "mesh": 0, "scale": [1e200, 1e200, 1e200] }),
        json!({ "mesh": 0, "scale": [1e-200, 1.0, 1.0] }),
        json!({ "mesh": 0, "matrix": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0] }),
        json!({ "mesh": 0, "scale": [1e16, 1.0, 1.0] }),
    ] {
        let mut document = triangle();
        let description = transform.to_string();
        document.push("nodes", transform);
        let loaded = document.load();
        assert_eq!(
            loaded.scene.objects.len(),
            1,
            "{description}: only the other object"
        );
        assert_eq!(
            count(&loaded, WarningKind::BadTransform),
            1,
            "{description}: {:?}",
            loaded.warnings
        );
    }
}

#[test]
fn required_extensions_are_known_harmless_or_refused() {
    let mut document = triangle();
    for (name, part) in [
        ("KHR_draco_mesh_compression", "without mesh compression"),
        ("EXT_meshopt_compression", "without mesh compression"),
        ("KHR_mesh_quantization", "without mesh compression"),
        ("VENDOR_unheard_of", "without this extension"),
    ] {
        document.json["extensionsRequired"] = json!([name]);
        let error = document.try_load().expect_err("refused").to_string();
        assert!(error.contains(name) && error.contains(part), "{error}");
    }
    document.json["extensionsRequired"] = json!(["KHR_texture_transform", "KHR_materials_clearcoat"]);
    document.json["extensionsUsed"] = json!(["KHR_materials_clearcoat", "VENDOR_unheard_of"]);
    let loaded = document.load();
    assert_eq!(
        count(&loaded, WarningKind::Ignored),
        2,
        "looks and something optional"
    );
}

#[test]
fn containers_with_wrong_lengths_are_refused() {
    let good = triangle().glb();
    assert!(try_text("a.glb", &good).is_ok(), "as it should be");
    for length in [0u32, 11, 12, 19, u32::MAX] {
        let mut bytes = good.clone();
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        let error = try_text("a.glb", bytes).expect_err("a wrong length").to_string();
        assert!(error.contains("GLB"), "{length}: {error}");
    }
    for at in [12, 13, 14, 15, 16] {
        let mut bytes = good.clone();
        bytes[at] ^= 0xff;
        assert!(try_text("a.glb", bytes).is_err(), "chunk head changed at {at}");
    }
    assert!(try_text("a.glb", b"glTF").is_err(), "only the first word");
    assert!(try_text("a.glb", &good[..good.len() - 1]).is_err(), "cut");
    let error = try_text("a.gltf", "{ \"asset\": }")
        .expect_err("no JSON")
        .to_string();
    assert!(error.contains("line 1"), "{error}");
    let error = try_text("a.gltf", r#"{"asset":{"version":"1.0"}}"#)
        .expect_err("old")
        .to_string();
    assert!(error.contains("glTF 2"), "{error}");
    let no_binary = glb(triangle().json.to_string().as_bytes(), b"");
    assert!(
        matches!(try_text("a.glb", no_binary), Err(Error::Empty { .. })),
        "no buffers at all"
    );
}

#[test]
fn a_short_buffer_costs_what_lay_behind_its_end() {
    let mut document = triangle();
    let second = document.triangle();
    document.push("nodes", json!({ "mesh": second }));
    let length = document.bytes.len();
    document.json["buffers"] = json!([{ "byteLength": length }]);
    document.bytes.truncate(length - 20);
    let loaded = document.load();
    assert_eq!(loaded.scene.triangle_count(), 1, "the first mesh");
    assert_eq!(
        count(&loaded, WarningKind::BadPart),
        2,
        "the buffer's end and the second mesh"
    );
}

#[test]
fn animation_skin_and_morphs_are_left_at_rest() {
    let mut document = triangle();
    let mesh = &mut document.json["meshes"][0]["primitives"][0];
    mesh["targets"] = json!([{ "POSITION": 0 }]);
    document.json["nodes"][0]["skin"] = json!(5);
    let loaded = document.load();
    assert_eq!(count(&loaded, WarningKind::RestPose), 2, "morph and skin");
    assert_eq!(loaded.scene.triangle_count(), 1, "the mesh is there");
}

#[test]
fn primitives_of_a_mesh_become_one_mesh_with_materials() {
    let mut document = Document::new();
    let shared = document.floats(
        "VEC3",
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0],
    );
    let indices = [document.indices(&[0, 1, 2]), document.indices(&[2, 1, 3])];
    document.push("materials", json!({ "name": "a" }));
    document.push("materials", json!({ "name": "b" }));
    document.push(
        "meshes",
        json!({ "primitives": [
            { "attributes": { "POSITION": shared }, "indices": indices[0], "material": 1 },
            { "attributes": { "POSITION": shared }, "indices": indices[1], "material": 0 },
            { "attributes": { "POSITION": shared }, "indices": indices[1], "material": 9 },
        ]}),
    );
    document.push("nodes", json!({ "mesh": 0 }));
    let loaded = document.load();
    let Geometry::Mesh(id) = loaded.scene.objects[0].geometry else {
        panic!("a mesh")
    };
    let mesh = &loaded.scene.meshes[id.index()];
    assert_eq!(mesh.positions.len(), 9, "vertices in use only");
    let names: Vec<String> = triangles(&loaded.scene)
        .into_iter()
        .map(|(name, _)| name)
        .collect();
    assert_eq!(
        names,
        ["b", "a", ""],
        "a material that does not exist is the default one"
    );
}
