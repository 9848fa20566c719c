//! A finder for any number of changes of visibility.

mod lattice;
mod narrow;
mod plan;

use llsr_rsb::uniform;
use llsr_visibility::{Certificate, Panel, Partition, Visibility};
use rand_core::Rng;

use lattice::Lattice;
use narrow::Open;
use plan::Point;

/// Questions asked at once at most: one pencil of rays.
const PENCIL: usize = 8;

/// Finds every change of visibility along a light, as long as what lies between two changes is not too thin.
///
/// All tests lie on one lattice over the light, shifted at random; a change is reported as the middle of the
/// lattice cell that holds it, which makes every end of the result unbiased as in
/// [dithered bisection](llsr_rsb::dithered_bisection). The first tests, asked together, are both ends of the
/// light, the two lattice points around each change of the pixel before, and as few more as are needed for no
/// stretch without a test to be wider than `nu`. Between neighbours that differ the change is then narrowed
/// down, all brackets side by side, starting close to where the pixel before had it.
///
/// A gap or panel wider than `nu` is never missed; a narrower one is met in each pixel with a probability of at
/// least half its width / `nu`, and followed from then on. Next to runs that are narrow, or were in the
/// pixel before, the lattice is up to 16 times finer, so that what is thin is neither lost nor measured coarsely.
///
/// To make the most of what it remembers, walk the pixels of a tile in serpentine order, so that every pixel
/// follows a neighbour, and let it ask the pixel above too ([`ChangeCoherence::prefer_richer`]).
///
/// Not in the paper (OF99 leaves more than two changes open, section 6); it answers its figure 7.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finder {
    /// Largest distance of a reported change from the true one, in light parameters. Values below
    /// 2<sup>-44</sup>, and NaN, count as 2<sup>-44</sup>.
    pub epsilon: f64,
    /// The widest stretch that may stay without a test, in light parameters; 1 or more asks for no test but
    /// the ends and what the pixel before suggests. Values below 2<sup>-16</sup>, and NaN, count as 2<sup>-16</sup>.
    pub nu: f64,
}

impl Default for Finder {
    /// The tolerances of the paper's figures: 0.05 and 0.25.
    fn default() -> Self {
        Self {
            epsilon: 0.05,
            nu: 0.25,
        }
    }
}

/// Where the lattice lies. Uniform numbers, fresh for every pixel: from a stream or from a mask.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Shift of the lattice in cells, counted modulo 1. A blue-noise mask over the pixels turns what noise
    /// the result has into noise of high frequency.
    pub lattice: f64,
    /// Chooses among the lattice points that would do as additional tests; counted modulo 1.
    pub cover: f64,
}

impl Shift {
    /// Both numbers from a stream.
    pub fn from_rng<R: Rng + ?Sized>(rng: &mut R) -> Self {
        Self {
            lattice: uniform(rng),
            cover: uniform(rng),
        }
    }
}

/// The changes of the pixel before, any number of them.
///
/// As with [`Coherence`](crate::Coherence), the caller carries it from pixel to pixel and [clears](Self::clear)
/// it wherever the next pixel is no neighbour.
#[derive(Debug, Default, PartialEq)]
pub struct ChangeCoherence {
    changes: Vec<f64>,
}

impl Clone for ChangeCoherence {
    fn clone(&self) -> Self {
        Self {
            changes: self.changes.clone(),
        }
    }

    /// Keeps the memory: a row of pixels can be remembered without allocation.
    fn clone_from(&mut self, source: &Self) {
        self.changes.clone_from(&source.changes);
    }
}

impl ChangeCoherence {
    /// No pixel before.
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets the pixel before and keeps the memory.
    pub fn clear(&mut self) {
        self.changes.clear();
    }

    /// The changes of the pixel before, ascending, in [0, 1].
    pub fn changes(&self) -> &[f64] {
        &self.changes
    }

    /// Takes over the changes of another neighbour, usually the pixel above, if it has more.
    ///
    /// What is narrow is met by chance; asking two neighbours makes it known to all pixels that see it a row
    /// further down. One change more costs about two tests a pixel.
    pub fn prefer_richer(&mut self, other: &Self) {
        if other.changes.len() > self.changes.len() {
            self.changes.clear();
            self.changes.extend_from_slice(&other.changes);
        }
    }

    /// Remembers a pixel that was solved in another way.
    pub fn remember(&mut self, partition: &Partition) {
        self.changes.clear();
        self.changes.extend(partition.changes().map(|change| change.t));
    }
}

/// What a search did, besides filling the partition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinderReport {
    /// Tests of the two ends of the light.
    pub end_tests: u32,
    /// All other tests.
    pub inner_tests: u32,
    /// Calls of [`Visibility::visible_each`]; none asks more than eight questions.
    pub batches: u32,
    /// Number of changes found.
    pub discontinuities: u32,
    /// No gap or panel wider than this was missed, for certain; but for rounding at most
    /// the finder's `nu`.
    pub widest_untested: f64,
}

/// Working memory of [`Finder::find`], kept from pixel to pixel.
#[derive(Clone, Debug, Default)]
pub struct FinderScratch {
    points: Vec<Point>,
    places: Vec<f64>,
    answers: Vec<bool>,
    open: Vec<Open>,
}

impl FinderScratch {
    /// Empty memory; it grows to about a kilobyte with the first pixels.
    pub fn new() -> Self {
        Self::default()
    }
}

impl Finder {
    /// Finds the visible part of the light, and remembers its changes in `coherence` for the next pixel.
    ///
    /// `partition` is overwritten. Its certificate is [`Certificate::Sampled`], because its ends are not exact;
    /// a caller that polishes them may state a bounded gap of [`FinderReport::widest_untested`] instead.
    /// The same arguments give the same result.
    ///
    /// # Cost
    /// With tolerances 0.05 and 0.25: 6 tests, ends included, where there is no change; about 7 for one change
    /// and 9 for two that the pixel before had too; 8 for one that it had not. Of these, the first (nearly
    /// all) are asked in one batch of up to eight. No allocation once `scratch` and `coherence` have grown.
    pub fn find<V: Visibility + ?Sized>(
        &self,
        oracle: &mut V,
        coherence: &mut ChangeCoherence,
        shift: Shift,
        scratch: &mut FinderScratch,
        partition: &mut Partition,
    ) -> FinderReport {
        let lattice = Lattice::new(self.epsilon, self.nu, shift.lattice);
        let FinderScratch {
            points,
            places,
            answers,
            open,
        } = scratch;
        plan::first_tests(&lattice, &coherence.changes, shift.cover, points);

        places.clear();
        places.push(0.0);
        places.extend(points.iter().map(|point| lattice.place(point.index)));
        places.push(1.0);
        answers.clear();
        answers.resize(places.len(), false);
        let mut batches = 0;
        for (places, answers) in places.chunks(PENCIL).zip(answers.chunks_mut(PENCIL)) {
            oracle.visible_each(places, answers);
            batches += 1;
        }
        let widest_untested = places
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .fold(0.0, f64::max);
        let mut inner_tests = points.len() as u32;

        narrow::open_brackets(&lattice, points, answers, open);
        loop {
            let (more_tests, more_batches) = narrow::narrow_all(&lattice, oracle, open);
            inner_tests += more_tests;
            batches += more_batches;
            if !narrow::refine(&lattice, open) {
                break;
            }
        }

        fill(&lattice, answers[0], open, partition);
        coherence.remember(partition);
        FinderReport {
            end_tests: 2,
            inner_tests,
            batches,
            discontinuities: open.len() as u32,
            widest_untested,
        }
    }
}

/// Fills `partition` from the cells that hold the changes, ascending, and the answer at t = 0.
fn fill(lattice: &Lattice, visible_at_start: bool, cells: &[Open], partition: &mut Partition) {
    partition.clear();
    let (mut start, mut start_uncertainty, mut visible) = (0.0, 0.0, visible_at_start);
    for cell in cells {
        let (lo, hi) = (lattice.place(cell.lo), lattice.place(cell.hi));
        // Of a cell that sticks out of the light only the part inside can hold the change.
        let end = (0.5 * (lo + hi)).clamp(0.0, 1.0);
        let end_uncertainty = (end - lo.max(0.0)).max(hi.min(1.0) - end);
        if visible {
            partition.push(Panel {
                start,
                end,
                start_uncertainty,
                end_uncertainty,
            });
        }
        (start, start_uncertainty, visible) = (end, end_uncertainty, !visible);
    }
    if visible {
        partition.push(Panel {
            start,
            end: 1.0,
            start_uncertainty,
            end_uncertainty: 0.0,
        });
    }
    partition.set_certificate(Certificate::Sampled);
}
