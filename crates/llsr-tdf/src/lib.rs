//! Two-discontinuity finder, Voronoi search and a finder for any number of visibility changes.
//!
//! [`Tdf`] is the finder of Ouellette & Fiume, "Approximating the Location of Integrand Discontinuities for
//! Penumbra Illumination with Linear Light Sources", Graphics Interface 1999 (section 5): cheap, and right
//! where a light has at most two changes of visibility.
//!
//! [`Finder`] goes beyond the paper: any number of changes, a width above which nothing is missed, at about the
//! same number of tests.
//!
//! Both fill a caller's [`Partition`](llsr_visibility::Partition) with the visible panels of the light and
//! carry what they learnt to the next pixel in an explicit value, so that the caller decides what is a
//! neighbour and results do not depend on threads.
//!
//! ```
//! use llsr_tdf::{Coherence, Tdf, TdfScratch};
//! use llsr_visibility::Partition;
//! use rand_core::SeedableRng;
//! use rand_pcg::Pcg64Mcg;
//!
//! let tdf = Tdf::default();
//! let (mut coherence, mut scratch, mut partition) = (Coherence::new(), TdfScratch::new(), Partition::dark());
//! let mut rng = Pcg64Mcg::seed_from_u64(1);
//! for pixel in 0..100 {
//!     // A blocker over 0.3 of the light that moves along it.
//!     let lo = 0.1 + 0.005 * f64::from(pixel);
//!     let mut visible = |t: f64| t < lo || t > lo + 0.3;
//!     let report = tdf.find(&mut visible, &mut coherence, &mut rng, &mut scratch, &mut partition);
//!     assert_eq!(report.discontinuities, 2);
//!     assert!((partition.measure() - 0.7).abs() <= 0.1);
//! }
//! ```

mod coherence;
mod finder;
mod tdf;
mod voronoi;

pub use coherence::Coherence;
pub use finder::{ChangeCoherence, Finder, FinderReport, FinderScratch, Shift};
pub use tdf::{Answer, Tdf, TdfReport, TdfScratch};
