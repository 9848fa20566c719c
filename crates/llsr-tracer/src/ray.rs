//! Rays against boxes and blocks in single precision, as filters with proven bounds.
//!
//! A ray is scaled so that the largest component of its direction is 1 and that axis is `z` after a permutation;
//! its parameter is then the distance along that axis. Errors that do not depend on the single box or triangle
//! are bounded once a ray.

use glam::DVec3;

use crate::block::TriangleBlock;
use crate::build::WideNode;
use crate::lanes::Simd;

/// Unit roundoff of `f32`.
const U: f32 = f32::EPSILON / 2.0;

/// A ray prepared for the filters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayFilter {
    origin: [f32; 3],
    /// Reciprocal direction.
    inverse: [f32; 3],
    /// What to add to `bound * inverse` for the nearer and the farther plane, padding included.
    near_offset: [f32; 3],
    far_offset: [f32; 3],
    /// Which of [`WideNode::bounds`] is nearer and farther on each axis.
    near: [usize; 3],
    far: [usize; 3],
    /// The axis permutation: the last is the axis of the largest component.
    axes: [usize; 3],
    /// Slopes over the last axis.
    shear: [f32; 2],
    /// Direction along the last axis, 1 or -1.
    sign: f32,
    /// Bound of the error of a sheared vertex coordinate (m).
    error: f32,
}

impl RayFilter {
    /// Prepares a ray for geometry whose coordinates are at most `reach` in absolute value. Also gives the factor
    /// from parameters of `direction` to those of the filter. `None` if the direction is zero or anything is not finite.
    #[inline(always)]
    pub(crate) fn new(origin: DVec3, direction: DVec3, reach: f32) -> Option<(Self, f64)> {
        let size = direction.abs();
        let last = if size.x > size.y {
            if size.x > size.z { 0 } else { 2 }
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let longest = size[last];
        if !(longest > 0.0 && (1.0 / longest).is_finite() && (origin + direction).is_finite()) {
            return None;
        }
        let d = direction / longest;
        // Origins beyond the range of f32 become infinite and see nothing through the filters' NaN.
        let o = origin.as_vec3();
        let scale = reach + o.abs().max_element();
        let mut this = Self {
            origin: o.to_array(),
            inverse: [0.0; 3],
            near_offset: [0.0; 3],
            far_offset: [0.0; 3],
            near: [0; 3],
            far: [0; 3],
            axes: [(last + 1) % 3, (last + 2) % 3, last],
            shear: [0.0; 2],
            sign: if d[last] > 0.0 { 1.0 } else { -1.0 },
            error: 32.0 * U * scale + f32::MIN_POSITIVE,
        };
        // A parameter on the boxes' planes is wrong by at most this many metres times the inverse: rounding of the
        // origin, the direction, its inverse, the offset and the sum. A component below `TINY` moves the ray
        // sideways by less than the padding before it has left the geometry.
        const TINY: f64 = 1.0 / (1u64 << 23) as f64;
        let pad = 16.0 * U * scale;
        for axis in 0..3 {
            let component = if d[axis].abs() < TINY {
                TINY.copysign(d[axis])
            } else {
                d[axis]
            };
            let inverse = (1.0 / component) as f32;
            let offset = -o[axis] * inverse;
            let padding = pad * inverse.abs();
            this.inverse[axis] = inverse;
            this.near_offset[axis] = offset - padding;
            this.far_offset[axis] = offset + padding;
            let negative = inverse < 0.0;
            this.near[axis] = axis + if negative { 3 } else { 0 };
            this.far[axis] = axis + if negative { 0 } else { 3 };
        }
        let last_component = d[last];
        this.shear = [0, 1].map(|i| (d[this.axes[i]] / last_component) as f32);
        Some((this, longest))
    }

    /// The children whose boxes the ray may enter at parameters in [0, `t_max`], and where it enters at the earliest.
    #[inline(always)]
    pub(crate) fn enters<S: Simd>(&self, s: S, node: &WideNode, t_max: f32) -> (u32, S::F) {
        let near = |axis: usize| {
            let bound = s.load(&node.bounds[self.near[axis]]);
            s.mul_add(
                bound,
                s.splat(self.inverse[axis]),
                s.splat(self.near_offset[axis]),
            )
        };
        let far = |axis: usize| {
            let bound = s.load(&node.bounds[self.far[axis]]);
            s.mul_add(bound, s.splat(self.inverse[axis]), s.splat(self.far_offset[axis]))
        };
        let enter = s.max(s.max(near(0), near(1)), s.max(near(2), s.splat(0.0)));
        let leave = s.min(s.min(far(0), far(1)), s.min(far(2), s.splat(t_max)));
        (s.le(enter, leave), enter)
    }

    /// Tests the block's triangles for parameters in [0, `t_max`].
    #[inline(always)]
    pub(crate) fn meets<S: Simd>(&self, s: S, block: &TriangleBlock, t_max: f32) -> BlockHits {
        let [x, y, z] = self.axes;
        let (ox, oy, oz) = (
            s.splat(self.origin[x]),
            s.splat(self.origin[y]),
            s.splat(self.origin[z]),
        );
        let (kx, ky) = (s.splat(self.shear[0]), s.splat(self.shear[1]));
        let sheared = |corner: usize| {
            let v = &block.vertices[corner];
            let depth = s.sub(s.load(&v[z]), oz);
            let across = s.neg_mul_add(kx, depth, s.sub(s.load(&v[x]), ox));
            let along = s.neg_mul_add(ky, depth, s.sub(s.load(&v[y]), oy));
            (across, along, depth)
        };
        let (ax, ay, az) = sheared(0);
        let (bx, by, bz) = sheared(1);
        let (cx, cy, cz) = sheared(2);
        // Edge functions, twice the signed areas of the origin with each edge.
        let u = s.mul_sub(cx, by, s.mul(cy, bx));
        let v = s.mul_sub(ax, cy, s.mul(ay, cx));
        let w = s.mul_sub(bx, ay, s.mul(by, ax));
        let least = s.min(s.min(u, v), w);
        let most = s.max(s.max(u, v), w);
        // Where the ray truly meets the triangle, sheared coordinates are at most 2 edges long and wrong by at
        // most `error`, so an edge function is wrong by less than this.
        let longest = block.longest_edge;
        let tolerance = self.error * (12.0 * longest + 4.0 * self.error) + f32::MIN_POSITIVE;
        let (plus, minus) = (s.splat(tolerance), s.splat(-tolerance));
        let candidates = s.le(minus, least) | s.le(most, plus);
        if candidates == 0 {
            return BlockHits::default();
        }
        let inside = s.lt(plus, least) | s.lt(most, minus);
        let sum = s.add(s.add(u, v), w);
        let depth = s.mul_add(u, az, s.mul_add(v, bz, s.mul(w, cz)));
        let sign = s.splat(self.sign);
        let t = s.mul(s.div(depth, sum), sign);
        // The weights are wrong by 3 tolerance / sum each where the ray is inside.
        let spread = s.splat(4.0 * tolerance * longest);
        let t_error = s.mul_add(spread, s.div(s.splat(4.0), s.abs(sum)), s.splat(4.0 * self.error));
        let above = s.lt(t_error, t);
        let below = s.lt(s.add(t, t_error), s.splat(t_max));
        let sure = candidates & inside & above & below;
        // Where the ray is not surely inside, the whole triangle must lie outside the range to be out of question.
        let (az, bz, cz) = (s.mul(az, sign), s.mul(bz, sign), s.mul(cz, sign));
        let (first, last) = (s.min(s.min(az, bz), cz), s.max(s.max(az, bz), cz));
        let slack = 2.0 * self.error;
        let behind = s.lt(last, s.splat(-slack)) | s.lt(s.splat(t_max + slack), first);
        let surely_out =
            inside & (s.lt(s.add(t, t_error), s.splat(0.0)) | s.lt(s.splat(t_max), s.sub(t, t_error)));
        BlockHits {
            sure,
            doubtful: candidates & !sure & !behind & !surely_out,
        }
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
