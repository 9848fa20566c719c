//! How many pieces the curves have in which surfaces of a scene run into each other, and how long finding them takes.
//!
//! `cargo run --release -p llsr-edges --example meetings -- SCENE.obj|.gltf|.glb|demo:NAME...`

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use llsr_edges::{MeetingOptions, Meetings, SceneEdgeOptions, SceneEdges};
use llsr_io::{LoadOptions, load_scene};
use llsr_scene::demo;

fn main() -> ExitCode {
    for name in std::env::args().skip(1) {
        let scene = match name.strip_prefix("demo:") {
            Some(demo) => demo::build(demo),
            None => load_scene(Path::new(&name), &LoadOptions::default())
                .map(|loaded| loaded.scene)
                .ok(),
        };
        let Some(scene) = scene else {
            eprintln!("{name}: cannot be read");
            return ExitCode::FAILURE;
        };
        let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
        let mut times = Vec::new();
        let mut found = Meetings::default();
        for _ in 0..5 {
            let start = Instant::now();
            found = Meetings::new(&edges, MeetingOptions::default());
            times.push(start.elapsed().as_secs_f64());
        }
        times.sort_by(f64::total_cmp);
        let within = found
            .iter()
            .filter(|meeting| meeting.objects[0] == meeting.objects[1])
            .count();
        println!(
            "{name}: {} triangles, {} pieces of meetings, {within} of them within one object, {:.1} ms{}",
            scene.triangle_count(),
            found.len(),
            1e3 * times[2],
            if found.is_cut_short() { ", cut short" } else { "" }
        );
    }
    ExitCode::SUCCESS
}
