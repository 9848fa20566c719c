//! Shaders for renderers that choose their samples: rays in, shaded points out.
//!
//! After Bala, Walter & Greenberg 2003, section 3: a shader finds the visible point of each ray and its colour, and tells
//! which objects and shadows it met on the way. Shaders differ only in what they compute.

mod direct;
mod encounters;
mod gi;
mod glossy;
mod look;
mod scratch;
mod world;

use std::error::Error;
use std::fmt;

use glam::{DVec3, Vec3};
use llsr_scene::ObjectId;

pub use direct::DirectShader;
pub use encounters::Encounters;
pub use gi::{GiCounts, GiSettings, GiShader, Renewal};
pub use glossy::{GlossySettings, GlossyShader};
pub use scratch::ShaderScratch;
pub use world::{MovedThing, Place, PlaceError, SceneChange, SceneMove, World};

/// A ray to shade.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadeRequest {
    /// The caller's name for the ray; comes back with its point and has no influence on it.
    pub id: u64,
    /// Where the ray starts (m, recentred frame).
    pub origin: DVec3,
    /// Where it goes; need not have unit length.
    pub direction: DVec3,
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadedPoint {
    /// The request's.
    pub id: u64,
    /// The visible point (m, recentred frame); of the background, a point a thousand times the scene's size away.
    pub position: Vec3,
    /// Unit shading normal, turned to the viewer; of the background, the direction to the viewer.
    pub normal: Vec3,
    /// Base colour, linear RGB; zero for the background.
    pub albedo: Vec3,
    /// Radiance towards the ray's origin, emission included: linear RGB in lux or W/m2 per steradian.
    pub colour: Vec3,
    /// The object, or `None` for the background.
    pub object: Option<ObjectId>,
    /// Set where the colour is that of a texture times the light on it.
    pub textured: Option<Textured>,
    /// The lights that reach the point, partly or wholly: bit i for all lights whose number is i modulo 64.
    pub lights: u64,
    /// The shader knows that it will say better when the ray is asked for again: what it went by is of before a move.
    pub provisional: bool,
}

/// A point on a base-colour texture, to which the colour is proportional: who shows it may interpolate the light, and look the
/// texture up for each pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Textured {
    /// Triangle of the object's mesh.
    pub triangle: u32,
    /// The point's colour if the texture had its [typical colour](llsr_scene::Texture::typical) everywhere.
    pub plain: Vec3,
}

/// Computes the colours of rays; BWG03's external shader process.
///
/// A shader is shared by all threads that shade.
pub trait Shader: Send + Sync {
    /// A short name for reports.
    fn name(&self) -> &str;

    /// Shades all `requests`: appends a point for each to `points`, in any order, and what was met to `met`.
    ///
    /// A request's point depends on the scene, the seed and the ray alone: not on the batch it comes in, on other batches or
    /// on the number of threads. `scratch` is working memory of the calling thread, of any content.
    ///
    /// # Errors
    /// [`ShaderError`] if the batch could not be shaded; `points` and `met` may hold a part of it then.
    fn shade(
        &self,
        requests: &[ShadeRequest],
        seed: u64,
        scratch: &mut ShaderScratch,
        points: &mut Vec<ShadedPoint>,
        met: &mut Encounters,
    ) -> Result<(), ShaderError>;

    /// Says that objects or lights have moved. Batches that begin after the return see the new scene; those under way may
    /// still see the old one. Returns at once.
    ///
    /// A shader that knows nothing of the scene's state leaves this as it is.
    fn changed(&self, change: &SceneChange) {
        let _ = change;
    }

    /// Rays that a caller for whom things move should hand over at a time, at most, so that calls stay short: what was shaded before a move is of
    /// little use after it. More than that are shaded too.
    fn portion(&self) -> usize {
        usize::MAX
    }

    /// Asks that calls of [`shade`](Self::shade) under way end soon, with an error if need be, because nobody waits for them
    /// any more. Returns at once.
    fn interrupt(&self) {}
}

/// Why a batch could not be shaded.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ShaderError {
    /// A ray whose origin is not finite, or whose direction is not finite or zero.
    BadRay {
        /// The request's.
        id: u64,
    },
    /// A shader outside of this program failed; what happened, in a sentence.
    External(String),
}

impl fmt::Display for ShaderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadRay { id } => write!(f, "ray {id} is not finite or has no direction"),
            Self::External(what) => f.write_str(what),
        }
    }
}

impl Error for ShaderError {}
