//! Which objects hide a light from a point.

use glam::DVec3;
use llsr_quadrature::LineLight;
use llsr_scene::ObjectId;
use llsr_visibility::Partition;

use crate::DirectLight;
use crate::direct::Stretch;

/// How far inside a hidden part, as a share of the stretch of light, the object at its end is looked for.
const INSIDE: f64 = 1e-4;

impl DirectLight<'_> {
    /// Adds the objects at the ends of the visible parts of a stretch of light, seen from `origin`; of a stretch wholly
    /// hidden, the one before its middle.
    pub(crate) fn blockers(
        &self,
        origin: DVec3,
        line: &LineLight,
        stretch: &Stretch,
        visible: &Partition,
        found: &mut Vec<ObjectId>,
    ) {
        let mut look = |u: f64| self.first_blocker(origin, line.point(stretch.at(u)), found);
        let panels = visible.panels();
        let ends = panels.iter().map(|panel| panel.end);
        let starts = panels.iter().map(|panel| panel.start);
        for (from, to) in std::iter::once(0.0).chain(ends).zip(starts.chain([1.0])) {
            let width = to - from;
            if width <= 0.0 {
                continue;
            }
            let middle = from + 0.5 * width;
            let inside = INSIDE.min(0.25 * width);
            // The ends of the stretch itself are no ends of shadow.
            let mut hit = false;
            if from > 0.0 {
                hit |= look(from + inside);
            }
            if to < 1.0 {
                hit |= look(to - inside);
            }
            if !hit {
                look(middle);
            }
        }
    }

    /// Adds the first object on the way from `origin` to `target`; false if there is none.
    pub(crate) fn first_blocker(&self, origin: DVec3, target: DVec3, found: &mut Vec<ObjectId>) -> bool {
        let hit = self.tracer.closest(origin, target - origin, 1.0);
        found.extend(hit.map(|hit| hit.object));
        hit.is_some()
    }
}
