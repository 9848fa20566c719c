//! Fan queries: which part of a segment a point sees, exactly.
//!
//! For a point p and a segment a-b, the fan is the triangle p, a, b. What cuts it blocks the light parameters that it
//! hides from p; the traversal keeps the union of these intervals, leaves out subtrees whose parameters are
//! blocked already, and ends when nothing is visible any more.
//!
//! On which side of the fan's plane a vertex lies is decided by exact predicates, by one expression for all triangles
//! that meet there, and where an edge crosses the plane is computed from its two vertices in an order that depends on
//! their sides only. So neighbours agree bit for bit on the end of their intervals, and no slit of light opens
//! between them. The conventions are those of [`Tracer::occluded`](crate::Tracer::occluded):
//!
//! - A vertex exactly in the plane counts as on its positive side (a symbolic perturbation). A triangle in the plane
//!   therefore has no crossings and blocks nothing; a triangle with one edge in the plane blocks by that edge.
//! - A triangle blocks t only if its own plane separates p from the point at t strictly, decided by exact signs: what
//!   touches p or the light, lies beyond the light or behind p blocks nothing.
//! - Triangles seen edge-on block nothing, but close slits that rounding leaves between their neighbours.
//!
//! The ends of the intervals are computed in double precision; see the private module `plane` for the error bound: a few
//! roundings times |p - a| / (|b - a| sin of the angle between them), times the reciprocal sine of the angle between the
//! plane and the edge that makes the end.

mod blockers;
mod boxes;
mod gaps;
mod listed;
mod plane;
mod query;
mod section;
mod shapes;
mod traverse;

pub use query::{FanQuery, FanReport, FanScratch};
