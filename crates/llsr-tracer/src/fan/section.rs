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

/// Up to so many pieces of what is visible it pays to compare with each before they are cut.
const FEW_GAPS: usize = 4;

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

/// Blocks what the given triangles of a block hide, and says whether that changed anything.
#[inline(always)]
pub(super) fn block_by_section<S: Simd>(
    s: S,
    fan: &FanPlane,
    block: &TriangleBlock,
    lanes: u32,
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
            changed |= block_by_edges(fan, block, lanes, &sides, &alpha, &height, gaps);
        }
    }
    let nothing = S::D::splat(s, 0.0);
    let below = low.side.lt(nothing) | high.side.lt(nothing) << 8;
    let corners = &block.corners;
    let a = s.permute_bits(below, &corners[0]);
    let b = s.permute_bits(below, &corners[1]);
    let c = s.permute_bits(below, &corners[2]);
    let mut cut = ((a ^ b) | (a ^ c)) & lanes;
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
        let mut seen = lo.lt(S::D::splat(s, end)) & S::D::splat(s, first).lt(hi);
        if (2..=FEW_GAPS).contains(&gaps.as_slice().len()) {
            let mut inside = 0;
            for gap in gaps.as_slice() {
                inside |= lo.lt(S::D::splat(s, gap[1])) & S::D::splat(s, gap[0]).lt(hi);
            }
            seen &= inside;
        }
        let both_ahead = ahead[0] & ahead[1];
        let live = lanes & (seen | !both_ahead);
        if live == 0 {
            continue;
        }
        // The whole cut lies between p and the light, and is not seen edge-on.
        let sure = live & between & S::D::splat(s, WIDEST_BRIDGE).lt(hi.sub(lo));
        let (los, his) = (lo.store(), hi.store());
        let mut bits = sure;
        while bits != 0 {
            let lane = (bits.trailing_zeros() & 7) as usize;
            bits &= bits - 1;
            // Neighbours make one interval, which cuts the rest of the light into fewer pieces.
            let (mut first, mut last) = (los[lane], his[lane]);
            while bits != 0 {
                let joined = bits & lo.le(S::D::splat(s, last)) & S::D::splat(s, first).le(hi);
                if joined == 0 {
                    break;
                }
                let lane = (joined.trailing_zeros() & 7) as usize;
                bits &= !(1 << lane);
                (first, last) = (first.min(los[lane]), last.max(his[lane]));
            }
            changed |= gaps.block(first, last);
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
    lanes: u32,
    sides: &[[f64; 8]; 2],
    alpha: &[[f64; 8]; 2],
    height: &[[f64; 8]; 2],
    gaps: &mut Gaps,
) -> bool {
    let mut changed = false;
    for lane in (0..BLOCK).filter(|lane| lanes >> lane & 1 == 1) {
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

/// A vertex as the fan sees it, by the same expressions as in lanes.
#[derive(Clone, Copy)]
struct FanVertex {
    side: f64,
    alpha: f64,
    height: f64,
}

impl FanVertex {
    #[inline(always)]
    fn new(fan: &FanPlane, v: Vec3) -> Self {
        let turned = v.to_array();
        let [u, v, k] = fan.axes;
        let (u, v, k) = (
            f64::from(*u.of(&turned)),
            f64::from(*v.of(&turned)),
            f64::from(*k.of(&turned)),
        );
        let (u, v, k) = (u - fan.from[0], v - fan.from[1], k - fan.from[2]);
        let [nu, nv, nk] = fan.normal;
        let [mu, mv, mk] = fan.permanent;
        let mut side = (nu * u + nv * v) + nk * k;
        if side.abs() <= (mu * u.abs() + mv * v.abs()) + mk * k.abs() {
            side = fan.exact_side(Vec3::from_array(turned).as_dvec3());
        }
        Self {
            side,
            alpha: fan.alpha[0] * u + fan.alpha[1] * v,
            height: fan.height[0] * u + fan.height[1] * v,
        }
    }
}

/// The same for a few triangles, one after the other; the scalar twin of [`block_by_section`], with the same bits.
#[inline(always)]
pub(super) fn block_by_each(
    fan: &FanPlane,
    block: &TriangleBlock,
    mut lanes: u32,
    gaps: &mut Gaps,
    report: &mut FanReport,
) -> bool {
    let mut changed = false;
    while lanes != 0 {
        let lane = (lanes.trailing_zeros() & 15) as usize;
        lanes &= lanes - 1;
        changed |= block_by_triangle(fan, block.triangle(lane), gaps, report);
    }
    changed
}

#[inline(always)]
fn block_by_triangle(fan: &FanPlane, triangle: [Vec3; 3], gaps: &mut Gaps, report: &mut FanReport) -> bool {
    let [a, b, c] = [
        FanVertex::new(fan, triangle[0]),
        FanVertex::new(fan, triangle[1]),
        FanVertex::new(fan, triangle[2]),
    ];
    let (na, nb, nc) = (a.side < 0.0, b.side < 0.0, c.side < 0.0);
    if na == nb && nb == nc {
        // An edge in the plane, below the rest.
        let (x, y) = match [a, b, c].map(|x| x.side == 0.0) {
            [true, true, false] if !nc => (a, b),
            [false, true, true] if !na => (b, c),
            [true, false, true] if !nb => (c, a),
            _ => return false,
        };
        let at = |x: FanVertex| Crossing::at(x.alpha, x.height);
        return apply(shadow_in_doubt(fan, triangle, at(x), at(y)), gaps);
    }
    report.triangles += 1;
    // The vertex that is alone on its side, and the two others in turn.
    let (lone, next, last, turned) = if nb == nc {
        (a, b, c, triangle)
    } else if na == nc {
        (b, c, a, [triangle[1], triangle[2], triangle[0]])
    } else {
        (c, a, b, [triangle[2], triangle[0], triangle[1]])
    };
    let sign = if lone.side < 0.0 { 1.0 } else { -1.0 };
    let (c0, between0) = crossing(fan, lone, next, sign);
    let (c1, between1) = crossing(fan, lone, last, sign);
    let (lo, hi) = if c0.t < c1.t { (c0.t, c1.t) } else { (c1.t, c0.t) };
    if c0.ahead && c1.ahead && !gaps.meets(lo, hi) {
        return false;
    }
    if between0 && between1 && hi - lo > WIDEST_BRIDGE {
        return gaps.block(lo, hi);
    }
    apply(shadow_in_doubt(fan, turned, c0, c1), gaps)
}

/// Where the edge between two vertices on different sides crosses the plane, and whether that is before the light and away
/// from p, beyond doubt.
#[inline(always)]
fn crossing(fan: &FanPlane, lone: FanVertex, other: FanVertex, sign: f64) -> (Crossing, bool) {
    let alpha = (other.side * lone.alpha - lone.side * other.alpha) * sign;
    let height = (other.side * lone.height - lone.side * other.height) * sign + 0.0;
    let weight = (other.side - lone.side) * sign;
    let slack = weight * fan.margin;
    let crossing = Crossing {
        t: alpha / height,
        ahead: height >= 0.0,
    };
    (crossing, slack < height && height < weight - slack)
}

#[inline(always)]
fn apply(shadow: Shadow, gaps: &mut Gaps) -> bool {
    let [[lo0, hi0], [lo1, hi1]] = shadow.blocks;
    let [lo, hi] = shadow.bridge;
    gaps.bridge(lo, hi);
    gaps.block(lo0, hi0) | gaps.block(lo1, hi1)
}
