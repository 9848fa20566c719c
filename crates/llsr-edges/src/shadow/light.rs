//! Lights as shadow events see them: corners and sides.

use std::f64::consts::TAU;

use glam::DVec3;
use llsr_scene::{AreaShape, Light};

/// Corners of the polygon that stands for a disc light.
///
/// Its radius is chosen so that it is as often inside as outside the circle: at most 0.25% of the radius apart.
const DISC_CORNERS: u32 = 32;

/// A light reduced to a point, a segment or a convex polygon.
///
/// Tubes with a radius are taken as their axes.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadowLight {
    corners: Vec<DVec3>,
    /// Of a light that emits to one side: unit normal and offset of its plane.
    emits: Option<(DVec3, f64)>,
}

impl ShadowLight {
    /// The corners and sides of `light`; coordinates that are not finite give a light without corners, which casts no
    /// shadow.
    pub fn new(light: &Light) -> Self {
        let (mut corners, normal) = match light {
            Light::Point(light) => (vec![light.position], None),
            Light::Linear(light) => (vec![light.a, light.b], None),
            Light::Area(light) => match light.shape {
                AreaShape::Rect {
                    corner,
                    along,
                    across,
                } => (
                    vec![corner, corner + along, corner + along + across, corner + across],
                    along.cross(across).try_normalize(),
                ),
                AreaShape::Disc {
                    center,
                    normal,
                    radius,
                } => {
                    let (u, v) = normal.any_orthonormal_pair();
                    let half = 0.5 * TAU / f64::from(DISC_CORNERS);
                    let out = radius / (0.5 * (1.0 + half.cos()));
                    let corner = |i: u32| {
                        let (sin, cos) = (TAU * f64::from(i) / f64::from(DISC_CORNERS)).sin_cos();
                        center + out * (cos * u + sin * v)
                    };
                    ((0..DISC_CORNERS).map(corner).collect(), Some(normal))
                }
            },
        };
        if corners.iter().all(|p| p.is_finite()) {
            corners.dedup();
            if corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
        } else {
            corners.clear();
        }
        let emits = match (corners.first(), normal) {
            (Some(&corner), Some(normal)) if corners.len() > 2 => Some((normal, normal.dot(corner))),
            _ => None,
        };
        Self { corners, emits }
    }

    /// The corners (m): one of a point, two of a line, three or more around a polygon.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners
    }

    /// Number of sides: none of a point, one of a line.
    pub fn sides(&self) -> usize {
        match self.corners.len() {
            0 | 1 => 0,
            2 => 1,
            n => n,
        }
    }

    /// The ends of a side.
    ///
    /// # Panics
    /// If there is no such side.
    pub fn side(&self, side: usize) -> [DVec3; 2] {
        let ends = [side, (side + 1) % self.corners.len()];
        ends.map(|i| self.corners[i])
    }

    /// The corners beside a corner.
    pub(super) fn neighbors(&self, corner: usize) -> impl Iterator<Item = DVec3> {
        let n = self.corners.len();
        let both = match n {
            0 | 1 => [None, None],
            2 => [Some(1 - corner), None],
            _ => [Some((corner + n - 1) % n), Some((corner + 1) % n)],
        };
        both.into_iter().flatten().map(|i| self.corners[i])
    }

    /// A corner of a polygon that is on no end of `side`.
    pub(super) fn opposite(&self, side: usize) -> Option<DVec3> {
        let n = self.corners.len();
        (n > 2).then(|| self.corners[(side + 2) % n])
    }

    /// False for points behind the plane of a light that emits to one side.
    pub(super) fn reaches(&self, p: DVec3) -> bool {
        self.emits.is_none_or(|(normal, offset)| normal.dot(p) > offset)
    }
}

#[cfg(test)]
mod tests {
    use llsr_scene::{AreaLight, LinearLight, PointLight};

    use super::*;

    fn area(shape: AreaShape) -> ShadowLight {
        ShadowLight::new(&Light::Area(AreaLight {
            name: String::new(),
            shape,
            flux: 1.0,
            color: glam::Vec3::ONE,
        }))
    }

    #[test]
    fn lights_become_points_lines_and_polygons() {
        let line = ShadowLight::new(&LinearLight::new("", DVec3::X, DVec3::Y, 1.0).into());
        assert_eq!((line.corners().len(), line.sides()), (2, 1), "a line");
        assert_eq!(line.neighbors(1).collect::<Vec<_>>(), [DVec3::X], "the other end");
        let short = ShadowLight::new(&LinearLight::new("", DVec3::X, DVec3::X, 1.0).into());
        assert_eq!((short.corners().len(), short.sides()), (1, 0), "no length");
        let lost = ShadowLight::new(&LinearLight::new("", DVec3::X, DVec3::NAN, 1.0).into());
        assert_eq!((lost.corners().len(), lost.sides()), (0, 0), "nowhere");
        let point = PointLight {
            name: String::new(),
            position: DVec3::Z,
            flux: 1.0,
            color: glam::Vec3::ONE,
        };
        assert_eq!(ShadowLight::new(&point.into()).corners(), [DVec3::Z], "a point");
        let rect = area(AreaShape::Rect {
            corner: DVec3::Y,
            along: DVec3::X,
            across: DVec3::Z,
        });
        assert_eq!((rect.corners().len(), rect.sides()), (4, 4), "a rectangle");
        assert!(
            rect.reaches(DVec3::ZERO) && !rect.reaches(2.0 * DVec3::Y),
            "emits downwards"
        );
        let flat = area(AreaShape::Rect {
            corner: DVec3::Y,
            along: DVec3::X,
            across: DVec3::ZERO,
        });
        assert_eq!(
            (flat.corners().len(), flat.sides()),
            (2, 1),
            "a rectangle without width"
        );
        let disc = area(AreaShape::Disc {
            center: DVec3::Y,
            normal: DVec3::Y,
            radius: 2.0,
        });
        for side in 0..disc.sides() {
            let [a, b] = disc.side(side).map(|p| p - DVec3::Y);
            let (far, near) = (a.length() - 2.0, 2.0 - (0.5 * (a + b)).length());
            assert!(
                (far - near).abs() < 1e-12 && far < 0.005,
                "{far} outside, {near} inside"
            );
        }
    }
}
