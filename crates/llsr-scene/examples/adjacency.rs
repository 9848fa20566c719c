//! Welds a box whose faces do not share vertices, and looks at its edges.
//!
//! `cargo run -p llsr-scene --example adjacency`

use glam::Vec3;
use llsr_scene::{Adjacency, MaterialId, Mesh};

fn main() {
    let cube = Mesh::cuboid("box", Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), MaterialId(0));
    // As a file with flat normals has it: three vertices of its own for every triangle.
    let positions: Vec<Vec3> = (0..cube.triangles.len())
        .flat_map(|face| cube.corners(face))
        .collect();
    let triangles: Vec<[u32; 3]> = (0..cube.triangles.len() as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();

    let adjacency = Adjacency::new(&positions, &triangles);
    println!(
        "{} vertices in the file, {} after welding",
        positions.len(),
        adjacency.weld.representative.len()
    );
    println!(
        "{} edges, closed: {}",
        adjacency.edges.len(),
        adjacency.is_closed()
    );
    let normal = |face: u32| {
        let [a, b, c] = adjacency.faces[face as usize].map(|v| adjacency.position(&positions, v));
        (b - a).cross(c - a).normalize()
    };
    let sharp = adjacency
        .edges
        .iter()
        .filter(|edge| normal(edge.faces[0]).dot(normal(edge.faces[1])) < 0.5)
        .count();
    println!("{sharp} of them are sharp: the sides of the box, not its diagonals");
}
