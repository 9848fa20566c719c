//! Moved objects against tracers built anew.

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_scene::{Geometry, Material, MaterialId, Mesh, MeshId, Object, ObjectId, Primitive, Scene, Shape};
use llsr_testkit::tracer::torus;
use llsr_tracer::{FanQuery, FanScratch, MoveError, Tracer};
use llsr_visibility::Partition;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn unit(rng: &mut Pcg64Mcg) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn point(rng: &mut Pcg64Mcg, size: f64) -> DVec3 {
    DVec3::new(unit(rng), unit(rng), unit(rng)) * (2.0 * size) - size
}

fn transform(rng: &mut Pcg64Mcg) -> Affine3A {
    let axis = point(rng, 1.0).as_vec3().try_normalize().unwrap_or(Vec3::Y);
    Affine3A::from_scale_rotation_translation(
        Vec3::splat(0.5 + unit(rng) as f32),
        Quat::from_axis_angle(axis, 6.0 * unit(rng) as f32),
        point(rng, 2.0).as_vec3(),
    )
}

/// A floor that stays, and a torus, a second one of the same mesh, a box and two primitives.
fn scene() -> Scene {
    let mut scene = Scene::new("movable");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::cuboid(
        "floor",
        Vec3::new(-4.0, -3.1, -4.0),
        Vec3::new(4.0, -3.0, 4.0),
        grey,
    ));
    let torus = scene.add_mesh(torus(0.7, 0.25, 40, 20, grey));
    let Geometry::Mesh(mesh) = scene.objects[torus.index()].geometry else {
        panic!("a torus is a mesh")
    };
    scene.add_object(Object {
        name: "second torus".into(),
        geometry: Geometry::Mesh(mesh),
        transform: Affine3A::from_translation(Vec3::new(1.5, 0.5, 0.0)),
    });
    scene.add_mesh(Mesh::cuboid("box", Vec3::splat(-0.4), Vec3::splat(0.4), grey));
    for shape in [
        Shape::Sphere {
            center: Vec3::ZERO,
            radius: 0.5,
        },
        Shape::Cylinder {
            a: Vec3::ZERO,
            b: Vec3::Y,
            radius: 0.2,
            capped: true,
        },
    ] {
        scene.add_primitive(
            "primitive",
            Primitive {
                shape,
                material: grey,
            },
        );
    }
    scene
}

const MOVABLE: [ObjectId; 5] = [ObjectId(1), ObjectId(2), ObjectId(3), ObjectId(4), ObjectId(5)];

/// Rays, segments and fans answered alike, to the last bit; returns how many rays hit.
fn same_answers(moved: &Tracer, fresh: &Tracer, rng: &mut Pcg64Mcg) -> u32 {
    let mut hits = 0;
    let mut scratch = FanScratch::default();
    for _ in 0..400 {
        let (p, q) = (point(rng, 3.5), point(rng, 3.5));
        let hit = moved.closest(p, (q - p).normalize(), f64::INFINITY);
        assert_eq!(
            hit,
            fresh.closest(p, (q - p).normalize(), f64::INFINITY),
            "ray {p} to {q}"
        );
        assert_eq!(moved.occluded(p, q), fresh.occluded(p, q), "segment {p} to {q}");
        let fan = FanQuery::new(p, q, point(rng, 3.5));
        let (mut one, mut other) = (Partition::dark(), Partition::dark());
        moved.fan(&fan, &mut scratch, &mut one);
        fresh.fan(&fan, &mut scratch, &mut other);
        assert_eq!(one, other, "{fan:?}");
        hits += u32::from(hit.is_some_and(|hit| hit.object.0 > 0));
    }
    hits
}

#[test]
fn a_moved_tracer_answers_as_one_built_anew() {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let mut scene = scene();
    let (mut moved, warnings) = Tracer::with_movable(&scene, &MOVABLE);
    assert!(warnings.is_empty(), "nothing is wrong: {warnings:?}");
    assert_eq!(moved.movable().count(), MOVABLE.len(), "all can move");
    let mut hits = same_answers(&moved, &Tracer::with_movable(&scene, &MOVABLE).0, &mut rng);
    for round in 0..12 {
        let object = MOVABLE[round % MOVABLE.len()];
        let to = transform(&mut rng);
        scene.objects[object.index()].transform = to;
        moved
            .set_transform(object, to)
            .expect("the transform is a similarity");
        let bounds = moved.movable_bounds(object).expect("it is movable");
        // The scene's box of a rotated primitive is a generous one.
        let truth = scene.object_bounds(object);
        let slack = Vec3::splat(1e-4);
        let holds = bounds.contains(truth.min + slack) && bounds.contains(truth.max - slack);
        assert!(holds || object.0 >= 4, "{bounds:?} holds {truth:?}");
        assert!(bounds.contains(truth.center()), "{bounds:?} is about {truth:?}");
        hits += same_answers(&moved, &Tracer::with_movable(&scene, &MOVABLE).0, &mut rng);
    }
    assert!(hits > 500, "the movable objects are met: {hits} times");
}

#[test]
fn movable_objects_stand_where_fixed_ones_would() {
    let mut rng = Pcg64Mcg::seed_from_u64(12);
    let mut scene = scene();
    let (mut moved, _) = Tracer::with_movable(&scene, &MOVABLE);
    let moves: Vec<_> = MOVABLE
        .iter()
        .map(|&object| (object, transform(&mut rng)))
        .collect();
    for &(object, to) in &moves {
        scene.objects[object.index()].transform = to;
    }
    moved.set_transforms(&moves).expect("similarities");
    let (fixed, _) = Tracer::new(&scene);
    let mut differ = 0;
    for _ in 0..2000 {
        let p = point(&mut rng, 3.5);
        let d = (point(&mut rng, 1.0) - p).normalize();
        let (a, b) = (
            moved.closest(p, d, f64::INFINITY),
            fixed.closest(p, d, f64::INFINITY),
        );
        // Fixed meshes are rounded to single precision, so a grazing ray may pass one and meet the other.
        let near = match (a, b) {
            (Some(a), Some(b)) => a.object == b.object && (a.t - b.t).abs() < 1e-4,
            (None, None) => true,
            _ => false,
        };
        differ += u32::from(!near);
    }
    assert!(differ <= 2, "{differ} of 2000 rays differ");
}

#[test]
fn what_cannot_be_moved_stays() {
    let mut rng = Pcg64Mcg::seed_from_u64(13);
    let scene = scene();
    let (mut tracer, _) = Tracer::with_movable(&scene, &MOVABLE);
    let fresh = tracer.clone();
    let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    let far = Affine3A::from_translation(Vec3::splat(1e30));
    let nan = Affine3A::from_translation(Vec3::splat(f32::NAN));
    for bad in [flat, far, nan] {
        for object in [ObjectId(1), ObjectId(4)] {
            let moves = [(ObjectId(3), transform(&mut rng)), (object, bad)];
            assert_eq!(
                tracer.set_transforms(&moves),
                Err(MoveError::BadTransform(object)),
                "{bad:?}"
            );
        }
    }
    for object in [ObjectId(0), ObjectId(77)] {
        let moved = tracer.set_transform(object, Affine3A::IDENTITY);
        assert_eq!(moved, Err(MoveError::NotMovable(object)), "not named as movable");
    }
    same_answers(&tracer, &fresh, &mut rng);
}

#[test]
fn objects_without_usable_geometry_cannot_be_moved() {
    let mut scene = Scene::new("nothing there");
    scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::new("empty", Vec::new(), Vec::new(), MaterialId(0)));
    scene.add_object(Object {
        name: "no such mesh".into(),
        geometry: Geometry::Mesh(MeshId(9)),
        transform: Affine3A::IDENTITY,
    });
    let (mut tracer, warnings) = Tracer::with_movable(&scene, &[ObjectId(0), ObjectId(1), ObjectId(5)]);
    assert_eq!(warnings.len(), 1, "the missing mesh: {warnings:?}");
    assert_eq!(tracer.movable().count(), 0, "nothing is left to move");
    let moved = tracer.set_transform(ObjectId(0), Affine3A::IDENTITY);
    assert_eq!(moved, Err(MoveError::NotMovable(ObjectId(0))), "an empty mesh");
    assert!(
        tracer.closest(DVec3::ZERO, DVec3::X, f64::INFINITY).is_none(),
        "nothing to hit"
    );
}
