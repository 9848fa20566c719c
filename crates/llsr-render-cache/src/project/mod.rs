//! Projection of many points into compact lists of those that fall into the picture.
//!
//! A list entry is (offset of the pixel, depth bits, tag) with tag = region << 28 | eighth << 26 | settled << 25 | slot, where points of
//! some age are settled and younger ones fresh. Depths are positive, so their bits are ordered as they are, and
//! `depth << 32 | tag` orders entries by depth, then by place, fresh before settled, and slot: the minimum at a pixel is the
//! same whatever the order in which points come.

#[cfg(target_arch = "x86_64")]
mod x86;

use std::ops::Range;

use glam::Vec3;

use crate::store::{LANES, PointStore};
use crate::view::View;

/// Lowest bit of the region in a tag.
pub(crate) const REGION_SHIFT: u32 = 28;
/// Lowest bit of the place within the region.
pub(crate) const EIGHTH_SHIFT: u32 = 26;
/// Set in the tags of points that are not fresh.
pub(crate) const SETTLED: u32 = 1 << 25;
/// Bits of a tag that hold the slot.
pub(crate) const SLOT_MASK: u32 = SETTLED - 1;

/// A list of projected points; the first `len` entries count.
#[derive(Clone, Debug, Default)]
pub(crate) struct List {
    pub(crate) pixel: Vec<u32>,
    pub(crate) depth: Vec<u32>,
    pub(crate) tag: Vec<u32>,
}

/// Room for projected points: kernels write whole vectors, so there must be `LANES` entries more than points.
#[derive(Debug)]
pub(crate) struct ListMut<'a> {
    pub(crate) pixel: &'a mut [u32],
    pub(crate) depth: &'a mut [u32],
    pub(crate) tag: &'a mut [u32],
}

/// Entries of a list: pixels, depth bits, tags.
pub(crate) type Entries<'a> = [&'a [u32]; 3];

impl ListMut<'_> {
    /// The first `count` entries.
    pub(crate) fn entries(&self, count: usize) -> Entries<'_> {
        [&self.pixel[..count], &self.depth[..count], &self.tag[..count]]
    }
}

impl List {
    /// Some of the entries.
    pub(crate) fn entries(&self, range: Range<usize>) -> Entries<'_> {
        [
            &self.pixel[range.clone()],
            &self.depth[range.clone()],
            &self.tag[range],
        ]
    }

    /// Makes room for `entries`; never shrinks.
    pub(crate) fn reserve(&mut self, entries: usize) {
        if self.pixel.len() < entries {
            for list in [&mut self.pixel, &mut self.depth, &mut self.tag] {
                list.resize(entries, 0);
            }
        }
    }

    /// Splits into lists of `entries` each.
    pub(crate) fn chunks_mut(&mut self, entries: usize) -> impl Iterator<Item = ListMut<'_>> {
        let (pixel, depth) = (
            self.pixel.chunks_exact_mut(entries),
            self.depth.chunks_exact_mut(entries),
        );
        let lists = pixel.zip(depth).zip(self.tag.chunks_exact_mut(entries));
        lists.map(|((pixel, depth), tag)| ListMut { pixel, depth, tag })
    }
}

/// Which kernels this machine can run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Level {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// The best one. The standard library remembers what it detected.
    pub(crate) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Scalar
    }

    /// All that this machine can run.
    #[cfg(test)]
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let all = [
            Self::Scalar,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512,
        ];
        all.into_iter().filter(|level| *level <= Self::detect())
    }
}

/// What is to be projected where.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Task<'a> {
    pub(crate) store: &'a PointStore,
    pub(crate) view: View,
    /// Pixels from row to row.
    pub(crate) stride: u32,
    /// Points below this age are fresh.
    pub(crate) fresh: u8,
}

/// Projects the slots from `first`, a multiple of [`LANES`], up to `end`, another one, and writes those that fall into
/// the picture to `list` in order. Returns how many.
///
/// # Panics
/// If the store has fewer than `end` slots or the list less room than `end - first + LANES` entries.
pub(crate) fn project(
    level: Level,
    task: &Task<'_>,
    (first, end): (usize, usize),
    list: &mut ListMut<'_>,
) -> usize {
    assert!(
        first.is_multiple_of(LANES) && end.is_multiple_of(LANES) && first <= end,
        "whole groups of slots"
    );
    let store = task.store;
    assert!(
        end <= store.x.len() && end <= store.y.len() && end <= store.z.len() && end <= store.age.len(),
        "slots beyond the store"
    );
    let room = end - first + LANES;
    assert!(
        room <= list.pixel.len() && room <= list.depth.len() && room <= list.tag.len(),
        "no room for the projected points"
    );
    match level {
        Level::Scalar => scalar(task, (first, end), list),
        // The kernels rely on what was just asserted.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => x86::project(level, task, (first, end), list),
    }
}

/// Copies the entries of `from` whose pixel is one of `pixels` from `first` on, in order; their pixels then count from
/// there. Returns how many.
///
/// # Panics
/// If `list` has less room than `LANES` entries more than `from`.
pub(crate) fn select(
    level: Level,
    from: Entries<'_>,
    (first, pixels): (u32, u32),
    list: &mut ListMut<'_>,
) -> usize {
    let count = from[0].len();
    assert!(
        count == from[1].len() && count == from[2].len(),
        "three parts of one list"
    );
    let room = count + LANES;
    assert!(
        room <= list.pixel.len() && room <= list.depth.len() && room <= list.tag.len(),
        "no room for the selected points"
    );
    match level {
        Level::Scalar => select_scalar(from, (first, pixels), list),
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => x86::select(level, from, (first, pixels), list),
    }
}

fn select_scalar(
    [pixel, depth, tag]: Entries<'_>,
    (first, pixels): (u32, u32),
    list: &mut ListMut<'_>,
) -> usize {
    let mut count = 0;
    for ((&pixel, &depth), &tag) in pixel.iter().zip(depth).zip(tag) {
        let at = pixel.wrapping_sub(first);
        // Always written, counted only if it belongs: which ones do cannot be guessed.
        (list.pixel[count], list.depth[count], list.tag[count]) = (at, depth, tag);
        count += usize::from(at < pixels);
    }
    count
}

/// The twin of the SIMD kernels: the same bits, one point at a time.
fn scalar(task: &Task<'_>, (first, end): (usize, usize), list: &mut ListMut<'_>) -> usize {
    let store = task.store;
    let mut count = 0;
    for i in first..end {
        if let Some(p) = task.view.project(Vec3::new(store.x[i], store.y[i], store.z[i])) {
            let settled = if store.age[i] < task.fresh { 0 } else { SETTLED };
            list.pixel[count] = p.y * task.stride + p.x;
            list.depth[count] = p.depth.to_bits();
            let place = u32::from(p.region) << REGION_SHIFT | u32::from(p.eighth) << EIGHTH_SHIFT;
            list.tag[count] = place | settled | i as u32;
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::Point;
    use glam::{Mat4, Vec4};

    fn run(level: Level, store: &PointStore, view: &View) -> [Vec<u32>; 3] {
        let mut list = List::default();
        list.reserve(store.slots() + LANES);
        let room = list.pixel.len();
        let mut chunk = list.chunks_mut(room).next().expect("one chunk");
        let task = Task {
            store,
            view: *view,
            stride: 64,
            fresh: 7,
        };
        let count = project(level, &task, (0, store.slots()), &mut chunk);
        [chunk.pixel, chunk.depth, chunk.tag].map(|part| part[..count].to_vec())
    }

    /// Points all over, a fifth of them at places that break things, and some slots empty.
    fn store(seed: u64, points: usize) -> PointStore {
        let mut state = seed;
        let mut next = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let odd = [0.0, -0.0, 1e-40, -1.0, f32::MAX, -f32::MAX, 1e30, 1.0];
        let mut store = PointStore::new(points).expect("capacity");
        for i in 0..points {
            let mut coordinate = |scale: f32| {
                let pick = next();
                if pick < 0.07 {
                    odd[(next() * 8.0) as usize]
                } else {
                    (next() - 0.5) * scale
                }
            };
            let position = Vec3::new(coordinate(4.0), coordinate(4.0), coordinate(6.0) - 2.0);
            let slot = store.take_vacant(None).expect("room");
            let point = Point {
                position,
                colour: Vec3::ONE,
                surface: 0,
                object: i as u32 % 7,
                lights: 1,
            };
            store.write(slot, &point);
            store.age[slot] = (next() * 20.0) as u8;
        }
        store.invalidate_object(3, crate::Fate::Remove);
        store
    }

    #[test]
    fn kernels_agree_to_the_last_bit() {
        let perspective = Mat4::from_cols(
            Vec4::new(1.3, 0.1, 0.0, 0.0),
            Vec4::new(0.0, 1.1, 0.0, 0.2),
            Vec4::new(0.05, 0.0, 0.0, -1.0),
            Vec4::new(0.1, -0.2, 0.1, 0.3),
        );
        let parallel = Mat4::from_scale(Vec3::new(0.4, 0.6, 1.0));
        let views = [
            View::new(&perspective, 64, 48).expect("size"),
            View::new(&perspective, 37, 211).expect("size"),
            View::new(&parallel, 64, 64)
                .expect("size")
                .with_depth(Vec4::new(0.0, 0.0, -1.0, 1.0)),
            View::new(&Mat4::ZERO, 64, 64).expect("size"),
            View::new(&Mat4::from_cols_array(&[f32::NAN; 16]), 64, 64).expect("size"),
        ];
        for points in [1, 15, 16, 17, 3000] {
            let store = store(points as u64, points);
            for view in &views {
                let expected = run(Level::Scalar, &store, view);
                for level in Level::all() {
                    assert_eq!(
                        run(level, &store, view),
                        expected,
                        "{level:?}, {points} points, {view:?}"
                    );
                }
            }
        }
        let list = run(Level::Scalar, &store(5, 3000), &views[0]);
        for (first, pixels) in [(0, 3072), (700, 900), (3000, 10), (0, 0)] {
            let selected = |level| {
                let mut out = List::default();
                out.reserve(list[0].len() + LANES);
                let room = out.pixel.len();
                let mut out = out.chunks_mut(room).next().expect("one chunk");
                let from = [&list[0][..], &list[1], &list[2]];
                let count = select(level, from, (first, pixels), &mut out);
                out.entries(count).map(<[u32]>::to_vec)
            };
            let expected = selected(Level::Scalar);
            let inside = list[0]
                .iter()
                .filter(|&&p| (first..first + pixels).contains(&p))
                .count();
            assert_eq!(expected[0].len(), inside, "all from {first} on");
            for level in Level::all() {
                assert_eq!(
                    selected(level),
                    expected,
                    "{level:?}, {pixels} pixels from {first}"
                );
            }
        }
        let inside = run(Level::Scalar, &store(9, 3000), &views[0])[0].len();
        assert!(
            inside > 300 && inside < 2500,
            "{inside} of 3000 fall into the picture: a fair mix"
        );
    }
}
