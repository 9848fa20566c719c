//! The traversal of one tree by a fan.

use super::blockers::Blockers;
use super::boxes::BoxFilter;
use super::gaps::{Gaps, Keep};
use super::plane::FanPlane;
use super::section::{block_by_each, block_by_section};
use super::shapes::block_shape;
use super::{FanReport, FanScratch};
use crate::block::TriangleBlock;
use crate::build::{ChildRef, STACK, WIDTH, WideTree};
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
    /// Whether what hid the light from the last point is asked first.
    pub(super) follow: bool,
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
            follow,
            scratch,
            report,
        } = self;
        let FanScratch {
            gaps,
            stack,
            blockers,
            ..
        } = scratch;
        if !follow {
            let leaf = TriangleLeaf { geometry };
            walk(s, &geometry.tree, fan, limits, gaps, stack, report, leaf);
            return;
        }
        blockers.begin(fan.a, fan.b, gaps.keep(), gaps.length());
        let leaf = Following {
            leaf: TriangleLeaf { geometry },
            blockers,
        };
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
    /// Blocks what is known beforehand, and says whether that may have hidden anything.
    fn begin(
        &mut self,
        s: S,
        filter: &BoxFilter,
        fan: &FanPlane,
        gaps: &mut Gaps,
        report: &mut FanReport,
    ) -> bool;

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

    /// Says that a leaf will be visited soon.
    fn expect(&self, s: S, at: ChildRef);

    /// All is known.
    #[inline(always)]
    fn end(&mut self) {}
}

struct TriangleLeaf<'a> {
    geometry: &'a Geometry,
}

impl<S: Simd> Leaf<S> for TriangleLeaf<'_> {
    #[inline(always)]
    fn begin(&mut self, _: S, _: &BoxFilter, _: &FanPlane, _: &mut Gaps, _: &mut FanReport) -> bool {
        false
    }

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
        let lanes = filter.cuts(s, block);
        lanes != 0 && block_by(s, fan, block, lanes, gaps, report)
    }

    #[inline(always)]
    fn expect(&self, s: S, at: ChildRef) {
        if at.is_block() {
            s.prefetch(&self.geometry.blocks[at.index()]);
        }
    }
}

/// Asks first what hid the light before, and remembers what hides it now.
struct Following<'a> {
    leaf: TriangleLeaf<'a>,
    blockers: &'a mut Blockers,
}

impl<S: Simd> Leaf<S> for Following<'_> {
    #[inline(always)]
    fn begin(
        &mut self,
        s: S,
        filter: &BoxFilter,
        fan: &FanPlane,
        gaps: &mut Gaps,
        report: &mut FanReport,
    ) -> bool {
        let mut changed = false;
        let mut index = 0;
        while let Some(at) = self.blockers.remembered(index) {
            index += 1;
            // It may be of another scene.
            let geometry = self.leaf.geometry;
            let exists = if at.is_block() {
                at.index() < geometry.blocks.len()
            } else {
                !at.is_node() && at.index() < geometry.shapes.len()
            };
            changed |= exists && self.block(s, at, filter, fan, gaps, report);
            if gaps.is_empty() {
                break;
            }
        }
        changed
    }

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
        let before = gaps.length();
        let changed = self.leaf.block(s, at, filter, fan, gaps, report);
        if changed {
            self.blockers.found(at, before - gaps.length());
        }
        changed
    }

    #[inline(always)]
    fn expect(&self, s: S, at: ChildRef) {
        self.leaf.expect(s, at);
    }

    #[inline(always)]
    fn end(&mut self) {
        self.blockers.end();
    }
}

struct PartLeaf<V> {
    visit: V,
}

impl<S: Simd, V: FnMut(usize, &mut Gaps, &mut FanReport)> Leaf<S> for PartLeaf<V> {
    #[inline(always)]
    fn begin(&mut self, _: S, _: &BoxFilter, _: &FanPlane, _: &mut Gaps, _: &mut FanReport) -> bool {
        false
    }

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

    #[inline(always)]
    fn expect(&self, _: S, _: ChildRef) {}
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
    let Some(mut filter) = BoxFilter::new(fan, &tree.bounds, hull) else {
        report.complete &= tree.bounds.is_empty();
        return;
    };
    if leaf.begin(s, &filter, fan, gaps, report) {
        if gaps.is_empty() {
            leaf.end();
            return;
        }
        hull = gaps.hull();
        filter.narrow(hull);
    }
    stack.clear();
    stack.reserve(STACK);
    let mut at = ChildRef::default();
    'all: loop {
        if report.visits() >= limits.budget {
            report.complete = false;
            break;
        }
        if at.is_node() {
            report.nodes += 1;
            let node = &tree.nodes[at.index()];
            let met = filter.meets(s, node);
            let mut mask = met.mask;
            report.pruned_missed += WIDTH_U32 - mask.count_ones();
            let first = stack.len();
            // The nearest waits on top: of equally dense surfaces it hides most at the least cost. Where only the gap at one end
            // is asked for, that which may hide most of it waits on top.
            let mut keys = [0f32; WIDTH];
            while mask != 0 {
                let slot = (mask.trailing_zeros() & 7) as usize;
                mask &= mask - 1;
                let at = node.children[slot];
                let bounded = met.bounded >> slot & 1 == 1;
                let entry = Waiting {
                    at,
                    t_min: if bounded {
                        met.t_min[slot]
                    } else {
                        f32::NEG_INFINITY
                    },
                    t_max: if bounded { met.t_max[slot] } else { f32::INFINITY },
                };
                if limits.prune && !gaps.meets(f64::from(entry.t_min), f64::from(entry.t_max)) {
                    report.pruned_blocked += 1;
                    continue;
                }
                if at.is_node() {
                    s.prefetch(&tree.nodes[at.index()]);
                } else {
                    leaf.expect(s, at);
                }
                let key = match gaps.keep() {
                    Keep::All => -met.near[slot],
                    Keep::First => -entry.t_min,
                    Keep::Last => entry.t_max,
                };
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
                break;
            }
            let now = gaps.hull();
            if now != hull {
                hull = now;
                filter.narrow(hull);
            }
        }
        at = loop {
            let Some(next) = stack.pop() else { break 'all };
            if !limits.prune || gaps.meets(f64::from(next.t_min), f64::from(next.t_max)) {
                break next.at;
            }
            report.pruned_blocked += 1;
        };
    }
    leaf.end();
}

/// Asks each of `leaves`, blocks with the triangles in question and shapes, until nothing is visible any more.
#[inline(always)]
pub(super) fn walk_leaves<S: Simd>(
    s: S,
    geometry: &Geometry,
    fan: &FanPlane,
    leaves: impl Iterator<Item = (ChildRef, u32)>,
    gaps: &mut Gaps,
    report: &mut FanReport,
) {
    for (at, lanes) in leaves {
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
        block_by(s, fan, block, lanes, gaps, report);
    }
}

/// Up to so many triangles it costs less to ask each than to prepare the whole block.
const FEW: u32 = 2;

/// Blocks what the given triangles hide, and says whether that changed anything.
#[inline(always)]
fn block_by<S: Simd>(
    s: S,
    fan: &FanPlane,
    block: &TriangleBlock,
    lanes: u32,
    gaps: &mut Gaps,
    report: &mut FanReport,
) -> bool {
    if lanes.count_ones() <= FEW {
        block_by_each(fan, block, lanes, gaps, report)
    } else {
        block_by_section(s, fan, block, lanes, gaps, report)
    }
}

const WIDTH_U32: u32 = WIDTH as u32;
