//! Polygons with more than three corners.

use glam::{DQuat, DVec3};
use llsr_io::WarningKind;
use proptest::prelude::*;

use crate::support::{area, area_vector, assert_no_warnings, count, obj, triangles};

fn polygon(corners: &[DVec3]) -> String {
    let mut text = String::new();
    for p in corners {
        text += &format!("v {:?} {:?} {:?}\n", p.x, p.y, p.z);
    }
    text += "f";
    for i in 1..=corners.len() {
        text += &format!(" {i}");
    }
    text + "\n"
}

fn flat(points: &[[f64; 2]]) -> Vec<DVec3> {
    points.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect()
}

#[test]
fn an_l_has_its_area_from_whichever_corner_it_starts() {
    let l = flat(&[
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 1.0],
        [1.0, 1.0],
        [1.0, 4.0],
        [0.0, 4.0],
    ]);
    let rotation = DQuat::from_scaled_axis(DVec3::new(0.3, -1.1, 0.7));
    for start in 0..l.len() {
        for reversed in [false, true] {
            let mut corners: Vec<DVec3> = (0..l.len()).map(|i| l[(start + i) % l.len()]).collect();
            if reversed {
                corners.reverse();
            }
            let turned: Vec<DVec3> = corners
                .iter()
                .map(|&p| rotation * p + DVec3::splat(1e4))
                .collect();
            let loaded = obj(&polygon(&turned));
            assert_no_warnings(&loaded);
            assert_eq!(loaded.scene.triangle_count(), 4, "six corners, four triangles");
            assert!(
                (area(&loaded.scene) - 7.0).abs() < 1e-4,
                "no overlap: {}",
                area(&loaded.scene)
            );
            let normal = rotation * if reversed { -DVec3::Z } else { DVec3::Z };
            assert!(
                (area_vector(&loaded.scene) - 7.0 * normal).length() < 1e-4,
                "turned as the outline"
            );
        }
    }
}

#[test]
fn a_slit_leads_to_a_hole() {
    // A square frame: once around outside, along the slit, once around inside, back.
    let frame = flat(&[
        [0.0, 0.0],
        [3.0, 0.0],
        [3.0, 3.0],
        [0.0, 3.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [2.0, 2.0],
        [2.0, 1.0],
        [1.0, 1.0],
    ]);
    let loaded = obj(&polygon(&frame));
    assert_no_warnings(&loaded);
    assert!(
        (area(&loaded.scene) - 8.0).abs() < 1e-5,
        "the hole stays open: {}",
        area(&loaded.scene)
    );
    for (_, [a, b, c]) in triangles(&loaded.scene) {
        let middle = (a + b + c) / 3.0;
        let in_hole = middle.x > 1.0 && middle.x < 2.0 && middle.y > 1.0 && middle.y < 2.0;
        assert!(!in_hole, "{middle} is outside of the hole");
    }
}

#[test]
fn corners_on_straight_edges_do_no_harm() {
    let square = flat(&[
        [0.0, 0.0],
        [1.0, 0.0],
        [2.0, 0.0],
        [2.0, 2.0],
        [1.0, 2.0],
        [0.0, 2.0],
        [0.0, 1.0],
    ]);
    let loaded = obj(&polygon(&square));
    assert_no_warnings(&loaded);
    assert!(
        (area(&loaded.scene) - 4.0).abs() < 1e-6,
        "area {}",
        area(&loaded.scene)
    );
    assert_eq!(loaded.scene.triangle_count(), 5, "each corner is used");
}

#[test]
fn repeated_corners_are_skipped() {
    let l = flat(&[
        [0.0, 0.0],
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 1.0],
        [1.0, 1.0],
        [1.0, 1.0],
        [1.0, 4.0],
        [0.0, 4.0],
        [0.0, 0.0],
    ]);
    let loaded = obj(&polygon(&l));
    assert_no_warnings(&loaded);
    assert_eq!(loaded.scene.triangle_count(), 4, "six places");
    assert!(
        (area(&loaded.scene) - 7.0).abs() < 1e-5,
        "area {}",
        area(&loaded.scene)
    );
    let back_and_forth = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 0.0]]);
    let loaded = obj(&format!("{}v 5 5 5\nf 1 2 5\n", polygon(&back_and_forth)));
    assert_eq!(
        count(&loaded, WarningKind::BadPolygon),
        1,
        "two places are no polygon"
    );
    assert_eq!(loaded.scene.triangle_count(), 1, "only the other one");
}

#[test]
fn crossing_and_empty_outlines_become_fans_with_a_warning() {
    for points in [
        &[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.5]][..],
        &[[0.0, 1.0], [0.6, -0.8], [-0.95, 0.3], [0.95, 0.3], [-0.6, -0.8]][..],
    ] {
        let loaded = obj(&polygon(&flat(points)));
        assert_eq!(
            count(&loaded, WarningKind::FannedPolygon),
            1,
            "{points:?}: {:?}",
            loaded.warnings
        );
        assert_eq!(
            loaded.scene.triangle_count(),
            points.len() - 2,
            "{points:?}: a fan"
        );
        let text = loaded.warnings[0].to_string();
        assert!(text.contains(&format!("line {}", points.len() + 1)), "{text}");
    }
    let line = obj(&format!(
        "{}v 9 9 9\nf 1 2 5\n",
        polygon(&flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]))
    ));
    assert_eq!(count(&line, WarningKind::FannedPolygon), 1, "corners on a line");
}

#[test]
fn polygons_out_of_plane_are_cut_and_warned_of() {
    let mut corners = flat(&[
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 1.0],
        [1.0, 1.0],
        [1.0, 4.0],
        [0.0, 4.0],
    ]);
    corners[3].z = 0.5;
    let loaded = obj(&polygon(&corners));
    assert_eq!(
        count(&loaded, WarningKind::NonPlanarPolygon),
        1,
        "half a metre of four"
    );
    assert_eq!(loaded.scene.triangle_count(), 4, "still four triangles");
    corners[3].z = 1e-3;
    assert_no_warnings(&obj(&polygon(&corners)));
}

#[test]
fn long_polygons_end_soon() {
    // A comb is the case in which each outline edge crosses many others of the first triangulation.
    let mut comb = Vec::new();
    for tooth in 0..3000 {
        let x = f64::from(tooth);
        comb.extend([[x, 0.0], [x + 0.25, 1e6], [x + 0.5, 0.0]]);
    }
    comb.extend([[3000.0, -1.0], [0.0, -1.0]]);
    let loaded = obj(&polygon(&flat(&comb)));
    assert!(loaded.scene.triangle_count() > 8000, "all of it is there");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any outline that winds once around a point without crossing itself keeps its area and orientation.
    #[test]
    fn star_shaped_outlines_keep_their_area(
        radii in prop::collection::vec(0.05f64..1.0, 4..40),
        turn in prop::array::uniform3(-3.0f64..3.0),
        offset in prop::array::uniform3(-100.0f64..100.0),
        scale in -3.0f64..3.0,
    ) {
        let scale = 10f64.powf(scale);
        let rotation = DQuat::from_scaled_axis(DVec3::from_array(turn));
        let n = radii.len();
        let plane: Vec<DVec3> = radii
            .iter()
            .enumerate()
            .map(|(i, r)| {
                let angle = std::f64::consts::TAU * i as f64 / n as f64;
                DVec3::new(angle.cos(), angle.sin(), 0.0) * *r
            })
            .collect();
        let exact: f64 = (0..n).map(|i| 0.5 * plane[i].cross(plane[(i + 1) % n]).z).sum::<f64>() * scale * scale;
        let corners: Vec<DVec3> =
            plane.iter().map(|&p| (rotation * p + DVec3::from_array(offset)) * scale).collect();
        let loaded = obj(&polygon(&corners));
        prop_assert_eq!(loaded.scene.triangle_count() as u64 + count(&loaded, WarningKind::CollapsedTriangle), n as u64 - 2);
        let tolerance = 1e-5 * scale * scale;
        prop_assert!((area(&loaded.scene) - exact).abs() < tolerance, "area {} is {exact}", area(&loaded.scene));
        let vector = area_vector(&loaded.scene);
        prop_assert!((vector - rotation * DVec3::Z * exact).length() < tolerance, "orientation");
    }
}
