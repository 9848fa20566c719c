//! Outlines of analytic primitives: where they turn away from the viewer, and their rims.

use std::f64::consts::{PI, TAU};

use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec3};
use llsr_scene::Shape;

/// Where a picture is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Eye {
    /// From a point (m, recentred frame).
    At(DVec3),
    /// From infinitely far away in this direction (towards the viewer).
    Towards(DVec3),
}

/// Appends to `out` the contour and the rims of a placed shape as chains of segments (m, recentred frame).
///
/// `radius_pixels` is the largest radius in pixels that the shape may have in the picture; chords then leave the true
/// curve by at most 1/20 of a pixel. Rims of which both sides face away are left out. Nothing is appended for a shape or
/// transform that is not valid.
pub fn outline(shape: &Shape, transform: &Affine3A, eye: Eye, radius_pixels: f64, out: &mut Vec<[Vec3; 2]>) {
    if !shape.is_valid() {
        return;
    }
    let placed = DAffine3::from_mat3_translation(
        DMat3::from_cols(
            transform.matrix3.x_axis.as_dvec3(),
            transform.matrix3.y_axis.as_dvec3(),
            transform.matrix3.z_axis.as_dvec3(),
        ),
        transform.translation.as_dvec3(),
    );
    // The sagitta of a chord over the angle 2 pi / n is r (1 - cos(pi / n)), about r pi^2 / (2 n^2).
    let wanted = PI * (radius_pixels.max(0.0) / (2.0 * SAGITTA)).sqrt();
    let mut curve = Curve {
        to_world: DAffine3::IDENTITY,
        segments: wanted.clamp(16.0, 1024.0),
        out,
    };
    // Canonical frames: unit sphere; unit cylinder around z, 0 <= z <= 1; cone of unit base at z = 0 with its tip at
    // z = 1; unit disc.
    let along = |a: Vec3, b: Vec3, radius: f32| {
        let (a, axis) = (a.as_dvec3(), (b - a).as_dvec3());
        let (x, y) = axis.normalize().any_orthonormal_pair();
        let r = f64::from(radius);
        DAffine3::from_mat3_translation(DMat3::from_cols(x * r, y * r, axis), a)
    };
    let frame = match *shape {
        Shape::Sphere { center, radius } => DAffine3::from_mat3_translation(
            DMat3::from_diagonal(DVec3::splat(f64::from(radius))),
            center.as_dvec3(),
        ),
        Shape::Cylinder { a, b, radius, .. } => along(a, b, radius),
        Shape::Cone {
            base, apex, radius, ..
        } => along(base, apex, radius),
        Shape::Disc {
            center,
            normal,
            radius,
        } => along(center, center + normal, radius),
    };
    curve.to_world = placed * frame;
    let to_local = curve.to_world.inverse();
    if !to_local.is_finite() {
        return;
    }
    // The viewer as a homogeneous point: (e, w).
    let (e, w) = match eye {
        Eye::At(position) => (to_local.transform_point3(position), 1.0),
        Eye::Towards(direction) => (to_local.transform_vector3(direction), 0.0),
    };
    match *shape {
        Shape::Sphere { .. } => {
            // Points p with |p| = 1 whose tangent plane holds the viewer: p . e = w.
            let distance = e.length();
            if distance > w {
                let normal = e / distance;
                let offset = w / distance;
                let (x, y) = normal.any_orthonormal_pair();
                let r = (1.0 - offset * offset).sqrt();
                curve.arc(normal * offset, x * r, y * r, 0.0, TAU);
            }
        }
        Shape::Cylinder { capped, .. } => {
            let front = Front::new(e, w);
            for angle in front.ends() {
                let foot = DVec3::new(angle.cos(), angle.sin(), 0.0);
                curve.line(foot, foot + DVec3::Z);
            }
            curve.rim(0.0, &front, !capped || e.z < 0.0);
            curve.rim(1.0, &front, !capped || e.z > w);
        }
        Shape::Cone { capped, .. } => {
            // The outward normal at angle a is (cos a, sin a, 1), and all tangent planes hold the tip.
            let front = Front::new(e, w - e.z);
            for angle in front.ends() {
                curve.line(DVec3::new(angle.cos(), angle.sin(), 0.0), DVec3::Z);
            }
            curve.rim(0.0, &front, !capped || e.z < 0.0);
        }
        Shape::Disc { .. } => curve.arc(DVec3::ZERO, DVec3::X, DVec3::Y, 0.0, TAU),
    }
}

/// Largest distance between a curve and its chords in pixels.
const SAGITTA: f64 = 0.05;

/// The part of a mantle that faces the viewer: angles within `half` of `middle`.
struct Front {
    middle: f64,
    half: f64,
}

impl Front {
    /// Angles a with cos(a) e.x + sin(a) e.y > least.
    fn new(e: DVec3, least: f64) -> Self {
        let radius = e.x.hypot(e.y);
        let half = if least >= radius {
            0.0
        } else if least <= -radius {
            PI
        } else {
            (least / radius).acos()
        };
        Self {
            middle: e.y.atan2(e.x),
            half,
        }
    }

    /// Where the mantle turns away.
    fn ends(&self) -> impl Iterator<Item = f64> {
        let both = self.half > 0.0 && self.half < PI;
        [self.middle - self.half, self.middle + self.half]
            .into_iter()
            .filter(move |_| both)
    }
}

struct Curve<'a> {
    to_world: DAffine3,
    /// Segments of a full circle.
    segments: f64,
    out: &'a mut Vec<[Vec3; 2]>,
}

impl Curve<'_> {
    fn line(&mut self, a: DVec3, b: DVec3) {
        self.out
            .push([a, b].map(|p| self.to_world.transform_point3(p).as_vec3()));
    }

    /// `centre + cos(a) x + sin(a) y` for a from `from` to `to`; pieces share their ends exactly.
    fn arc(&mut self, centre: DVec3, x: DVec3, y: DVec3, from: f64, to: f64) {
        let count = ((to - from) / TAU * self.segments).ceil().max(1.0) as u32;
        let closed = to - from >= TAU;
        let at = |i: u32| {
            let i = if closed && i == count { 0 } else { i };
            let angle = from + (to - from) * f64::from(i) / f64::from(count);
            self.to_world
                .transform_point3(centre + x * angle.cos() + y * angle.sin())
                .as_vec3()
        };
        let points: Vec<Vec3> = (0..=count).map(at).collect();
        self.out.extend(points.windows(2).map(|pair| [pair[0], pair[1]]));
    }

    /// The unit circle at height `z`: all of it, or what belongs to the mantle's front.
    fn rim(&mut self, z: f64, front: &Front, whole: bool) {
        let centre = DVec3::Z * z;
        if whole || front.half >= PI {
            self.arc(centre, DVec3::X, DVec3::Y, 0.0, TAU);
        } else if front.half > 0.0 {
            let (from, to) = (front.middle - front.half, front.middle + front.half);
            self.arc(centre, DVec3::X, DVec3::Y, from, to);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(shape: Shape, eye: Eye) -> Vec<[Vec3; 2]> {
        let mut out = Vec::new();
        outline(&shape, &Affine3A::IDENTITY, eye, 100.0, &mut out);
        out
    }

    #[test]
    fn the_contour_of_a_sphere_is_where_rays_graze_it() {
        let (center, radius) = (Vec3::new(1.0, 2.0, 3.0), 0.5);
        let eye = DVec3::new(4.0, 2.5, 3.0);
        let out = found(Shape::Sphere { center, radius }, Eye::At(eye));
        assert!(out.len() >= 16, "a closed chain, not {}", out.len());
        for [a, b] in out {
            for p in [a, b].map(Vec3::as_dvec3) {
                let normal = (p - center.as_dvec3()) / f64::from(radius);
                assert!((normal.length() - 1.0).abs() < 1e-5, "{p} on the sphere");
                assert!(normal.dot((eye - p).normalize()).abs() < 1e-5, "{p} seen edge-on");
            }
        }
        let inside = found(Shape::Sphere { center, radius }, Eye::At(center.as_dvec3()));
        assert!(inside.is_empty(), "no contour from inside: {inside:?}");
    }

    #[test]
    fn a_cylinder_shows_two_lines_and_the_rims_that_can_be_seen() {
        let shape = |capped| Shape::Cylinder {
            a: Vec3::ZERO,
            b: Vec3::Y * 2.0,
            radius: 0.5,
            capped,
        };
        let lines = |out: &[[Vec3; 2]]| out.iter().filter(|[a, b]| (a.y - b.y).abs() > 1.0).count();
        let at = |out: &[[Vec3; 2]], y: f32| {
            let rim = out.iter().filter(|[a, b]| a.y == y && b.y == y);
            rim.map(|[a, b]| f64::from(a.distance(*b))).sum::<f64>()
        };
        let eye = Eye::At(DVec3::new(0.0, 5.0, 1.0));
        let closed = found(shape(true), eye);
        assert_eq!(lines(&closed), 2, "contour lines");
        assert!((at(&closed, 2.0) - PI).abs() < 0.02, "the whole upper rim");
        // Of the lower rim the front: half angle acos(0.5 / 1).
        assert!(
            (at(&closed, 0.0) - PI / 3.0).abs() < 0.02,
            "a third of the lower rim"
        );
        let open = found(shape(false), eye);
        assert!((at(&open, 0.0) - PI).abs() < 0.02, "all of an open rim");
        let along = found(shape(true), Eye::At(DVec3::new(0.1, 5.0, 0.1)));
        assert_eq!(lines(&along), 0, "from above the mantle is not seen");
        assert_eq!(at(&along, 0.0), 0.0, "nor the lower rim");
        let parallel = found(shape(true), Eye::Towards(DVec3::X));
        assert_eq!(lines(&parallel), 2, "parallel rays graze two lines");
    }

    #[test]
    fn a_cone_seen_from_its_tip_has_no_contour_lines() {
        let cone = Shape::Cone {
            base: Vec3::ZERO,
            apex: Vec3::Z,
            radius: 0.5,
            capped: true,
        };
        let lines = |eye| {
            let out = found(cone, eye);
            out.iter().filter(|[_, b]| *b == Vec3::Z).count()
        };
        assert_eq!(lines(Eye::At(DVec3::Z * 4.0)), 0, "the whole mantle is in front");
        assert_eq!(
            lines(Eye::At(DVec3::NEG_Z * 4.0)),
            0,
            "the whole mantle is behind"
        );
        assert_eq!(lines(Eye::At(DVec3::X * 4.0)), 2, "from the side");
    }

    #[test]
    fn what_is_not_valid_has_no_outline() {
        let disc = Shape::Disc {
            center: Vec3::ZERO,
            normal: Vec3::ZERO,
            radius: 1.0,
        };
        assert!(found(disc, Eye::At(DVec3::Z)).is_empty(), "no normal");
        let sphere = Shape::Sphere {
            center: Vec3::ZERO,
            radius: 1.0,
        };
        let mut out = Vec::new();
        let flat = Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0));
        outline(&sphere, &flat, Eye::At(DVec3::Z * 3.0), 10.0, &mut out);
        assert!(out.is_empty(), "squashed to nothing: {out:?}");
    }
}
