//! The edge-and-point image: an anti-aliased picture from sparse shaded points and the edges where shading jumps.
//!
//! After Bala, Walter and Greenberg, "Combining Edges and Points for Interactive High-Quality Rendering", SIGGRAPH 2003
//! ("BWG03"), sections 4 and 5. Whoever can project edges (silhouettes, creases, shadow boundaries) and shade some points gets a
//! picture that interpolates the points but never across an edge, with edges anti-aliased. The crate knows nothing of
//! scenes, cameras and shading, does no I/O and starts no threads.
//!
//! ```
//! use glam::{Vec2, Vec3};
//! use llsr_epi::{EdgeList, EdgePointImage, Picture, Point, ScreenSegment, Settings};
//!
//! # fn main() -> Result<(), llsr_epi::SizeError> {
//! // A vertical edge at x = 4.5 with a dark sample to its left and a bright one to its right.
//! let mut edges = EdgeList::new(8, 8);
//! edges.push(ScreenSegment { a: Vec2::new(4.5, -1.0), b: Vec2::new(4.5, 9.0), depth_a: 1.0, depth_b: 1.0 });
//! let mut image = EdgePointImage::new(8, 8, Settings::default())?;
//! for (x, value) in [(2.5, 0.25), (6.5, 1.0)] {
//!     image.insert(&Point { position: Vec2::new(x, 4.5), depth: 2.0, colour: Vec3::splat(value) });
//! }
//! image.rasterize(&edges, None);
//! let mut picture = Picture::new(8, 8);
//! image.reconstruct(&mut picture);
//! assert_eq!(picture.pixel(3, 4).x, 0.25); // nothing leaks over the edge
//! assert_eq!(picture.pixel(5, 4).x, 1.0);
//! // 9/16 of the pixel lie left of the edge: it is known to an eighth and drawn in the middle of it.
//! assert_eq!(picture.pixel(4, 4).x, 9.0 / 16.0 * 0.25 + 7.0 / 16.0);
//! # Ok(())
//! # }
//! ```
//!
//! The parts, in the order in which a frame uses them: [`EdgeList`] clips and projects edges; [`EdgePointImage`] takes edges
//! and [`Point`]s, classifies pixels, finds what is reachable and rebuilds the colours; [`Picture`] holds these and says
//! where samples are wanted next.

mod antialias;
mod bands;
mod board;
mod classify;
mod code;
mod colour;
mod complex;
mod crossings;
mod donors;
mod edges;
mod fill;
mod fit;
mod image;
mod interpolate;
mod kernel;
mod lanes;
mod load;
mod occlusion;
pub mod paper;
mod patch;
mod picture;
mod pixels;
mod planes;
mod raster;
mod reach;
mod simd;
mod tables;

pub use bands::{
    AntialiasBand, ClassifyBand, ComplexBand, DonorBand, FillBand, InterpolateBand, RasterizeBand, ReachBand,
};
pub use code::{EdgeCode, PixelClass, Reachability, RegionSide};
pub use colour::MAX_COMPONENT;
pub use donors::{ColourRow, DonorRow, NO_DONOR, SampleValues};
pub use edges::{EdgeList, ScreenSegment};
pub use image::{ClassCounts, EdgePointImage, MAX_SIZE, PixelCrossings, Settings, SizeError};
pub use kernel::Kernel;
pub use load::SamplePlanes;
pub use occlusion::{CELL, Occlusion};
pub use picture::{Picture, UNREACHED};
pub use pixels::{Point, Sample};
