//! Where the camera will be.

use glam::{DMat3, DQuat};
use llsr_scene::Camera;

/// A turn in one frame beyond which the camera has jumped, not moved (radians).
const JUMP: f64 = 0.35;

/// The camera `frames` frames after `now`, if it goes on as it came from `before`. False, and `out` is `now`, if it did not move
/// or jumped.
pub(crate) fn extrapolate(before: &Camera, now: &Camera, frames: u32, out: &mut Camera) -> bool {
    out.position = now.position;
    out.axes = now.axes;
    out.projection = now.projection;
    if before.projection != now.projection || (before.position == now.position && before.axes == now.axes) {
        return false;
    }
    let turn = DQuat::from_mat3(&(now.axes * before.axes.transpose())).normalize();
    let (axis, angle) = turn.to_axis_angle();
    // The short way round.
    let angle = if angle > std::f64::consts::PI {
        angle - std::f64::consts::TAU
    } else {
        angle
    };
    if !angle.is_finite() || angle.abs() > JUMP {
        return false;
    }
    let frames = f64::from(frames);
    out.position = now.position + (now.position - before.position) * frames;
    out.axes = DMat3::from_axis_angle(axis, angle * frames) * now.axes;
    out.position.is_finite() && out.axes.is_finite()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use llsr_scene::FieldOfView;

    use super::*;

    fn camera(step: f64) -> Camera {
        // Walks along x and turns about y.
        let eye = DVec3::new(0.1 * step, 1.0, 0.0);
        let angle = 0.02 * step;
        let ahead = eye + DVec3::new(angle.sin(), 0.0, -angle.cos());
        Camera::look_at(
            "walker",
            eye,
            ahead,
            DVec3::Y,
            FieldOfView::vertical_degrees(60.0),
        )
    }

    #[test]
    fn steady_motion_goes_on() {
        let mut out = camera(0.0);
        assert!(extrapolate(&camera(3.0), &camera(4.0), 5, &mut out), "it moves");
        let expected = camera(9.0);
        assert!(
            out.position.distance(expected.position) < 1e-9,
            "{}",
            out.position
        );
        assert!(
            (out.forward() - expected.forward()).length() < 1e-9,
            "{}",
            out.forward()
        );
    }

    #[test]
    fn rest_and_jumps_tell_nothing() {
        let mut out = camera(0.0);
        assert!(!extrapolate(&camera(3.0), &camera(3.0), 5, &mut out), "at rest");
        assert!(!extrapolate(&camera(0.0), &camera(60.0), 5, &mut out), "a jump");
        assert_eq!(out.position, camera(60.0).position, "stays where it is");
    }
}
