//! The render cache: shaded points kept, reprojected, filtered and aged, and requests for new ones.
//!
//! Shading is slow, and most of a picture was already there a frame ago. So shaded points are kept in 3D
//! ([`PointStore`], a fixed number of them) and for each frame projected anew ([`PointImage`]): a sparse picture, to be
//! completed by somebody who interpolates, knowing the edges or not. What they miss, and which points are old, says
//! where new samples are wanted ([`Priorities`]), so does what new samples show to have been wrong ([`Surprises`]), and [`Chooser`] picks
//! the pixels to ask the shader for.
//!
//! After B. Walter, G. Drettakis, S. Parker, "Interactive Rendering using the Render Cache", Eurographics Workshop on
//! Rendering 1999, and its sequel of 2002, as used by K. Bala, B. Walter, D. P. Greenberg, "Combining Edges
//! and Points for Interactive High-Quality Rendering", SIGGRAPH 2003 (BWG03), sections 4.3 and 5.3. The crate knows
//! neither edges, cameras nor shaders: a view is a 4x4 matrix, a sample is a [`Point`].
//!
//! # One frame
//!
//! ```
//! use glam::{Mat4, Vec3};
//! use llsr_render_cache::*;
//!
//! let (width, height) = (64, 64);
//! let mut store = PointStore::new(4096)?;
//! let mut image = PointImage::new(width, height)?;
//! let mut priorities = Priorities::new(width, height)?;
//! let mut chooser = Chooser::new(width, height)?;
//! let mut requests = Vec::new();
//! // Looks along -z at a wall, 90 degrees wide; clip space is (x, y, anything, depth).
//! let matrix = Mat4::from_cols_array_2d(&[[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 0., -1.], [0., 0., 1., 0.]]);
//!
//! for frame in 0..50 {
//!     store.advance(1, 255);
//!     for request in &requests {
//!         // The shader: hits a wall at z = -2.
//!         let Request { x, y } = *request;
//!         let ndc = |v: u32| (v as f32 + 0.5) / 32.0 - 1.0;
//!         let position = Vec3::new(2.0 * ndc(x), -2.0 * ndc(y), -2.0);
//!         let point = Point { position, colour: Vec3::ONE, surface: 0, object: 0, lights: 1 };
//!         store.insert(&point, &image, &Replacement::default());
//!     }
//!     image.reproject(&store, &View::new(&matrix, width, height)?, &DepthFilter::default());
//!     priorities.update_by_gaps(&image, AgeRule::default());
//!     let phase = (f64::from(frame) * 0.618).fract();
//!     chooser.choose(&mut priorities, 100, phase, 0, &mut requests);
//! }
//! assert!(image.counts().occupied > 3500, "{:?} of 4096 pixels have a point", image.counts());
//! # Ok::<(), llsr_render_cache::Error>(())
//! ```
//!
//! # What holds
//!
//! - The same calls give the same bits, whatever the machine, the number of threads, or the instruction set.
//! - Nothing is allocated after the first frame of a size.
//! - The cost of a frame is proportional to slots plus pixels; that of invalidation to slots.
//! - No input panics or loops: points that are not finite are refused, colours are repaired, and what a matrix of NaNs
//!   sees is nothing.

mod colour;
mod error;
mod fetch;
mod filter;
mod finish;
mod hilbert;
mod image;
mod predict;
mod priority;
mod project;
mod replace;
mod request;
mod store;
mod surprise;
mod view;

pub use colour::{MAX_COMPONENT, PackedColour, pack_colour, unpack_colour};
pub use error::Error;
pub use filter::DepthFilter;
pub use image::{Counts, FinishBand, NO_SLOT, OCCUPIED, PointImage, ProjectChunk, ResolveBand};
pub use predict::Prediction;
pub use priority::{AgeRule, Priorities};
pub use replace::{Insertion, Place, Replacement};
pub use request::{Chooser, Request};
pub use store::{Fate, MAX_CAPACITY, Point, PointStore};
pub use surprise::Surprises;
pub use view::{MAX_SIDE, Projected, View};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
