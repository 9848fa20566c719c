//! Rays with a common origin, one a lane, against boxes and triangles: filters with proven bounds.
//!
//! The frame is that of [`RayFilter`](crate::ray::RayFilter): axes are permuted so that the rays run along the last one,
//! and a ray's parameter is the distance along it. One axis serves all rays, so that slopes may be a little above 1; rays
//! that spread further are not put into one sheaf.

use glam::{DVec3, Vec3A};

use crate::block::{BLOCK, TriangleBlock};
use crate::build::WideNode;
use crate::lanes::{Floats, Simd};
use crate::unchecked::Axis;

/// Unit roundoff of `f32`.
const U: f32 = f32::EPSILON / 2.0;

/// The most rays of a sheaf.
pub(crate) const RAYS: usize = 16;

/// Largest slope of a ray against the common axis.
const STEEPEST: f32 = 2.0;

/// Rays from one point, in the lanes of `S`.
#[derive(Clone, Copy)]
pub(crate) struct Sheaf<S: Simd> {
    /// Origin in single precision, and in permuted axes.
    origin: [f32; 3],
    /// Slopes along the first two permuted axes.
    shear: [S::W; 2],
    /// Distance along the axis of a direction's length, the same for each ray.
    scale: [f32; RAYS],
    /// Reciprocal direction per unit of the parameter, and the padding of a box's planes.
    inverse: [S::W; 3],
    padding: [S::W; 3],
    axes: [Axis; 3],
    /// Direction along the last axis, 1 or -1.
    sign: f32,
    /// Largest slope, at least 1.
    steep: f32,
    /// Bound of the error of a sheared coordinate of a vertex near a ray (m).
    error: f32,
}

/// The vertices of a block relative to the origin of a sheaf, in permuted axes.
pub(crate) struct Moved {
    across: [f32; BLOCK],
    along: [f32; BLOCK],
    depth: [f32; BLOCK],
    error: f32,
    tolerance: f32,
}

/// What a triangle's test found: bit masks of rays.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RayHits {
    /// Rays that hit it for certain.
    pub(crate) sure: u32,
    /// Rays that only double precision can decide.
    pub(crate) doubtful: u32,
}

impl<S: Simd> Sheaf<S> {
    /// Prepares rays for geometry whose coordinates are at most `reach` in absolute value. `None` if they are no or
    /// too many rays, do not run along one axis, or if a number is not finite or near the ends of the range.
    #[inline(always)]
    pub(crate) fn new(s: S, origin: DVec3, directions: &[DVec3], reach: f32) -> Option<Self> {
        if directions.is_empty() || directions.len() > RAYS {
            return None;
        }
        let o = Vec3A::from(origin.as_vec3());
        let mut rows = [[0f32; RAYS]; 3];
        for (lane, d) in directions.iter().enumerate() {
            for axis in 0..3 {
                rows[axis][lane] = d[axis] as f32;
            }
        }
        for row in &mut rows {
            let first = row[0];
            row[directions.len()..].fill(first);
        }
        let middle = directions[directions.len() / 2].abs();
        let last = if middle.x >= middle.y && middle.x >= middle.z {
            0
        } else if middle.y >= middle.z {
            1
        } else {
            2
        };
        let axes = [(last + 1) % 3, (last + 2) % 3, last].map(Axis::new);
        let sign = axes[2].of(&rows)[0].signum();
        // These are false for NaN.
        let (mut sound, mut steep) = (true, 1f32);
        let mut scale = [0f32; RAYS];
        let mut slopes = [[0f32; RAYS]; 2];
        for lane in 0..RAYS {
            let length = axes[2].of(&rows)[lane] * sign;
            sound &= length > 1e-12 && length < 1e12;
            scale[lane] = length;
            let inverse = 1.0 / length;
            for (row, axis) in slopes.iter_mut().zip(&axes) {
                let slope = axis.of(&rows)[lane] * inverse;
                sound &= slope.abs() <= STEEPEST;
                steep = steep.max(slope.abs());
                row[lane] = slope;
            }
        }
        let from = o.abs().max_element();
        if !(sound && from < 1e18 && reach < 1e18) {
            return None;
        }
        let box_scale = reach + from;
        let directions = [&slopes[0], &slopes[1], &[sign; RAYS]];
        let mut inverse = [S::W::splat(s, 0.0); 3];
        let mut padding = inverse;
        for (row, axis) in directions.into_iter().zip(&axes) {
            // As for single rays: a component below `TINY` is replaced by it.
            const TINY: f32 = 1.0 / (1u32 << 22) as f32;
            let mut reciprocal = [0f32; RAYS];
            for (to, &d) in reciprocal.iter_mut().zip(row) {
                *to = 1.0 / if d.abs() < TINY { TINY.copysign(d) } else { d };
            }
            let reciprocal = S::W::load(s, &reciprocal);
            *axis.of_mut(&mut inverse) = reciprocal;
            *axis.of_mut(&mut padding) = reciprocal.abs().mul(S::W::splat(s, 20.0 * U * box_scale));
        }
        Some(Self {
            origin: o.to_array(),
            // The slopes are against the depth as it is, not as the rays run.
            shear: [
                S::W::load(s, &slopes[0]).mul(S::W::splat(s, sign)),
                S::W::load(s, &slopes[1]).mul(S::W::splat(s, sign)),
            ],
            scale,
            inverse,
            padding,
            axes,
            sign,
            steep,
            // As for single rays, with the slope as a factor.
            error: U * steep * (2.5 * from + 8.0 * box_scale) + f32::MIN_POSITIVE,
        })
    }

    /// The filter's parameter at `t` lengths of ray `lane`'s direction, rounded up.
    #[inline(always)]
    pub(crate) fn parameter(&self, lane: usize, t: f64) -> f32 {
        (t as f32) * self.scale[lane & (RAYS - 1)] * (1.0 + 8.0 * f32::EPSILON)
    }

    /// The rays that may enter the box of a child at parameters in [0, `t_max`].
    #[inline(always)]
    pub(crate) fn enters(&self, s: S, node: &WideNode, slot: usize, t_max: S::W) -> u32 {
        let mut enter = S::W::splat(s, 0.0);
        let mut leave = t_max;
        for axis in 0..3 {
            let lo = node.bounds[axis][slot & 7] - self.origin[axis];
            let hi = node.bounds[axis + 3][slot & 7] - self.origin[axis];
            let (lo, hi) = (
                S::W::splat(s, lo).mul(self.inverse[axis]),
                S::W::splat(s, hi).mul(self.inverse[axis]),
            );
            enter = lo.min(hi).sub(self.padding[axis]).max(enter);
            leave = lo.max(hi).add(self.padding[axis]).min(leave);
        }
        enter.le(leave)
    }

    /// Moves a block's vertices to the origin.
    #[inline(always)]
    pub(crate) fn moved(&self, s: S, block: &TriangleBlock) -> Moved {
        let [x, y, z] = self.axes;
        let move_row = |axis: Axis| {
            S::W::load(s, axis.of(&block.vertices))
                .sub(S::W::splat(s, *axis.of(&self.origin)))
                .store()
        };
        let longest = block.longest_edge;
        let steep = self.steep;
        // Of single rays, with slopes of up to `steep`: where a ray truly meets a triangle, sheared coordinates are at
        // most sqrt(1 + steep^2) <= 1.42 steep edges long.
        let error = self.error + 9.0 * U * steep * longest;
        let tolerance = steep * longest * (6.0 * error + 5.0 * U * steep * longest)
            + 4.0 * error * error
            + f32::MIN_POSITIVE;
        Moved {
            across: move_row(x),
            along: move_row(y),
            depth: move_row(z),
            error,
            tolerance,
        }
    }

    /// Tests the triangle in `lane` for parameters in [0, `t_max`].
    #[inline(always)]
    pub(crate) fn meets(
        &self,
        s: S,
        block: &TriangleBlock,
        moved: &Moved,
        lane: usize,
        t_max: S::W,
    ) -> RayHits {
        let [a, b, c] = block.places(lane);
        let splat = |row: &[f32; BLOCK], place: usize| S::W::splat(s, row[place & (BLOCK - 1)]);
        let (az, bz, cz) = (
            splat(&moved.depth, a),
            splat(&moved.depth, b),
            splat(&moved.depth, c),
        );
        let [sx, sy] = self.shear;
        let ax = sx.neg_mul_add(az, splat(&moved.across, a));
        let ay = sy.neg_mul_add(az, splat(&moved.along, a));
        let bx = sx.neg_mul_add(bz, splat(&moved.across, b));
        let by = sy.neg_mul_add(bz, splat(&moved.along, b));
        let cx = sx.neg_mul_add(cz, splat(&moved.across, c));
        let cy = sy.neg_mul_add(cz, splat(&moved.along, c));
        // Edge functions, twice the signed areas of the ray with each edge.
        let u = cx.mul_sub(by, cy.mul(bx));
        let v = ax.mul_sub(cy, ay.mul(cx));
        let w = bx.mul_sub(ay, by.mul(ax));
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        let (plus, minus) = (S::W::splat(s, moved.tolerance), S::W::splat(s, -moved.tolerance));
        let candidates = minus.le(least) | most.le(plus);
        if candidates == 0 {
            return RayHits::default();
        }
        let inside = plus.lt(least) | most.lt(minus);
        let sum = u.add(v).add(w);
        let height = u.mul_add(az, v.mul_add(bz, w.mul(cz)));
        let sign = S::W::splat(s, self.sign);
        let t = height.div(sum).mul(sign);
        let longest = self.steep * block.longest_edge;
        let spread = S::W::splat(s, 16.0 * moved.tolerance * longest).div(sum.abs());
        let t_error = spread.add(S::W::splat(s, 4.0 * moved.error));
        let zero = S::W::splat(s, 0.0);
        let sure = candidates & inside & t_error.lt(t) & t.add(t_error).lt(t_max);
        let outside = inside & (t.add(t_error).lt(zero) | t_max.lt(t.sub(t_error)));
        // Where a ray is not surely inside, the whole triangle must lie outside the range to be out of question.
        let (az, bz, cz) = (az.mul(sign), bz.mul(sign), cz.mul(sign));
        let (first, last) = (az.min(bz).min(cz), az.max(bz).max(cz));
        let slack = S::W::splat(s, 2.0 * moved.error);
        let apart = last.add(slack).lt(zero) | t_max.add(slack).lt(first);
        RayHits {
            sure,
            doubtful: candidates & !sure & !apart & !outside,
        }
    }
}
