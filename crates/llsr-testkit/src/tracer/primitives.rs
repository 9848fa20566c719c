//! Segments against analytic primitives, by distances instead of roots.

use glam::DVec3;
use llsr_scene::{Geometry, Scene, Shape};

/// Does the segment `p`-`q` come into a solid primitive of the scene? Spheres, cylinders and cones count as solid, discs
/// as nothing; objects must not be scaled. Not exact: within about 1e-7 of the size of a shape either answer is possible.
pub fn segment_enters_primitive(scene: &Scene, p: DVec3, q: DVec3) -> bool {
    scene.objects.iter().any(|object| {
        let Geometry::Primitive(primitive) = object.geometry else {
            return false;
        };
        let place = |v: glam::Vec3| object.transform.transform_point3(v).as_dvec3();
        match primitive.shape {
            Shape::Sphere { center, radius } => {
                nearest_to_axis(p - place(center), q - place(center)) < f64::from(radius)
            }
            Shape::Cylinder { a, b, radius, .. } => solid(place(a), place(b), p, q, |_| f64::from(radius)),
            Shape::Cone {
                base, apex, radius, ..
            } => solid(place(base), place(apex), p, q, |h| f64::from(radius) * (1.0 - h)),
            Shape::Disc { .. } => false,
        }
    })
}

/// Least distance of the segment `u`-`v` from the origin.
fn nearest_to_axis(u: DVec3, v: DVec3) -> f64 {
    let way = v - u;
    let t = (-u.dot(way) / way.length_squared()).clamp(0.0, 1.0);
    (u + way * t).length()
}

/// A solid of revolution about `a`-`b`, whose radius is linear in the height h from 0 at a to 1 at b.
fn solid(a: DVec3, b: DVec3, p: DVec3, q: DVec3, radius: impl Fn(f64) -> f64) -> bool {
    let axis = b - a;
    let height = |x: DVec3| (x - a).dot(axis) / axis.length_squared();
    let (hp, hq) = (height(p), height(q));
    // The part of the segment between the two planes.
    let crossing = |h: f64| (h - hp) / (hq - hp);
    let (mut first, mut last) = (0f64, 1f64);
    if hp == hq {
        if !(0.0..=1.0).contains(&hp) {
            return false;
        }
    } else {
        let (x, y) = (crossing(0.0), crossing(1.0));
        first = first.max(x.min(y));
        last = last.min(x.max(y));
        if first >= last {
            return false;
        }
    }
    // How far outside the mantle a point lies is convex along a segment: thirds close in on its least value.
    let outside = |s: f64| {
        let x = p + (q - p) * s;
        let h = height(x);
        (x - a - axis * h).length() - radius(h)
    };
    for _ in 0..80 {
        let (s, t) = (first + (last - first) / 3.0, last - (last - first) / 3.0);
        if outside(s) < outside(t) {
            last = t;
        } else {
            first = s;
        }
    }
    outside(0.5 * (first + last)) < 0.0
}
