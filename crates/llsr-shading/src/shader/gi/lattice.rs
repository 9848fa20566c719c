//! Where records of irradiance lie: on lines of a lattice.
//!
//! Along each axis run lines through the points of a square lattice, and finer ones on each further level. Where a line
//! crosses a surface there is a place for a record. So places depend on the scene alone, not on what was shaded before: whoever
//! needs a record finds the same one, whatever the order of work and the number of threads.

use glam::{DVec2, DVec3};
use llsr_scene::{Bounds, ObjectId};
use llsr_tracer::{Hit, Surface, Tracer};

use crate::random::mix;
use crate::shader::World;

/// Surfaces that one line may cross; the rest are left out.
const CROSSINGS: usize = 256;
/// The most levels.
pub(crate) const LEVELS: usize = 13;

/// One object in so many may be left out of the size of a scene.
const OUTLIERS: usize = 16;

/// The size of a scene to which distances of records are proportional (m): the diagonal of its box, or of that without a sixteenth of
/// the objects, the largest, if it is less than half of that. A room often lies on a ground that is much larger.
pub(crate) fn scene_size(world: &World) -> f64 {
    let scene = world.scene();
    let mut boxes: Vec<Bounds> = (0..scene.objects.len())
        .map(|index| scene.object_bounds(ObjectId::from(index)))
        .filter(|bounds| !bounds.is_empty())
        .collect();
    boxes.sort_by(|a, b| a.diagonal().total_cmp(&b.diagonal()));
    boxes.truncate(boxes.len() - boxes.len() / OUTLIERS);
    let most = boxes.iter().fold(Bounds::EMPTY, |all, bounds| all.union(*bounds));
    let (all, most) = (f64::from(world.bounds().diagonal()), f64::from(most.diagonal()));
    if most > 0.0 && most < 0.5 * all { most } else { all }
}

/// A line of the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct LineKey {
    axis: u8,
    level: u8,
    i: i32,
    j: i32,
}

/// A place for a record: where a line crosses a surface, on one of its sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct PlaceKey {
    line: LineKey,
    pub(crate) object: ObjectId,
    triangle: u32,
    /// On the side to which the line runs, or the other.
    upper: bool,
}

impl PlaceKey {
    pub(crate) fn new(line: LineKey, hit: &Hit, upper: bool) -> Self {
        let triangle = match hit.surface {
            Surface::Triangle { index, .. } => index,
            Surface::Primitive => u32::MAX,
        };
        Self {
            line,
            object: hit.object,
            triangle,
            upper,
        }
    }

    /// A number for its random choices.
    pub(crate) fn hash(&self, seed: u64) -> u64 {
        let LineKey { axis, level, i, j } = self.line;
        let words = [
            u64::from(axis) << 32 | u64::from(level) << 8 | u64::from(self.upper),
            u64::from(i as u32) << 32 | u64::from(j as u32),
            u64::from(self.object.0) << 32 | u64::from(self.triangle),
        ];
        words.iter().fold(mix(seed), |hash, &word| mix(hash ^ word))
    }
}

/// All lines.
#[derive(Clone, Debug)]
pub(crate) struct Lattice {
    /// Distance between lines on the coarsest level (m).
    spacing: f64,
    /// Where lines begin and end along each axis (m).
    low: DVec3,
    high: DVec3,
    /// Shift of each level's lattice, in its spacings, so that lines do not run along walls.
    shifts: [[DVec2; LEVELS]; 3],
}

impl Lattice {
    /// A lattice about a scene; `spacing` is that of the coarsest level (m).
    pub(crate) fn new(bounds: Bounds, spacing: f64, seed: u64) -> Self {
        let margin = f64::from(bounds.diagonal());
        let unit = |word: u64| (mix(seed ^ mix(word)) >> 11) as f64 / (1u64 << 53) as f64;
        let shift = |axis: usize, level: usize| {
            let word = (axis * LEVELS + level) as u64;
            DVec2::new(unit(2 * word), unit(2 * word + 1))
        };
        Self {
            spacing,
            low: bounds.min.as_dvec3() - margin,
            high: bounds.max.as_dvec3() + margin,
            shifts: std::array::from_fn(|axis| std::array::from_fn(|level| shift(axis, level))),
        }
    }

    /// Distance between the lines of a level (m).
    pub(crate) fn spacing(&self, level: usize) -> f64 {
        self.spacing / (1u64 << level) as f64
    }

    /// The four lines of a level and axis around a point, with their bilinear weights.
    pub(crate) fn around(&self, axis: usize, level: usize, point: DVec3) -> [(LineKey, f64); 4] {
        let across = DVec2::new(point[(axis + 1) % 3], point[(axis + 2) % 3]);
        let place = across / self.spacing(level) - self.shifts[axis][level];
        let corner = place.floor();
        let inside = place - corner;
        std::array::from_fn(|which| {
            let step = DVec2::new((which & 1) as f64, (which >> 1) as f64);
            let weight = (DVec2::ONE - (inside - step).abs()).max(DVec2::ZERO);
            let key = LineKey {
                axis: axis as u8,
                level: level as u8,
                i: (corner.x + step.x) as i32,
                j: (corner.y + step.y) as i32,
            };
            (key, weight.x * weight.y)
        })
    }

    /// Where a line begins, its unit direction and its length.
    fn line(&self, key: LineKey) -> (DVec3, DVec3, f64) {
        let axis = usize::from(key.axis);
        let level = usize::from(key.level);
        let across =
            (DVec2::new(f64::from(key.i), f64::from(key.j)) + self.shifts[axis][level]) * self.spacing(level);
        let mut origin = DVec3::ZERO;
        origin[axis] = self.low[axis];
        origin[(axis + 1) % 3] = across.x;
        origin[(axis + 2) % 3] = across.y;
        let mut direction = DVec3::ZERO;
        direction[axis] = 1.0;
        (origin, direction, self.high[axis] - self.low[axis])
    }

    /// The direction of the lines along an axis.
    pub(crate) fn direction(axis: usize) -> DVec3 {
        let mut direction = DVec3::ZERO;
        direction[axis] = 1.0;
        direction
    }

    /// All crossings of a line with surfaces, in order.
    pub(crate) fn crossings(&self, key: LineKey, tracer: &Tracer) -> Box<[Hit]> {
        let (start, direction, length) = self.line(key);
        let mut hits = Vec::new();
        let mut origin = start;
        while hits.len() < CROSSINGS {
            let left = length - (origin - start).dot(direction);
            let Some(hit) = tracer.closest(origin, direction, left) else {
                break;
            };
            origin = hit.leave(direction);
            hits.push(hit);
        }
        hits.into_boxed_slice()
    }

    /// Does a line run through a box?
    pub(crate) fn crosses(&self, key: LineKey, bounds: &Bounds) -> bool {
        let (start, _, _) = self.line(key);
        let axis = usize::from(key.axis);
        // A box in single precision, so a little more than it says.
        let slack = 1e-5 * f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
        [(axis + 1) % 3, (axis + 2) % 3].into_iter().all(|other| {
            start[other] >= f64::from(bounds.min[other]) - slack
                && start[other] <= f64::from(bounds.max[other]) + slack
        })
    }
}
