//! Dropping the edges of lights that do not matter where they fall.

use glam::{DVec3, Vec3};
use llsr_scene::LightId;

use super::scene::ShadowScene;
use super::store::ShadowEdges;

/// What [`ShadowEdges::drop_unimportant`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImportanceReport {
    /// Edges that stay.
    pub kept: usize,
    /// Edges dropped.
    pub dropped: usize,
    /// Largest contrast of a dropped edge: its light's irradiance over that of all lights.
    pub largest_dropped: f64,
}

impl ShadowEdges {
    /// Drops the edges that cannot be seen because other lights outshine theirs (Ward 1994, *Adaptive shadow testing
    /// for ray tracing*, which Bala et al. 2003 name in section 8).
    ///
    /// In the middle of an edge, lights are sorted by their unoccluded `irradiance` (light, point, unit normal of the
    /// receiver's face turned towards the light; any unit, not negative). Those at the weak end that together give
    /// less than `threshold` of the whole are unimportant there: all their shadows together change the irradiance
    /// by less than that. An edge of one of them is dropped. With a threshold of 0 none is. Edges come back when
    /// they are computed again after a move.
    ///
    /// Cost: for each edge one call of `irradiance` for each light.
    pub fn drop_unimportant(
        &mut self,
        scene: &ShadowScene,
        threshold: f64,
        mut irradiance: impl FnMut(LightId, DVec3, DVec3) -> f64,
    ) -> ImportanceReport {
        let lights: Vec<LightId> = scene.lights().collect();
        let mut largest_dropped = 0.0f64;
        let dropped = self.retain_edges(|edge| {
            let [a, b] = edge.segment.map(Vec3::as_dvec3);
            let middle = 0.5 * (a + b);
            let Some(normal) = face_normal(scene, edge.triple.receiver, edge.face) else {
                return true;
            };
            // The side that the edge's own light reaches.
            let towards = scene
                .light(edge.triple.light)
                .map_or(DVec3::ZERO, |light| center(light.corners()) - middle);
            let normal = if normal.dot(towards) < 0.0 {
                -normal
            } else {
                normal
            };
            let mut ask = |light| {
                let e = irradiance(light, middle, normal);
                if e.is_finite() { e.max(0.0) } else { 0.0 }
            };
            let own = ask(edge.triple.light);
            let (mut all, mut weaker) = (own, own);
            for &light in lights.iter().filter(|&&light| light != edge.triple.light) {
                let other = ask(light);
                all += other;
                // Equal lights are taken in their order.
                if other < own || (other == own && light < edge.triple.light) {
                    weaker += other;
                }
            }
            let drop = weaker < threshold * all;
            if drop {
                largest_dropped = largest_dropped.max(own / all);
            }
            !drop
        });
        ImportanceReport {
            kept: self.len(),
            dropped,
            largest_dropped,
        }
    }
}

fn center(corners: &[DVec3]) -> DVec3 {
    corners.iter().sum::<DVec3>() / (corners.len().max(1) as f64)
}

fn face_normal(scene: &ShadowScene, object: llsr_scene::ObjectId, face: u32) -> Option<DVec3> {
    let object = scene.object(object)?;
    let [a, b, c] = object
        .mesh
        .edges()
        .corners(face)
        .map(|p| object.to_world.transform_point3(p));
    (b - a).cross(c - a).try_normalize()
}
