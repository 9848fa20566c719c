//! What has moved so far.

use std::collections::VecDeque;

use crate::shader::SceneMove;

/// Moves that are kept. What was made before the first of them is made anew.
const KEPT: usize = 256;

/// The moves of a scene in order, the last few of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Changes {
    /// Moves before the first one kept.
    dropped: u64,
    kept: VecDeque<SceneMove>,
}

impl Changes {
    /// Number of moves so far.
    pub(crate) fn count(&self) -> u64 {
        self.dropped + self.kept.len() as u64
    }

    pub(crate) fn extend(&mut self, moves: &[SceneMove]) {
        self.kept.extend(moves);
        let over = self.kept.len().saturating_sub(KEPT);
        self.kept.drain(..over);
        self.dropped += over as u64;
    }

    /// The moves after the first `count`; `None` if some of them are no longer known.
    pub(crate) fn since(&self, count: u64) -> Option<impl Iterator<Item = &SceneMove>> {
        let skip = usize::try_from(count.checked_sub(self.dropped)?).ok()?;
        Some(self.kept.iter().skip(skip))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::MovedThing;
    use llsr_scene::{Bounds, ObjectId};

    #[test]
    fn moves_are_known_until_they_are_too_many() {
        let mut changes = Changes::default();
        for number in 0..1000 {
            let what = MovedThing::Object(ObjectId(number));
            let (before, after) = (Bounds::EMPTY, Bounds::EMPTY);
            changes.extend(&[SceneMove { what, before, after }]);
        }
        assert_eq!(changes.count(), 1000, "all are counted");
        let last: Vec<_> = changes
            .since(998)
            .expect("these are kept")
            .map(|m| m.what)
            .collect();
        assert_eq!(
            last,
            [998, 999].map(|n| MovedThing::Object(ObjectId(n))),
            "the last two"
        );
        assert_eq!(
            changes.since(1000).expect("none are needed").count(),
            0,
            "nothing since"
        );
        assert_eq!(
            changes.since(1000 - KEPT as u64).map(Iterator::count),
            Some(KEPT),
            "all that are kept"
        );
        assert!(changes.since(999 - KEPT as u64).is_none(), "one of them is gone");
    }
}
