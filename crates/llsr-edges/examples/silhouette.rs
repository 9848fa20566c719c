//! Silhouette of a torus from a few places: `silhouette`.

use std::f32::consts::TAU;

use glam::{DVec3, Vec3};
use llsr_edges::{EdgeOptions, EdgeScratch, FoundEdges, MeshEdges};
use llsr_intervals::Viewpoint;
use llsr_scene::{MaterialId, Mesh};

fn torus(rows: u32, columns: u32) -> Mesh {
    let angle = |i: u32, n: u32| TAU * i as f32 / n as f32;
    let positions = (0..rows * columns)
        .map(|i| {
            let (around, across) = (angle(i / columns, rows), angle(i % columns, columns));
            let out = 1.0 + 0.4 * across.cos();
            Vec3::new(out * around.cos(), -0.4 * across.sin(), out * around.sin())
        })
        .collect();
    let at = |r: u32, c: u32| (r % rows) * columns + c % columns;
    let triangles = (0..rows * columns)
        .flat_map(|i| {
            let (r, c) = (i / columns, i % columns);
            let [p, q, s, t] = [at(r, c), at(r + 1, c), at(r + 1, c + 1), at(r, c + 1)];
            [[p, q, s], [p, s, t]]
        })
        .collect();
    Mesh::new("torus", positions, triangles, MaterialId(0))
}

fn main() {
    let mesh = torus(400, 200);
    let edges = MeshEdges::new(&mesh, EdgeOptions::default()).expect("the torus is a valid mesh");
    let (mut scratch, mut found) = (EdgeScratch::default(), FoundEdges::default());
    for eye in [
        DVec3::new(0.0, 5.0, 0.0),
        DVec3::new(3.0, 1.0, 0.0),
        DVec3::new(0.0, 0.0, 9.0),
    ] {
        let viewer = Viewpoint::at(eye).expect("a finite place");
        let did = edges.find(&viewer, &mut scratch, &mut found);
        println!(
            "from {eye}: {} of {} edges, after a look at {} nodes and {} blocks of 64",
            found.silhouettes.len(),
            edges.len(),
            did.nodes,
            did.blocks,
        );
    }
}
