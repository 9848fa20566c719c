//! The edges of scenes: instances, primitives, pictures and broken input.

use std::collections::HashMap;

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_edges::{
    EdgeClass, EdgeOptions, EdgeWarning, Eye, MeshEdges, SceneEdgeOptions, SceneEdges, SceneFound,
    SceneScratch, SceneView,
};
use llsr_scene::{
    Camera, FieldOfView, Geometry, MaterialId, Mesh, MeshId, Object, ObjectId, Primitive, Projection, Scene,
    Shape, Viewport, demo,
};
use llsr_testkit::edges::{SilhouetteOracle, View, bumpy_sphere, random_roofs, torus};

const EYE: DVec3 = DVec3::new(6.0, 4.0, 9.0);

fn from(eye: Eye) -> SceneView<'static> {
    SceneView::Eye { eye, chords: 64 }
}

fn find(edges: &SceneEdges, view: SceneView<'_>) -> SceneFound {
    let mut found = SceneFound::default();
    edges.find(view, None, &mut SceneScratch::default(), &mut found);
    found
}

fn sorted(found: &SceneFound, object: ObjectId, class: EdgeClass) -> Vec<u32> {
    let of = found.iter().filter(|e| e.object == object && e.class == class);
    let mut edges: Vec<u32> = of.map(|e| e.edge).collect();
    edges.sort_unstable();
    edges
}

fn instances() -> Scene {
    let mut scene = Scene::new("instances");
    scene.add_mesh(torus(1.0, 0.3, 20, 12));
    scene.add_mesh(random_roofs(60, 0.1, 3));
    for (i, scale) in [(1.0f32, 0.7), (2.0, -1.3), (3.0, 1.0)] {
        let transform = Affine3A::from_scale_rotation_translation(
            Vec3::new(scale, scale.abs(), 1.2),
            Quat::from_rotation_y(0.8 * i),
            Vec3::new(2.5 * i - 4.0, 0.4 * i, -i),
        );
        scene.add_object(Object {
            name: format!("instance {i}"),
            geometry: Geometry::Mesh(MeshId(i as u32 % 2)),
            transform,
        });
    }
    scene
}

#[test]
fn every_instance_has_the_silhouette_of_its_moved_mesh() {
    let scene = instances();
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    for eye in [Eye::At(EYE), Eye::Towards(DVec3::new(0.3, 0.5, -1.0))] {
        let found = find(&edges, from(eye));
        let mut all = 0;
        for index in 0..scene.objects.len() {
            let id = ObjectId::from(index);
            let Geometry::Mesh(mesh) = scene.objects[index].geometry else {
                panic!("meshes only")
            };
            let to_object = edges.to_object(id).expect("invertible");
            let mesh = &scene.meshes[mesh.index()];
            let oracle = SilhouetteOracle::new(&mesh.positions, &mesh.triangles);
            let view = match eye {
                Eye::At(p) => View::At(to_object.transform_point3(p)),
                Eye::Towards(d) => View::Towards(to_object.transform_vector3(d)),
            };
            let own = edges.mesh_of(id).expect("prepared");
            let mut names: Vec<_> = sorted(&found, id, EdgeClass::Silhouette)
                .into_iter()
                .map(|edge| SilhouetteOracle::name(own.segment(edge)))
                .collect();
            names.sort_unstable();
            assert_eq!(names, oracle.silhouettes(view), "object {index} from {eye:?}");
            all += names.len();
            let boundary = sorted(&found, id, EdgeClass::Boundary);
            assert_eq!(boundary, own.boundaries().collect::<Vec<_>>(), "object {index}");
        }
        assert!(all > 100, "{all} silhouette edges");
    }
}

#[test]
fn segments_are_where_the_object_stands() {
    let scene = instances();
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let found = find(&edges, from(Eye::At(EYE)));
    for edge in found.iter() {
        let own = edges.mesh_of(edge.object).expect("prepared");
        let transform = scene.objects[edge.object.index()].transform;
        let expected = own.segment(edge.edge).map(|p| transform.transform_point3(p));
        assert_eq!(edge.segment, expected, "object {:?}", edge.object);
    }
    let runs: usize = found.runs().iter().map(|run| run.range().len()).sum();
    assert_eq!(runs, found.len(), "runs cover all edges");
}

#[test]
fn moving_an_object_is_the_same_as_preparing_the_moved_scene() {
    let mut scene = instances();
    let mut edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let before = find(&edges, from(Eye::At(EYE)));
    let moved = Affine3A::from_rotation_translation(Quat::from_rotation_x(0.5), Vec3::new(0.3, 1.0, -2.0));
    let id = ObjectId(3);
    edges.set_transform(id, moved);
    scene.objects[id.index()].transform = moved;
    let fresh = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let found = find(&edges, from(Eye::At(EYE)));
    assert_eq!(found, find(&fresh, from(Eye::At(EYE))), "moved or built anew");
    assert_ne!(found, before, "the move is seen");
    assert_eq!(edges.transform(id), moved);
}

#[test]
fn only_listed_objects_are_looked_at() {
    let scene = instances();
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let all = find(&edges, from(Eye::At(EYE)));
    let mut some = SceneFound::default();
    let visible = [ObjectId(4), ObjectId(2)];
    edges.find(
        from(Eye::At(EYE)),
        Some(&visible),
        &mut SceneScratch::default(),
        &mut some,
    );
    for object in (0..scene.objects.len()).map(ObjectId::from) {
        for class in EdgeClass::ALL {
            let expected = if visible.contains(&object) {
                sorted(&all, object, class)
            } else {
                Vec::new()
            };
            assert_eq!(sorted(&some, object, class), expected, "{object:?} {class:?}");
        }
    }
}

#[test]
fn creases_follow_the_angle_of_their_mesh() {
    let mut scene = Scene::new("two cubes");
    for x in [-2.0, 2.0] {
        let corner = Vec3::new(x, 0.0, 0.0);
        scene.add_mesh(Mesh::cuboid("cube", corner, corner + Vec3::ONE, MaterialId(0)));
    }
    let count = |options: &SceneEdgeOptions| {
        let found = find(&SceneEdges::new(&scene, options), from(Eye::At(EYE)));
        [0, 1].map(|i| sorted(&found, ObjectId(i), EdgeClass::Crease).len())
    };
    assert_eq!(count(&SceneEdgeOptions::default()), [3, 3]);
    assert_eq!(count(&SceneEdgeOptions::with_crease_degrees(95.0)), [0, 0]);
    let own = SceneEdgeOptions {
        crease_degrees_of: vec![(MeshId(1), 10.0), (MeshId(1), 120.0)],
        ..SceneEdgeOptions::default()
    };
    assert_eq!(count(&own), [3, 0], "the second cube has its own");
}

fn primitives() -> Scene {
    let mut scene = Scene::new("primitives");
    let material = MaterialId(0);
    let mut add = |shape| scene.add_primitive("", Primitive { shape, material });
    add(Shape::Cylinder {
        a: Vec3::ZERO,
        b: Vec3::new(0.2, 1.0, 0.1),
        radius: 0.4,
        capped: true,
    });
    add(Shape::Cone {
        base: Vec3::X * 2.0,
        apex: Vec3::new(2.0, 1.5, 0.0),
        radius: 0.5,
        capped: true,
    });
    add(Shape::Sphere {
        center: Vec3::X * 4.0,
        radius: 0.6,
    });
    scene
}

#[test]
fn outlines_of_closed_primitives_are_closed_chains() {
    let mut scene = primitives();
    for object in &mut scene.objects {
        object.transform =
            Affine3A::from_scale_rotation_translation(Vec3::new(1.0, 0.7, 1.3), Quat::IDENTITY, Vec3::Z);
    }
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    for eye in [
        Eye::At(EYE),
        Eye::At(DVec3::new(2.0, -3.0, 7.0)),
        Eye::Towards(DVec3::new(1.0, 0.4, 2.0)),
    ] {
        let found = find(&edges, from(eye));
        for object in (0..3).map(ObjectId) {
            // The ends of silhouettes pair up: the outline of a closed surface is closed.
            let mut ends: HashMap<[u32; 3], usize> = HashMap::new();
            let of = found.iter().filter(|e| e.object == object);
            for end in of
                .filter(|e| e.class == EdgeClass::Silhouette)
                .flat_map(|e| e.segment)
            {
                *ends.entry(end.to_array().map(f32::to_bits)).or_default() += 1;
            }
            assert!(ends.len() >= 16, "{object:?}: {} ends", ends.len());
            assert!(
                ends.values().all(|&n| n == 2),
                "{object:?} from {eye:?}: {ends:?}"
            );
        }
    }
}

#[test]
fn rims_are_creases_where_both_sides_are_seen() {
    let edges = SceneEdges::new(&primitives(), &SceneEdgeOptions::default());
    let found = find(&edges, from(Eye::At(EYE)));
    let count = |object: u32, class| sorted(&found, ObjectId(object), class).len();
    assert!(count(0, EdgeClass::Crease) > 10, "the near half of the upper rim");
    assert_eq!(
        count(0, EdgeClass::Boundary),
        0,
        "a closed cylinder has no boundary"
    );
    assert_eq!(count(2, EdgeClass::Crease), 0, "a sphere has no creases");
    let blunt = SceneEdges::new(&primitives(), &SceneEdgeOptions::with_crease_degrees(95.0));
    let found = find(&blunt, from(Eye::At(EYE)));
    assert_eq!(
        sorted(&found, ObjectId(0), EdgeClass::Crease),
        [],
        "right angles are blunter"
    );
}

#[test]
fn objects_outside_the_picture_are_left_out_and_no_others() {
    let scene = demo::build("subway").expect("built in");
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let viewport = Viewport {
        width: 300,
        height: 200,
    };
    let mut camera = scene.cameras[0].clone();
    let mut left_out = 0;
    for turn in 0..8 {
        let target =
            camera.position + DVec3::new((0.8 * f64::from(turn)).cos(), 0.1, (0.8 * f64::from(turn)).sin());
        camera = Camera::look_at(
            "",
            camera.position,
            target,
            DVec3::Y,
            FieldOfView::vertical_degrees(50.0),
        );
        if turn % 2 == 1 {
            camera.projection = Projection::Orthographic { height: 2.0 };
        }
        let picture = SceneView::Picture {
            camera: &camera,
            viewport,
        };
        let found = find(&edges, picture);
        let kept: Vec<ObjectId> = found.runs().iter().map(|run| run.object).collect();
        let all = find(&edges, from(picture.eye()));
        for edge in all.iter().filter(|edge| !kept.contains(&edge.object)) {
            left_out += 1;
            let inside = edge.segment.iter().any(|p| {
                camera
                    .project(viewport, p.as_dvec3())
                    .is_some_and(|(x, y, _)| (0.0..=300.0).contains(&x) && (0.0..=200.0).contains(&y))
            });
            assert!(!inside, "turn {turn}: {edge:?} is in the picture");
        }
    }
    assert!(left_out > 50, "{left_out} edges left out");
}

#[test]
fn broken_input_has_no_edges_and_is_named() {
    let mut scene = instances();
    let good = find(
        &SceneEdges::new(&scene, &SceneEdgeOptions::default()),
        from(Eye::At(EYE)),
    );
    scene.add_mesh(Mesh::new(
        "nan",
        vec![Vec3::NAN; 3],
        vec![[0, 1, 2]],
        MaterialId(0),
    ));
    scene.add_mesh(Mesh::new(
        "index",
        vec![Vec3::ZERO],
        vec![[0, 1, 2]],
        MaterialId(0),
    ));
    let cube = |name: &str| Mesh::cuboid(name, Vec3::ZERO, Vec3::ONE, MaterialId(0));
    let flat = scene.add_mesh(cube("flattened"));
    scene.objects[flat.index()].transform = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    let lost = scene.add_mesh(cube("lost"));
    scene.objects[lost.index()].transform = Affine3A::from_translation(Vec3::splat(f32::NAN));
    scene.objects.push(Object {
        name: "nothing".into(),
        geometry: Geometry::Mesh(MeshId(99)),
        transform: Affine3A::IDENTITY,
    });
    let disc = Shape::Disc {
        center: Vec3::ZERO,
        normal: Vec3::ZERO,
        radius: 1.0,
    };
    scene.add_primitive(
        "disc",
        Primitive {
            shape: disc,
            material: MaterialId(0),
        },
    );
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let named: Vec<String> = edges.warnings().iter().map(ToString::to_string).collect();
    for name in ["'nan'", "'index'", "'flattened'", "'lost'", "'nothing'", "'disc'"] {
        let times = named.iter().filter(|text| text.contains(name)).count();
        assert_eq!(times, 1, "{name} in {named:?}");
    }
    assert_eq!(find(&edges, from(Eye::At(EYE))), good, "the rest is as before");
    let nowhere = find(&edges, from(Eye::At(DVec3::new(f64::NAN, 0.0, 0.0))));
    assert!(
        nowhere.iter().all(|e| edges.mesh_of(e.object).is_none()),
        "no viewer, no mesh edges"
    );
    assert!(
        find(&edges, from(Eye::Towards(DVec3::ZERO))).is_empty(),
        "no direction"
    );
}

#[test]
fn repairs_are_reported() {
    let mut mesh = bumpy_sphere(8, 0.0, 1);
    mesh.name = "turned".into();
    mesh.triangles[3].swap(0, 1);
    let mut scene = Scene::new("");
    scene.add_mesh(mesh.clone());
    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let report = MeshEdges::new(&mesh, EdgeOptions::default())
        .expect("valid")
        .report();
    assert_eq!(report.flipped_edges, 3);
    let warning = EdgeWarning::Repaired {
        mesh: "turned".into(),
        report,
    };
    assert_eq!(edges.warnings(), [warning]);
    assert_eq!(
        edges.warnings()[0].to_string(),
        "mesh 'turned': 3 edges whose faces are turned against each other"
    );
}
