//! Line drawings: edges without their hidden parts, joined into polylines.

mod clip;
mod hidden;
mod join;

use glam::DVec3;

pub use clip::clip_to_picture;
pub use hidden::{Sight, split_hidden};
pub use join::join;

/// A straight edge to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Strokes of one group that meet are joined; what a group means is the caller's affair.
    pub group: u32,
    /// The ends (m, recentred frame).
    pub ends: [DVec3; 2],
}

impl Stroke {
    /// The point at `t`: bitwise the ends at 0 and 1.
    pub fn at(&self, t: f64) -> DVec3 {
        let [a, b] = self.ends;
        if t <= 0.0 {
            a
        } else if t >= 1.0 {
            b
        } else {
            a + (b - a) * t
        }
    }
}

/// A stretch of a stroke that is wholly seen or wholly hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Position of the stroke in the list.
    pub stroke: u32,
    /// Whether something hides it.
    pub hidden: bool,
    /// Where it begins and ends on the stroke, 0 <= begin < end <= 1.
    pub t: [f64; 2],
}

/// A polyline of a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Group of its strokes.
    pub group: u32,
    /// Whether something hides it.
    pub hidden: bool,
    /// Whether the last point is joined to the first.
    pub closed: bool,
    /// Its points (m, recentred frame), at least two.
    pub points: Vec<DVec3>,
}
