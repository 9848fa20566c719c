//! Direct light of linear lights by every visibility search method, and the tile renderer.
//!
//! [`DirectLight`] shades one surface point with one light and can be used on its own; [`render`] makes a
//! picture on all threads of the current rayon pool, the same bits for any number of them.

mod alone;
mod blockers;
mod direct;
mod film;
mod lamps;
mod paint;
mod random;
mod render;
mod search;
mod settings;
mod shader;
mod share;
mod statistics;
mod surface;

pub use direct::{DirectLight, LightAnswer, LightState, Pixel, Scratch};
pub use film::{Film, Layer};
pub use lamps::PreparedLights;
pub use render::{Interrupted, Rendered, TILE, render, tile_count};
pub use settings::{Method, Settings, Wasteful};
pub use shader::{
    DirectShader, Encounters, GiCounts, GiSettings, GiShader, GlossySettings, GlossyShader, MovedThing,
    Place, PlaceError, Renewal, SceneChange, SceneMove, ShadeRequest, ShadedPoint, Shader, ShaderError,
    ShaderScratch, Textured, World,
};
pub use statistics::{BlockCounts, FanCounts, HISTOGRAM_LEN, LightClass, Skipped, Statistics, TdfCounts};
pub use surface::SurfacePoint;
