//! A window that shows edge-and-point frames of a scene and lets one walk, pick and drag.
//!
//! After Bala, Walter & Greenberg, "Combining Edges and Points for Interactive High-Quality Rendering", SIGGRAPH 2003. The display has
//! a thread of its own and never waits for the shaders.
//!
//! [`Engine`] is the view without a window: keys and mouse go in, pixels come out. [`view`] opens a window around it.
//!
//! ```
//! use std::sync::Arc;
//!
//! use llsr_scene::{Viewport, demo};
//! use llsr_shading::{DirectShader, Shader, World};
//! use llsr_epr::movable_objects;
//! use llsr_viewer::{Engine, ShaderChoice, ViewSettings};
//!
//! let scene = demo::build("torus-capsule").unwrap();
//! let (camera, movable) = (scene.cameras[0].clone(), movable_objects(&scene));
//! let (world, _) = World::new(Arc::new(scene), &movable);
//! let direct = ShaderChoice {
//!     name: "direct".to_owned(),
//!     make: Box::new(|world| {
//!         let ambient = world.suggested_ambient();
//!         Ok(Arc::new(DirectShader::new(world, ambient)) as Arc<dyn Shader>)
//!     }),
//! };
//! let viewport = Viewport { width: 64, height: 48 };
//! let mut engine = Engine::new(Arc::new(world), camera, viewport, vec![direct], ViewSettings::default())?;
//! engine.key("KeyW", true);
//! for _ in 0..3 {
//!     engine.frame(1.0 / 60.0);
//! }
//! assert_eq!(engine.canvas().size(), (64, 48));
//! # Ok::<(), llsr_viewer::ViewError>(())
//! ```

mod canvas;
mod engine;
mod grip;
mod jobs;
mod keys;
mod overlay;
mod pace;
mod record;
mod rig;
mod settings;
mod text;
mod window;

pub use canvas::{Canvas, ToneTable};
pub use engine::{Button, Engine};
pub use grip::{Grip, surface_under};
pub use jobs::PictureSettings;
pub use keys::{Action, BINDINGS, Binding, Flight, MOUSE, Meaning, meaning};
pub use record::Recorder;
pub use rig::{Rig, Steering};
pub use settings::{MakeShader, ShaderChoice, ViewError, ViewReport, ViewSettings};
pub use window::view;
