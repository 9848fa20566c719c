//! Slow oracles, corpora and proptest strategies for the tests of the workspace.

pub mod allocations;
pub mod edges;
pub mod epi;
pub mod intervals;
pub mod program;
pub mod quadrature;
pub mod tracer;
pub mod visibility;
