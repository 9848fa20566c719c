//! Fan queries against exact brute force, and against rays.

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_scene::{Material, MaterialId, Mesh, Primitive, Scene, SegmentOracle, Shape};
use llsr_testkit::tracer::{bumpy_knot, exactness_trials, leak_trials, scene_of, slit_trials, torus};
use llsr_tracer::{FanQuery, FanReport, FanScratch, Instructions, Tracer};
use llsr_visibility::{Bracket, Certificate, Partition};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn unit(rng: &mut Pcg64Mcg) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn point(rng: &mut Pcg64Mcg, size: f64) -> DVec3 {
    DVec3::new(unit(rng), unit(rng), unit(rng)) * (2.0 * size) - size
}

fn tracer(scene: &Scene) -> Tracer {
    Tracer::new(scene).0
}

fn visible(tracer: &Tracer, p: DVec3, a: DVec3, b: DVec3) -> Partition {
    let mut visible = Partition::default();
    tracer.visible_part(p, a, b, &mut FanScratch::default(), &mut visible);
    visible
}

#[test]
fn ends_and_cells_are_those_of_exact_brute_force() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let found = exactness_trials(&mut rng, 4000, 1e-12, tracer);
    assert!(found.partly > 800, "penumbrae occur: {found:?}");
    assert_eq!(
        (found.missed, found.invented, found.uncertified),
        (0, 0, 0),
        "{found:?}"
    );
}

#[test]
fn nothing_leaks_out_of_closed_meshes() {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    let found = leak_trials(&mut rng, 60_000, tracer);
    assert_eq!((found.missed, found.uncertified), (0, 0), "{found:?}");
}

#[test]
fn a_convex_body_hides_one_interval_even_edge_on() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let found = slit_trials(&mut rng, 20_000, tracer);
    assert!(found.partly > 2000, "penumbrae occur: {found:?}");
    assert_eq!((found.missed, found.uncertified), (0, 0), "{found:?}");
}

/// Rays at the middle and close to the ends of each interval say the same.
fn agrees_with_rays(tracer: &Tracer, p: DVec3, a: DVec3, b: DVec3, visible: &Partition) -> usize {
    let mut ends = vec![0.0, 1.0];
    ends.extend(visible.changes().map(|change| change.t));
    ends.sort_unstable_by(f64::total_cmp);
    for pair in ends.windows(2) {
        if pair[1] - pair[0] < 1e-7 {
            continue;
        }
        for t in [pair[0] + 1e-8, 0.5 * (pair[0] + pair[1]), pair[1] - 1e-8] {
            assert_eq!(
                tracer.occluded(p, a + (b - a) * t),
                !visible.contains(t),
                "t = {t} of {visible:?}, {p} to {a} - {b}"
            );
        }
    }
    ends.len() - 2
}

#[test]
fn instruction_sets_instances_and_pruning_do_not_matter() {
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let mut scene = scene_of([
        (bumpy_knot(120, 24, 0.2, MaterialId(0)), Affine3A::IDENTITY),
        (
            Mesh::cuboid(
                "floor",
                Vec3::new(-3.0, -1.2, -3.0),
                Vec3::new(3.0, -1.0, 3.0),
                MaterialId(0),
            ),
            Affine3A::IDENTITY,
        ),
    ]);
    // The same knot again, twice, so that it becomes an instance.
    let again = scene.objects[0].clone();
    for x in [-1.5, 1.5] {
        scene.add_object(llsr_scene::Object {
            transform: Affine3A::from_rotation_translation(Quat::from_rotation_x(x), Vec3::new(x, 0.1, 0.3)),
            ..again.clone()
        });
    }
    let mut tracer = tracer(&scene);
    let mut scratch = FanScratch::default();
    let (mut found, mut other) = (Partition::default(), Partition::default());
    let (mut changes, mut pruned, mut saved) = (0, 0, 0);
    for _ in 0..1500 {
        let (eye, aim) = (point(&mut rng, 3.0), point(&mut rng, 0.5));
        let Some(hit) = tracer.closest(eye, (aim - eye).normalize(), f64::INFINITY) else {
            continue;
        };
        let p = hit.leave(eye - aim);
        let a = point(&mut rng, 1.0) + DVec3::Y * 2.0;
        let b = a + point(&mut rng, 1.0);
        let query = FanQuery::new(p, a, b);
        tracer.restrict(Instructions::Portable);
        let report = tracer.fan(&query, &mut scratch, &mut found);
        assert!(report.complete, "no budget was set");
        changes += agrees_with_rays(&tracer, p, a, b, &found);
        pruned += report.pruned_blocked;
        for instructions in [Instructions::Avx2, Instructions::Avx512] {
            tracer.restrict(instructions);
            let same = tracer.fan(&query, &mut scratch, &mut other);
            assert_eq!(other, found, "{instructions:?}");
            assert!(same.complete, "{instructions:?}");
        }
        let all = tracer.fan(
            &FanQuery {
                prune: false,
                ..query
            },
            &mut scratch,
            &mut other,
        );
        assert_eq!(other, found, "without pruning");
        saved += i64::from(all.visits()) - i64::from(report.visits());
    }
    assert!(
        changes > 100 && pruned > 200 && saved > 200,
        "{changes} changes, {pruned} pruned, {saved} saved"
    );
}

#[test]
fn narrow_queries_and_polishing_give_the_ends_of_the_whole() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let tracer = tracer(&scene_of([(
        bumpy_knot(120, 24, 0.2, MaterialId(0)),
        Affine3A::IDENTITY,
    )]));
    let mut scratch = FanScratch::default();
    let mut polished = 0;
    for _ in 0..300 {
        let p = DVec3::new(0.0, -1.0, 0.0) + point(&mut rng, 0.8) * DVec3::new(1.0, 0.0, 1.0);
        let a = point(&mut rng, 1.0) + DVec3::Y * 2.0;
        let b = a + point(&mut rng, 1.0);
        let whole = visible(&tracer, p, a, b);
        let changes: Vec<_> = whole.changes().collect();
        for change in &changes {
            let (lo, hi) = ((change.t - 0.03).max(0.0), (change.t + 0.02).min(1.0));
            if changes.iter().filter(|c| lo <= c.t && c.t <= hi).count() > 1 {
                continue;
            }
            let bracket = Bracket::new(lo, hi, !change.visible_above);
            assert_eq!(
                tracer.polish(p, a, b, bracket, &mut scratch),
                Some(change.t),
                "the same end, bit for bit"
            );
            polished += 1;
        }
    }
    assert!(polished > 100, "{polished} ends");
}

#[test]
fn what_is_remembered_of_a_light_changes_no_answer() {
    let mut rng = Pcg64Mcg::seed_from_u64(9);
    let tracer = tracer(&scene_of([(
        bumpy_knot(120, 24, 0.2, MaterialId(0)),
        Affine3A::IDENTITY,
    )]));
    let lights = [0.0, 1.0].map(|x| {
        (
            DVec3::new(x - 1.0, 2.0, -0.2),
            DVec3::new(x - 0.4, 2.0, 0.2 + 0.1 * x),
        )
    });
    let mut helped = FanScratch::default();
    let (mut found, mut expected) = (Partition::default(), Partition::default());
    let (mut with, mut without) = (0, 0);
    for walk in 0..12 {
        // A short way along which neighbouring points see about the same.
        let (start, step) = (point(&mut rng, 0.8), point(&mut rng, 0.004));
        for i in 0..60 {
            let p = (start + f64::from(i) * step) * DVec3::new(1.0, 0.0, 1.0) - DVec3::Y;
            let (a, b) = lights[(i % 2) as usize];
            let mut query = FanQuery::new(p, a, b);
            with += tracer.fan(&query, &mut helped, &mut found).visits();
            without += tracer
                .fan(&query, &mut FanScratch::default(), &mut expected)
                .visits();
            assert_eq!(found, expected, "walk {walk}, point {i}: the same bits");
            // What a budget is enough for does not depend on the queries before.
            query.budget = 12;
            assert_eq!(
                tracer.fan(&query, &mut helped, &mut found),
                tracer.fan(&query, &mut FanScratch::default(), &mut expected),
                "walk {walk}, point {i}: the same work"
            );
            assert_eq!(
                found, expected,
                "walk {walk}, point {i}: the same incomplete answer"
            );
        }
    }
    assert!(with * 10 < without * 9, "{with} visits instead of {without}");
}

#[test]
fn sequences_with_a_budget_can_be_repeated() {
    let tracer = tracer(&scene_of([(
        bumpy_knot(120, 24, 0.2, MaterialId(0)),
        Affine3A::IDENTITY,
    )]));
    let (a, b) = (DVec3::new(-1.0, 2.0, -0.2), DVec3::new(-0.4, 2.0, 0.2));
    let answer = |i: i32, scratch: &mut FanScratch| {
        let query = FanQuery {
            budget: 60,
            ..FanQuery::new(DVec3::new(0.004 * f64::from(i) - 0.4, -1.0, 0.1), a, b)
        };
        let mut visible = Partition::default();
        (tracer.fan(&query, scratch, &mut visible), visible)
    };
    let mut scratch = FanScratch::default();
    let mut run = || {
        scratch.begin_sequence();
        (0..200).map(|i| answer(i, &mut scratch)).collect::<Vec<_>>()
    };
    let together = run();
    assert_eq!(together, run(), "the same work and the same answers");
    let alone: Vec<_> = (0..200).map(|i| answer(i, &mut FanScratch::default())).collect();
    let visits = |answers: &[(FanReport, Partition)]| -> u32 { answers.iter().map(|x| x.0.visits()).sum() };
    let (together, alone) = (visits(&together), visits(&alone));
    assert!(
        together < alone,
        "{together} visits of queries that help each other, {alone} of queries that do not"
    );
}

#[test]
fn shapes_hide_what_rays_say_they_hide() {
    let mut rng = Pcg64Mcg::seed_from_u64(6);
    let shapes = [
        Shape::Sphere {
            center: Vec3::new(0.1, 0.2, 0.3),
            radius: 0.5,
        },
        Shape::Cylinder {
            a: Vec3::new(-0.4, 0.0, 0.1),
            b: Vec3::new(0.3, 0.5, 0.2),
            radius: 0.3,
            capped: true,
        },
        Shape::Cylinder {
            a: Vec3::new(0.4, 0.0, 0.1),
            b: Vec3::new(0.3, -0.5, 0.2),
            radius: 0.2,
            capped: false,
        },
        Shape::Cone {
            base: Vec3::new(0.0, -0.4, 0.0),
            apex: Vec3::new(0.2, 0.5, 0.1),
            radius: 0.4,
            capped: true,
        },
        Shape::Cone {
            base: Vec3::new(0.0, -0.4, 0.0),
            apex: Vec3::new(0.2, 0.5, 0.1),
            radius: 0.6,
            capped: false,
        },
        Shape::Disc {
            center: Vec3::new(0.1, 0.0, -0.1),
            normal: Vec3::Y,
            radius: 0.6,
        },
    ];
    for shape in shapes {
        let mut scene = Scene::new("shape");
        scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        scene.add_primitive(
            "shape",
            Primitive {
                shape,
                material: MaterialId(0),
            },
        );
        scene.objects[0].transform = Affine3A::from_scale_rotation_translation(
            Vec3::new(1.0, 1.5, 0.8),
            Quat::from_rotation_z(0.4),
            Vec3::new(0.1, -0.2, 0.3),
        );
        let tracer = tracer(&scene);
        let mut changes = 0;
        for i in 0..2000 {
            // Points and lights inside the shape, outside, and on its surface.
            let size = if i % 4 == 0 { 0.4 } else { 1.5 };
            let mut p = point(&mut rng, size);
            if i % 4 == 1 {
                let direction = (point(&mut rng, 0.3) - p).normalize();
                if let Some(hit) = tracer.closest(p, direction, f64::INFINITY) {
                    p = hit.leave(-direction);
                }
            }
            let (a, b) = (point(&mut rng, 1.5), point(&mut rng, 1.5));
            let found = visible(&tracer, p, a, b);
            assert_eq!(found.certificate(), Certificate::Exact, "closed forms are exact");
            changes += agrees_with_rays(&tracer, p, a, b, &found);
            for k in 0..40 {
                let t = (f64::from(k) + 0.5) / 40.0;
                if found.changes().all(|change| (change.t - t).abs() > 1e-8) {
                    let hidden = tracer.occluded(p, a + (b - a) * t);
                    assert_eq!(
                        hidden,
                        !found.contains(t),
                        "{shape:?} at t = {t}, {p} to {a} - {b}"
                    );
                }
            }
        }
        assert!(changes > 500, "{shape:?} casts penumbrae: {changes}");
    }
}

#[test]
fn degenerate_fans() {
    let scene = scene_of([(
        Mesh::cuboid("box", Vec3::splat(-1.0), Vec3::splat(1.0), MaterialId(0)),
        Affine3A::IDENTITY,
    )]);
    let tracer = tracer(&scene);
    let at = DVec3::new;
    // A light of no length.
    let seen = |p, a, b| visible(&tracer, p, a, b);
    assert!(
        seen(at(0.0, 3.0, 0.0), at(3.0, 3.0, 0.0), at(3.0, 3.0, 0.0)).is_lit(),
        "free point"
    );
    assert!(
        seen(at(0.0, 3.0, 0.0), at(0.1, -3.0, 0.0), at(0.1, -3.0, 0.0)).is_dark(),
        "hidden point"
    );
    // p on the light's line, outside it: the box begins at x = -1, the light runs from -3 to 3.
    let end_on = seen(at(-5.0, 0.2, 0.1), at(-3.0, 0.2, 0.1), at(3.0, 0.2, 0.1));
    assert_eq!(end_on.panels().len(), 1, "visible up to the box");
    assert!(
        (end_on.panels()[0].end - 1.0 / 3.0).abs() < 1e-12,
        "the box begins at a third: {end_on:?}"
    );
    let reversed = seen(at(-5.0, 0.2, 0.1), at(3.0, 0.2, 0.1), at(-3.0, 0.2, 0.1));
    assert!(
        (reversed.panels()[0].start - 2.0 / 3.0).abs() < 1e-12,
        "and from the other end: {reversed:?}"
    );
    // p on the light itself, on either side of the box and free.
    let on = seen(at(-2.0, 0.2, 0.1), at(-3.0, 0.2, 0.1), at(3.0, 0.2, 0.1));
    assert!((on.measure() - 1.0 / 3.0).abs() < 1e-12, "up to the box: {on:?}");
    assert!(
        seen(at(0.0, 3.0, 0.0), at(-3.0, 3.0, 0.0), at(3.0, 3.0, 0.0)).is_lit(),
        "nothing is near"
    );
    // p at an end of the light.
    assert!(
        seen(at(-3.0, 0.2, 0.1), at(-3.0, 0.2, 0.1), at(-2.0, 0.2, 0.1)).is_lit(),
        "p at an end"
    );
    // The light dips into the box: its surface hides what is inside, and what is beyond.
    let dips = seen(at(0.5, 3.0, 0.0), at(-2.0, 1.5, 0.0), at(0.0, 0.5, 0.0));
    assert!(
        (dips.measure() - 0.5).abs() < 1e-12,
        "half is above the face: {dips:?}"
    );
    // The light lies in the plane of a face, and touches without being hidden.
    assert!(
        seen(at(0.5, 3.0, 0.0), at(-2.0, 1.0, 0.0), at(0.5, 1.0, 0.3)).is_lit(),
        "on the face"
    );
    // The fan lies in the plane of a face: nothing of the box is in the way inside that plane but edges.
    let flat = seen(at(-2.0, 1.0, 0.0), at(2.0, 1.0, -9.0), at(2.0, 1.0, 9.0));
    assert_eq!(
        flat.panels().len(),
        2,
        "the sides end in the plane of the top: {flat:?}"
    );
    // Not numbers.
    for bad in [f64::NAN, f64::INFINITY] {
        let found = seen(at(bad, 0.0, 0.0), at(3.0, 3.0, 0.0), at(0.0, 3.0, 0.0));
        assert!(found.is_lit(), "nothing is known to block");
        assert_eq!(
            found.certificate(),
            Certificate::Sampled,
            "and the certificate says so"
        );
    }
    // No scene.
    let (empty, _) = Tracer::new(&Scene::new("empty"));
    assert!(
        visible(&empty, at(0.0, 0.0, 0.0), at(1.0, 1.0, 0.0), at(1.0, 2.0, 0.0)).is_lit(),
        "empty"
    );
}

#[test]
fn a_spent_budget_is_said() {
    let tracer = tracer(&scene_of([(
        torus(1.0, 0.4, 200, 80, MaterialId(0)),
        Affine3A::IDENTITY,
    )]));
    let query = FanQuery {
        budget: 5,
        ..FanQuery::new(
            DVec3::new(1.0, 0.1, 0.0),
            DVec3::new(0.0, 3.0, 0.0),
            DVec3::new(1.0, 3.0, 1.0),
        )
    };
    let mut found = Partition::default();
    let report = tracer.fan(&query, &mut FanScratch::default(), &mut found);
    assert!(!report.complete && report.visits() <= 5, "{report:?}");
    assert_eq!(
        found.certificate(),
        Certificate::Sampled,
        "hidden parts may be missing"
    );
    assert!(!found.is_dark(), "five visits do not close the light");
}
