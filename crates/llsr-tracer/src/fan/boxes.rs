//! Fans against eight boxes or sixteen triangles at a time, in single precision with padding.
//!
//! A box meets the fan's triangle only if it is not wholly on one side of the plane, beyond one of the two
//! outer rays, or beyond the light. Each of these is a linear function whose extreme over a box is attained at
//! the corner that its gradient's signs select; over a triangle, at one of its corners. Coordinates are taken relative to
//! p first, so that the error is relative to the distance from p to the farthest corner of the tree, not to the
//! distance from the origin.

use glam::DVec3;
use llsr_scene::Bounds;

use super::plane::FanPlane;
use crate::block::{BLOCK, TriangleBlock};
use crate::build::{WIDTH, WideNode};
use crate::lanes::{Floats, Simd};
use crate::unchecked::Plane;

/// Unit roundoff of `f32`.
const U: f32 = f32::EPSILON / 2.0;

/// A linear function of position.
#[derive(Clone, Copy, Debug)]
struct Linear {
    gradient: [f32; 3],
    /// Value at the rounded p, and the bound of all rounding.
    constant: f32,
    padding: f32,
    /// Which plane of a box gives the largest and the smallest value on each axis.
    largest: [Plane; 3],
    smallest: [Plane; 3],
}

impl Linear {
    /// `gradient . (x - p)`, to be evaluated at `x` - `rounded_p`, whose components are at most `reach`.
    #[inline(always)]
    fn new(gradient: DVec3, p: DVec3, rounded_p: [f32; 3], reach: f32) -> Self {
        let g = gradient.as_vec3().to_array();
        let moved = DVec3::from(rounded_p.map(f64::from)) - p;
        let constant = gradient.dot(moved) as f32;
        // The gradient, the difference, three products and three sums are rounded.
        let padding = 16.0 * U * ((g[0].abs() + g[1].abs() + g[2].abs()) * reach + constant.abs());
        let plane = |axis: usize, largest: bool| Plane::new(axis, (g[axis] > 0.0) == largest);
        Self {
            gradient: g,
            constant,
            padding,
            largest: [plane(0, true), plane(1, true), plane(2, true)],
            smallest: [plane(0, false), plane(1, false), plane(2, false)],
        }
    }
}

/// `p` is where the coordinates are taken from.
#[inline(always)]
fn extreme<S: Simd>(
    s: S,
    linear: &Linear,
    p: &[f32; 3],
    node: &WideNode,
    planes: [Plane; 3],
    value: f32,
) -> S::F {
    // Without closures: they are not compiled with the caller's instructions.
    let [gx, gy, gz] = linear.gradient;
    let (gx, gy, gz) = (S::F::splat(s, gx), S::F::splat(s, gy), S::F::splat(s, gz));
    let x = S::F::load(s, planes[0].of(node)).sub(S::F::splat(s, p[0]));
    let y = S::F::load(s, planes[1].of(node)).sub(S::F::splat(s, p[1]));
    let z = S::F::load(s, planes[2].of(node)).sub(S::F::splat(s, p[2]));
    gx.mul_add(x, gy.mul_add(y, gz.mul_add(z, S::F::splat(s, value))))
}

/// At least the largest value over each box.
#[inline(always)]
fn most<S: Simd>(s: S, linear: &Linear, p: &[f32; 3], node: &WideNode) -> S::F {
    extreme(
        s,
        linear,
        p,
        node,
        linear.largest,
        linear.constant + linear.padding,
    )
}

/// At most the smallest value over each box.
#[inline(always)]
fn least<S: Simd>(s: S, linear: &Linear, p: &[f32; 3], node: &WideNode) -> S::F {
    extreme(
        s,
        linear,
        p,
        node,
        linear.smallest,
        linear.constant - linear.padding,
    )
}

/// The least and greatest value over each triangle, without padding.
#[inline(always)]
fn over_triangles<S: Simd>(s: S, linear: &Linear, x: &[S::W; 3], corners: &[[u8; BLOCK]; 3]) -> (S::W, S::W) {
    let [gx, gy, gz] = linear.gradient;
    let (gx, gy, gz) = (S::W::splat(s, gx), S::W::splat(s, gy), S::W::splat(s, gz));
    let value = gx.mul_add(
        x[0],
        gy.mul_add(x[1], gz.mul_add(x[2], S::W::splat(s, linear.constant))),
    );
    let [a, b, c] = corners;
    let (a, b, c) = (s.permute(value, a), s.permute(value, b), s.permute(value, c));
    (a.min(b).min(c), a.max(b).max(c))
}

/// A fan prepared for the boxes and blocks of one tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxFilter {
    p: [f32; 3],
    reach: f32,
    /// Distance from the plane, in some unit.
    side: Linear,
    /// 0 at p, 1 on the light.
    height: Linear,
    /// alpha - middle * h.
    across: Linear,
    middle: f32,
    /// alpha - t0 h and t1 h - alpha for the outer rays at t0 and t1.
    left: Linear,
    right: Linear,
}

/// The children of a node that the fan may meet.
pub(super) struct Met {
    /// One bit a child.
    pub(super) mask: u32,
    /// The light parameters behind each child: at most the least and at least the greatest.
    pub(super) t_min: [f32; WIDTH],
    pub(super) t_max: [f32; WIDTH],
    /// At most the least h of each child: 0 at p, 1 on the light.
    pub(super) near: [f32; WIDTH],
}

impl BoxFilter {
    /// Prepares the fan for boxes inside `bounds`, in front of [`t0`, `t1`].
    #[inline(always)]
    pub(super) fn new(fan: &FanPlane, bounds: &Bounds, range: [f64; 2]) -> Self {
        let rounded = fan.p.as_vec3();
        let reach = (bounds.max - rounded)
            .abs()
            .max((bounds.min - rounded).abs())
            .max_element()
            * (1.0 + 4.0 * f32::EPSILON);
        let p = rounded.to_array();
        let side = Linear::new(fan.normal / fan.normal.abs().max_element(), fan.p, p, reach);
        let height = Linear::new(fan.height, fan.p, p, reach);
        let mut filter = Self {
            p,
            reach,
            side,
            height,
            across: height,
            middle: 0.0,
            left: height,
            right: height,
        };
        filter.narrow(fan, range);
        filter
    }

    /// Looks for boxes in front of [`t0`, `t1`] only.
    #[inline(always)]
    pub(super) fn narrow(&mut self, fan: &FanPlane, [t0, t1]: [f64; 2]) {
        let middle = 0.5 * (t0 + t1) as f32;
        let (p, reach) = (self.p, self.reach);
        self.left = Linear::new(fan.alpha - fan.height * t0, fan.p, p, reach);
        self.right = Linear::new(fan.height * t1 - fan.alpha, fan.p, p, reach);
        self.across = Linear::new(fan.alpha - fan.height * f64::from(middle), fan.p, p, reach);
        self.middle = middle;
    }

    /// Which children the fan may meet, and which light parameters they may hide.
    #[inline(always)]
    pub(super) fn meets<S: Simd>(&self, s: S, node: &WideNode) -> Met {
        let p = &self.p;
        let (zero, one) = (S::F::splat(s, 0.0), S::F::splat(s, 1.0));
        let mut mask = least(s, &self.side, p, node).le(zero) & zero.le(most(s, &self.side, p, node));
        mask &= zero.le(most(s, &self.left, p, node)) & zero.le(most(s, &self.right, p, node));
        let (near, far) = (least(s, &self.height, p, node), most(s, &self.height, p, node));
        mask &= near.le(one) & zero.le(far);
        if mask == 0 {
            return Met {
                mask,
                t_min: [0.0; WIDTH],
                t_max: [0.0; WIDTH],
                near: [0.0; WIDTH],
            };
        }
        // alpha / h - middle is extreme at corners; where the box reaches p nothing bounds it. What lies beyond the light does
        // not matter.
        let tiny = S::F::splat(s, 1e-30);
        let near_h = one.div(near.max(tiny));
        let far_h = one.div(far.max(tiny).min(one));
        let (lo, hi) = (least(s, &self.across, p, node), most(s, &self.across, p, node));
        let middle = S::F::splat(s, self.middle);
        let slack = S::F::splat(s, 8.0 * U);
        let t_min = lo.mul(near_h).min(lo.mul(far_h));
        let t_min = middle.sub(slack).add(slack.neg_mul_add(t_min.abs(), t_min));
        let t_max = hi.mul(near_h).max(hi.mul(far_h));
        let t_max = middle.add(slack).add(slack.mul_add(t_max.abs(), t_max));
        Met {
            mask,
            t_min: t_min.store(),
            t_max: t_max.store(),
            near: near.store(),
        }
    }

    /// Which triangles of a block the fan may cut.
    #[inline(always)]
    pub(super) fn cuts<S: Simd>(&self, s: S, block: &TriangleBlock) -> u32 {
        let [x, y, z] = &block.vertices;
        let x = [
            S::W::load(s, x).sub(S::W::splat(s, self.p[0])),
            S::W::load(s, y).sub(S::W::splat(s, self.p[1])),
            S::W::load(s, z).sub(S::W::splat(s, self.p[2])),
        ];
        let corners = &block.corners;
        let padding = S::W::splat(s, self.side.padding);
        let (lo, hi) = over_triangles(s, &self.side, &x, corners);
        let mut mask = block.used & lo.le(padding) & S::W::splat(s, -self.side.padding).le(hi);
        if mask == 0 {
            return 0;
        }
        let (_, hi) = over_triangles(s, &self.left, &x, corners);
        mask &= S::W::splat(s, -self.left.padding).le(hi);
        let (_, hi) = over_triangles(s, &self.right, &x, corners);
        mask &= S::W::splat(s, -self.right.padding).le(hi);
        let (lo, hi) = over_triangles(s, &self.height, &x, corners);
        let padding = self.height.padding;
        mask & lo.le(S::W::splat(s, 1.0 + padding)) & S::W::splat(s, -padding).le(hi)
    }
}
