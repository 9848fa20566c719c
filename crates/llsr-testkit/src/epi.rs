//! Oracles and synthetic input for the edge-and-point image. Nothing here uses `llsr-epi`.

pub mod blind;
pub mod crossings;
pub mod edge_sets;
pub mod flood;
pub mod triangulation;
pub mod windows;
