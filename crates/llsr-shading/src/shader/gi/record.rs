//! Records of irradiance: what one says nearby, and whether it survives a change of the scene.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::{DVec3, Vec3};
use llsr_scene::{Bounds, Light, ObjectId};
use rand_pcg::Pcg64Mcg;

use crate::SurfacePoint;
use crate::shader::gi::cache::Footprint;
use crate::shader::gi::changes::Changes;
use crate::shader::gi::gather::{Gathered, directions, frame, unit};
use crate::shader::{MovedThing, SceneMove};

/// Irradiance at a place on a surface, with what is needed to use it beside that place.
#[derive(Debug)]
pub(crate) struct Record {
    pub(crate) position: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) gathered: Gathered,
    /// How far what it says holds, by the distances around and the gradient (m).
    pub(crate) natural: f64,
    /// How far it is used: the R of Ward & Heckbert (m); more than that on the finest level.
    pub(crate) reach: f64,
    /// The object that it lies on.
    pub(crate) object: ObjectId,
    /// What the directions of its rays are drawn from.
    pub(crate) hash: u64,
    /// How far its rays went; see [`Fan`].
    pub(crate) lengths: Box<[u8]>,
    /// The number of changes of the scene up to which it is known to hold.
    pub(crate) holds_until: AtomicU64,
    /// It is known not to hold any more.
    pub(crate) outdated: AtomicBool,
    /// Was nothing that it was made of outdated or missing?
    pub(crate) complete: bool,
}

/// The rays that records send. A record keeps a byte for each: the directions come from its random number once more.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fan {
    /// Rays from the zenith down and around it.
    pub(crate) rays: [u32; 2],
    /// Rays that meet nothing end here (m).
    pub(crate) longest: f64,
    /// Do its rays ask the records for rays from afar?
    pub(crate) asks_far: bool,
}

/// Lengths that a byte tells apart while they double.
const STEPS: f64 = 16.0;

impl Fan {
    /// Random numbers for the directions of a record.
    pub(crate) fn random(hash: u64) -> Pcg64Mcg {
        Pcg64Mcg::new(u128::from(hash) << 64 | u128::from(!hash) | 1)
    }

    /// A byte for the length of a ray (m, above 0), 0 for a ray that was not sent. Lengths are rounded up, by less than a twentieth;
    /// those below 1/65,000 of the farthest count as that.
    pub(crate) fn encode(&self, length: Option<f64>) -> u8 {
        let Some(length) = length else { return 0 };
        let steps = STEPS * (length / self.longest).log2();
        // A cast takes what is out of range to its end.
        ((255.0 + steps.ceil()) as u8).max(1)
    }

    /// Where the rays of a record end.
    fn ends<'a>(&self, record: &'a Record) -> impl Iterator<Item = Vec3> + use<'a> {
        let axes = frame(record.normal);
        let (rays, longest) = (self.rays, self.longest);
        let mut random = Self::random(record.hash);
        let mut directions = directions(axes, rays, move || unit(&mut random));
        record.lengths.iter().filter_map(move |&code| {
            let direction = directions.next()?;
            let length = longest * ((f64::from(code) - 255.0) / STEPS).exp2();
            (code > 0).then(|| (record.position + direction * length).as_vec3())
        })
    }
}

impl Footprint for Record {
    fn heap_bytes(&self) -> usize {
        self.lengths.len()
    }
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

    /// How much the record counts at a point, 0 to 1, if it may be wrong by `tolerance` at most. It comes to nothing where the
    /// error comes to that, and so does that of a record in a crevice, whose light is that of nothing outside.
    pub(crate) fn goodness(&self, point: DVec3, normal: DVec3, tolerance: f64) -> f64 {
        let error = self.error(point, normal) / tolerance;
        let beyond = (point - self.position).length() / self.natural;
        (2.0 - 2.0 * error).clamp(0.0, 1.0)
            * if beyond > 1.0 {
                1.0 / (beyond * beyond)
            } else {
                1.0
            }
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
    ///
    /// `ends` is working memory.
    pub(crate) fn holds(&self, fan: &Fan, changes: &Changes, lights: &[Light], ends: &mut Vec<Vec3>) -> bool {
        let until = self.holds_until.load(Ordering::Relaxed);
        if self.outdated.load(Ordering::Relaxed) {
            return false;
        }
        if until == changes.count() {
            return true;
        }
        let holds = self.holds_after(until, fan, changes, lights, ends);
        if holds {
            self.holds_until.fetch_max(changes.count(), Ordering::Relaxed);
        } else {
            self.outdated.store(true, Ordering::Relaxed);
        }
        holds
    }

    /// Does a record that holds after the first `until` changes still hold after all?
    fn holds_after(
        &self,
        until: u64,
        fan: &Fan,
        changes: &Changes,
        lights: &[Light],
        ends: &mut Vec<Vec3>,
    ) -> bool {
        let Some(news) = changes.since(until) else {
            return false;
        };
        ends.clear();
        for change in news {
            match change.what {
                MovedThing::Light(_) => return false,
                MovedThing::Object(object) if object == self.object => return false,
                MovedThing::Object(_) => {}
            }
            if ends.is_empty() {
                ends.extend(fan.ends(self));
            }
            if self.may_feel(change, lights, ends) {
                return false;
            }
        }
        true
    }

    /// Does it lie at that place of a surface, still?
    pub(crate) fn lies_on(&self, surface: &SurfacePoint, fan: &Fan) -> bool {
        let near = 1e-6 * fan.longest;
        self.position.distance(surface.position) <= near && self.normal.dot(surface.shading_normal) > 0.999
    }

    /// May another object that moved have changed what its rays bring?
    fn may_feel(&self, change: &SceneMove, lights: &[Light], ends: &[Vec3]) -> bool {
        let boxes = [change.before, change.after];
        let here = self.position.as_vec3();
        let crossed = |end: &Vec3| {
            boxes
                .iter()
                .any(|bounds| segment_meets_box(here, *end, bounds, 0.0))
        };
        if ends.iter().any(crossed) {
            return true;
        }
        let mut shadowed = 0;
        for light in lights {
            let (a, b) = light.ends();
            let (middle, half) = ((0.5 * (a + b)).as_vec3(), 0.5 * a.distance(b) as f32);
            for end in ends {
                let may = |bounds: &Bounds| segment_meets_box(*end, middle, bounds, half);
                shadowed += usize::from(boxes.iter().any(may));
            }
        }
        shadowed * SHADOWED > ends.len() * lights.len()
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
    use llsr_scene::ObjectId;

    #[test]
    fn rays_end_where_they_were_seen_to_end_or_a_little_beyond() {
        let fan = Fan {
            rays: [7, 20],
            longest: 30.0,
            asks_far: false,
        };
        let position = DVec3::new(1.0, -2.0, 0.5);
        let normal = DVec3::new(0.6, 0.0, -0.8);
        let mut numbers = Pcg64Mcg::new(9);
        let mut random = Fan::random(77);
        // Lengths of all sizes from 3 mm on; every ninth ray is not sent.
        let sent: Vec<(DVec3, Option<f64>)> = directions(frame(normal), fan.rays, || unit(&mut random))
            .enumerate()
            .map(|(index, direction)| {
                let length = 30.0 * (1e-4f64).powf(unit(&mut numbers));
                (direction, (index % 9 != 4).then_some(length))
            })
            .collect();
        let record = Record {
            position,
            normal,
            gathered: Gathered::default(),
            natural: 1.0,
            reach: 1.0,
            object: ObjectId(0),
            hash: 77,
            lengths: sent.iter().map(|&(_, length)| fan.encode(length)).collect(),
            holds_until: AtomicU64::new(0),
            outdated: AtomicBool::new(false),
            complete: true,
        };
        let ends: Vec<Vec3> = fan.ends(&record).collect();
        let expected: Vec<_> = sent
            .iter()
            .filter_map(|&(d, length)| Some((d, length?)))
            .collect();
        assert_eq!((ends.len(), expected.len()), (124, 124));
        for (end, (direction, length)) in ends.iter().zip(expected) {
            let along = (end.as_dvec3() - position).dot(direction);
            assert!(
                along > 0.999_99 * length && along < 1.045 * length,
                "{along} for {length}"
            );
            let off = (end.as_dvec3() - position).cross(direction).length();
            assert!(off < 1e-5 * (1.0 + length), "{off} m beside a ray of {length} m");
        }
        let lengths = [30.0, f64::INFINITY, 1e-9].map(|length| fan.encode(Some(length)));
        assert_eq!((lengths, fan.encode(None)), ([255, 255, 1], 0));
    }

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
