//! Shadow edges have the same bits for any number of threads, from the start and after moves. (Here because this crate has
//! llsr-edges work on all threads.)

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_edges::{ShadowEdge, ShadowEdges, ShadowKind, ShadowOptions, ShadowScene};
use llsr_scene::{LightId, LinearLight, ObjectId, Scene, Triple};
use llsr_testkit::edges::{ShadowScenes, bumpy_sphere};

type Bits = (Triple, ShadowKind, u32, [[u32; 3]; 2]);

fn bits<'a>(edges: impl Iterator<Item = &'a ShadowEdge>) -> Vec<Bits> {
    edges
        .map(|e| {
            let segment = e.segment.map(|p| p.to_array().map(f32::to_bits));
            (e.triple, e.kind, e.face, segment)
        })
        .collect()
}

fn scene() -> Scene {
    let mut scene = ShadowScenes::Crowd.build(7);
    // So many corners that the search for events is shared out.
    let mut rough = bumpy_sphere(48, 0.4, 3);
    rough
        .positions
        .iter_mut()
        .for_each(|p| *p = *p * 0.5 + Vec3::Y * 2.4);
    scene.add_mesh(rough);
    let (a, b) = (DVec3::new(2.5, 4.5, 0.0), DVec3::new(2.5, 4.2, 1.5));
    scene.add_light(LinearLight::new("second", a, b, 500.0));
    scene
}

/// The edges in their order at the start and after a blocker, a receiver that blocks as well, and a light have moved.
fn course() -> Vec<Vec<Bits>> {
    let scene = scene();
    let (mut prepared, _) = ShadowScene::new(&scene, ShadowOptions::default());
    let rough = ObjectId::from(scene.objects.len() - 1);
    let ids: Vec<ObjectId> = prepared.objects().collect();
    let lights: Vec<LightId> = prepared.lights().collect();
    // All there can be, so that none has to be added after a move.
    let triples: Vec<Triple> = lights
        .iter()
        .flat_map(|&light| ids.iter().map(move |&blocker| (light, blocker)))
        .filter(|(_, blocker)| blocker.0 % 4 == 1 || *blocker == rough)
        .flat_map(|(light, blocker)| {
            ids.iter().map(move |&receiver| Triple {
                light,
                blocker,
                receiver,
            })
        })
        .collect();
    let fresh = |prepared: &ShadowScene| ShadowEdges::compute(prepared, triples.iter().copied());
    let mut edges = fresh(&prepared);
    let mut seen = vec![bits(edges.iter())];
    let turned =
        |x: f32| Affine3A::from_rotation_translation(Quat::from_rotation_z(x), Vec3::new(0.3 * x, 0.2, -0.2));
    for (object, place) in [(rough, turned(0.4)), (ObjectId(6), turned(-0.7))] {
        assert!(prepared.move_object(object, place), "moved");
        edges.object_moved(&prepared, object);
        assert_eq!(
            bits(edges.iter()),
            bits(fresh(&prepared).iter()),
            "as from the start"
        );
        seen.push(bits(edges.iter()));
    }
    let (a, b) = (DVec3::new(-1.5, 4.0, 0.3), DVec3::new(-0.5, 4.4, 0.9));
    assert!(
        prepared.move_light(LightId(1), &LinearLight::new("second", a, b, 500.0).into()),
        "moved"
    );
    edges.light_moved(&prepared, LightId(1));
    assert_eq!(
        bits(edges.iter()),
        bits(fresh(&prepared).iter()),
        "as from the start"
    );
    seen.push(bits(edges.iter()));
    let gaps = lights
        .iter()
        .flat_map(|&light| prepared.closing_gaps(light, 1 << 18).edges)
        .collect::<Vec<_>>();
    seen.push(bits(gaps.iter()));
    seen
}

#[test]
fn any_number_of_threads_finds_the_same_bits_also_after_moves() {
    let [one, two, three] = [1, 2, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(course)
    });
    assert!(one.iter().all(|edges| edges.len() > 100), "there are edges");
    assert!(
        one.windows(2).all(|pair| pair[0] != pair[1]),
        "moves change something"
    );
    assert_eq!(one, two, "one thread and two");
    assert_eq!(one, three, "one thread and three");
}
