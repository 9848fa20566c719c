//! Slow, exact oracles for ray and fan queries, and closed meshes by formula.

mod boxes;
mod exact;
mod fan;
mod fan_trials;
mod meshes;
mod occlusion;
mod primitives;

pub use boxes::{AxisBox, PastBoxes, light_past_boxes, visible_past_boxes};
pub use exact::Exact;
pub use fan::{FanCell, FanDisagreement, disagreement, fan_cells};
pub use fan_trials::{FanTrials, exactness_trials, leak_trials, scene_of, slit_trials};
pub use meshes::{bumpy_knot, hare, hare_radius, torus, world_triangles};
pub use occlusion::segment_is_cut;
pub use primitives::primitive_shadows;
