//! Slow oracles, corpora and proptest strategies for the tests of the workspace.

pub mod edges;
pub mod epi;
pub mod intervals;
pub mod quadrature;
pub mod tracer;
pub mod visibility;
