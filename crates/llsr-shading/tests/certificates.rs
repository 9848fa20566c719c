//! What certificates promise holds, where fans are too dear and a search takes over.

use glam::{DVec3, Vec3};
use llsr_scene::{Camera, FieldOfView, Light, LinearLight, Material, Mesh, Scene, Viewport};
use llsr_shading::{Film, Layer, Method, Rendered, Settings, SurfacePoint, render};
use llsr_testkit::tracer::bumpy_knot;
use llsr_tracer::{FanQuery, FanScratch, Tracer};
use llsr_visibility::Partition;

const VIEW: Viewport = Viewport {
    width: 48,
    height: 48,
};

/// A rough knot between a tube and a floor, seen from above.
fn scene() -> Scene {
    let mut scene = Scene::new("knot");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    let v = Vec3::new;
    let floor = [
        v(-3.0, -1.0, -3.0),
        v(-3.0, -1.0, 3.0),
        v(3.0, -1.0, 3.0),
        v(3.0, -1.0, -3.0),
    ];
    scene.add_mesh(Mesh::quad("floor", floor, grey));
    scene.add_mesh(bumpy_knot(300, 30, 0.2, grey));
    let (a, b) = (DVec3::new(-1.2, 2.5, 0.3), DVec3::new(1.2, 2.3, -0.2));
    scene.add_light(LinearLight::new("tube", a, b, 1000.0));
    scene.cameras.push(Camera::look_at(
        "above",
        DVec3::new(0.0, 4.0, 1.0),
        DVec3::new(0.0, -1.0, 0.0),
        DVec3::NEG_Z,
        FieldOfView::vertical_degrees(45.0),
    ));
    scene
}

fn picture(scene: &Scene, tracer: &Tracer, method: Method, nu: f64) -> Rendered {
    let settings = Settings {
        method,
        nu,
        epsilon: 0.01,
        // Little enough that most penumbrae are searched.
        fan_budget: 12,
        layers: vec![Layer::Irradiance, Layer::Discontinuities, Layer::Certificate],
        ..Settings::default()
    };
    render(scene, tracer, &scene.cameras[0], VIEW, &settings, &|| true).expect("nobody interrupts")
}

fn layer<'a>(film: &'a Film, name: &str) -> &'a [f32] {
    film.channel(name).expect("the layer was asked for")
}

/// Width of the narrowest visible or hidden stretch of the light above the horizon.
fn narrowest(visible: &Partition, t0: f64, t1: f64) -> f64 {
    let mut ends = vec![t0, t1];
    ends.extend(
        visible
            .changes()
            .map(|change| change.t)
            .filter(|&t| t0 < t && t < t1),
    );
    ends.sort_unstable_by(f64::total_cmp);
    ends.windows(2)
        .map(|pair| (pair[1] - pair[0]) / (t1 - t0))
        .fold(1.0, f64::min)
}

#[test]
fn nothing_wider_than_nu_is_overlooked_and_ends_are_exact() {
    let scene = scene();
    let (tracer, warnings) = Tracer::new(&scene);
    assert!(warnings.is_empty(), "{warnings:?}");
    let Light::Linear(light) = &scene.lights[0] else {
        panic!("a linear light")
    };
    let exact = picture(&scene, &tracer, Method::Exact, 0.25);
    assert!(
        layer(&exact.film, "certificate.Y")
            .iter()
            .all(|&level| level == 0.0),
        "exact queries are exact"
    );
    let rays = scene.cameras[0].rays(VIEW);
    let mut fan = FanScratch::default();
    let mut visible = Partition::default();
    for nu in [0.25, 0.05] {
        let auto = picture(&scene, &tracer, Method::Auto, nu);
        let (mut proved, mut bounded, mut complete) = (0, 0, 0);
        for index in 0..(VIEW.width * VIEW.height) as usize {
            let (x, y) = (index as u32 % VIEW.width, index as u32 / VIEW.width);
            let at = |rendered: &Rendered, name: &str| f64::from(layer(&rendered.film, name)[index]);
            let level = at(&auto, "certificate.Y");
            let (found, truth) = (at(&auto, "irradiance.Y"), at(&exact, "irradiance.Y"));
            let (changes, all) = (at(&auto, "discontinuities.Y"), at(&exact, "discontinuities.Y"));
            if level == 0.0 {
                proved += 1;
                assert_eq!((found, changes), (truth, all), "certified exact at {x},{y}");
                continue;
            }
            assert!(changes <= all, "{changes} changes at {x},{y}, of {all}");
            if level > 1.0 {
                continue;
            }
            bounded += 1;
            let (eye, direction) = rays.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let hit = tracer
                .closest(eye, direction, f64::INFINITY)
                .expect("a search is about a surface");
            let point = SurfacePoint::new(&scene, &hit, direction);
            let above = |q: DVec3| point.geometric_normal.dot(q - point.origin) > 0.0;
            if !above(light.a) || !above(light.b) {
                continue;
            }
            tracer.fan(
                &FanQuery::new(point.origin, light.a, light.b),
                &mut fan,
                &mut visible,
            );
            if narrowest(&visible, 0.0, 1.0) > nu {
                assert_eq!(changes, all, "nothing at {x},{y} is narrow: {visible:?}");
            }
            if changes == all {
                complete += 1;
                assert!(
                    (found - truth).abs() <= 1e-6 * truth,
                    "all changes of {x},{y} were found, and not exactly: {found}, not {truth}"
                );
            }
        }
        assert!(
            proved > 1000 && bounded > 100 && complete > 60,
            "nu {nu}: {proved} proved, {bounded} bounded, {complete} of them complete"
        );
    }
}
