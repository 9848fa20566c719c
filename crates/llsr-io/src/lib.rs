//! Scene and image files: OBJ, glTF, PNG and multi-layer EXR, with untrusted input checked first.

mod error;
mod files;
mod gltf;
mod import;
mod load;
mod obj;
mod picture;
mod polygon;
mod request;
mod texture;
mod tubes;
mod warning;

pub use error::Error;
pub use files::write_file;
pub use load::{LoadOptions, Loaded, load_scene};
pub use picture::{Development, Image, Tone, exposure_for, read_image, write_exr, write_png};
pub use request::{Flux, LineLightRequest, ParseError, TubeRequest, parse_point};
pub use warning::{Warning, WarningKind};
