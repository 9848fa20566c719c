//! What the camera sees at the centre of each pixel.

use glam::{DVec3, Vec3};
use llsr_scene::{Camera, Projection, Scene, Viewport};
use llsr_shading::SurfacePoint;
use llsr_tracer::Tracer;
use rayon::prelude::*;

/// Rays that are looked up together.
pub(crate) const TOGETHER: usize = 16;
/// Marks a pixel in which the camera sees nothing.
const NOTHING: u32 = u32::MAX;

/// The surface at a pixel's centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// The point (m, recentred frame).
    pub(crate) position: Vec3,
    /// Unit shading normal, turned to the viewer.
    pub(crate) normal: Vec3,
    /// Linear RGB, texture included.
    pub(crate) albedo: Vec3,
    /// Emitted radiance.
    pub(crate) emission: Vec3,
    /// Distance along the ray (m); infinite where nothing is seen.
    pub(crate) distance: f32,
    /// Position of the material in the scene, or [`NOTHING`].
    material: u32,
}

impl Seen {
    const EMPTY: Self = Self {
        position: Vec3::ZERO,
        normal: Vec3::ZERO,
        albedo: Vec3::ZERO,
        emission: Vec3::ZERO,
        distance: f32::INFINITY,
        material: NOTHING,
    };

    pub(crate) fn new(point: &SurfacePoint) -> Self {
        Self {
            position: point.position.as_vec3(),
            normal: point.shading_normal.as_vec3(),
            albedo: point.albedo,
            emission: point.emission,
            distance: point.distance as f32,
            material: point.material.0,
        }
    }

    pub(crate) fn is_hit(&self) -> bool {
        self.material != NOTHING
    }

    /// True if both have the same material, or both nothing.
    pub(crate) fn same_material(&self, other: &Self) -> bool {
        self.material == other.material
    }

    /// Could both lie on one smooth surface, so that light on one says something about light on the other?
    ///
    /// The normals differ by at most 25 degrees and each point lies within 25 degrees of the other's plane.
    pub(crate) fn is_near(&self, other: &Self) -> bool {
        const COSINE: f32 = 0.906;
        const SINE: f32 = 0.423;
        if !self.is_hit() || !other.is_hit() {
            return self.is_hit() == other.is_hit();
        }
        let apart = other.position - self.position;
        let off = apart.dot(self.normal).abs().max(apart.dot(other.normal).abs());
        self.normal.dot(other.normal) >= COSINE && off <= SINE * apart.length()
    }
}

/// The surface that a ray through a place of the picture (pixels) meets.
pub(crate) fn look(
    scene: &Scene,
    tracer: &Tracer,
    camera: &Camera,
    viewport: Viewport,
    x: f64,
    y: f64,
) -> Option<SurfacePoint> {
    let (origin, direction): (DVec3, DVec3) = camera.ray(viewport, x, y);
    let hit = tracer.closest(origin, direction, f64::INFINITY)?;
    Some(SurfacePoint::new(scene, &hit, direction))
}

/// The surfaces that rays through some places of the picture (pixels) meet, in `points`; places near to each other are looked up
/// together, with the same answers as from [`look`].
///
/// # Panics
/// If the slices differ in length.
pub(crate) fn look_each(
    scene: &Scene,
    tracer: &Tracer,
    camera: &Camera,
    viewport: Viewport,
    places: &[(f64, f64)],
    points: &mut [Option<SurfacePoint>],
) {
    assert_eq!(places.len(), points.len(), "one answer per place");
    for (places, points) in places.chunks(TOGETHER).zip(points.chunks_mut(TOGETHER)) {
        if !matches!(camera.projection, Projection::Perspective(_)) {
            // Parallel rays have no common origin.
            for (point, &(x, y)) in points.iter_mut().zip(places) {
                *point = look(scene, tracer, camera, viewport, x, y);
            }
            continue;
        }
        let mut directions = [DVec3::ZERO; TOGETHER];
        let mut hits = [None; TOGETHER];
        let (directions, hits) = (&mut directions[..places.len()], &mut hits[..places.len()]);
        for (direction, &(x, y)) in directions.iter_mut().zip(places) {
            *direction = camera.ray(viewport, x, y).1;
        }
        tracer.closest_each(camera.position, directions, f64::INFINITY, hits);
        for ((point, hit), &direction) in points.iter_mut().zip(&*hits).zip(&*directions) {
            *point = hit.as_ref().map(|hit| SurfacePoint::new(scene, hit, direction));
        }
    }
}

/// Looks through the centres of all pixels; `None` if `progress`, called after each row, asked to stop.
pub(crate) fn look_everywhere(
    scene: &Scene,
    tracer: &Tracer,
    camera: &Camera,
    viewport: Viewport,
    progress: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Seen>> {
    let mut seen = vec![Seen::EMPTY; viewport.pixels()];
    let whole = seen
        .par_chunks_mut(viewport.width as usize)
        .enumerate()
        .all(|(y, row)| {
            for (i, part) in row.chunks_mut(TOGETHER).enumerate() {
                let place = |k: usize| ((i * TOGETHER + k) as f64 + 0.5, y as f64 + 0.5);
                let places: [(f64, f64); TOGETHER] = std::array::from_fn(place);
                let mut points = [None; TOGETHER];
                let (places, points) = (&places[..part.len()], &mut points[..part.len()]);
                look_each(scene, tracer, camera, viewport, places, points);
                for (seen, point) in part.iter_mut().zip(&*points) {
                    *seen = point.as_ref().map_or(Seen::EMPTY, Seen::new);
                }
            }
            progress()
        });
    whole.then_some(seen)
}
