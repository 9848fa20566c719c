//! Shadow edges against exact visibility.

use std::collections::BTreeSet;

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_edges::{ShadowEdge, ShadowEdges, ShadowKind, ShadowOptions, ShadowScene};
use llsr_scene::{
    AreaLight, AreaShape, Geometry, Light, LightId, LinearLight, Material, MaterialId, Mesh, ObjectId,
    PointLight, Scene, Triple,
};
use llsr_testkit::edges::{
    ClassImage, LightClass, ShadowCoverage, ShadowOracle, ShadowScenes, class_changes, class_image,
    shadow_coverage,
};
use llsr_testkit::tracer::world_triangles;

fn prepare(scene: &Scene) -> ShadowScene {
    let (prepared, left_out) = ShadowScene::new(scene, ShadowOptions::default());
    assert!(left_out.is_empty(), "all objects of {} take part", scene.name);
    prepared
}

fn compute(scene: &Scene) -> ShadowEdges {
    let prepared = prepare(scene);
    ShadowEdges::compute(&prepared, prepared.all_triples())
}

fn segments<'a>(edges: impl Iterator<Item = &'a ShadowEdge>) -> [Vec<[Vec3; 2]>; 2] {
    let mut result = [Vec::new(), Vec::new()];
    for edge in edges {
        if edge.kind != ShadowKind::Umbral {
            result[0].push(edge.segment);
        }
        if edge.kind != ShadowKind::Penumbral {
            result[1].push(edge.segment);
        }
    }
    result
}

fn coverage(scene: &Scene, count: u32, seed: u64) -> ShadowCoverage {
    let edges = compute(scene);
    shadow_coverage(
        scene,
        count,
        seed,
        |light, receiver| {
            segments(
                edges
                    .iter()
                    .filter(|e| e.triple.light == light && e.triple.receiver == receiver),
            )
        },
        |_, _| (),
    )
}

fn sum(kind: ShadowScenes, seeds: std::ops::Range<u64>, count: u32) -> ShadowCoverage {
    seeds.fold(ShadowCoverage::default(), |mut all, seed| {
        all.add(&coverage(&kind.build(seed), count, seed));
        all
    })
}

#[test]
fn convex_blockers_are_covered() {
    for kind in ShadowScenes::ALL.into_iter().filter(|kind| kind.is_simple()) {
        let found = sum(kind, 0..10, 80);
        let [outer, inner] = found.shares();
        assert!(
            found.outer[1] > 50 && found.inner[1] > 30,
            "{kind:?}: too few changes in {found:?}"
        );
        assert!(outer >= 0.995 && inner >= 0.995, "{kind:?}: {found:?}");
    }
}

#[test]
fn outer_edges_of_all_kinds_of_blockers_are_covered() {
    for kind in ShadowScenes::ALL.into_iter().filter(|kind| !kind.is_simple()) {
        let found = sum(kind, 10..15, 80);
        let [outer, inner] = found.shares();
        assert!(
            found.outer[1] > 50 && found.inner[1] > 30,
            "{kind:?}: too few changes in {found:?}"
        );
        assert!(outer >= 0.99, "{kind:?}: {found:?}");
        // Gaps that close between two edges (EEE) are not among them.
        assert!(inner >= 0.7, "{kind:?}: {found:?}");
    }
}

#[test]
fn closing_gaps_complete_the_inner_edges() {
    for kind in [ShadowScenes::Crowd, ShadowScenes::Torus, ShadowScenes::Chain] {
        let (mut before, mut after) = (ShadowCoverage::default(), ShadowCoverage::default());
        for seed in 20..24 {
            let scene = kind.build(seed);
            let prepared = prepare(&scene);
            let mut edges: Vec<ShadowEdge> = compute(&scene).iter().copied().collect();
            let count = |edges: &[ShadowEdge], into: &mut ShadowCoverage| {
                into.add(&shadow_coverage(
                    &scene,
                    60,
                    seed,
                    |_, receiver| segments(edges.iter().filter(|e| e.triple.receiver == receiver)),
                    |_, _| (),
                ));
            };
            count(&edges, &mut before);
            let gaps = prepared.closing_gaps(LightId(0), 1 << 22);
            assert!(!gaps.truncated, "{kind:?}: all pairs");
            edges.extend(gaps.edges);
            count(&edges, &mut after);
        }
        let [before, after] = [before, after].map(|c| c.inner);
        assert!(before[1] > 40 && before[0] < before[1], "{kind:?}: {before:?}");
        assert!(
            after[0] * 100 >= after[1] * 99,
            "{kind:?}: {before:?}, with gaps {after:?}"
        );
    }
    let scene = ShadowScenes::Crowd.build(1);
    let prepared = prepare(&scene);
    let some = prepared.closing_gaps(LightId(0), 1000);
    assert!(some.truncated && some.pairs <= 1000, "{} pairs", some.pairs);
    assert_eq!(prepared.closing_gaps(LightId(5), 1000).pairs, 0, "no such light");
}

/// Figure 9: under light that grazes the capsule where the torus touches it, both boundaries run together there.
#[test]
fn umbral_and_penumbral_edges_meet_where_a_torus_touches_a_capsule() {
    let mut scene = llsr_scene::demo::build("torus-capsule").expect("built in");
    let named = |name: &str| scene.objects.iter().position(|o| o.name == name).expect(name);
    let (capsule, torus) = (ObjectId::from(named("capsule")), ObjectId::from(named("torus")));
    // The vertex of the torus that is deepest in the capsule, whose axis lies along x.
    let bounds = prepare(&scene).object(capsule).expect("a capsule").bounds();
    let (axis, radius) = (bounds.center().as_dvec3(), 0.5 * f64::from(bounds.size().z));
    let from_axis = |p: DVec3| (p - axis).with_x(0.0);
    let Geometry::Mesh(ring) = scene.objects[torus.index()].geometry else {
        panic!("a mesh");
    };
    let deepest = scene.meshes[ring.index()]
        .positions
        .iter()
        .map(|p| p.as_dvec3())
        .min_by(|p, q| from_axis(*p).length().total_cmp(&from_axis(*q).length()))
        .expect("vertices");
    let normal = from_axis(deepest).normalize();
    let contact = (axis + normal * radius).with_x(deepest.x);
    let back = DVec3::X.cross(normal) * -DVec3::X.cross(normal).z.signum();
    // Its ends are seen from there 12 and 16 degrees above the tangent plane.
    let end = |up: f64, aside: f64| {
        let (up, aside) = (up.to_radians(), aside.to_radians());
        contact + 3.2 * (up.sin() * normal + up.cos() * (aside.cos() * back + aside.sin() * DVec3::X))
    };
    let (a, b) = (end(12.0, -25.0), end(16.0, 22.0));
    scene.lights[0] = LinearLight::new("tube", a, b, 9000.0).into();
    let prepared = prepare(&scene);
    let found = ShadowEdges::compute(&prepared, prepared.all_triples());
    let near: Vec<&ShadowEdge> = found
        .iter()
        .filter(|e| e.triple.receiver == capsule && e.triple.blocker == torus)
        .filter(|e| middle(e).distance(contact) < 0.5)
        .collect();

    // How far penumbral edges are from the nearest umbral one, by their distance from the contact.
    let width = |from: f64, to: f64| {
        let umbral = || near.iter().filter(|e| e.kind == ShadowKind::Umbral);
        let widths: Vec<f64> = near
            .iter()
            .filter(|e| e.kind == ShadowKind::Penumbral)
            .filter(|e| (from..to).contains(&middle(e).distance(contact)))
            .map(|e| umbral().fold(f64::MAX, |least, u| least.min(distance(middle(e), u))))
            .collect();
        assert!(widths.len() > 2, "{} edges between {from} and {to}", widths.len());
        widths.iter().sum::<f64>() / widths.len() as f64
    };
    let (at_contact, beside) = (width(0.0, 0.12), width(0.3, 0.5));
    // Under a tube of radius r that lies on a plane, light at an angle e grazes the tube r (1 - cos e) above the plane, and
    // its shadow begins r tan(e / 2) beside the contact. The width is 0.3% of the torus's.
    let tube = 0.5 * f64::from(prepared.object(torus).expect("a torus").bounds().size().x) - 0.82;
    let expected = tube * (8f64.to_radians().tan() - 6f64.to_radians().tan());
    assert!(
        at_contact < 1.2 * expected,
        "{at_contact} m wide at the contact, not {expected}"
    );
    assert!(
        beside > 4.0 * at_contact,
        "{at_contact} at the contact, {beside} m beside it"
    );

    // Exact visibility says the same on both sides of these edges.
    let oracle = ShadowOracle::new(&world_triangles(&scene));
    let mesh = prepared.object(capsule).expect("a capsule").mesh().edges();
    let mut scratch = Vec::new();
    let (mut looked_at, mut real) = (0, 0);
    for edge in near.iter().filter(|e| middle(e).distance(contact) < 0.3) {
        let [u, v, w] = mesh.corners(edge.face);
        let [p, q] = edge.segment.map(Vec3::as_dvec3);
        let across = (v - u).cross(w - u).cross(q - p).normalize();
        let classes =
            [1e-4, -1e-4].map(|step| oracle.class(middle(edge) + step * across, a, b, &mut scratch));
        let other = if edge.kind == ShadowKind::Umbral {
            LightClass::Umbra
        } else {
            LightClass::Lit
        };
        looked_at += 1;
        real += usize::from((classes[0] == other) != (classes[1] == other));
    }
    // Where the shadows of both ends cross, an edge goes on for a little.
    assert!(
        looked_at > 20 && real * 20 >= looked_at * 19,
        "{real} of {looked_at} edges are real"
    );
}

fn middle(edge: &ShadowEdge) -> DVec3 {
    let [a, b] = edge.segment.map(Vec3::as_dvec3);
    0.5 * (a + b)
}

fn distance(p: DVec3, edge: &ShadowEdge) -> f64 {
    let [a, b] = edge.segment.map(Vec3::as_dvec3);
    let t = (p - a).dot(b - a) / (b - a).length_squared();
    p.distance(a + (b - a) * t.clamp(0.0, 1.0))
}

#[test]
fn neighbours_of_different_class_have_an_edge_between_them() {
    for kind in ShadowScenes::ALL {
        let mut all = ClassImage::default();
        for seed in 30..33 {
            let scene = kind.build(seed);
            let prepared = prepare(&scene);
            let mut edges: Vec<ShadowEdge> = compute(&scene).iter().copied().collect();
            edges.extend(prepared.closing_gaps(LightId(0), 1 << 22).edges);
            all.add(&class_image(
                &scene,
                6000,
                |_, receiver| segments(edges.iter().filter(|e| e.triple.receiver == receiver)),
                |_, _| (),
            ));
        }
        let ClassImage {
            points,
            separated,
            real,
            ..
        } = all;
        assert!(
            points.iter().all(|&n| n > 50) && separated.outer[1] > 50 && separated.inner[1] > 30,
            "{kind:?}: too few changes in {all:?}"
        );
        let [outer, inner] = separated.shares();
        let needed = if kind.is_simple() { 0.995 } else { 0.99 };
        assert!(outer >= needed && inner >= needed, "{kind:?}: {all:?}");
        // Few blockers, few edges at which nothing changes.
        let [outer, _] = real.shares();
        assert!(!kind.is_simple() || outer >= 0.99, "{kind:?}: {all:?}");
    }
}

#[test]
fn edges_of_outshone_lights_are_dropped() {
    let mut scene = ShadowScenes::Box.build(4);
    for i in 0..6u8 {
        let at = DVec3::new(f64::from(i) - 3.0, 5.0, 2.0);
        scene.add_light(LinearLight::new("", at, at + DVec3::Z, 1.0));
    }
    let prepared = prepare(&scene);
    // Half of the light comes from the first, a millionth from the last three together.
    let power = [1.0, 0.5, 0.3, 0.2, 5e-7, 5e-7, 1e-6];
    let irradiance = |light: LightId, _: DVec3, normal: DVec3| {
        assert!((normal.length() - 1.0).abs() < 1e-9, "a unit normal");
        power[light.index()]
    };
    let all = ShadowEdges::compute(&prepared, prepared.all_triples());
    for (threshold, gone) in [(0.0, 0), (7e-7, 2), (1.5e-6, 3), (0.06, 3), (0.12, 4), (2.0, 7)] {
        let mut edges = all.clone();
        let report = edges.drop_unimportant(&prepared, threshold, irradiance, irradiance);
        assert_eq!(report.kept + report.dropped, all.len(), "all are counted");
        assert_eq!(report.kept, edges.len(), "kept");
        let mut order: Vec<usize> = (0..7).collect();
        order.sort_by(|&i, &j| power[i].total_cmp(&power[j]));
        let dropped = &order[..gone];
        let expected = all
            .iter()
            .filter(|e| dropped.contains(&e.triple.light.index()))
            .count();
        assert_eq!(report.dropped, expected, "threshold {threshold}");
        assert!(
            report.largest_dropped <= threshold,
            "{report:?} with threshold {threshold}"
        );
        assert_eq!(edges.dropped(), expected, "remembered");
        assert_eq!(report.sample.is_empty(), expected == 0, "some are named");
        let named = report.sample.iter().all(|e| dropped.contains(&e.light.index()));
        assert!(named, "{:?}", report.sample);
    }
    // Beside a weak light's shadow the first, and at last all stronger ones, may be hidden: then it matters.
    let count = |from: f64| {
        let mut edges = all.clone();
        let past = |light: LightId, _: DVec3, _: DVec3| {
            if power[light.index()] > from {
                0.0
            } else {
                power[light.index()]
            }
        };
        let report = edges.drop_unimportant(&prepared, 3e-6, irradiance, past);
        // What was computed again is there again.
        let light = scene.lights[6].clone();
        let mut moved = prepared.clone();
        assert!(moved.move_light(LightId(6), &light), "to where it was");
        edges.light_moved(&moved, LightId(6));
        let back = edges.iter().filter(|e| e.triple.light == LightId(6)).count();
        let before = all.iter().filter(|e| e.triple.light == LightId(6)).count();
        assert_eq!(back, before, "computed again");
        report.dropped
    };
    assert_eq!(
        count(1.0),
        count(0.9),
        "half of the light is enough to outshine them"
    );
    assert!(
        count(1.0) > 0 && count(0.0) == 0,
        "if nothing stronger comes through, none is dropped"
    );
}

#[test]
fn point_lights_have_hard_edges_alone() {
    for kind in [ShadowScenes::Crowd, ShadowScenes::Torus, ShadowScenes::Sheets] {
        let mut scene = kind.build(3);
        let place = scene.lights[0].ends().0;
        scene.lights[0] = Light::Point(PointLight {
            name: "point".into(),
            position: place,
            flux: 1.0,
            color: Vec3::ONE,
        });
        let edges = compute(&scene);
        assert!(edges.iter().all(|edge| edge.kind == ShadowKind::Hard), "{kind:?}");
        let found = coverage(&scene, 200, 5);
        assert!(found.outer[1] > 60, "{kind:?}: {found:?}");
        assert!(found.shares()[0] >= 0.995, "{kind:?}: {found:?}");
    }
}

#[test]
fn rectangles_and_discs_are_covered_behind_a_convex_blocker() {
    let mut scratch = [0usize; 4];
    for seed in 0..6 {
        for round in [false, true] {
            let mut scene = ShadowScenes::Ball.build(seed);
            let corner = scene.lights[0].ends().0;
            let shape = if round {
                AreaShape::Disc {
                    center: corner,
                    normal: -DVec3::Y,
                    radius: 0.4,
                }
            } else {
                AreaShape::Rect {
                    corner,
                    along: DVec3::new(0.5, 0.0, 0.3),
                    across: DVec3::new(-0.3, 0.0, 0.5),
                }
            };
            scene.lights[0] = Light::Area(AreaLight {
                name: "area".into(),
                shape,
                flux: 1.0,
                color: Vec3::ONE,
            });
            let prepared = prepare(&scene);
            let polygon = prepared.light(LightId(0)).expect("a light").corners().to_vec();
            let edges = compute(&scene);
            let oracle = ShadowOracle::new(&world_triangles(&scene));
            let found = segments(edges.iter().filter(|e| e.triple.receiver == ObjectId(0)));
            let mut counts = ShadowCoverage::default();
            for i in 0..12 {
                let angle = f64::from(i) * 0.5 + 0.1;
                let way = DVec3::new(angle.cos(), 0.0, angle.sin());
                let line = [-6.0 * way, 6.0 * way];
                for change in class_changes(line, 128, |p| oracle.class_of_polygon(p, &polygon)) {
                    counts.count(&change, &found[0], &found[1], 1e-4 * 12.0);
                }
            }
            scratch[0] += counts.outer[0];
            scratch[1] += counts.outer[1];
            scratch[2] += counts.inner[0];
            scratch[3] += counts.inner[1];
        }
    }
    let [outer, outer_all, inner, inner_all] = scratch;
    assert!(outer_all > 100 && inner_all > 50, "{scratch:?}");
    assert_eq!(
        (outer, inner),
        (outer_all, inner_all),
        "found and all, outer and inner"
    );
}

fn sorted(edges: &ShadowEdges) -> Vec<(Triple, ShadowKind, [[u32; 3]; 2])> {
    let mut list: Vec<_> = edges
        .iter()
        .map(|e| {
            (
                e.triple,
                e.kind,
                e.segment.map(|p| p.to_array().map(f32::to_bits)),
            )
        })
        .collect();
    list.sort_unstable();
    list
}

fn same(a: &ShadowEdges, b: &ShadowEdges) {
    let (a, b) = (sorted(a), sorted(b));
    assert_eq!(a.len(), b.len(), "number of edges");
    for (a, b) in a.iter().zip(&b) {
        assert_eq!(a, b, "an edge");
    }
}

#[test]
fn moves_compute_what_a_fresh_start_computes_and_no_more() {
    let mut scene = ShadowScenes::Crowd.build(1);
    let far = LinearLight::new("far", DVec3::new(3.0, 5.0, 0.0), DVec3::new(3.0, 5.0, 1.0), 1.0);
    scene.add_light(far);
    let mut prepared = prepare(&scene);
    // All triples, so that none has to be added after a move.
    let ids: Vec<ObjectId> = prepared.objects().collect();
    let triples: Vec<Triple> = [LightId(0), LightId(1)]
        .into_iter()
        .flat_map(|light| {
            let ids = &ids;
            ids.iter().take(6).flat_map(move |&blocker| {
                ids.iter()
                    .filter(move |r| r.0 % 3 != 1)
                    .map(move |&receiver| Triple {
                        light,
                        blocker,
                        receiver,
                    })
            })
        })
        .collect();
    let mut edges = ShadowEdges::compute(&prepared, triples.iter().copied());
    let pairs = 12;
    let turned =
        |y: f32| Affine3A::from_rotation_translation(Quat::from_rotation_x(y), Vec3::new(0.3, 1.0 + y, 0.2));

    let blocker = ObjectId(4);
    assert!(prepared.move_object(blocker, turned(0.3)), "moved");
    let done = edges.object_moved(&prepared, blocker);
    assert_eq!(done.pairs, 2, "a blocker that receives nothing: one pair a light");
    same(&edges, &ShadowEdges::compute(&prepared, triples.iter().copied()));

    let receiver = ObjectId(9);
    assert!(prepared.move_object(receiver, turned(0.9)), "moved");
    let done = edges.object_moved(&prepared, receiver);
    assert_eq!(done.pairs, pairs, "a receiver of all pairs");
    same(&edges, &ShadowEdges::compute(&prepared, triples.iter().copied()));

    let light = LinearLight::new("moved", DVec3::new(0.0, 5.0, 0.0), DVec3::new(1.0, 5.0, 1.0), 1.0);
    assert!(prepared.move_light(LightId(1), &light.into()), "moved");
    let done = edges.light_moved(&prepared, LightId(1));
    assert_eq!(done.pairs, pairs / 2, "the pairs of one light");
    same(&edges, &ShadowEdges::compute(&prepared, triples.iter().copied()));
    assert_eq!(edges.light_moved(&prepared, LightId(7)).pairs, 0, "no such light");

    // One triple after the other gives the same as all together.
    let mut grown = ShadowEdges::default();
    for &triple in triples.iter().rev() {
        grown.add(&prepared, [triple]);
    }
    same(&grown, &edges);
    assert_eq!(grown.add(&prepared, triples.clone()).pairs, 0, "nothing new");
    assert_eq!(grown.triples().count(), triples.len(), "each once");
    let by_triple: usize = triples.iter().map(|&t| edges.of(t).count()).sum();
    assert_eq!(by_triple, edges.len(), "each edge belongs to one triple");
    // Without the boxes, nothing is between blockers and floor.
    grown.retain(&prepared, |triple| triple.receiver == ObjectId(0));
    let floor = triples.iter().copied().filter(|t| t.receiver == ObjectId(0));
    assert_eq!(
        sorted(&grown),
        sorted(&ShadowEdges::compute(&prepared, floor)),
        "retained"
    );
}

#[test]
fn boxes_name_all_triples_with_edges() {
    for kind in [ShadowScenes::Crowd, ShadowScenes::Chain] {
        let scene = kind.build(2);
        let prepared = prepare(&scene);
        let named = prepared.all_triples_and_hiders();
        let every: Vec<Triple> = prepared
            .objects()
            .flat_map(|blocker| {
                prepared.objects().map(move |receiver| Triple {
                    light: LightId(0),
                    blocker,
                    receiver,
                })
            })
            .collect();
        let (some, all) = (
            ShadowEdges::compute(&prepared, named.iter().copied()),
            ShadowEdges::compute(&prepared, every.iter().copied()),
        );
        same(&some, &all);
        // Without those that only hide, no shadow falls on another triple than those named.
        let falling: BTreeSet<Triple> = prepared.all_triples().into_iter().collect();
        let shaded = |edge: &ShadowEdge| falling.contains(&edge.triple);
        assert!(all.iter().all(shaded), "{kind:?}: all triples with edges");
        let at_most = if kind == ShadowScenes::Crowd {
            every.len() / 2
        } else {
            every.len()
        };
        assert!(
            falling.len() <= named.len() && named.len() <= at_most,
            "{kind:?}: {}",
            named.len()
        );
    }
}

#[test]
fn odd_scenes_are_survived() {
    let mut scene = Scene::new("odd");
    scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::default());
    scene.add_mesh(Mesh::new(
        "point",
        vec![Vec3::ONE; 3],
        vec![[0, 1, 2]],
        MaterialId(0),
    ));
    scene.add_mesh(Mesh::new(
        "nan",
        vec![Vec3::NAN; 3],
        vec![[0, 1, 2]],
        MaterialId(0),
    ));
    scene.add_mesh(Mesh::cuboid("box", Vec3::ZERO, Vec3::ONE, MaterialId(0)));
    let flat = scene.add_mesh(Mesh::cuboid("flattened", Vec3::ZERO, Vec3::ONE, MaterialId(0)));
    scene.objects[flat.index()].transform = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    // In the plane of faces, through a box, through a corner, along an edge, nowhere.
    for (a, b) in [
        (DVec3::new(0.0, 1.0, 3.0), DVec3::new(2.0, 1.0, 3.0)),
        (DVec3::new(-1.0, 0.5, 0.5), DVec3::new(2.0, 0.5, 0.5)),
        (DVec3::ONE, DVec3::new(2.0, 3.0, 1.5)),
        (DVec3::new(-3.0, 1.0, 1.0), DVec3::new(-2.0, 1.0, 1.0)),
        (DVec3::NAN, DVec3::ONE),
        (DVec3::splat(1e300), DVec3::ONE),
    ] {
        scene.add_light(LinearLight::new("", a, b, 1.0));
    }
    let (mut prepared, left_out) = ShadowScene::new(&scene, ShadowOptions::default());
    assert_eq!(
        left_out,
        [ObjectId(2), ObjectId(4)],
        "the mesh without places and the box without height"
    );
    let edges = ShadowEdges::compute(&prepared, prepared.all_triples());
    assert!(
        edges.iter().all(|e| e.segment.iter().all(|p| p.is_finite())),
        "finite ends"
    );
    assert!(
        !prepared.move_object(ObjectId(3), Affine3A::from_scale(Vec3::ZERO)),
        "no inverse"
    );
    assert!(
        !prepared.move_object(ObjectId(2), Affine3A::IDENTITY),
        "takes no part"
    );
    assert!(
        !prepared.move_object(ObjectId(99), Affine3A::IDENTITY),
        "no such object"
    );
    let missing = Triple {
        light: LightId(0),
        blocker: ObjectId(77),
        receiver: ObjectId(2),
    };
    assert!(
        ShadowEdges::compute(&prepared, [missing]).is_empty(),
        "no such blocker"
    );
}
