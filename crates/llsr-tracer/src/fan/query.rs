//! The public face of fan queries.

use glam::DVec3;
use llsr_scene::SegmentOracle;
use llsr_visibility::{Bracket, Certificate, Panel, Partition};

use super::blockers::Blockers;
use super::gaps::{Gaps, Keep};
use super::plane::FanPlane;
use super::traverse::{FanThroughPart, FanThroughParts, Limits, Waiting};
use crate::Tracer;

/// Which part of the segment `a`-`b` between the parameters `t0` and `t1` does `p` see?
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FanQuery {
    /// The point that looks (m, recentred frame). Start from [`Hit::leave`](crate::Hit::leave).
    pub p: DVec3,
    /// The end of the segment at t = 0 (m).
    pub a: DVec3,
    /// The end of the segment at t = 1 (m).
    pub b: DVec3,
    /// First parameter asked for, at least 0.
    pub t0: f64,
    /// Last parameter asked for, at most 1.
    pub t1: f64,
    /// The most nodes, blocks of triangles and shapes to visit. Where it is spent the answer is incomplete.
    pub budget: u32,
    /// Whether subtrees that hide nothing new are left out. Answers do not depend on it; it is there to measure by.
    pub prune: bool,
}

impl FanQuery {
    /// The whole segment, without a limit.
    pub fn new(p: DVec3, a: DVec3, b: DVec3) -> Self {
        Self {
            p,
            a,
            b,
            t0: 0.0,
            t1: 1.0,
            budget: u32::MAX,
            prune: true,
        }
    }
}

/// What a fan query did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FanReport {
    /// Nodes visited.
    pub nodes: u32,
    /// Blocks of triangles visited.
    pub blocks: u32,
    /// Triangles that the plane of the fan cuts, among those of the blocks.
    pub triangles: u32,
    /// Analytic primitives tested.
    pub shapes: u32,
    /// Subtrees left out because all that they can hide was blocked already.
    pub pruned_blocked: u32,
    /// Subtrees left out because their box misses the fan.
    pub pruned_missed: u32,
    /// Whether the answer is complete: the budget was enough, and every number was finite.
    pub complete: bool,
}

impl FanReport {
    pub(super) fn new() -> Self {
        Self {
            nodes: 0,
            blocks: 0,
            triangles: 0,
            shapes: 0,
            pruned_blocked: 0,
            pruned_missed: 0,
            complete: true,
        }
    }

    /// Nodes, blocks and shapes visited.
    pub fn visits(&self) -> u32 {
        self.nodes + self.blocks + self.shapes
    }
}

/// Working memory of fan queries, kept between them so that none allocates after the first few.
#[derive(Clone, Debug, Default)]
pub struct FanScratch {
    pub(super) gaps: Gaps,
    pub(super) stack: Vec<Waiting>,
    pub(super) blockers: Blockers,
    /// Whether queries with a budget may be helped by what earlier ones found.
    repeatable: bool,
    top: Vec<Waiting>,
}

impl FanScratch {
    /// Forgets the queries before, and lets those from here on help each other even where they have a budget.
    ///
    /// What hid a light from one point is asked first for the next, so that points should come in an order in which neighbours
    /// follow each other. Complete answers do not depend on that, but what a budget is enough for does: by calling this the
    /// caller promises that the sequence of queries from here is the same in every run, on whatever thread.
    /// Otherwise only queries without a budget are helped.
    pub fn begin_sequence(&mut self) {
        self.blockers.clear();
        self.repeatable = true;
    }

    /// Appends what the finished query left unblocked to `visible`, and says if the answer is not complete.
    pub(super) fn write_visible(&mut self, report: &FanReport, visible: &mut Partition) {
        self.gaps.finish();
        for &[lo, hi] in self.gaps.as_slice() {
            visible.push(Panel::exact(lo, hi));
        }
        if !report.complete {
            visible.set_certificate(Certificate::Sampled);
        }
    }
}

impl Tracer {
    /// Writes to `visible` what `query.p` sees of the segment between `query.t0` and `query.t1`.
    ///
    /// The answer agrees with [`occluded`](Self::occluded) except within rounding of the panels' ends; nothing is
    /// missed and nothing invented, however many occluders there are. The certificate is [`Certificate::Exact`]
    /// if the answer is complete, else [`Certificate::Sampled`]: panels then may hold more that is hidden.
    ///
    /// Special cases: If `a` equals `b` all parameters answer alike. If `p` lies on the segment's line, up to about 1e-12 of the angle,
    /// the first surface on that line hides all that is beyond it. If a number is not finite or the range of
    /// parameters is reversed nothing is blocked, as by rays, and the answer counts as incomplete.
    ///
    /// Cost: a fraction of a shadow ray's where the fan meets nothing, a few rays' in a penumbra.
    pub fn fan(&self, query: &FanQuery, scratch: &mut FanScratch, visible: &mut Partition) -> FanReport {
        visible.clear();
        let Some(report) = self.gaps(query, Keep::All, scratch) else {
            visible.fill();
            visible.set_certificate(Certificate::Sampled);
            return FanReport {
                complete: false,
                ..FanReport::new()
            };
        };
        scratch.write_visible(&report, visible);
        report
    }

    /// The exact place of the change of visibility that a search has bracketed, or `None` if there is none: if the end of the bracket
    /// that should be visible is hidden, or all of it is visible.
    ///
    /// Of several changes in the bracket, the one next to its visible end. Cost: that of a shadow ray or two if the
    /// bracket is narrow.
    pub fn polish(
        &self,
        p: DVec3,
        a: DVec3,
        b: DVec3,
        bracket: Bracket,
        scratch: &mut FanScratch,
    ) -> Option<f64> {
        let query = FanQuery {
            t0: bracket.lo,
            t1: bracket.hi,
            ..FanQuery::new(p, a, b)
        };
        let (t0, t1) = (query.t0.max(0.0), query.t1.min(1.0));
        let keep = if bracket.visible_at_lo {
            Keep::First
        } else {
            Keep::Last
        };
        let report = self.gaps(&query, keep, scratch)?;
        scratch.gaps.finish();
        let &[lo, hi] = scratch.gaps.as_slice().first()?;
        let change = if bracket.visible_at_lo { hi } else { lo };
        (report.complete && t0 < change && change < t1).then_some(change)
    }

    /// Leaves in `scratch` what is visible; `None` if the query makes no sense.
    #[inline(always)]
    fn gaps(&self, query: &FanQuery, keep: Keep, scratch: &mut FanScratch) -> Option<FanReport> {
        let FanQuery { p, a, b, .. } = *query;
        let (t0, t1) = (query.t0.max(0.0), query.t1.min(1.0));
        if !(p.is_finite() && a.is_finite() && b.is_finite() && t0 <= t1) {
            return None;
        }
        let mut report = FanReport::new();
        scratch.gaps.reset(t0, t1, keep);
        if let Some(fan) = FanPlane::new(p, a, b) {
            self.fan_in_plane(&fan, query, scratch, &mut report);
        } else {
            self.fan_on_line(p, a, b, &mut scratch.gaps);
        }
        Some(report)
    }

    /// The general case: p and the segment span a plane.
    fn fan_in_plane(
        &self,
        fan: &FanPlane,
        query: &FanQuery,
        scratch: &mut FanScratch,
        report: &mut FanReport,
    ) {
        let limits = Limits {
            budget: query.budget,
            prune: query.prune,
        };
        if let Some(geometry) = self.only_geometry() {
            let follow = query.prune
                && FEW_NODES < geometry.tree.nodes.len()
                && (query.budget == u32::MAX || scratch.repeatable);
            self.level().run(FanThroughPart {
                geometry,
                fan,
                limits,
                follow,
                scratch,
                report,
            });
            return;
        }
        let mut top_stack = std::mem::take(&mut scratch.top);
        let mut gaps = std::mem::take(&mut scratch.gaps);
        self.level().run(FanThroughParts {
            top: self.top(),
            fan,
            limits,
            stack: &mut top_stack,
            gaps: &mut gaps,
            report,
            visit: |index: usize, gaps: &mut Gaps, report: &mut FanReport| {
                let Some((geometry, placement)) = self.part(index) else {
                    return;
                };
                let local = match placement {
                    None => Some(*fan),
                    Some(at) => FanPlane::new(at.localize(fan.p), at.localize(fan.a), at.localize(fan.b)),
                };
                let Some(local) = local else {
                    report.complete = false;
                    return;
                };
                std::mem::swap(&mut scratch.gaps, gaps);
                self.level().run(FanThroughPart {
                    geometry,
                    fan: &local,
                    limits,
                    follow: false,
                    scratch: &mut *scratch,
                    report,
                });
                std::mem::swap(&mut scratch.gaps, gaps);
            },
        });
        scratch.top = top_stack;
        scratch.gaps = gaps;
    }

    /// p and the segment lie on one line, or the segment is a point: rays instead of a fan.
    fn fan_on_line(&self, p: DVec3, a: DVec3, b: DVec3, gaps: &mut Gaps) {
        let along = b - a;
        let length = along.length_squared();
        if length == 0.0 {
            if self.occluded(p, a) {
                gaps.block(0.0, 1.0);
            }
            return;
        }
        // Where p is on the line; each end is seen past the points between.
        let at = (p - a).dot(along) / length;
        for (end, t_end) in [(a, 0.0), (b, 1.0)] {
            let away: f64 = t_end - at;
            let beyond_other = if t_end == 0.0 { 1.0 < at } else { at < 0.0 };
            let within = (0.0..=1.0).contains(&at);
            if away == 0.0 || !(beyond_other || within) || !self.occluded(p, end) {
                continue;
            }
            // The first surface hides the rest; if rounding loses it, all is taken as hidden.
            let first = self.closest(p, end - p, 1.0).map_or(0.0, |hit| hit.t);
            let t = at + away * first;
            gaps.block(t.min(t_end), t.max(t_end));
        }
    }
}

/// Trees with so few nodes are traversed faster than anything is remembered.
const FEW_NODES: usize = 16;

impl SegmentOracle for Tracer {
    type Scratch = FanScratch;

    fn visible_part(&self, p: DVec3, a: DVec3, b: DVec3, scratch: &mut FanScratch, visible: &mut Partition) {
        self.fan(&FanQuery::new(p, a, b), scratch, visible);
    }
}
