//! How the camera moves: by flying, and around a point.

use glam::{DMat3, DVec3};
use llsr_scene::{Camera, FieldOfView, Projection};

/// Largest angle between the view and the horizon (radians): the picture never turns over.
const STEEPEST: f64 = 89.0 * std::f64::consts::PI / 180.0;
/// Opening angles that zooming stays between (radians, either direction).
const OPENING: (f64, f64) = (0.02, 2.6);

/// What moving the mouse does to the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Steering {
    /// It turns on the spot.
    #[default]
    Fly,
    /// It goes round what lies under the pointer.
    Orbit,
}

/// A camera that stays level.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    camera: Camera,
    /// Metres a second when flying; positive.
    speed: f64,
}

impl Rig {
    /// Begins with `camera`; a camera that leans to the side is set upright by the first turn. `speed` is in metres a second.
    pub fn new(camera: Camera, speed: f64) -> Self {
        Self { camera, speed }
    }

    /// The camera as it stands.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Flying speed (m/s).
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Multiplies the flying speed; it stays between a micrometre and a thousand kilometres a second.
    pub fn change_speed(&mut self, factor: f64) {
        self.speed = (self.speed * factor).clamp(1e-6, 1e6);
    }

    /// Angle of the view above the horizon (radians).
    fn elevation(&self) -> f64 {
        self.camera.forward().y.clamp(-1.0, 1.0).asin()
    }

    /// Direction of the view around the vertical (radians; 0 is -z, to the left positive).
    fn heading(&self) -> f64 {
        let forward = self.camera.forward();
        // Straight up or down, the picture's upper border tells where one would go.
        let level = if forward.x.hypot(forward.z) > 1e-9 {
            forward
        } else {
            self.camera.axes.y_axis * -forward.y.signum()
        };
        (-level.x).atan2(-level.z)
    }

    fn axes(heading: f64, elevation: f64) -> DMat3 {
        DMat3::from_rotation_y(heading) * DMat3::from_rotation_x(elevation)
    }

    /// Turns to the left by `left` and upwards by `up` (radians).
    pub fn turn(&mut self, left: f64, up: f64) {
        let elevation = (self.elevation() + up).clamp(-STEEPEST, STEEPEST);
        self.camera.axes = Self::axes(self.heading() + left, elevation);
    }

    /// Goes round `pivot` while turning, so that it stays where it is in the picture.
    ///
    /// `left` and `up` (radians) say how the camera turns; it stays as far away as it is. Where the camera cannot
    /// turn any farther up or down it does not go round either.
    pub fn orbit(&mut self, pivot: DVec3, left: f64, up: f64) {
        let before = self.camera.axes;
        self.turn(left, up);
        let turned = self.camera.axes * before.transpose();
        self.camera.position = pivot + turned * (self.camera.position - pivot);
    }

    /// Moves by so many metres to the right, up (along y) and ahead.
    pub fn step(&mut self, right: f64, up: f64, ahead: f64) {
        let axes = self.camera.axes;
        self.camera.position += axes.x_axis * right + DVec3::Y * up - axes.z_axis * ahead;
    }

    /// Moves in the plane of the picture, so that a point at `distance` (m, along the view) follows a pointer that
    /// moves by `right` and `down` pixels in a picture of `height` pixels.
    pub fn pan(&mut self, right: f64, down: f64, height: f64, distance: f64) {
        let pixel = match self.camera.projection {
            Projection::Perspective(FieldOfView::Vertical(angle) | FieldOfView::Horizontal(angle)) => {
                2.0 * (0.5 * angle).tan() * distance.max(0.0) / height
            }
            Projection::Orthographic { height: metres } => metres / height,
        };
        let axes = self.camera.axes;
        self.camera.position += (axes.y_axis * down - axes.x_axis * right) * pixel;
    }

    /// Comes nearer to `pivot`, or goes away: the distance is multiplied by `factor`. Parallel rays show a part of
    /// the scene that is so much smaller instead.
    pub fn approach(&mut self, pivot: DVec3, factor: f64) {
        match &mut self.camera.projection {
            Projection::Perspective(_) => {
                self.camera.position = pivot + (self.camera.position - pivot) * factor;
            }
            Projection::Orthographic { height } => *height = (*height * factor).clamp(1e-6, 1e9),
        }
    }

    /// Opens the view by `factor`, within (0, π).
    pub fn widen(&mut self, factor: f64) {
        if let Projection::Perspective(FieldOfView::Vertical(angle) | FieldOfView::Horizontal(angle)) =
            &mut self.camera.projection
        {
            *angle = (*angle * factor).clamp(OPENING.0, OPENING.1);
        }
    }

    /// Looks through another camera.
    pub fn jump(&mut self, camera: Camera) {
        self.camera = camera;
    }
}

#[cfg(test)]
mod tests {
    use llsr_scene::Viewport;
    use proptest::prelude::*;

    use super::*;

    const VIEWPORT: Viewport = Viewport {
        width: 320,
        height: 200,
    };

    fn rig(eye: DVec3, target: DVec3) -> Rig {
        let angle = FieldOfView::vertical_degrees(50.0);
        Rig::new(Camera::look_at("start", eye, target, DVec3::Y, angle), 1.0)
    }

    fn vector() -> impl Strategy<Value = DVec3> {
        (-5.0..5.0, -5.0..5.0, -5.0..5.0).prop_map(DVec3::from)
    }

    fn upright(axes: DMat3) -> bool {
        let unit = (axes * axes.transpose() - DMat3::IDENTITY)
            .to_cols_array()
            .into_iter();
        unit.fold(0.0f64, |m, v| m.max(v.abs())) < 1e-9
            && axes.determinant() > 0.0
            && axes.x_axis.y.abs() < 1e-9
            && axes.y_axis.y > 0.0
    }

    proptest! {
        #[test]
        fn cameras_stay_upright(eye in vector(), target in vector(), turns in prop::collection::vec((-3.0..3.0, -3.0..3.0), 1..20)) {
            prop_assume!(eye.distance(target) > 0.1);
            let mut rig = rig(eye, target);
            for (left, up) in turns {
                rig.turn(left, up);
                prop_assert!(upright(rig.camera().axes), "axes {:?}", rig.camera().axes);
                prop_assert!(rig.elevation().abs() <= STEEPEST + 1e-9, "not over the top");
            }
        }

        #[test]
        fn turning_by_nothing_changes_nothing(eye in vector(), target in vector()) {
            prop_assume!((eye - target).with_y(0.0).length() > 0.2);
            let mut rig = rig(eye, target);
            let before = rig.camera().forward();
            rig.turn(0.0, 0.0);
            prop_assert!(before.distance(rig.camera().forward()) < 1e-9, "same view");
        }

        #[test]
        fn what_one_goes_round_stays_in_its_place(eye in vector(), target in vector(), pivot in vector(), left in -2.0..2.0, up in -0.5..0.5) {
            prop_assume!((eye - target).with_y(0.0).length() > 0.5);
            let mut rig = rig(eye, target);
            // A first turn sets the camera upright if it was too steep.
            rig.turn(0.0, 0.0);
            let before = rig.camera().project(VIEWPORT, pivot);
            prop_assume!(before.is_some_and(|(_, _, depth)| depth > 0.1));
            let (x, y, depth) = before.unwrap_or_default();
            rig.orbit(pivot, left, up);
            let after = rig.camera().project(VIEWPORT, pivot).unwrap_or_default();
            let apart = (x - after.0).abs() + (y - after.1).abs();
            prop_assert!(apart < 1e-5 * (1.0 + x.abs() + y.abs()), "{:?} {:?}", (x, y), after);
            prop_assert!((depth - after.2).abs() < 1e-9 * (1.0 + depth), "as far away");
        }

        #[test]
        fn coming_nearer_scales_the_distance(eye in vector(), target in vector(), factor in 0.1..3.0) {
            prop_assume!(eye.distance(target) > 0.1);
            let mut rig = rig(eye, target);
            rig.approach(target, factor);
            let distance = rig.camera().position.distance(target);
            prop_assert!((distance - factor * eye.distance(target)).abs() < 1e-9, "{distance}");
        }

        #[test]
        fn a_point_follows_the_pointer_that_pans(eye in vector(), right in -40.0..40.0, down in -40.0..40.0) {
            let target = eye + DVec3::new(1.0, -0.3, -4.0);
            let mut rig = rig(eye, target);
            let (x, y, depth) = rig.camera().project(VIEWPORT, target).unwrap_or_default();
            rig.pan(right, down, f64::from(VIEWPORT.height), depth);
            let after = rig.camera().project(VIEWPORT, target).unwrap_or_default();
            prop_assert!((after.0 - x - right).abs() < 1e-6 && (after.1 - y - down).abs() < 1e-6, "{after:?}");
        }
    }

    #[test]
    fn steps_go_where_they_say() {
        let mut rig = rig(DVec3::ZERO, DVec3::X);
        rig.step(0.0, 0.0, 2.0);
        assert!(
            rig.camera().position.distance(DVec3::X * 2.0) < 1e-12,
            "ahead is +x"
        );
        rig.step(1.0, 3.0, 0.0);
        let expected = DVec3::new(2.0, 3.0, 1.0);
        assert!(
            rig.camera().position.distance(expected) < 1e-12,
            "to the right is +z, up is +y"
        );
    }

    #[test]
    fn turning_left_is_to_the_left() {
        let mut rig = rig(DVec3::ZERO, -DVec3::Z);
        rig.turn(0.3, 0.2);
        let forward = rig.camera().forward();
        assert!(
            forward.x < -0.2 && forward.y > 0.15,
            "to the left and up: {forward}"
        );
    }

    #[test]
    fn a_view_from_straight_above_keeps_its_heading() {
        let camera = Camera {
            axes: DMat3::from_rotation_x(-std::f64::consts::FRAC_PI_2),
            ..rig(DVec3::ZERO, -DVec3::Z).camera().clone()
        };
        let mut rig = Rig::new(camera, 1.0);
        rig.turn(0.0, 0.5);
        let forward = rig.camera().forward();
        assert!(
            forward.z < -0.3 && forward.x.abs() < 1e-9,
            "looks along -z again: {forward}"
        );
    }

    #[test]
    fn the_view_stays_between_nothing_and_half_a_turn() {
        let mut rig = rig(DVec3::ZERO, -DVec3::Z);
        for factor in [100.0, 1e-9, f64::MAX] {
            rig.widen(factor);
            let angle = rig.camera().vertical_field_of_view(VIEWPORT).unwrap_or_default();
            assert!(angle > 0.0 && angle < std::f64::consts::PI, "{angle}");
        }
    }
}
