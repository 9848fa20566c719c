//! Oracles for silhouettes and shadow edges: brute force over all edges, and meshes to try them on.

mod meshes;
mod silhouettes;

pub use meshes::{bumpy_sphere, chain_link, cube_cloud, random_roofs, torus};
pub use silhouettes::{SilhouetteOracle, View, ViewedEdge};
