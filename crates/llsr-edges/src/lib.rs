//! Silhouettes, creases and shadow edges of linear lights.
//!
//! [`MeshEdges`] prepares one mesh, [`SceneEdges`] a whole scene with its instances and primitives.

mod mesh;
mod view;

pub use mesh::{EdgeOptions, EdgeReport, EdgeScratch, FoundEdges, InvalidMesh, MeshEdges};
pub use view::{
    EdgeClass, EdgeRun, EdgeWarning, Eye, SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView,
    ViewedEdge, outline, outline_chords,
};
