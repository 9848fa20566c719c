//! Outward-rounded intervals and interval vectors, and the tree of normals and positions that they prune.
//!
//! ```
//! use llsr_intervals::IntervalVec3;
//!
//! let normals = IntervalVec3::of([[0.0f32, 0.8, 0.6], [0.1, 0.9, 0.4]]);
//! let view = IntervalVec3::point(0.0, 1.0, 2.0);
//! assert!(normals.dot(&view).certainly_positive(), "no silhouette edge among these faces");
//! ```

mod arithmetic;
mod exact;
mod interval;
mod plain;
mod real;
mod slices;
mod tree;
mod vector;

pub use exact::{OrientedPlane, Viewpoint, orientation};
pub use interval::Interval;
pub use plain::{PlainStatistics, PlainTree};
pub use real::Real;
pub use slices::IntervalSlices;
pub use tree::{
    Beam, FaceColumns, FaceHit, FaceScratch, FaceStatistics, FaceTree, Instructions, NarrowedFaces, Plane,
    PlaneScan, PlaneTree, QueryScratch, QueryStatistics, Select, TreeOptions, Wedge,
};
pub use vector::IntervalVec3;
