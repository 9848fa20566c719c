//! Rays against boxes and blocks in single precision, as filters with proven bounds.
//!
//! A ray is scaled so that the largest component of its direction is 1 and that axis is the last after a permutation;
//! its parameter is then the distance along that axis. Errors that do not depend on the single box or triangle
//! are bounded once a ray.

use glam::{DVec3, Vec3A};

use crate::block::TriangleBlock;
use crate::build::WideNode;
use crate::lanes::{Floats, Simd};
use crate::unchecked::{Axis, Plane};

/// Unit roundoff of `f32`.
pub(crate) const U: f32 = f32::EPSILON / 2.0;

/// The axes after the permutation that makes each axis the last.
pub(crate) const AXES: [[u8; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];

/// A ray prepared for the filters, in the lanes of `S`.
#[derive(Clone, Copy)]
pub(crate) struct RayFilter<S: Simd> {
    boxes: BoxFilter<S>,
    /// Origin and slopes in permuted axes.
    origin: [S::W; 3],
    shear: [S::W; 2],
    axes: [Axis; 3],
    /// Direction along the last axis, 1 or -1.
    sign: f32,
    /// Bound of the error of a sheared coordinate of a vertex near the ray (m).
    error: f32,
}

/// The part of a ray that boxes need.
#[derive(Clone, Copy)]
struct BoxFilter<S: Simd> {
    /// Reciprocal direction.
    inverse: [S::F; 3],
    /// What to add to `bound * inverse` for the nearer and the farther plane, padding included.
    near_offset: [S::F; 3],
    far_offset: [S::F; 3],
    /// Which of [`WideNode::bounds`] is nearer and farther on each axis.
    near: [Plane; 3],
    far: [Plane; 3],
}

impl<S: Simd> RayFilter<S> {
    /// Prepares the ray for geometry whose coordinates are at most `reach` in absolute value, up to the parameter `t_max`
    /// in lengths of `direction`. Also gives the length of `direction` along its longest axis, which is the
    /// filter's parameter at its tip. `None` if the direction is zero or anything is not finite.
    #[inline(always)]
    pub(crate) fn new(s: S, origin: DVec3, direction: DVec3, t_max: f32, reach: f32) -> Option<(Self, f32)> {
        let o = Vec3A::from(origin.as_vec3());
        let mut d = Vec3A::from(direction.as_vec3());
        let mut length = d.abs().max_element();
        // Far from the range in which reciprocals and products are normal numbers (this is false for NaN too).
        if !(length > 1e-18 && length < 1e18) {
            let longest = direction.abs().max_element();
            if !(longest > 0.0 && longest.is_finite() && (1.0 / longest).is_finite()) {
                return None;
            }
            d = Vec3A::from((direction / longest).as_vec3());
            length = longest as f32;
        }
        if !o.is_finite() {
            return None;
        }
        let longest = d.abs().max_element();
        let last = d.abs().cmpeq(Vec3A::splat(longest)).bitmask().trailing_zeros() as usize & 3;
        // A component below `TINY` is replaced by it: that moves the ray sideways by less than the padding before it
        // has left the geometry.
        const TINY: f32 = 1.0 / (1u32 << 22) as f32;
        let d = d * (1.0 / longest);
        let d = d.abs().max(Vec3A::splat(TINY)).copysign(d);
        let inverse = 1.0 / d;
        // A parameter on the boxes' planes is wrong by at most this many metres times the inverse: rounding of the
        // origin, the direction, its inverse, the offset and the sum.
        let from = o.abs().max_element();
        let scale = reach + from;
        let padding = inverse.abs() * (16.0 * U * scale);
        let offset = -o * inverse;
        let (near_offset, far_offset) = ((offset - padding).to_array(), (offset + padding).to_array());
        let negative = d.is_negative_bitmask();
        let inverse = inverse.to_array();
        let axes = AXES[last].map(|axis| Axis::new(usize::from(axis)));
        let (o, d) = (o.to_array(), d.to_array());
        let sign = axes[2].of(&d).signum();
        let flip = [0, 1, 2].map(|axis| negative >> axis & 1 == 1);
        let this = Self {
            boxes: BoxFilter {
                inverse: inverse.map(|x| S::F::splat(s, x)),
                near_offset: near_offset.map(|x| S::F::splat(s, x)),
                far_offset: far_offset.map(|x| S::F::splat(s, x)),
                near: [0, 1, 2].map(|axis| Plane::new(axis, flip[axis])),
                far: [0, 1, 2].map(|axis| Plane::new(axis, !flip[axis])),
            },
            origin: axes.map(|axis| S::W::splat(s, *axis.of(&o))),
            shear: [0, 1].map(|i| S::W::splat(s, axes[i].of(&d) * sign)),
            axes,
            sign,
            // Of a vertex at distance r: U r from each of two subtractions, 3 U r from the slope, which multiplies the
            // depth; U |origin| from each of two coordinates of the origin. The vertices of a triangle that the ray meets
            // are at most as far as the hit and an edge; the edge is added in the test.
            error: U * (2.5 * from + 6.0 * scale.min(length * t_max)) + f32::MIN_POSITIVE,
        };
        Some((this, length))
    }

    /// The children whose boxes the ray may enter at parameters in [0, `t_max`], and where it enters at the earliest.
    #[inline(always)]
    pub(crate) fn enters(&self, s: S, node: &WideNode, t_max: f32) -> (u32, S::F) {
        let b = &self.boxes;
        let zero = S::F::splat(s, 0.0);
        let enter = b.near_plane(s, node, 0).max_bits(b.near_plane(s, node, 1));
        let enter = enter.max_bits(b.near_plane(s, node, 2).max_bits(zero));
        let leave = b.far_plane(s, node, 0).min_bits(b.far_plane(s, node, 1));
        let leave = leave.min_bits(b.far_plane(s, node, 2).min_bits(S::F::splat(s, t_max)));
        (enter.le(leave), enter)
    }

    /// Tests the block's triangles for parameters in [0, `t_max`].
    #[inline(always)]
    pub(crate) fn meets(&self, s: S, block: &TriangleBlock, t_max: f32) -> BlockHits {
        // Vertices relative to the origin, sheared so that the ray is the last axis.
        let [x, y, z] = self.axes;
        let depth = S::W::load(s, z.of(&block.vertices)).sub(self.origin[2]);
        let across = S::W::load(s, x.of(&block.vertices)).sub(self.origin[0]);
        let along = S::W::load(s, y.of(&block.vertices)).sub(self.origin[1]);
        let across = self.shear[0].neg_mul_add(depth, across);
        let along = self.shear[1].neg_mul_add(depth, along);
        let [a, b, c] = &block.corners;
        let (ax, ay) = (s.permute(across, a), s.permute(along, a));
        let (bx, by) = (s.permute(across, b), s.permute(along, b));
        let (cx, cy) = (s.permute(across, c), s.permute(along, c));
        let edges = Edges::new(block, [(ax, ay), (bx, by), (cx, cy)], self.error);
        let candidates = edges.candidates(s, block);
        if candidates == 0 {
            return BlockHits::default();
        }
        let depths = (s.permute(depth, a), s.permute(depth, b), s.permute(depth, c));
        edges.decide(s, candidates, depths, self.sign, t_max)
    }
}

/// How a ray passes the edges of a block's triangles.
pub(crate) struct Edges<S: Simd> {
    /// Edge functions, twice the signed areas of the origin with each edge.
    areas: [S::W; 3],
    least: S::W,
    most: S::W,
    longest: f32,
    /// Bound of the error of a sheared coordinate (m), and of an edge function (m^2).
    error: f32,
    tolerance: f32,
}

impl<S: Simd> Edges<S> {
    /// `corners` are sheared; a coordinate of a vertex near the ray is wrong by at most `error`.
    #[inline(always)]
    pub(crate) fn new(block: &TriangleBlock, corners: [(S::W, S::W); 3], error: f32) -> Self {
        let [(ax, ay), (bx, by), (cx, cy)] = corners;
        let u = cx.mul_sub(by, cy.mul(bx));
        let v = ax.mul_sub(cy, ay.mul(cx));
        let w = bx.mul_sub(ay, by.mul(ax));
        // Where the ray truly meets the triangle, sheared coordinates are at most 1.42 edges long and wrong by at most
        // `error`, and an edge function adds two products of two of them and rounds twice.
        let longest = block.longest_edge;
        let error = error + 6.0 * U * longest;
        Self {
            areas: [u, v, w],
            least: u.min(v).min(w),
            most: u.max(v).max(w),
            longest,
            error,
            tolerance: longest * (6.0 * error + 5.0 * U * longest) + 4.0 * error * error + f32::MIN_POSITIVE,
        }
    }

    /// The triangles that the ray's line may meet.
    #[inline(always)]
    pub(crate) fn candidates(&self, s: S, block: &TriangleBlock) -> u32 {
        let (plus, minus) = (S::W::splat(s, self.tolerance), S::W::splat(s, -self.tolerance));
        (minus.le(self.least) | self.most.le(plus)) & block.used
    }

    /// Which of the candidates are met at parameters in [0, `t_max`]; `depths` are those of the three corners, and the
    /// ray runs along `sign`.
    #[inline(always)]
    pub(crate) fn decide(
        &self,
        s: S,
        candidates: u32,
        depths: (S::W, S::W, S::W),
        sign: f32,
        t_max: f32,
    ) -> BlockHits {
        let ([u, v, w], (az, bz, cz)) = (self.areas, depths);
        let (plus, minus) = (S::W::splat(s, self.tolerance), S::W::splat(s, -self.tolerance));
        let inside = plus.lt(self.least) | self.most.lt(minus);
        let sum = u.add(v).add(w);
        let height = u.mul_add(az, v.mul_add(bz, w.mul(cz)));
        let sign = S::W::splat(s, sign);
        let t = height.div(sum).mul(sign);
        // The weights are wrong by 3 tolerance / sum each where the ray is inside.
        let spread = S::W::splat(s, 16.0 * self.tolerance * self.longest).div(sum.abs());
        let t_error = spread.add(S::W::splat(s, 4.0 * self.error));
        let (start, end) = (S::W::splat(s, 0.0), S::W::splat(s, t_max));
        let sure = candidates & inside & t_error.lt(t) & t.add(t_error).lt(end);
        let outside = inside & (t.add(t_error).lt(start) | end.lt(t.sub(t_error)));
        // Where the ray is not surely inside, the whole triangle must lie outside the range to be out of question.
        let (az, bz, cz) = (az.mul(sign), bz.mul(sign), cz.mul(sign));
        let (first, last) = (az.min(bz).min(cz), az.max(bz).max(cz));
        let slack = 2.0 * self.error;
        let apart = last.lt(S::W::splat(s, -slack)) | S::W::splat(s, t_max + slack).lt(first);
        BlockHits {
            sure,
            doubtful: candidates & !sure & !apart & !outside,
        }
    }
}

// Functions, not closures: only they can be made to inline into the caller's instructions.
impl<S: Simd> BoxFilter<S> {
    #[inline(always)]
    fn near_plane(&self, s: S, node: &WideNode, axis: usize) -> S::F {
        S::F::load(s, self.near[axis].of(node)).mul_add(self.inverse[axis], self.near_offset[axis])
    }

    #[inline(always)]
    fn far_plane(&self, s: S, node: &WideNode, axis: usize) -> S::F {
        S::F::load(s, self.far[axis].of(node)).mul_add(self.inverse[axis], self.far_offset[axis])
    }
}

/// What a block's test found: bit masks of lanes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BlockHits {
    /// Lanes that are hit for certain.
    pub(crate) sure: u32,
    /// Lanes that only double precision can decide.
    pub(crate) doubtful: u32,
}
