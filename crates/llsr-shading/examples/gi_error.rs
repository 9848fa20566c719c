//! How far the irradiance of the global illumination shader is from that of long random walks, and what it costs.
//!
//! ```text
//! cargo run --release -p llsr-shading --example gi_error -- [SCENE [MATERIAL=FLUX]] [points=N] [walks=N] [rays=AxB]
//!     [tolerance=T] [spacing=S] [levels=N] [bounces=N] [memory=MIB] [crowd=N] [then ...]
//! ```
//!
//! SCENE is a file or `demo:NAME`; without one, `demo:rooms`. Points are spread over the picture of its first camera, and after a `crowd` of others, which say what a point costs. Each `then`
//! begins another row with settings of its own. One thread.
//!
//! The walks share only the tracer and the materials with the shader. Errors are relative root mean squares over the points (root of
//! the mean square error by the mean), with the expected share of the walks' own noise taken out.

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use llsr_io::{LoadOptions, load_scene};
use llsr_scene::{Camera, Light, LinearLight, Scene, Viewport, demo, luminance};
use llsr_shading::{GiSettings, GiShader, ShaderScratch, SurfacePoint, World};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const SIZE: Viewport = Viewport {
    width: 512,
    height: 512,
};

struct Reference {
    surface: SurfacePoint,
    /// Luminance of the irradiance.
    mean: f64,
    /// Square of its standard error.
    variance: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1).peekable();
    let name = arguments
        .next_if(|a| !a.contains('=') || a.contains('.'))
        .unwrap_or_else(|| "demo:rooms".into());
    let mut options = LoadOptions::default();
    let (mut points, mut walks, mut crowd) = (400, 4000, 16_384);
    let mut rows = vec![GiSettings::default()];
    for argument in arguments {
        let row = rows.last_mut().ok_or("there is a row")?;
        match argument.split_once('=') {
            None if argument == "then" => rows.push(GiSettings::default()),
            Some(("points", value)) => points = value.parse()?,
            Some(("walks", value)) => walks = value.parse()?,
            Some(("tolerance", value)) => row.tolerance = value.parse()?,
            Some(("crowd", value)) => crowd = value.parse()?,
            Some(("memory", value)) => row.memory = value.parse::<usize>()? << 20,
            Some(("bounces", value)) => row.bounces = value.parse()?,
            Some(("spacing", value)) => row.spacing = value.parse()?,
            Some(("levels", value)) => row.levels = value.parse()?,
            Some(("rays", value)) => {
                let (rows, columns) = value.split_once('x').ok_or("rays=AxB")?;
                row.rays = [rows.parse()?, columns.parse()?];
            }
            _ => options.tubes.push(argument.parse()?),
        }
    }
    let scene = match name.strip_prefix("demo:") {
        Some(demo) => demo::build(demo).ok_or_else(|| format!("no demo {demo}"))?,
        None => load_scene(Path::new(&name), &options)?.scene,
    };
    let world = Arc::new(World::new(Arc::new(scene), &[]).0);
    let camera = camera(world.scene());
    let surfaces: Vec<SurfacePoint> = (0..points).filter_map(|n| visible(&world, &camera, n)).collect();
    let started = Instant::now();
    let references = references(&world, &surfaces, walks);
    let level = references.iter().map(|r| r.mean).sum::<f64>() / references.len() as f64;
    let noise = references.iter().map(|r| r.variance).sum::<f64>() / references.len() as f64;
    println!(
        "{name}: {} points, {walks} walks each, {:.0} s; their own error {:.2}%",
        references.len(),
        started.elapsed().as_secs_f64(),
        100.0 * noise.sqrt() / level
    );
    println!(
        "| rays | bounces | tolerance | spacing | levels | MiB | made | records | alone | us a point | later | error % | median % | bias % |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for settings in rows {
        measure(&world, &camera, &references, &settings, (level, noise), crowd);
    }
    Ok(())
}

fn camera(scene: &Scene) -> Camera {
    scene.cameras.first().cloned().unwrap_or_else(|| {
        let bounds = scene.bounds();
        Camera::outside(bounds.center(), 0.5 * bounds.diagonal(), SIZE)
    })
}

/// What a pixel of a lattice of rank one shows, shifted to the right by some pixels.
fn beside(world: &World, camera: &Camera, number: u32, shift: f64) -> Option<SurfacePoint> {
    let number = f64::from(number);
    let (x, y) = (
        (number * 0.754_877_666_246_693).fract(),
        (number * 0.569_840_290_998_053).fract(),
    );
    let (origin, direction) = camera.ray(SIZE, x * 512.0 + shift, y * 512.0);
    world.look(origin, direction.normalize())
}

fn visible(world: &World, camera: &Camera, number: u32) -> Option<SurfacePoint> {
    beside(world, camera, number, 0.0).filter(|surface| surface.albedo.max_element() > 0.0)
}

/// One row of the table.
fn measure(
    world: &Arc<World>,
    camera: &Camera,
    references: &[Reference],
    settings: &GiSettings,
    (level, noise): (f64, f64),
    crowd: u32,
) {
    let shader = GiShader::new(Arc::clone(world), settings);
    let mut scratch = ShaderScratch::default();
    // As in a picture: many points besides those that are compared, so that the cost is that of records and looking up.
    let crowd: Vec<SurfacePoint> = (0..crowd).filter_map(|n| visible(world, camera, n)).collect();
    let timed = |points: &[SurfacePoint], scratch: &mut ShaderScratch| {
        let started = Instant::now();
        for surface in points {
            shader.indirect_irradiance(surface, scratch);
        }
        started.elapsed().as_secs_f64() * 1e6 / points.len().max(1) as f64
    };
    let (first, last) = crowd.split_at(crowd.len() / 4 * 3);
    let (early, later) = (timed(first, &mut scratch), timed(last, &mut scratch));
    let got: Vec<f64> = references
        .iter()
        .map(|r| {
            let irradiance = shader.indirect_irradiance(&r.surface, &mut scratch);
            f64::from(luminance(irradiance.as_vec3()))
        })
        .collect();
    let pairs = || got.iter().zip(references);
    let count = got.len() as f64;
    let square = pairs().map(|(got, r)| (got - r.mean).powi(2)).sum::<f64>() / count - noise;
    let bias = pairs().map(|(got, r)| got - r.mean).sum::<f64>() / count;
    let mut shares: Vec<f64> = pairs().map(|(got, r)| (got / r.mean - 1.0).abs()).collect();
    shares.sort_by(f64::total_cmp);
    let counts = shader.counts();
    if std::env::var_os("WORST").is_some() {
        let mut by: Vec<_> = pairs().collect();
        by.sort_by(|a, b| (b.0 - b.1.mean).abs().total_cmp(&(a.0 - a.1.mean).abs()));
        for (got, r) in by.iter().take(25) {
            println!(
                "worst {got:.1} for {:.1} at {:.3} normal {:.2}",
                r.mean, r.surface.position, r.surface.shading_normal
            );
        }
    }
    println!(
        "| {}x{} | {} | {} | {} | {} | {:.4} | {} | {} | {} | {early:.1} | {later:.1} | {:.2} | {:.2} | {:+.2} |",
        settings.rays[0],
        settings.rays[1],
        settings.bounces,
        settings.tolerance,
        settings.spacing,
        settings.levels,
        settings.memory >> 20,
        counts.made,
        counts.records,
        counts.alone,
        100.0 * square.max(0.0).sqrt() / level,
        100.0 * shares[shares.len() / 2],
        100.0 * bias / level,
    );
}

fn references(world: &World, surfaces: &[SurfacePoint], walks: u32) -> Vec<Reference> {
    let lights: Vec<&LinearLight> = world
        .lights()
        .iter()
        .filter_map(|light| match light {
            Light::Linear(light) => Some(light),
            _ => None,
        })
        .collect();
    assert_eq!(lights.len(), world.lights().len(), "all lights are lines");
    let mut random = Pcg64Mcg::seed_from_u64(1);
    surfaces
        .iter()
        .map(|surface| {
            let (mut sum, mut square) = (0.0, 0.0);
            for _ in 0..walks {
                let one = PI * walk(world, &lights, surface, &mut random);
                sum += one;
                square += one * one;
            }
            let count = f64::from(walks);
            let mean = sum / count;
            Reference {
                surface: *surface,
                mean,
                variance: (square / count - mean * mean) / count,
            }
        })
        .collect()
}

fn unit(random: &mut Pcg64Mcg) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Luminance of the radiance that arrives by one random walk over up to eight surfaces, cosine-weighted.
fn walk(world: &World, lights: &[&LinearLight], start: &SurfacePoint, random: &mut Pcg64Mcg) -> f64 {
    let mut at = *start;
    let (mut sum, mut share) = (DVec3::ZERO, DVec3::ONE);
    for _ in 0..8 {
        // Uniform on the sphere by rejection, then Lambert by adding the normal.
        let on_sphere = loop {
            let v = DVec3::new(unit(random), unit(random), unit(random)) * 2.0 - 1.0;
            if v.length_squared() <= 1.0 && v.length_squared() > 1e-4 {
                break v.normalize();
            }
        };
        let direction = (at.shading_normal + on_sphere).normalize();
        if !direction.is_finite() || direction.dot(at.geometric_normal) <= 0.0 {
            break;
        }
        let Some(next) = world.look(at.origin, direction) else {
            break;
        };
        at = next;
        sum += share * at.emission.as_dvec3();
        share *= at.albedo.as_dvec3();
        sum += share / PI * by_one_light(world, lights, &at, random);
    }
    f64::from(luminance(sum.as_vec3()))
}

/// Irradiance estimated from one place of one light, picked by how much it may give.
fn by_one_light(world: &World, lights: &[&LinearLight], at: &SurfacePoint, random: &mut Pcg64Mcg) -> DVec3 {
    let may_give = |light: &LinearLight| {
        let middle = 0.5 * (light.a + light.b);
        light.flux / (0.25 * light.a.distance_squared(light.b) + at.position.distance_squared(middle))
    };
    let all: f64 = lights.iter().map(|light| may_give(light)).sum();
    let mut left = all * unit(random);
    let Some(light) = lights.iter().find(|light| {
        left -= may_give(light);
        left < 0.0
    }) else {
        return DVec3::ZERO;
    };
    // Places along the light evenly by the angle that they are seen under.
    let length = light.a.distance(light.b);
    let axis = (light.b - light.a) / length;
    let foot = (at.position - light.a).dot(axis);
    let beside = (at.position - light.a - axis * foot).length();
    let (low, high) = ((-foot / beside).atan(), ((length - foot) / beside).atan());
    let along = foot + beside * (low + (high - low) * unit(random)).tan();
    let target = light.a + axis * along;
    let to = target - at.position;
    let distance = to.length();
    let cosine = at.shading_normal.dot(to) / distance;
    if cosine <= 0.0 || at.geometric_normal.dot(to) <= 0.0 || world.tracer().occluded(at.origin, target) {
        return DVec3::ZERO;
    }
    let sine = axis.cross(to / distance).length();
    let chance = beside / ((high - low) * distance * distance);
    let irradiance = light.flux / (PI * PI * length) * sine * cosine / (distance * distance) / chance;
    light.color.as_dvec3() * (irradiance * all / may_give(light))
}
