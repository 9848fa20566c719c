//! A second opinion on what a shaft may meet, in a frame that follows the light.
//!
//! Boxes along the axes of the scene are wide around a light that runs askew. In a frame with one axis along the light,
//! its box has no width, and the hull with the box of the points is tight.

use glam::{DMat3, DVec3};
use llsr_scene::Bounds;

/// The hull of two boxes in a frame of its own, in double precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShaftFrame {
    /// Rows are the frame's axes.
    to_frame: DMat3,
    from: [DVec3; 2],
    to: [DVec3; 2],
    /// Many times the rounding of a coordinate in the frame (m).
    slack: f64,
}

impl ShaftFrame {
    /// `reach` is the largest coordinate of what will be tested (m).
    pub(super) fn new(points: &[DVec3], light: &[DVec3], reach: f32) -> Self {
        let first = light.first().copied().unwrap_or(DVec3::ZERO);
        let along = light
            .iter()
            .map(|&q| q - first)
            .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
            .and_then(DVec3::try_normalize)
            .unwrap_or(DVec3::X);
        let (u, v) = along.any_orthonormal_pair();
        let to_frame = DMat3::from_cols(along, u, v).transpose();
        let mut frame = Self {
            to_frame,
            from: extent(to_frame, points),
            to: extent(to_frame, light),
            slack: 0.0,
        };
        let largest = [frame.from, frame.to]
            .concat()
            .iter()
            .fold(f64::from(reach), |largest, p| largest.max(p.abs().max_element()));
        frame.slack = 64.0 * f64::EPSILON * largest;
        frame
    }

    /// May the shaft meet the hull of `corners`?
    pub(super) fn meets(&self, corners: &[DVec3]) -> bool {
        let [min, max] = extent(self.to_frame, corners);
        let (mut first, mut last) = (0f64, 1f64);
        for axis in 0..3 {
            // The interpolated lower plane lies below the upper one of what is tested, and the other way round.
            for (rise, room) in [
                (
                    self.to[0][axis] - self.from[0][axis],
                    max[axis] - self.from[0][axis] + self.slack,
                ),
                (
                    self.from[1][axis] - self.to[1][axis],
                    self.from[1][axis] - min[axis] + self.slack,
                ),
            ] {
                // s rise <= room, with s up to a few roundings.
                let s = room / rise;
                if rise > 0.0 {
                    last = last.min(s + 1e-12);
                } else if rise < 0.0 {
                    first = first.max(s - 1e-12);
                } else if room < 0.0 {
                    return false;
                }
            }
        }
        first <= last
    }

    /// May the shaft meet the box?
    pub(super) fn meets_box(&self, bounds: &Bounds) -> bool {
        self.meets(&bounds.corners().map(|p| p.as_dvec3()))
    }
}

/// The box around `points` in the frame.
fn extent(to_frame: DMat3, points: &[DVec3]) -> [DVec3; 2] {
    points
        .iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[min, max], &p| {
            let p = to_frame * p;
            [min.min(p), max.max(p)]
        })
}
