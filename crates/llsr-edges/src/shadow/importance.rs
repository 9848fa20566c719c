//! Dropping the edges of lights that do not matter where they fall.

use glam::{DVec3, Vec3};
use llsr_scene::LightId;

use super::scene::ShadowScene;
use super::store::ShadowEdges;

/// The middle of a dropped edge, to measure there what its shadow does to a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DroppedEdge {
    /// The light that casts the shadow.
    pub light: LightId,
    /// The place (m, scene's frame).
    pub point: DVec3,
    /// Unit normal of the receiver's face, turned towards the light.
    pub normal: DVec3,
}

/// What [`ShadowEdges::drop_unimportant`] did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportanceReport {
    /// Edges that stay.
    pub kept: usize,
    /// Edges dropped.
    pub dropped: usize,
    /// Largest contrast of a dropped edge, as it was judged: its light's irradiance over that of all lights looked at.
    pub largest_dropped: f64,
    /// Up to [`SAMPLE`](Self::SAMPLE) of the dropped edges, at even distances in the order of all.
    pub sample: Vec<DroppedEdge>,
}

impl ImportanceReport {
    /// Dropped edges that are reported one by one, at most.
    pub const SAMPLE: usize = 512;
}

/// Every n-th of a number of items that is not known before.
#[derive(Debug)]
struct Thinned<T> {
    items: Vec<T>,
    most: usize,
    every: usize,
    seen: usize,
}

impl<T> Thinned<T> {
    fn new(most: usize) -> Self {
        Self {
            items: Vec::new(),
            most,
            every: 1,
            seen: 0,
        }
    }

    fn push(&mut self, item: T) {
        if self.seen.is_multiple_of(self.every) {
            if self.items.len() == self.most {
                let mut number = 0;
                self.items.retain(|_| {
                    number += 1;
                    number % 2 == 1
                });
                self.every *= 2;
            }
            if self.seen.is_multiple_of(self.every) {
                self.items.push(item);
            }
        }
        self.seen += 1;
    }
}

impl ShadowEdges {
    /// Drops the edges that cannot be seen because other lights outshine theirs (Ward 1994, *Adaptive shadow testing
    /// for ray tracing*, which Bala et al. 2003 name in section 8).
    ///
    /// In the middle of an edge, lights are sorted by their unoccluded `irradiance` (light, point, unit normal of the
    /// receiver's face turned towards the light; any unit, not negative). Those at the weak end that together give
    /// less than `threshold` of what they and the stronger ones give are unimportant there: all their shadows together
    /// change the irradiance by less than that. An edge of one of them is dropped. With a threshold of 0 none is. Edges
    /// come back when they are computed again after a move.
    ///
    /// Of the stronger lights counts what is `received` past all that hides them (same arguments and unit, never more than
    /// `irradiance`): beside a weak light's shadow a strong one may be hidden too. To give `irradiance` for both is to
    /// trust that it is not, for callers that cannot ask. [`ImportanceReport::sample`] names places at which to measure
    /// what came of it.
    ///
    /// Cost: for each edge one call of `irradiance` for each light, and for those that seem unimportant one or a few of
    /// `received`.
    pub fn drop_unimportant(
        &mut self,
        scene: &ShadowScene,
        threshold: f64,
        mut irradiance: impl FnMut(LightId, DVec3, DVec3) -> f64,
        mut received: impl FnMut(LightId, DVec3, DVec3) -> f64,
    ) -> ImportanceReport {
        let lights: Vec<LightId> = scene.lights().collect();
        let mut stronger: Vec<(f64, LightId)> = Vec::with_capacity(lights.len());
        let mut largest_dropped = 0.0f64;
        let mut sample = Thinned::new(ImportanceReport::SAMPLE);
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
            let usable = |e: f64| if e.is_finite() { e.max(0.0) } else { 0.0 };
            let mut ask = |light| usable(irradiance(light, middle, normal));
            let own = ask(edge.triple.light);
            let (mut all, mut weaker) = (own, own);
            stronger.clear();
            for &light in lights.iter().filter(|&&light| light != edge.triple.light) {
                let other = ask(light);
                all += other;
                // Equal lights are taken in their order.
                if other < own || (other == own && light < edge.triple.light) {
                    weaker += other;
                } else {
                    stronger.push((other, light));
                }
            }
            if weaker >= threshold * all {
                return true;
            }
            // It would not matter if nothing hid the stronger ones. The strongest first, until enough has come through.
            stronger.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let mut seen = weaker;
            let mut next = stronger.iter();
            let drop = loop {
                if weaker < threshold * seen {
                    break true;
                }
                let Some(&(most, light)) = next.next() else {
                    break false;
                };
                seen += usable(received(light, middle, normal)).min(most);
            };
            if drop {
                largest_dropped = largest_dropped.max(own / seen);
                sample.push(DroppedEdge {
                    light: edge.triple.light,
                    point: middle,
                    normal,
                });
            }
            !drop
        });
        ImportanceReport {
            kept: self.len(),
            dropped,
            largest_dropped,
            sample: sample.items,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinned_items_are_evenly_spaced_and_never_too_many() {
        for count in [0, 1, 7, 8, 9, 100, 1000] {
            let mut thinned = Thinned::new(8);
            (0..count).for_each(|i| thinned.push(i));
            let Thinned { items, every, .. } = thinned;
            assert!(
                items.len() <= 8 && items.len() >= count.min(4),
                "{count}: {items:?}"
            );
            assert!(
                items.iter().zip(0..).all(|(&item, i)| item == i * every),
                "{count}: {items:?}"
            );
            assert!(items.len() * every >= count, "{count}: to the end");
        }
    }
}
