//! Fans against eight boxes at a time, in single precision with padding.
//!
//! A box meets the fan's triangle only if it is not wholly on one side of the plane, beyond one of the two
//! outer rays, or beyond the light. The first is a linear function whose extreme over a box is attained at the
//! corner that its gradient's signs select. The others depend on two coordinates only (see `plane`), so that four
//! corners tell all, and the light parameters of these bound what the box may hide. Coordinates are taken
//! relative to p first, so that the error is relative to the distance from p to the farthest corner of the tree,
//! not to the distance from the origin.

use glam::DVec3;
use llsr_scene::Bounds;

use super::plane::FanPlane;
use crate::block::TriangleBlock;
use crate::build::{WIDTH, WideNode};
use crate::lanes::{Floats, Simd};
use crate::unchecked::{Axis, Plane};

/// Unit roundoff of `f32`.
const U: f32 = f32::EPSILON / 2.0;

/// A fan prepared for the boxes and blocks of one tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxFilter {
    axes: [Axis; 3],
    /// For u, v and the last axis the plane of a box where the side is least and where it is greatest.
    planes: [[Plane; 2]; 3],
    /// The rounded p, in the fan's axes.
    p: [f32; 3],
    /// The side is the last coordinate and these times u and v.
    slope: [f32; 2],
    /// Without the constant and beyond all rounding: a point with a greater one is above the plane, ...
    above: f32,
    /// ... with a smaller one below it.
    below: f32,
    /// alpha and h by u, v and 1.
    alpha: [f32; 3],
    height: [f32; 3],
    /// Bounds of the rounding of h, and of alpha - t h for t in [0, 1].
    height_error: f32,
    error: f32,
    /// The light parameters asked for.
    range: [f32; 2],
    /// p, the end of the light at t = 0 and the light's direction from the rounded p, in the fan's axes.
    apex: [f64; 3],
    start: [f64; 3],
    along: [f64; 3],
    /// Between which coordinates from the rounded p the fan lies in front of these, in the fan's axes.
    extent: [[f32; 2]; 3],
}

/// The children of a node that the fan may meet.
pub(super) struct Met {
    /// One bit a child.
    pub(super) mask: u32,
    /// The light parameters in [0, 1] behind each child: at most the least and at least the greatest, where `bounded`.
    pub(super) t_min: [f32; WIDTH],
    pub(super) t_max: [f32; WIDTH],
    /// Children that lie before p beyond doubt.
    pub(super) bounded: u32,
    /// About the least h of each child: 0 at p, 1 on the light.
    pub(super) near: [f32; WIDTH],
}

impl BoxFilter {
    /// Prepares the fan for boxes inside `bounds`, in front of the light parameters `range`; `None` if nothing is in
    /// `bounds` or p is beyond single precision.
    #[inline(always)]
    pub(super) fn new(fan: &FanPlane, bounds: &Bounds, range: [f64; 2]) -> Option<Self> {
        let rounded = fan.p.as_vec3();
        let reach = (bounds.max - rounded)
            .abs()
            .max((bounds.min - rounded).abs())
            .max_element()
            * (1.0 + 4.0 * f32::EPSILON);
        if !reach.is_finite() {
            return None;
        }
        let turn = |v: [f32; 3]| fan.axes.map(|axis| *axis.of(&v));
        let turn64 = |v: DVec3| fan.axes.map(|axis| *axis.of(&v.to_array()));
        let p = turn(rounded.to_array());
        let moved = (rounded.as_dvec3() - fan.p).to_array();
        let moved = fan.axes.map(|axis| *axis.of(&moved));
        let steep = 1.0 / fan.normal[2];
        let steep = [fan.normal[0] * steep, fan.normal[1] * steep];
        let slope = steep.map(|x| x as f32);
        let side = (moved[2] + steep[0] * moved[0] + steep[1] * moved[1]) as f32;
        // The gradient, the differences, the products and the sums are rounded; so are the sums below.
        let side_error = 16.0 * U * (3.0 * reach + side.abs());
        let linear = |[u, v]: [f64; 2]| {
            let constant = (u * moved[0] + v * moved[1]) as f32;
            let (u, v) = (u as f32, v as f32);
            let error = 16.0 * U * ((u.abs() + v.abs()) * reach + constant.abs()) + f32::MIN_POSITIVE;
            ([u, v, constant], error)
        };
        let (mut alpha, mut alpha_error) = linear(fan.alpha);
        let (mut height, mut height_error) = linear(fan.height);
        if !(alpha_error < 1e20 && height_error < 1e20) {
            // Nothing is left out.
            (alpha, alpha_error) = ([0.0; 3], f32::INFINITY);
            (height, height_error) = ([0.0; 3], f32::INFINITY);
        }
        let plane = |place: usize, positive: bool| {
            let axis = fan.axes[place].index();
            [Plane::new(axis, !positive), Plane::new(axis, positive)]
        };
        let mut filter = Self {
            axes: fan.axes,
            planes: [
                plane(0, slope[0] >= 0.0),
                plane(1, slope[1] >= 0.0),
                plane(2, true),
            ],
            p,
            slope,
            above: side_error - side,
            below: -side_error - side,
            alpha,
            height,
            height_error,
            error: 1.1 * (alpha_error + height_error),
            range: [0.0, 1.0],
            apex: moved.map(|x| -x),
            start: turn64(fan.a - rounded.as_dvec3()),
            along: turn64(fan.b - fan.a),
            extent: [[0.0; 2]; 3],
        };
        filter.narrow(range);
        Some(filter)
    }

    /// Looks for boxes in front of [`t0`, `t1`] only.
    #[inline(always)]
    pub(super) fn narrow(&mut self, [t0, t1]: [f64; 2]) {
        // Parameters in [0, 1] are rounded by less than this.
        self.range = [t0 as f32 - 2.0 * U, t1 as f32 + 2.0 * U];
        for axis in 0..3 {
            let (p, start, along) = (self.apex[axis], self.start[axis], self.along[axis]);
            let (x, y) = (start + t0 * along, start + t1 * along);
            let (least, most) = (p.min(x.min(y)), p.max(x.max(y)));
            // The rounding of the ends is far below that of single precision, which the factor exceeds.
            let slack =
                f64::from(4.0 * U) * (p.abs() + start.abs() + along.abs()) + f64::from(f32::MIN_POSITIVE);
            self.extent[axis] = [(least - slack) as f32, (most + slack) as f32];
        }
    }

    /// Which children the fan may meet, and which light parameters they may hide.
    #[inline(always)]
    pub(super) fn meets<S: Simd>(&self, s: S, node: &WideNode) -> Met {
        // Without closures: they are not compiled with the caller's instructions.
        let [pu, pv, pk] = self.p;
        let [[u0, u1], [v0, v1], [k0, k1]] = self.planes;
        let (pu, pv, pk) = (S::F::splat(s, pu), S::F::splat(s, pv), S::F::splat(s, pk));
        let u0 = S::F::load(s, u0.of(node)).sub(pu);
        let u1 = S::F::load(s, u1.of(node)).sub(pu);
        let v0 = S::F::load(s, v0.of(node)).sub(pv);
        let v1 = S::F::load(s, v1.of(node)).sub(pv);
        let k0 = S::F::load(s, k0.of(node)).sub(pk);
        let k1 = S::F::load(s, k1.of(node)).sub(pk);
        let (su, sv) = (S::F::splat(s, self.slope[0]), S::F::splat(s, self.slope[1]));
        let least = su.mul_add(u0, sv.mul_add(v0, k0));
        let most = su.mul_add(u1, sv.mul_add(v1, k1));
        let mut mask = least.le(S::F::splat(s, self.above)) & S::F::splat(s, self.below).le(most);
        // A difference that is rounded keeps its order.
        let [u, v, k] = self.extent;
        mask &= u0.min(u1).le(S::F::splat(s, u[1])) & S::F::splat(s, u[0]).le(u0.max(u1));
        mask &= v0.min(v1).le(S::F::splat(s, v[1])) & S::F::splat(s, v[0]).le(v0.max(v1));
        mask &= k0.le(S::F::splat(s, k[1])) & S::F::splat(s, k[0]).le(k1);

        let alpha = corners(s, &self.alpha, u0, u1, v0, v1);
        let height = corners(s, &self.height, u0, u1, v0, v1);
        let near = height[0].min(height[1]).min(height[2].min(height[3]));
        let far = height[0].max(height[1]).max(height[2].max(height[3]));
        mask &= near.le(S::F::splat(s, 1.0 + self.height_error));
        mask &= S::F::splat(s, -self.height_error).le(far);
        // Beyond an outer ray?
        let (t0, t1) = (S::F::splat(s, self.range[0]), S::F::splat(s, self.range[1]));
        let right = [
            t0.neg_mul_add(height[0], alpha[0]),
            t0.neg_mul_add(height[1], alpha[1]),
            t0.neg_mul_add(height[2], alpha[2]),
            t0.neg_mul_add(height[3], alpha[3]),
        ];
        let left = [
            t1.mul_sub(height[0], alpha[0]),
            t1.mul_sub(height[1], alpha[1]),
            t1.mul_sub(height[2], alpha[2]),
            t1.mul_sub(height[3], alpha[3]),
        ];
        let error = S::F::splat(s, -self.error);
        mask &= error.le(right[0].max(right[1]).max(right[2].max(right[3])));
        mask &= error.le(left[0].max(left[1]).max(left[2].max(left[3])));

        // A quotient alpha / h in [0, 1] is wrong by at most the error over the computed h, and its own rounding; one outside
        // does not enter [0, 1] by more than that.
        let one = S::F::splat(s, 1.0);
        let bounded = S::F::splat(s, 2.0 * self.height_error).lt(near);
        let i = [
            one.div(height[0]),
            one.div(height[1]),
            one.div(height[2]),
            one.div(height[3]),
        ];
        let t = [
            alpha[0].mul(i[0]),
            alpha[1].mul(i[1]),
            alpha[2].mul(i[2]),
            alpha[3].mul(i[3]),
        ];
        let largest = i[0].max(i[1]).max(i[2].max(i[3]));
        let slack = S::F::splat(s, self.error).mul_add(largest, S::F::splat(s, 8.0 * U));
        let t_min = t[0].min(t[1]).min(t[2].min(t[3])).sub(slack);
        let t_max = t[0].max(t[1]).max(t[2].max(t[3])).add(slack);
        Met {
            mask,
            t_min: t_min.store(),
            t_max: t_max.store(),
            bounded,
            near: near.store(),
        }
    }

    /// The triangles of a block that the fan may cut.
    #[inline(always)]
    pub(super) fn cuts<S: Simd>(&self, s: S, block: &TriangleBlock) -> u32 {
        let [u, v, k] = self.axes;
        let u = S::W::load(s, u.of(&block.vertices)).sub(S::W::splat(s, self.p[0]));
        let v = S::W::load(s, v.of(&block.vertices)).sub(S::W::splat(s, self.p[1]));
        let k = S::W::load(s, k.of(&block.vertices)).sub(S::W::splat(s, self.p[2]));
        let (su, sv) = (S::W::splat(s, self.slope[0]), S::W::splat(s, self.slope[1]));
        let side = su.mul_add(u, sv.mul_add(v, k));
        let not_above = side.le(S::W::splat(s, self.above));
        let not_below = S::W::splat(s, self.below).le(side);
        if not_above == 0 || not_below == 0 {
            return 0;
        }
        // Before which vertices each outer ray passes; a triangle beyond either is not cut.
        let error = S::W::splat(s, -self.error);
        let [au, av, ac] = self.alpha;
        let [hu, hv, hc] = self.height;
        let alpha = S::W::splat(s, au).mul_add(u, S::W::splat(s, av).mul_add(v, S::W::splat(s, ac)));
        let height = S::W::splat(s, hu).mul_add(u, S::W::splat(s, hv).mul_add(v, S::W::splat(s, hc)));
        let [t0, t1] = self.range;
        let right = error.le(S::W::splat(s, t0).neg_mul_add(height, alpha));
        let left = error.le(S::W::splat(s, t1).mul_sub(height, alpha));
        if right == 0 || left == 0 {
            return 0;
        }
        let [a, b, c] = &block.corners;
        let right = s.permute_bits(right, a) | s.permute_bits(right, b) | s.permute_bits(right, c);
        let left = s.permute_bits(left, a) | s.permute_bits(left, b) | s.permute_bits(left, c);
        let below =
            s.permute_bits(not_above, a) | s.permute_bits(not_above, b) | s.permute_bits(not_above, c);
        let above =
            s.permute_bits(not_below, a) | s.permute_bits(not_below, b) | s.permute_bits(not_below, c);
        below & above & left & right & block.used
    }
}

/// A linear function of u and v at the four corners.
#[inline(always)]
fn corners<S: Simd>(s: S, linear: &[f32; 3], u0: S::F, u1: S::F, v0: S::F, v1: S::F) -> [S::F; 4] {
    let [gu, gv, constant] = *linear;
    let (gu, gv) = (S::F::splat(s, gu), S::F::splat(s, gv));
    let constant = S::F::splat(s, constant);
    let (at0, at1) = (gv.mul_add(v0, constant), gv.mul_add(v1, constant));
    [
        gu.mul_add(u0, at0),
        gu.mul_add(u1, at0),
        gu.mul_add(u0, at1),
        gu.mul_add(u1, at1),
    ]
}
