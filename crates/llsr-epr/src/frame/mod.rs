//! Interactive frames: edges and points joined once a frame.

mod blind;
mod camera_path;
mod hidden;
mod lockstep;
mod motion;
mod occluders;
mod patch;
mod predict;
mod renderer;
mod settings;
mod shadows;
mod share;
mod texture;

pub use blind::BlindInterpolation;
pub use camera_path::{CameraPath, CameraPathError};
pub use lockstep::{LockstepRenderer, ray_trace};
pub use renderer::{FrameError, FrameRenderer};
pub use settings::{FrameReport, FrameSettings, StageTimes};
pub use shadows::{ShadowThread, ShadowWork};
