//! Built-in scenes, made by formulas: no file is read.
//!
//! ```
//! let scene = llsr_scene::demo::build("wall").expect("wall is a built-in scene");
//! assert_eq!(scene.lights.len(), 1);
//! ```

mod floor;
mod sphere;
mod subway;

use crate::Scene;

/// A built-in scene.
#[derive(Clone, Copy, Debug)]
pub struct Demo {
    /// What to call it: `demo:NAME` on the command line.
    pub name: &'static str,
    /// One line about it.
    pub about: &'static str,
    make: fn() -> Scene,
}

impl Demo {
    /// Makes the scene.
    pub fn build(&self) -> Scene {
        let mut scene = (self.make)();
        scene.name = self.name.to_owned();
        scene
    }
}

/// All built-in scenes.
pub const DEMOS: &[Demo] = &[
    Demo {
        name: "subway",
        about: "a subway car with two tubes along it (Ouellette & Fiume 1999, figs. 2 and 7)",
        make: subway::subway,
    },
    Demo {
        name: "wall",
        about: "a tube behind a wall: at most one change of visibility (fig. 5)",
        make: floor::wall,
    },
    Demo {
        name: "cylinder-2",
        about: "a long tube and a cylinder of radius 2: at most two changes (fig. 6a)",
        make: || floor::cylinder(2.0),
    },
    Demo {
        name: "cylinder-0.4",
        about: "the same with a cylinder of radius 0.4 (fig. 6b-d)",
        make: || floor::cylinder(0.4),
    },
    Demo {
        name: "sphere-and-friends",
        about: "a triangulated patch, a cube and a cone that shade a sphere (fig. 1)",
        make: sphere::sphere_and_friends,
    },
];

/// Makes the built-in scene of that name.
pub fn build(name: &str) -> Option<Scene> {
    DEMOS.iter().find(|demo| demo.name == name).map(Demo::build)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Geometry, Light};

    #[test]
    fn every_demo_is_well_formed() {
        for demo in DEMOS {
            let scene = demo.build();
            assert_eq!(scene.name, demo.name, "the scene carries its name");
            assert!(
                !scene.cameras.is_empty() && !scene.lights.is_empty(),
                "{}: camera and light",
                demo.name
            );
            for mesh in &scene.meshes {
                assert!(mesh.is_valid(), "{}: mesh {}", demo.name, mesh.name);
                let material_ok = mesh.materials.iter().all(|m| m.index() < scene.materials.len());
                assert!(material_ok, "{}: materials of {}", demo.name, mesh.name);
            }
            for object in &scene.objects {
                if let Geometry::Primitive(primitive) = object.geometry {
                    assert!(primitive.shape.is_valid(), "{}: {}", demo.name, object.name);
                }
            }
            for light in &scene.lights {
                let Light::Linear(light) = light else { continue };
                assert!(
                    light.length() > 0.0 && light.flux > 0.0,
                    "{}: light {}",
                    demo.name,
                    light.name
                );
            }
        }
    }

    #[test]
    fn the_cylinder_scene_has_the_measures_of_the_paper() {
        let scene = build("cylinder-2").expect("built in");
        let Light::Linear(light) = &scene.lights[0] else {
            panic!("the light is linear")
        };
        assert!((light.length() - 50.0).abs() < 1e-12, "length 50");
        let middle = light.point(0.5);
        assert!(
            (middle.length() - 21.0).abs() < 1e-12,
            "21 units from the foot of the cylinder"
        );
        assert!(
            (middle.y / middle.length() - 0.5f64.sqrt()).abs() < 1e-12,
            "at 45 degrees"
        );
    }
}
