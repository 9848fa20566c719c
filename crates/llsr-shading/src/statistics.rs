//! What a rendering did, counted.

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
    /// Pairs by the heuristic of the two-discontinuity finder that answered, in the order of
    /// [`Answered`](llsr_tdf::Answered).
    pub heuristics: [u64; 8],
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
            heuristics: [0; 8],
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
        for (mine, theirs) in self.heuristics.iter_mut().zip(other.heuristics) {
            *mine += theirs;
        }
        self.skipped.below_horizon += other.skipped.below_horizon;
        self.skipped.no_power += other.skipped.no_power;
        self.skipped.horizon_clipped += other.skipped.horizon_clipped;
    }
}
