//! What is still visible of a light while its occluders are found.

/// Which of the visible intervals matter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Keep {
    #[default]
    All,
    /// The one that begins at the first parameter asked for.
    First,
    /// The one that ends at the last.
    Last,
}

/// Sorted disjoint intervals of light parameters that nothing found so far blocks.
#[derive(Clone, Debug, Default)]
pub(super) struct Gaps {
    gaps: Vec<[f64; 2]>,
    /// Narrow intervals that do not block but close slits between neighbours; sorted and disjoint.
    bridges: Vec<[f64; 2]>,
    keep: Keep,
}

impl Gaps {
    /// All of [`lo`, `hi`] is visible.
    pub(super) fn reset(&mut self, lo: f64, hi: f64, keep: Keep) {
        self.gaps.clear();
        self.bridges.clear();
        self.keep = keep;
        if lo < hi {
            self.gaps.push([lo, hi]);
        }
    }

    #[inline(always)]
    pub(super) fn keep(&self) -> Keep {
        self.keep
    }

    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.gaps.is_empty()
    }

    /// How much is visible, if that is in one or two pieces; else nothing.
    #[inline(always)]
    pub(super) fn length(&self) -> f64 {
        match self.gaps.as_slice() {
            [gap] => gap[1] - gap[0],
            [low, high] => (low[1] - low[0]) + (high[1] - high[0]),
            _ => 0.0,
        }
    }

    #[inline(always)]
    pub(super) fn as_slice(&self) -> &[[f64; 2]] {
        &self.gaps
    }

    /// First and last visible parameter; reversed if there is none.
    #[inline(always)]
    pub(super) fn hull(&self) -> [f64; 2] {
        match (self.gaps.first(), self.gaps.last()) {
            (Some(first), Some(last)) => [first[0], last[1]],
            _ => [1.0, 0.0],
        }
    }

    /// Is anything of [`lo`, `hi`] visible? False if an end is NaN.
    #[inline(always)]
    pub(super) fn meets(&self, lo: f64, hi: f64) -> bool {
        // There is hardly ever more than a handful.
        self.gaps.iter().any(|gap| lo < gap[1] && gap[0] < hi)
    }

    /// Blocks [`lo`, `hi`], and says whether that changed anything. An interval with a NaN or reversed end is empty.
    #[inline(always)]
    pub(super) fn block(&mut self, lo: f64, hi: f64) -> bool {
        if let [gap] = self.gaps.as_mut_slice() {
            // The usual case: one gap is cut at an end or not at all.
            let (meets, left, right) = (lo < gap[1] && gap[0] < hi, gap[0] < lo, hi < gap[1]);
            if !(meets && lo <= hi) {
                return false;
            }
            match (self.keep, left, right) {
                (Keep::All, true, false) | (Keep::First, true, _) => gap[1] = lo,
                (Keep::All, false, true) | (Keep::Last, _, true) => gap[0] = hi,
                (Keep::All, true, true) => {
                    let end = std::mem::replace(&mut gap[1], lo);
                    self.gaps.push([hi, end]);
                }
                _ => self.gaps.clear(),
            }
            return true;
        }
        self.block_any(lo, hi)
    }

    /// The same for several gaps, which there are only where all are kept.
    #[inline(never)]
    fn block_any(&mut self, lo: f64, hi: f64) -> bool {
        if lo.is_nan() || hi.is_nan() || hi < lo {
            return false;
        }
        let first = self.gaps.partition_point(|gap| gap[1] <= lo);
        let end = first + self.gaps[first..].partition_point(|gap| gap[0] < hi);
        if first == end {
            return false;
        }
        let left = [self.gaps[first][0], lo];
        let right = [hi, self.gaps[end - 1][1]];
        match (left[0] < left[1], right[0] < right[1]) {
            (true, true) if end - first == 1 => {
                self.gaps[first] = left;
                self.gaps.insert(end, right);
            }
            (keep_left, keep_right) => {
                let mut from = first;
                let mut to = end;
                if keep_left {
                    self.gaps[from] = left;
                    from += 1;
                }
                if keep_right {
                    to -= 1;
                    self.gaps[to] = right;
                }
                self.gaps.drain(from..to);
            }
        }
        true
    }

    /// Notes that no slit inside [`lo`, `hi`] is real.
    pub(super) fn bridge(&mut self, lo: f64, hi: f64) {
        if hi <= lo || !self.meets(lo, hi) {
            return;
        }
        let first = self.bridges.partition_point(|old| old[1] < lo);
        let end = first + self.bridges[first..].partition_point(|old| old[0] <= hi);
        let (mut lo, mut hi) = (lo, hi);
        if first < end {
            (lo, hi) = (lo.min(self.bridges[first][0]), hi.max(self.bridges[end - 1][1]));
            self.bridges[first] = [lo, hi];
            self.bridges.drain(first + 1..end);
        } else {
            self.bridges.insert(first, [lo, hi]);
        }
    }

    /// Closes the slits that bridges fill from side to side.
    pub(super) fn finish(&mut self) {
        let Self { gaps, bridges, .. } = self;
        if !bridges.is_empty() {
            gaps.retain(|gap| !bridges.iter().any(|b| b[0] <= gap[0] && gap[1] <= b[1]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Gaps, Keep};

    #[test]
    fn blocking_cuts_joins_and_ignores_nonsense() {
        let mut gaps = Gaps::default();
        gaps.reset(0.0, 1.0, Keep::All);
        assert!(gaps.block(0.2, 0.4), "the middle is cut");
        assert!(!gaps.block(0.2, 0.4), "twice changes nothing");
        assert!(gaps.block(0.6, 0.8), "cut again");
        assert_eq!(
            gaps.as_slice(),
            [[0.0, 0.2], [0.4, 0.6], [0.8, 1.0]],
            "three gaps"
        );
        assert!(
            !gaps.block(f64::NAN, 0.5) && !gaps.block(0.5, 0.45),
            "empty intervals"
        );
        assert!(
            gaps.meets(0.1, 0.3) && !gaps.meets(0.2, 0.4),
            "shared ends are no overlap"
        );
        assert!(gaps.block(0.1, 0.9), "cut at both sides");
        assert_eq!(
            gaps.as_slice(),
            [[0.0, 0.1], [0.9, 1.0]],
            "the middle gap is gone"
        );
        assert!(gaps.block(-1.0, 0.05) && gaps.block(0.95, 2.0), "ends");
        assert_eq!(gaps.hull(), [0.05, 0.95], "the hull");
        assert!(gaps.block(f64::NEG_INFINITY, f64::INFINITY), "everything");
        assert!(gaps.is_empty(), "nothing is left");
    }

    #[test]
    fn only_the_gap_at_an_end_is_kept() {
        let mut gaps = Gaps::default();
        gaps.reset(0.25, 0.75, Keep::First);
        assert!(gaps.block(0.5, 0.6), "cut");
        assert_eq!(gaps.as_slice(), [[0.25, 0.5]], "what is beyond does not matter");
        assert!(
            !gaps.block(0.6, 0.7) && gaps.block(0.4, 0.45),
            "nor what blocks it"
        );
        assert_eq!(gaps.as_slice(), [[0.25, 0.4]], "cut again");
        assert!(gaps.block(0.2, 0.3) && gaps.is_empty(), "its end is hidden");
        gaps.reset(0.25, 0.75, Keep::Last);
        assert!(gaps.block(0.5, 0.6) && gaps.block(0.65, 0.7), "cut twice");
        assert_eq!(gaps.as_slice(), [[0.7, 0.75]], "the last is left");
        assert!(gaps.block(0.72, 0.8) && gaps.is_empty(), "its end is hidden");
    }

    #[test]
    fn bridges_close_slits_and_nothing_else() {
        let mut gaps = Gaps::default();
        gaps.reset(0.0, 1.0, Keep::All);
        gaps.bridge(0.5, 0.5 + 1e-12);
        gaps.bridge(0.5 + 1e-12, 0.5 + 2e-12);
        gaps.block(0.25, 0.5);
        gaps.block(0.5 + 2e-12, 0.75);
        gaps.finish();
        assert_eq!(gaps.as_slice(), [[0.0, 0.25], [0.75, 1.0]], "the slit is closed");
        gaps.reset(0.0, 1.0, Keep::All);
        gaps.bridge(0.5, 0.5 + 1e-12);
        gaps.block(0.25, 0.5);
        gaps.finish();
        assert_eq!(
            gaps.as_slice(),
            [[0.0, 0.25], [0.5, 1.0]],
            "no slit, nothing closed"
        );
    }
}
