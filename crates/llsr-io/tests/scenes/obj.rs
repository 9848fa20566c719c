//! OBJ text.

use glam::DVec3;
use llsr_io::{Error, WarningKind};
use llsr_scene::Geometry;

use crate::support::{
    Folder, area, area_vector, assert_no_warnings, count, obj, triangles, try_load, try_text,
};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn objects_groups_and_materials_become_objects_with_materials() {
    let text = format!(
        "{SQUARE}f 1 2 3\no lamp\nusemtl red paint\nf 1 2 3 4\nusemtl blue\nf 1 2 4\ng shade a\nf 2 3 4\no lamp\nf 1 3 4\n"
    );
    let scene = obj(&text).scene;
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(
        names,
        ["", "lamp", "lamp/shade a"],
        "an object that comes back is the same"
    );
    let mut materials: Vec<String> = triangles(&scene)
        .into_iter()
        .map(|(material, _)| material)
        .collect();
    materials.sort();
    assert_eq!(
        materials,
        ["", "blue", "blue", "blue", "red paint", "red paint"],
        "material of each triangle"
    );
}

#[test]
fn references_count_backwards_and_forwards() {
    let backwards = obj("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\n");
    assert_no_warnings(&backwards);
    assert!(
        (area(&backwards.scene) - 0.5).abs() < 1e-6,
        "the last three at that line"
    );
    let forwards = obj("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n");
    assert_no_warnings(&forwards);
    assert!((area(&forwards.scene) - 0.5).abs() < 1e-6, "vertices may follow");
}

#[test]
fn far_coordinates_keep_their_detail() {
    let far = |x: f64| format!("{:.6}", x + 1e6);
    let mut text = String::new();
    for i in 0..30 {
        let x = f64::from(i) * 1.25e-4;
        text += &format!("v {} {} {}\n", far(x), far(-2.0 * x), far(0.5));
        text += &format!(
            "v {} {} {}\nv {} {} {}\n",
            far(x),
            far(1.0),
            far(0.5),
            far(x + 1.0),
            far(0.0),
            far(1.5)
        );
        text += "f -3 -2 -1\n";
    }
    let loaded = obj(&text);
    assert_no_warnings(&loaded);
    for (i, (_, [p, ..])) in triangles(&loaded.scene).iter().enumerate() {
        let x = i as f64 * 1.25e-4;
        let want = DVec3::new(1e6 + x, 1e6 - 2.0 * x, 1e6 + 0.5);
        // Single precision alone would be off by up to 0.03.
        assert!((p - want).abs().max_element() < 2e-7, "{p} is {want}");
    }
}

#[test]
fn odd_text_is_read_as_it_was_meant() {
    // Continued lines, another line ending, Latin-1 bytes, comments behind data, curve weights, colours, a sign.
    let mut bytes = b"# caf\xe9\r\nv 0 0 \\\r\n 0 0.5\r\nv +1 0 0 # \xe9\r\nv 0 1e0 0 1 0.5 0\r\no caf\xe9\r\nf 1 2 \\\n\\\n 3\r\n".to_vec();
    bytes.extend(b"s off\nvp 0.1 0.2\n");
    let loaded = try_text("scene.obj", bytes).expect("a readable file");
    assert!(
        (area(&loaded.scene) - 0.5).abs() < 1e-6,
        "weights of curves do not move vertices"
    );
    assert_eq!(
        count(&loaded, WarningKind::BadText),
        2,
        "the bad byte of line 4 and of the name"
    );
    assert_eq!(count(&loaded, WarningKind::Ignored), 1, "the colour");
    assert_eq!(loaded.scene.objects[0].name, "caf\u{fffd}", "a replaced letter");
    let text = loaded
        .warnings
        .iter()
        .find(|w| w.kind == WarningKind::BadText)
        .expect("a warning")
        .to_string();
    assert!(
        text.contains("line 4, line 6"),
        "lines are counted as in the file: {text}"
    );
}

#[test]
fn marks_and_line_ends_of_other_systems() {
    for text in [
        "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 0\rv 1 0 0\r# comment\rv 0 1 0\rf 1 2 3\r",
        "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3",
    ] {
        let loaded = obj(text);
        assert_no_warnings(&loaded);
        assert!((area(&loaded.scene) - 0.5).abs() < 1e-6, "{text:?}");
    }
}

#[test]
fn bad_vertices_take_only_their_faces_along() {
    for bad in ["nan 0 0", "0 inf 0", "1e400 0 0", "0 0 -1e16", "0 0", "0 x 0", ""] {
        let loaded = obj(&format!("{SQUARE}v {bad}\nf 1 2 3\nf 1 2 5\nf 3 4 1\n"));
        assert_eq!(loaded.scene.triangle_count(), 2, "v {bad}: two faces are left");
        let kinds = count(&loaded, WarningKind::BadVertex) + count(&loaded, WarningKind::BadStatement);
        assert_eq!(kinds, 1, "v {bad}: one warning");
        let text = loaded.warnings[0].to_string();
        assert!(text.contains("line 5"), "{text}");
    }
}

#[test]
fn bad_faces_are_left_out_and_named() {
    for (face, kind) in [
        ("1 2 9", WarningKind::BadIndex),
        ("1 2 -9", WarningKind::BadIndex),
        ("0 1 2", WarningKind::BadIndex),
        ("1 2 99999999999999999999", WarningKind::BadStatement),
        ("1 2 9223372036854775807", WarningKind::BadIndex),
        ("1 2 -9223372036854775808", WarningKind::BadIndex),
        ("1 2 x", WarningKind::BadStatement),
        ("1 2 /3", WarningKind::BadIndex),
        ("1/1/1/1 2 3", WarningKind::BadStatement),
        ("1 2", WarningKind::BadPolygon),
        ("", WarningKind::BadPolygon),
    ] {
        let loaded = obj(&format!("{SQUARE}f 1 2 3\nf {face}\n"));
        assert_eq!(
            loaded.scene.triangle_count(),
            1,
            "f {face}: the good face is left"
        );
        assert_eq!(count(&loaded, kind), 1, "f {face}: {:?}", loaded.warnings);
        assert!(
            loaded.warnings[0].to_string().contains("line 6"),
            "f {face}: {}",
            loaded.warnings[0]
        );
    }
}

#[test]
fn normals_and_coordinates_are_used_where_all_corners_have_them() {
    let attributes = "vt 0.25 0.25\nvt 0.5\nvt nan 0\nvn 0 0 2\nvn 0 0 0\n";
    let mesh_of = |face: &str| {
        let loaded = obj(&format!("{SQUARE}{attributes}f {face}\n"));
        let Geometry::Mesh(id) = loaded.scene.objects[0].geometry else {
            panic!("a mesh")
        };
        (loaded.scene.meshes[id.index()].clone(), loaded.warnings)
    };
    let (mesh, _) = mesh_of("1/1/1 2/2/1 3/1/1");
    assert_eq!(mesh.normals[0], glam::Vec3::Z, "unit length");
    assert_eq!(mesh.uvs[0], glam::Vec2::new(0.25, 0.75), "v from the top");
    assert_eq!(mesh.uvs[1], glam::Vec2::new(0.5, 1.0), "a missing number is 0");
    for face in ["1/1 2 3/1", "1/3 2/1 3/1", "1/9 2/1 3/1"] {
        let (mesh, warnings) = mesh_of(face);
        assert!(
            mesh.uvs.is_empty() && mesh.triangles.len() == 1,
            "f {face}: without coordinates"
        );
        assert!(!warnings.is_empty(), "f {face}: with a warning");
    }
    for face in ["1//1 2//2 3//1", "1//1 2 3", "1//1 2//7 3//1"] {
        let (mesh, _) = mesh_of(face);
        assert!(
            mesh.normals.is_empty() && mesh.triangles.len() == 1,
            "f {face}: flat"
        );
    }
}

#[test]
fn faces_without_normals_are_flat_beside_faces_with() {
    let loaded = obj(&format!(
        "{SQUARE}vn 0 0 1\nvt 0 0\nf 1//1 2//1 3//1\nf 1/1 3/1 4/1\nf 1 2 4\n"
    ));
    let meshes: Vec<_> = loaded
        .scene
        .meshes
        .iter()
        .map(|m| (m.normals.len(), m.uvs.len(), m.triangles.len()))
        .collect();
    assert_eq!(
        meshes,
        [(0, 6, 2), (3, 0, 1)],
        "one mesh of each kind, coordinates filled up"
    );
}

#[test]
fn collapsed_triangles_go_and_needles_stay() {
    let loaded = obj("v 0 0 0\nv 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\nf 1 3 5\n");
    assert_eq!(
        count(&loaded, WarningKind::CollapsedTriangle),
        1,
        "two corners in one place"
    );
    assert_eq!(count(&loaded, WarningKind::Needle), 1, "three corners on a line");
    assert_eq!(
        loaded.scene.triangle_count(),
        2,
        "the needle holds its neighbours together"
    );
}

#[test]
fn lines_points_and_curves_are_ignored() {
    let loaded = obj(&format!(
        "{SQUARE}l 1 2\np 1\ncstype bezier\ncurv 0 1 1 2 3\nend\nf 1 2 3\nnonsense 1\n"
    ));
    assert_eq!(count(&loaded, WarningKind::Ignored), 5, "five statements");
    assert_eq!(
        count(&loaded, WarningKind::BadStatement),
        1,
        "one is no statement at all"
    );
}

#[test]
fn files_without_anything_say_why() {
    let error = try_text("scene.obj", "v 0 0 0\nf 1 1 7\n")
        .expect_err("empty")
        .to_string();
    assert!(
        error.contains("no usable geometry") && error.contains("line 2"),
        "{error}"
    );
    assert!(
        matches!(try_text("scene.obj", ""), Err(Error::Empty { .. })),
        "an empty file"
    );
    assert!(
        matches!(try_text("scene.ply", "ply"), Err(Error::Ending { .. })),
        "another format"
    );
    let folder = Folder::new();
    let error = try_load(&folder.path("missing.obj"))
        .expect_err("missing")
        .to_string();
    assert!(error.contains("missing.obj"), "{error}");
    std::fs::create_dir(folder.path("folder.obj")).expect("a folder");
    assert!(
        try_load(&folder.path("folder.obj")).is_err(),
        "a folder is no file"
    );
}

#[test]
fn the_frame_is_right_handed_as_written() {
    let loaded = obj(&format!("{SQUARE}f 1 2 3 4\n"));
    assert!(
        (area_vector(&loaded.scene) - DVec3::Z).length() < 1e-6,
        "counter-clockwise seen from +z"
    );
    assert_eq!(loaded.scene.origin, DVec3::new(0.5, 0.5, 0.0), "recentred");
}
