//! Which part of a tube a few floor points see past a post: exactly, by one query each.
//!
//! `cargo run -p llsr-tracer --example visible_part`

use glam::{DVec3, Vec3};
use llsr_scene::{Material, Primitive, Scene, SegmentOracle, Shape};
use llsr_tracer::{FanScratch, Tracer};
use llsr_visibility::Partition;

fn main() {
    let mut scene = Scene::new("a post on a floor");
    let material = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    let shape = Shape::Cylinder {
        a: Vec3::ZERO,
        b: Vec3::new(0.0, 3.0, 0.0),
        radius: 0.1,
        capped: true,
    };
    scene.add_primitive("post", Primitive { shape, material });
    let (tracer, _) = Tracer::new(&scene);

    let (a, b) = (DVec3::new(-1.0, 2.0, -1.0), DVec3::new(1.0, 2.0, -1.0));
    let (mut scratch, mut visible) = (FanScratch::default(), Partition::dark());
    for x in [0.0, 0.5, 1.0, 1.5] {
        let p = DVec3::new(x, 0.0, 1.0);
        tracer.visible_part(p, a, b, &mut scratch, &mut visible);
        let panels: Vec<String> = visible
            .panels()
            .iter()
            .map(|panel| format!("{:.4} to {:.4}", panel.start, panel.end))
            .collect();
        println!("from x = {x}: {}", panels.join(" and "));
    }
}
