//! The nearest of all pieces along an event's edge (Bala et al. 2003, section 6.5, "Clipping").

/// Part of a face in an event's wedge: a segment in (s, w), see `section`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// From the smaller to the larger place along the event's edge, in [0, 1].
    pub(super) s: [f64; 2],
    /// Inverse distance at the first; [`HIDING`](Self::HIDING) on the light's side of the blocker.
    w: f64,
    /// Change of the inverse distance along the event's edge.
    slope: f64,
    /// Which receiver.
    pub(super) slot: u32,
    /// Its face.
    pub(super) face: u32,
}

impl Piece {
    /// Nearer than all that can be shown.
    pub(super) const HIDING: f64 = 1e30;

    /// Between two places `s` with the inverse distances `w` there, in any order.
    pub(super) fn new(mut s: [f64; 2], mut w: [f64; 2], slot: u32, face: u32) -> Self {
        if s[0] > s[1] {
            s.reverse();
            w.reverse();
        }
        let length = s[1] - s[0];
        let slope = if length > 0.0 { (w[1] - w[0]) / length } else { 0.0 };
        Self {
            s,
            w: w[0],
            slope,
            slot,
            face,
        }
    }

    /// From the smaller to the larger of two places, with the inverse distance at the first and its change.
    #[inline]
    pub(super) fn ordered(s: [f64; 2], w: f64, slope: f64, slot: u32, face: u32) -> Self {
        Self {
            s,
            w,
            slope,
            slot,
            face,
        }
    }

    fn hides(&self) -> bool {
        self.w >= Self::HIDING
    }

    /// Inverse distance at `s`.
    pub(super) fn at(&self, s: f64) -> f64 {
        self.w + self.slope * (s - self.s[0])
    }
}

/// Working memory of the sweep.
#[derive(Clone, Debug, Default)]
pub(super) struct SweepScratch {
    order: Vec<u64>,
    sorted: Vec<u64>,
    starts: Vec<u32>,
    active: Vec<u32>,
    /// Of the active pieces, at both ends of what is looked at.
    heights: Vec<[f64; 2]>,
}

/// Gives to `show` the visible parts (number, from, to) of all pieces, from the smallest place on.
///
/// Cost: n log n in the number of pieces, times the number that lie behind each other.
pub(super) fn visible_parts(
    pieces: &[Piece],
    scratch: &mut SweepScratch,
    mut show: impl FnMut(u32, f64, f64),
) {
    if let [piece] = pieces {
        if !piece.hides() {
            show(0, piece.s[0], piece.s[1]);
        }
        return;
    }
    if pieces.iter().all(Piece::hides) {
        return;
    }
    let SweepScratch {
        order,
        sorted,
        starts,
        active,
        heights,
    } = scratch;
    sort(pieces, order, sorted, starts);
    let mut shown = Shown {
        last: None,
        show: |number: u32, from: f64, to: f64| {
            if !pieces[number as usize].hides() {
                show(number, from, to);
            }
        },
    };
    active.clear();
    let mut next = 0;
    let mut x = 0.0f64;
    let start_of = |next: usize| {
        order
            .get(next)
            .map_or(f64::INFINITY, |&key| pieces[key as u32 as usize].s[0])
    };
    let mut start = start_of(0);
    loop {
        if active.is_empty() {
            if next >= order.len() {
                break;
            }
            x = x.max(start);
        }
        while start <= x && next < order.len() {
            active.push(order[next] as u32);
            next += 1;
            start = start_of(next);
        }
        let (mut end, mut kept) = (start, 0);
        for i in 0..active.len() {
            let number = active[i];
            let last = pieces[number as usize].s[1];
            active[kept] = number;
            if last > x {
                kept += 1;
                end = end.min(last);
            }
        }
        active.truncate(kept);
        if active.is_empty() {
            continue;
        }
        if let [only] = active[..] {
            shown.add(only, x, end);
            x = end;
            continue;
        }
        // Between x and end the same pieces are there; they may cross.
        if let [a, b] = active[..] {
            let [here, there] =
                [&pieces[a as usize], &pieces[b as usize]].map(|piece| [piece.at(x), piece.at(end)]);
            let is_second = is_higher(there, here);
            let (top, here, other) = if is_second {
                (b, there, here)
            } else {
                (a, here, there)
            };
            let until = crossing(x, end, here, other).map_or(end, |at| end.min(at));
            shown.add(top, x, until);
            x = until;
            continue;
        }
        heights.clear();
        heights.extend(active.iter().map(|&number| {
            let piece = &pieces[number as usize];
            [piece.at(x), piece.at(end)]
        }));
        let top = highest(heights);
        let mut until = end;
        for (i, &other) in heights.iter().enumerate() {
            if i != top
                && let Some(at) = crossing(x, end, heights[top], other)
            {
                until = until.min(at);
            }
        }
        shown.add(active[top], x, until);
        x = until;
    }
    shown.finish();
}

/// Fewer pieces than this are sorted at once.
const FEW: usize = 24;

/// Fills `order` with the numbers of all pieces by where they begin; places are in the upper half.
fn sort(pieces: &[Piece], order: &mut Vec<u64>, sorted: &mut Vec<u64>, starts: &mut Vec<u32>) {
    // Places are not negative, so their bits sort as they do.
    let place = |piece: &Piece| piece.s[0].max(0.0) as f32;
    order.clear();
    order.extend(
        (0u64..)
            .zip(pieces)
            .map(|(i, piece)| u64::from(place(piece).to_bits()) << 32 | i),
    );
    if order.len() < FEW {
        order.sort_unstable();
        return;
    }
    // Into buckets along the edge, as many as there are pieces.
    let last = order.len() - 1;
    let scale = order.len() as f32;
    let bucket = |key: u64| ((f32::from_bits((key >> 32) as u32) * scale) as usize).min(last);
    starts.clear();
    starts.resize(order.len() + 1, 0);
    for &key in &*order {
        starts[bucket(key) + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    sorted.clear();
    sorted.resize(order.len(), 0);
    for &key in &*order {
        let start = &mut starts[bucket(key)];
        sorted[*start as usize] = key;
        *start += 1;
    }
    std::mem::swap(order, sorted);
    // A bucket now ends where it said that the next one begins. Those with many pieces are sorted by themselves, the others by insertion.
    let mut start = 0;
    for &end in &starts[..=last] {
        let range = &mut order[start as usize..end as usize];
        start = end;
        if range.len() > FEW {
            range.sort_unstable();
            continue;
        }
        for i in 1..range.len() {
            let key = range[i];
            let mut place = i;
            while place > 0 && range[place - 1] > key {
                range[place] = range[place - 1];
                place -= 1;
            }
            range[place] = key;
        }
    }
}

/// The number of the highest piece just after a place, given heights there and at the end of what is looked at.
fn highest(heights: &[[f64; 2]]) -> usize {
    let mut best = 0;
    for number in 1..heights.len() {
        if is_higher(heights[number], heights[best]) {
            best = number;
        }
    }
    best
}

/// Just after a place, given heights there and at the end of what is looked at: of those that are equal there, what is higher at the end.
#[inline(always)]
fn is_higher([w, v]: [f64; 2], [here, there]: [f64; 2]) -> bool {
    let tie = 1e-12 * (w.abs() + here.abs());
    w > here + tie || (w >= here - tie && v > there)
}

/// Where between `x` and `end` another piece gets above the highest one, given the heights of both there.
#[inline(always)]
fn crossing(x: f64, end: f64, top: [f64; 2], other: [f64; 2]) -> Option<f64> {
    let after = other[1] - top[1];
    if after > 0.0 {
        let before = (top[0] - other[0]).max(0.0);
        let crossing = x + (end - x) * (before / (before + after));
        // Ties at x were decided by what is higher at the end.
        if crossing > x {
            return Some(crossing);
        }
    }
    None
}

/// Joins parts of one piece that follow each other.
struct Shown<F> {
    last: Option<(u32, f64, f64)>,
    show: F,
}

impl<F: FnMut(u32, f64, f64)> Shown<F> {
    fn add(&mut self, number: u32, from: f64, to: f64) {
        match &mut self.last {
            Some((last, _, end)) if *last == number && *end == from => *end = to,
            last => {
                if let Some((number, from, to)) = last.replace((number, from, to)) {
                    (self.show)(number, from, to);
                }
            }
        }
    }

    fn finish(mut self) {
        if let Some((number, from, to)) = self.last.take() {
            (self.show)(number, from, to);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn piece(s: [f64; 2], w: [f64; 2]) -> Piece {
        Piece::new(s, w, 0, 0)
    }

    fn parts(pieces: &[Piece]) -> Vec<(u32, f64, f64)> {
        let mut parts = Vec::new();
        visible_parts(pieces, &mut SweepScratch::default(), |n, a, b| {
            parts.push((n, a, b))
        });
        parts
    }

    #[test]
    fn nearer_pieces_stop_the_event() {
        let floor = piece([0.0, 1.0], [0.2, 0.2]);
        let step = piece([0.25, 0.5], [0.5, 0.5]);
        let expected = [(0, 0.0, 0.25), (1, 0.25, 0.5), (0, 0.5, 1.0)];
        assert_eq!(parts(&[floor, step]), expected, "a step above the floor");
        let wall = piece([0.4, 0.6], [Piece::HIDING; 2]);
        let expected = [(0, 0.0, 0.25), (1, 0.25, 0.4), (0, 0.6, 1.0)];
        assert_eq!(parts(&[floor, step, wall]), expected, "a wall before the blocker");
        assert_eq!(parts(&[wall]), [], "nothing but a wall");
        assert_eq!(parts(&[]), [], "nothing");
        let ramp = piece([0.0, 1.0], [0.0, 0.4]);
        assert_eq!(
            parts(&[floor, ramp]),
            [(0, 0.0, 0.5), (1, 0.5, 1.0)],
            "a ramp through the floor"
        );
    }

    proptest! {
        #[test]
        fn pieces_are_sorted_by_where_they_begin(
            places in prop::collection::vec((0u16..2000, 0u8..4), 1..200),
            far in prop::collection::vec(0u8..2, 0..80),
        ) {
            // Spread out, in heaps, and at the ends.
            let place = |(x, kind): (u16, u8)| match kind {
                0 => f64::from(x) / 2000.0,
                1 => 0.5 + f64::from(x) * 1e-9,
                2 => f64::from(x / 1000),
                _ => f64::from(x / 100) / 20.0,
            };
            let places = places.into_iter().map(place).chain(far.into_iter().map(f64::from));
            let pieces: Vec<Piece> = places.map(|s| piece([s, 2.0], [1.0; 2])).collect();
            let (mut order, mut sorted, mut starts) = (Vec::new(), Vec::new(), Vec::new());
            sort(&pieces, &mut order, &mut sorted, &mut starts);
            let mut expected: Vec<usize> = (0..pieces.len()).collect();
            expected.sort_by(|&a, &b| (pieces[a].s[0] as f32).total_cmp(&(pieces[b].s[0] as f32)));
            let numbers: Vec<usize> = order.iter().map(|&key| key as u32 as usize).collect();
            prop_assert_eq!(numbers, expected);
        }

        #[test]
        fn the_envelope_is_the_largest_everywhere(
            raw in prop::collection::vec((0u8..16, 0u8..16, 0u8..8, 0u8..8, prop::bool::weighted(0.1)), 1..24),
            exact in any::<bool>(),
        ) {
            let jitter = |i: usize, k: usize| if exact { 0.0 } else { ((i * 7 + k * 3) % 11) as f64 * 1e-3 };
            let pieces: Vec<Piece> = raw
                .iter()
                .enumerate()
                .map(|(i, &(a, b, u, v, hides))| {
                    let (a, b) = (f64::from(a) / 16.0 + jitter(i, 0), f64::from(b) / 16.0 + jitter(i, 1));
                    let w = if hides { [Piece::HIDING; 2] } else { [f64::from(u) + jitter(i, 2), f64::from(v)] };
                    piece([a.min(b), a.max(b)], w)
                })
                .collect();
            let parts = parts(&pieces);
            for pair in parts.windows(2) {
                prop_assert!(pair[0].2 <= pair[1].1, "in order: {:?}", parts);
            }
            for i in 0..400 {
                let s = (f64::from(i) + 0.5) / 400.0;
                let most = pieces
                    .iter()
                    .filter(|p| p.s[0] < s && s < p.s[1])
                    .map(|p| p.at(s))
                    .fold(f64::NEG_INFINITY, f64::max);
                let shown = parts.iter().find(|p| p.1 < s && s < p.2).map(|p| pieces[p.0 as usize].at(s));
                if most >= Piece::HIDING || most == f64::NEG_INFINITY {
                    prop_assert_eq!(shown, None, "hidden at {}", s);
                } else if parts.iter().all(|p| (p.1 - s).abs() > 1e-9 && (p.2 - s).abs() > 1e-9) {
                    let shown = shown.expect("something is shown");
                    prop_assert!((shown - most).abs() < 1e-6, "{} of {} at {}", shown, most, s);
                }
            }
        }
    }
}
