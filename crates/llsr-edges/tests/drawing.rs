//! Drawings: hidden parts against brute force, and polylines.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use llsr_edges::{
    Eye, Part, SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView, Sight, Stroke, join,
    split_hidden,
};
use llsr_scene::{MaterialId, Mesh, Scene, SegmentOracle};
use llsr_testkit::edges::{bumpy_sphere, chain_link, torus};
use llsr_testkit::tracer::{fan_cells, segment_is_cut};
use llsr_visibility::{Panel, Partition};
use proptest::prelude::*;

/// Fans in exact arithmetic over all triangles.
struct BruteForce(Vec<[Vec3; 3]>);

impl SegmentOracle for BruteForce {
    type Scratch = ();

    fn visible_part(&self, p: DVec3, a: DVec3, b: DVec3, (): &mut (), visible: &mut Partition) {
        visible.clear();
        for cell in fan_cells(&self.0, p, a, b).iter().filter(|cell| !cell.blocked) {
            if cell.lo < cell.hi {
                visible.push(Panel::exact(cell.lo, cell.hi));
            }
        }
    }
}

fn scene_of(meshes: &[Mesh]) -> (Scene, BruteForce) {
    let mut scene = Scene::new("");
    let mut triangles = Vec::new();
    for mesh in meshes {
        triangles.extend((0..mesh.triangles.len()).map(|i| mesh.corners(i)));
        scene.add_mesh(mesh.clone());
    }
    (scene, BruteForce(triangles))
}

fn strokes(scene: &Scene, eye: Eye) -> Vec<Stroke> {
    let edges = SceneEdges::new(scene, &SceneEdgeOptions::with_crease_degrees(30.0));
    let mut found = SceneFound::default();
    let view = SceneView::Eye { eye, chords: 64 };
    edges.find(view, None, &mut SceneScratch::default(), &mut found);
    let stroke = |ends: &[Vec3; 2]| Stroke {
        group: 0,
        ends: ends.map(Vec3::as_dvec3),
    };
    found.segments().iter().map(stroke).collect()
}

/// Is the point of `stroke` at `t` hidden by a triangle that is not the edge's own? Ends on a plane up to rounding are
/// avoided by leaving own triangles out, which hide nothing of their own edge.
fn hidden_at(triangles: &[[Vec3; 3]], eye: Eye, stroke: &Stroke, t: f64) -> bool {
    let others: Vec<[Vec3; 3]> = triangles
        .iter()
        .filter(|triangle| {
            let has = |p: DVec3| triangle.iter().any(|v| v.as_dvec3() == p);
            !(has(stroke.ends[0]) && has(stroke.ends[1]))
        })
        .copied()
        .collect();
    let point = stroke.at(t);
    let viewer = match eye {
        Eye::At(p) => p,
        Eye::Towards(d) => point + d * 1e3,
    };
    segment_is_cut(&others, viewer, point)
}

fn check(meshes: &[Mesh], eye: Eye, tolerance: f64) {
    let (scene, oracle) = scene_of(meshes);
    let strokes = strokes(&scene, eye);
    let sight = Sight::of_edges(eye, f64::from(scene.bounds().diagonal()));
    let parts = split_hidden(&strokes, &sight, &oracle);
    let mut covered = vec![0.0; strokes.len()];
    let (mut seen, mut hidden, mut whole) = (0, 0, 0);
    for part in &parts {
        assert_eq!(
            part.t[0], covered[part.stroke as usize],
            "parts follow each other"
        );
        covered[part.stroke as usize] = part.t[1];
        let stroke = &strokes[part.stroke as usize];
        let length = stroke.ends[0].distance(stroke.ends[1]) * (part.t[1] - part.t[0]);
        *if part.hidden { &mut hidden } else { &mut seen } += 1;
        whole += usize::from(part.t == [0.0, 1.0]);
        if length < 4.0 * tolerance {
            continue;
        }
        for share in [0.3, 0.5, 0.77] {
            let t = part.t[0] + (part.t[1] - part.t[0]) * share;
            assert_eq!(
                hidden_at(&oracle.0, eye, stroke, t),
                part.hidden,
                "{part:?} of {stroke:?} at {t} from {eye:?}"
            );
        }
    }
    assert!(covered.iter().all(|&end| end == 1.0), "parts cover the strokes");
    assert!(
        seen > 10 && hidden > 10 && parts.len() > whole,
        "{seen} seen, {hidden} hidden, {whole} whole"
    );
}

fn still_life() -> Vec<Mesh> {
    vec![
        Mesh::cuboid(
            "table",
            Vec3::new(-2.0, -0.2, -2.0),
            Vec3::new(2.0, 0.0, 2.0),
            MaterialId(0),
        ),
        // It stands exactly on the table, and half of it hides behind the ring.
        Mesh::cuboid(
            "box",
            Vec3::new(-0.5, 0.0, -1.2),
            Vec3::new(0.7, 1.0, -0.4),
            MaterialId(0),
        ),
        chain_link(Vec3::new(0.3, 0.5, 0.6), 0.3, true, 10, 5),
        torus(0.6, 0.2, 10, 6),
    ]
}

#[test]
fn parts_are_hidden_where_brute_force_says_so() {
    check(&still_life(), Eye::At(DVec3::new(3.1, 2.3, 4.7)), 1e-5);
    check(
        &[bumpy_sphere(8, 0.3, 4)],
        Eye::At(DVec3::new(0.4, -0.9, 3.3)),
        1e-5,
    );
}

#[test]
fn parallel_rays_are_judged_the_same_way() {
    check(
        &still_life(),
        Eye::Towards(DVec3::new(0.3, 0.45, 1.0).normalize()),
        1e-3,
    );
}

#[test]
fn an_edge_is_never_hidden_by_its_own_faces() {
    // Convex solids of any size, near and far, alone: every edge found is seen.
    for scale in [1e-3f32, 1.0, 1e4] {
        for offset in [0.0f32, 100.0] {
            let low = Vec3::splat(offset * scale);
            let cube = Mesh::cuboid("", low, low + Vec3::new(1.0, 0.7, 0.3) * scale, MaterialId(0));
            let ball = {
                let mut ball = bumpy_sphere(6, 0.0, 1);
                for p in &mut ball.positions {
                    *p = *p * scale + low;
                }
                ball
            };
            for mesh in [cube, ball] {
                let (scene, oracle) = scene_of(&[mesh]);
                let center = scene.bounds().center().as_dvec3();
                let size = f64::from(scene.bounds().diagonal());
                for away in [0.8, 3.0, 1e4] {
                    let eye = Eye::At(center + DVec3::new(0.48, 0.36, 0.8) * (size * away));
                    let strokes = strokes(&scene, eye);
                    let sight = Sight::of_edges(eye, size);
                    let parts = split_hidden(&strokes, &sight, &oracle);
                    assert!(strokes.len() >= 7, "{} strokes", strokes.len());
                    let hidden: Vec<&Part> = parts.iter().filter(|part| part.hidden).collect();
                    assert!(
                        hidden.is_empty(),
                        "{hidden:?} at scale {scale}, offset {offset}, away {away}"
                    );
                }
            }
        }
    }
}

#[test]
fn what_touches_an_edge_does_not_hide_it() {
    // A box on a floor, and a second one that shares its side: their common edges are seen from above.
    let boxes = [
        Mesh::cuboid(
            "floor",
            Vec3::new(-3.0, -0.1, -3.0),
            Vec3::new(3.0, 0.0, 3.0),
            MaterialId(0),
        ),
        Mesh::cuboid("a", Vec3::ZERO, Vec3::ONE, MaterialId(0)),
        Mesh::cuboid("b", Vec3::X, Vec3::new(2.0, 1.0, 1.0), MaterialId(0)),
    ];
    let (_, oracle) = scene_of(&boxes);
    let sight = Sight::of_edges(Eye::At(DVec3::new(1.3, 2.0, 5.0)), 9.0);
    let stroke = |a: Vec3, b: Vec3| Stroke {
        group: 0,
        ends: [a.as_dvec3(), b.as_dvec3()],
    };
    let touching = [
        stroke(Vec3::Z, Vec3::new(1.0, 0.0, 1.0)),
        stroke(Vec3::new(1.0, 1.0, 0.0), Vec3::ONE),
        stroke(Vec3::new(1.0, 0.0, 1.0), Vec3::ONE),
    ];
    let parts = split_hidden(&touching, &sight, &oracle);
    assert_eq!(parts.len(), 3, "{parts:?}");
    assert!(
        parts.iter().all(|part| !part.hidden && part.t == [0.0, 1.0]),
        "{parts:?}"
    );
}

/// A part that covers each stroke.
fn whole(strokes: &[Stroke]) -> Vec<Part> {
    (0..strokes.len() as u32)
        .map(|stroke| Part {
            stroke,
            hidden: false,
            t: [0.0, 1.0],
        })
        .collect()
}

fn polyline(points: &[DVec3]) -> Vec<Stroke> {
    points
        .windows(2)
        .map(|pair| Stroke {
            group: 0,
            ends: [pair[0], pair[1]],
        })
        .collect()
}

#[test]
fn loops_close_and_crossings_go_straight_on() {
    let circle: Vec<DVec3> = (0..=12)
        .map(|i| DVec3::from((glam::DVec2::from_angle(f64::from(i % 12) * 0.5), 0.0)))
        .collect();
    let lines = join(&polyline(&circle), &whole(&polyline(&circle)), |p| p);
    assert_eq!(lines.len(), 1, "{lines:?}");
    assert!(lines[0].closed && lines[0].points.len() == 12, "{lines:?}");

    // Two lines that cross in a common point, cut there.
    let mut cross = polyline(&[DVec3::NEG_X, DVec3::ZERO, DVec3::X]);
    cross.extend(polyline(&[DVec3::NEG_Y, DVec3::ZERO, DVec3::Y]));
    let lines = join(&cross, &whole(&cross), |p| p);
    let ends: Vec<[DVec3; 2]> = lines
        .iter()
        .map(|line| [line.points[0], line.points[2]])
        .collect();
    assert_eq!(ends, [[DVec3::NEG_X, DVec3::X], [DVec3::NEG_Y, DVec3::Y]]);

    // Other groups and hidden parts are kept apart.
    let mut mixed = polyline(&[DVec3::ZERO, DVec3::X, DVec3::X * 2.0, DVec3::X * 3.0]);
    mixed[1].group = 7;
    assert_eq!(join(&mixed, &whole(&mixed), |p| p).len(), 3, "groups");
    mixed[1].group = 0;
    let mut parts = whole(&mixed);
    parts[1].hidden = true;
    assert_eq!(join(&mixed, &parts, |p| p).len(), 3, "hidden parts");
    assert_eq!(join(&mixed, &whole(&mixed), |p| p).len(), 1, "all of one kind");
    assert_eq!(join(&[], &[], |p| p), [], "nothing");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Segments between points of a small grid, many of them equal, crossing, or of no length.
    #[test]
    fn every_part_is_drawn_once(ends in prop::collection::vec(prop::array::uniform4(0u8..4), 0..60)) {
        let point = |x: u8, y: u8| DVec3::new(f64::from(x), f64::from(y), 0.0);
        let strokes: Vec<Stroke> = ends
            .iter()
            .map(|&[x0, y0, x1, y1]| Stroke { group: u32::from(x0 % 2), ends: [point(x0, y0), point(x1, y1)] })
            .collect();
        let lines = join(&strokes, &whole(&strokes), |p| p);
        let name = |group: u32, a: DVec3, b: DVec3| {
            let mut ends = [a, b].map(|p| [p.x as u8, p.y as u8]);
            ends.sort_unstable();
            (group, ends)
        };
        let mut left: BTreeMap<_, i32> = BTreeMap::new();
        for stroke in &strokes {
            *left.entry(name(stroke.group, stroke.ends[0], stroke.ends[1])).or_default() += 1;
        }
        for line in &lines {
            prop_assert!(line.points.len() >= 2, "{line:?}");
            let closing = line.closed.then(|| [line.points[line.points.len() - 1], line.points[0]]);
            let pairs = line.points.windows(2).map(|pair| [pair[0], pair[1]]).chain(closing);
            for [a, b] in pairs {
                *left.entry(name(line.group, a, b)).or_default() -= 1;
            }
        }
        prop_assert!(left.values().all(|&n| n == 0), "{left:?}");
    }
}
