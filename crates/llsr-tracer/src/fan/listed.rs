//! Fans through the leaves that a shaft has kept, instead of through the tree.

use llsr_visibility::Partition;

use super::gaps::Keep;
use super::plane::FanPlane;
use super::traverse::walk_leaves;
use super::{FanQuery, FanReport, FanScratch};
use crate::lanes::{Kernel, Simd};
use crate::part::Geometry;
use crate::shaft::{Shaft, ShaftLeaf};
use crate::{Sight, Tracer};

impl Tracer {
    /// The answer of [`fan`](Self::fan) for a point and a part of the light of the group that `shaft` was made for.
    ///
    /// The bits are those of the query through the tree; the budget and pruning of `query` count only where the shaft knows
    /// nothing and the tree is asked. Cost: about 60 ns and 20 ns a triangle.
    pub fn fan_in_shaft(
        &self,
        query: &FanQuery,
        shaft: &Shaft,
        scratch: &mut FanScratch,
        visible: &mut Partition,
    ) -> FanReport {
        let FanQuery { p, a, b, t0, t1, .. } = *query;
        let (t0, t1) = (t0.max(0.0), t1.min(1.0));
        let sound = p.is_finite() && a.is_finite() && b.is_finite() && t0 <= t1;
        let Some(geometry) = self
            .only_geometry()
            .filter(|_| sound && shaft.sight() != Sight::Unknown)
        else {
            return self.fan(query, scratch, visible);
        };
        // By reference: the plane is large.
        let plane = FanPlane::new(p, a, b);
        let Some(fan) = &plane else {
            return self.fan(query, scratch, visible);
        };
        let mut report = FanReport::new();
        visible.clear();
        if shaft.sight() == Sight::Blocked {
            return report;
        }
        scratch.gaps.reset(t0, t1, Keep::All);
        self.level().run(FanThroughLeaves {
            geometry,
            fan,
            shaft,
            scratch,
            report: &mut report,
        });
        scratch.write_visible(&report, visible);
        report
    }
}

/// One fan through a few leaves.
struct FanThroughLeaves<'a> {
    geometry: &'a Geometry,
    fan: &'a FanPlane,
    shaft: &'a Shaft,
    scratch: &'a mut FanScratch,
    report: &'a mut FanReport,
}

impl Kernel for FanThroughLeaves<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self {
            geometry,
            fan,
            shaft,
            scratch,
            report,
        } = self;
        let leaves = shaft.leaves.iter().map(|&ShaftLeaf { at, lanes }| (at, lanes));
        walk_leaves(s, geometry, fan, leaves, &mut scratch.gaps, report);
    }
}
