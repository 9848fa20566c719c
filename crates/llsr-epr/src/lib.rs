//! The edge-and-point renderer: joins edges and shaded points into pictures.
//!
//! After Bala, Walter and Greenberg, "Combining Edges and Points for Interactive High-Quality Rendering", SIGGRAPH 2003
//! ("BWG03"). [`FrameRenderer`] makes interactive frames, most of whose pixels were shaded in earlier ones, and
//! [`LockstepRenderer`] or a [`ShaderPool`] feeds it; [`render_still`] makes a finished picture from a few percent of shaded pixels.

mod external;
mod frame;
mod importance;
mod movable;
mod pool;
mod still;

pub use external::{ExternalSettings, ExternalShader, MAX_LINE, PROTOCOL, Peer, split_words};
pub use frame::{
    BlindInterpolation, CameraPath, CameraPathError, FrameError, FrameRenderer, FrameReport, FrameSettings,
    LockstepRenderer, ShadowThread, ShadowWork, StageTimes, ray_trace,
};
pub use importance::{DroppedContrast, drop_outshone, dropped_contrast};
pub use movable::movable_objects;
pub use pool::{
    Harvest, Lockstep, Overflow, PoolCounts, PoolSettings, PoolStatus, ShaderPool, shade_lockstep,
};
pub use still::{
    NarrowShadows, Still, StillCounts, StillError, StillLayer, StillSettings, layer_colours,
    narrow_shadow_edges, render_still, still_steps, view_edges,
};
