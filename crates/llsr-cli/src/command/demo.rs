//! `llsr demo`: the built-in scenes.

use std::path::PathBuf;

use llsr_io::write_gltf;
use llsr_scene::demo;

use crate::args::{Common, DemoArgs};
use crate::failure::Failure;
use crate::load::no_such_demo;

pub(crate) fn run(args: &DemoArgs, common: &Common) -> Result<(), Failure> {
    let Some(name) = &args.name else {
        for demo in demo::DEMOS {
            println!("{:<20} {}", demo.name, demo.about);
        }
        if !common.quiet {
            println!("\nRender one with `llsr render demo:NAME`, or write it as glTF with `llsr demo NAME`.");
        }
        return Ok(());
    };
    let bare = name.strip_prefix("demo:").unwrap_or(name);
    let scene = demo::build(bare).ok_or_else(|| Failure::Usage(no_such_demo(bare)))?;
    let output = args
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{bare}.gltf")));
    write_gltf(&output, &scene)?;
    if !common.quiet {
        println!("wrote {}", output.display());
    }
    Ok(())
}
