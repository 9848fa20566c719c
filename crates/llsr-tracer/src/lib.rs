//! Closest hit, occlusion and exact fan queries over a bounding volume hierarchy.
//!
//! Build a [`Tracer`] from a scene once; all queries take `&self` and may run on any number of threads.
//!
//! ```
//! use glam::{DVec3, Vec3};
//! use llsr_scene::{Material, Mesh, Scene};
//! use llsr_tracer::Tracer;
//!
//! let mut scene = Scene::new("a box above the floor");
//! let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
//! scene.add_mesh(Mesh::cuboid("floor", Vec3::new(-5.0, -1.0, -5.0), Vec3::new(5.0, 0.0, 5.0), grey));
//! scene.add_mesh(Mesh::cuboid("box", Vec3::new(-0.5, 1.0, -0.5), Vec3::new(0.5, 2.0, 0.5), grey));
//! let (tracer, warnings) = Tracer::new(&scene);
//! assert!(warnings.is_empty());
//!
//! let eye = DVec3::new(2.0, 1.0, 0.0);
//! let down = DVec3::new(-2.0, -1.0, 0.0).normalize();
//! let hit = tracer.closest(eye, down, f64::INFINITY).unwrap();
//! assert!((hit.position.y).abs() < 1e-12);
//! let start = hit.leave(-down);
//! assert!(tracer.occluded(start, DVec3::new(0.0, 4.0, 0.0)));
//! assert!(!tracer.occluded(start, DVec3::new(3.0, 4.0, 0.0)));
//! ```
//!
//! # Filters and decisions
//!
//! Boxes and triangles are tested eight at a time in single precision, with error bounds worked out per ray. The
//! bounds make these tests *filters*: a box is entered whenever exact arithmetic would enter it, and a triangle is
//! hit, missed, or in doubt. Doubt is settled in double precision with exact predicates. So the answers do not
//! depend on the instructions that the machine has, on the shape of the tree, or on whether one ray or a pencil of
//! them was asked; there are no leaks along shared edges; and points leave a surface by a few units in the
//! last place of double precision instead of a tuned epsilon.

mod block;
mod build;
mod exact;
mod fan;
mod hit;
mod lanes;
mod motion;
mod packet;
mod pages;
mod part;
mod pencil;
mod ray;
mod shaft;
mod shape;
mod sheaf;
mod tracer;
mod traverse;
mod unchecked;

pub use fan::{FanQuery, FanReport, FanScratch};
pub use hit::{Hit, Surface};
pub use lanes::Instructions;
pub use motion::MoveError;
pub use shaft::{Shaft, Sight};
pub use tracer::{LARGEST_COORDINATE, Tracer, Warning};
