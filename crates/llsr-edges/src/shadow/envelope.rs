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
    active: Vec<u32>,
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
    let order = &mut scratch.order;
    order.clear();
    // Places are not negative, so their bits sort as they do.
    let key = |piece: &Piece| u64::from((piece.s[0].max(0.0) as f32).to_bits()) << 32;
    order.extend((0u64..).zip(pieces).map(|(i, piece)| key(piece) | i));
    order.sort_unstable();
    let mut shown = Shown {
        last: None,
        show: |number: u32, from: f64, to: f64| {
            if !pieces[number as usize].hides() {
                show(number, from, to);
            }
        },
    };
    let active = &mut scratch.active;
    active.clear();
    let mut next = 0;
    let mut x = 0.0f64;
    let start_of = |next: usize| {
        order
            .get(next)
            .map(|&key| (key as u32, pieces[key as u32 as usize].s[0]))
    };
    loop {
        if active.is_empty() {
            let Some((_, start)) = start_of(next) else { break };
            x = x.max(start);
        }
        while let Some((number, start)) = start_of(next)
            && start <= x
        {
            active.push(number);
            next += 1;
        }
        let mut end = start_of(next).map_or(f64::INFINITY, |(_, start)| start);
        active.retain(|&number| pieces[number as usize].s[1] > x);
        for &number in active.iter() {
            end = end.min(pieces[number as usize].s[1]);
        }
        if active.is_empty() {
            continue;
        }
        if let [only] = active[..] {
            shown.add(only, x, end);
            x = end;
            continue;
        }
        // Between x and end the same pieces are there; they may cross.
        let top = highest(pieces, active, x, end);
        let piece = &pieces[top as usize];
        let (here, there) = (piece.at(x), piece.at(end));
        let mut until = end;
        for &number in active.iter() {
            let other = &pieces[number as usize];
            let after = other.at(end) - there;
            if after > 0.0 && number != top {
                let before = here - other.at(x);
                let crossing = x + (end - x) * (before.max(0.0) / (before.max(0.0) + after));
                // Ties at x were decided by what is higher at the end.
                if crossing > x {
                    until = until.min(crossing);
                }
            }
        }
        shown.add(top, x, until);
        x = until;
    }
    shown.finish();
}

/// The highest piece just after `x`: among those that are equal there, the highest at `end`.
fn highest(pieces: &[Piece], active: &[u32], x: f64, end: f64) -> u32 {
    let mut best = active[0];
    let (mut here, mut there) = (pieces[best as usize].at(x), pieces[best as usize].at(end));
    for &number in &active[1..] {
        let piece = &pieces[number as usize];
        let (w, v) = (piece.at(x), piece.at(end));
        let tie = 1e-12 * (w.abs() + here.abs());
        if w > here + tie || (w >= here - tie && v > there) {
            (best, here, there) = (number, w, v);
        }
    }
    best
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
