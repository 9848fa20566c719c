//! Step functions with planted changes.

use llsr_visibility::{Panel, Partition, Visibility};

/// A light whose changes of visibility are known.
///
/// As in Ouellette & Fiume 1999, equation 1, each run includes its upper end: a point is visible if the
/// number of changes strictly below it is even, for a light that is visible at its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Steps {
    /// Whether t = 0 is visible, where no change lies below it.
    pub visible_at_start: bool,
    /// The changes, ascending. Two equal ones are none.
    pub changes: Vec<f64>,
}

impl Steps {
    /// A light with the given changes, which are sorted.
    pub fn new(visible_at_start: bool, changes: impl IntoIterator<Item = f64>) -> Self {
        let mut changes: Vec<f64> = changes.into_iter().collect();
        changes.sort_by(f64::total_cmp);
        Self {
            visible_at_start,
            changes,
        }
    }

    /// A light behind blockers, each from its first to its second number; they may overlap and stick out.
    pub fn behind(blockers: &[[f64; 2]]) -> Self {
        let hidden = |t: f64| {
            blockers
                .iter()
                .any(|&[a, b]| (a < t || a <= 0.0) && t <= b && a < b)
        };
        let mut ends: Vec<f64> = blockers
            .iter()
            .flatten()
            .copied()
            .filter(|&t| 0.0 < t && t < 1.0)
            .collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        // Just above an end, before the next number that matters.
        ends.retain(|&t| hidden(t) != hidden(t.next_up()));
        Self {
            visible_at_start: !hidden(0.0),
            changes: ends,
        }
    }

    /// Is the point at `t` visible?
    pub fn at(&self, t: f64) -> bool {
        let below = self.changes.iter().filter(|&&change| change < t).count();
        self.visible_at_start == (below % 2 == 0)
    }

    /// The runs between changes inside [0, 1], as (from, to, visible), without empty ones.
    pub fn runs(&self) -> Vec<(f64, f64, bool)> {
        let mut runs: Vec<(f64, f64, bool)> = Vec::new();
        let (mut from, mut visible) = (0.0, self.visible_at_start);
        for to in self.changes.iter().map(|t| t.clamp(0.0, 1.0)).chain([1.0]) {
            if to > from {
                match runs.last_mut() {
                    Some(last) if last.2 == visible => last.1 = to,
                    _ => runs.push((from, to, visible)),
                }
            }
            (from, visible) = (to, !visible);
        }
        runs
    }

    /// The true visible panels.
    pub fn partition(&self) -> Partition {
        let mut partition = Partition::dark();
        for (from, to, visible) in self.runs() {
            if visible {
                partition.push(Panel::exact(from, to));
            }
        }
        partition
    }

    /// The true visible width.
    pub fn measure(&self) -> f64 {
        self.runs()
            .iter()
            .filter(|run| run.2)
            .map(|run| run.1 - run.0)
            .sum()
    }

    /// The width of the narrowest run between two changes (those at the ends of the light do not count), or 1.
    pub fn narrowest_inner_run(&self) -> f64 {
        let runs = self.runs();
        let inner = runs.get(1..runs.len().saturating_sub(1)).unwrap_or_default();
        inner.iter().map(|run| run.1 - run.0).fold(1.0, f64::min)
    }
}

impl Visibility for Steps {
    fn visible(&mut self, t: f64) -> bool {
        self.at(t)
    }
}
