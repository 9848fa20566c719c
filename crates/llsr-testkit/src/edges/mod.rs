//! Oracles for silhouettes and shadow edges: brute force over all edges, and meshes to try them on.

mod class_image;
mod meshes;
mod shadow_scenes;
mod shadows;
mod silhouettes;

pub use class_image::{ClassImage, ClassPoint, class_image};
pub use meshes::{bumpy_sphere, chain_link, cube_cloud, random_roofs, torus};
pub use shadow_scenes::{ShadowScenes, shadow_coverage};
pub use shadows::{ClassChange, LightClass, ShadowCoverage, ShadowOracle, class_changes};
pub use silhouettes::{SilhouetteOracle, View, ViewedEdge};
