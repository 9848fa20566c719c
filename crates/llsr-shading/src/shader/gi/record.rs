//! Records of irradiance: what one says nearby, and whether it survives a change of the scene.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec3, Vec3};
use llsr_scene::{Bounds, Light, ObjectId};

use crate::shader::gi::changes::Changes;
use crate::shader::gi::gather::Gathered;
use crate::shader::{MovedThing, SceneMove};

/// Irradiance at a place on a surface, with what is needed to use it beside that place.
#[derive(Debug)]
pub(crate) struct Record {
    pub(crate) position: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) gathered: Gathered,
    /// How far it reaches: the R of Ward & Heckbert (m).
    pub(crate) reach: f64,
    /// The object that it lies on.
    pub(crate) object: ObjectId,
    /// Where its rays ended (m).
    pub(crate) ends: Box<[Vec3]>,
    /// The number of changes of the scene up to which it is known to hold.
    pub(crate) holds_until: AtomicU64,
}

/// Share of its pairs of ray and light that a moved object may come between without a record being made anew.
const SHADOWED: usize = 16;

impl Record {
    /// How wrong the record may be at a point, as a share (Ward & Heckbert 1992, equation 4, the split-sphere model);
    /// infinite where it has no say.
    pub(crate) fn error(&self, point: DVec3, normal: DVec3) -> f64 {
        let offset = point - self.position;
        let distance = offset.length();
        // A record in front of the point may lie behind what shadows the point.
        if offset.dot(normal + self.normal) < -0.1 * distance {
            return f64::INFINITY;
        }
        distance / self.reach + (1.0 - normal.dot(self.normal)).max(0.0).sqrt()
    }

    /// Irradiance at a point by the gradients (equation 5), never negative.
    pub(crate) fn irradiance(&self, point: DVec3, normal: DVec3) -> DVec3 {
        let Gathered {
            irradiance,
            rotation,
            translation,
            ..
        } = &self.gathered;
        let offset = (point - self.position).as_vec3();
        let turn = self.normal.cross(normal).as_vec3();
        let mut sum = *irradiance;
        for axis in 0..3 {
            sum += rotation[axis] * turn[axis] + translation[axis] * offset[axis];
        }
        sum.max(Vec3::ZERO).as_dvec3()
    }

    /// Does the record hold in a scene after all of `changes`?
    ///
    /// It does not if a moved thing may have come in the way of its rays, or may have left it; nor if it lies on an object
    /// that moved; nor if a light moved; nor if the shadow of a moved object may have changed what more than one in sixteen
    /// of its rays bring.
    pub(crate) fn holds(&self, changes: &Changes, lights: &[Light]) -> bool {
        let until = self.holds_until.load(Ordering::Relaxed);
        let Some(mut news) = changes.since(until) else {
            return false;
        };
        if news.any(|change| self.may_feel(change, lights)) {
            return false;
        }
        self.holds_until.fetch_max(changes.count(), Ordering::Relaxed);
        true
    }

    fn may_feel(&self, change: &SceneMove, lights: &[Light]) -> bool {
        match change.what {
            MovedThing::Light(_) => return true,
            MovedThing::Object(object) if object == self.object => return true,
            MovedThing::Object(_) => {}
        }
        let boxes = [change.before, change.after];
        let here = self.position.as_vec3();
        let crossed = |end: &Vec3| {
            boxes
                .iter()
                .any(|bounds| segment_meets_box(here, *end, bounds, 0.0))
        };
        if self.ends.iter().any(crossed) {
            return true;
        }
        let mut shadowed = 0;
        for light in lights {
            let (a, b) = light.ends();
            let (middle, half) = ((0.5 * (a + b)).as_vec3(), 0.5 * a.distance(b) as f32);
            for end in &self.ends {
                let may = |bounds: &Bounds| segment_meets_box(*end, middle, bounds, half);
                shadowed += usize::from(boxes.iter().any(may));
            }
        }
        shadowed * SHADOWED > self.ends.len() * lights.len()
    }
}

/// Does a segment meet a box grown by `margin` to all sides? True if in doubt.
fn segment_meets_box(from: Vec3, to: Vec3, bounds: &Bounds, margin: f32) -> bool {
    let slack = margin + 1e-4 * bounds.diagonal();
    let inverse = 1.0 / (to - from);
    let (low, high) = (
        (bounds.min - slack - from) * inverse,
        (bounds.max + slack - from) * inverse,
    );
    // Along an axis that the segment does not follow both are infinite, or NaN on the box's face; `max` and `min` pass over NaN.
    let enter = low.min(high).to_array().into_iter().fold(0.0f32, f32::max);
    let leave = low.max(high).to_array().into_iter().fold(1.0f32, f32::min);
    enter <= leave
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_meet_boxes_that_they_pass_through() {
        let bounds = Bounds {
            min: Vec3::ZERO,
            max: Vec3::ONE,
        };
        let inside = Vec3::splat(0.5);
        let meets = |from: Vec3, to: Vec3| segment_meets_box(from, to, &bounds, 0.0);
        assert!(meets(inside, inside), "a point in it");
        assert!(meets(inside, Vec3::splat(9.0)), "out of it");
        assert!(
            meets(Vec3::new(-1.0, 0.5, 0.5), Vec3::new(2.0, 0.5, 0.5)),
            "along an axis"
        );
        assert!(
            !meets(Vec3::new(-1.0, 1.5, 0.5), Vec3::new(2.0, 1.5, 0.5)),
            "beside it"
        );
        assert!(
            !meets(Vec3::new(-2.0, 0.5, 0.5), Vec3::new(-0.5, 0.5, 0.5)),
            "short of it"
        );
        assert!(
            !meets(Vec3::new(-1.0, 0.5, 0.5), Vec3::new(0.5, 2.5, 0.5)),
            "past a corner"
        );
        assert!(
            meets(Vec3::new(-1.0, 0.5, 0.5), Vec3::new(0.5, 1.1, 0.5)),
            "through a corner"
        );
        let near = Vec3::new(-0.3, -3.0, 0.5);
        assert!(!meets(near, Vec3::new(-0.3, 3.0, 0.5)), "beside it");
        assert!(
            segment_meets_box(near, Vec3::new(-0.3, 3.0, 0.5), &bounds, 0.4),
            "within the margin"
        );
    }
}
