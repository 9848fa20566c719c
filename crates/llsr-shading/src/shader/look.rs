//! What all shaders of this crate have in common: the ray, the background and direct light.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec3, Vec3};
use llsr_scene::{LightId, ObjectId, Triple};

use crate::random::mix;
use crate::shader::{Encounters, ShadeRequest, ShadedPoint, ShaderError, ShaderScratch, Textured, World};
use crate::{DirectLight, LightAnswer, Pixel, SurfacePoint};

/// What a surface sends to its viewer.
pub(crate) struct Shaded {
    /// Radiance.
    colour: Vec3,
    textured: Option<Textured>,
    /// The lights that reach it.
    lights: u64,
    /// See [`ShadedPoint::provisional`].
    provisional: bool,
}

impl Shaded {
    /// Of whatever surface.
    pub(crate) fn new(colour: Vec3, lights: u64) -> Self {
        Self {
            colour,
            textured: None,
            lights,
            provisional: false,
        }
    }

    /// Of a diffuse surface: its own light, and what it reflects of an irradiance.
    pub(crate) fn diffuse(world: &World, surface: &SurfacePoint, irradiance: DVec3, lights: u64) -> Self {
        let reflected = |albedo: Vec3| (albedo.as_dvec3() * irradiance * FRAC_1_PI).as_vec3();
        let dark = surface.emission == Vec3::ZERO;
        let textured = surface.textured.filter(|_| dark).map(|triangle| Textured {
            triangle,
            plain: reflected(world.plain_albedo(surface.material)),
        });
        Self {
            colour: surface.emission + reflected(surface.albedo),
            textured,
            lights,
            provisional: false,
        }
    }

    /// The same, [provisional](ShadedPoint::provisional) or not.
    pub(crate) fn for_now(self, provisional: bool) -> Self {
        Self { provisional, ..self }
    }
}

/// The loop of all shaders: `shade` lights a surface that a ray meets; it is told the ray's number, to seed random choices with.
pub(crate) fn shade_each(
    world: &World,
    requests: &[ShadeRequest],
    seed: u64,
    points: &mut Vec<ShadedPoint>,
    met: &mut Encounters,
    mut shade: impl FnMut(&SurfacePoint, u64, &mut Encounters) -> Shaded,
) -> Result<(), ShaderError> {
    for request in requests {
        let direction = unit_direction(request)?;
        let Some(surface) = world.look(request.origin, direction) else {
            points.push(background(world, request, direction));
            continue;
        };
        let hash = ray_hash(seed, request.origin, direction);
        let shaded = shade(&surface, hash, met);
        points.push(ShadedPoint {
            id: request.id,
            position: surface.position.as_vec3(),
            normal: surface.shading_normal.as_vec3(),
            albedo: surface.albedo,
            colour: shaded.colour,
            object: Some(surface.object),
            textured: shaded.textured,
            lights: shaded.lights,
            provisional: shaded.provisional,
        });
    }
    met.settle();
    Ok(())
}

/// The direction of a request as a unit vector.
fn unit_direction(request: &ShadeRequest) -> Result<DVec3, ShaderError> {
    let direction = request.direction.try_normalize();
    direction
        .filter(|_| request.origin.is_finite())
        .ok_or(ShaderError::BadRay { id: request.id })
}

/// A number for a ray that seeds its random choices: the same wherever and whenever the ray is shaded.
fn ray_hash(seed: u64, origin: DVec3, direction: DVec3) -> u64 {
    let numbers = origin.to_array().into_iter().chain(direction.to_array());
    numbers.fold(mix(seed), |hash, number| mix(hash ^ number.to_bits()))
}

/// A pixel that stands for a ray or a point of that number.
pub(crate) fn pixel_of(hash: u64) -> Pixel {
    Pixel {
        x: hash as u32,
        y: (hash >> 32) as u32,
        index: hash,
        subsample: 0,
    }
}

/// The point for a ray that meets nothing.
fn background(world: &World, request: &ShadeRequest, direction: DVec3) -> ShadedPoint {
    ShadedPoint {
        id: request.id,
        position: world.background(request.origin, direction).as_vec3(),
        normal: (-direction).as_vec3(),
        albedo: Vec3::ZERO,
        colour: Vec3::ZERO,
        object: None,
        textured: None,
        lights: 0,
        provisional: false,
    }
}

/// Direct light on a surface that was asked for: `each` gets the colour of every light and its answer. Reports the surface
/// and the shadows on it, and returns the lights that reach it.
pub(crate) fn direct_and_met(
    world: &World,
    direct: &DirectLight<'_>,
    surface: &SurfacePoint,
    hash: u64,
    scratch: &mut ShaderScratch,
    met: &mut Encounters,
    mut each: impl FnMut(DVec3, &LightAnswer),
) -> u64 {
    let ShaderScratch {
        direct: memory,
        states,
        blockers,
        statistics,
        ..
    } = scratch;
    met.add_object(surface.object);
    let mut seen = 0;
    let visit = |light: LightId, answer: &LightAnswer, blockers: &[ObjectId]| {
        each(world.lights()[light.index()].color().as_dvec3(), answer);
        seen |= u64::from(answer.irradiance > 0.0) << (light.0 % 64);
        for &blocker in blockers {
            met.add_triple(Triple {
                light,
                blocker,
                receiver: surface.object,
            });
        }
    };
    direct.shade_point_and_blockers(
        surface,
        pixel_of(hash),
        states,
        memory,
        statistics,
        blockers,
        visit,
    );
    seen
}

/// Direct light on a surface that was met on the way.
pub(crate) fn direct_only(
    world: &World,
    direct: &DirectLight<'_>,
    surface: &SurfacePoint,
    hash: u64,
    scratch: &mut ShaderScratch,
    mut each: impl FnMut(DVec3, &LightAnswer),
) {
    let ShaderScratch {
        direct: memory,
        states,
        statistics,
        ..
    } = scratch;
    direct.shade_point(
        surface,
        pixel_of(hash),
        states,
        memory,
        statistics,
        |light, answer| {
            each(world.lights()[light.index()].color().as_dvec3(), answer);
        },
    );
}
