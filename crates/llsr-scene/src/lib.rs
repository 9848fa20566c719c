//! Scenes for linear-light rendering: what is there, not how it is traced or shaded.
//!
//! Lengths are metres, the frame is right-handed with y up. Geometry is stored in single precision relative to
//! [`Scene::origin`], which a loader sets to the centre of what it read, so that a room a million metres from
//! the file's origin keeps its detail. Everything below the loader works in that recentred frame.
//!
//! ```
//! use glam::{DVec3, Vec3};
//! use llsr_scene::{Camera, FieldOfView, LinearLight, Material, Mesh, Scene};
//!
//! let mut scene = Scene::new("a lit floor");
//! let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
//! scene.add_mesh(Mesh::quad("floor", [Vec3::ZERO, Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::X], grey));
//! scene.add_light(LinearLight::new("tube", DVec3::new(0.0, 2.0, 0.0), DVec3::new(1.0, 2.0, 0.0), 3000.0));
//! scene.cameras.push(Camera::look_at(
//!     "default", DVec3::new(0.5, 1.5, 4.0), DVec3::ZERO, DVec3::Y, FieldOfView::vertical_degrees(40.0),
//! ));
//! assert_eq!(scene.triangle_count(), 2);
//! ```

mod adjacency;
mod bounds;
mod camera;
pub mod demo;
mod ids;
mod light;
mod material;
mod mesh;
mod oracle;
mod primitive;
mod scene;
mod texture;

pub use adjacency::{Adjacency, Edge, NO_FACE, Weld};
pub use bounds::Bounds;
pub use camera::{Camera, CameraRays, FieldOfView, Projection, Viewport};
pub use ids::{LightId, MaterialId, MeshId, ObjectId, TextureId, Triple};
pub use light::{AreaLight, AreaShape, EmissionLaw, Light, LinearLight, PhotometricUnit, PointLight};
pub use material::{Material, TextureUse};
pub use mesh::Mesh;
pub use oracle::SegmentOracle;
pub use primitive::{Primitive, Shape};
pub use scene::{Geometry, Object, Scene};
pub use texture::{TYPICAL_TEXELS, Texture, Wrap, linear_to_srgb, luminance, srgb_to_linear};
