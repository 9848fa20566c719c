//! The section of a block's triangles with the plane of a fan, in lanes of double precision.
//!
//! Sides and coordinates are computed once a vertex, crossings once for each triangle that is cut, up to eight at a time.
//! Only what is close to p or the light, edge-on, or in the plane is left to the scalar code.

use glam::Vec3;

use super::FanReport;
use super::gaps::Gaps;
use super::plane::{Crossing, FanPlane, Shadow, WIDEST_BRIDGE, shadow_in_doubt};
use crate::block::{BLOCK, TriangleBlock};
use crate::lanes::{Doubles, Simd};

/// What the fan sees of eight vertices.
#[derive(Clone, Copy)]
struct Eight<S: Simd> {
    /// Proportional to the distance from the plane; its sign is that of exact arithmetic where it is not `doubtful`.
    side: S::D,
    alpha: S::D,
    height: S::D,
    doubtful: u32,
}

#[inline(always)]
fn eight<S: Simd>(s: S, fan: &FanPlane, u: &[f32; 8], v: &[f32; 8], k: &[f32; 8]) -> Eight<S> {
    let u = S::D::widen(s, u).sub(S::D::splat(s, fan.from[0]));
    let v = S::D::widen(s, v).sub(S::D::splat(s, fan.from[1]));
    let k = S::D::widen(s, k).sub(S::D::splat(s, fan.from[2]));
    let side = dot(s, &fan.normal, u, v, k);
    let doubt = dot(s, &fan.permanent, u.abs(), v.abs(), k.abs());
    let [au, av] = fan.alpha;
    let [hu, hv] = fan.height;
    Eight {
        side,
        alpha: S::D::splat(s, au).mul(u).add(S::D::splat(s, av).mul(v)),
        height: S::D::splat(s, hu).mul(u).add(S::D::splat(s, hv).mul(v)),
        doubtful: side.abs().le(doubt),
    }
}

#[inline(always)]
fn dot<S: Simd>(s: S, g: &[f64; 3], u: S::D, v: S::D, k: S::D) -> S::D {
    let uv = S::D::splat(s, g[0]).mul(u).add(S::D::splat(s, g[1]).mul(v));
    uv.add(S::D::splat(s, g[2]).mul(k))
}

/// Blocks what the triangles of a block hide, and says whether that changed anything.
#[inline(always)]
pub(super) fn block_by_section<S: Simd>(
    s: S,
    fan: &FanPlane,
    block: &TriangleBlock,
    gaps: &mut Gaps,
    report: &mut FanReport,
) -> bool {
    let [u, v, k] = fan.axes;
    let (u, _) = u.of(&block.vertices).as_chunks::<8>();
    let (v, _) = v.of(&block.vertices).as_chunks::<8>();
    let (k, _) = k.of(&block.vertices).as_chunks::<8>();
    let mut low = eight(s, fan, &u[0], &v[0], &k[0]);
    let mut high = eight(s, fan, &u[1], &v[1], &k[1]);
    let mut changed = false;
    let doubtful = low.doubtful | high.doubtful << 8;
    if doubtful != 0 {
        let mut sides = [low.side.store(), high.side.store()];
        let zero = decide_sides(fan, block, doubtful, &mut sides);
        low.side = S::D::load(s, &sides[0]);
        high.side = S::D::load(s, &sides[1]);
        if zero.count_ones() >= 2 {
            let alpha = [low.alpha.store(), high.alpha.store()];
            let height = [low.height.store(), high.height.store()];
            changed |= block_by_edges(fan, block, &sides, &alpha, &height, gaps);
        }
    }
    let nothing = S::D::splat(s, 0.0);
    let below = low.side.lt(nothing) | high.side.lt(nothing) << 8;
    let corners = &block.corners;
    let a = s.permute_bits(below, &corners[0]);
    let b = s.permute_bits(below, &corners[1]);
    let c = s.permute_bits(below, &corners[2]);
    let mut cut = ((a ^ b) | (a ^ c)) & block.used;
    report.triangles += cut.count_ones();
    let (side, alpha, height) = (
        [low.side, high.side],
        [low.alpha, high.alpha],
        [low.height, high.height],
    );
    while cut != 0 {
        let group = if cut.count_ones() > 8 { cut & 0xff } else { cut };
        cut &= !group;
        // The vertex that is alone on its side, and the two others in turn.
        let a_alone = s.spread(s.compress_bits(!(b ^ c), group));
        let b_alone = s.spread(s.compress_bits(!(a ^ c), group));
        let c_alone = s.spread(s.compress_bits(!(a ^ b), group));
        let a = s.compress_bytes(&corners[0], group);
        let b = s.compress_bytes(&corners[1], group);
        let c = s.compress_bytes(&corners[2], group);
        let lone = (a & a_alone) | (b & b_alone) | (c & c_alone);
        let next = (b & a_alone) | (c & b_alone) | (a & c_alone);
        let last = (c & a_alone) | (a & b_alone) | (b & c_alone);
        let lone_side = s.pick(&side, lone);
        let lone_alpha = s.pick(&alpha, lone);
        let lone_height = s.pick(&height, lone);
        // In which order the ends of an edge are weighted follows from their sides only, so that both faces of an edge get the
        // same bits: from the vertex below to the one above. A change of sign is exact.
        let sign = S::D::splat(s, 1.0).or_else(lone_side.lt(nothing), S::D::splat(s, -1.0));
        let lanes = (1u32 << group.count_ones()) - 1;
        let mut t = [nothing; 2];
        let (mut ahead, mut between) = ([0; 2], lanes);
        for (i, other) in [next, last].into_iter().enumerate() {
            let other_side = s.pick(&side, other);
            let other_alpha = s.pick(&alpha, other);
            let other_height = s.pick(&height, other);
            let alpha = other_side
                .mul(lone_alpha)
                .sub(lone_side.mul(other_alpha))
                .mul(sign);
            let height = other_side
                .mul(lone_height)
                .sub(lone_side.mul(other_height))
                .mul(sign);
            // Adding zero turns a negative zero into a positive one.
            let height = height.add(nothing);
            let weight = other_side.sub(lone_side).mul(sign);
            let slack = weight.mul(S::D::splat(s, fan.margin));
            t[i] = alpha.div(height);
            ahead[i] = nothing.le(height);
            // Before the light and away from p, beyond doubt.
            between &= slack.lt(height) & height.lt(weight.sub(slack));
        }
        let order = t[0].lt(t[1]);
        let lo = t[0].or_else(order, t[1]);
        let hi = t[1].or_else(order, t[0]);
        let [first, end] = gaps.hull();
        let seen = lo.lt(S::D::splat(s, end)) & S::D::splat(s, first).lt(hi);
        let both_ahead = ahead[0] & ahead[1];
        let live = lanes & (seen | !both_ahead);
        if live == 0 {
            continue;
        }
        // The whole cut lies between p and the light, and is not seen edge-on.
        let sure = live & between & S::D::splat(s, WIDEST_BRIDGE).lt(hi.sub(lo));
        let (lo, hi) = (lo.store(), hi.store());
        let mut bits = sure;
        while bits != 0 {
            let lane = (bits.trailing_zeros() & 7) as usize;
            bits &= bits - 1;
            changed |= gaps.block(lo[lane], hi[lane]);
        }
        let mut bits = live & !sure;
        if bits != 0 {
            let t = [t[0].store(), t[1].store()];
            while bits != 0 {
                let lane = (bits.trailing_zeros() & 7) as usize;
                bits &= bits - 1;
                let crossing = |i: usize| Crossing {
                    t: t[i][lane],
                    ahead: ahead[i] >> lane & 1 == 1,
                };
                let triangle = [lone, next, last].map(|bytes| block.vertex((bytes >> (8 * lane)) as u8));
                changed |= apply(shadow_in_doubt(fan, triangle, crossing(0), crossing(1)), gaps);
            }
        }
    }
    changed
}

/// Puts exact signs in place of doubtful ones, and says which vertices lie in the plane.
#[cold]
#[inline(never)]
fn decide_sides(fan: &FanPlane, block: &TriangleBlock, doubtful: u32, sides: &mut [[f64; 8]; 2]) -> u32 {
    let mut zero = 0;
    for place in 0..BLOCK {
        if doubtful >> place & 1 == 1 {
            let side = fan.exact_side(block.vertex(place as u8).as_dvec3());
            sides[place / 8][place % 8] = side;
            zero |= u32::from(side == 0.0) << place;
        }
    }
    zero
}

/// Triangles above the plane but for an edge that lies exactly in it: edges belong to their triangles.
#[cold]
#[inline(never)]
fn block_by_edges(
    fan: &FanPlane,
    block: &TriangleBlock,
    sides: &[[f64; 8]; 2],
    alpha: &[[f64; 8]; 2],
    height: &[[f64; 8]; 2],
    gaps: &mut Gaps,
) -> bool {
    let mut changed = false;
    for lane in (0..BLOCK).filter(|lane| block.used >> lane & 1 == 1) {
        let places = block.corners.map(|row| usize::from(row[lane]) & (BLOCK - 1));
        let side = |place: usize| sides[place / 8][place % 8];
        let [u, v, w] = places;
        let (x, y) = match places.map(|place| side(place) == 0.0) {
            [true, true, false] if side(w) > 0.0 => (u, v),
            [false, true, true] if side(u) > 0.0 => (v, w),
            [true, false, true] if side(v) > 0.0 => (w, u),
            _ => continue,
        };
        let at = |place: usize| Crossing::at(alpha[place / 8][place % 8], height[place / 8][place % 8]);
        let triangle: [Vec3; 3] = block.triangle(lane);
        changed |= apply(shadow_in_doubt(fan, triangle, at(x), at(y)), gaps);
    }
    changed
}

#[inline(always)]
fn apply(shadow: Shadow, gaps: &mut Gaps) -> bool {
    let [[lo0, hi0], [lo1, hi1]] = shadow.blocks;
    let [lo, hi] = shadow.bridge;
    gaps.bridge(lo, hi);
    gaps.block(lo0, hi0) | gaps.block(lo1, hi1)
}
