//! Curves in which surfaces meet: planted ones, ones found pair by pair, and surfaces that only touch.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_edges::{MeetingOptions, Meetings, SceneEdgeOptions, SceneEdges};
use llsr_scene::{MaterialId, Mesh, ObjectId, Scene};
use llsr_testkit::edges::{cube_cloud, torus};
use proptest::prelude::*;

fn meetings(meshes: Vec<(Mesh, Affine3A)>) -> Meetings {
    let mut scene = Scene::new("meetings");
    for (mesh, transform) in meshes {
        let object = scene.add_mesh(mesh);
        scene.objects[object.index()].transform = transform;
    }
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    Meetings::new(&edges, MeetingOptions::default())
}

fn still(meshes: Vec<Mesh>) -> Meetings {
    meetings(
        meshes
            .into_iter()
            .map(|mesh| (mesh, Affine3A::IDENTITY))
            .collect(),
    )
}

fn cuboid(min: [f32; 3], max: [f32; 3]) -> Mesh {
    Mesh::cuboid("", min.into(), max.into(), MaterialId(0))
}

/// A square of the plane y = 0, `half` to each side.
fn ground(half: f32) -> Mesh {
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    Mesh::quad(
        "",
        corners.map(|[x, z]| half * Vec3::new(x, 0.0, z)),
        MaterialId(0),
    )
}

fn length(found: &Meetings) -> f64 {
    let lengths = found.iter().map(|meeting| {
        let [a, b] = meeting.segment.map(|p| p.as_dvec3());
        a.distance(b)
    });
    lengths.sum()
}

/// How many pieces end at each place.
fn ends(found: &Meetings) -> HashMap<[u32; 3], usize> {
    let mut ends = HashMap::new();
    for p in found.iter().flat_map(|meeting| meeting.segment) {
        *ends.entry(p.to_array().map(|c| (c + 0.0).to_bits())).or_default() += 1;
    }
    ends
}

fn turned(axis: [f32; 3], angle: f32, by: [f32; 3]) -> Affine3A {
    let axis = Vec3::from(axis).try_normalize().unwrap_or(Vec3::Y);
    Affine3A::from_rotation_translation(Quat::from_axis_angle(axis, angle), by.into())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// A post through the ground has a rectangle around it, wherever both are.
    #[test]
    fn a_box_through_a_plane_has_a_closed_rectangle_around_it(
        half in prop::array::uniform2(0.05f32..0.9),
        below in 0.01f32..2.0,
        above in 0.01f32..2.0,
        axis in prop::array::uniform3(-1.0f32..1.0),
        angle in 0.0f32..6.0,
        by in prop::array::uniform3(-20.0f32..20.0),
    ) {
        let to = turned(axis, angle, by);
        let [x, z] = half;
        let post = cuboid([-x, -below, -z], [x, above, z]);
        let found = meetings(vec![(ground(2.0), to), (post, to)]);
        let perimeter = 4.0 * (f64::from(x) + f64::from(z));
        prop_assert!((length(&found) - perimeter).abs() < 2e-4, "{} for {perimeter}", length(&found));
        let back = to.inverse();
        for meeting in found.iter() {
            prop_assert_eq!(meeting.objects, [ObjectId(0), ObjectId(1)]);
            for p in meeting.segment.map(|p| back.transform_point3(p)) {
                let on_side = (p.x.abs() - x).abs().min((p.z.abs() - z).abs());
                prop_assert!(p.y.abs() < 5e-5 && on_side < 5e-5, "{p} is on no side");
            }
        }
        for (place, count) in ends(&found) {
            prop_assert_eq!(count, 2, "the rectangle is open at {:?}", place.map(f32::from_bits));
        }
    }

    /// Every pair of triangles against segments that are cut by a triangle, which knows no planes in common.
    #[test]
    fn two_triangles_cross_where_sides_of_one_go_through_the_other(
        corners in prop::array::uniform6(prop::array::uniform3(-1.0f32..1.0)),
    ) {
        let [a, b, c, d, e, f] = corners.map(Vec3::from);
        let two = [[a, b, c], [d, e, f]];
        let meshes = two.map(|corners| Mesh::new("", corners.to_vec(), vec![[0, 1, 2]], MaterialId(0)));
        let found = still(meshes.to_vec());
        let mut places: Vec<DVec3> = Vec::new();
        for [of, by] in [[0, 1], [1, 0]] {
            for i in 0..3 {
                places.extend(through([two[of][i], two[of][(i + 1) % 3]], two[by]));
            }
        }
        prop_assume!(places.len() != 2 || places[0].distance(places[1]) > 1e-4);
        prop_assert_eq!(found.len(), usize::from(places.len() == 2), "{:?}", places);
        for meeting in found.iter() {
            for end in meeting.segment {
                let near = places.iter().map(|p| p.distance(end.as_dvec3())).fold(f64::MAX, f64::min);
                prop_assert!(near < 1e-4, "{} from where a side goes through", near);
            }
        }
    }
}

/// Where a segment goes through a triangle, by barycentric coordinates.
fn through([p, q]: [Vec3; 2], [a, b, c]: [Vec3; 3]) -> Option<DVec3> {
    let [p, q, a, b, c] = [p, q, a, b, c].map(|v| v.as_dvec3());
    let matrix = glam::DMat3::from_cols(b - a, c - a, p - q);
    let solution = matrix.inverse() * (p - a);
    let (u, v, t) = (solution.x, solution.y, solution.z);
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&t);
    inside.then(|| p + (q - p) * t)
}

#[test]
fn a_torus_cut_through_its_middle_has_two_circles() {
    // Corners of the torus lie in the plane, so whole edges do.
    for rows in [96, 97] {
        let found = still(vec![torus(1.0, 0.3, rows, 48), ground(2.0)]);
        let (mut inner, mut outer) = (0.0, 0.0);
        for meeting in found.iter() {
            let [a, b] = meeting.segment.map(|p| p.as_dvec3());
            assert!(
                a.y.abs() < 1e-5 && b.y.abs() < 1e-5,
                "{a} to {b} is not in the plane"
            );
            let sum = if a.length() < 1.0 { &mut inner } else { &mut outer };
            *sum += a.distance(b);
        }
        for (sum, radius) in [(inner, 0.7), (outer, 1.3)] {
            let circle = TAU * radius;
            assert!(
                sum < circle && sum > 0.998 * circle,
                "{sum} for a circle of {circle}"
            );
        }
        assert!(
            ends(&found).values().all(|&count| count == 2),
            "both circles are closed"
        );
    }
}

#[test]
fn what_touches_or_coincides_does_not_meet() {
    let table = || cuboid([-1.0, 0.0, -1.0], [1.0, 0.1, 1.0]);
    let cases = [
        ("on the ground", vec![ground(3.0), table()]),
        (
            "under a ceiling",
            vec![cuboid([-0.1, -1.0, -0.1], [0.1, 0.0, 0.1]), ground(3.0)],
        ),
        ("twice the same", vec![table(), table()]),
        (
            "side by side",
            vec![table(), cuboid([1.0, 0.0, -1.0], [2.0, 0.1, 1.0])],
        ),
        ("apart", vec![table(), cuboid([3.0, 0.0, 0.0], [4.0, 1.0, 1.0])]),
        ("alone", vec![torus(1.0, 0.3, 20, 12)]),
    ];
    for (what, meshes) in cases {
        let found = still(meshes);
        assert!(found.is_empty(), "{what}: {:?}", found.iter().collect::<Vec<_>>());
    }
}

#[test]
fn parts_of_one_mesh_meet_like_objects() {
    let mut cross = cuboid([-1.0, -0.1, -0.1], [1.0, 0.1, 0.1]);
    cross.append(&cuboid([-0.2, -1.0, -0.05], [0.2, 1.0, 0.05]));
    let found = still(vec![cross]);
    assert!(
        found.iter().all(|meeting| meeting.objects == [ObjectId(0); 2]),
        "its own parts"
    );
    // The thinner bar enters above and leaves below: two rectangles of 0.4 by 0.1.
    assert!((length(&found) - 2.0).abs() < 1e-5, "{}", length(&found));
}

#[test]
fn a_heap_of_boxes_is_found_whole_and_can_be_cut_short() {
    let mut scene = Scene::new("heap");
    scene.add_mesh(cube_cloud(60, 0.3, 4));
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let found = Meetings::new(&edges, MeetingOptions::default());
    assert!(!found.is_cut_short(), "a small heap");
    // Each box's faces against each other box's, without a tree.
    let mesh = edges.mesh_of(ObjectId(0)).expect("a mesh");
    let faces: Vec<[Vec3; 3]> = (0..mesh.faces().len() as u32)
        .map(|face| mesh.corners(face).map(|p| p.as_vec3()))
        .collect();
    let mut expected = 0.0;
    for i in 0..faces.len() {
        for j in 0..i / 12 * 12 {
            let sides = |of: [Vec3; 3], by: [Vec3; 3]| {
                (0..3)
                    .filter_map(move |k| through([of[k], of[(k + 1) % 3]], by))
                    .collect::<Vec<_>>()
            };
            let places = [sides(faces[i], faces[j]), sides(faces[j], faces[i])].concat();
            if let [p, q] = places[..] {
                expected += p.distance(q);
            }
        }
    }
    let sum = length(&found);
    assert!(
        (sum - expected).abs() < 1e-3 * expected && expected > 10.0,
        "{sum} for {expected}"
    );

    // The same box 3000 times, a little apart: all pairs meet, which is not tried.
    let mut heap = Mesh::default();
    for i in 0..3000u32 {
        let shift = Vec3::splat(1e-4 * i as f32);
        heap.append(&Mesh::cuboid("", shift, shift + 1.0, MaterialId(0)));
    }
    let mut scene = Scene::new("all in one");
    scene.add_mesh(heap);
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let few = Meetings::new(
        &edges,
        MeetingOptions {
            most_pairs: 1,
            ..MeetingOptions::default()
        },
    );
    assert!(few.is_cut_short(), "more than a million pairs");
    assert!(few.len() <= (1 << 20) + 36_000, "no more pieces than pairs");
}
