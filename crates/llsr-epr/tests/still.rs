//! Still pictures: no leaks over edges, the same bits on any number of threads, and what each part is good for.

use glam::{DVec3, Vec3};
use llsr_epr::{Still, StillCounts, StillError, StillLayer, StillSettings, render_still, still_steps};
use llsr_scene::{
    Camera, FieldOfView, LinearLight, Material, MaterialId, Mesh, Primitive, Projection, Scene, Shape,
    Viewport,
};
use llsr_tracer::Tracer;

const VIEWPORT: Viewport = Viewport {
    width: 72,
    height: 56,
};

/// A small square in the air before a wall, both facing the camera, lit so differently that a leak shows: the light lies
/// between them, so that the square is dark in front and the wall bright. The square throws no shadow on what is seen.
fn two_planes() -> Scene {
    let mut scene = Scene::new("two planes");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    let square = |z: f32, half: f32| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x * half, y * half, z))
    };
    scene.add_mesh(Mesh::quad("wall", square(0.0, 9.0), grey));
    scene.add_mesh(Mesh::quad("square", square(2.0, 0.6), grey));
    scene.add_light(LinearLight::new(
        "tube",
        DVec3::new(-1.0, 0.0, 1.5),
        DVec3::new(1.0, 0.0, 1.5),
        1000.0,
    ));
    scene.cameras.push(Camera::look_at(
        "front",
        DVec3::new(0.0, 0.0, 6.0),
        DVec3::ZERO,
        DVec3::Y,
        FieldOfView::vertical_degrees(35.0),
    ));
    scene
}

fn still(scene: &Scene, settings: &StillSettings) -> Still {
    let (tracer, _) = Tracer::new(scene);
    render_still(
        scene,
        &tracer,
        &scene.cameras[0],
        VIEWPORT,
        settings,
        &[],
        &|| true,
    )
    .expect("nobody interrupts")
}

fn sparse() -> StillSettings {
    StillSettings {
        layers: StillLayer::ALL.map(|known| known.1).to_vec(),
        ..StillSettings::default()
    }
}

#[test]
fn light_does_not_leak_over_a_silhouette() {
    let made = still(&two_planes(), &sparse());
    let edges = made.film.channel("edges.Y").expect("asked for");
    let depth = made.film.channel("depth.Z").expect("asked for");
    let pixels: Vec<[f32; 3]> = made.film.pixels().collect();
    let (mut dark, mut bright) = (0, 0);
    for (index, pixel) in pixels.iter().enumerate() {
        if edges[index] > 0.0 {
            continue;
        }
        if depth[index] < 5.0 {
            dark += 1;
            assert_eq!(*pixel, [0.0; 3], "the dark square at {index}");
        } else {
            bright += 1;
            assert!(pixel[0] > 0.1, "the bright wall at {index}: {pixel:?}");
        }
    }
    assert!(dark > 100 && bright > 1000, "{dark} dark, {bright} bright");
    let shaded = made.counts.rounds.iter().sum::<usize>();
    assert!(shaded <= pixels.len() / 19, "{shaded} of {}", pixels.len());
    // The outline is a square: four straight edges, complex only at its corners.
    assert!(
        made.counts.simple > 50 && made.counts.complex <= 16,
        "{:?}",
        made.counts
    );
    let blended = (0..pixels.len())
        .filter(|&i| edges[i] == 0.5 && pixels[i][0] > 0.0)
        .count();
    assert!(
        blended > made.counts.simple / 2,
        "{blended} blended pixels of {:?}",
        made.counts
    );
}

#[test]
fn where_a_box_runs_into_a_wall_there_is_an_edge() {
    let mut scene = two_planes();
    let material = MaterialId(0);
    let (half, depth) = (0.6, 0.5);
    scene.objects.truncate(1);
    let (from, to) = (Vec3::new(-half, -half, -depth), Vec3::new(half, half, depth));
    scene.add_mesh(Mesh::cuboid("box", from, to, material));
    scene.cameras[0] = Camera::look_at(
        "aside",
        DVec3::new(3.0, 2.0, 5.0),
        DVec3::ZERO,
        DVec3::Y,
        FieldOfView::vertical_degrees(30.0),
    );
    let settings = StillSettings {
        shadow_edges: false,
        ..sparse()
    };
    let made = still(&scene, &settings);
    let edges = made.film.channel("edges.Y").expect("asked for");
    // The sides of the box that the camera sees meet the wall at x = 0.6 and at y = 0.6.
    for i in 0..20 {
        let along = f64::from(half) * (0.095 * f64::from(i) - 0.9);
        for place in [[f64::from(half), along], [along, f64::from(half)]] {
            let (x, y, _) = scene.cameras[0]
                .project(VIEWPORT, DVec3::new(place[0], place[1], 0.0))
                .expect("in the picture");
            let index = y as usize * VIEWPORT.width as usize + x as usize;
            assert!(edges[index] > 0.0, "no edge at {place:?}, pixel ({x}, {y})");
        }
    }
}

/// The room of a few primitives and meshes that the other tests look at.
fn still_life() -> Scene {
    let mut scene = Scene::new("still life");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.7)));
    let red = scene.add_material(Material::diffuse("red", Vec3::new(0.8, 0.1, 0.1)));
    let floor = [(-4.0, 4.0), (4.0, 4.0), (4.0, -4.0), (-4.0, -4.0)].map(|(x, z)| Vec3::new(x, 0.0, z));
    scene.add_mesh(Mesh::quad("floor", floor, grey));
    scene.add_mesh(Mesh::cuboid(
        "box",
        Vec3::new(-1.2, -0.1, -0.5),
        Vec3::new(-0.4, 0.8, 0.5),
        red,
    ));
    let primitive = |shape, material: MaterialId| Primitive { shape, material };
    scene.add_primitive(
        "ball",
        primitive(
            Shape::Sphere {
                center: Vec3::new(0.5, 0.5, 0.0),
                radius: 0.5,
            },
            grey,
        ),
    );
    scene.add_primitive(
        "post",
        primitive(
            Shape::Cylinder {
                a: Vec3::new(1.5, 0.0, -0.6),
                b: Vec3::new(1.5, 1.2, -0.6),
                radius: 0.2,
                capped: true,
            },
            red,
        ),
    );
    scene.add_light(LinearLight::new(
        "tube",
        DVec3::new(-1.0, 3.0, 1.0),
        DVec3::new(1.0, 3.0, 1.0),
        3000.0,
    ));
    scene.cameras.push(Camera::look_at(
        "front",
        DVec3::new(0.5, 2.0, 4.5),
        DVec3::new(0.2, 0.4, 0.0),
        DVec3::Y,
        FieldOfView::vertical_degrees(45.0),
    ));
    scene
}

fn rmse(a: &Still, b: &Still) -> f64 {
    let square: f64 = a
        .film
        .pixels()
        .zip(b.film.pixels())
        .flat_map(|(a, b)| [0, 1, 2].map(|i| f64::from(a[i] - b[i]).powi(2)))
        .sum();
    (square / a.film.viewport.pixels() as f64).sqrt()
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let scene = still_life();
    let on = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads start")
            .install(|| still(&scene, &sparse()))
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.film, three.film, "one thread and three");
    assert_eq!(one.statistics, three.statistics, "and the same work");
    assert_eq!(one.counts, three.counts, "and the same pixels");
}

#[test]
fn edges_and_density_bring_the_picture_nearer_to_the_full_one() {
    let scene = still_life();
    let with = |density, edges| {
        let settings = StillSettings {
            density,
            edges,
            ..StillSettings::default()
        };
        still(&scene, &settings)
    };
    let full = with(1.0, true);
    let (few, many, blind) = (with(0.05, true), with(0.3, true), with(0.05, false));
    let errors = [&few, &many, &blind].map(|made| rmse(made, &full));
    assert!(
        errors[1] < 0.7 * errors[0],
        "more samples, less error: {errors:?}"
    );
    assert!(
        errors[0] < 0.8 * errors[2],
        "edges keep samples apart: {errors:?}"
    );
}

#[test]
fn samples_are_where_the_layer_says_and_no_more_than_asked_for() {
    let made = still(&still_life(), &sparse());
    let StillCounts {
        rounds,
        regions_missed,
        ..
    } = &made.counts;
    let samples = made.film.channel("samples.Y").expect("asked for");
    for (round, &count) in (1..).zip(rounds) {
        let marked = samples.iter().filter(|&&value| value == round as f32).count();
        assert_eq!(marked, count, "pixels of round {round}");
    }
    let budget = (0.05 * VIEWPORT.pixels() as f64).ceil() as usize;
    let all: usize = rounds.iter().sum();
    assert!(
        all <= budget + regions_missed + 8,
        "{all} samples, {budget} asked for"
    );
    // Small regions take nothing from the rounds that look for what is needed.
    assert!(
        all + 8 >= budget + regions_missed && *regions_missed > 8,
        "{all} samples, {budget} asked for and {regions_missed} on top"
    );
}

#[test]
fn it_stops_when_told_and_refuses_sizes_that_do_not_fit() {
    let scene = two_planes();
    let (tracer, _) = Tracer::new(&scene);
    let run = |viewport, progress: &(dyn Fn() -> bool + Sync)| {
        let settings = StillSettings::default();
        render_still(
            &scene,
            &tracer,
            &scene.cameras[0],
            viewport,
            &settings,
            &[],
            progress,
        )
        .err()
    };
    assert_eq!(run(VIEWPORT, &|| false), Some(StillError::Interrupted));
    let wide = Viewport {
        width: llsr_epi::MAX_SIZE + 1,
        height: 1,
    };
    assert!(
        matches!(run(wide, &|| true), Some(StillError::Size(_))),
        "too wide"
    );
    let one = Viewport { width: 1, height: 1 };
    assert_eq!(run(one, &|| true), None, "a single pixel");
    let steps = std::sync::atomic::AtomicU64::new(0);
    let count = || {
        steps.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        true
    };
    assert_eq!(run(VIEWPORT, &count), None);
    assert!(
        steps.into_inner() <= still_steps(VIEWPORT, 3),
        "steps of progress"
    );
}

#[test]
fn parallel_rays_and_empty_scenes_work() {
    let mut scene = still_life();
    scene.cameras[0].projection = Projection::Orthographic { height: 4.0 };
    let made = still(&scene, &sparse());
    assert!(made.film.pixels().any(|pixel| pixel[0] > 0.0), "something is lit");
    scene.objects.clear();
    let empty = still(&scene, &sparse());
    assert!(
        empty.film.pixels().all(|pixel| pixel == [0.0; 3]),
        "nothing is seen"
    );
    assert_eq!(empty.counts.rounds, [0, 0, 0], "and nothing shaded");
}
