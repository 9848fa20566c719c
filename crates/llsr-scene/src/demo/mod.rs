//! Built-in scenes, made by formulas: no file is read.
//!
//! ```
//! let scene = llsr_scene::demo::build("wall").expect("wall is a built-in scene");
//! assert_eq!(scene.lights.len(), 1);
//! ```

mod bars;
mod chains;
mod contact;
mod floor;
mod pattern;
mod rooms;
mod solid;
mod sphere;
mod subway;
mod tea_stand;

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
    Demo {
        name: "rooms",
        about: "four textured rooms with six tubes, to walk through (Bala et al. 2003, fig. 12)",
        make: rooms::rooms,
    },
    Demo {
        name: "chains",
        about: "interlocking tori of 73,728 triangles under two tubes (fig. 7)",
        make: chains::chains,
    },
    Demo {
        name: "torus-capsule",
        about: "a torus that leans on a capsule: shadows that harden at the contact (fig. 9)",
        make: contact::torus_capsule,
    },
    Demo {
        name: "tea-stand",
        about: "wrought stands with china: fine geometry and its shadows (fig. 10)",
        make: tea_stand::tea_stand,
    },
    Demo {
        name: "bars",
        about: "a tube over 64 bars: many changes of visibility",
        make: bars::bars,
    },
];

/// Makes the built-in scene of that name.
pub fn build(name: &str) -> Option<Scene> {
    DEMOS.iter().find(|demo| demo.name == name).map(Demo::build)
}

#[cfg(test)]
mod tests;
