//! Cameras of glTF files.

use glam::{DMat3, DVec3};
use llsr_io::{Loaded, WarningKind};
use llsr_scene::{FieldOfView, Projection, Viewport};
use serde_json::{Value, json};

use crate::support::{Document, count};

fn with(finish: impl FnOnce(&mut Value)) -> Loaded {
    let mut document = Document::new();
    let mesh = document.triangle();
    document.push("nodes", json!({ "mesh": mesh, "translation": [1e6, 0.0, 0.0] }));
    finish(&mut document.json);
    document.load()
}

#[test]
fn perspective_and_orthographic_cameras_are_read_with_their_place() {
    let loaded = with(|json| {
        json["cameras"] = json!([
            { "type": "perspective", "perspective": { "yfov": 0.75, "znear": 0.1, "aspectRatio": 2.0 } },
            { "name": "map", "type": "orthographic", "orthographic": { "xmag": 1.0, "ymag": -3.0, "znear": 0.1, "zfar": 9.0 } },
        ]);
        let nodes = json["nodes"].as_array_mut().expect("nodes");
        // Scaled, and turned so that -z becomes x.
        let s = std::f64::consts::FRAC_1_SQRT_2;
        nodes.push(json!({
            "name": "eye", "camera": 0, "translation": [1e6, 0.03125, 2.0], "rotation": [0.0, -s, 0.0, s], "scale": [3.0, 3.0, 3.0],
        }));
        nodes.push(json!({ "camera": 1 }));
    });
    let [eye, map] = &loaded.scene.cameras[..] else {
        panic!("two cameras")
    };
    assert_eq!(
        (eye.name.as_str(), map.name.as_str()),
        ("eye", "map"),
        "the node's name goes first"
    );
    assert_eq!(
        eye.projection,
        Projection::Perspective(FieldOfView::Vertical(0.75)),
        "vertical angle"
    );
    assert_eq!(
        map.projection,
        Projection::Orthographic { height: 6.0 },
        "twice the magnification"
    );
    assert!(
        (eye.position + loaded.scene.origin - DVec3::new(1e6, 0.03125, 2.0)).length() < 1e-9,
        "place"
    );
    assert!(
        (eye.forward() - DVec3::X).length() < 1e-12,
        "looks along {}",
        eye.forward()
    );
    assert!(
        (eye.axes.transpose() * eye.axes).abs_diff_eq(DMat3::IDENTITY, 1e-12),
        "no scale is left"
    );
}

#[test]
fn cameras_of_converted_scenes_look_along_plus_z_with_x_to_the_left() {
    // At (1, 2, 3), looking along +x: forward is x, up is y, left is x rotated... z cross x = y, so left = y cross z = -z.
    let rows = "0 0 1 1000001  0 1 0 2  -1 0 0 3  0 0 0 1";
    let list: Vec<f64> = rows
        .split_whitespace()
        .map(|x| x.parse().expect("a number"))
        .collect();
    for (matrix, angle) in [(json!(rows), json!("60")), (json!(list), json!(60.0))] {
        let loaded = with(|json| {
            json["asset"]["extras"] =
                json!({ "camera_toWorld_mitsuba": matrix, "camera_fov_deg_x": angle, "more": [1] });
        });
        let camera = &loaded.scene.cameras[0];
        assert!(
            (camera.position + loaded.scene.origin - DVec3::new(1_000_001.0, 2.0, 3.0)).length() < 1e-9,
            "place"
        );
        assert!(
            (camera.forward() - DVec3::X).length() < 1e-12,
            "forward {}",
            camera.forward()
        );
        assert!(
            (camera.axes.x_axis - DVec3::Z).length() < 1e-12,
            "right is the other side of left"
        );
        let wide = Viewport {
            width: 200,
            height: 100,
        };
        let (_, corner) = camera.ray(wide, 200.0, 50.0);
        assert!(
            (corner.angle_between(DVec3::X).to_degrees() - 30.0).abs() < 1e-9,
            "60 degrees from side to side"
        );
    }
}

#[test]
fn unusable_cameras_are_left_out() {
    let lens = |yfov: f64| json!([{ "type": "perspective", "perspective": { "yfov": yfov, "znear": 0.1 } }]);
    for cameras in [
        lens(0.0),
        lens(-1.0),
        lens(4.0),
        json!([]),
        json!([{ "type": "perspective" }]),
        json!([{ "type": "fisheye" }]),
        json!([{ "type": "orthographic", "orthographic": { "xmag": 0, "ymag": 0, "znear": 0, "zfar": 1 } }]),
    ] {
        let text = cameras.to_string();
        let loaded = with(|json| {
            json["cameras"] = cameras;
            json["nodes"][0]["camera"] = json!(0);
        });
        assert!(loaded.scene.cameras.is_empty(), "{text}: no camera");
        assert_eq!(count(&loaded, WarningKind::BadCamera), 1, "{text}: a warning");
        assert_eq!(
            loaded.scene.objects.len(),
            1,
            "{text}: the mesh of that node is there"
        );
    }
    for extras in [
        json!({ "camera_toWorld_mitsuba": "1 0 0" }),
        json!({ "camera_toWorld_mitsuba": "a b c" }),
        json!({ "camera_toWorld_mitsuba": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0] }),
        json!({ "camera_toWorld_mitsuba": "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "camera_fov_deg_x": 180 }),
        json!({ "camera_toWorld_mitsuba": "1 0 0 1e99 0 1 0 0 0 0 1 0 0 0 0 1", "camera_fov_deg_x": 60 }),
    ] {
        let text = extras.to_string();
        let loaded = with(|json| json["asset"]["extras"] = extras);
        assert!(loaded.scene.cameras.is_empty(), "{text}: no camera");
        assert_eq!(count(&loaded, WarningKind::BadCamera), 1, "{text}: a warning");
    }
}
