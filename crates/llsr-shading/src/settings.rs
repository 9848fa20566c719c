//! What to compute and how carefully.

use std::fmt;
use std::str::FromStr;

use crate::Layer;

/// How the visible part of a light is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Method {
    /// The best there is for the scene.
    #[default]
    Auto,
    /// One exact fan query for each light, whatever it costs.
    Exact,
    /// The finder for any number of changes, to epsilon and nu, without exact queries.
    Finder,
    /// Two-discontinuity finder with random seed bisection (Ouellette & Fiume 1999, section 5).
    Tdf,
    /// Both ends are tested; where they differ, random seed bisection (section 3.4).
    Rsb,
    /// The same with dithered bisection.
    Dithered,
    /// The same with random cuts (section 3.3).
    RandomCut,
    /// The same with pure bisection (section 3.1).
    Bisection,
    /// The same with jittered bisection (section 3.2).
    JitteredBisection,
    /// Gauss points on the whole light, each tested.
    Gauss,
    /// Hierarchical Poisson disk samples, each tested (section 4).
    Hpd,
    /// One random sample in each of equal strata, each tested.
    Stratified,
    /// Midpoints of equal strata, each tested.
    Uniform,
}

impl Method {
    /// All methods, in the order of the command line.
    pub const ALL: [Self; 13] = [
        Self::Auto,
        Self::Exact,
        Self::Finder,
        Self::Tdf,
        Self::Rsb,
        Self::Dithered,
        Self::RandomCut,
        Self::Bisection,
        Self::JitteredBisection,
        Self::Gauss,
        Self::Hpd,
        Self::Stratified,
        Self::Uniform,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Exact => "exact",
            Self::Finder => "finder",
            Self::Tdf => "tdf",
            Self::Rsb => "rsb",
            Self::Dithered => "dithered",
            Self::RandomCut => "random-cut",
            Self::Bisection => "bisection",
            Self::JitteredBisection => "jittered-bisection",
            Self::Gauss => "gauss",
            Self::Hpd => "hpd",
            Self::Stratified => "stratified",
            Self::Uniform => "uniform",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|method| method.name() == text)
            .ok_or_else(|| {
                let names: Vec<_> = Self::ALL.iter().map(|method| method.name()).collect();
                format!("'{text}' is not a method; there are {}", names.join(", "))
            })
    }
}

/// Work that can be left out without changing the picture, and is unless stated here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wasteful {
    /// Search lights that lie wholly below the horizon.
    pub horizon: bool,
    /// Search the part of a light below the horizon too.
    pub clip: bool,
    /// Visit subtrees that hide nothing new.
    pub prune: bool,
    /// Search lights without power.
    pub power: bool,
    /// Find out for each pixel on its own what lies between it and a light, instead of for blocks of pixels.
    pub tiles: bool,
    /// Ask fans about everything in the scene, whether or not its box meets the fan: for small scenes only.
    pub boxes: bool,
}

/// What to compute for each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How visibility is found.
    pub method: Method,
    /// Tolerance of a change's place, in light parameters: half a bracket's width is at most this.
    pub epsilon: f64,
    /// Widest gap, in light parameters, that a search may overlook.
    pub nu: f64,
    /// Nodes, blocks and shapes that [`Method::Auto`] lets a fan query visit before it searches instead. The default costs about as
    /// much as a search.
    pub fan_budget: u32,
    /// Samples of a light for the sampling methods, at least 1.
    pub samples: u32,
    /// Rays through a pixel, at least 1; a single one goes through the centre.
    pub spp: u32,
    /// Whether subsamples of a pixel that lie on one surface share one answer about the lights.
    pub share: bool,
    /// Work that is done although the picture does not need it, to measure what leaving it out saves.
    pub wasteful: Wasteful,
    /// Lines that stand for a light with an area, at least 1.
    pub light_lines: u32,
    /// Whether surfaces reflect as glTF's metal-rough model has it (GGX and Lambert), or as Lambert alone.
    pub glossy: bool,
    /// Whether pixels around which the irradiance varies much are rendered again with each light in quarters (Ouellette
    /// & Fiume 1999, section 6); for [`Method::Tdf`] and the searches for a single change.
    pub refine: bool,
    /// Seed of all random choices.
    pub seed: u64,
    /// Layers beside the picture.
    pub layers: Vec<Layer>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Auto,
            epsilon: 0.05,
            nu: 0.25,
            fan_budget: 400,
            samples: 16,
            spp: 1,
            share: true,
            wasteful: Wasteful::default(),
            light_lines: 4,
            glossy: false,
            refine: false,
            seed: 0,
            layers: Vec::new(),
        }
    }
}
