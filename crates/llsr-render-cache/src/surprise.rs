//! Where the picture was wrong: what new samples say about what was shown in their places.
//!
//! Gaps between points tell where a picture may be wrong, not where it is. A new sample tells exactly that, for its pixel: between
//! the points there may lie a highlight, a kink where light sets on a round body, or the edge of a shadow that nobody has drawn. Where
//! one was, more are likely: so samples that differ from the picture are remembered for some frames, and the pixels around them, wherever
//! the camera takes them, are asked for before those around samples that agreed.

use glam::Vec3;

use crate::Error;
use crate::priority::Priorities;
use crate::view::{View, check_size};

/// Pixels along the side of a cell.
const CELL: usize = 4;
/// Difference, in square roots of shares of white, from which on a surprise counts in full.
const FULL: f32 = 0.05;
/// The least surprise that is remembered, of 255.
const LEAST: u8 = 12;
/// What is left of a surprise after a frame, of 256.
const FADED: u32 = 230;
/// What reaches the cells beside that of a surprise, and those at its corners, of 256.
const BESIDE: u32 = 160;
const CORNER: u32 = 100;
/// Share of the samples that are brighter than white.
const BRIGHTER: f32 = 0.02;
/// How fast white follows the samples, at most and in the end.
const STEP: [f32; 2] = [0.5, 0.01];
/// Weights of red, green and blue in luminance (Rec. 709).
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// A place where a sample differed from the picture.
#[derive(Clone, Copy, Debug)]
struct Surprise {
    position: Vec3,
    strength: u8,
}

/// Samples that differed from what the picture showed in their places, and the pixels that they make more urgent.
///
/// 12 bytes for each remembered sample, at most [`capacity`](Self::new) of them, and a quarter of a byte for each pixel.
#[derive(Clone, Debug)]
pub struct Surprises {
    /// Those that are remembered, from old to new until there are too many.
    found: Vec<Surprise>,
    capacity: usize,
    /// Which one is forgotten next if there are too many.
    turn: usize,
    /// A luminance that few samples exceed, and the number of samples that it is known from.
    white: f32,
    samples: u32,
    size: (u32, u32),
    columns: usize,
    /// For each cell the largest surprise in it, then with what its neighbours hand on.
    cells: Vec<u8>,
    spread: Vec<u8>,
    /// For each pixel of a row the factor of its priority, of 256.
    factors: Vec<u16>,
}

impl Surprises {
    /// None yet, for pictures of `width` x `height` pixels; at most `capacity` are remembered at a time. All memory is allocated here.
    ///
    /// # Errors
    /// [`Error::Size`] if a side is 0 or above [`MAX_SIDE`](crate::MAX_SIDE).
    pub fn new(width: u32, height: u32, capacity: usize) -> Result<Self, Error> {
        check_size(width, height)?;
        let columns = (width as usize).div_ceil(CELL);
        let cells = columns * (height as usize).div_ceil(CELL);
        Ok(Self {
            found: Vec::with_capacity(capacity),
            capacity,
            turn: 0,
            white: 0.0,
            samples: 0,
            size: (width, height),
            columns,
            cells: vec![0; cells],
            spread: vec![0; cells],
            factors: vec![0; columns * CELL],
        })
    }

    /// The number of samples that are remembered.
    pub fn len(&self) -> usize {
        self.found.len()
    }

    /// Is none remembered?
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Looks at a new sample at `position`, which brought `colour` where the picture had `shown` (linear). Both are seen as a viewer would see
    /// them who is used to the brightness of the samples so far.
    pub fn compare(&mut self, position: Vec3, colour: Vec3, shown: Vec3) {
        self.get_used_to(colour);
        let seen = |colour: Vec3| {
            let shares = (colour / self.white).clamp(Vec3::ZERO, Vec3::ONE);
            Vec3::new(shares.x.sqrt(), shares.y.sqrt(), shares.z.sqrt())
        };
        let difference = (seen(colour) - seen(shown)).abs().max_element();
        // NaN is no surprise.
        let strength = (255.0 / FULL * difference).min(255.0) as u8;
        if strength < LEAST || self.capacity == 0 {
            return;
        }
        let surprise = Surprise { position, strength };
        if self.found.len() < self.capacity {
            self.found.push(surprise);
        } else {
            self.turn = (self.turn + 1) % self.capacity;
            self.found[self.turn] = surprise;
        }
    }

    /// Moves white towards the luminance that a share [`BRIGHTER`] of the samples exceed (stochastic approximation of a quantile, in steps
    /// relative to it: H. Robbins, S. Monro, "A Stochastic Approximation Method", 1951).
    fn get_used_to(&mut self, colour: Vec3) {
        let luminance = colour.dot(LUMINANCE);
        let [most, least] = STEP;
        let step = (1.0 / (1.0 + self.samples as f32)).clamp(least, most);
        self.samples = self.samples.saturating_add(1);
        let up = luminance > self.white;
        if self.white == 0.0 && up && luminance.is_finite() {
            self.white = luminance;
        }
        self.white *= if up {
            1.0 + step * (1.0 - BRIGHTER)
        } else {
            1.0 - step * BRIGHTER
        };
        self.white = self.white.clamp(f32::MIN_POSITIVE, crate::MAX_COMPONENT);
    }

    /// Lowers the priorities of all pixels to their share `calm`, in [0, 1], but less around what is remembered, the less the greater and the younger
    /// the surprise. Then all surprises fade. The priorities 0 and 255 stay, and none falls to 0: pixels that know nothing are waiting
    /// for the first sample.
    ///
    /// # Cost
    /// A pass over the priorities, and a projection for each sample that is remembered.
    ///
    /// # Panics
    /// If `priorities` or `view` has another size.
    pub fn apply(&mut self, view: &View, calm: f32, priorities: &mut Priorities) {
        assert_eq!(view.size(), self.size, "sizes of the view and the surprises");
        assert_eq!(
            priorities.size(),
            self.size,
            "sizes of the priorities and the surprises"
        );
        self.place(view);
        self.spread();
        let calm = (256.0 * calm.clamp(0.0, 1.0)) as u16;
        let rows = self.spread.chunks_exact(self.columns);
        for (row, cells) in rows.enumerate() {
            for (factors, &cell) in self.factors.chunks_exact_mut(CELL).zip(cells) {
                factors.fill(calm + (u32::from(256 - calm) * u32::from(cell) / 255) as u16);
            }
            for y in row * CELL..((row + 1) * CELL).min(self.size.1 as usize) {
                for (value, &factor) in priorities.row_mut(y as u32).iter_mut().zip(&self.factors) {
                    // Rounded up; at 255 of 256 that leaves what was there.
                    let lowered = ((u16::from(*value) * factor.min(255) + 255) >> 8) as u8;
                    *value = if *value == u8::MAX { u8::MAX } else { lowered };
                }
            }
        }
    }

    /// Puts what is remembered into the cells of a view, lets it fade and forgets what has faded.
    fn place(&mut self, view: &View) {
        self.cells.fill(0);
        let (cells, columns) = (&mut self.cells, self.columns);
        self.found.retain_mut(|surprise| {
            if let Some(at) = view.project(surprise.position) {
                let cell = &mut cells[at.y as usize / CELL * columns + at.x as usize / CELL];
                *cell = (*cell).max(surprise.strength);
            }
            surprise.strength = ((u32::from(surprise.strength) * FADED) >> 8) as u8;
            surprise.strength >= LEAST
        });
        self.turn = self.turn.min(self.found.len().saturating_sub(1));
    }

    /// Hands on to neighbours.
    fn spread(&mut self) {
        let (columns, rows) = (self.columns as isize, (self.cells.len() / self.columns) as isize);
        self.spread.copy_from_slice(&self.cells);
        for y in 0..rows {
            for x in 0..columns {
                let strength = u32::from(self.cells[(y * columns + x) as usize]);
                if strength == 0 {
                    continue;
                }
                for (dx, dy) in [
                    (-1, -1),
                    (0, -1),
                    (1, -1),
                    (-1, 0),
                    (1, 0),
                    (-1, 1),
                    (0, 1),
                    (1, 1),
                ] {
                    let (u, v): (isize, isize) = (x + dx, y + dy);
                    if (0..columns).contains(&u) && (0..rows).contains(&v) {
                        let part = if dx == 0 || dy == 0 { BESIDE } else { CORNER };
                        let cell = &mut self.spread[(v * columns + u) as usize];
                        *cell = (*cell).max(((strength * part) >> 8) as u8);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{Mat4, Vec4};
    use proptest::prelude::*;

    use super::*;

    const SIZE: u32 = 70;

    /// Looks along -z, 90 degrees wide, from `x` to the right of the origin.
    fn view(x: f32) -> View {
        let matrix = Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::new(0.0, 0.0, 0.0, -1.0), Vec4::ZERO)
            * Mat4::from_translation(Vec3::new(-x, 0.0, 0.0));
        View::new(&matrix, SIZE, SIZE).expect("size")
    }

    /// The place at depth 1 that the view from the origin shows in the middle of a pixel.
    fn place(x: u32, y: u32) -> Vec3 {
        let ndc = |v: u32| (v as f32 + 0.5) / (0.5 * SIZE as f32) - 1.0;
        Vec3::new(ndc(x), -ndc(y), -1.0)
    }

    fn new(capacity: usize) -> Surprises {
        Surprises::new(SIZE, SIZE, capacity).expect("size")
    }

    /// What becomes of priorities that are `value` everywhere.
    fn applied(surprises: &mut Surprises, view: &View, calm: f32, value: u8) -> Vec<u8> {
        let mut priorities = Priorities::new(SIZE, SIZE).expect("size");
        (0..SIZE).for_each(|y| priorities.row_mut(y).fill(value));
        surprises.apply(view, calm, &mut priorities);
        (0..SIZE).flat_map(|y| priorities.row(y).to_vec()).collect()
    }

    fn at(values: &[u8], x: u32, y: u32) -> u8 {
        values[(y * SIZE + x) as usize]
    }

    #[test]
    fn pixels_around_what_differs_keep_their_priority() {
        let mut surprises = new(100);
        // Used to a white of about 1.
        for i in 0..1000 {
            surprises.compare(place(i % SIZE, i / SIZE), Vec3::ONE, Vec3::ONE);
        }
        assert!(surprises.is_empty(), "what agrees tells nothing");
        assert_eq!(
            applied(&mut surprises, &view(0.0), 0.25, 100),
            [25; 4900],
            "calm everywhere"
        );
        surprises.compare(place(30, 40), Vec3::ONE, Vec3::splat(0.7));
        assert_eq!(surprises.len(), 1);
        let values = applied(&mut surprises, &view(0.0), 0.25, 100);
        assert!(at(&values, 30, 40) >= 99, "in full: {}", at(&values, 30, 40));
        let beside = at(&values, 26, 40);
        assert!((50..99).contains(&beside), "less beside it: {beside}");
        assert_eq!(at(&values, 21, 40), 25, "calm elsewhere");
        // A tenth of the width further on everything lies 7 pixels to the left.
        let moved = applied(&mut surprises, &view(0.2), 0.25, 100);
        assert!(at(&moved, 23, 40) > 85, "it goes along: {}", at(&moved, 23, 40));
        assert!(at(&moved, 23, 40) < at(&values, 30, 40), "and fades");
        assert_eq!(at(&moved, 33, 40), 25, "nothing stays behind");
        for _ in 0..40 {
            applied(&mut surprises, &view(0.0), 0.25, 100);
        }
        assert!(surprises.is_empty(), "forgotten");
    }

    #[test]
    fn nothing_known_stays_urgent_and_nothing_wanted_stays_so() {
        let mut surprises = new(0);
        for (value, expected) in [(0, 0), (1, 1), (2, 1), (254, 20), (255, 255)] {
            assert_eq!(
                applied(&mut surprises, &view(0.0), 0.08, value),
                [expected; 4900],
                "{value}"
            );
        }
        for value in 0..=255 {
            assert_eq!(
                applied(&mut surprises, &view(0.0), 1.0, value),
                [value; 4900],
                "all as it was"
            );
        }
    }

    #[test]
    fn no_more_are_remembered_than_there_is_room_for() {
        let mut surprises = new(5);
        let wild = [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e30];
        for i in 0..500 {
            let [a, b] = [i % 5, i / 5 % 5].map(|k| Vec3::splat(wild[k as usize]));
            surprises.compare(place(i % SIZE, 3), a, b);
            assert!(
                surprises.len() <= 5 && surprises.white.is_finite(),
                "{surprises:?}"
            );
        }
        for i in 0..50 {
            surprises.compare(place(i, 20), Vec3::ONE, Vec3::ZERO);
        }
        let values = applied(&mut surprises, &view(0.0), 0.0, 200);
        assert!(at(&values, 49, 20) >= 199, "the newest are there");
        assert!(at(&values, 30, 20) < 20, "the oldest gave way");
    }

    proptest! {
        #[test]
        fn brightness_as_a_whole_does_not_count(seed in 0u32..1000, scale in -10.0..10f32) {
            // Powers of two: no rounding.
            let scale = scale.round().exp2();
            let run = |scale: f32| {
                let mut surprises = new(1000);
                let mut state = seed;
                for _ in 0..300 {
                    let mut unit = || {
                        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                        (state >> 8) as f32 / (1 << 24) as f32
                    };
                    let colour = scale * Vec3::new(unit(), unit(), unit());
                    let shown = colour * (0.9 + 0.2 * unit());
                    surprises.compare(place((70.0 * unit()) as u32, 9), colour, shown);
                }
                applied(&mut surprises, &view(0.0), 0.1, 100)
            };
            prop_assert_eq!(run(scale), run(1.0));
        }
    }
}
