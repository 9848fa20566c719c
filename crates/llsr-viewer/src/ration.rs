//! Shadows that shaders have met, handed on to the display a few at a time.
//!
//! A scene with many lights has thousands of pairs of light and blocker; finding the edges of all their shadows takes seconds, and the
//! display must not wait for it. So the first picture has none, and then so many pairs follow at a time as there is time for.

use llsr_scene::{LightId, ObjectId, Triple};

/// Time for shadows in one frame (ms): while the user moves, and while nothing is touched.
const TIME: (f64, f64) = (10.0, 120.0);
/// Frames between two portions: the renderer gathers what it is told.
const FRAMES: u32 = 8;
/// Pairs of the first portion, when nothing is known of their cost.
const FIRST: usize = 4;

/// Triples that the renderer does not know of yet.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ration {
    /// Sorted, by light and blocker first, without repetitions.
    waiting: Vec<Triple>,
    /// All that were handed on, sorted.
    known: Vec<Triple>,
    /// Cost of a pair (ms); 0 as long as none is known.
    cost: f64,
    since: u32,
}

fn pair(triple: &Triple) -> (LightId, ObjectId) {
    (triple.light, triple.blocker)
}

impl Ration {
    /// A shader has met these.
    pub(crate) fn meet(&mut self, triples: &[Triple]) {
        let before = self.waiting.len();
        let new = |triple: &&Triple| self.known.binary_search(triple).is_err();
        self.waiting.extend(triples.iter().filter(new));
        if self.waiting.len() > before {
            self.waiting.sort_unstable();
            self.waiting.dedup();
        }
    }

    /// The last frame computed the shadows of so many pairs in so many milliseconds.
    pub(crate) fn took(&mut self, pairs: usize, ms: f64) {
        if pairs > 0 {
            let cost = ms / pairs as f64;
            self.cost = if self.cost > 0.0 {
                0.5 * (self.cost + cost)
            } else {
                cost
            };
        }
    }

    /// Pairs that wait.
    pub(crate) fn pairs_waiting(&self) -> usize {
        self.waiting.chunk_by(|a, b| pair(a) == pair(b)).count()
    }

    /// What the next frame is to know of: whole pairs, replacing what `out` held. Often nothing.
    pub(crate) fn next(&mut self, busy: bool, out: &mut Vec<Triple>) {
        out.clear();
        self.since += 1;
        if self.since < FRAMES || self.waiting.is_empty() {
            return;
        }
        self.since = 0;
        let time = if busy { TIME.0 } else { TIME.1 };
        let pairs = if self.cost > 0.0 {
            ((time / self.cost) as usize).max(1)
        } else {
            FIRST
        };
        let groups = self.waiting.chunk_by(|a, b| pair(a) == pair(b));
        let count: usize = groups.take(pairs).map(<[Triple]>::len).sum();
        out.extend(self.waiting.drain(..count));
        self.known.extend_from_slice(out);
        self.known.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triple(light: u32, blocker: u32, receiver: u32) -> Triple {
        Triple {
            light: LightId(light),
            blocker: ObjectId(blocker),
            receiver: ObjectId(receiver),
        }
    }

    /// Of 30 lights and 40 blockers, with 3 receivers each.
    fn all() -> Vec<Triple> {
        let pairs = (0..30).flat_map(|light| (0..40).map(move |blocker| (light, blocker)));
        pairs
            .flat_map(|(light, blocker)| (0..3).map(move |receiver| triple(light, blocker, receiver)))
            .collect()
    }

    /// Portions until nothing waits, if a pair takes `ms`: the pairs of each.
    fn portions(ration: &mut Ration, busy: bool, ms: f64) -> Vec<Vec<Triple>> {
        let (mut found, mut out) = (Vec::new(), Vec::new());
        for _ in 0..100_000 {
            ration.next(busy, &mut out);
            let pairs = out.chunk_by(|a, b| pair(a) == pair(b)).count();
            ration.took(pairs, ms * pairs as f64);
            if !out.is_empty() {
                found.push(out.clone());
            }
            if ration.pairs_waiting() == 0 {
                break;
            }
        }
        found
    }

    #[test]
    fn everything_comes_once_and_pairs_come_whole() {
        let mut ration = Ration::default();
        let mut shuffled = all();
        shuffled.sort_by_key(|t| (t.blocker.0 * 7 + t.light.0 * 13 + t.receiver.0 * 5) % 31);
        ration.meet(&shuffled);
        ration.meet(&shuffled);
        let mut came = Vec::new();
        for portion in portions(&mut ration, true, 1.0) {
            for group in portion.chunk_by(|a, b| pair(a) == pair(b)) {
                assert_eq!(group.len(), 3, "all receivers of {:?}", pair(&group[0]));
            }
            came.extend(portion);
        }
        came.sort_unstable();
        assert_eq!(came, all(), "each once");
        ration.meet(&all());
        assert_eq!(ration.pairs_waiting(), 0, "known now");
        ration.meet(&[triple(3, 3, 9)]);
        assert_eq!(ration.pairs_waiting(), 1, "a new receiver of a known pair");
    }

    #[test]
    fn portions_fit_the_time_there_is() {
        for (busy, most) in [(true, TIME.0), (false, TIME.1)] {
            let mut ration = Ration::default();
            ration.meet(&all());
            let portions = portions(&mut ration, busy, 2.0);
            for portion in &portions[1..] {
                let pairs = portion.chunk_by(|a, b| pair(a) == pair(b)).count();
                assert!(2.0 * pairs as f64 <= most, "{pairs} pairs in {most} ms");
            }
            let least = 1200.0 * 2.0 / most;
            assert!(
                portions.len() as f64 <= 1.3 * least + 2.0,
                "{} portions where {least} would do",
                portions.len()
            );
        }
    }
}
