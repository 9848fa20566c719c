//! Frames in lockstep with shaders.

use std::sync::Arc;

use glam::{Affine3A, DVec3, Vec3};
use llsr_epr::{
    CameraPath, FrameRenderer, FrameReport, FrameSettings, LockstepRenderer, ShadowThread, ray_trace,
};
use llsr_scene::{Camera, FieldOfView, LinearLight, Material, Mesh, ObjectId, Scene, Viewport, demo};
use llsr_shading::{
    DirectShader, Encounters, Place, ShadeRequest, ShadedPoint, Shader, ShaderError, ShaderScratch, World,
};

const VIEWPORT: Viewport = Viewport {
    width: 120,
    height: 90,
};

/// A box above a floor under a short light.
fn boxed() -> (Scene, ObjectId) {
    let mut scene = Scene::new("box");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.6)));
    let red = scene.add_material(Material::diffuse("red", Vec3::new(0.8, 0.1, 0.1)));
    let corners = [[-4.0, -4.0], [-4.0, 4.0], [4.0, 4.0], [4.0, -4.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
    scene.add_mesh(Mesh::quad("floor", corners, grey));
    let id = scene.add_mesh(Mesh::cuboid(
        "box",
        Vec3::new(-0.5, 0.6, -0.5),
        Vec3::new(0.5, 1.2, 0.5),
        red,
    ));
    let (a, b) = (DVec3::new(-0.3, 4.0, 0.0), DVec3::new(0.3, 4.0, 0.0));
    scene.add_light(LinearLight::new("tube", a, b, 3000.0));
    (scene, id)
}

fn camera() -> Camera {
    let eye = DVec3::new(1.0, 3.5, 5.0);
    Camera::look_at(
        "eye",
        eye,
        DVec3::new(0.0, 0.3, 0.0),
        DVec3::Y,
        FieldOfView::vertical_degrees(50.0),
    )
}

fn bits(renderer: &FrameRenderer) -> Vec<u32> {
    let picture = renderer.picture();
    (0..picture.size().1)
        .flat_map(|y| {
            picture
                .row(y)
                .into_iter()
                .flatten()
                .map(|v| v.to_bits())
                .collect::<Vec<_>>()
        })
        .collect()
}

/// Mean of |a - b| over mean of b, for the pixels that `of` picks.
fn relative_error(renderer: &FrameRenderer, truth: &llsr_epi::Picture, of: impl Fn(u32, u32) -> bool) -> f32 {
    let (mut difference, mut sum) = (0.0, 0.0);
    for y in 0..VIEWPORT.height {
        for x in (0..VIEWPORT.width).filter(|&x| of(x, y)) {
            let (a, b) = (renderer.picture().pixel(x, y), truth.pixel(x, y));
            difference += (a - b).abs().element_sum();
            sum += b.element_sum();
        }
    }
    difference / sum
}

#[test]
fn walks_have_the_same_bits_for_any_number_of_threads() {
    let scene = demo::build("subway").expect("a scene");
    let (world, _) = World::new(Arc::new(scene), &[]);
    let world = Arc::new(world);
    let path = CameraPath::default_walk(&world.scene().cameras[0], 12, 10.0);
    let run = |threads: usize, shadows_apart: bool, beside: bool| {
        let shader = DirectShader::new(Arc::clone(&world), Vec3::ONE);
        let settings = FrameSettings {
            threads,
            shadows_apart,
            ..FrameSettings::default()
        };
        let renderer = FrameRenderer::new(world.scene(), VIEWPORT, settings).expect("size");
        let mut lockstep = LockstepRenderer::new(renderer, 200);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| {
            lockstep.warm_up(&shader, &path.cameras[0]);
            for camera in &path.cameras {
                if beside {
                    lockstep.draw_and_shade(&shader, camera);
                } else {
                    lockstep.draw(camera);
                    lockstep.shade(&shader);
                }
                assert_eq!(lockstep.renderer.report().holes, 0, "no frame has holes");
            }
        });
        (bits(&lockstep.renderer), *lockstep.renderer.report())
    };
    let (one, report) = run(1, false, false);
    for threads in [2, 5] {
        assert_eq!(one, run(threads, false, false).0, "one thread and {threads}");
    }
    let (apart, apart_report) = run(1, true, false);
    assert_eq!(apart, run(2, true, false).0, "shadows apart, one thread and two");
    for shadows_apart in [false, true] {
        let (beside, beside_report) = run(1, shadows_apart, true);
        assert_eq!(
            beside,
            run(2, shadows_apart, true).0,
            "drawn and shaded at once, one thread and two"
        );
        let (points, fewer) = (report.points.occupied, beside_report.points.occupied);
        assert!(
            fewer < points && fewer + 400 > points,
            "the points of one frame less: {fewer} and {points}"
        );
    }
    assert!(apart_report.shadow_edges > 0, "{apart_report:?}");
    assert!(
        report.shadow_edges > 0 && report.silhouette_edges > 0,
        "{report:?}"
    );
    assert!(report.points.occupied > 1000, "points gather: {report:?}");
    let other_seed = {
        let shader = DirectShader::new(Arc::clone(&world), Vec3::ONE);
        let settings = FrameSettings {
            seed: 1,
            ..FrameSettings::default()
        };
        let renderer = FrameRenderer::new(world.scene(), VIEWPORT, settings).expect("size");
        let mut lockstep = LockstepRenderer::new(renderer, 200);
        lockstep.warm_up(&shader, &path.cameras[0]);
        lockstep.draw(&path.cameras[0]);
        bits(&lockstep.renderer)
    };
    assert_ne!(one, other_seed, "the seed matters");
}

#[test]
fn a_still_camera_comes_close_to_ray_tracing() {
    let (scene, _) = boxed();
    let (world, _) = World::new(Arc::new(scene), &[]);
    let scene = Arc::clone(world.scene());
    let shader = DirectShader::new(Arc::new(world), Vec3::ZERO);
    let truth = ray_trace(&shader, &camera(), VIEWPORT, 4, 0).expect("the shader works");
    let error = |edges: bool| {
        let settings = FrameSettings {
            shadow_edges: edges,
            // Creases at no angle: silhouettes only.
            crease_degrees: if edges { 85.0 } else { 180.0 },
            ..FrameSettings::default()
        };
        let renderer = FrameRenderer::new(&scene, VIEWPORT, settings).expect("size");
        let mut lockstep = LockstepRenderer::new(renderer, 400);
        lockstep.warm_up(&shader, &camera());
        for _ in 0..6 {
            lockstep.draw(&camera());
            lockstep.shade(&shader);
        }
        relative_error(&lockstep.renderer, &truth, |_, _| true)
    };
    let (with, without) = (error(true), error(false));
    assert!(with < 0.03, "{with} with a quarter of the pixels shaded");
    assert!(with < 0.9 * without, "edges help: {with}, without {without}");
}

#[test]
fn samples_go_where_new_ones_differed_from_the_picture() {
    let (scene, _) = boxed();
    let (world, _) = World::new(Arc::new(scene), &[]);
    let scene = Arc::clone(world.scene());
    let shader = DirectShader::new(Arc::new(world), Vec3::ZERO);
    // The floor beside the box, with a sharp border of its shadow that nobody draws, and nothing else.
    let camera = || {
        let (eye, at) = (DVec3::new(0.0, 1.0, 1.2), DVec3::new(0.0, 0.0, 0.7));
        Camera::look_at("eye", eye, at, DVec3::Y, FieldOfView::vertical_degrees(50.0))
    };
    let truth = ray_trace(&shader, &camera(), VIEWPORT, 4, 0).expect("the shader works");
    let slope = |x: u32, y: u32| {
        let beside = [(x.saturating_sub(1), y), (x, y.saturating_sub(1))];
        let change = |(u, v)| (truth.pixel(x, y) - truth.pixel(u, v)).abs().max_element();
        beside.into_iter().map(change).fold(0.0, f32::max) / truth.pixel(x, y).max_element().max(1e-6)
    };
    let run = |calm_priority: f32| {
        let settings = FrameSettings {
            shadow_edges: false,
            calm_priority,
            ..FrameSettings::default()
        };
        let renderer = FrameRenderer::new(&scene, VIEWPORT, settings).expect("size");
        let mut lockstep = LockstepRenderer::new(renderer, 100);
        lockstep.warm_up(&shader, &camera());
        let (mut steep, mut all) = (0, 0);
        for _ in 0..16 {
            lockstep.draw(&camera());
            for request in lockstep.renderer.requests() {
                let at = lockstep
                    .renderer
                    .points()
                    .view()
                    .project((request.origin + request.direction).as_vec3())
                    .expect("in the picture");
                steep += usize::from(slope(at.x, at.y) > 0.05);
                all += 1;
            }
            lockstep.shade(&shader);
        }
        lockstep.draw(&camera());
        (
            steep as f32 / all as f32,
            relative_error(&lockstep.renderer, &truth, |_, _| true),
        )
    };
    let (even_share, even_error) = run(1.0);
    let (share, error) = run(FrameSettings::default().calm_priority);
    assert!(
        share > 1.25 * even_share,
        "{share} of the requests at steep places, {even_share} if spread evenly"
    );
    assert!(error < 0.9 * even_error, "{error}, evenly {even_error}");
}

#[test]
fn what_is_seen_through_a_narrow_gap_keeps_its_points() {
    let mut scene = Scene::new("gap");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.6)));
    let wall = [[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]].map(|[x, y]| Vec3::new(x, y, -3.0));
    let wall = scene.add_mesh(Mesh::quad("wall", wall, grey));
    // Between two boards, three pixels wide.
    for side in [-1.0, 1.0] {
        let (a, b) = (
            Vec3::new(0.078 * side, -2.0, -0.02),
            Vec3::new(2.0 * side, 2.0, 0.0),
        );
        scene.add_mesh(Mesh::cuboid("board", a.min(b), a.max(b), grey));
    }
    let (a, b) = (DVec3::new(-0.3, 1.0, 4.0), DVec3::new(0.3, 1.0, 4.0));
    scene.add_light(LinearLight::new("tube", a, b, 3000.0));
    let (world, _) = World::new(Arc::new(scene), &[]);
    let scene = Arc::clone(world.scene());
    let shader = DirectShader::new(Arc::new(world), Vec3::ONE);
    let camera = Camera::look_at(
        "eye",
        DVec3::new(0.0, 0.0, 5.0),
        DVec3::ZERO,
        DVec3::Y,
        FieldOfView::vertical_degrees(50.0),
    );
    let renderer = FrameRenderer::new(&scene, VIEWPORT, FrameSettings::default()).expect("size");
    let mut lockstep = LockstepRenderer::new(renderer, 300);
    lockstep.warm_up(&shader, &camera);
    for _ in 0..12 {
        lockstep.draw(&camera);
        lockstep.shade(&shader);
    }
    lockstep.draw(&camera);
    let points = lockstep.renderer.points();
    let seen = (20..70)
        .flat_map(|y| (59..61).map(move |x| y * points.stride() + x))
        .filter(|&i| lockstep.renderer.store().object(points.slot_plane()[i]) == Some(wall.0))
        .count();
    assert!(seen > 20, "{seen} of 100 pixels in the gap have a point");
}

#[test]
fn no_stale_shadow_outlives_its_frames() {
    for shadows_apart in [false, true] {
        check_stale_shadows(shadows_apart);
    }
}

fn check_stale_shadows(shadows_apart: bool) {
    let (scene, object) = boxed();
    let (world, _) = World::new(Arc::new(scene), &[object]);
    let scene = Arc::clone(world.scene());
    let world = Arc::new(world);
    let shader = DirectShader::new(Arc::clone(&world), Vec3::ZERO);
    let settings = FrameSettings {
        shadows_apart,
        ..FrameSettings::default()
    };
    let renderer = FrameRenderer::new(&scene, VIEWPORT, settings).expect("size");
    let mut lockstep = LockstepRenderer::new(renderer, 300);
    lockstep.warm_up(&shader, &camera());
    for _ in 0..20 {
        lockstep.draw(&camera());
        lockstep.shade(&shader);
    }
    let before = ray_trace(&shader, &camera(), VIEWPORT, 1, 0).expect("the shader works");
    let to = Affine3A::from_translation(Vec3::new(1.8, 0.0, 0.0));
    let change = world.moved(&[Place::Object(object, to)]).expect("movable");
    shader.changed(&change);
    lockstep.renderer.changed(&change);
    let truth = ray_trace(&shader, &camera(), VIEWPORT, 1, 0).expect("the shader works");
    // Where the shadow or the box was: there a stale point would show.
    let changed = |x: u32, y: u32| (before.pixel(x, y) - truth.pixel(x, y)).abs().max_element() > 1.0;
    lockstep.draw(&camera());
    assert!(
        lockstep.renderer.report().doubtful > 100,
        "{:?}",
        lockstep.renderer.report()
    );
    let first = relative_error(&lockstep.renderer, &truth, changed);
    for _ in 0..settings.stale_frames {
        lockstep.shade(&shader);
        lockstep.draw(&camera());
    }
    let last = relative_error(&lockstep.renderer, &truth, changed);
    assert!(first > 0.2, "the shadow moved: {first}");
    assert!(
        last < 0.06,
        "{last} after {} frames, {first} at first",
        settings.stale_frames
    );
    // Every point that is left agrees with the scene as it is.
    let mut met = Encounters::default();
    let mut wrong = 0;
    for (_, point) in lockstep.renderer.store().iter() {
        let request = ShadeRequest {
            id: 0,
            origin: camera().position,
            direction: point.position.as_dvec3() - camera().position,
        };
        let mut answer = Vec::new();
        shader
            .shade(
                &[request],
                0,
                &mut ShaderScratch::default(),
                &mut answer,
                &mut met,
            )
            .expect("a good ray");
        let same_place = answer[0].position.distance(point.position) < 0.01;
        let difference = (answer[0].colour - point.colour).abs().max_element();
        wrong += usize::from(same_place && difference > 0.1 * answer[0].colour.max_element() + 1.0);
    }
    assert!(wrong <= 3, "{wrong} points show what was");
}

#[test]
fn shadows_computed_apart_are_those_of_the_frame_itself() {
    let (scene, object) = boxed();
    let (world, _) = World::new(Arc::new(scene), &[object]);
    let world = Arc::new(world);
    let shader = DirectShader::new(Arc::clone(&world), Vec3::ZERO);
    let to = Affine3A::from_translation(Vec3::new(0.7, 0.3, 0.0));
    let change = world.moved(&[Place::Object(object, to)]).expect("movable");
    let renderer = |shadows_apart| {
        let settings = FrameSettings {
            shadows_apart,
            ..FrameSettings::default()
        };
        FrameRenderer::new(world.scene(), VIEWPORT, settings).expect("size")
    };
    // What the frame itself finds, before and after the box moves.
    let mut within = LockstepRenderer::new(renderer(false), 300);
    within.warm_up(&shader, &camera());
    within.draw(&camera());
    let still = within.renderer.report().shadow_edges;
    within.renderer.changed(&change);
    within.draw(&camera());
    let moved = within.renderer.report().shadow_edges;
    assert!(still > 0 && moved > 0, "{still} edges, {moved} after the move");

    // Nobody does the work: there are none.
    let mut alone = renderer(true);
    alone.draw(&camera(), 1000);
    let (mut points, mut met) = (Vec::new(), Encounters::default());
    let mut scratch = ShaderScratch::default();
    shader
        .shade(alone.requests(), 0, &mut scratch, &mut points, &mut met)
        .expect("good rays");
    alone.take(&points, &met);
    alone.draw(&camera(), 0);
    assert_eq!(alone.report().shadow_edges, 0, "nobody computed them");
    let mut work = alone.shadow_work().expect("shadows were met");
    assert!(alone.shadow_work().is_none(), "it is given away once");
    alone.changed(&change);
    work.run();
    alone.shadow_work_done(work);
    alone.draw(&camera(), 0);
    let report = *alone.report();
    assert_eq!(report.shadow_edges, still, "as the box was when work began");
    assert!(report.shadow_pairs > 0 && report.shadow_ms > 0.0, "{report:?}");
    let mut work = alone.shadow_work().expect("the box has moved meanwhile");
    work.run();
    alone.shadow_work_done(work);
    alone.draw(&camera(), 0);
    assert_eq!(alone.report().shadow_edges, moved, "as the box is");
    assert!(alone.shadow_work().is_none(), "all is done");

    // A thread does it.
    let mut live = renderer(true);
    let mut thread = ShadowThread::start().expect("a thread");
    live.draw(&camera(), 0);
    live.take(&points, &met);
    let mut frames = 0;
    while live.report().shadow_edges != still {
        thread.tend(&mut live);
        live.draw(&camera(), 0);
        frames += 1;
        assert!(frames < 20_000, "the thread gives {:?}", live.report());
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

#[test]
fn points_move_with_their_object() {
    let (scene, object) = boxed();
    let (world, _) = World::new(Arc::new(scene), &[object]);
    let scene = Arc::clone(world.scene());
    let world = Arc::new(world);
    let shader = DirectShader::new(Arc::clone(&world), Vec3::ZERO);
    let renderer = FrameRenderer::new(&scene, VIEWPORT, FrameSettings::default()).expect("size");
    let mut lockstep = LockstepRenderer::new(renderer, 300);
    lockstep.warm_up(&shader, &camera());
    lockstep.draw(&camera());
    let points = |lockstep: &LockstepRenderer| {
        let on_box = lockstep
            .renderer
            .store()
            .iter()
            .filter(|(_, p)| p.object == object.0);
        on_box.map(|(_, p)| p.position).collect::<Vec<_>>()
    };
    let before = points(&lockstep);
    let by = Vec3::new(0.1, 0.2, -0.3);
    let change = world
        .moved(&[Place::Object(object, Affine3A::from_translation(by))])
        .expect("movable");
    lockstep.renderer.changed(&change);
    let after = points(&lockstep);
    assert!(before.len() > 10, "{} points on the box", before.len());
    assert_eq!(before.len(), after.len(), "none is lost");
    for (a, b) in before.iter().zip(&after) {
        assert!((*a + by).distance(*b) < 1e-5, "{a} to {b}");
    }
}

/// Answers some requests, and fails for the others.
struct Moody<'a>(&'a DirectShader);

impl Shader for Moody<'_> {
    fn name(&self) -> &str {
        "moody"
    }

    fn shade(
        &self,
        requests: &[ShadeRequest],
        seed: u64,
        scratch: &mut ShaderScratch,
        points: &mut Vec<ShadedPoint>,
        met: &mut Encounters,
    ) -> Result<(), ShaderError> {
        match requests[0].id / 32 % 3 {
            0 => panic!("as planned"),
            1 => Err(ShaderError::External("no".to_owned())),
            _ => self.0.shade(requests, seed, scratch, points, met),
        }
    }
}

#[test]
fn a_failing_shader_costs_samples_only() {
    let (scene, _) = boxed();
    let (world, _) = World::new(Arc::new(scene), &[]);
    let scene = Arc::clone(world.scene());
    let direct = DirectShader::new(Arc::new(world), Vec3::ZERO);
    let shader = Moody(&direct);
    let renderer = FrameRenderer::new(&scene, VIEWPORT, FrameSettings::default()).expect("size");
    let mut lockstep = LockstepRenderer::new(renderer, 320);
    lockstep.warm_up(&shader, &camera());
    for _ in 0..10 {
        lockstep.draw(&camera());
        lockstep.shade(&shader);
    }
    let trouble = lockstep.trouble();
    assert!(trouble.panics > 0 && trouble.errors > 0, "{trouble:?}");
    assert_eq!(lockstep.renderer.report().holes, 0, "the picture stays whole");
    assert!(
        lockstep.renderer.report().points.occupied > 300,
        "points still come"
    );
}

#[test]
fn the_picture_stays_when_nobody_shades_any_more() {
    let (scene, id) = boxed();
    let (world, _) = World::new(Arc::new(scene), &[id]);
    let world = Arc::new(world);
    let shader = DirectShader::new(Arc::clone(&world), Vec3::ONE);
    let settings = FrameSettings::default();
    let stale = usize::from(settings.stale_frames);
    let renderer = FrameRenderer::new(world.scene(), VIEWPORT, settings).expect("a size");
    let mut lockstep = LockstepRenderer::new(renderer, VIEWPORT.pixels() / 50);
    lockstep.warm_up(&shader, &camera());
    for _ in 0..40 {
        lockstep.draw(&camera());
        lockstep.shade(&shader);
    }
    lockstep.draw(&camera());
    let before = *lockstep.renderer.report();
    // Far longer than an age can count.
    for _ in 0..600 {
        lockstep.draw(&camera());
    }
    let after = *lockstep.renderer.report();
    assert_eq!(after.points.occupied, before.points.occupied, "no point is lost");
    assert_eq!(
        (after.silhouette_edges, after.shadow_edges),
        (before.silhouette_edges, before.shadow_edges),
        "and no edge"
    );
    // What moves is in doubt, shader or not.
    let up = Affine3A::from_translation(Vec3::Y);
    let change = world.moved(&[Place::Object(id, up)]).expect("it may move");
    lockstep.renderer.changed(&change);
    for _ in 0..=stale {
        lockstep.draw(&camera());
    }
    let last = lockstep.renderer.report();
    assert!(
        last.points.occupied < before.points.occupied * 9 / 10,
        "{} of {} points are left",
        last.points.occupied,
        before.points.occupied
    );
    assert!(
        last.points.occupied > before.points.occupied / 4,
        "the floor stays"
    );
    assert_eq!(last.holes, 0, "the picture stays");
}

#[test]
fn nothing_known_is_one_large_hole() {
    let (scene, _) = boxed();
    let mut renderer = FrameRenderer::new(&scene, VIEWPORT, FrameSettings::default()).expect("size");
    renderer.draw(&camera(), 50);
    let FrameReport { holes, .. } = *renderer.report();
    assert_eq!(holes, VIEWPORT.pixels(), "nothing to show");
    assert_eq!(renderer.requests().len(), 50, "but a start");
    let ids: std::collections::BTreeSet<u64> = renderer.requests().iter().map(|r| r.id).collect();
    assert_eq!(ids.len(), 50, "ids differ");
    let none = Viewport { width: 0, height: 5 };
    assert!(
        FrameRenderer::new(&scene, none, FrameSettings::default()).is_err(),
        "no pixels"
    );
}
