//! Narrows all brackets side by side.

use llsr_visibility::Visibility;

use super::PENCIL;
use super::lattice::Lattice;
use super::plan::Point;

/// A bracket on the lattice of `step`; its ends answer differently.
#[derive(Clone, Copy, Debug)]
pub(super) struct Open {
    pub(super) lo: i64,
    pub(super) hi: i64,
    visible_at_lo: bool,
    step: i64,
    search: Search,
    /// Whether the pixel before suggested one of its ends.
    tracked: bool,
}

/// Where to test next.
#[derive(Clone, Copy, Debug)]
enum Search {
    /// In the middle.
    Halve,
    /// So many steps above the lower end, near which the change is expected.
    Up(i64),
    /// So many steps below the upper end.
    Down(i64),
}

impl Open {
    /// The point to test next, or nothing if the bracket is a single cell.
    fn next(&mut self) -> Option<i64> {
        let length = self.hi - self.lo;
        if length <= self.step {
            return None;
        }
        match self.search {
            Search::Up(distance) if 2 * distance < length => return Some(self.lo + distance),
            Search::Down(distance) if 2 * distance < length => return Some(self.hi - distance),
            _ => self.search = Search::Halve,
        }
        // Half way, on the lattice of a step that is a power of two.
        Some(self.lo + ((length / 2) & !(self.step - 1)))
    }

    /// Takes the answer at `index`.
    fn answer(&mut self, index: i64, visible: bool) {
        let above = visible == self.visible_at_lo;
        // As long as the change flees, double the distance; once it is caught, halve.
        self.search = match self.search {
            Search::Up(distance) if above => Search::Up(2 * distance),
            Search::Down(distance) if !above => Search::Down(2 * distance),
            _ => Search::Halve,
        };
        if above {
            self.lo = index;
        } else {
            self.hi = index;
        }
    }
}

/// Writes a bracket for every two neighbours that answered differently.
///
/// `answers` holds those of t = 0, of the points, and of t = 1.
pub(super) fn open_brackets(lattice: &Lattice, points: &[Point], answers: &[bool], open: &mut Vec<Open>) {
    open.clear();
    for (i, pair) in answers.windows(2).enumerate() {
        if pair[0] == pair[1] {
            continue;
        }
        let below = i.checked_sub(1).map(|i| points[i]);
        let above = points.get(i).copied();
        let step = [below, above]
            .iter()
            .flatten()
            .map(|point| point.step)
            .min()
            .unwrap_or(lattice.coarse);
        // Where the light ends, the lattice of this step goes on by one point.
        let lo = below.map_or_else(|| lattice.at_or_above(0, step) - step, |point| point.index);
        let hi = above.map_or_else(|| lattice.at_or_above(lattice.end, step), |point| point.index);
        let tracked = |point: Option<Point>| point.is_some_and(|point| point.tracked);
        let search = match (tracked(below), tracked(above)) {
            (true, false) => Search::Up(step),
            (false, true) => Search::Down(step),
            _ => Search::Halve,
        };
        open.push(Open {
            lo,
            hi,
            visible_at_lo: pair[0],
            step,
            search,
            tracked: tracked(below) || tracked(above),
        });
    }
}

/// Opens the cells beside runs that turned out to be narrow, to be narrowed further. Returns whether there are
/// any.
///
/// A blocker of a hundredth of the light that happens to be met must not cast the shadow of a whole cell. Of the
/// runs that the pixel before had, only those are refined that have nearly vanished: to choose the step by what
/// was measured with it makes the measure biased, to choose it by the pixel before does not.
pub(super) fn refine(lattice: &Lattice, cells: &mut [Open]) -> bool {
    let mut any = false;
    for i in 1..cells.len() {
        let width = middle(lattice, &cells[i]) - middle(lattice, &cells[i - 1]);
        let step = lattice.step_for(width);
        let pair = &mut cells[i - 1..=i];
        let newly = !pair[0].tracked && !pair[1].tracked;
        let collapsed = width < 1.5 * lattice.width(pair[0].step.max(pair[1].step));
        if !newly && !collapsed {
            continue;
        }
        for cell in pair {
            if step < cell.step {
                // Points of the finer lattice that lie outside the light are of no use.
                cell.lo = cell.lo.max(lattice.at_or_above(0, step) - step);
                cell.hi = cell.hi.min(lattice.at_or_above(lattice.end, step));
                cell.step = step;
                cell.search = Search::Halve;
                any = true;
            }
        }
    }
    any
}

/// Where a cell puts its change, in the light.
fn middle(lattice: &Lattice, cell: &Open) -> f64 {
    (0.5 * (lattice.place(cell.lo) + lattice.place(cell.hi))).clamp(0.0, 1.0)
}

/// Narrows every bracket to one cell of its step. Returns the tests and the batches that took.
pub(super) fn narrow_all<V: Visibility + ?Sized>(
    lattice: &Lattice,
    oracle: &mut V,
    open: &mut [Open],
) -> (u32, u32) {
    let (mut tests, mut batches) = (0, 0);
    let mut asked = [(0, 0); PENCIL];
    let mut places = [0.0; PENCIL];
    let mut answers = [false; PENCIL];
    loop {
        let mut progress = false;
        let mut count = 0;
        for bracket in 0..=open.len() {
            if let Some(index) = open.get_mut(bracket).and_then(Open::next) {
                asked[count] = (bracket, index);
                places[count] = lattice.place(index);
                count += 1;
            }
            if count == PENCIL || (bracket == open.len() && count > 0) {
                oracle.visible_each(&places[..count], &mut answers[..count]);
                for (&(bracket, index), &answer) in asked[..count].iter().zip(&answers) {
                    open[bracket].answer(index, answer);
                }
                tests += count as u32;
                batches += 1;
                count = 0;
                progress = true;
            }
        }
        if !progress {
            return (tests, batches);
        }
    }
}
