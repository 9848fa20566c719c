//! The ways a light gets into a scene.

use std::f64::consts::PI;

use glam::{DMat3, DQuat, DVec3, Vec3};
use llsr_io::{Error, LoadOptions, Loaded, WarningKind, load_scene};
use llsr_scene::{EmissionLaw, Light, LinearLight, PhotometricUnit};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::support::{Document, Folder, area, assert_no_warnings, count};

/// A closed prism with `sides` sides along x from -0.5 to 0.5: positions and triangles.
fn prism(sides: u32, radius: f64) -> (Vec<DVec3>, Vec<u32>) {
    let mut positions = Vec::new();
    for x in [-0.5, 0.5] {
        positions.extend((0..sides).map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(sides)).sin_cos();
            DVec3::new(x, radius * cos, radius * sin)
        }));
        positions.push(DVec3::X * x);
    }
    let (far, n) = (sides + 1, sides);
    let mut indices = Vec::new();
    for i in 0..n {
        let j = (i + 1) % n;
        indices.extend([i, j, far + j, i, far + j, far + i]);
        indices.extend([n, j, i, far + n, far + i, far + j]);
    }
    (positions, indices)
}

/// A document whose material 0 ("lamp") is on these bodies, each a mesh and a node, and material 1 on a floor.
fn document(bodies: &[(Vec<DVec3>, Vec<u32>)], lamp: Value) -> Document {
    let mut document = Document::new();
    document.push("materials", lamp);
    document.push("materials", json!({ "name": "floor" }));
    for (positions, indices) in bodies {
        let flat: Vec<f32> = positions.iter().flat_map(|p| p.as_vec3().to_array()).collect();
        let mesh = document.mesh(&flat, indices);
        document.json["meshes"][mesh]["primitives"][0]["material"] = json!(0);
        document.push("nodes", json!({ "mesh": mesh }));
    }
    let floor = document.triangle();
    document.json["meshes"][floor]["primitives"][0]["material"] = json!(1);
    document.push("nodes", json!({ "name": "floor", "mesh": floor }));
    document
}

fn plain() -> Value {
    json!({ "name": "lamp" })
}

fn glowing(strength: f64) -> Value {
    json!({
        "name": "lamp", "emissiveFactor": [1.0, 0.5, 0.25],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": strength } },
    })
}

fn options(tubes: &[&str], lines: &[&str]) -> LoadOptions {
    LoadOptions {
        tubes: tubes.iter().map(|t| t.parse().expect("a request")).collect(),
        line_lights: lines.iter().map(|t| t.parse().expect("a request")).collect(),
        ..LoadOptions::default()
    }
}

fn try_with(document: &Document, options: &LoadOptions) -> Result<Loaded, Error> {
    let folder = Folder::new();
    load_scene(&folder.put("scene.glb", document.glb()), options)
}

fn linear(loaded: &Loaded) -> Vec<LinearLight> {
    let lights = loaded.scene.lights.iter();
    lights
        .map(|light| match light {
            Light::Linear(light) => {
                let mut light = light.clone();
                light.a += loaded.scene.origin;
                light.b += loaded.scene.origin;
                light
            }
            other => panic!("{other:?} is no line"),
        })
        .collect()
}

#[test]
fn a_tube_asked_for_becomes_a_light_and_leaves_the_geometry() {
    let options = LoadOptions {
        emission: EmissionLaw::Isotropic,
        ..options(&["lamp=36W"], &[])
    };
    let loaded = try_with(&document(&[prism(12, 0.02)], plain()), &options).expect("a readable file");
    assert_no_warnings(&loaded);
    let [light] = &linear(&loaded)[..] else {
        panic!("one light")
    };
    assert!(
        light.a.distance(DVec3::X * -0.5) < 1e-6 && light.b.distance(DVec3::X * 0.5) < 1e-6,
        "{light:?}"
    );
    assert_eq!(
        (light.flux, light.emission),
        (36.0, EmissionLaw::Isotropic),
        "as asked"
    );
    // The widths of a twelve-sided prism differ by 3.5 %.
    assert!(
        (light.radius / 0.02 - 1.0).abs() < 0.04,
        "radius {}",
        light.radius
    );
    assert_eq!(loaded.scene.unit, PhotometricUnit::Radiant, "watts");
    assert_eq!(
        loaded.scene.triangle_count(),
        1,
        "the tube blocks no light any more"
    );
}

#[test]
fn an_emissive_tube_gives_pi_times_luminance_times_area() {
    let document = document(&[prism(12, 0.02)], glowing(4000.0));
    let with_tube = area(
        &try_with(&document, &LoadOptions::default())
            .expect("readable")
            .scene,
    );
    let body = {
        let (positions, indices) = prism(12, 0.02);
        let corner = |i: usize| positions[indices[i] as usize];
        (0..indices.len() / 3)
            .map(|t| {
                0.5 * (corner(3 * t + 1) - corner(3 * t))
                    .cross(corner(3 * t + 2) - corner(3 * t))
                    .length()
            })
            .sum::<f64>()
    };
    assert!((with_tube - 0.5).abs() < 1e-6, "only the floor is left");
    let loaded = try_with(&document, &LoadOptions::default()).expect("a readable file");
    assert_no_warnings(&loaded);
    let light = &linear(&loaded)[0];
    let luminance = 4000.0 * (0.2126 + 0.5 * 0.7152 + 0.25 * 0.0722);
    assert!(
        (light.flux / (PI * luminance * body) - 1.0).abs() < 1e-5,
        "flux {}",
        light.flux
    );
    assert!(
        light
            .color
            .distance(Vec3::new(1.0, 0.5, 0.25) * (4000.0 / luminance) as f32)
            < 1e-5,
        "{}",
        light.color
    );
    assert_eq!(
        (light.emission, loaded.scene.unit),
        (EmissionLaw::Diffuse, PhotometricUnit::Luminous),
        "glTF's law and unit"
    );
    let asked = try_with(&document, &options(&["lamp=5lm"], &[])).expect("a readable file");
    assert_eq!(linear(&asked)[0].flux, 5.0, "a request goes before emission");
}

#[test]
fn thick_flat_and_short_parts_stay_geometry() {
    let scaled = |scale: DVec3| {
        let (positions, indices) = prism(12, 0.5);
        (
            positions.into_iter().map(|p| p * scale).collect::<Vec<_>>(),
            indices,
        )
    };
    for (scale, is_tube) in [
        (DVec3::new(10.1, 1.0, 1.0), true),
        (DVec3::new(9.9, 1.0, 1.0), false),
        (DVec3::new(15.2, 1.5, 1.02), true),
        (DVec3::new(20.0, 1.5, 0.9), false),
        (DVec3::new(1.0, 1.0, 0.01), false),
        (DVec3::new(100.0, 1.0, 0.0), false),
    ] {
        let loaded =
            try_with(&document(&[scaled(scale)], glowing(1.0)), &LoadOptions::default()).expect("readable");
        assert_eq!(loaded.scene.lights.len(), usize::from(is_tube), "{scale}");
        assert_eq!(
            count(&loaded, WarningKind::DarkEmitter),
            u64::from(!is_tube),
            "{scale}"
        );
        let result = try_with(&document(&[scaled(scale)], plain()), &options(&["lamp=1lm"], &[]));
        assert_eq!(result.is_ok(), is_tube, "{scale}: {result:?}");
        if let Err(error) = result {
            assert!(matches!(error, Error::NoTube { parts: 1, .. }), "{error}");
        }
    }
}

#[test]
fn parts_are_found_by_position_not_by_index() {
    // Two tubes and a box in one mesh, every triangle with vertices of its own.
    let mut positions = Vec::new();
    let (tube, tube_indices) = prism(6, 0.01);
    for offset in [0.0, 1.0] {
        positions.extend(tube_indices.iter().map(|&i| tube[i as usize] + DVec3::Y * offset));
    }
    let (cube, cube_indices) = prism(4, 0.5);
    positions.extend(cube_indices.iter().map(|&i| cube[i as usize] + DVec3::Y * 3.0));
    let indices: Vec<u32> = (0..positions.len() as u32).collect();
    let document = document(&[(positions, indices)], plain());
    let loaded = try_with(&document, &options(&["lamp=1lm"], &[])).expect("a readable file");
    let names: Vec<&str> = loaded.scene.lights.iter().map(Light::name).collect();
    assert_eq!(names, ["lamp", "lamp-2"], "two lights with names of their own");
    assert_eq!(count(&loaded, WarningKind::NotATube), 1, "the box");
    assert_eq!(loaded.scene.triangle_count(), 16 + 1, "box and floor");
}

#[test]
fn shared_meshes_are_judged_where_they_stand() {
    let mut document = document(&[prism(12, 0.02)], plain());
    document.json["nodes"] = json!([
        { "name": "a", "mesh": 0 },
        { "name": "b", "mesh": 0, "translation": [0.0, 2.0, 0.0], "scale": [2.0, 1.0, 1.0] },
        { "name": "short", "mesh": 0, "translation": [0.0, 4.0, 0.0], "scale": [0.1, 1.0, 1.0] },
        { "name": "floor", "mesh": 1 },
    ]);
    let loaded = try_with(&document, &options(&["lamp=1lm"], &[])).expect("a readable file");
    let lights = linear(&loaded);
    assert_eq!(lights.len(), 2, "the long ones");
    assert!(
        (lights[1].length() - 2.0).abs() < 1e-6 && (lights[1].a.y - 2.0).abs() < 1e-6,
        "{:?}",
        lights[1]
    );
    let names: Vec<&str> = loaded.scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["short", "floor"], "the short one stays");
    assert_eq!(count(&loaded, WarningKind::NotATube), 1, "with a warning");
}

#[test]
fn unknown_materials_list_the_nearest_first() {
    let document = document(&[prism(12, 0.02)], plain());
    let error = try_with(&document, &options(&["Lmap=1lm"], &[])).expect_err("no such material");
    let Error::UnknownMaterial { known, .. } = &error else {
        panic!("{error}")
    };
    assert_eq!(known, &["lamp", "floor"], "nearest first");
    assert!(error.to_string().contains(r#""lamp", "floor""#), "{error}");
}

#[test]
fn lumens_and_watts_do_not_mix() {
    let dark = document(&[prism(12, 0.02)], plain());
    let bright = document(&[prism(12, 0.02)], glowing(1.0));
    let mixed = |document: &Document, options: &LoadOptions| {
        matches!(try_with(document, options), Err(Error::MixedUnits { .. }))
    };
    assert!(
        mixed(&dark, &options(&["lamp=1lm"], &["0,0,0:1,0,0=1W"])),
        "two requests"
    );
    assert!(
        mixed(&bright, &options(&[], &["0,0,0:1,0,0=1W"])),
        "the file's light and a request"
    );
    assert!(
        !mixed(&dark, &options(&[], &["0,0,0:1,0,0=1W"])),
        "a file without lights has no unit"
    );
    assert!(
        !mixed(&bright, &options(&["lamp=1W"], &[])),
        "the file's light was replaced"
    );
    let radiant = LoadOptions {
        unit: Some(PhotometricUnit::Radiant),
        ..options(&[], &["0,0,0:1,0,0=1W"])
    };
    let loaded = try_with(&bright, &radiant).expect("both in watts");
    assert_eq!(
        (loaded.scene.unit, loaded.scene.lights.len()),
        (PhotometricUnit::Radiant, 2),
        "as said"
    );
    let mut stated = document(&[prism(12, 0.02)], plain());
    stated.json["asset"]["extras"] = json!({ "llsr": { "unit": "radiant" } });
    assert!(
        mixed(&stated, &options(&[], &["0,0,0:1,0,0=1lm"])),
        "the file's word and a request"
    );
}

#[test]
fn lines_asked_for_stand_in_the_files_frame() {
    let mut document = document(&[], plain());
    document.json["nodes"][0]["translation"] = json!([1e6, 0.0, 0.0]);
    let options = LoadOptions {
        emission: EmissionLaw::Isotropic,
        ..options(&[], &["1000000,2,-3:1000001.5,2,-3=7lm"])
    };
    let loaded = try_with(&document, &options).expect("a readable file");
    let light = &linear(&loaded)[0];
    assert!(light.a.distance(DVec3::new(1e6, 2.0, -3.0)) < 1e-9, "{}", light.a);
    assert!((light.length() - 1.5).abs() < 1e-9, "{}", light.length());
    assert_eq!(
        (light.flux, light.emission, light.radius),
        (7.0, EmissionLaw::Isotropic, 0.0),
        "as asked"
    );
    assert!(
        loaded.scene.lights[0].ends().0.length() < 10.0,
        "recentred with the rest"
    );
}

/// A floor and one punctual light on a node.
fn punctual(light: Value, node: Value) -> Loaded {
    let mut document = document(&[], plain());
    document.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
    let mut node = node;
    node["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    document.push("nodes", node);
    try_with(&document, &LoadOptions::default()).expect("a readable file")
}

#[test]
fn point_lights_with_a_length_are_linear_lights_along_x() {
    let extras = json!({ "llsr": { "length": 1.2, "emission": "isotropic", "radius": 0.013 }, "other": 3 });
    let s = std::f64::consts::FRAC_1_SQRT_2;
    // Turned so that x becomes y, in a node of half size.
    let node = json!({ "name": "tube", "translation": [1.0, 2.0, 3.0], "rotation": [0.0, 0.0, s, s], "scale": [0.5, 0.5, 0.5] });
    let source = json!({ "type": "point", "color": [1.0, 0.5, 0.0], "intensity": 100.0 });
    let mut on_node = node.clone();
    on_node["extras"] = extras.clone();
    let mut on_light = source.clone();
    on_light["extras"] = extras;
    for loaded in [punctual(source, on_node), punctual(on_light, node)] {
        assert_no_warnings(&loaded);
        let light = &linear(&loaded)[0];
        assert_eq!(light.name, "tube", "the node's name");
        assert!(light.a.distance(DVec3::new(1.0, 1.7, 3.0)) < 1e-9, "{}", light.a);
        assert!(light.b.distance(DVec3::new(1.0, 2.3, 3.0)) < 1e-9, "{}", light.b);
        assert!(
            (light.flux - 400.0 * PI).abs() < 1e-9,
            "4 pi candela: {}",
            light.flux
        );
        assert!(
            (llsr_scene::luminance(light.color) - 1.0).abs() < 1e-6,
            "luminance 1: {}",
            light.color
        );
        assert_eq!(
            (light.emission, light.radius),
            (EmissionLaw::Isotropic, 0.013),
            "extras"
        );
    }
    let loaded = punctual(
        json!({ "type": "point" }),
        json!({ "extras": { "llsr": { "length": 1.0 } } }),
    );
    assert_eq!(
        linear(&loaded)[0].emission,
        EmissionLaw::Diffuse,
        "the default law"
    );
}

#[test]
fn other_punctual_lights() {
    let loaded = punctual(
        json!({ "type": "point", "name": "bulb", "intensity": 10.0 }),
        json!({ "translation": [0, 3, 0] }),
    );
    let Light::Point(light) = &loaded.scene.lights[0] else {
        panic!("a point")
    };
    assert!((light.flux - 40.0 * PI).abs() < 1e-9, "flux {}", light.flux);
    assert!(
        (light.position + loaded.scene.origin).distance(DVec3::Y * 3.0) < 1e-9,
        "place"
    );
    let spot = punctual(json!({ "type": "spot", "spot": {} }), json!({}));
    assert_eq!(
        (
            spot.scene.lights.len(),
            count(&spot, WarningKind::UnsupportedLight)
        ),
        (0, 1),
        "no spots"
    );
    let zero = punctual(
        json!({ "type": "point" }),
        json!({ "extras": { "llsr": { "length": 0.0 } } }),
    );
    assert!(
        matches!(zero.scene.lights[0], Light::Point(_)),
        "no length, a point"
    );
    assert_eq!(count(&zero, WarningKind::ShortLight), 1, "with a warning");
    for (light, node) in [
        (json!({ "type": "point", "intensity": -1.0 }), json!({})),
        (
            json!({ "type": "point" }),
            json!({ "extras": { "llsr": { "length": -2.0 } } }),
        ),
        (
            json!({ "type": "point" }),
            json!({ "extras": { "llsr": { "length": 1e30 } } }),
        ),
    ] {
        let text = format!("{light} {node}");
        let loaded = punctual(light, node);
        assert_eq!(
            (loaded.scene.lights.len(), count(&loaded, WarningKind::BadLight)),
            (0, 1),
            "{text}"
        );
    }
    let black = punctual(json!({ "type": "point", "color": [0, 0, 0] }), json!({}));
    assert_eq!(
        black.scene.lights[0].color(),
        Vec3::ONE,
        "a colour without luminance became white"
    );
    for extras in [json!(5), json!("llsr"), json!({ "llsr": null }), json!([1])] {
        let loaded = punctual(json!({ "type": "point" }), json!({ "extras": extras }));
        assert!(
            matches!(loaded.scene.lights[0], Light::Point(_)),
            "foreign extras do not matter"
        );
        assert_no_warnings(&loaded);
    }
    let wrong = punctual(
        json!({ "type": "point" }),
        json!({ "extras": { "llsr": { "length": "long" } } }),
    );
    assert_eq!(count(&wrong, WarningKind::BadPart), 1, "ours but unreadable");
}

#[test]
fn a_file_may_be_nothing_but_lights() {
    let mut document = Document::new();
    document.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    let light = json!({ "KHR_lights_punctual": { "light": 0 } });
    document.push("nodes", json!({ "translation": [5, 0, 0], "extensions": light }));
    let loaded = document.load();
    assert_eq!(
        loaded.scene.origin,
        DVec3::new(5.0, 0.0, 0.0),
        "the lights' middle"
    );
}

#[test]
fn many_lights_are_named_in_time() {
    let mut document = document(&[], plain());
    let lights: Vec<Value> = (0..20_000)
        .map(|_| json!({ "type": "point", "name": "x" }))
        .collect();
    document.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
    for i in 0..20_000 {
        document.push(
            "nodes",
            json!({ "extensions": { "KHR_lights_punctual": { "light": i } } }),
        );
    }
    let loaded = document.load();
    let names: std::collections::HashSet<&str> = loaded.scene.lights.iter().map(Light::name).collect();
    assert_eq!(names.len(), 20_000, "all different");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// A tube of any place, direction and size is found, ends and all.
    #[test]
    fn planted_tubes_are_recovered(
        turn in prop::array::uniform3(-3.0f64..3.0),
        offset in prop::array::uniform3(-50.0f64..50.0),
        size in -2.0f64..2.0,
        thinness in 0.002f64..0.045,
        sides in 3u32..24,
        split in any::<bool>(),
    ) {
        let size = 10f64.powf(size);
        let rotation = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::from_array(turn)));
        let place = |p: DVec3| rotation * p * size + DVec3::from_array(offset) * size;
        let (positions, mut indices) = prism(sides, thinness);
        let mut positions: Vec<DVec3> = positions.into_iter().map(place).collect();
        if split {
            // Unwelded, as many exporters write.
            positions = indices.iter().map(|&i| positions[i as usize]).collect();
            indices = (0..positions.len() as u32).collect();
        }
        let document = document(&[(positions, indices)], plain());
        let loaded = try_with(&document, &options(&["lamp=1lm"], &[])).expect("a tube");
        let light = &linear(&loaded)[0];
        let mut ends = [place(DVec3::X * -0.5), place(DVec3::X * 0.5)];
        if (light.a - ends[0]).length() > (light.a - ends[1]).length() {
            ends.reverse();
        }
        let axis = light.b - light.a;
        prop_assert!(axis.max_element() >= -axis.min_element(), "the direction with the positive leading component");
        // File positions have single precision: 50 sizes times 6e-8, and twice that for recentring.
        for (got, want) in [(light.a, ends[0]), (light.b, ends[1])] {
            prop_assert!(got.distance(want) < 2e-5 * size, "{got} is {want}");
        }
        let circle = light.radius / (thinness * size);
        prop_assert!(circle > 0.7 && circle < 1.001, "radius {}", light.radius);
    }
}
