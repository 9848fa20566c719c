//! Which points a moving object puts in doubt: those from which it was or is in the way of a light.

use glam::Vec3;
use llsr_scene::{AreaShape, Bounds, Light};

/// A light as far as shadows reach: everything of it lies within `spread` of the segment a-b (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightSpan {
    pub(crate) a: Vec3,
    pub(crate) b: Vec3,
    pub(crate) spread: f32,
}

impl LightSpan {
    pub(crate) fn of(light: &Light) -> Self {
        let (a, b) = light.ends();
        let spread = match light {
            Light::Linear(line) => line.radius,
            Light::Point(_) => 0.0,
            Light::Area(area) => match area.shape {
                // The other two corners are equally far from the diagonal.
                AreaShape::Rect { along, across, .. } => {
                    let diagonal = along + across;
                    along.cross(across).length() / diagonal.length().max(f64::MIN_POSITIVE)
                }
                AreaShape::Disc { radius, .. } => radius,
            },
        };
        // What rounding to f32 may move.
        let size = a.abs().max(b.abs()).max_element();
        Self {
            a: a.as_vec3(),
            b: b.as_vec3(),
            spread: (spread + 1e-6 * size) as f32,
        }
    }
}

/// Points whose view of one light passes through a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade {
    /// The middle of the box, to which everything else is relative.
    center: Vec3,
    half: Vec3,
    a: Vec3,
    b: Vec3,
    /// Of both ends of the light.
    light: Bounds,
}

impl Shade {
    /// The shade of everything in `bounds` (recentred frame, not empty) under a light.
    pub(crate) fn new(span: &LightSpan, bounds: Bounds) -> Self {
        let center = bounds.center();
        let (a, b) = (span.a - center, span.b - center);
        // Rounding of the test below must not lose a point.
        let slack = 1e-5 * (bounds.size().max_element() + center.abs().max_element());
        Self {
            center,
            half: bounds.size() * 0.5 + Vec3::splat(span.spread + slack),
            a,
            b,
            light: Bounds {
                min: a.min(b),
                max: a.max(b),
            },
        }
    }

    /// Does the triangle of `point` and the light meet the box? Exact up to rounding, by separating axes (T. Akenine-Moeller,
    /// "Fast 3D Triangle-Box Overlap Testing", 2001).
    #[inline]
    pub(crate) fn covers(&self, point: Vec3) -> bool {
        let p = point - self.center;
        let (low, high) = (self.light.min.min(p), self.light.max.max(p));
        if (low.cmpgt(self.half) | high.cmplt(-self.half)).any() {
            return false;
        }
        let (a, b, half) = (self.a, self.b, self.half);
        let apart = |axis: Vec3| {
            let (u, v, w) = (axis.dot(p), axis.dot(a), axis.dot(b));
            let radius = axis.abs().dot(half);
            u.min(v).min(w) > radius || u.max(v).max(w) < -radius
        };
        let edges = [a - p, b - p, b - a];
        if apart(edges[0].cross(edges[1])) {
            return false;
        }
        let across = |e: Vec3| {
            apart(Vec3::new(0.0, -e.z, e.y))
                || apart(Vec3::new(e.z, 0.0, -e.x))
                || apart(Vec3::new(-e.y, e.x, 0.0))
        };
        !edges.into_iter().any(across)
    }
}

#[cfg(test)]
mod tests {
    use llsr_scene::LinearLight;

    use super::*;

    fn numbers(seed: u64) -> impl FnMut() -> f32 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
        }
    }

    #[test]
    fn what_a_box_shades_is_found() {
        let mut next = numbers(5);
        let mut vector = move || Vec3::new(next(), next(), next());
        let (mut inside, mut outside) = (0, 0);
        for _ in 0..400 {
            let (a, b) = (vector() * 3.0, vector() * 3.0);
            let light = Light::from(LinearLight::new("l", a.as_dvec3(), b.as_dvec3(), 1.0));
            let (corner, other) = (vector(), vector());
            let bounds = Bounds::of([corner, other]);
            let shade = Shade::new(&LightSpan::of(&light), bounds);
            for _ in 0..50 {
                let point = vector() * 4.0;
                // The truth by many rays to the light: each is cut by the three slabs.
                let blocked = (0..=200).any(|i| {
                    let to = a + (b - a) * (i as f32 / 200.0);
                    let along = to - point;
                    let (mut from, mut end) = (0.0f32, 1.0f32);
                    for axis in 0..3 {
                        let near = (bounds.min[axis] - point[axis]) / along[axis];
                        let far = (bounds.max[axis] - point[axis]) / along[axis];
                        from = from.max(near.min(far));
                        end = end.min(near.max(far));
                    }
                    from <= end
                });
                let covered = shade.covers(point);
                assert!(covered || !blocked, "{point} behind {bounds:?} of {a} {b}");
                inside += usize::from(blocked);
                outside += usize::from(covered && !blocked);
            }
        }
        assert!(inside > 2000, "{inside} points were in the shade");
        assert!(
            outside * 50 < inside,
            "{outside} more than {inside} are taken for shaded"
        );
    }
}
