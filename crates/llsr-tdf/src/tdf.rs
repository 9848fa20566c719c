//! The two-discontinuity finder.

use llsr_rsb::{Found, Method, Stop, bisect};
use llsr_visibility::{Bracket, Certificate, Panel, Partition, Visibility};
use rand_core::Rng;

use crate::coherence::Coherence;
use crate::voronoi::{VoronoiScratch, supported_nu, voronoi_search};

/// The golden ratio's fraction: shifts of successive lattices that differ by it fall nowhere near each other.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// What the rounding of two places can add to their distance.
const ROUNDING: f64 = 2.0 * f64::EPSILON;

/// The two-discontinuity finder (TDF) of OF99 section 5: finds up to two changes of visibility along a light.
///
/// Both ends are tested. If they differ, one bisection finds *a* change; with three or more changes the pixel
/// comes out wrong, and [`Finder`](crate::Finder) is the search to use. If they agree, a heuristic chosen by
/// the number P of changes in the pixel before looks for a point m that answers otherwise; from it one
/// bisection runs to either end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tdf {
    /// How brackets are narrowed. For [`Method::DitheredAt`] the second of two brackets uses the shift plus
    /// the golden ratio, modulo 1, so that the errors of the two ends do not go together.
    pub method: Method,
    /// When a bisection stops.
    pub stop: Stop,
    /// Voronoi Search stops when no stretch without a test is as wide as this (in light parameters, the
    /// tolerance nu of the paper). Values below 2<sup>-16</sup>, and NaN, count as 2<sup>-16</sup>.
    pub nu: f64,
    /// The heuristic of state P = 1 searches only between the old change and the end that turned. With this
    /// option the rest of the light is searched too where that finds nothing, so that no gap wider than `nu`
    /// is missed in a pixel without changes. The paper has no such option.
    pub search_rest: bool,
}

impl Default for Tdf {
    /// As in the paper's figures 6 and 7: random seed bisection to 0.05, nu = 0.25.
    fn default() -> Self {
        Self {
            method: Method::RandomSeed,
            stop: Stop::Tolerance(0.05),
            nu: 0.25,
            search_rest: false,
        }
    }
}

/// Which part of the finder gave the answer.
#[derive(Clone, Copy, Debug, Eq, Hash, PartialEq)]
pub enum Answer {
    /// The two ends answered differently: one change, found by bisection.
    EndsDiffer,
    /// State P = 0: Voronoi Search met a point that answers otherwise.
    Voronoi0,
    /// State P = 1: the midpoint between the old change and the end that turned answers otherwise.
    Midpoint1,
    /// State P = 1: Voronoi Search between the old change and the end that turned met a point.
    Voronoi1,
    /// State P = 1 with [`Tdf::search_rest`]: Voronoi Search in the rest of the light met a point.
    Rest1,
    /// State P = 2: the midpoint of the two old changes answers otherwise.
    Midpoint2,
    /// State P = 2: Voronoi Search met a point.
    Voronoi2,
    /// The ends agree and no point was met that answers otherwise.
    NothingFound,
}

/// What a search did, besides filling the partition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TdfReport {
    /// Tests of the two ends of the light.
    pub end_tests: u32,
    /// All other tests.
    pub inner_tests: u32,
    /// Number of changes of the pixel before, P of the paper.
    pub state: u8,
    /// Which part of the finder gave the answer.
    pub answer: Answer,
    /// Number of changes found, 0 to 2.
    pub discontinuities: u8,
    /// The widest stretch without a test: no gap or panel wider than this was missed, for certain.
    pub widest_untested: f64,
    /// True if `widest_untested` is not above the finder's `nu`, but for rounding. Always so after a Voronoi Search of the
    /// whole light that met nothing; a search that ends early, and that of state P = 1 without
    /// [`Tdf::search_rest`], cannot be certain.
    pub certain: bool,
}

impl TdfReport {
    /// True if a change was found in state P = 1 or 2 without falling back to Voronoi Search.
    pub fn coherent(&self) -> bool {
        matches!(self.answer, Answer::Midpoint1 | Answer::Midpoint2)
    }
}

/// Working memory of [`Tdf::find`], kept from pixel to pixel.
#[derive(Clone, Debug, Default)]
pub struct TdfScratch {
    voronoi: VoronoiScratch,
    known: Vec<f64>,
    tested: Vec<f64>,
    found: Vec<Found>,
}

impl TdfScratch {
    /// Empty memory; it grows to a few hundred bytes with the first pixels.
    pub fn new() -> Self {
        Self::default()
    }

    /// The result of each bisection of the last search, ascending; estimates are not clamped.
    pub fn found(&self) -> &[Found] {
        &self.found
    }

    /// The points tested by the last search, ascending.
    pub fn tested(&self) -> &[f64] {
        &self.tested
    }
}

/// Passes questions on and notes them.
struct Recording<'a, V: ?Sized> {
    oracle: &'a mut V,
    tested: &'a mut Vec<f64>,
}

impl<V: Visibility + ?Sized> Visibility for Recording<'_, V> {
    fn visible(&mut self, t: f64) -> bool {
        self.tested.push(t);
        self.oracle.visible(t)
    }

    fn visible_each(&mut self, ts: &[f64], answers: &mut [bool]) {
        self.tested.extend_from_slice(ts);
        self.oracle.visible_each(ts, answers);
    }
}

impl Tdf {
    /// Finds the visible part of the light, and remembers its changes in `coherence` for the next pixel.
    ///
    /// `partition` is overwritten. Its ends lie inside the bracket each bisection started from (an estimate of
    /// dithered bisection outside it is moved to its end), with the largest possible error as uncertainty; its
    /// certificate is [`Certificate::Sampled`]. `rng` breaks ties and draws seeds.
    ///
    /// # Cost
    /// Two end tests; besides, with tolerance 0.05 and nu = 0.25, 4.15 tests on average if the ends differ, 4.5
    /// if nothing is found in state P = 0, about 7.5 if two changes are found by coherence. No allocation once
    /// `scratch` has grown.
    pub fn find<V, R>(
        &self,
        oracle: &mut V,
        coherence: &mut Coherence,
        rng: &mut R,
        scratch: &mut TdfScratch,
        partition: &mut Partition,
    ) -> TdfReport
    where
        V: Visibility + ?Sized,
        R: Rng + ?Sized,
    {
        let TdfScratch {
            voronoi,
            known,
            tested,
            found,
        } = scratch;
        tested.clear();
        found.clear();
        let mut ends = [false; 2];
        oracle.visible_each(&[0.0, 1.0], &mut ends);
        let [at_start, at_end] = ends;
        let oracle = &mut Recording { oracle, tested };
        let state = coherence.state();

        let answer = if at_start != at_end {
            found.push(bisect(
                self.method,
                oracle,
                Bracket::new(0.0, 1.0, at_start),
                self.stop,
                rng,
            ));
            Answer::EndsDiffer
        } else if let Some((m, answer)) = self.other_point(oracle, coherence, at_start, rng, (voronoi, known))
        {
            found.push(bisect(
                self.method,
                oracle,
                Bracket::new(0.0, m, at_start),
                self.stop,
                rng,
            ));
            let method = match self.method {
                Method::DitheredAt(shift) => Method::DitheredAt(shift + GOLDEN),
                method => method,
            };
            found.push(bisect(
                method,
                oracle,
                Bracket::new(m, 1.0, !at_start),
                self.stop,
                rng,
            ));
            let (lower, upper) = (found[0].estimate.clamp(0.0, m), found[1].estimate.clamp(m, 1.0));
            coherence.set(at_start, &[lower, upper]);
            fill(partition, at_start, &[(lower, &found[0]), (upper, &found[1])]);
            answer
        } else {
            Answer::NothingFound
        };
        if answer == Answer::EndsDiffer {
            let estimate = found[0].estimate.clamp(0.0, 1.0);
            coherence.set(at_start, &[estimate]);
            fill(partition, at_start, &[(estimate, &found[0])]);
        } else if answer == Answer::NothingFound {
            coherence.set(at_start, &[]);
            fill(partition, at_start, &[]);
        }

        let inner_tests = tested.len() as u32;
        tested.extend([0.0, 1.0]);
        tested.sort_unstable_by(f64::total_cmp);
        let widest_untested = tested
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .fold(0.0, f64::max);
        TdfReport {
            end_tests: 2,
            inner_tests,
            state,
            answer,
            discontinuities: found.len() as u8,
            widest_untested,
            certain: widest_untested <= supported_nu(self.nu) + ROUNDING,
        }
    }

    /// Looks for a point inside the light that does not answer `base`, as both ends do (OF99 section 5.1).
    fn other_point<V, R>(
        &self,
        oracle: &mut Recording<'_, V>,
        coherence: &Coherence,
        base: bool,
        rng: &mut R,
        (scratch, known): (&mut VoronoiScratch, &mut Vec<f64>),
    ) -> Option<(f64, Answer)>
    where
        V: Visibility + ?Sized,
        R: Rng + ?Sized,
    {
        match *coherence.changes() {
            [change] => {
                let end = coherence.changed_end(base);
                let middle = 0.5 * (change + end);
                let (lo, hi) = (change.min(end), change.max(end));
                if lo < middle && middle < hi {
                    if oracle.visible(middle) != base {
                        return Some((middle, Answer::Midpoint1));
                    }
                    let known = [lo, middle, hi];
                    if let Some(t) = voronoi_search(oracle, &known, base, self.nu, true, rng, scratch) {
                        return Some((t, Answer::Voronoi1));
                    }
                }
                if !self.search_rest {
                    return None;
                }
                known.clear();
                known.extend_from_slice(oracle.tested);
                known.extend([0.0, 1.0]);
                known.sort_unstable_by(f64::total_cmp);
                let t = voronoi_search(oracle, known, base, self.nu, false, rng, scratch)?;
                Some((t, Answer::Rest1))
            }
            [first, second] => {
                let middle = 0.5 * (first + second);
                if 0.0 < middle && middle < 1.0 && oracle.visible(middle) != base {
                    return Some((middle, Answer::Midpoint2));
                }
                let known = [0.0, middle, 1.0];
                let t = voronoi_search(oracle, &known, base, self.nu, true, rng, scratch)?;
                Some((t, Answer::Voronoi2))
            }
            _ => {
                let t = voronoi_search(oracle, &[0.0, 1.0], base, self.nu, true, rng, scratch)?;
                Some((t, Answer::Voronoi0))
            }
        }
    }
}

/// Fills `partition` from the changes, ascending, and the answer at t = 0.
fn fill(partition: &mut Partition, visible_at_start: bool, changes: &[(f64, &Found)]) {
    partition.clear();
    let (mut start, mut start_uncertainty, mut visible) = (0.0, 0.0, visible_at_start);
    for &(t, found) in changes {
        let uncertainty = (t - found.bracket.lo).max(found.bracket.hi - t);
        if visible {
            partition.push(Panel {
                start,
                end: t,
                start_uncertainty,
                end_uncertainty: uncertainty,
            });
        }
        (start, start_uncertainty, visible) = (t, uncertainty, !visible);
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
