//! What the built-in scenes promise.

use super::*;
use glam::{Affine3A, Vec2, Vec3};

use crate::{Adjacency, Geometry, Light};

#[test]
fn every_demo_is_well_formed() {
    for demo in DEMOS {
        let scene = demo.build();
        assert_eq!(scene.name, demo.name, "the scene carries its name");
        assert!(
            !scene.cameras.is_empty() && !scene.lights.is_empty(),
            "{}: camera and light",
            demo.name
        );
        for mesh in &scene.meshes {
            assert!(mesh.is_valid(), "{}: mesh {}", demo.name, mesh.name);
            let material_ok = mesh.materials.iter().all(|m| m.index() < scene.materials.len());
            assert!(material_ok, "{}: materials of {}", demo.name, mesh.name);
        }
        for object in &scene.objects {
            if let Geometry::Primitive(primitive) = object.geometry {
                assert!(primitive.shape.is_valid(), "{}: {}", demo.name, object.name);
            }
        }
        for light in &scene.lights {
            let Light::Linear(light) = light else { continue };
            assert!(
                light.length() > 0.0 && light.flux > 0.0,
                "{}: light {}",
                demo.name,
                light.name
            );
        }
    }
}

#[test]
fn the_cylinder_scene_has_the_measures_of_the_paper() {
    let scene = build("cylinder-2").expect("built in");
    let Light::Linear(light) = &scene.lights[0] else {
        panic!("the light is linear")
    };
    assert!((light.length() - 50.0).abs() < 1e-12, "length 50");
    let middle = light.point(0.5);
    assert!(
        (middle.length() - 21.0).abs() < 1e-12,
        "21 units from the foot of the cylinder"
    );
    assert!(
        (middle.y / middle.length() - 0.5f64.sqrt()).abs() < 1e-12,
        "at 45 degrees"
    );
}

/// Scenes whose solids are made by `solid`.
const SOLID: [&str; 5] = ["rooms", "chains", "torus-capsule", "tea-stand", "bars"];

#[test]
fn triangle_counts_are_those_that_measurements_name() {
    let expected = [
        ("rooms", 15_006, 6),
        // The tori's, and two of the floor.
        ("chains", 73_728 + 2, 2),
        ("torus-capsule", 30_000, 1),
        ("tea-stand", 124_328, 3),
        ("bars", 64 * 12 + 2, 1),
    ];
    for (name, triangles, lights) in expected {
        let scene = build(name).expect("built in");
        assert_eq!(scene.triangle_count(), triangles, "triangles of {name}");
        assert_eq!(scene.lights.len(), lights, "lights of {name}");
    }
}

#[test]
fn solids_are_watertight_and_face_outwards() {
    for name in SOLID {
        let scene = build(name).expect("built in");
        for mesh in scene.meshes.iter().filter(|mesh| mesh.name != "floor") {
            let adjacency = Adjacency::new(&mesh.positions, &mesh.triangles);
            assert_eq!(
                (
                    adjacency.boundary_edges,
                    adjacency.non_manifold_edges,
                    adjacency.degenerate_faces
                ),
                (0, 0, 0),
                "{name}, {}: open edges, shared edges, triangles without area",
                mesh.name
            );
            assert!(
                !adjacency.edges.iter().any(|edge| edge.flipped),
                "{name}, {}: orientation",
                mesh.name
            );
            let volume: f32 = (0..mesh.triangles.len())
                .map(|i| {
                    let [a, b, c] = mesh.corners(i);
                    a.dot(b.cross(c)) / 6.0
                })
                .sum();
            assert!(
                volume > 0.0,
                "{name}, {}: encloses {volume} cubic metres",
                mesh.name
            );
        }
    }
}

#[test]
fn normals_stand_on_the_outer_side_of_every_triangle() {
    for name in SOLID {
        let scene = build(name).expect("built in");
        for mesh in scene.meshes.iter().filter(|mesh| !mesh.normals.is_empty()) {
            for (i, triangle) in mesh.triangles.iter().enumerate() {
                let [a, b, c] = mesh.corners(i);
                let face = (b - a).cross(c - a).normalize();
                for &v in triangle {
                    let normal = mesh.normals[v as usize];
                    assert!(
                        (normal.length() - 1.0).abs() < 1e-4,
                        "{name}, {}: unit normals",
                        mesh.name
                    );
                    assert!(
                        normal.dot(face) > 0.3,
                        "{name}, {}, triangle {i}: normal {normal} on a face towards {face}",
                        mesh.name
                    );
                }
            }
        }
    }
}

/// Points of a link's centre line.
fn link(place: Affine3A) -> impl Iterator<Item = Vec3> {
    (0..256).map(move |i| {
        let d = Vec2::from_angle(std::f32::consts::TAU * i as f32 / 256.0) * chains::RADIUS;
        place.transform_point3(Vec3::new(d.x, 0.0, d.y))
    })
}

#[test]
fn each_link_of_the_chain_hangs_in_its_two_neighbours_and_touches_no_other() {
    let places = chains::places();
    assert_eq!(places.len(), chains::LINKS, "links");
    for (i, &one) in places.iter().enumerate() {
        for (j, &other) in places.iter().enumerate().skip(i + 1) {
            // A circle is linked with another if it passes once through its disc; sides are signs of y in its frame.
            let inverse = one.inverse();
            let local: Vec<Vec3> = link(other).map(|p| inverse.transform_point3(p)).collect();
            let passes = (0..local.len()).filter(|&k| {
                let (a, b) = (local[k], local[(k + 1) % local.len()]);
                let middle = a.lerp(b, a.y / (a.y - b.y));
                (a.y < 0.0) != (b.y < 0.0) && middle.with_y(0.0).length() < chains::RADIUS
            });
            let neighbours = j == i + 1 || (i == 0 && j + 1 == places.len());
            assert_eq!(passes.count() % 2 == 1, neighbours, "links {i} and {j}");
            let nearest = local.iter().fold(f32::INFINITY, |nearest, p| {
                let across = p.with_y(0.0).length() - chains::RADIUS;
                nearest.min(across.hypot(p.y))
            });
            assert!(
                nearest > 2.0 * chains::WIRE,
                "links {i} and {j} are {nearest} m apart"
            );
        }
    }
}

/// Distance between a point and a triangle.
fn distance(point: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let segment = |p: Vec3, q: Vec3| {
        let along = q - p;
        let t = ((point - p).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        point.distance(p + t * along)
    };
    let normal = (b - a).cross(c - a).normalize();
    let foot = point - normal * (point - a).dot(normal);
    let inside = |p: Vec3, q: Vec3| (q - p).cross(foot - p).dot(normal) >= 0.0;
    let rim = segment(a, b).min(segment(b, c)).min(segment(c, a));
    if inside(a, b) && inside(b, c) && inside(c, a) {
        rim.min(point.distance(foot))
    } else {
        rim
    }
}

#[test]
fn the_torus_touches_the_capsule_and_both_stand_on_the_floor() {
    let scene = build("torus-capsule").expect("built in");
    let part = |name: &str| {
        let mesh = scene.meshes.iter().find(|mesh| mesh.name == name);
        mesh.expect("a mesh of that name")
    };
    let (capsule, torus) = (part("capsule"), part("torus"));
    for mesh in [capsule, torus] {
        let lowest = mesh.bounds().min.y;
        assert!(
            (-0.004..=0.0).contains(&lowest),
            "{} begins at {lowest} m",
            mesh.name
        );
    }
    // The capsule is the points within its radius of a segment along x.
    let bounds = capsule.bounds();
    let radius = 0.5 * bounds.size().z;
    let (height, half) = (bounds.center().y, 0.5 * bounds.size().x - radius);
    let deepest = torus.positions.iter().map(|p| {
        let nearest = Vec3::new(p.x.clamp(-half, half), height, 0.0);
        radius - p.distance(nearest)
    });
    let deepest = deepest.fold(f32::NEG_INFINITY, f32::max);
    assert!(
        (0.0005..0.003).contains(&deepest),
        "the torus reaches {deepest} m into the capsule"
    );
}

#[test]
fn nothing_stands_in_the_way_through_the_rooms() {
    let scene = build("rooms").expect("built in");
    let camera = &scene.cameras[0];
    let (eye, forward) = (camera.position.as_vec3(), camera.forward().as_vec3());
    let triangles: Vec<[Vec3; 3]> = scene
        .meshes
        .iter()
        .flat_map(|mesh| (0..mesh.triangles.len()).map(|i| mesh.corners(i)))
        .collect();
    // Round through all doorways, and 12 m straight on from the camera.
    let round = (0..72u8).map(|i| {
        let d = Vec2::from_angle(std::f32::consts::TAU * f32::from(i) / 72.0) * rooms::CIRCLE;
        Vec3::new(d.x, eye.y, d.y)
    });
    let straight = (0..=48u8).map(|i| eye + forward * (0.25 * f32::from(i)));
    for point in round.chain(straight) {
        for height in [0.4, eye.y] {
            let point = point.with_y(height);
            let nearest = triangles
                .iter()
                .fold(f32::INFINITY, |nearest, &t| nearest.min(distance(point, t)));
            assert!(nearest > 0.35, "something is {nearest} m from {point}");
        }
    }
}
