//! Recording the camera's path, 30 steps a second whatever the frame rate.

use llsr_epr::CameraPath;
use llsr_scene::{Camera, FieldOfView};

/// Steps a second.
const RATE: f64 = 30.0;
/// Most steps: an hour.
const MOST: usize = 30 * 3600;

/// A path that is being recorded.
#[derive(Clone, Debug, Default)]
pub struct Recorder {
    path: CameraPath,
    /// Time since the first step (s).
    time: f64,
    last: Option<(f64, Camera)>,
}

impl Recorder {
    /// The camera of the frame that is shown `seconds` after the one before.
    pub fn frame(&mut self, camera: &Camera, seconds: f64) {
        let Some((before, last)) = self.last.take() else {
            self.path.cameras.push(camera.clone());
            self.last = Some((0.0, camera.clone()));
            return;
        };
        self.time += seconds.max(0.0);
        // Steps between two frames lie between their cameras.
        while self.path.cameras.len() < MOST {
            let due = self.path.cameras.len() as f64 / RATE;
            if due > self.time {
                break;
            }
            let share = (due - before) / (self.time - before).max(f64::MIN_POSITIVE);
            self.path
                .cameras
                .push(between(&last, camera, share.clamp(0.0, 1.0)));
        }
        self.last = Some((self.time, camera.clone()));
    }

    /// Length so far (s).
    pub fn seconds(&self) -> f64 {
        self.path.cameras.len() as f64 / RATE
    }

    /// The path.
    pub fn finish(self) -> CameraPath {
        self.path
    }
}

/// A camera between two, level if they are.
fn between(from: &Camera, to: &Camera, share: f64) -> Camera {
    let mix = |a: glam::DVec3, b: glam::DVec3| a.lerp(b, share);
    let position = mix(from.position, to.position);
    let ahead = mix(from.forward(), to.forward());
    // Opposite views have no middle.
    let forward = ahead.try_normalize().unwrap_or(to.forward());
    let up = mix(from.axes.y_axis, to.axes.y_axis);
    let angle = FieldOfView::vertical_degrees(45.0);
    let axes = Camera::look_at("", position, position + forward, up, angle).axes;
    let nearer = if share < 0.5 { from } else { to };
    Camera {
        name: "path".to_owned(),
        position,
        axes,
        projection: nearer.projection,
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn camera(time: f64) -> Camera {
        // Straight on at 3 m/s while turning to the left.
        let eye = DVec3::new(0.0, 1.6, -3.0 * time);
        let (sin, cos) = (0.4 * time).sin_cos();
        Camera::look_at(
            "c",
            eye,
            eye + DVec3::new(-sin, 0.0, -cos),
            DVec3::Y,
            FieldOfView::vertical_degrees(60.0),
        )
    }

    #[test]
    fn steps_are_a_thirtieth_of_a_second_apart_at_any_frame_rate() {
        for rate in [7.0, 30.0, 144.0] {
            let mut recorder = Recorder::default();
            for frame in 0..=(2.0 * rate) as u32 {
                recorder.frame(&camera(f64::from(frame) / rate), 1.0 / rate);
            }
            assert!((recorder.seconds() - 2.0).abs() < 0.07, "{}", recorder.seconds());
            let path = recorder.finish();
            for (step, recorded) in path.cameras.iter().enumerate() {
                let expected = camera(step as f64 / 30.0);
                let apart = recorded.position.distance(expected.position);
                assert!(apart < 1e-6, "{rate} frames a second, step {step}: {apart} m");
                let turned = recorded.forward().angle_between(expected.forward());
                assert!(
                    turned < 1e-3,
                    "{rate} frames a second, step {step}: {turned} radians"
                );
            }
        }
    }

    #[test]
    fn one_frame_is_one_step() {
        let mut recorder = Recorder::default();
        recorder.frame(&camera(0.0), 0.5);
        assert_eq!(recorder.finish().cameras.len(), 1, "steps");
    }
}
