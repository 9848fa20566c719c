//! What a rendering did, counted.

use llsr_tdf::{Answer, TdfReport};
use llsr_tracer::{FanReport, Sight};

/// Number of discontinuities from which on all are counted together.
pub const HISTOGRAM_LEN: usize = 17;

/// Which part of a light a point sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightClass {
    /// All of the light above the horizon.
    Lit,
    /// Some of it.
    Penumbra,
    /// None, or the whole light is below the horizon.
    Umbra,
}

/// Work left out because the scene did not need it, in pairs of hit pixel and light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Skipped {
    /// The light lies wholly below the receiver's horizon.
    pub below_horizon: u64,
    /// The light has no flux or no length.
    pub no_power: u64,
    /// The light is cut at the horizon before it is searched.
    pub horizon_clipped: u64,
    /// Nothing lies between the light and a block of pixels: all of it is seen, and no query is asked.
    pub clear_blocks: u64,
    /// One surface hides the whole light from a block of pixels: no query is asked.
    pub hidden_blocks: u64,
}

/// What was found between lights and blocks of eight by eight pixels, in pairs of block and light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlockCounts {
    /// Nothing.
    pub clear: u64,
    /// One surface that hides all of the light.
    pub hidden: u64,
    /// A few things, which alone are asked about.
    pub among: u64,
    /// Too many things; each pixel asks the whole scene.
    pub unknown: u64,
}

impl BlockCounts {
    pub(crate) fn count(&mut self, sight: Sight) {
        match sight {
            Sight::Clear => self.clear += 1,
            Sight::Blocked => self.hidden += 1,
            Sight::Among => self.among += 1,
            Sight::Unknown => self.unknown += 1,
        }
    }

    fn add(&mut self, other: &Self) {
        self.clear += other.clear;
        self.hidden += other.hidden;
        self.among += other.among;
        self.unknown += other.unknown;
    }

    /// Pairs of block and light that were looked at.
    pub fn tested(&self) -> u64 {
        self.clear + self.hidden + self.among + self.unknown
    }
}

/// Counts of the two-discontinuity finder by the number P of changes of the pixel before (0, 1 or 2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TdfCounts {
    /// Searches in each state.
    pub searches: [u64; 3],
    /// Tests besides those of the two ends.
    pub inner_tests: [u64; 3],
    /// Searches whose two ends differed.
    pub ends_differ: [u64; 3],
    /// Searches answered by the midpoint that coherence suggests; none in state 0.
    pub coherent: [u64; 3],
    /// Searches in which Voronoi Search met a change.
    pub voronoi: [u64; 3],
    /// Searches that met no change.
    pub nothing: [u64; 3],
}

impl TdfCounts {
    pub(crate) fn count(&mut self, report: &TdfReport) {
        let state = usize::from(report.state).min(2);
        self.searches[state] += 1;
        self.inner_tests[state] += u64::from(report.inner_tests);
        match report.answer {
            Answer::EndsDiffer => self.ends_differ[state] += 1,
            Answer::Midpoint1 | Answer::Midpoint2 => self.coherent[state] += 1,
            Answer::NothingFound => self.nothing[state] += 1,
            _ => self.voronoi[state] += 1,
        }
    }

    fn add(&mut self, other: &Self) {
        for state in 0..3 {
            self.searches[state] += other.searches[state];
            self.inner_tests[state] += other.inner_tests[state];
            self.ends_differ[state] += other.ends_differ[state];
            self.coherent[state] += other.coherent[state];
            self.voronoi[state] += other.voronoi[state];
            self.nothing[state] += other.nothing[state];
        }
    }

    /// Of the searches in states 1 and 2 that found two changes, the share that coherence answered without a
    /// Voronoi Search; 1 if there were none.
    pub fn coherence_share(&self) -> f64 {
        let coherent = self.coherent[1] + self.coherent[2];
        let all = coherent + self.voronoi[1] + self.voronoi[2];
        if all == 0 {
            1.0
        } else {
            coherent as f64 / all as f64
        }
    }
}

/// Counts of exact fan queries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FanCounts {
    /// Queries over the part of a light above the horizon.
    pub queries: u64,
    /// Queries that met no triangle and no primitive.
    pub empty: u64,
    /// Queries about the few things that lie between the light and a block of pixels.
    pub in_shaft: u64,
    /// Queries whose budget was spent, so that a search took over.
    pub over_budget: u64,
    /// Nodes, blocks and shapes visited.
    pub visits: u64,
    /// Subtrees left out because what they can hide was blocked already.
    pub pruned_blocked: u64,
    /// Ends of brackets that were found exactly after a search.
    pub polished: u64,
}

impl FanCounts {
    pub(crate) fn count(&mut self, report: &FanReport) {
        self.queries += 1;
        self.empty += u64::from(report.blocks == 0 && report.shapes == 0);
        self.over_budget += u64::from(!report.complete);
        self.visits += u64::from(report.visits());
        self.pruned_blocked += u64::from(report.pruned_blocked);
    }

    fn add(&mut self, other: &Self) {
        self.queries += other.queries;
        self.empty += other.empty;
        self.in_shaft += other.in_shaft;
        self.over_budget += other.over_budget;
        self.visits += other.visits;
        self.pruned_blocked += other.pruned_blocked;
        self.polished += other.polished;
    }
}

/// Counts over a picture. "Pair" means a hit pixel (or subsample) and a light.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Statistics {
    /// Rays from the camera.
    pub primary_rays: u64,
    /// Rays from the camera that hit a surface.
    pub hits: u64,
    /// Visibility tests (rays between a surface and a light).
    pub visibility_tests: u64,
    /// Those of them at the two ends of a light.
    pub end_tests: u64,
    /// Pairs that see all of the light.
    pub lit: u64,
    /// Pairs that see a part.
    pub penumbra: u64,
    /// Pairs that see nothing.
    pub umbra: u64,
    /// Pairs by number of discontinuities; the last entry holds that number and all above.
    pub discontinuities: [u64; HISTOGRAM_LEN],
    /// What the two-discontinuity finder did, by its state.
    pub tdf: TdfCounts,
    /// What exact queries did.
    pub fans: FanCounts,
    /// Pixels that were rendered again because the irradiance varies much around them.
    pub refined: u64,
    /// What was found for blocks of pixels.
    pub blocks: BlockCounts,
    /// Pairs left out.
    pub skipped: Skipped,
}

impl Default for Statistics {
    fn default() -> Self {
        Self {
            primary_rays: 0,
            hits: 0,
            visibility_tests: 0,
            end_tests: 0,
            lit: 0,
            penumbra: 0,
            umbra: 0,
            discontinuities: [0; HISTOGRAM_LEN],
            tdf: TdfCounts::default(),
            fans: FanCounts::default(),
            refined: 0,
            blocks: BlockCounts::default(),
            skipped: Skipped::default(),
        }
    }
}

impl Statistics {
    /// Number of pairs of hit pixel and light.
    pub fn pairs(&self) -> u64 {
        self.lit + self.penumbra + self.umbra
    }

    /// Counts one pair's class.
    pub fn count_class(&mut self, class: LightClass) {
        match class {
            LightClass::Lit => self.lit += 1,
            LightClass::Penumbra => self.penumbra += 1,
            LightClass::Umbra => self.umbra += 1,
        }
    }

    /// Adds the counts of another part of the picture.
    pub fn add(&mut self, other: &Self) {
        self.primary_rays += other.primary_rays;
        self.hits += other.hits;
        self.visibility_tests += other.visibility_tests;
        self.end_tests += other.end_tests;
        self.lit += other.lit;
        self.penumbra += other.penumbra;
        self.umbra += other.umbra;
        for (mine, theirs) in self.discontinuities.iter_mut().zip(other.discontinuities) {
            *mine += theirs;
        }
        self.tdf.add(&other.tdf);
        self.fans.add(&other.fans);
        self.refined += other.refined;
        self.skipped.below_horizon += other.skipped.below_horizon;
        self.skipped.no_power += other.skipped.no_power;
        self.skipped.horizon_clipped += other.skipped.horizon_clipped;
        self.skipped.clear_blocks += other.skipped.clear_blocks;
        self.skipped.hidden_blocks += other.skipped.hidden_blocks;
        self.blocks.add(&other.blocks);
    }
}
