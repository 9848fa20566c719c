//! Pictures against answers that are known or found the slow way.

use glam::DVec3;
use llsr_scene::{
    Camera, FieldOfView, Light, LinearLight, Material, Mesh, Projection, Scene, Viewport, demo,
};
use llsr_shading::{Film, Layer, Method, Rendered, Settings, render};
use llsr_tracer::Tracer;

const VIEW: Viewport = Viewport {
    width: 48,
    height: 40,
};

fn picture(scene: &Scene, settings: Settings) -> Rendered {
    let (tracer, warnings) = Tracer::new(scene);
    assert!(warnings.is_empty(), "{warnings:?}");
    render(scene, &tracer, &scene.cameras[0], VIEW, &settings, &|| true).expect("nobody interrupts")
}

fn layer<'a>(film: &'a Film, name: &str) -> &'a [f32] {
    film.channel(name).expect("the layer was asked for")
}

/// Irradiance of the visible stretch (`t0`, `t1`) of the light by the midpoint rule on the defining integral.
fn slow_irradiance(light: &LinearLight, p: DVec3, normal: DVec3, t0: f64, t1: f64) -> f64 {
    let steps = 4_000;
    let axis = (light.b - light.a).normalize();
    let pi = std::f64::consts::PI;
    (0..steps)
        .map(|i| {
            let t = t0 + (t1 - t0) * (f64::from(i) + 0.5) / f64::from(steps);
            let to = light.a + (light.b - light.a) * t - p;
            let (r2, direction) = (to.length_squared(), to.normalize());
            let sine = axis.cross(direction).length();
            light.flux / (pi * pi) * sine * normal.dot(direction).max(0.0) / r2 * (t1 - t0) / f64::from(steps)
        })
        .sum()
}

/// Where the camera ray through a pixel's centre meets the floor.
fn floor_point(camera: &Camera, x: u32, y: u32) -> Option<DVec3> {
    let (origin, direction) = camera.ray(VIEW, f64::from(x) + 0.5, f64::from(y) + 0.5);
    (direction.y < 0.0).then(|| origin - direction * (origin.y / direction.y))
}

#[test]
fn the_penumbra_behind_the_wall_is_that_of_its_upright_edge() {
    let scene = demo::build("wall").expect("built in");
    let Light::Linear(light) = &scene.lights[0] else {
        panic!("a linear light")
    };
    let layers = vec![Layer::Irradiance, Layer::Discontinuities, Layer::Depth];
    for method in [
        Method::Auto,
        Method::Tdf,
        Method::Rsb,
        Method::Dithered,
        Method::RandomCut,
        Method::Bisection,
    ] {
        let settings = Settings {
            method,
            epsilon: 1e-7,
            layers: layers.clone(),
            ..Settings::default()
        };
        let film = picture(&scene, settings).film;
        let (irradiance, depth) = (layer(&film, "irradiance.Y"), layer(&film, "depth.Z"));
        let (mut in_penumbra, mut checked) = (0, 0);
        for (index, (&seen, &distance)) in irradiance.iter().zip(depth).enumerate() {
            let (x, y) = (index as u32 % VIEW.width, index as u32 / VIEW.width);
            let Some(p) = floor_point(&scene.cameras[0], x, y) else {
                continue;
            };
            // The wall hides part of the floor; it stands at z = -4 and ends at x = -1.
            let is_floor = (p.distance(scene.cameras[0].position) / f64::from(distance) - 1.0).abs() < 1e-5;
            if !is_floor || p.z < -4.0 {
                continue;
            }
            // The line from p over the wall's edge meets the light's line z = -8 there:
            let x_hidden = p.x + (-1.0 - p.x) * (-8.0 - p.z) / (-4.0 - p.z);
            let hidden = ((x_hidden - light.a.x) / (light.b.x - light.a.x)).clamp(0.0, 1.0);
            let expected = slow_irradiance(light, p, DVec3::Y, hidden, 1.0);
            in_penumbra += usize::from(hidden > 0.0 && hidden < 1.0);
            checked += 1;
            let tolerance = 1e-5 * expected + 1e-3;
            assert!(
                (f64::from(seen) - expected).abs() < tolerance,
                "{method} at {x},{y}: {seen}, not {expected}"
            );
        }
        assert!(
            checked > 1000 && in_penumbra > 300,
            "{checked} floor pixels, {in_penumbra} in penumbra"
        );
    }
}

#[test]
fn sampling_methods_converge_to_the_same_picture() {
    let scene = demo::build("cylinder-2").expect("built in");
    let layers = vec![Layer::Irradiance];
    let truth = Settings {
        epsilon: 1e-8,
        nu: 0.05,
        layers: layers.clone(),
        ..Settings::default()
    };
    let truth = picture(&scene, truth);
    let exact = layer(&truth.film, "irradiance.Y");
    let mean: f64 = exact.iter().map(|&v| f64::from(v)).sum::<f64>() / exact.len() as f64;
    for (method, samples, bound) in [
        (Method::Stratified, 256, 0.004),
        (Method::Uniform, 256, 0.006),
        (Method::Gauss, 64, 0.02),
        (Method::Hpd, 64, 0.04),
    ] {
        let settings = Settings {
            method,
            samples,
            layers: layers.clone(),
            ..Settings::default()
        };
        let film = picture(&scene, settings).film;
        let square: f64 = layer(&film, "irradiance.Y")
            .iter()
            .zip(exact)
            .map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2))
            .sum();
        let error = (square / exact.len() as f64).sqrt() / mean;
        assert!(error < bound, "{method} with {samples} samples: {error}");
    }
}

/// A floor under bars that run across the light: many changes of visibility.
fn bars(count: u32) -> Scene {
    let mut scene = Scene::new("bars");
    let grey = scene.add_material(Material::diffuse("grey", glam::Vec3::splat(0.5)));
    let v = glam::Vec3::new;
    let floor = [
        v(-3.0, 0.0, -3.0),
        v(-3.0, 0.0, 3.0),
        v(3.0, 0.0, 3.0),
        v(3.0, 0.0, -3.0),
    ];
    scene.add_mesh(Mesh::quad("floor", floor, grey));
    let pitch = 2.0 / count as f32;
    for i in 0..count {
        let x = -1.0 + pitch * i as f32;
        let corners = [
            v(x, 1.0, -1.0),
            v(x, 1.0, 1.0),
            v(x + 0.5 * pitch, 1.0, 1.0),
            v(x + 0.5 * pitch, 1.0, -1.0),
        ];
        scene.add_mesh(Mesh::quad("bar", corners, grey));
    }
    let (a, b) = (DVec3::new(-1.0, 2.0, 0.0), DVec3::new(1.0, 2.0, 0.0));
    scene.add_light(LinearLight::new("tube", a, b, 1000.0));
    let mut camera = Camera::look_at(
        "below",
        DVec3::new(0.0, 0.9, 0.0),
        DVec3::ZERO,
        DVec3::X,
        FieldOfView::vertical_degrees(60.0),
    );
    camera.projection = Projection::Orthographic { height: 1.0 };
    scene.cameras.push(camera);
    scene
}

#[test]
fn the_default_sees_every_bar_where_the_finder_of_two_changes_does_not() {
    let scene = bars(4);
    let layers = vec![Layer::Irradiance, Layer::Discontinuities];
    let render = |method| {
        let settings = Settings {
            method,
            epsilon: 1e-6,
            nu: 0.03,
            layers: layers.clone(),
            ..Settings::default()
        };
        picture(&scene, settings).film
    };
    let (auto, tdf) = (render(Method::Auto), render(Method::Tdf));
    let Light::Linear(light) = &scene.lights[0] else {
        panic!("a linear light")
    };
    let error = |film: &Film| {
        let irradiance = layer(film, "irradiance.Y");
        let mut worst = 0f64;
        for y in 0..VIEW.height {
            for x in 0..VIEW.width {
                let Some(p) = floor_point(&scene.cameras[0], x, y) else {
                    continue;
                };
                // Bars at half height, 0.25 wide every 0.5: their shadows on the light seen from p, at twice the scale.
                let shadow = |edge: f64| ((p.x + 2.0 * (edge - p.x) + 1.0) / 2.0).clamp(0.0, 1.0);
                let mut expected = slow_irradiance_fast(light, p, 0.0, 1.0);
                for bar in 0..4 {
                    let left = -1.0 + 0.5 * f64::from(bar);
                    expected -= slow_irradiance_fast(light, p, shadow(left), shadow(left + 0.25));
                }
                worst =
                    worst.max((f64::from(irradiance[(y * VIEW.width + x) as usize]) / expected - 1.0).abs());
            }
        }
        worst
    };
    assert!(error(&auto) < 1e-4, "auto is off by {}", error(&auto));
    assert!(
        error(&tdf) > 0.1,
        "two changes cannot describe four bars: {}",
        error(&tdf)
    );
    assert!(
        layer(&auto, "discontinuities.Y").iter().any(|&n| n >= 4.0),
        "many changes are seen"
    );
}

/// As `slow_irradiance` on the floor, with fewer steps: the stretches are short.
fn slow_irradiance_fast(light: &LinearLight, p: DVec3, t0: f64, t1: f64) -> f64 {
    if t0 >= t1 {
        return 0.0;
    }
    let steps = 400;
    let pi = std::f64::consts::PI;
    let axis = (light.b - light.a).normalize();
    (0..steps)
        .map(|i| {
            let t = t0 + (t1 - t0) * (f64::from(i) + 0.5) / f64::from(steps);
            let to = light.a + (light.b - light.a) * t - p;
            let direction = to.normalize();
            let sine = axis.cross(direction).length();
            light.flux / (pi * pi) * sine * direction.y.max(0.0) / to.length_squared() * (t1 - t0)
                / f64::from(steps)
        })
        .sum()
}

#[test]
fn a_light_below_the_horizon_costs_no_test() {
    let mut scene = demo::build("wall").expect("built in");
    let Light::Linear(light) = &mut scene.lights[0] else {
        panic!("a linear light")
    };
    light.a.y = -2.0;
    light.b.y = -2.0;
    let rendered = picture(&scene, Settings::default());
    // The wall's front still sees a part of it through no floor: only floor pixels are without a test.
    assert!(
        rendered.statistics.skipped.below_horizon > 1000,
        "{:?}",
        rendered.statistics.skipped
    );
    scene.lights.clear();
    scene.add_light(LinearLight::new(
        "off",
        DVec3::new(-1.0, 3.0, 0.0),
        DVec3::new(1.0, 3.0, 0.0),
        0.0,
    ));
    let rendered = picture(&scene, Settings::default());
    assert_eq!(
        rendered.statistics.visibility_tests, 0,
        "a light without flux needs no test"
    );
    assert_eq!(
        rendered.statistics.skipped.no_power, rendered.statistics.hits,
        "and is counted"
    );
}

#[test]
fn subsamples_average_to_the_same_brightness() {
    let scene = demo::build("sphere-and-friends").expect("built in");
    let mean = |spp: u32| {
        let settings = Settings {
            epsilon: 1e-4,
            nu: 0.1,
            spp,
            layers: vec![Layer::Irradiance],
            ..Settings::default()
        };
        let film = picture(&scene, settings).film;
        let values = layer(&film, "irradiance.Y");
        values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
    };
    let (one, many) = (mean(1), mean(9));
    assert!((one / many - 1.0).abs() < 0.02, "{one} and {many}");
}

#[test]
fn refinement_brings_the_finder_of_two_changes_closer() {
    let scene = bars(3);
    let layers = vec![Layer::Irradiance];
    let truth = Settings {
        epsilon: 1e-6,
        nu: 0.02,
        layers: layers.clone(),
        ..Settings::default()
    };
    let truth = picture(&scene, truth).film;
    let error = |refine: bool| {
        let settings = Settings {
            method: Method::Tdf,
            refine,
            layers: layers.clone(),
            ..Settings::default()
        };
        let rendered = picture(&scene, settings);
        assert_eq!(
            rendered.statistics.refined > 0,
            refine,
            "pixels are refined only on request"
        );
        let (a, b) = (
            layer(&rendered.film, "irradiance.Y"),
            layer(&truth, "irradiance.Y"),
        );
        a.iter()
            .zip(b)
            .map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2))
            .sum::<f64>()
    };
    let (plain, refined) = (error(false), error(true));
    assert!(
        refined < 0.25 * plain,
        "the squared error goes from {plain} to {refined}"
    );
}

#[test]
fn a_rectangle_gives_the_irradiance_of_its_surface() {
    let mut scene = bars(1);
    scene.lights.clear();
    let (flux, side, height) = (1000.0, 0.8, 2.5);
    scene.add_light(llsr_scene::AreaLight {
        name: "panel".to_owned(),
        shape: llsr_scene::AreaShape::Rect {
            corner: DVec3::new(1.2, height, -0.4),
            along: DVec3::new(side, 0.0, 0.0),
            across: DVec3::new(0.0, 0.0, side),
        },
        flux,
        color: glam::Vec3::ONE,
    });
    // Only the right half of the floor sees the panel without a bar in between: look there.
    scene.objects.truncate(1);
    let settings = Settings {
        layers: vec![Layer::Irradiance],
        light_lines: 8,
        ..Settings::default()
    };
    let film = picture(&scene, settings).film;
    let irradiance = layer(&film, "irradiance.Y");
    for (x, y) in [(24, 20), (3, 5), (40, 33)] {
        let p = floor_point(&scene.cameras[0], x, y).expect("the floor");
        let steps = 200;
        let mut expected = 0.0;
        for i in 0..steps {
            for j in 0..steps {
                let at = |k: i32| (f64::from(k) + 0.5) / f64::from(steps) * side;
                let to = DVec3::new(1.2 + at(i), height, -0.4 + at(j)) - p;
                let cosine = to.y / to.length();
                // Radiance flux / (pi A); both cosines are the same, and A / steps^2 is the area of a cell.
                expected += flux / std::f64::consts::PI * cosine * cosine
                    / to.length_squared()
                    / f64::from(steps * steps);
            }
        }
        let seen = f64::from(irradiance[(y * VIEW.width + x) as usize]);
        assert!(
            (seen / expected - 1.0).abs() < 1e-4,
            "{seen} and {expected} at {x},{y}"
        );
    }
}

#[test]
fn a_thick_tube_sends_the_flux_of_its_axis_and_casts_another_shadow() {
    let scene = bars(1);
    let (line, mut thick) = (scene.clone(), scene.clone());
    let Light::Linear(light) = &mut thick.lights[0] else {
        panic!("a linear light")
    };
    light.radius = 0.15;
    let settings = || Settings {
        epsilon: 1e-5,
        nu: 0.1,
        light_lines: 16,
        layers: vec![Layer::Irradiance],
        ..Settings::default()
    };
    let (thin, soft) = (picture(&line, settings()).film, picture(&thick, settings()).film);
    let (a, b) = (layer(&thin, "irradiance.Y"), layer(&soft, "irradiance.Y"));
    let mean = |v: &[f32]| v.iter().map(|&v| f64::from(v)).sum::<f64>() / v.len() as f64;
    assert!(
        (mean(a) / mean(b) - 1.0).abs() < 0.05,
        "the same flux: {} and {}",
        mean(a),
        mean(b)
    );
    assert!(
        a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.01 * a.max(*b)),
        "the radius matters"
    );
}
