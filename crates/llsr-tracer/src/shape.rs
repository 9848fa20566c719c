//! Analytic primitives in double precision.
//!
//! Every shape is an affine image of a canonical one: the unit sphere; the unit cylinder around z with 0 <= z <= 1; the
//! cone of unit base at z = 0 and tip at z = 1; the unit disc at z = 0. Rays and fans are mapped to the canonical
//! frame, which leaves ray and light parameters as they are.

use glam::{Affine3A, DAffine3, DMat3, DVec2, DVec3, Vec3};
use llsr_scene::{Bounds, ObjectId, Shape};

/// Which canonical surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Sphere,
    Cylinder { capped: bool },
    Cone { capped: bool },
    Disc,
}

/// A shape of the scene, placed.
#[derive(Clone, Debug)]
pub(crate) struct PlacedShape {
    kind: Kind,
    to_local: DAffine3,
    to_world: DAffine3,
    pub(crate) object: ObjectId,
    /// How much longer than the rounding of a coordinate an offset must be to be seen in the canonical frame.
    condition: f64,
}

/// A crossing of a ray with a canonical surface.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Crossing {
    t: f64,
    /// Canonical outward normal, not normalised.
    normal: DVec3,
    point: DVec3,
}

/// Up to four crossings, unsorted.
type Crossings = ([Option<Crossing>; 4], usize);

/// Tolerance with which the rims of mantles and caps overlap, in canonical units.
const RIM: f64 = 8.0 * f64::EPSILON;

/// A point of a shape met by a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapeHit {
    pub(crate) t: f64,
    pub(crate) position: DVec3,
    /// Unit, outwards.
    pub(crate) normal: DVec3,
    /// How far along the normal a point must be moved to be certainly on its side (m).
    pub(crate) offset: f64,
}

impl PlacedShape {
    /// Places `shape`; `None` if it or the transform has no extent or is not finite.
    pub(crate) fn new(shape: &Shape, transform: &Affine3A, object: ObjectId) -> Option<Self> {
        if !shape.is_valid() {
            return None;
        }
        let (kind, canonical) = match *shape {
            Shape::Sphere { center, radius } => (
                Kind::Sphere,
                DAffine3::from_mat3_translation(
                    DMat3::from_diagonal(DVec3::splat(f64::from(radius))),
                    center.as_dvec3(),
                ),
            ),
            Shape::Cylinder { a, b, radius, capped } => (Kind::Cylinder { capped }, along(a, b, radius)),
            Shape::Cone {
                base,
                apex,
                radius,
                capped,
            } => (Kind::Cone { capped }, along(base, apex, radius)),
            Shape::Disc {
                center,
                normal,
                radius,
            } => {
                let z = normal.as_dvec3().normalize();
                let (x, y) = z.any_orthonormal_pair();
                let r = f64::from(radius);
                let frame = DMat3::from_cols(x * r, y * r, z * r);
                (
                    Kind::Disc,
                    DAffine3::from_mat3_translation(frame, center.as_dvec3()),
                )
            }
        };
        let placed = DAffine3::from_mat3_translation(
            DMat3::from_cols(
                transform.matrix3.x_axis.as_dvec3(),
                transform.matrix3.y_axis.as_dvec3(),
                transform.matrix3.z_axis.as_dvec3(),
            ),
            transform.translation.as_dvec3(),
        );
        let to_world = placed * canonical;
        let to_local = to_world.inverse();
        let norm = |m: DMat3| {
            (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt()
        };
        let condition = norm(to_world.matrix3) * norm(to_local.matrix3);
        if !to_local.is_finite() || !to_world.is_finite() || !condition.is_finite() || condition > 1e12 {
            return None;
        }
        Some(Self {
            kind,
            to_local,
            to_world,
            object,
            condition,
        })
    }

    /// A box around the shape, rounded outwards.
    pub(crate) fn bounds(&self) -> Bounds {
        let m = self.to_world.matrix3;
        let at = self.to_world.translation;
        let disc = m.x_axis * m.x_axis + m.y_axis * m.y_axis;
        let disc = DVec3::new(disc.x.sqrt(), disc.y.sqrt(), disc.z.sqrt());
        let (min, max) = match self.kind {
            Kind::Sphere => {
                let ball = DVec3::new(m.row(0).length(), m.row(1).length(), m.row(2).length());
                (at - ball, at + ball)
            }
            Kind::Cylinder { .. } => {
                let end = at + m.z_axis;
                (at.min(end) - disc, at.max(end) + disc)
            }
            Kind::Cone { .. } => {
                let apex = at + m.z_axis;
                ((at - disc).min(apex), (at + disc).max(apex))
            }
            Kind::Disc => (at - disc, at + disc),
        };
        let slack = (min.abs().max(max.abs())) * 1e-12;
        Bounds {
            min: (min - slack).as_vec3().map(f32::next_down),
            max: (max + slack).as_vec3().map(f32::next_up),
        }
    }

    /// Does the open segment `p`-`q` cut the surface?
    pub(crate) fn cuts_segment(&self, p: DVec3, q: DVec3) -> bool {
        let o = self.localize(p);
        self.cuts_canonical(o, self.localize(q) - o)
    }

    /// Which canonical surface this is an image of.
    pub(crate) fn kind(&self) -> Kind {
        self.kind
    }

    /// A point of the scene in the canonical frame.
    pub(crate) fn localize(&self, p: DVec3) -> DVec3 {
        self.to_local.transform_point3(p)
    }

    /// Does the open segment from `o` to `o + d`, both in the canonical frame, cut the surface?
    pub(crate) fn cuts_canonical(&self, o: DVec3, d: DVec3) -> bool {
        let mut cut = Cut(false);
        self.cross(o, d, &mut cut);
        cut.0
    }

    /// The first crossing with 0 < t <= `t_max`.
    pub(crate) fn closest(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<ShapeHit> {
        let o = self.to_local.transform_point3(origin);
        let d = self.to_local.transform_vector3(direction);
        let (crossings, n) = self.crossings(o, d);
        let first = crossings[..n]
            .iter()
            .flatten()
            .filter(|crossing| crossing.t > 0.0 && crossing.t <= t_max)
            .min_by(|x, y| x.t.total_cmp(&y.t))?;
        let position = self.to_world.transform_point3(first.point);
        let normal = (self.to_local.matrix3.transpose() * first.normal).normalize_or_zero();
        let scale = position.abs().max_element() + self.to_world.translation.abs().max_element();
        Some(ShapeHit {
            t: first.t,
            position,
            normal,
            offset: 64.0 * f64::EPSILON * self.condition * scale.max(f64::MIN_POSITIVE),
        })
    }

    fn crossings(&self, o: DVec3, d: DVec3) -> Crossings {
        let mut found = Found::default();
        self.cross(o, d, &mut found);
        (found.crossings, found.count)
    }

    /// Hands all crossings of the line with the surface to `found`.
    #[inline(always)]
    fn cross(&self, o: DVec3, d: DVec3, found: &mut impl Crossed) {
        match self.kind {
            Kind::Sphere => {
                let a = d.length_squared();
                let c = (o.length() - 1.0) * (o.length() + 1.0);
                for t in quadratic(a, o.dot(d), c, a - o.cross(d).length_squared()) {
                    found.push(t, || {
                        let point = (o + d * t).normalize_or_zero();
                        (point, point)
                    });
                }
            }
            Kind::Cylinder { capped } => {
                let (o2, d2) = (o.truncate(), d.truncate());
                let a = d2.length_squared();
                let c = (o2.length() - 1.0) * (o2.length() + 1.0);
                let discriminant = a - o2.perp_dot(d2).powi(2);
                for t in quadratic(a, o2.dot(d2), c, discriminant) {
                    let z = o.z + d.z * t;
                    if (-RIM..=1.0 + RIM).contains(&z) {
                        found.push(t, || {
                            let r = (o2 + d2 * t).normalize_or_zero();
                            (r.extend(z), r.extend(0.0))
                        });
                    }
                }
                if capped {
                    cap(found, o, d, 0.0, -1.0);
                    cap(found, o, d, 1.0, 1.0);
                }
            }
            Kind::Cone { capped } => {
                // Radius 1 - z; h is the height below the tip.
                let (o2, d2) = (o.truncate(), d.truncate());
                let h = 1.0 - o.z;
                let a = d2.length_squared() - d.z * d.z;
                let b = o2.dot(d2) + h * d.z;
                let c = (o2.length() - h) * (o2.length() + h);
                // b^2 - ac, with the squares that cancel left out.
                let cross = o2.perp_dot(d2);
                let mixed = o2 * d.z + d2 * h;
                let discriminant = mixed.length_squared() - cross * cross;
                for t in quadratic(a, b, c, discriminant) {
                    let z = o.z + d.z * t;
                    if (-RIM..=1.0 + RIM).contains(&z) {
                        found.push(t, || {
                            let r = (o2 + d2 * t).normalize_or_zero();
                            ((r * (1.0 - z)).extend(z), r.extend(1.0))
                        });
                    }
                }
                if capped {
                    cap(found, o, d, 0.0, -1.0);
                }
            }
            Kind::Disc => cap(found, o, d, 0.0, 1.0),
        }
    }
}

/// The canonical frame of a shape around the axis from `a` to `b`.
fn along(a: Vec3, b: Vec3, radius: f32) -> DAffine3 {
    let (a, b) = (a.as_dvec3(), b.as_dvec3());
    let z = b - a;
    let (x, y) = z.normalize().any_orthonormal_pair();
    let r = f64::from(radius);
    DAffine3::from_mat3_translation(DMat3::from_cols(x * r, y * r, z), a)
}

/// What becomes of crossings. Points and normals are worked out only where they are wanted.
trait Crossed {
    fn push(&mut self, t: f64, point_and_normal: impl FnOnce() -> (DVec3, DVec3));
}

#[derive(Default)]
struct Found {
    crossings: [Option<Crossing>; 4],
    count: usize,
}

impl Crossed for Found {
    fn push(&mut self, t: f64, point_and_normal: impl FnOnce() -> (DVec3, DVec3)) {
        if let Some(slot) = self.crossings.get_mut(self.count) {
            let (point, normal) = point_and_normal();
            *slot = Some(Crossing { t, normal, point });
            self.count += 1;
        }
    }
}

/// Whether a crossing lies between the ends of the segment.
struct Cut(bool);

impl Crossed for Cut {
    #[inline(always)]
    fn push(&mut self, t: f64, _: impl FnOnce() -> (DVec3, DVec3)) {
        self.0 |= t > 0.0 && t < 1.0;
    }
}

/// Crosses the unit disc at height `z` whose outward normal is `up` times the z axis.
#[inline(always)]
fn cap(found: &mut impl Crossed, o: DVec3, d: DVec3, z: f64, up: f64) {
    let t = (z - o.z) / d.z;
    if d.z == 0.0 || !t.is_finite() {
        return;
    }
    let at: DVec2 = o.truncate() + d.truncate() * t;
    if at.length_squared() <= 1.0 + RIM {
        found.push(t, || (at.extend(z), DVec3::new(0.0, 0.0, up)));
    }
}

/// The roots of a t^2 + 2 b t + c for a given positive discriminant b^2 - a c; a tangent has none.
fn quadratic(a: f64, b: f64, c: f64, discriminant: f64) -> impl Iterator<Item = f64> {
    let root = discriminant.max(0.0).sqrt();
    // The sum without cancellation; the other root from the product of both.
    let q = -(b + root.copysign(b));
    let roots = if discriminant > 0.0 {
        [q / a, c / q]
    } else {
        [f64::NAN; 2]
    };
    roots.into_iter().filter(|t| t.is_finite())
}
