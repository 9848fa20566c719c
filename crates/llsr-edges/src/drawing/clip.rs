//! Edges cut to what a picture shows.

use glam::DVec3;
use llsr_scene::{Camera, Projection, Viewport};

/// The part of a segment (m, recentred frame) inside the picture, or `None`.
///
/// A perspective camera sees nothing nearer than `near` (m, positive) along its direction. An end inside the picture is
/// returned bitwise as it is.
pub fn clip_to_picture(
    camera: &Camera,
    viewport: Viewport,
    near: f64,
    ends: [DVec3; 2],
) -> Option<[DVec3; 2]> {
    let (half_x, half_y) = camera.half_extent(viewport);
    // Distances from the sides of the picture, each negative outside.
    let inside = |p: DVec3| {
        let local = camera.axes.transpose() * (p - camera.position);
        match camera.projection {
            Projection::Perspective(_) => {
                let (x, y, depth) = (local.x / half_x, local.y / half_y, -local.z);
                [depth - x, depth + x, depth - y, depth + y, depth - near]
            }
            Projection::Orthographic { .. } => {
                let (x, y) = (local.x / half_x, local.y / half_y);
                [1.0 - x, 1.0 + x, 1.0 - y, 1.0 + y, 0.0]
            }
        }
    };
    let [at_a, at_b] = ends.map(inside);
    let (mut t0, mut t1) = (0.0f64, 1.0f64);
    for (a, b) in at_a.into_iter().zip(at_b) {
        match (a < 0.0, b < 0.0) {
            (true, true) => return None,
            (true, false) => t0 = t0.max(a / (a - b)),
            (false, true) => t1 = t1.min(a / (a - b)),
            (false, false) => {}
        }
    }
    let [a, b] = ends;
    (t0 < t1).then(|| {
        [
            if t0 > 0.0 { a + (b - a) * t0 } else { a },
            if t1 < 1.0 { a + (b - a) * t1 } else { b },
        ]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use llsr_scene::FieldOfView;

    #[test]
    fn what_is_left_lies_in_the_picture_and_ends_inside_stay() {
        let viewport = Viewport {
            width: 40,
            height: 20,
        };
        let mut camera = Camera::look_at(
            "",
            DVec3::new(1.0, 2.0, 5.0),
            DVec3::ZERO,
            DVec3::Y,
            FieldOfView::vertical_degrees(50.0),
        );
        for turn in 0..2 {
            let inside = DVec3::new(0.1, 0.2, 0.3);
            for far in [
                DVec3::X * 90.0,
                DVec3::Y * -70.0,
                DVec3::new(4.0, 8.0, 20.0),
                camera.position,
            ] {
                let [a, b] =
                    clip_to_picture(&camera, viewport, 1e-3, [inside, far]).expect("it begins inside");
                assert_eq!(a, inside, "an end inside stays");
                let (x, y, depth) = camera.project(viewport, b).expect("in front");
                assert!(
                    (-1e-6..=40.0 + 1e-6).contains(&x) && (-1e-6..=20.0 + 1e-6).contains(&y),
                    "{x} {y}"
                );
                assert!(turn == 1 || depth >= 1e-3 - 1e-12, "depth {depth}");
                let back = clip_to_picture(&camera, viewport, 1e-3, [far, inside]).expect("it ends inside");
                assert!(
                    back[0].distance(b) < 1e-9 && back[1] == inside,
                    "either way round"
                );
            }
            let outside = [DVec3::new(90.0, 0.0, -5.0), DVec3::new(90.0, 0.0, 5.0)];
            assert_eq!(
                clip_to_picture(&camera, viewport, 1e-3, outside),
                None,
                "beside the picture"
            );
            camera.projection = Projection::Orthographic { height: 3.0 };
        }
        camera.projection = Projection::Perspective(FieldOfView::vertical_degrees(50.0));
        let behind = [camera.position + DVec3::Z, camera.position + DVec3::Z * 3.0];
        assert_eq!(
            clip_to_picture(&camera, viewport, 1e-3, behind),
            None,
            "behind the camera"
        );
    }
}
