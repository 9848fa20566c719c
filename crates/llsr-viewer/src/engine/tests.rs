//! The engine driven by keys and mouse, without a window.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use llsr_io::Tone;
use llsr_scene::{FieldOfView, LinearLight, Material, Mesh, Scene};
use llsr_shading::{DirectShader, ShadedPoint, ShaderError, ShaderScratch};

use super::*;
use crate::jobs::PictureSettings;

const VIEWPORT: Viewport = Viewport {
    width: 96,
    height: 72,
};

/// A red box on a grey floor under a tube.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    let red = scene.add_material(Material::diffuse("red", Vec3::new(0.8, 0.05, 0.05)));
    let half = 10.0;
    scene.add_mesh(Mesh::cuboid(
        "floor",
        Vec3::new(-half, -0.5, -half),
        Vec3::new(half, 0.0, half),
        grey,
    ));
    scene.add_mesh(Mesh::cuboid(
        "box",
        Vec3::new(-0.5, 0.0, -0.5),
        Vec3::new(0.5, 1.0, 0.5),
        red,
    ));
    let (a, b) = (DVec3::new(-1.0, 4.0, 1.0), DVec3::new(1.0, 4.0, 1.0));
    scene.add_light(LinearLight::new("tube", a, b, 5000.0));
    scene
}

fn camera() -> Camera {
    Camera::look_at(
        "default",
        DVec3::new(0.0, 2.0, 5.0),
        DVec3::new(0.0, 0.5, 0.0),
        DVec3::Y,
        FieldOfView::vertical_degrees(40.0),
    )
}

fn choice(name: &str, make: impl Fn(Arc<World>) -> Arc<dyn Shader> + Send + Sync + 'static) -> ShaderChoice {
    ShaderChoice {
        name: name.to_owned(),
        make: Box::new(move |world| Ok(make(world))),
    }
}

fn direct() -> ShaderChoice {
    choice("direct", |world| {
        Arc::new(DirectShader::new(world, Vec3::splat(20.0)))
    })
}

fn settings() -> ViewSettings {
    ViewSettings {
        title: "test".to_owned(),
        samples: 2000,
        shader_threads: 1,
        tone: Tone::Srgb,
        ..ViewSettings::default()
    }
}

fn engine_with(shaders: Vec<ShaderChoice>, settings: ViewSettings) -> Engine {
    let scene = scene();
    let movable = llsr_epr::movable_objects(&scene);
    let world = Arc::new(World::new(Arc::new(scene), &movable).0);
    let mut engine = Engine::new(world, camera(), VIEWPORT, shaders, settings).expect("an engine");
    // Text would be in the way of comparisons.
    engine.shown.numbers = false;
    engine.message = None;
    engine
}

fn engine() -> Engine {
    engine_with(vec![direct()], settings())
}

/// Frames until the picture has settled: most pixels have a sample of this moment.
fn settle(engine: &mut Engine) {
    for _ in 0..40 {
        engine.frame(1.0 / 60.0);
        assert!(
            engine.pool.wait_idle(Duration::from_secs(20)),
            "the shader answers"
        );
    }
    engine.message = None;
    engine.frame(0.0);
}

/// Frames until the edges of all shadows that were met are there.
fn find_shadows(engine: &mut Engine) {
    let start = Instant::now();
    while engine.renderer.shadow_pairs_waiting() > 0 {
        assert!(start.elapsed() < Duration::from_secs(60), "shadows are found");
        engine.frame(0.0);
        std::thread::sleep(Duration::from_millis(1));
    }
    engine.frame(0.0);
}

fn press(engine: &mut Engine, code: &str) {
    engine.key(code, true);
    engine.key(code, false);
}

/// Pixels that differ clearly.
fn difference(a: &Canvas, b: &Canvas) -> usize {
    let far = |(&p, &q): (&u32, &u32)| {
        (0..3).any(|i| ((p >> (8 * i) & 255) as i32 - (q >> (8 * i) & 255) as i32).abs() > 24)
    };
    a.pixels()
        .iter()
        .zip(b.pixels())
        .filter(|&pair| far(pair))
        .count()
}

/// The same view, shaded anew: only pixels at edges, whose samples lie elsewhere, may differ.
fn is_same(a: &Canvas, b: &Canvas) -> bool {
    difference(a, b) < a.pixels().len() / 40
}

fn is_red(pixel: Option<u32>) -> bool {
    pixel.is_some_and(|p| (p >> 16 & 255) > 2 * (p >> 8 & 255))
}

#[test]
fn the_first_frame_shows_the_scene() {
    let mut engine = engine();
    engine.frame(0.0);
    assert!(
        is_red(engine.canvas().get(48, 34)),
        "the box is in the middle: {:x?}",
        engine.canvas().get(48, 34)
    );
    let floor = engine.canvas().get(10, 60);
    assert!(
        !is_red(floor) && floor.is_some_and(|p| p & 255 > 20),
        "the floor is beside it: {floor:x?}"
    );
}

#[test]
fn flying_and_coming_home() {
    let mut engine = engine();
    settle(&mut engine);
    let before = engine.canvas().clone();
    engine.key("KeyD", true);
    for _ in 0..10 {
        engine.frame(0.05);
    }
    engine.key("KeyD", false);
    let right = engine.camera().position - camera().position;
    let expected = 0.5 * engine.rig.speed();
    assert!(
        (right.x - expected).abs() < 1e-9 && right.with_x(0.0).length() < 1e-9,
        "{right} after half a second"
    );
    settle(&mut engine);
    assert!(difference(&before, engine.canvas()) > 100, "another picture");
    engine.frame(0.05);
    assert_eq!(
        engine.camera().position - camera().position,
        right,
        "the key is up again"
    );
    press(&mut engine, "Home");
    assert_eq!(*engine.camera(), camera(), "the first camera");
    settle(&mut engine);
    assert!(is_same(&before, engine.canvas()), "the first picture");
}

#[test]
fn a_long_pause_is_not_flown() {
    let mut engine = engine();
    engine.key("KeyW", true);
    engine.frame(100.0);
    let way = engine.camera().position.distance(camera().position);
    assert!(way <= LONGEST_STEP * engine.rig.speed() + 1e-9, "{way} m");
    engine.release_all();
    engine.frame(0.1);
    let again = engine.camera().position.distance(camera().position);
    assert!((again - way).abs() < 1e-12, "keys are up when the window is left");
}

#[test]
fn the_mouse_turns_and_goes_round() {
    let mut engine = engine();
    engine.pointer(48.0, 34.0);
    engine.button(Button::Left, true);
    engine.pointer(68.0, 34.0);
    engine.button(Button::Left, false);
    let turned = engine.camera().clone();
    assert_eq!(turned.position, camera().position, "on the spot");
    assert!(
        turned.forward().x < -0.05,
        "what is seen follows the pointer to the right: {}",
        turned.forward()
    );
    engine.pointer(10.0, 10.0);
    assert_eq!(*engine.camera(), turned, "the button is up");

    press(&mut engine, "Home");
    press(&mut engine, "KeyO");
    engine.pointer(48.0, 34.0);
    let (_, pivot) = crate::surface_under(engine.world(), &camera(), VIEWPORT, 48.0, 34.0).expect("the box");
    engine.button(Button::Left, true);
    engine.pointer(68.0, 38.0);
    let now = engine.camera();
    assert!(now.position.distance(camera().position) > 0.1, "it goes round");
    let (x, y, _) = now.project(VIEWPORT, pivot).expect("still in view");
    assert!(
        (x - 48.0).abs() < 1e-6 && (y - 34.0).abs() < 1e-6,
        "the picked point stays at its place: {x}, {y}"
    );
}

#[test]
fn a_dragged_box_is_where_the_pointer_is_and_its_old_place_is_empty() {
    let mut engine = engine();
    settle(&mut engine);
    let before = engine.canvas().clone();
    engine.pointer(48.0, 34.0);
    engine.button(Button::Right, true);
    for x in 0..=20 {
        engine.pointer(48.0 + f64::from(x), 34.0);
        engine.frame(1.0 / 60.0);
    }
    engine.button(Button::Right, false);
    settle(&mut engine);
    assert!(
        is_red(engine.canvas().get(68, 34)),
        "the box is 20 pixels to the right"
    );
    assert!(
        !is_red(engine.canvas().get(42, 34)),
        "and no longer at its left border"
    );
    assert!(engine.report().moves >= 20, "it moved in every frame");
    let stale = engine.renderer.settings().stale_frames;
    assert!(u32::from(stale) < 40, "settling outlasts {stale} frames");

    press(&mut engine, "Backspace");
    settle(&mut engine);
    assert!(is_same(&before, engine.canvas()), "back at its place");
}

#[test]
fn a_dragged_light_lights_other_places() {
    let mut engine = engine();
    settle(&mut engine);
    let before = engine.canvas().clone();
    press(&mut engine, "KeyL");
    let (a, b) = engine.world().lights()[0].ends();
    let middle = camera()
        .project(VIEWPORT, a.midpoint(b))
        .expect("in front of the camera");
    engine.pointer(middle.0, middle.1);
    engine.button(Button::Right, true);
    engine.pointer(middle.0 + 40.0, middle.1 + 10.0);
    engine.frame(1.0 / 60.0);
    engine.button(Button::Right, false);
    press(&mut engine, "KeyL");
    let moved = engine.world().lights()[0].ends().0 - a;
    assert!(moved.x > 0.5 && moved.y < 0.0, "to the right and down: {moved}");
    settle(&mut engine);
    assert!(
        difference(&before, engine.canvas()) > 200,
        "shadows fall elsewhere"
    );
}

#[test]
fn what_holds_the_rest_stays() {
    let mut engine = engine();
    engine.pointer(10.0, 60.0);
    engine.button(Button::Right, true);
    engine.pointer(40.0, 60.0);
    engine.frame(1.0 / 60.0);
    assert_eq!(engine.report().moves, 0, "the floor is not dragged");
    let said = engine.message.as_ref().map(|(_, text, _)| text.clone());
    assert!(
        said.as_deref().is_some_and(|text| text.contains("floor")),
        "and it is said why: {said:?}"
    );
}

#[test]
fn every_switch_changes_the_picture_and_back() {
    let mut engine = engine();
    settle(&mut engine);
    // No new samples: the same points, shown in other ways.
    let samples = std::mem::replace(&mut engine.samples, 0);
    find_shadows(&mut engine);
    // With new edges some points are found to shine through, and go.
    for _ in 0..30 {
        engine.frame(0.0);
    }
    let before = engine.canvas().clone();
    for (code, least) in [
        ("KeyG", 40),
        ("KeyR", 1000),
        ("KeyB", 10),
        ("KeyH", 1000),
        ("KeyI", 200),
    ] {
        press(&mut engine, code);
        engine.frame(0.0);
        let changed = difference(&before, engine.canvas());
        assert!(changed >= least, "{code}: {changed} pixels changed");
        press(&mut engine, code);
        engine.message = None;
        engine.frame(0.0);
        let left = difference(&before, engine.canvas());
        assert_eq!(left, 0, "{code} again: pixels that still differ");
    }
    // Samples: after a jump most pixels have none.
    engine.renderer.forget();
    press(&mut engine, "KeyP");
    engine.budget = Budget::default();
    engine.samples = samples.min(200);
    engine.frame(0.0);
    engine.pool.wait_idle(Duration::from_secs(20));
    engine.frame(0.0);
    let lit = engine.canvas().pixels().iter().filter(|&&p| p != 0).count();
    assert!((50..1000).contains(&lit), "{lit} pixels have a sample");
}

#[test]
fn edges_are_drawn_where_the_box_ends() {
    let mut engine = engine();
    press(&mut engine, "KeyG");
    engine.frame(0.0);
    // Along a row through the box: two runs of coloured pixels, at its left and right outline.
    let corner = camera()
        .project(VIEWPORT, DVec3::new(-0.5, 0.5, 0.5))
        .expect("in view");
    let violet = |x: i32| {
        let pixel = engine.canvas().get(x, corner.1 as i32).unwrap_or(0);
        (pixel & 255) > (pixel >> 8 & 255) + 40
    };
    let x = corner.0 as i32;
    assert!((x - 1..=x + 1).any(violet), "the left outline is at {x}");
    assert!(!(x + 4..x + 8).any(violet), "and the face beside it has no edge");
}

#[test]
fn plain_ray_tracing_is_shown_when_it_is_done() {
    let mut engine = engine();
    press(&mut engine, "KeyT");
    let start = Instant::now();
    while engine.tracing.done.is_none() && start.elapsed() < Duration::from_secs(60) {
        engine.frame(0.01);
        std::thread::sleep(Duration::from_millis(2));
    }
    engine.message = None;
    engine.frame(0.0);
    let traced = engine.tracing.done.as_ref().expect("a picture");
    assert!(traced.seconds > 0.0, "its time is known");
    // One ray through each centre: compare with the shader asked directly.
    let shader = (direct().make)(Arc::clone(engine.world())).expect("the shader");
    for (x, y) in [(48u32, 34u32), (20, 60), (75, 50)] {
        let (origin, direction) = camera().ray(VIEWPORT, f64::from(x) + 0.5, f64::from(y) + 0.5);
        let request = ShadeRequest {
            id: 0,
            origin,
            direction,
        };
        let (mut points, mut met) = (Vec::new(), Encounters::default());
        shader
            .shade(
                &[request],
                0,
                &mut ShaderScratch::default(),
                &mut points,
                &mut met,
            )
            .expect("a point");
        let color = points[0].colour;
        let expected = engine.table.pixel(color.x, color.y, color.z);
        assert_eq!(
            engine.canvas().get(x as i32, y as i32),
            Some(expected),
            "pixel {x}, {y}"
        );
    }
    press(&mut engine, "KeyT");
    engine.frame(0.01);
    assert!(engine.tracing.done.is_none(), "gone when it is switched off");
}

#[test]
fn resizing_keeps_the_scene_in_the_picture() {
    let mut engine = engine();
    settle(&mut engine);
    engine.resize(Viewport {
        width: 150,
        height: 110,
    });
    engine.frame(0.0);
    assert_eq!(engine.canvas().size(), (150, 110), "the new size");
    assert!(
        is_red(engine.canvas().get(75, 52)),
        "points that are there already are shown at once"
    );
    engine.resize(Viewport { width: 0, height: 10 });
    engine.frame(0.0);
    assert_eq!(
        engine.canvas().size(),
        (150, 110),
        "a size without pixels is refused"
    );
}

/// Fails or panics whenever it is told to.
struct Moody {
    inner: Arc<dyn Shader>,
    bad: Arc<AtomicBool>,
}

impl Shader for Moody {
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
        if self.bad.load(Ordering::Relaxed) {
            if requests[0].id.is_multiple_of(2) {
                panic!("out of paint");
            }
            return Err(ShaderError::External("the other program is gone".to_owned()));
        }
        self.inner.shade(requests, seed, scratch, points, met)
    }

    fn changed(&self, change: &llsr_shading::SceneChange) {
        self.inner.changed(change);
    }
}

#[test]
fn a_failing_shader_is_shown_and_the_picture_stays() {
    let bad = Arc::new(AtomicBool::new(false));
    let bad_too = Arc::clone(&bad);
    let moody = choice("moody", move |world| {
        Arc::new(Moody {
            inner: Arc::new(DirectShader::new(world, Vec3::splat(20.0))),
            bad: Arc::clone(&bad_too),
        })
    });
    let mut engine = engine_with(vec![moody], settings());
    settle(&mut engine);
    let before = engine.canvas().clone();
    bad.store(true, Ordering::Relaxed);
    let start = Instant::now();
    while engine.report().shader_errors == 0 && start.elapsed() < Duration::from_secs(30) {
        engine.frame(0.01);
        std::thread::sleep(Duration::from_millis(5));
    }
    let report = engine.report();
    assert!(report.shader_errors > 0, "errors are counted");
    let said = report.last_error.unwrap_or_default();
    assert!(
        said.contains("out of paint") || said.contains("gone"),
        "and their words kept: {said}"
    );
    let line = engine
        .lines(&engine.pool.status())
        .into_iter()
        .find(|(_, line)| line.contains("shader failed"));
    assert!(line.is_some(), "the window says so");
    engine.message = None;
    // Without the rows that hold the message.
    let below = |canvas: &Canvas| {
        let mut canvas = canvas.clone();
        canvas.fill(0, 0, 96, 16, 0);
        canvas
    };
    assert!(
        is_same(&below(&before), &below(engine.canvas())),
        "the picture stays"
    );
    bad.store(false, Ordering::Relaxed);
    let shaded = engine.report().samples;
    settle(&mut engine);
    assert!(
        engine.report().samples > shaded,
        "it goes on when the shader does"
    );
}

#[test]
fn shaders_are_changed_in_mid_view() {
    let dark = choice("dark", |world| Arc::new(DirectShader::new(world, Vec3::ZERO)));
    let broken = ShaderChoice {
        name: "broken".to_owned(),
        make: Box::new(|_| Err("no such program".to_owned())),
    };
    let bright = choice("bright", |world| {
        Arc::new(DirectShader::new(world, Vec3::splat(3000.0)))
    });
    // Dark enough that nothing is clipped.
    let settings = ViewSettings {
        exposure: Some(-10.0),
        ..settings()
    };
    let mut engine = engine_with(vec![dark, bright, broken], settings);
    // A move before the change: the new shader must know of it.
    let place = Place::Object(
        ObjectId(1),
        glam::Affine3A::from_translation(Vec3::new(1.0, 0.0, 0.0)),
    );
    engine.put(&[place]);
    settle(&mut engine);
    let before = engine.canvas().clone();
    press(&mut engine, "KeyN");
    settle(&mut engine);
    let level = |canvas: &Canvas| {
        canvas
            .pixels()
            .iter()
            .map(|p| u64::from(p >> 8 & 255))
            .sum::<u64>()
    };
    assert!(
        level(engine.canvas()) > 2 * level(&before),
        "the other shader is brighter"
    );
    let (x, y, _) = camera()
        .project(VIEWPORT, DVec3::new(1.0, 0.5, 0.5))
        .expect("in view");
    let pixel = engine.canvas().get(x as i32, y as i32);
    assert!(
        pixel.is_some_and(|p| (p >> 16 & 255) > (p >> 8 & 255)),
        "the box stands where it was put: {pixel:x?}"
    );
    press(&mut engine, "KeyN");
    let said = engine.message.as_ref().map(|m| m.1.clone()).unwrap_or_default();
    assert!(said.contains("no such program"), "{said}");
    assert_eq!(
        engine.shaders[engine.chosen].name, "bright",
        "goes on with what it had"
    );
}

#[test]
fn without_a_shader_there_is_no_view() {
    let world = Arc::new(World::new(Arc::new(scene()), &[]).0);
    let error = Engine::new(world, camera(), VIEWPORT, Vec::new(), settings()).expect_err("refused");
    assert_eq!(error, ViewError::NoShader, "with its reason");
}

#[test]
fn pictures_and_paths_are_saved_beside_the_display() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = ViewSettings {
        picture: PictureSettings {
            spp: 4,
            stem: folder.path().join("shot"),
        },
        path_stem: folder.path().join("path"),
        ..settings()
    };
    let mut engine = engine_with(vec![direct()], settings);
    let place = Place::Object(
        ObjectId(1),
        glam::Affine3A::from_translation(Vec3::new(1.2, 0.0, 0.0)),
    );
    engine.put(&[place]);
    for number in 1..=2 {
        press(&mut engine, "KeyX");
        let start = Instant::now();
        while engine.report().files.len() < number && start.elapsed() < Duration::from_secs(60) {
            engine.frame(0.01);
            std::thread::sleep(Duration::from_millis(2));
        }
    }
    let files = engine.report().files;
    assert_eq!(
        files,
        ["shot.png", "shot-2.png"].map(|name| folder.path().join(name)),
        "two pictures"
    );
    let image = llsr_io::read_image(&files[0]).expect("a picture");
    assert_eq!((image.width, image.height), (96, 72), "of the window's size");
    let pixels = image.rgb().expect("colours");
    let red = |x: usize, y: usize| pixels[y * 96 + x].x > 3.0 * pixels[y * 96 + x].y;
    let (x, y, _) = camera()
        .project(VIEWPORT, DVec3::new(1.2, 0.5, 0.5))
        .expect("in view");
    assert!(red(x as usize, y as usize), "of the scene as it stands");

    press(&mut engine, "KeyC");
    engine.key("KeyW", true);
    for _ in 0..11 {
        engine.frame(0.1);
    }
    engine.key("KeyW", false);
    press(&mut engine, "KeyC");
    let path = folder.path().join("path.txt");
    let text = std::fs::read_to_string(&path).expect("a path");
    let path = llsr_epr::CameraPath::parse(&text, DVec3::ZERO).expect("that can be read");
    let steps = path.cameras.len() - 1;
    assert!((29..=30).contains(&steps), "{steps} steps in a second");
    let way = path.cameras[steps].position.distance(path.cameras[0].position);
    let expected = engine.rig.speed() * steps as f64 / 30.0;
    assert!((way - expected).abs() < 1e-6, "{way} m instead of {expected}");
}

#[test]
fn a_picture_can_be_given_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = ViewSettings {
        picture: PictureSettings {
            spp: 4096,
            stem: folder.path().join("shot"),
        },
        ..settings()
    };
    let mut engine = engine_with(vec![direct()], settings);
    press(&mut engine, "KeyX");
    engine.frame(0.01);
    assert!(engine.saving.is_some(), "under way");
    press(&mut engine, "KeyX");
    assert!(engine.saving.is_none(), "given up");
    engine.frame(0.01);
    drop(engine);
    let left = std::fs::read_dir(folder.path()).expect("the folder").count();
    assert_eq!(left, 0, "nothing half written");
}

#[test]
fn requests_are_handed_in_so_that_the_first_lie_everywhere() {
    for count in [0, 1, 255, 257, 3000] {
        let all: Vec<ShadeRequest> = (0..count)
            .map(|id| ShadeRequest {
                id,
                origin: DVec3::ZERO,
                direction: DVec3::Z,
            })
            .collect();
        let mut order = vec![all.first().copied().unwrap_or(ShadeRequest {
            id: 9,
            origin: DVec3::ZERO,
            direction: DVec3::Z,
        })];
        spread(&all, &mut order);
        let mut ids: Vec<u64> = order.iter().map(|request| request.id).collect();
        let first: Vec<u64> = ids.iter().copied().take(CHUNK / 2).collect();
        ids.sort_unstable();
        assert!(ids.into_iter().eq(0..count), "each of {count} once");
        let gap = first.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
        assert!(gap <= count / CHUNK as u64 + 1, "{count}: a gap of {gap}");
        let reached = first.last().map_or(0, |&id| id);
        assert!(reached >= count / 3 || count < 3, "{count}: only up to {reached}");
    }
}

#[test]
fn escape_ends() {
    let mut engine = engine();
    assert!(!engine.wants_to_quit(), "not yet");
    press(&mut engine, "Escape");
    assert!(engine.wants_to_quit(), "now");
}
