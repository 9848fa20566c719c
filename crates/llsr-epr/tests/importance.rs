//! Shadow edges of outshone lights are left out where they cannot be seen, and only there.

use glam::{DVec3, Vec3};
use llsr_edges::{DroppedEdge, ShadowEdges, ShadowOptions, ShadowScene};
use llsr_epr::{drop_outshone, dropped_contrast};
use llsr_quadrature::Receiver;
use llsr_scene::{LightId, LinearLight, Material, Mesh, Scene};
use llsr_shading::{PreparedLights, Settings};
use llsr_tracer::Tracer;

/// A strong tube over a floor, of which a table takes its light, and a weak one that shines below the table too; posts stand
/// everywhere.
fn table() -> Scene {
    let mut scene = Scene::new("table");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    let corners = [[-4.0, -4.0], [-4.0, 4.0], [4.0, 4.0], [4.0, -4.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
    scene.add_mesh(Mesh::quad("floor", corners, grey));
    let (low, high) = (Vec3::new(-1.5, 0.9, -1.5), Vec3::new(1.5, 1.0, 1.5));
    scene.add_mesh(Mesh::cuboid("table", low, high, grey));
    for i in 0..25u8 {
        let at = Vec3::new(f32::from(i % 5) - 2.0, 0.0, f32::from(i / 5) - 2.0) * 1.3;
        let high = at + Vec3::new(0.1, 0.3, 0.1);
        scene.add_mesh(Mesh::cuboid("post", at.with_y(0.05), high, grey));
    }
    let (a, b) = (DVec3::new(-0.6, 3.0, 0.1), DVec3::new(0.6, 3.0, -0.2));
    scene.add_light(LinearLight::new("strong", a, b, 10_000.0));
    let (a, b) = (DVec3::new(3.0, 0.6, 0.1), DVec3::new(3.1, 0.6, 1.2));
    scene.add_light(LinearLight::new("weak", a, b, 5.0));
    scene
}

#[test]
fn what_is_dropped_is_not_seen_and_what_hides_the_strong_light_is_asked() {
    let scene = table();
    let (tracer, _) = Tracer::new(&scene);
    let (prepared, _) = ShadowScene::new(&scene, ShadowOptions::default());
    let all = ShadowEdges::compute(&prepared, prepared.all_triples());
    let threshold = 0.01;
    let measure =
        |sample: &[DroppedEdge]| dropped_contrast(&scene, &tracer, &Settings::default(), sample, threshold);

    let mut edges = all.clone();
    let report = drop_outshone(&scene, &tracer, &prepared, &mut edges, threshold);
    let asked = measure(&report.sample);
    assert!(
        report.dropped > 50 && asked.measured > 20,
        "{} dropped, {asked:?}",
        report.dropped
    );
    let weak = |edges: &ShadowEdges| edges.iter().filter(|e| e.triple.light == LightId(1)).count();
    let below_table = |edges: &ShadowEdges| {
        let weak = edges.iter().filter(|e| e.triple.light == LightId(1));
        weak.map(|e| 0.5 * (e.segment[0] + e.segment[1]))
            .filter(|p| p.y.abs() < 1e-3 && p.x.abs() < 1.2 && p.z.abs() < 1.2)
            .count()
    };
    // Judged by three rays to a light, half as much again may come of it.
    assert!(asked.largest < 1.5 * threshold, "{asked:?}");
    assert!(asked.mean < threshold && asked.mean > 0.0, "{asked:?}");
    assert!(below_table(&all) > 5, "the weak light's shadows below the table");
    assert_eq!(below_table(&edges), below_table(&all), "are kept");
    assert!(weak(&edges) < weak(&all), "others are not");
    assert_eq!(
        all.len() - weak(&all),
        edges.len() - weak(&edges),
        "all of the strong light's are kept"
    );

    // Without asking, the measurement says what is lost.
    let mut edges = all.clone();
    let lights = PreparedLights::new(&scene.lights, &scene.materials, &Settings::default());
    let free = |light: LightId, position: DVec3, normal: DVec3| {
        lights.free_irradiance(light, &Receiver { position, normal }, normal)
    };
    let report = edges.drop_unimportant(&prepared, threshold, free, free);
    let trusted = measure(&report.sample);
    assert!(
        below_table(&edges) < below_table(&all),
        "edges are lost that are seen"
    );
    assert!(trusted.above > 3 && trusted.largest > 0.99, "{trusted:?}");
    assert!(
        measure(&[]).measured == 0 && measure(&[]).mean == 0.0,
        "nothing to measure"
    );
}

/// A strong tube that stands on a wall with one end, as in a fixture's cap, sends nothing along itself: however near its end is, it does
/// not outshine what falls on the wall around it.
#[test]
fn a_light_seen_end_on_outshines_nothing() {
    let mut scene = Scene::new("cap");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
    scene.add_mesh(Mesh::quad("wall", corners, grey));
    // Its shadow's edges pass within millimetres of the foot of the strong tube.
    let (low, high) = (Vec3::new(-0.001, -0.5, 0.3), Vec3::new(0.001, 0.5, 0.32));
    scene.add_mesh(Mesh::cuboid("strip", low, high, grey));
    scene.add_light(LinearLight::new(
        "strong",
        DVec3::Z * 0.002,
        DVec3::new(0.0, 0.0, 0.25),
        10_000.0,
    ));
    let (a, b) = (DVec3::new(0.0, -0.6, 2.0), DVec3::new(0.0, 0.6, 2.0));
    scene.add_light(LinearLight::new("weak", a, b, 3000.0));
    let (tracer, _) = Tracer::new(&scene);
    let (prepared, _) = ShadowScene::new(&scene, ShadowOptions::default());
    let all = ShadowEdges::compute(&prepared, prepared.all_triples());
    let threshold = 0.01;
    let mut edges = all.clone();
    let report = drop_outshone(&scene, &tracer, &prepared, &mut edges, threshold);
    let seen = dropped_contrast(&scene, &tracer, &Settings::default(), &report.sample, threshold);
    assert_eq!(seen.above, 0, "{seen:?}");
    let near = |edges: &ShadowEdges| {
        let weak = edges.iter().filter(|e| e.triple.light == LightId(1));
        weak.filter(|e| e.segment.iter().all(|p| p.z.abs() < 1e-4))
            .count()
    };
    assert!(near(&all) > 1, "{}", near(&all));
    assert_eq!(near(&edges), near(&all));
}
