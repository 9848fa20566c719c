//! The traversal of one tree by a fan.

use glam::{DVec3, Vec3};

use super::boxes::BoxFilter;
use super::gaps::Gaps;
use super::plane::{FanPlane, FanVertex, Shadow, crossing, shadow};
use super::shapes::block_shape;
use super::{FanReport, FanScratch};
use crate::build::{ChildRef, STACK, WideTree};
use crate::lanes::{Kernel, Simd};
use crate::part::Geometry;

/// A subtree that waits, with the light parameters that it may hide.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Waiting {
    at: ChildRef,
    t_min: f32,
    t_max: f32,
}

/// What limits a traversal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// The most nodes, blocks and shapes to visit.
    pub(super) budget: u32,
    /// Whether subtrees whose light parameters are blocked already are left out.
    pub(super) prune: bool,
}

/// One fan through the geometry of one part, in that part's frame.
pub(super) struct FanThroughPart<'a> {
    pub(super) geometry: &'a Geometry,
    pub(super) fan: &'a FanPlane,
    pub(super) limits: Limits,
    pub(super) scratch: &'a mut FanScratch,
    pub(super) report: &'a mut FanReport,
}

impl Kernel for FanThroughPart<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self {
            geometry,
            fan,
            limits,
            scratch,
            report,
        } = self;
        let FanScratch { gaps, stack, .. } = scratch;
        let leaf = TriangleLeaf { geometry };
        walk(s, &geometry.tree, fan, limits, gaps, stack, report, leaf);
    }
}

/// One fan through the tree of parts; `visit` is called for each part that it may meet.
pub(super) struct FanThroughParts<'a, V> {
    pub(super) top: &'a WideTree,
    pub(super) fan: &'a FanPlane,
    pub(super) limits: Limits,
    pub(super) visit: V,
    pub(super) stack: &'a mut Vec<Waiting>,
    pub(super) gaps: &'a mut Gaps,
    pub(super) report: &'a mut FanReport,
}

impl<V: FnMut(usize, &mut Gaps, &mut FanReport)> Kernel for FanThroughParts<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let leaf = PartLeaf { visit: self.visit };
        walk(
            s,
            self.top,
            self.fan,
            self.limits,
            self.gaps,
            self.stack,
            self.report,
            leaf,
        );
    }
}

/// What happens at the leaves; a trait, because closures are not compiled with the caller's instructions.
trait Leaf<S: Simd> {
    /// Blocks what the leaf hides, and says whether it may have hidden anything.
    fn block(
        &mut self,
        s: S,
        at: ChildRef,
        filter: &BoxFilter,
        fan: &FanPlane,
        gaps: &mut Gaps,
        report: &mut FanReport,
    ) -> bool;
}

struct TriangleLeaf<'a> {
    geometry: &'a Geometry,
}

impl<S: Simd> Leaf<S> for TriangleLeaf<'_> {
    #[inline(always)]
    fn block(
        &mut self,
        s: S,
        at: ChildRef,
        filter: &BoxFilter,
        fan: &FanPlane,
        gaps: &mut Gaps,
        report: &mut FanReport,
    ) -> bool {
        if !at.is_block() {
            report.shapes += 1;
            return block_shape(&self.geometry.shapes[at.index()], fan.p, fan.a, fan.b, gaps);
        }
        report.blocks += 1;
        let block = &self.geometry.blocks[at.index()];
        let mut mask = filter.cuts(s, block);
        let mut changed = false;
        while mask != 0 {
            let lane = (mask.trailing_zeros() & 15) as usize;
            mask &= mask - 1;
            changed |= block_by_triangle(fan, block.triangle(lane), gaps, report);
        }
        changed
    }
}

struct PartLeaf<V> {
    visit: V,
}

impl<S: Simd, V: FnMut(usize, &mut Gaps, &mut FanReport)> Leaf<S> for PartLeaf<V> {
    #[inline(always)]
    fn block(
        &mut self,
        _: S,
        at: ChildRef,
        _: &BoxFilter,
        _: &FanPlane,
        gaps: &mut Gaps,
        report: &mut FanReport,
    ) -> bool {
        (self.visit)(at.index(), gaps, report);
        true
    }
}

/// Visits what the fan may meet, down to the leaves, until nothing is visible any more.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "one caller each for trees of triangles and of parts"
)]
fn walk<S: Simd>(
    s: S,
    tree: &WideTree,
    fan: &FanPlane,
    limits: Limits,
    gaps: &mut Gaps,
    stack: &mut Vec<Waiting>,
    report: &mut FanReport,
    mut leaf: impl Leaf<S>,
) {
    if gaps.is_empty() {
        return;
    }
    let mut hull = gaps.hull();
    let mut filter = BoxFilter::new(fan, &tree.bounds, hull);
    stack.clear();
    stack.reserve(STACK);
    let mut at = ChildRef::default();
    loop {
        if report.visits() >= limits.budget {
            report.complete = false;
            return;
        }
        if at.is_node() {
            report.nodes += 1;
            let node = &tree.nodes[at.index()];
            let met = filter.meets(s, node);
            let mut mask = met.mask;
            report.pruned_missed += WIDTH_U32 - mask.count_ones();
            let first = stack.len();
            // The nearest waits on top: of equally dense surfaces it hides most at the least cost.
            let mut keys = [0f32; crate::build::WIDTH];
            while mask != 0 {
                let slot = (mask.trailing_zeros() & 7) as usize;
                mask &= mask - 1;
                let entry = Waiting {
                    at: node.children[slot],
                    t_min: met.t_min[slot],
                    t_max: met.t_max[slot],
                };
                if limits.prune && !gaps.meets(f64::from(entry.t_min), f64::from(entry.t_max)) {
                    report.pruned_blocked += 1;
                    continue;
                }
                let key = -met.near[slot];
                let mut place = stack.len();
                stack.push(entry);
                while place > first && keys[place - first - 1] > key {
                    stack[place] = stack[place - 1];
                    keys[place - first] = keys[place - first - 1];
                    place -= 1;
                }
                stack[place] = entry;
                keys[place - first] = key;
            }
        } else if leaf.block(s, at, &filter, fan, gaps, report) && limits.prune {
            if gaps.is_empty() {
                return;
            }
            let now = gaps.hull();
            if now != hull {
                hull = now;
                filter.narrow(fan, hull);
            }
        }
        at = loop {
            let Some(next) = stack.pop() else { return };
            if !limits.prune || gaps.meets(f64::from(next.t_min), f64::from(next.t_max)) {
                break next.at;
            }
            report.pruned_blocked += 1;
        };
    }
}

/// Asks each of `leaves`, blocks with the triangles in question and shapes, until nothing is visible any more.
#[inline(always)]
pub(super) fn walk_leaves<S: Simd>(
    s: S,
    geometry: &Geometry,
    fan: &FanPlane,
    filter: bool,
    leaves: impl Iterator<Item = (ChildRef, u32)>,
    gaps: &mut Gaps,
    report: &mut FanReport,
) {
    let filter = if filter {
        Some(BoxFilter::new(fan, &geometry.tree.bounds, gaps.hull()))
    } else {
        None
    };
    for (at, mut lanes) in leaves {
        if gaps.is_empty() {
            return;
        }
        if !at.is_block() {
            report.shapes += 1;
            block_shape(&geometry.shapes[at.index()], fan.p, fan.a, fan.b, gaps);
            continue;
        }
        report.blocks += 1;
        let block = &geometry.blocks[at.index()];
        if let Some(filter) = &filter {
            lanes &= filter.cuts(s, block);
        }
        while lanes != 0 {
            let lane = (lanes.trailing_zeros() & 15) as usize;
            lanes &= lanes - 1;
            block_by_triangle(fan, block.triangle(lane), gaps, report);
        }
    }
}

const WIDTH_U32: u32 = crate::build::WIDTH as u32;

/// Blocks what a triangle hides.
#[inline(always)]
fn block_by_triangle(fan: &FanPlane, triangle: [Vec3; 3], gaps: &mut Gaps, report: &mut FanReport) -> bool {
    let [u, v, w] = triangle;
    let (u, v, w) = (
        fan.vertex(DVec3::from(u)),
        fan.vertex(DVec3::from(v)),
        fan.vertex(DVec3::from(w)),
    );
    let (nu, nv, nw) = (u.side < 0.0, v.side < 0.0, w.side < 0.0);
    if nu == nv && nv == nw {
        return !nu && block_by_edge(fan, triangle, [u, v, w], gaps);
    }
    report.triangles += 1;
    // The vertex that is alone on its side, and the two others.
    let (lone, x, y) = if nv == nw {
        (u, v, w)
    } else if nu == nw {
        (v, w, u)
    } else {
        (w, u, v)
    };
    let (c0, c1) = if lone.side < 0.0 {
        (crossing(fan, &lone, &x), crossing(fan, &lone, &y))
    } else {
        (crossing(fan, &x, &lone), crossing(fan, &y, &lone))
    };
    if c0.ahead && c1.ahead && !gaps.meets(c0.t.min(c1.t), c0.t.max(c1.t)) {
        return false;
    }
    apply(shadow(fan, triangle, c0, c1), gaps)
}

/// A triangle above the plane but for an edge that lies exactly in it: edges belong to their triangles.
#[inline(always)]
fn block_by_edge(fan: &FanPlane, triangle: [Vec3; 3], vertices: [FanVertex; 3], gaps: &mut Gaps) -> bool {
    let [u, v, w] = vertices;
    let (x, y) = match [u, v, w].map(|x| x.side == 0.0) {
        [true, true, false] => (u, v),
        [false, true, true] => (v, w),
        [true, false, true] => (w, u),
        _ => return false,
    };
    apply(shadow(fan, triangle, x.direction(), y.direction()), gaps)
}

#[inline(always)]
fn apply(shadow: Shadow, gaps: &mut Gaps) -> bool {
    match shadow {
        Shadow::Blocks([[lo0, hi0], [lo1, hi1]]) => gaps.block(lo0, hi0) | gaps.block(lo1, hi1),
        Shadow::Bridges([lo, hi]) => {
            gaps.bridge(lo, hi);
            false
        }
        Shadow::Nothing => false,
    }
}
