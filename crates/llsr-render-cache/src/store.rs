//! The points themselves: a fixed number of slots in structure of arrays.

use glam::{Affine3A, Vec3};

use crate::Error;
use crate::colour::{PackedColour, pack_colour, unpack_colour};

/// The largest number of points in a store.
pub const MAX_CAPACITY: usize = (1 << 25) - 1;

/// Slots are handled in groups of this many: the arrays are padded to a multiple of it.
pub(crate) const LANES: usize = 16;

/// A shaded point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Where it lies. A sample of the background goes far away along its ray, say a thousand times the size of the
    /// scene.
    pub position: Vec3,
    /// What the image interpolates, linear: radiance, or light without what the caller puts on it for each pixel. Stored
    /// with 14 bits, see [`pack_colour`].
    pub colour: Vec3,
    /// The piece of surface that it lies on, in the caller's numbers.
    pub surface: u32,
    /// The object that it lies on.
    pub object: u32,
    /// The set of lights that the shader looked at for it, whether they were visible or not: bit i for all lights
    /// whose number is i modulo 64.
    pub lights: u64,
}

/// What invalidation does to the points it finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// They are gone at once. Right for points whose position is wrong.
    Remove,
    /// They age by so many ticks: they stay until newer samples come, and are asked for first. Right for points whose
    /// colour is doubtful.
    Age(u8),
    /// They reach the age 255 after so many further ticks at the latest, so that [`PointStore::advance`] with a largest age of
    /// 254 removes them then, unless newer samples take their places before. Right for points whose colour may be wrong
    /// and must not stay, while something else is still better than nothing.
    Expire(u8),
}

/// A fixed number of slots for points.
///
/// 41 bytes a slot. Points are known by the numbers of their slots. These stay the same until the next
/// [`insert`](Self::insert), which may move another point.
///
/// Points that fall close to each other are kept close to each other: the slots are divided among the pixels in the order of
/// scan lines, and new samples go to the slots of their part of the picture if they can. Reprojection of large pictures is
/// several times faster for it than with points in random order.
#[derive(Clone, Debug)]
pub struct PointStore {
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
    pub(crate) z: Vec<f32>,
    /// Packed, the fine part from bit 32 on; slots without a point hold 0.
    pub(crate) colour: Vec<u64>,
    pub(crate) surface: Vec<u32>,
    /// Was there ever a surface that is not 0?
    pub(crate) on_surfaces: bool,
    pub(crate) object: Vec<u32>,
    pub(crate) lights: Vec<u64>,
    /// Ticks since insertion, plus what changes of colour added.
    pub(crate) age: Vec<u8>,
    /// For each group of [`LANES`] slots the set of those without a point.
    vacant: Vec<u16>,
    vacancies: usize,
    /// Where the search for a group with a vacancy goes on.
    vacant_hand: usize,
    capacity: usize,
    /// Where the search for a slot to recycle goes on.
    pub(crate) hand: usize,
}

impl PointStore {
    /// An empty store with room for `capacity` points. All memory that the store will ever use is allocated here.
    ///
    /// # Errors
    /// [`Error::Capacity`] unless it is 1 to [`MAX_CAPACITY`].
    pub fn new(capacity: usize) -> Result<Self, Error> {
        if !(1..=MAX_CAPACITY).contains(&capacity) {
            return Err(Error::Capacity(capacity));
        }
        // At least one slot beyond the capacity stays empty, so that "no point" can be looked up without a branch.
        let slots = (capacity + 1).next_multiple_of(LANES);
        Ok(Self {
            // A slot is empty if its position is NaN: projection drops it without a further test.
            x: vec![f32::NAN; slots],
            y: vec![0.0; slots],
            z: vec![0.0; slots],
            colour: vec![0; slots],
            surface: vec![0; slots],
            on_surfaces: false,
            object: vec![0; slots],
            lights: vec![0; slots],
            age: vec![0; slots],
            vacant: (0..capacity.div_ceil(LANES))
                .map(|group| u16::MAX >> ((group + 1) * LANES).saturating_sub(capacity))
                .collect(),
            vacancies: capacity,
            vacant_hand: 0,
            capacity,
            hand: 0,
        })
    }

    /// The number of points there is room for.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// The number of points.
    pub fn len(&self) -> usize {
        self.capacity - self.vacancies
    }

    /// Is there no point?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The number of slots with padding: a multiple of [`LANES`] above the capacity.
    pub(crate) fn slots(&self) -> usize {
        self.x.len()
    }

    /// The point in `slot`, colours as stored; `None` if there is none.
    pub fn point(&self, slot: u32) -> Option<Point> {
        let i = slot as usize;
        self.is_live(i).then(|| Point {
            position: self.position(i),
            colour: self.colour(i),
            surface: self.surface[i],
            object: self.object[i],
            lights: self.lights[i],
        })
    }

    /// The age in ticks of the point in `slot`, 255 for that or more; `None` if there is none.
    pub fn age(&self, slot: u32) -> Option<u8> {
        let i = slot as usize;
        self.is_live(i).then(|| self.age[i])
    }

    /// All points with their slots, in order of the slots.
    pub fn iter(&self) -> impl Iterator<Item = (u32, Point)> + '_ {
        (0..self.capacity as u32).filter_map(|slot| Some((slot, self.point(slot)?)))
    }

    pub(crate) fn is_live(&self, i: usize) -> bool {
        self.x.get(i).is_some_and(|x| !x.is_nan())
    }

    pub(crate) fn colour(&self, i: usize) -> Vec3 {
        unpack_colour(PackedColour {
            coarse: self.colour[i] as u32,
            fine: (self.colour[i] >> 32) as u16,
        })
    }

    pub(crate) fn position(&self, i: usize) -> Vec3 {
        Vec3::new(self.x[i], self.y[i], self.z[i])
    }

    /// Lets all points age by `ticks`, up to 255, and removes those whose age passes `max_age`; with 255 none are.
    /// Returns how many were removed.
    ///
    /// Call it once a frame with 1; where shading is slow, every few frames, so that ages tell more.
    pub fn advance(&mut self, ticks: u8, max_age: u8) -> usize {
        self.advance_to_rest(ticks, u8::MAX, max_age)
    }

    /// The same, but points whose age is at most `rest` do not grow older than that: they wait for newer samples, however long
    /// these take. Only what was made older still, by [`Fate`] or early ageing, goes on ageing until it is removed.
    ///
    /// For a display that must keep its picture when the shader is slow or gone.
    pub fn advance_to_rest(&mut self, ticks: u8, rest: u8, max_age: u8) -> usize {
        let mut oldest = 0;
        for age in &mut self.age[..self.capacity] {
            let most = if *age <= rest { rest } else { u8::MAX };
            *age = age.saturating_add(ticks).min(most);
            oldest = oldest.max(*age);
        }
        if oldest <= max_age {
            return 0;
        }
        let before = self.vacancies;
        for i in 0..self.capacity {
            if self.age[i] > max_age {
                // Slots without a point have aged too.
                if self.is_live(i) {
                    self.remove(i);
                }
                self.age[i] = 0;
            }
        }
        self.vacancies - before
    }

    /// Invalidates the points on an object. Returns how many.
    pub fn invalidate_object(&mut self, object: u32, fate: Fate) -> usize {
        self.apply(fate, |store, i| store.object[i] == object)
    }

    /// Invalidates the points for which the shader looked at any of the lights in `lights` (bits as in
    /// [`Point::lights`]). Returns how many.
    pub fn invalidate_lights(&mut self, lights: u64, fate: Fate) -> usize {
        self.apply(fate, |store, i| store.lights[i] & lights != 0)
    }

    /// Invalidates the points in a box, its sides included. Returns how many.
    pub fn invalidate_box(&mut self, min: Vec3, max: Vec3, fate: Fate) -> usize {
        self.apply(fate, |store, i| {
            let p = store.position(i);
            p.cmpge(min).all() && p.cmple(max).all()
        })
    }

    /// Invalidates the points for which `affected` says so; it is called in order of the slots. Returns how many.
    pub fn invalidate_where(&mut self, mut affected: impl FnMut(&Point) -> bool, fate: Fate) -> usize {
        self.apply(fate, |store, i| {
            store.point(i as u32).is_some_and(|p| affected(&p))
        })
    }

    /// Invalidates the points for whose positions `affected` says so; it is called in order of the slots. Returns how many.
    /// Several times faster than [`invalidate_where`](Self::invalidate_where).
    pub fn invalidate_positions(&mut self, mut affected: impl FnMut(Vec3) -> bool, fate: Fate) -> usize {
        self.apply(fate, |store, i| affected(store.position(i)))
    }

    /// Moves the points on an object along with it. Their colours stay: let them age if the light on them changes.
    /// Points that the motion takes to infinity are removed. Returns how many points moved.
    pub fn move_object(&mut self, object: u32, motion: &Affine3A) -> usize {
        let mut moved = 0;
        for i in 0..self.capacity {
            if self.object[i] == object && self.is_live(i) {
                let position = motion.transform_point3(self.position(i));
                if position.is_finite() {
                    (self.x[i], self.y[i], self.z[i]) = position.into();
                    moved += 1;
                } else {
                    self.remove(i);
                }
            }
        }
        moved
    }

    /// Removes the point in a slot, if there is one.
    pub(crate) fn discard(&mut self, slot: u32) {
        let i = slot as usize;
        if self.is_live(i) {
            self.remove(i);
        }
    }

    /// The object of the point in `slot`; `None` if there is no point.
    pub fn object(&self, slot: u32) -> Option<u32> {
        let i = slot as usize;
        self.is_live(i).then(|| self.object[i])
    }

    /// The same for the point in `slot`, if there is one.
    pub fn invalidate(&mut self, slot: u32, fate: Fate) {
        let i = slot as usize;
        if self.is_live(i) {
            self.meet(i, fate);
        }
    }

    /// Removes all points.
    pub fn clear(&mut self) {
        self.apply(Fate::Remove, |_, _| true);
    }

    fn apply(&mut self, fate: Fate, mut affected: impl FnMut(&Self, usize) -> bool) -> usize {
        let mut count = 0;
        for i in 0..self.capacity {
            if self.is_live(i) && affected(self, i) {
                count += 1;
                self.meet(i, fate);
            }
        }
        count
    }

    fn meet(&mut self, i: usize, fate: Fate) {
        match fate {
            Fate::Remove => self.remove(i),
            Fate::Age(ticks) => self.age[i] = self.age[i].saturating_add(ticks),
            Fate::Expire(ticks) => self.age[i] = self.age[i].max(u8::MAX - ticks),
        }
    }

    fn remove(&mut self, i: usize) {
        self.x[i] = f32::NAN;
        self.colour[i] = 0;
        self.surface[i] = 0;
        self.vacant[i / LANES] |= 1 << (i % LANES);
        self.vacancies += 1;
    }

    /// The number of groups of slots.
    pub(crate) fn groups(&self) -> usize {
        self.vacant.len()
    }

    /// Takes a slot without a point, if there is one: in the group `home` or beside it if possible.
    pub(crate) fn take_vacant(&mut self, home: Option<usize>) -> Option<usize> {
        if self.vacancies == 0 {
            return None;
        }
        let near = home.and_then(|home| {
            let beside = [home, home + 1, home.wrapping_sub(1)];
            beside
                .into_iter()
                .find(|&group| self.vacant.get(group).is_some_and(|set| *set != 0))
        });
        let group = near.unwrap_or_else(|| {
            let vacant = |set: &u16| *set != 0;
            let (before, after) = self.vacant.split_at(self.vacant_hand);
            let found = after.iter().position(vacant).map(|i| self.vacant_hand + i);
            // There is one, for there are vacancies.
            self.vacant_hand = found.or_else(|| before.iter().position(vacant)).unwrap_or(0);
            self.vacant_hand
        });
        let bit = self.vacant[group].trailing_zeros() as usize;
        self.vacant[group] &= self.vacant[group] - 1;
        self.vacancies -= 1;
        Some(group * LANES + bit)
    }

    /// Copies the point in a slot to another one that is taken.
    pub(crate) fn copy(&mut self, from: usize, to: usize) {
        self.x[to] = self.x[from];
        self.y[to] = self.y[from];
        self.z[to] = self.z[from];
        self.colour[to] = self.colour[from];
        self.surface[to] = self.surface[from];
        self.object[to] = self.object[from];
        self.lights[to] = self.lights[from];
        self.age[to] = self.age[from];
    }

    /// Writes a new point into a slot that is taken.
    pub(crate) fn write(&mut self, i: usize, point: &Point) {
        (self.x[i], self.y[i], self.z[i]) = point.position.into();
        let packed = pack_colour(point.colour);
        self.colour[i] = u64::from(packed.coarse) | u64::from(packed.fine) << 32;
        self.surface[i] = point.surface;
        self.on_surfaces |= point.surface != 0;
        self.object[i] = point.object;
        self.lights[i] = point.lights;
        self.age[i] = 0;
    }
}
