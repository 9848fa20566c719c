//! Shadows of analytic primitives on a line, by distances instead of roots.

use glam::DVec3;
use llsr_scene::{Geometry, Scene, Shape};

/// Places on the line from which the search for a shadow starts.
const STARTS: u32 = 64;

/// The stretches of the line `a`-`b`, in parameters from 0 to 1, that the scene's primitives hide from `p`: one at most for each,
/// unsorted, overlapping.
///
/// Spheres, cylinders and cones count as solid, discs as nothing, and `p` must not lie inside; objects must not be scaled. How far
/// a point lies outside a solid is a convex function of the point, so that its least value along a segment, as a function of the
/// place where the segment meets the line, falls and then rises: thirds close in on the least value of all, and halves on
/// where it passes zero. Ends are right to about 1e-7 where a segment grazes, and better elsewhere. Cost: a millisecond a
/// primitive.
pub fn primitive_shadows(scene: &Scene, p: DVec3, a: DVec3, b: DVec3) -> Vec<(f64, f64)> {
    scene
        .objects
        .iter()
        .filter_map(|object| {
            let Geometry::Primitive(primitive) = object.geometry else {
                return None;
            };
            let place = |v: glam::Vec3| object.transform.transform_point3(v).as_dvec3();
            match primitive.shape {
                Shape::Sphere { center, radius } => {
                    let center = place(center);
                    shadow(p, a, b, |x| (x - center).length() - f64::from(radius))
                }
                Shape::Cylinder {
                    a: foot,
                    b: head,
                    radius,
                    ..
                } => {
                    let (foot, head) = (place(foot), place(head));
                    shadow(p, a, b, |x| turned(foot, head, x, |_| f64::from(radius)))
                }
                Shape::Cone {
                    base, apex, radius, ..
                } => {
                    let (base, apex) = (place(base), place(apex));
                    shadow(p, a, b, |x| {
                        turned(base, apex, x, |h| f64::from(radius) * (1.0 - h))
                    })
                }
                Shape::Disc { .. } => None,
            }
        })
        .collect()
}

/// How far `x` lies outside a solid of revolution about `a`-`b`, whose radius is linear in the height from 0 at a to 1 at b.
fn turned(a: DVec3, b: DVec3, x: DVec3, radius: impl Fn(f64) -> f64) -> f64 {
    let axis = b - a;
    let length = axis.length();
    let h = (x - a).dot(axis) / (length * length);
    let mantle = (x - a - axis * h).length() - radius(h);
    mantle.max(-h * length).max((h - 1.0) * length)
}

/// Where a function that falls and then rises is least between `lo` and `hi`.
fn least(mut lo: f64, mut hi: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..70 {
        let (u, v) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if f(u) < f(v) {
            hi = v;
        } else {
            lo = u;
        }
    }
    0.5 * (lo + hi)
}

/// The stretch of `a`-`b` whose segments from `p` come to where `outside`, a convex function, is negative.
fn shadow(p: DVec3, a: DVec3, b: DVec3, outside: impl Fn(DVec3) -> f64) -> Option<(f64, f64)> {
    let clearance = |t: f64| {
        let way = a + (b - a) * t - p;
        let along = |s: f64| outside(p + way * s);
        // An end of the segment may be the nearest.
        along(least(0.0, 1.0, along)).min(along(0.0)).min(along(1.0))
    };
    let start = |i: u32| f64::from(i) / f64::from(STARTS);
    let (nearest, _) = (0..=STARTS)
        .map(|i| (i, clearance(start(i))))
        .min_by(|x, y| x.1.total_cmp(&y.1))?;
    let inside = least(
        start(nearest.saturating_sub(1)),
        start((nearest + 1).min(STARTS)),
        clearance,
    );
    let inside = [inside, start(nearest)]
        .into_iter()
        .find(|&t| clearance(t) < 0.0)?;
    let end = |mut free: f64| {
        if clearance(free) < 0.0 {
            return free;
        }
        let mut hidden = inside;
        for _ in 0..55 {
            let t = 0.5 * (free + hidden);
            if clearance(t) < 0.0 { hidden = t } else { free = t }
        }
        hidden
    };
    Some((end(0.0), end(1.0)))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use llsr_scene::{Material, Primitive};

    use super::*;

    #[test]
    fn shadows_of_a_sphere_and_a_cylinder_have_closed_forms() {
        let mut scene = Scene::new("two");
        let material = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        // Seen from the origin along z, the light at z = 4 along x; the shadow's edge is the tangent from the origin.
        let sphere = Shape::Sphere {
            center: Vec3::new(0.0, 0.0, 2.0),
            radius: 0.25,
        };
        scene.add_primitive(
            "sphere",
            Primitive {
                shape: sphere,
                material,
            },
        );
        let thin = Shape::Cylinder {
            a: Vec3::new(0.75, -1.0, 1.0),
            b: Vec3::new(0.75, 1.0, 1.0),
            radius: 0.001,
            capped: true,
        };
        scene.add_primitive(
            "cylinder",
            Primitive {
                shape: thin,
                material,
            },
        );
        let short = Shape::Cylinder {
            a: Vec3::new(-0.5, 0.5, 1.0),
            b: Vec3::new(-0.5, 1.0, 1.0),
            radius: 0.1,
            capped: true,
        };
        scene.add_primitive(
            "above",
            Primitive {
                shape: short,
                material,
            },
        );
        let (a, b) = (DVec3::new(-4.0, 0.0, 4.0), DVec3::new(4.0, 0.0, 4.0));
        let found = primitive_shadows(&scene, DVec3::ZERO, a, b);
        assert_eq!(found.len(), 2, "the short one stands above: {found:?}");
        let edge = 4.0 * (0.125f64).asin().tan();
        let middle = f64::atan2(0.75, 1.0);
        let half = (f64::from(0.001f32) / 1.25).asin();
        let expected = [
            (-edge, edge),
            (4.0 * (middle - half).tan(), 4.0 * (middle + half).tan()),
        ];
        for ((lo, hi), (from, to)) in found.into_iter().zip(expected) {
            let (lo, hi) = (-4.0 + 8.0 * lo, -4.0 + 8.0 * hi);
            assert!(
                (lo - from).abs() < 1e-9 && (hi - to).abs() < 1e-9,
                "{lo} to {hi}, not {from} to {to}"
            );
        }
    }
}
