//! Slow, exact oracles for ray and fan queries, and closed meshes by formula.

mod exact;
mod meshes;
mod occlusion;

pub use exact::Exact;
pub use meshes::{bumpy_knot, torus, world_triangles};
pub use occlusion::segment_is_cut;
