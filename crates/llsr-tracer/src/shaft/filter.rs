//! Shafts against eight boxes or sixteen triangles at a time, in single precision with padding.
//!
//! A shaft is the convex hull of two boxes: every point of a segment from one to the other lies, at the fraction s of its
//! way, in the box whose planes are interpolated between theirs. So a third box meets the shaft exactly if for some
//! s in [0, 1] it overlaps the interpolated box on all three axes, which are six linear inequalities in s.

use glam::{DVec3, Vec3};
use llsr_scene::Bounds;

use crate::block::TriangleBlock;
use crate::build::WideNode;
use crate::lanes::{Floats, Simd};
use crate::unchecked::Plane;

/// Unit roundoff of `f32`.
const U: f32 = f32::EPSILON / 2.0;

/// A bound of s: `slope` times a plane of the box in question, plus `offset`, which includes the padding.
#[derive(Clone, Copy, Debug)]
struct Limit {
    plane: Plane,
    slope: f32,
    offset: f32,
}

/// The hull of two boxes, prepared for tests.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShaftFilter {
    lower: [Limit; 6],
    lower_len: usize,
    upper: [Limit; 6],
    upper_len: usize,
}

/// The smallest box of single precision around points of double precision.
pub(crate) fn around(points: impl IntoIterator<Item = DVec3>) -> Bounds {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in points {
        (min, max) = (min.min(p), max.max(p));
    }
    let down = |x: f64| {
        let y = x as f32;
        if f64::from(y) > x { y.next_down() } else { y }
    };
    let up = |x: f64| {
        let y = x as f32;
        if f64::from(y) < x { y.next_up() } else { y }
    };
    Bounds {
        min: Vec3::new(down(min.x), down(min.y), down(min.z)),
        max: Vec3::new(up(max.x), up(max.y), up(max.z)),
    }
}

impl ShaftFilter {
    /// The shaft between two boxes, for geometry whose coordinates are at most `reach` in absolute value. `None`
    /// if a box is empty or a number is not finite or near the ends of the range.
    #[inline(always)]
    pub(crate) fn new(from: &Bounds, to: &Bounds, reach: f32) -> Option<Self> {
        let (f, t) = ([from.min, from.max], [to.min, to.max]);
        let largest = f
            .iter()
            .chain(&t)
            .map(|v| v.abs().max_element())
            .fold(reach, f32::max);
        // A comparison with NaN is false.
        let in_range = f.iter().chain(&t).all(|v| v.is_finite()) && largest > 1e-18 && largest < 1e18;
        if !in_range || from.is_empty() || to.is_empty() {
            return None;
        }
        let scale = reach + from.min.abs().max(from.max.abs()).max_element();
        // Moving an interpolated plane by less than the padding is allowed.
        let tiny = (4.0 * U) * scale + f32::MIN_POSITIVE;
        let none = Limit {
            plane: Plane::new(0, false),
            slope: 0.0,
            offset: 0.0,
        };
        let mut filter = Self {
            lower: [none; 6],
            lower_len: 0,
            upper: [none; 6],
            upper_len: 0,
        };
        for axis in 0..3 {
            // The interpolated lower plane is below the box's upper one, and the other way round.
            for (side, above) in [(0, true), (1, false)] {
                let way = t[side][axis] - f[side][axis];
                let way = if way.abs() < tiny { tiny.copysign(way) } else { way };
                let slope = 1.0 / way;
                // Rounding of the way, the slope, the offset and the sum, each relative to a coordinate.
                let padding = slope.abs() * (16.0 * U * scale);
                let offset = -f[side][axis] * slope;
                let plane = Plane::new(axis, above);
                if (way > 0.0) == above {
                    filter.upper[filter.upper_len] = Limit {
                        plane,
                        slope,
                        offset: offset + padding,
                    };
                    filter.upper_len += 1;
                } else {
                    filter.lower[filter.lower_len] = Limit {
                        plane,
                        slope,
                        offset: offset - padding,
                    };
                    filter.lower_len += 1;
                }
            }
        }
        Some(filter)
    }

    /// The children whose boxes the shaft may meet at s <= `s_max`, and the least s of each.
    #[inline(always)]
    pub(crate) fn meets<S: Simd>(&self, s: S, node: &WideNode, s_max: f32) -> (u32, S::F) {
        let mut lo = S::F::splat(s, 0.0);
        for limit in &self.lower[..self.lower_len] {
            let plane = S::F::load(s, limit.plane.of(node));
            lo = plane
                .mul_add(S::F::splat(s, limit.slope), S::F::splat(s, limit.offset))
                .max(lo);
        }
        let mut hi = S::F::splat(s, s_max);
        for limit in &self.upper[..self.upper_len] {
            let plane = S::F::load(s, limit.plane.of(node));
            hi = plane
                .mul_add(S::F::splat(s, limit.slope), S::F::splat(s, limit.offset))
                .min(hi);
        }
        (lo.le(hi), lo)
    }

    /// The triangles of a block whose boxes the shaft may meet.
    #[inline(always)]
    pub(crate) fn meets_triangles<S: Simd>(&self, s: S, block: &TriangleBlock) -> u32 {
        let [a, b, c] = &block.corners;
        let mut planes = [S::W::splat(s, 0.0); 6];
        for axis in 0..3 {
            let x = S::W::load(s, &block.vertices[axis]);
            let (xa, xb, xc) = (s.permute(x, a), s.permute(x, b), s.permute(x, c));
            planes[axis] = xa.min(xb).min(xc);
            planes[axis + 3] = xa.max(xb).max(xc);
        }
        let mut lo = S::W::splat(s, 0.0);
        for limit in &self.lower[..self.lower_len] {
            let plane = *limit.plane.pick(&planes);
            lo = plane
                .mul_add(S::W::splat(s, limit.slope), S::W::splat(s, limit.offset))
                .max(lo);
        }
        let mut hi = S::W::splat(s, 1.0);
        for limit in &self.upper[..self.upper_len] {
            let plane = *limit.plane.pick(&planes);
            hi = plane
                .mul_add(S::W::splat(s, limit.slope), S::W::splat(s, limit.offset))
                .min(hi);
        }
        lo.le(hi) & block.used
    }
}
