//! From the scene arguments to a scene.

use std::path::Path;

use llsr_io::{LoadOptions, Loaded, load_scene};
use llsr_scene::{EmissionLaw, LinearLight, demo};

use crate::args::{Emission, SceneArgs};
use crate::failure::Failure;

/// Loads a file or makes a built-in scene, with the lights of the command line.
pub(crate) fn load(args: &SceneArgs) -> Result<Loaded, Failure> {
    let emission = match args.emission {
        None | Some(Emission::Diffuse) => EmissionLaw::Diffuse,
        Some(Emission::Isotropic) => EmissionLaw::Isotropic,
    };
    let Some(name) = args.scene.strip_prefix("demo:") else {
        let options = LoadOptions {
            tubes: args.tube.clone(),
            line_lights: args.line_light.clone(),
            emission,
            ..LoadOptions::default()
        };
        return Ok(load_scene(Path::new(&args.scene), &options)?);
    };
    let mut scene = demo::build(name).ok_or_else(|| Failure::Usage(no_such_demo(name)))?;
    if let Some(tube) = args.tube.first() {
        return Err(Failure::Usage(format!(
            "--tube {}: built-in scenes have their lights already; --line-light adds one",
            tube.material
        )));
    }
    for (number, request) in args.line_light.iter().enumerate() {
        if request.flux.unit != scene.unit {
            return Err(Failure::Usage(format!(
                "--line-light: the scene's lights are in {}; give this one in {} too",
                scene.unit.flux_symbol(),
                scene.unit.flux_symbol()
            )));
        }
        let (a, b) = (request.a - scene.origin, request.b - scene.origin);
        let name = format!("line-light-{}", number + 1);
        scene.add_light(LinearLight {
            emission,
            ..LinearLight::new(name, a, b, request.flux.value)
        });
    }
    Ok(Loaded {
        scene,
        warnings: Vec::new(),
    })
}

pub(crate) fn no_such_demo(name: &str) -> String {
    let names: Vec<_> = demo::DEMOS.iter().map(|demo| demo.name).collect();
    format!(
        "there is no built-in scene '{name}'; there are {}",
        names.join(", ")
    )
}

/// A command that shades needs a light.
pub(crate) fn need_light(loaded: &Loaded, shown: &str) -> Result<(), Failure> {
    if !loaded.scene.lights.is_empty() {
        return Ok(());
    }
    Err(Failure::Work(format!(
        "{shown}: the scene has no light. Give it one in any of these ways:\n  \
         --line-light x,y,z:x,y,z=3000lm   a linear light between two points (metres)\n  \
         --tube MATERIAL=3000lm            long thin parts of that material become tubes\n  \
         in the glTF file: a KHR_lights_punctual point light, with extras {{\"llsr\": {{\"length\": 1.2}}}} to make\n  \
         it a line, or an emissive material on long thin parts.\n\
         `llsr info {shown}` lists the materials and what was read."
    )))
}
