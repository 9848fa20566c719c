//! Silhouettes, creases and shadow edges of linear lights.

mod mesh;

pub use mesh::{EdgeOptions, EdgeReport, EdgeScratch, FoundEdges, InvalidMesh, MeshEdges};
