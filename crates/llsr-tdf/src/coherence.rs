//! What the two-discontinuity finder remembers from one pixel to the next.

use llsr_visibility::Partition;

/// The changes of visibility of the pixel before, which guide the search in this one.
///
/// The caller carries it from pixel to pixel and starts afresh (with [`new`](Self::new)) wherever the next
/// pixel is no neighbour: at the start of a row or tile, for another light, on another surface if it likes.
/// Results then depend on nothing but the pixels since that start, whatever thread renders them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coherence {
    /// The changes, ascending, in [0, 1]; those from `state` on mean nothing.
    changes: [f64; 2],
    /// Number of changes, P in the paper.
    state: u8,
    /// Whether t = 0 was visible.
    visible_at_start: bool,
}

impl Coherence {
    /// No pixel before: state P = 0.
    pub fn new() -> Self {
        Self::default()
    }

    /// The number of changes of the pixel before: P of the paper, 0, 1 or 2.
    pub fn state(&self) -> u8 {
        self.state
    }

    /// The changes of the pixel before, ascending, in [0, 1].
    pub fn changes(&self) -> &[f64] {
        &self.changes[..usize::from(self.state)]
    }

    /// Remembers a pixel that was solved in another way.
    ///
    /// A pixel with more than two changes has no state in the paper and is remembered as P = 0.
    pub fn remember(&mut self, partition: &Partition) {
        *self = Self::new();
        let mut changes = partition.changes();
        let (first, second) = (changes.next(), changes.next());
        if changes.next().is_some() {
            return;
        }
        if let Some(first) = first {
            self.visible_at_start = !first.visible_above;
        }
        for change in [first, second].into_iter().flatten() {
            self.changes[usize::from(self.state)] = change.t;
            self.state += 1;
        }
    }

    /// Remembers up to two changes, ascending, and whether t = 0 is visible.
    pub(crate) fn set(&mut self, visible_at_start: bool, changes: &[f64]) {
        *self = Self {
            visible_at_start,
            ..Self::default()
        };
        for &change in changes {
            self.changes[usize::from(self.state)] = change.clamp(0.0, 1.0);
            self.state += 1;
        }
    }

    /// In state P = 1, the end of the light (0 or 1) that now answers otherwise, both ends answering `now`.
    pub(crate) fn changed_end(&self, now: bool) -> f64 {
        if self.visible_at_start == now { 1.0 } else { 0.0 }
    }
}
