//! Reads a scene and says what is in it: `cargo run --example inspect -- SCENE [MATERIAL=3000lm]...`

use std::path::Path;
use std::process::ExitCode;

use llsr_io::{LoadOptions, load_scene};

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let Some(scene) = arguments.next() else {
        eprintln!("usage: inspect SCENE.obj|.gltf|.glb [MATERIAL=3000lm]...");
        return ExitCode::from(2);
    };
    let tubes = match arguments.map(|text| text.parse()).collect() {
        Ok(tubes) => tubes,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::from(2);
        }
    };
    let options = LoadOptions {
        tubes,
        ..LoadOptions::default()
    };
    match load_scene(Path::new(&scene), &options) {
        Ok(loaded) => {
            let scene = &loaded.scene;
            println!(
                "{}: {} triangles in {} objects",
                scene.name,
                scene.triangle_count(),
                scene.objects.len()
            );
            println!("size {:.3} m around {:.3}", scene.bounds().size(), scene.origin);
            for light in &scene.lights {
                let (a, b) = light.ends();
                println!(
                    "light {}: {:.3} to {:.3}, {} {}",
                    light.name(),
                    a,
                    b,
                    light.flux(),
                    scene.unit.flux_symbol()
                );
            }
            for camera in &scene.cameras {
                println!(
                    "camera {:?} at {:.3} looking along {:.3}",
                    camera.name,
                    camera.position,
                    camera.forward()
                );
            }
            for warning in &loaded.warnings {
                println!("warning: {warning}");
            }
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
