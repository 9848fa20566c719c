//! Silhouettes, creases and shadow edges of linear lights.
//!
//! [`MeshEdges`] prepares one mesh, [`SceneEdges`] a whole scene with its instances and primitives. [`ShadowEdges`] are
//! found in a [`ShadowScene`], which can take the edges of the meshes from either, [`Meetings`] where surfaces run into each other.

mod drawing;
mod meeting;
mod mesh;
mod shadow;
mod view;

pub use drawing::{Line, Part, Sight, Stroke, clip_to_picture, join, split_hidden};
pub use meeting::{Meeting, MeetingOptions, Meetings};
pub use mesh::{EdgeOptions, EdgeReport, EdgeScratch, FoundEdges, InvalidMesh, MeshEdges};
pub use shadow::{
    DroppedEdge, Gaps, ImportanceReport, ShadowEdge, ShadowEdges, ShadowKind, ShadowLight, ShadowMesh,
    ShadowObject, ShadowOptions, ShadowScene, ShadowSource, ShadowStatistics,
};
pub use view::{
    EdgeClass, EdgeRun, EdgeWarning, Eye, SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView,
    ViewedEdge, onto_surface, outline, outline_chords,
};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
