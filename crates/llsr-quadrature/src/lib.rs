//! Irradiance from visible panels of a linear light: closed forms, Gauss rules and sample patterns.
//!
//! A search for discontinuities of visibility ends with a [`Partition`](llsr_visibility::Partition) of the
//! light into visible panels. This crate turns it into irradiance. It knows the receiver, the light and the
//! partition; it knows no occluder and never asks for visibility.
//!
//! ```
//! use glam::DVec3;
//! use llsr_quadrature::{Emission, GaussRule, LineIrradiance, LineLight, Receiver, gauss};
//! use llsr_visibility::{Panel, Partition};
//!
//! let light = LineLight {
//!     a: DVec3::new(-1.0, 2.0, 0.0),
//!     b: DVec3::new(1.0, 2.0, 0.0),
//!     emission: Emission::Diffuse,
//!     flux: 1000.0,
//! };
//! let receiver = Receiver { position: DVec3::new(0.5, 0.0, 0.3), normal: DVec3::Y };
//! let mut visible = Partition::dark();
//! visible.insert(Panel::exact(0.0, 0.4));
//!
//! let line = LineIrradiance::new(&receiver, &light);
//! let exact = line.partition(&visible);
//! let two_points = gauss(&GaussRule::new(2), &visible, |t| line.density(t));
//! assert!((two_points - exact).abs() < 1e-3 * exact);
//! ```

mod dither;
mod gauss;
mod glossy;
mod light;
mod line;
mod material;
mod pattern;
mod stack;

pub use dither::DitherMask;
pub use gauss::{GaussRule, gauss};
pub use glossy::{Glossy, GlossyOptions, LineGlossy};
pub use light::{Emission, LineLight, Receiver, horizon_clip};
pub use line::{LineAxis, LineIrradiance};
pub use material::{Lobes, MetalRough};
pub use pattern::{Pattern, hierarchical_poisson, sobol, stratified, uniform};
pub use stack::{DiscLight, RectLight, TubeLight, sampled_nodes};

/// Runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
