//! Outlines of analytic primitives: where they turn away from the viewer, and their rims.

use std::f64::consts::{PI, TAU};

use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec3};
use llsr_scene::{Camera, Projection, Shape};

use super::{EdgeClass, double};

/// Where a scene is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Eye {
    /// From a point (m, recentred frame).
    At(DVec3),
    /// From infinitely far away in this direction (towards the viewer; any length but 0).
    Towards(DVec3),
}

impl Eye {
    /// Where a camera looks from.
    pub fn of(camera: &Camera) -> Self {
        match camera.projection {
            Projection::Perspective(_) => Self::At(camera.position),
            Projection::Orthographic { .. } => Self::Towards(-camera.forward()),
        }
    }
}

/// Chords or tangents that stand for a circle of `radius_pixels` in a picture and leave it by at most 1/20 of a pixel; 16 to
/// 1024.
pub fn outline_chords(radius_pixels: f64) -> u32 {
    // The sagitta of a chord over the angle 2 pi / n is r (1 - cos(pi / n)), about r pi^2 / (2 n^2); so far outside do two
    // tangents meet, too.
    let wanted = PI * (radius_pixels.max(0.0) / (2.0 * SAGITTA)).sqrt();
    wanted.clamp(16.0, 1024.0).ceil() as u32
}

/// Largest distance between a curve and its chords in pixels.
const SAGITTA: f64 = 0.05;

/// Calls `piece` with the segments (m, recentred frame) of the contour and the rims of a placed shape, chain by chain.
///
/// The contour is a silhouette. The rim of a capped mantle is a silhouette where one side of it faces the viewer and a
/// crease where both do, if the angle there is above `crease_degrees`; where both face away it is left out. Rims of
/// uncapped mantles and of discs are boundaries.
///
/// Curves are replaced by tangents, not by chords: a viewer sees these beside the shape, while chords of a contour lie
/// inside and would be hidden by the very surface whose contour they are. For the same reason all is drawn a few roundings
/// (at least 2^-20 of the radius) outside. The second argument of `piece` numbers the curve: 0 and 1 for the
/// contour's lines (0 for that of a sphere), 2 for the rim at the first end or the only one, 3 for that at the second.
/// Chains that meet do so in bitwise equal points. A full circle has `chords` tangents, an arc a share of them and one more.
/// There is nothing for a shape or transform that is not valid. Allocates nothing.
pub fn outline(
    shape: &Shape,
    transform: &Affine3A,
    eye: Eye,
    chords: u32,
    crease_degrees: f64,
    piece: impl FnMut(EdgeClass, u32, [Vec3; 2]),
) {
    if !shape.is_valid() {
        return;
    }
    let to_world = double(transform) * canonical_frame(shape);
    let to_local = to_world.inverse();
    if !to_local.is_finite() {
        return;
    }
    // Ends are rounded to single precision where they are in the scene.
    let columns = to_world.matrix3.to_cols_array_2d().map(DVec3::from_array);
    let lengths = columns.map(DVec3::length);
    let reach = to_world.translation.length() + lengths[0].max(lengths[1]).max(lengths[2]);
    let outside = (f64::from(f32::EPSILON) * 2.0 * reach / lengths[0].min(lengths[1])).clamp(1e-6, 1e-3);
    let mut curve = Curve {
        to_world,
        chords: f64::from(chords.max(3)),
        outside: 1.0 + outside,
        piece,
    };
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
                let circle = Circle {
                    centre: normal * offset,
                    x: x * r,
                    y: y * r,
                };
                curve.circle(EdgeClass::Silhouette, 0, &circle);
            }
        }
        Shape::Cylinder { capped, .. } => {
            let front = Front::new(e, w);
            curve.sides(&front, |foot| foot + DVec3::Z);
            let crease = crease_degrees < 90.0;
            curve.rim(2, 0.0, &front, capped.then_some(e.z < 0.0), crease);
            curve.rim(3, 1.0, &front, capped.then_some(e.z > w), crease);
        }
        Shape::Cone {
            base,
            apex,
            radius,
            capped,
        } => {
            // The outward normal at angle a is (cos a, sin a, 1), and all tangent planes hold the tip.
            let front = Front::new(e, w - e.z);
            let tip = DVec3::Z * curve.outside;
            curve.sides(&front, |_| tip);
            let slope = f64::from(radius).atan2(f64::from(base.distance(apex)));
            let crease = crease_degrees < 90.0 + slope.to_degrees();
            curve.rim(2, 0.0, &front, capped.then_some(e.z < 0.0), crease);
        }
        Shape::Disc { .. } => {
            curve.circle(EdgeClass::Boundary, 2, &Circle::at_height(0.0));
        }
    }
}

/// Maps a valid shape's canonical frame to its own: unit sphere; unit cylinder around z, 0 <= z <= 1; cone of unit base at
/// z = 0 with its tip at z = 1; unit disc.
fn canonical_frame(shape: &Shape) -> DAffine3 {
    let along = |a: Vec3, b: Vec3, radius: f32| {
        let (a, axis) = (a.as_dvec3(), (b - a).as_dvec3());
        let (x, y) = axis.normalize().any_orthonormal_pair();
        let r = f64::from(radius);
        DAffine3::from_mat3_translation(DMat3::from_cols(x * r, y * r, axis), a)
    };
    match *shape {
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
    }
}

/// Calls `piece` with short pieces of `segment` (m, recentred frame), moved onto the curved part of a placed shape's surface
/// near which it lies.
///
/// Lines on a primitive that were found on a mesh in its place pass above and below the true surface. The pieces span at
/// most 0.04 radians and lie just outside, by no more than 2^-12 of the radius. A segment on a flat part, a cap or a disc,
/// is handed on whole, and so is any if the shape or transform is not valid.
pub fn onto_surface(
    shape: &Shape,
    transform: &Affine3A,
    segment: [Vec3; 2],
    mut piece: impl FnMut([Vec3; 2]),
) {
    const SPAN: f64 = 0.04;
    const OUTSIDE: f64 = 1.0 + SPAN * SPAN / 8.0 + 1e-6;
    let to_world = match shape.is_valid() {
        true => double(transform) * canonical_frame(shape),
        false => DAffine3::ZERO,
    };
    let to_local = to_world.inverse();
    let [a, b] = segment.map(|p| to_local.transform_point3(p.as_dvec3()));
    // The factor that brings a point onto the mantle; none where the surface is flat.
    let scale = |p: DVec3| match shape {
        Shape::Sphere { .. } => Some(DVec3::splat(OUTSIDE / p.length())),
        Shape::Cylinder { .. } | Shape::Cone { .. } => {
            let radius = match shape {
                Shape::Cone { .. } => 1.0 - p.z,
                _ => 1.0,
            };
            let r = p.truncate().length();
            // A cap's points lie well inside the mantle, but for its rim.
            let on_mantle = (r - radius).abs() < 0.1 * radius;
            let factor = radius * OUTSIDE / r;
            on_mantle.then(|| DVec3::new(factor, factor, 1.0))
        }
        Shape::Disc { .. } => None,
    };
    let middle = 0.5 * (a + b);
    let curved = to_local.is_finite()
        && [a, b, middle]
            .iter()
            .all(|&p| scale(p).is_some_and(DVec3::is_finite));
    if !curved {
        piece(segment);
        return;
    }
    // A chord no deeper than half the radius is spread by a factor of two at most.
    let count = (2.0 * a.distance(b) / SPAN).ceil().clamp(1.0, 1e3) as u32;
    let at = |i: u32| {
        let p = a + (b - a) * (f64::from(i) / f64::from(count));
        let moved = scale(p).map_or(p, |scale| p * scale);
        to_world.transform_point3(moved).as_vec3()
    };
    let mut before = at(0);
    for i in 1..=count {
        let next = at(i);
        piece([before, next]);
        before = next;
    }
}

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

    /// Where the mantle turns away, if it does.
    fn ends(&self) -> Option<[f64; 2]> {
        (self.half > 0.0 && self.half < PI).then_some([self.middle - self.half, self.middle + self.half])
    }
}

/// `centre + cos(a) x + sin(a) y`.
struct Circle {
    centre: DVec3,
    x: DVec3,
    y: DVec3,
}

impl Circle {
    /// The unit circle around z.
    fn at_height(z: f64) -> Self {
        Self {
            centre: DVec3::Z * z,
            x: DVec3::X,
            y: DVec3::Y,
        }
    }

    /// The point at an angle, `scale` times as far from the centre as the circle.
    fn at(&self, angle: f64, scale: f64) -> DVec3 {
        self.centre + (self.x * angle.cos() + self.y * angle.sin()) * scale
    }
}

struct Curve<F> {
    to_world: DAffine3,
    /// Segments of a full circle.
    chords: f64,
    /// Factor by which everything is drawn too large.
    outside: f64,
    piece: F,
}

impl<F: FnMut(EdgeClass, u32, [Vec3; 2])> Curve<F> {
    fn world(&self, p: DVec3) -> Vec3 {
        self.to_world.transform_point3(p).as_vec3()
    }

    /// The lines along which a mantle turns away, from the unit circle to `top` of their foot.
    fn sides(&mut self, front: &Front, top: impl Fn(DVec3) -> DVec3) {
        let base = Circle::at_height(0.0);
        for (number, angle) in (0..).zip(front.ends().into_iter().flatten()) {
            let foot = base.at(angle, self.outside);
            let ends = [self.world(foot), self.world(top(foot))];
            (self.piece)(EdgeClass::Silhouette, number, ends);
        }
    }

    /// A whole circle as a polygon around it.
    fn circle(&mut self, class: EdgeClass, number: u32, circle: &Circle) {
        let count = self.chords as u32;
        let scale = self.outside / (PI / f64::from(count)).cos();
        let corner = |i: u32| circle.at(TAU * f64::from(i % count) / f64::from(count), scale);
        let mut before = self.world(corner(0));
        for i in 1..=count {
            let next = self.world(corner(i));
            (self.piece)(class, number, [before, next]);
            before = next;
        }
    }

    /// The arc over the angles from `from` to `to` as tangents, ending exactly where the angle `last`, which is `to` up to
    /// full turns, is.
    fn arc(&mut self, class: EdgeClass, number: u32, circle: &Circle, from: f64, to: f64, last: f64) {
        // Tangents touch at both ends and at `count` - 1 points between.
        let count = ((to - from) / TAU * self.chords).ceil().max(1.0) as u32;
        let step = (to - from) / f64::from(count);
        let scale = self.outside / (0.5 * step).cos();
        let mut before = self.world(circle.at(from, self.outside));
        for i in 0..=count {
            let next = if i == count {
                circle.at(last, self.outside)
            } else {
                circle.at(from + step * (f64::from(i) + 0.5), scale)
            };
            let next = self.world(next);
            (self.piece)(class, number, [before, next]);
            before = next;
        }
    }

    /// The unit circle at height `z`, between a mantle and a cap that faces the viewer or not, or without a cap.
    fn rim(&mut self, number: u32, z: f64, front: &Front, cap: Option<bool>, crease: bool) {
        let circle = Circle::at_height(z);
        let class = |mantle: bool| match cap {
            None => Some(EdgeClass::Boundary),
            Some(cap) if cap != mantle => Some(EdgeClass::Silhouette),
            Some(true) if crease => Some(EdgeClass::Crease),
            Some(_) => None,
        };
        let Some([start, end]) = front.ends() else {
            if let Some(class) = class(front.half > 0.0) {
                self.circle(class, number, &circle);
            }
            return;
        };
        if let Some(class) = class(true) {
            self.arc(class, number, &circle, start, end, end);
        }
        if let Some(class) = class(false) {
            self.arc(class, number, &circle, end, start + TAU, start);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(shape: Shape, eye: Eye) -> Vec<[Vec3; 2]> {
        let mut out = Vec::new();
        let chords = outline_chords(100.0);
        outline(&shape, &Affine3A::IDENTITY, eye, chords, 85.0, |_, _, segment| {
            out.push(segment)
        });
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
                assert!(
                    (1.0..1.01).contains(&normal.length()),
                    "{p} just outside the sphere"
                );
                assert!(normal.dot((eye - p).normalize()).abs() < 1e-2, "{p} seen edge-on");
            }
            // The tangent's middle touches, and no ray to it meets the sphere.
            let (a, b) = (a.as_dvec3() - center.as_dvec3(), b.as_dvec3() - center.as_dvec3());
            let middle = (a + b) * 0.5;
            assert!(
                (middle.length() / f64::from(radius) - 1.0).abs() < 1e-5,
                "{middle} touches"
            );
            let eye = eye - center.as_dvec3();
            for t in [0.0, 0.2, 0.5, 0.9] {
                let ray = a + (b - a) * t - eye;
                let nearest = eye + ray * (-eye.dot(ray) / ray.length_squared());
                assert!(nearest.length() > f64::from(radius), "a ray past {nearest}");
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
            out.iter().filter(|[_, b]| b.distance(Vec3::Z) < 1e-5).count()
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
    fn lines_are_moved_onto_curved_surfaces() {
        let transform = Affine3A::from_scale_rotation_translation(
            Vec3::splat(2.0),
            glam::Quat::from_rotation_x(0.3),
            Vec3::new(3.0, 0.0, 1.0),
        );
        let sphere = Shape::Sphere {
            center: Vec3::ZERO,
            radius: 0.5,
        };
        let world = |p: Vec3| transform.transform_point3(p);
        let chord = [world(Vec3::X * 0.49), world(Vec3::new(0.3, 0.41, 0.0))];
        let mut pieces = Vec::new();
        onto_surface(&sphere, &transform, chord, |piece| pieces.push(piece));
        assert!(pieces.len() > 10, "{} pieces", pieces.len());
        assert!(pieces.windows(2).all(|pair| pair[0][1] == pair[1][0]), "a chain");
        for [a, b] in pieces {
            for p in [a, 0.5 * (a + b), b] {
                let out = p.distance(world(Vec3::ZERO));
                assert!((1.0..1.0003).contains(&out), "{p} is {out} from the centre");
            }
        }
        let drum = Shape::Cylinder {
            a: Vec3::ZERO,
            b: Vec3::Y,
            radius: 1.0,
            capped: true,
        };
        let on_cap = [Vec3::Y, Vec3::new(0.5, 1.0, 0.0)];
        let mut pieces = Vec::new();
        onto_surface(&drum, &Affine3A::IDENTITY, on_cap, |piece| pieces.push(piece));
        assert_eq!(pieces, [on_cap], "flat parts stay");
        let along = [Vec3::new(0.98, 0.1, 0.0), Vec3::new(0.98, 0.9, 0.0)];
        pieces.clear();
        onto_surface(&drum, &Affine3A::IDENTITY, along, |piece| pieces.push(piece));
        assert!(
            pieces.iter().flatten().all(|p| (1.0..1.001).contains(&p.x)),
            "{pieces:?}"
        );
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
        outline(
            &sphere,
            &flat,
            Eye::At(DVec3::Z * 3.0),
            16,
            85.0,
            |_, _, segment| out.push(segment),
        );
        assert!(out.is_empty(), "squashed to nothing: {out:?}");
    }
}
