//! Pencils of rays against single rays and exact brute force.

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_scene::{Geometry, MaterialId, Mesh, MeshId, Object, ObjectId, Primitive, Scene, Shape};
use llsr_testkit::tracer::{scene_of, segment_is_cut, torus, world_triangles};
use llsr_tracer::{Instructions, Tracer};
use proptest::prelude::*;

const ALL: [Instructions; 3] = [Instructions::Portable, Instructions::Avx2, Instructions::Avx512];

/// Numbers that often coincide with those of the meshes: rays then run in faces, through edges and vertices, along
/// axes and along the sides of boxes.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => (-6i32..7).prop_map(|x| f64::from(x) * 0.5),
        2 => (-6i32..7, -2i32..3).prop_map(|(x, steps)| {
            let x = f64::from(x) * 0.5;
            let step = if steps < 0 { f64::next_down } else { f64::next_up };
            (0..steps.abs()).fold(x, |x, _| step(x))
        }),
        3 => -3.0..3.0f64,
        1 => (-3.0..3.0f64, -40i32..0).prop_map(|(x, e)| x * 2f64.powi(e)),
    ]
}

fn point() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array)
}

/// A segment that is often short, or along an axis, or a point.
fn light() -> impl Strategy<Value = (DVec3, DVec3)> {
    (point(), point(), 0..6usize, -30i32..1).prop_map(|(a, b, shape, e)| match shape {
        0 => (a, a),
        1 => (a, a + (b - a) * 2f64.powi(e)),
        2..=4 => {
            let mut end = a;
            end[shape - 2] = b[shape - 2];
            (a, end)
        }
        _ => (a, b),
    })
}

/// Up to twenty parameters, the ends and equal ones among them, in any order.
fn parameters() -> impl Strategy<Value = Vec<f64>> {
    let t = prop_oneof![
        3 => 0.0..1.0f64,
        1 => (0..9i32).prop_map(|i| f64::from(i) / 8.0),
        1 => Just(-0.25),
    ];
    prop::collection::vec(t, 0..20)
}

/// Cubes in a grid, a flat grid of triangles in their midst, and needles.
fn aligned(seed: u32) -> Scene {
    let grey = MaterialId(0);
    let mut meshes = Vec::new();
    for i in 0..6u32 {
        let at =
            |k: u32| (seed.wrapping_mul(2_654_435_761).rotate_left(5 * i + 11 * k) % 9) as f32 * 0.5 - 2.0;
        let low = Vec3::new(at(0), at(1), at(2));
        // Flat in one direction now and then.
        let size = Vec3::new(1.0, 0.5, if i == 3 { 0.0 } else { 0.5 });
        meshes.push(Mesh::cuboid("box", low, low + size, grey));
    }
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..8u32 {
        for k in 0..8u32 {
            positions.push(Vec3::new(i as f32 * 0.5 - 2.0, 0.5, k as f32 * 0.5 - 2.0));
            if i < 7 && k < 7 && !seed.wrapping_add(i * 5 + k * 3).is_multiple_of(4) {
                let v = i * 8 + k;
                triangles.extend([[v, v + 1, v + 9], [v, v + 9, v + 8]]);
            }
        }
    }
    meshes.push(Mesh::new("grid", positions, triangles, grey));
    let needle = |y: f32| {
        [
            Vec3::new(-3.0, y, 0.0),
            Vec3::new(3.0, y, 1e-4),
            Vec3::new(3.0, y, 2e-4),
        ]
    };
    let positions: Vec<Vec3> = [-0.75, 0.0, 1.25].into_iter().flat_map(needle).collect();
    meshes.push(Mesh::new(
        "needles",
        positions,
        vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]],
        grey,
    ));
    scene_of(meshes.into_iter().map(|mesh| (mesh, Affine3A::IDENTITY)))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn pencils_are_cut_where_exact_rays_are(
        seed in any::<u32>(),
        from in point(),
        light in light(),
        ts in parameters(),
    ) {
        let scene = aligned(seed);
        let triangles = world_triangles(&scene);
        let (mut tracer, _) = Tracer::new(&scene);
        let (a, b) = light;
        let expected: Vec<bool> = ts
            .iter()
            .map(|&t| segment_is_cut(&triangles, from, a + (b - a) * t))
            .collect();
        for instructions in ALL {
            tracer.restrict(instructions);
            let mut blocked = vec![false; ts.len()];
            tracer.occluded_pencil(from, a, b, &ts, &mut blocked);
            prop_assert_eq!(&blocked, &expected, "{:?}", instructions);
        }
    }

    #[test]
    fn pencils_through_instances_and_moved_objects_are_cut_where_single_rays_are(
        from in point(),
        light in light(),
        ts in parameters(),
        turn in -3.0..3.0f32,
        shift in point(),
    ) {
        let mut tracer = PARTS.with(Clone::clone);
        let transform = Affine3A::from_rotation_translation(Quat::from_rotation_y(turn), shift.as_vec3());
        tracer.set_transform(ObjectId(2), transform).expect("a rigid motion is invertible");
        let (a, b) = light;
        let expected: Vec<bool> = ts.iter().map(|&t| tracer.occluded(from, a + (b - a) * t)).collect();
        for instructions in ALL {
            tracer.restrict(instructions);
            let mut blocked = vec![false; ts.len()];
            tracer.occluded_pencil(from, a, b, &ts, &mut blocked);
            prop_assert_eq!(&blocked, &expected, "{:?}", instructions);
        }
    }
}

thread_local! {
    /// Two instances of a torus, a box that may move, and a sphere.
    static PARTS: Tracer = {
        let mut scene = scene_of([
            (torus(1.2, 0.4, 64, 40, MaterialId(0)), Affine3A::IDENTITY),
        ]);
        scene.add_object(Object {
            name: "second torus".into(),
            geometry: Geometry::Mesh(MeshId::from(0)),
            transform: Affine3A::from_rotation_x(1.2),
        });
        scene.add_mesh(Mesh::cuboid("box", Vec3::splat(-0.5), Vec3::splat(0.5), MaterialId(0)));
        let shape = Shape::Sphere { center: Vec3::Y, radius: 0.6 };
        scene.add_primitive("sphere", Primitive { shape, material: MaterialId(0) });
        Tracer::with_movable(&scene, &[ObjectId(2)]).0
    };
}

#[test]
fn instances_and_moved_objects_give_both_answers() {
    let tracer = PARTS.with(Clone::clone);
    let ts: Vec<f64> = (0..8).map(|i| f64::from(i) / 7.0).collect();
    let mut blocked = [false; 8];
    let above = DVec3::new(0.0, 4.0, 0.0);
    tracer.occluded_pencil(
        above,
        DVec3::new(-3.0, 0.0, 0.0),
        DVec3::new(3.0, 0.0, 0.0),
        &ts,
        &mut blocked,
    );
    assert!(blocked.contains(&true) && blocked.contains(&false), "{blocked:?}");
}

#[test]
fn ends_that_are_not_finite_are_not_reached() {
    let scene = aligned(7);
    let (mut tracer, _) = Tracer::new(&scene);
    let (a, b) = (DVec3::new(-2.6, 3.0, 0.1), DVec3::new(2.6, -3.0, 0.2));
    let from = DVec3::new(0.3, -2.9, 2.7);
    let ts = [0.1, 0.3, 0.5, 0.7, 0.9, 1.0];
    for instructions in ALL {
        tracer.restrict(instructions);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut blocked = [true; 6];
            tracer.occluded_pencil(DVec3::new(0.0, bad, 0.0), a, b, &ts, &mut blocked);
            assert_eq!(blocked, [false; 6], "from {bad}");
            // One bad question leaves the others what they are.
            let mut mixed = ts;
            mixed[2] = bad;
            let expected = mixed.map(|t| tracer.occluded(from, a + (b - a) * t));
            assert!(!expected[2] && expected.contains(&true), "{expected:?}");
            tracer.occluded_pencil(from, a, b, &mixed, &mut blocked);
            assert_eq!(blocked, expected, "a parameter of {bad}");
        }
        // Rays without length and out of the range of single precision.
        for (end, reach) in [
            (from, 0.0),
            (from + DVec3::splat(1e-30), 1e-31),
            (DVec3::splat(1e25), 1e24),
        ] {
            let mut blocked = [true; 6];
            let along = end + DVec3::X * reach;
            let expected = ts.map(|t| tracer.occluded(from, end + (along - end) * t));
            tracer.occluded_pencil(from, end, along, &ts, &mut blocked);
            assert_eq!(blocked, expected, "to {end}");
        }
    }
}
