//! Where a new sample goes, and what it says about the points around it.
//!
//! Follows the Render Cache (Walter, Drettakis, Parker 1999, section 4): a new sample replaces what it renews, and where
//! it shows that colours have changed the points around it age early, so that they are sampled again soon.

use glam::Vec3;

use crate::fetch::fetch;
use crate::image::{NO_SLOT, PointImage};
use crate::project::{self, Level, ListMut, SLOT_MASK, Task};
use crate::store::{LANES, Point, PointStore};
use crate::view::Projected;

/// By how many ticks a point must be older than those of its home for a new sample to take its slot instead.
const HOME_BONUS: u32 = 16;

/// Changes of colour make points older up to this age: doubtful, not gone. Where a border runs through a pixel its samples differ each time, and
/// points around it would otherwise age until they are removed.
const EARLY_MOST: u8 = 192;

/// How new samples take the place of old points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replacement {
    /// Points of one object in one pixel whose depths differ by at most this share are the same surface: the new one
    /// renews the old one.
    pub depth_tolerance: f32,
    /// The change of colour that makes the points around age early: largest difference of a component over the
    /// largest component of both colours. Below 1/256 every sample may count as a change, for colours are
    /// stored with nine bits.
    pub colour_tolerance: f32,
    /// Ticks that the points around age early.
    pub early_ageing: u8,
    /// How many pixels around, each way, up to 15.
    pub early_radius: u8,
    /// Ticks by which a point that the picture does not show counts as older when slots are recycled.
    pub unseen_bonus: u8,
}

impl Default for Replacement {
    fn default() -> Self {
        Self {
            depth_tolerance: 0.02,
            colour_tolerance: 0.15,
            early_ageing: 64,
            early_radius: 4,
            unseen_bonus: 64,
        }
    }
}

/// What became of a new sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Insertion {
    /// The slot it went to.
    pub slot: u32,
    /// Whose slot that was.
    pub place: Place,
    /// Did its colour differ so much from that of the point it renewed that the points around aged early?
    pub changed: bool,
}

/// For each slot of a group the pixel that shows its point.
type Places = [Option<u32>; LANES];

/// Whose slot a new sample took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Nobody's.
    Free,
    /// That of a point of the same surface in the same pixel.
    Renewed,
    /// That of a point that shone through in the same pixel.
    Hidden,
    /// That of an old point; see [`PointStore::insert`].
    Recycled,
}

impl PointStore {
    /// Stores a new sample. Returns `None`, and stores nothing, if its position is not finite.
    ///
    /// `image` is the last picture of this store: it tells which point the sample renews. In the pixel of the sample
    /// - a point of the same surface is replaced; if its colour was different, the points around age early;
    /// - a point that shone through a nearer surface is replaced;
    /// - a point that is clearly nearer stays, but ages early: the sample has seen past it. It is either at the rim of
    ///   its object, and will be confirmed by samples to come, or out of date.
    ///
    /// Otherwise the sample takes a free slot or, if there is none, that of the oldest of 32 points: 16 of its own part of
    /// the picture and 16 taken in turn from all over the store. Points that the picture does not show count as older.
    /// To keep points close together that are so in the picture, another point may be moved to that slot and the new one
    /// take its place.
    pub fn insert(&mut self, point: &Point, image: &PointImage, policy: &Replacement) -> Option<Insertion> {
        if !point.position.is_finite() {
            return None;
        }
        let projected = image.view().project(point.position);
        if let Some(at) = projected
            && let Some((slot, place)) = self.in_place(point, at, image, policy)
        {
            let changed = place == Place::Renewed && {
                let (new, old) = (point.colour, self.colour(slot));
                let difference = (new - old).abs().max_element();
                difference > policy.colour_tolerance * new.max(old).max_element()
            };
            self.write(slot, point);
            if changed {
                self.age_around(slot, at, image, policy);
            }
            return Some(Insertion {
                slot: slot as u32,
                place,
                changed,
            });
        }
        let home = projected.map(|at| self.home(image, at.y as usize * image.stride() + at.x as usize));
        let mut places = None;
        let (mut slot, place) = match self.take_vacant(home) {
            Some(slot) => (slot, Place::Free),
            None => {
                places = home.map(|home| self.places(home, image));
                let local = home.zip(places.as_ref());
                (self.recycle(local, image, policy), Place::Recycled)
            }
        };
        // A point that has strayed there makes room for the new one.
        if let Some(home) = home
            && home.abs_diff(slot / LANES) > 1
        {
            let places = places.unwrap_or_else(|| self.places(home, image));
            if let Some(stray) = self.stray(home, &places, image) {
                self.copy(stray, slot);
                slot = stray;
            }
        }
        self.write(slot, point);
        Some(Insertion {
            slot: slot as u32,
            place,
            changed: false,
        })
    }

    /// Asks the memory for what [`insert`](Self::insert) of a point at `position` will look at first. Nothing changes: a caller with many points is
    /// faster if it does this for each some points before it is inserted, since what lies around in the store is seldom in
    /// the caches.
    pub fn prefetch(&self, position: Vec3, image: &PointImage) {
        let Some(at) = image.view().project(position) else {
            return;
        };
        let (stride, slots) = (image.stride(), image.slot_plane());
        let pixel = at.y as usize * stride + at.x as usize;
        fetch(&image.keys, pixel);
        // The points of its home are shown in the rows around.
        for row in 0..5 {
            fetch(slots, (pixel + row * stride).wrapping_sub(2 * stride));
        }
        let first = self.home(image, pixel) * LANES;
        for values in [&self.x, &self.y, &self.z] {
            fetch(values, first);
        }
        fetch(&self.age, first);
        fetch(&self.object, first);
        fetch(&self.surface, first);
        for half in [first, first + LANES / 2] {
            fetch(&self.colour, half);
            fetch(&self.lights, half);
        }
    }

    fn in_place(
        &mut self,
        point: &Point,
        at: Projected,
        image: &PointImage,
        policy: &Replacement,
    ) -> Option<(usize, Place)> {
        let slot = image.nearest_slot(at.x, at.y)?;
        // The slot may have changed hands since the picture was made.
        if !self.is_live(slot) {
            return None;
        }
        let old = image.view().project(self.position(slot))?;
        if (old.x, old.y) != (at.x, at.y) {
            return None;
        }
        let near = policy.depth_tolerance * at.depth;
        if self.object[slot] == point.object && (old.depth - at.depth).abs() <= near {
            return Some((slot, Place::Renewed));
        }
        if image.slot_plane()[at.y as usize * image.stride() + at.x as usize] == NO_SLOT {
            return Some((slot, Place::Hidden));
        }
        if old.depth < at.depth - near {
            self.age[slot] = self.age[slot].saturating_add(policy.early_ageing);
        }
        None
    }

    /// Early ageing around a pixel, of all points but the one in `slot` and those that came since the last tick.
    fn age_around(&mut self, slot: usize, at: Projected, image: &PointImage, policy: &Replacement) {
        let (width, height) = image.size();
        let radius = u32::from(policy.early_radius.min(15));
        let columns = at.x.saturating_sub(radius) as usize..(at.x + radius + 1).min(width) as usize;
        for y in at.y.saturating_sub(radius)..(at.y + radius + 1).min(height) {
            let row = &image.slot_plane()[y as usize * image.stride()..];
            for &other in &row[columns.clone()] {
                if other == NO_SLOT || other as usize == slot {
                    continue;
                }
                if let Some(age) = self.age.get_mut(other as usize)
                    && *age > 0
                {
                    *age = age.saturating_add(policy.early_ageing).min(EARLY_MOST.max(*age));
                }
            }
        }
    }

    /// The group of slots for points that fall into a pixel, given by its place in the planes.
    fn home(&self, image: &PointImage, pixel: usize) -> usize {
        (pixel as u64 * self.groups() as u64 / image.slot_plane().len() as u64) as usize
    }

    /// The slot of the oldest point of two groups: the home of the new point and the next one in turn. The latter one must
    /// be older by [`HOME_BONUS`]; of equally old ones in a group the first is taken. The store is full.
    fn recycle(&mut self, home: Option<(usize, &Places)>, image: &PointImage, policy: &Replacement) -> usize {
        let turn = self.hand;
        self.hand = (turn + 1) % self.groups();
        let mut best = self.oldest(turn, &self.places(turn, image), policy);
        if let Some((home, places)) = home {
            let local = self.oldest(home, places, policy);
            if local.1 + HOME_BONUS >= best.1 {
                best = local;
            }
        }
        best.0
    }

    /// The slot of the oldest point of a group, and its age with the bonus for those that the picture does not show.
    fn oldest(&self, group: usize, places: &Places, policy: &Replacement) -> (usize, u32) {
        let first = group * LANES;
        let mut best = (first, 0);
        for (slot, place) in (first..self.capacity()).zip(places) {
            // The picture cannot know what came since the last tick.
            let unseen = place.is_none() && self.age[slot] > 0;
            let bonus = if unseen { u32::from(policy.unseen_bonus) } else { 0 };
            let score = u32::from(self.age[slot]) + bonus;
            if score > best.1 {
                best = (slot, score);
            }
        }
        best
    }

    /// The slot of a point in the group that the picture does not show or that falls to the home of others. Points that came
    /// since the last tick stay.
    fn stray(&self, group: usize, places: &Places, image: &PointImage) -> Option<usize> {
        // The pixels whose home is the group or one beside it, as `home` finds it but without dividing for each.
        let (groups, pixels) = (self.groups() as u64, image.slot_plane().len() as u64);
        let near = (group.saturating_sub(1) as u64 * pixels)..(group as u64 + 2) * pixels;
        let stray =
            |place: Option<u32>| place.is_none_or(|pixel| !near.contains(&(u64::from(pixel) * groups)));
        let mut slots = (group * LANES..self.capacity()).zip(places);
        slots
            .find(|&(slot, place)| self.is_live(slot) && self.age[slot] > 0 && stray(*place))
            .map(|found| found.0)
    }

    /// For each slot of a group the pixel that shows its point, as its place in the planes.
    fn places(&self, group: usize, image: &PointImage) -> Places {
        let (mut pixel, mut depth, mut tag) = ([0; 2 * LANES], [0; 2 * LANES], [0; 2 * LANES]);
        let mut list = ListMut {
            pixel: &mut pixel,
            depth: &mut depth,
            tag: &mut tag,
        };
        let first = group * LANES;
        let task = Task {
            store: self,
            view: *image.view(),
            stride: image.stride() as u32,
            fresh: 0,
        };
        let count = project::project(Level::detect(), &task, (first, first + LANES), &mut list);
        let mut places = [None; LANES];
        let [pixels, _, tags] = list.entries(count);
        for (&pixel, &tag) in pixels.iter().zip(tags) {
            let slot = tag & SLOT_MASK;
            if image.slot_plane()[pixel as usize] == slot {
                places[slot as usize - first] = Some(pixel);
            }
        }
        places
    }
}
