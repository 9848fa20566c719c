//! Work that is left out must not show: pictures with and without it.

use glam::{DVec3, Vec3};
use llsr_scene::{AreaLight, AreaShape, EmissionLaw, LinearLight, Scene, Viewport, demo};
use llsr_shading::{Film, Layer, Method, Rendered, Settings, Wasteful, render};
use llsr_tracer::Tracer;

const VIEW: Viewport = Viewport {
    width: 75,
    height: 45,
};

fn picture(scene: &Scene, settings: &Settings) -> Rendered {
    let (tracer, warnings) = Tracer::new(scene);
    assert!(warnings.is_empty(), "{warnings:?}");
    render(scene, &tracer, &scene.cameras[0], VIEW, settings, &|| true).expect("nobody interrupts")
}

/// A demo with more kinds of light in it, one of them without power and one under the floor.
fn many_lights(name: &str) -> Scene {
    let mut scene = demo::build(name).expect("built in");
    let around = |x: f64, y: f64| DVec3::new(x, y, 0.7);
    scene.add_light(LinearLight::new("off", around(-1.0, 2.0), around(1.0, 2.0), 0.0));
    scene.add_light(LinearLight::new(
        "under",
        around(-1.0, -2.0),
        around(1.0, -3.0),
        900.0,
    ));
    let mut thick = LinearLight::new("thick", around(-0.6, 2.1), around(0.9, 2.2), 2000.0);
    thick.radius = 0.1;
    scene.add_light(thick);
    scene.add_light(AreaLight {
        name: "panel".to_owned(),
        shape: AreaShape::Rect {
            corner: around(-0.5, 2.2),
            along: DVec3::new(0.9, 0.0, 0.2),
            across: DVec3::new(-0.1, 0.0, 0.5),
        },
        flux: 1500.0,
        color: Vec3::ONE,
    });
    scene
}

fn settings(method: Method, spp: u32, wasteful: Wasteful) -> Settings {
    Settings {
        method,
        spp,
        wasteful,
        layers: vec![
            Layer::Irradiance,
            Layer::Discontinuities,
            Layer::Certificate,
            Layer::Depth,
        ],
        ..Settings::default()
    }
}

fn assert_same(a: &Film, b: &Film, what: &str) {
    for ((name, a), (_, b)) in a.channels.iter().zip(&b.channels) {
        // A light without power has changes too, once it is searched.
        if what.ends_with("power") && name == "discontinuities.Y" {
            continue;
        }
        let different = a
            .iter()
            .zip(b)
            .filter(|(a, b)| a.to_bits() != b.to_bits())
            .count();
        assert_eq!(different, 0, "{what}: pixels of {name} differ");
    }
}

#[test]
fn blocks_boxes_and_pruning_do_not_show() {
    let (mut clear, mut hidden, mut among) = (0, 0, 0);
    for name in ["subway", "wall", "cylinder-2", "sphere-and-friends"] {
        let scene = many_lights(name);
        for (method, spp) in [(Method::Auto, 1), (Method::Exact, 3)] {
            let skipping = picture(&scene, &settings(method, spp, Wasteful::default()));
            clear += skipping.statistics.skipped.clear_blocks;
            hidden += skipping.statistics.skipped.hidden_blocks;
            among += skipping.statistics.fans.in_shaft;
            let none = Wasteful::default();
            for (what, wasteful) in [
                ("tiles", Wasteful { tiles: true, ..none }),
                ("boxes", Wasteful { boxes: true, ..none }),
                ("prune", Wasteful { prune: true, ..none }),
                ("power", Wasteful { power: true, ..none }),
            ] {
                let whole = picture(&scene, &settings(method, spp, wasteful));
                assert_same(&skipping.film, &whole.film, &format!("{name}, {method}, {what}"));
                let (less, more) = (&skipping.statistics, &whole.statistics);
                let queries = |s: &llsr_shading::Statistics| s.fans.queries;
                match what {
                    "tiles" | "boxes" => {
                        assert_eq!(more.skipped.clear_blocks, 0, "{name}: {what} is switched off");
                        assert!(queries(more) > queries(less), "{name}: {what} saves queries");
                    }
                    "power" => assert!(
                        more.skipped.no_power == 0 && less.skipped.no_power > 0,
                        "{name}: the dark light is searched"
                    ),
                    _ => assert!(more.fans.pruned_blocked == 0, "{name}: nothing is pruned"),
                }
            }
        }
    }
    assert!(
        clear > 2000 && hidden > 100 && among > 2000,
        "every kind occurs: {clear} clear, {hidden} hidden, {among} among"
    );
}

#[test]
fn what_is_below_the_horizon_does_not_show() {
    for name in ["subway", "cylinder-2"] {
        let scene = many_lights(name);
        let skipping = picture(&scene, &settings(Method::Exact, 1, Wasteful::default()));
        let none = Wasteful::default();
        for wasteful in [
            Wasteful {
                horizon: true,
                ..none
            },
            Wasteful { clip: true, ..none },
        ] {
            let whole = picture(&scene, &settings(Method::Exact, 1, wasteful));
            assert!(
                whole.statistics.skipped.below_horizon < skipping.statistics.skipped.below_horizon,
                "{name}: lights below the horizon are searched"
            );
            let channel = |film: &Film| film.channel("irradiance.Y").expect("asked for").to_vec();
            for (a, b) in channel(&skipping.film).into_iter().zip(channel(&whole.film)) {
                assert!(
                    (a - b).abs() <= 1e-5 * a.max(b),
                    "{name}, {wasteful:?}: {a} and {b}"
                );
            }
        }
    }
}

#[test]
fn threads_and_emission_laws_do_not_matter_to_blocks() {
    let mut scene = many_lights("subway");
    for light in &mut scene.lights {
        if let llsr_scene::Light::Linear(light) = light {
            light.emission = EmissionLaw::Isotropic;
        }
    }
    let settings = settings(Method::Auto, 2, Wasteful::default());
    let pictures = [1, 2, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| picture(&scene, &settings))
    });
    for other in &pictures[1..] {
        assert_same(&pictures[0].film, &other.film, "other threads");
        assert_eq!(
            pictures[0].statistics, other.statistics,
            "the same work whatever the threads"
        );
    }
}
