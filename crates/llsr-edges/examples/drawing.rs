//! A line drawing without hidden lines, as SVG on standard output: `drawing > chain.svg`.
//!
//! The oracle here tries all triangles; with a ray tracer that answers fan queries it is a matter of milliseconds.

use std::f32::consts::TAU;

use glam::{DVec3, Vec3};
use llsr_edges::{
    Eye, SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView, Sight, Stroke, clip_to_picture,
    join, split_hidden,
};
use llsr_scene::{Camera, FieldOfView, MaterialId, Mesh, Scene, SegmentOracle, Viewport};
use llsr_visibility::{Panel, Partition};

/// Samples each segment and tries all triangles at every sample.
struct Samples(Vec<[DVec3; 3]>);

impl Samples {
    fn hides(&self, p: DVec3, q: DVec3) -> bool {
        let ray = q - p;
        self.0.iter().any(|&[a, b, c]| {
            let (u, v, w) = (a - p, b - p, c - p);
            let sides = [ray.dot(u.cross(v)), ray.dot(v.cross(w)), ray.dot(w.cross(u))];
            let inside = sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0);
            let normal = (b - a).cross(c - a);
            inside && normal.dot(u) / normal.dot(ray) < 1.0
        })
    }
}

impl SegmentOracle for Samples {
    type Scratch = ();

    fn visible_part(&self, p: DVec3, a: DVec3, b: DVec3, (): &mut (), visible: &mut Partition) {
        const COUNT: u32 = 16;
        visible.clear();
        for i in 0..COUNT {
            let at = |x: f64| (f64::from(i) + x) / f64::from(COUNT);
            if !self.hides(p, a + (b - a) * at(0.5)) {
                visible.push(Panel::exact(at(0.0), at(1.0)));
            }
        }
    }
}

fn link(middle: Vec3, upright: bool) -> Mesh {
    let (rows, columns) = (48, 16);
    let positions = (0..rows * columns)
        .map(|i| {
            let (u, v) = (
                TAU * (i / columns) as f32 / rows as f32,
                TAU * (i % columns) as f32 / columns as f32,
            );
            let out = 1.0 + 0.25 * v.cos();
            let p = Vec3::new(out * u.cos() * 1.4, -0.25 * v.sin(), out * u.sin());
            middle + if upright { Vec3::new(p.x, -p.z, p.y) } else { p }
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
    Mesh::new("link", positions, triangles, MaterialId(0))
}

fn main() {
    let mut scene = Scene::new("two links");
    let mut triangles = Vec::new();
    for mesh in [link(Vec3::ZERO, false), link(Vec3::X * 1.9, true)] {
        triangles.extend((0..mesh.triangles.len()).map(|i| mesh.corners(i).map(|p| p.as_dvec3())));
        scene.add_mesh(mesh);
    }
    let viewport = Viewport {
        width: 600,
        height: 400,
    };
    let eye = DVec3::new(2.0, 3.0, 6.0);
    let target = DVec3::new(0.9, 0.0, 0.0);
    let camera = Camera::look_at("", eye, target, DVec3::Y, FieldOfView::vertical_degrees(40.0));

    let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
    let mut found = SceneFound::default();
    let view = SceneView::Picture {
        camera: &camera,
        viewport,
    };
    edges.find(view, None, &mut SceneScratch::default(), &mut found);
    let strokes: Vec<Stroke> = found
        .segments()
        .iter()
        .filter_map(|ends| clip_to_picture(&camera, viewport, 1e-3, ends.map(Vec3::as_dvec3)))
        .map(|ends| Stroke { group: 0, ends })
        .collect();
    let sight = Sight::of_edges(Eye::of(&camera), f64::from(scene.bounds().diagonal()));
    let mut parts = split_hidden(&strokes, &sight, &Samples(triangles));
    parts.retain(|part| !part.hidden);
    let project = |p: DVec3| {
        camera
            .project(viewport, p)
            .map_or(p, |(x, y, _)| DVec3::new(x, y, 0.0))
    };
    let lines = join(&strokes, &parts, project);

    println!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 600 400\">");
    for line in &lines {
        let points: Vec<String> = line
            .points
            .iter()
            .chain(line.points.first().filter(|_| line.closed))
            .map(|&p| format!("{:.2},{:.2}", project(p).x, project(p).y))
            .collect();
        println!(
            "<polyline fill=\"none\" stroke=\"black\" points=\"{}\"/>",
            points.join(" ")
        );
    }
    println!("</svg>");
    eprintln!(
        "{} edges, {} seen parts, {} lines",
        strokes.len(),
        parts.len(),
        lines.len()
    );
}
