//! Subsamples of a pixel that lie on one surface and share one answer about the lights.
//!
//! Inside a pixel the irradiance of a smooth stretch of surface is linear to second order, so its mean over the
//! subsamples is its value at their middle, and one search for discontinuities there serves them all (Ouellette & Fiume
//! 1999, section 6, where it is future work). Textures are not shared: albedo is averaged over the subsamples.

use glam::{DVec3, Vec3};

use crate::SurfacePoint;

/// Cosine between normals up to which a surface counts as smooth within a pixel (about 8 degrees).
const SMOOTH: f64 = 0.99;
/// How far a point may lie off the tangent plane of another, relative to their distance.
const FLAT: f64 = 0.15;

/// Could the two points share one answer?
fn alike(a: &SurfacePoint, b: &SurfacePoint) -> bool {
    let offset = b.position - a.position;
    a.object == b.object
        && a.material == b.material
        && a.geometric_normal.dot(b.geometric_normal) > SMOOTH
        && a.shading_normal.dot(b.shading_normal) > SMOOTH
        && offset.dot(a.geometric_normal).abs() <= FLAT * offset.length()
}

/// Moves the points that can share an answer with the first to the front; returns them and the others.
///
/// # Panics
/// If there is no point.
pub(crate) fn split_surface(points: &mut [SurfacePoint]) -> (&mut [SurfacePoint], &mut [SurfacePoint]) {
    let first = points[0];
    let mut same = 1;
    for index in 1..points.len() {
        if alike(&first, &points[index]) {
            points.swap(same, index);
            same += 1;
        }
    }
    points.split_at_mut(same)
}

/// One point that stands for several of one surface: their middle if they lie in one plane, else the one nearest to it.
///
/// # Panics
/// If there is no point.
pub(crate) fn representative(points: &[SurfacePoint]) -> SurfacePoint {
    let [first, rest @ ..] = points else {
        panic!("a group has at least one point")
    };
    if rest.is_empty() {
        return *first;
    }
    let n = points.len() as f64;
    let mean = |f: &dyn Fn(&SurfacePoint) -> DVec3| points.iter().map(f).sum::<DVec3>() / n;
    let middle = mean(&|p| p.position);
    let planar = rest.iter().all(|p| p.geometric_normal == first.geometric_normal);
    let mut point = if planar {
        // Origins lie off the plane by their own offsets, on one side; so does their mean.
        SurfacePoint {
            position: middle,
            origin: mean(&|p| p.origin),
            shading_normal: mean(&|p| p.shading_normal).normalize_or(first.shading_normal),
            to_viewer: mean(&|p| p.to_viewer).normalize_or(first.to_viewer),
            ..*first
        }
    } else {
        let distance = |p: &SurfacePoint| p.position.distance_squared(middle);
        *points
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or(first)
    };
    let share = 1.0 / points.len() as f32;
    point.albedo = points.iter().map(|p| p.albedo).sum::<Vec3>() * share;
    point.emission = points.iter().map(|p| p.emission).sum::<Vec3>() * share;
    point
}
