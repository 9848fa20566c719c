//! Scene and picture files: OBJ, glTF, PNG and multi-layer EXR.
//!
//! Files are not trusted. Every number, index, offset and size is checked before tobj, gltf, image, exr or spade see it;
//! what can be repaired or left out is, and each such thing is a [`Warning`]; what cannot is an [`Error`] that names
//! the file, the element and the cause. Reading never panics, ends, and takes memory in proportion to the file plus at
//! most 1 GiB. Files are written under another name and take theirs when they are complete.
//!
//! # Scenes
//!
//! [`load_scene`] reads `.obj`, `.gltf` and `.glb`, [`write_gltf`] writes the latter two. Lengths are metres. Everything is
//! placed in double precision, then moved so that the middle of the geometry is the origin; [`Scene::origin`] leads back.
//!
//! A light gets into a scene in one of these ways:
//!
//! - A glTF node with a `KHR_lights_punctual` point light is a point light of 4π times its intensity. If the
//!   `extras` of the node or the light hold `{"llsr": {"length": 1.2}}` it is a linear light of that length along the node's
//!   x axis, its middle at the node's origin, scaled with the node; `"emission": "isotropic"` and `"radius"`
//!   may stand beside the length. `{"llsr": {"rect": [0.6, 1.2]}}` makes it a rectangle of that width (x) and height (y),
//!   `{"llsr": {"disc": 0.3}}` a disc of that radius, both shining along the node's -z axis. Its colour is scaled to luminance 1. Spot and directional lights are left out.
//! - A long thin part of an emissive material (with `KHR_materials_emissive_strength`) is a linear light of π times luminance
//!   times area. A part is a connected set of triangles of one material in one mesh, corners at equal positions being
//!   connected; it is long and thin if its length is at least 10 times its larger cross extent and the cross extents differ
//!   by a factor of at most 1.5. The light runs along the part's principal axis from end to end, and the part leaves the
//!   geometry. Other emissive parts give no light.
//! - The same for a material named in [`LoadOptions::tubes`], with a flux for each tube.
//! - [`LoadOptions::line_lights`], between two points.
//!
//! `{"llsr": {"unit": "radiant"}}` in `asset.extras` says that all of a file's numbers are watts, not lumens.
//! Cameras are those of glTF; `asset.extras.camera_toWorld_mitsuba` and `camera_fov_deg_x`, as left by some
//! converters, add one more.
//!
//! ```
//! use llsr_io::{LoadOptions, read_scene};
//!
//! // A triangular prism of ten metres by twenty centimetres, and a floor.
//! let text = "\
//!     v 0 2 0\nv 0 2.2 0\nv 0 2.1 0.2\nv 10 2 0\nv 10 2.2 0\nv 10 2.1 0.2\n\
//!     v 0 0 0\nv 9 0 0\nv 9 0 9\nv 0 0 9\n\
//!     usemtl tube\nf 1 2 5 4\nf 2 3 6 5\nf 3 1 4 6\nf 1 3 2\nf 4 5 6\n\
//!     usemtl floor\nf 7 10 9 8\n";
//! let options = LoadOptions { tubes: vec!["tube=3000lm".parse()?], ..LoadOptions::default() };
//! let loaded = read_scene("room.obj".as_ref(), text.into(), &options)?;
//! assert_eq!(loaded.scene.lights[0].flux(), 3000.0);
//! assert_eq!(loaded.scene.triangle_count(), 2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Pictures
//!
//! An [`Image`] holds named channels. [`write_exr`] writes all of them as 32-bit floats in one part, the same bytes for the
//! same data; [`write_png`] shows `R,G,B` after an exposure and a tone curve; [`read_image`] reads both.
//!
//! [`Scene::origin`]: llsr_scene::Scene::origin

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
pub use files::{check_folder, check_writable, read_text, write_file};
pub use gltf::write_gltf;
pub use load::{LoadOptions, Loaded, load_scene, read_scene};
pub use picture::{Development, Image, Tone, exposure_for, read_image, write_exr, write_png};
pub use request::{Flux, LineLightRequest, ParseError, TubeRequest, parse_point};
pub use warning::{Warning, WarningKind};
