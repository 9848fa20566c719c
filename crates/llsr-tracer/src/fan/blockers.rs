//! What hid a light from the point that looked at it before.
//!
//! Neighbouring points see a light past the same occluders. Those that hid most of it are asked first, so that what is
//! left to traverse is little more than the edges of the shadow. Only the order of the tests depends on what is
//! remembered, never the answer.

use glam::DVec3;

use super::gaps::Keep;
use crate::build::ChildRef;

/// The most leaves that are remembered of a light.
const MOST: usize = 8;
/// A leaf that hides less than this share of what is asked for is not worth asking first: fine meshes hide a light by many
/// such leaves, and taking them out of order cuts the rest into pieces.
const LEAST: f64 = 1.0 / 32.0;
/// How many lights are remembered; a power of two.
const LIGHTS: usize = 256;

/// A leaf, and how much of the light it hid that nothing before it did (light parameters).
#[derive(Clone, Copy, Debug, Default)]
struct Blocker {
    at: ChildRef,
    gain: f32,
}

/// A few leaves, the one that hid most first.
#[derive(Clone, Copy, Debug, Default)]
struct List {
    blockers: [Blocker; MOST],
    len: usize,
}

impl List {
    #[inline(always)]
    fn insert(&mut self, new: Blocker) {
        let mut place = self.len.min(MOST - 1);
        if self.len == MOST && new.gain <= self.blockers[place].gain {
            return;
        }
        self.len = place + 1;
        while place > 0 && self.blockers[place - 1].gain < new.gain {
            self.blockers[place] = self.blockers[place - 1];
            place -= 1;
        }
        self.blockers[place] = new;
    }
}

/// The leaves that hid each of many lights, and those that the running query has found.
#[derive(Clone, Debug, Default)]
pub(super) struct Blockers {
    /// By the light's key; empty before the first query.
    lights: Vec<(u64, List)>,
    key: u64,
    /// The least gain that is remembered.
    least: f64,
    found: List,
}

impl Blockers {
    /// Forgets everything and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.lights.fill((0, List::default()));
    }

    /// A query for some `length` of a light begins.
    #[inline(always)]
    pub(super) fn begin(&mut self, a: DVec3, b: DVec3, keep: Keep, length: f64) {
        if self.lights.is_empty() {
            self.lights.resize(LIGHTS, (0, List::default()));
        }
        let mut key = keep as u64;
        for x in [a.x, a.y, a.z, b.x, b.y, b.z] {
            key = (key.rotate_left(23) ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
        self.key = key;
        self.least = LEAST * length;
        self.found.len = 0;
    }

    fn slot(&self) -> usize {
        (self.key >> 32) as usize & (LIGHTS - 1)
    }

    /// The leaf to ask as number `index`, if one is remembered.
    #[inline(always)]
    pub(super) fn remembered(&self, index: usize) -> Option<ChildRef> {
        let (key, list) = self.lights.get(self.slot())?;
        (*key == self.key && index < list.len).then(|| list.blockers[index & (MOST - 1)].at)
    }

    /// Notes that the running query has found a leaf that hides something new.
    #[inline(always)]
    pub(super) fn found(&mut self, at: ChildRef, gain: f64) {
        if self.least <= gain {
            let gain = gain as f32;
            self.found.insert(Blocker { at, gain });
        }
    }

    /// The query is over.
    #[inline(always)]
    pub(super) fn end(&mut self) {
        let slot = self.slot();
        if let Some(light) = self.lights.get_mut(slot) {
            *light = (self.key, self.found);
        }
    }
}
