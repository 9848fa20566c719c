//! Meshes that no modeller should make: needles, triangles without an area, sheets that meet in one edge, loose triangles.

use glam::{Affine3A, DVec3, Vec3};
use llsr_scene::{MaterialId, Mesh, Scene, SegmentOracle};
use llsr_testkit::tracer::{disagreement, fan_cells, hare, scene_of, world_triangles};
use llsr_tracer::{FanScratch, Tracer};
use llsr_visibility::{Certificate, Partition};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn unit(rng: &mut Pcg64Mcg) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn point(rng: &mut Pcg64Mcg, size: f64) -> DVec3 {
    DVec3::new(unit(rng), unit(rng), unit(rng)) * (2.0 * size) - size
}

fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    Mesh::new("mesh", positions, triangles, MaterialId(0))
}

fn one(mesh: Mesh) -> Scene {
    scene_of([(mesh, Affine3A::IDENTITY)])
}

fn visible(tracer: &Tracer, p: DVec3, a: DVec3, b: DVec3) -> Partition {
    let mut visible = Partition::default();
    tracer.visible_part(p, a, b, &mut FanScratch::default(), &mut visible);
    visible
}

/// Random fans against exact brute force; returns how many were partly hidden.
fn check(mesh: Mesh, seed: u64, fans: u32) -> u32 {
    let scene = one(mesh);
    let triangles = world_triangles(&scene);
    let (tracer, _) = Tracer::new(&scene);
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut partly = 0;
    for _ in 0..fans {
        let [p, a, b] = [(); 3].map(|()| point(&mut rng, 1.3));
        let found = visible(&tracer, p, a, b);
        let difference = disagreement(&fan_cells(&triangles, p, a, b), &found, 1e-9);
        assert!(
            difference.missed == 0.0 && difference.invented == 0.0,
            "{p} to {a} - {b}: {difference:?}, {found:?}"
        );
        assert_eq!(found.certificate(), Certificate::Exact, "{p} to {a} - {b}");
        partly += u32::from(found.discontinuities() > 0);
    }
    partly
}

#[test]
fn triangles_without_area_hide_nothing() {
    let solid = hare(20, 12, MaterialId(0));
    let (mut positions, mut triangles) = (solid.positions.clone(), solid.triangles.clone());
    let first = positions.len() as u32;
    let (u, v) = (Vec3::new(-1.0, 0.5, 0.25), Vec3::new(1.0, 0.75, 0.25));
    // A point, an edge there and back, three points on a line (exactly), and edges of the body folded onto themselves.
    positions.extend([u, v, u + 0.5 * (v - u)]);
    triangles.extend([
        [first, first, first],
        [first, first + 1, first],
        [first, first + 2, first + 1],
    ]);
    triangles.extend((0..50).map(|i| {
        let [a, b, _] = solid.triangles[i];
        [a, b, a]
    }));
    let (clean, _) = Tracer::new(&one(solid));
    let (cluttered, _) = Tracer::new(&one(mesh(positions, triangles)));
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let mut partly = 0;
    for i in 0..2000 {
        let [mut p, a, b] = [(); 3].map(|()| point(&mut rng, 1.5));
        if i % 4 == 0 {
            // In a plane with the line, and so is the light's end.
            p = (u + (v - u) * unit(&mut rng) as f32).as_dvec3() + (a - v.as_dvec3()) * -0.5;
        }
        let (x, y) = (visible(&clean, p, a, b), visible(&cluttered, p, a, b));
        assert_eq!(x, y, "{p} to {a} - {b}");
        partly += u32::from(x.discontinuities() > 0);
    }
    assert!(partly > 200, "{partly} penumbrae");
}

#[test]
fn needles_are_seen_for_what_they_are() {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    for width in [1e-2, 1e-4, 1e-6] {
        let (mut positions, mut triangles) = (vec![], vec![]);
        for i in 0..60u32 {
            let (u, v) = (point(&mut rng, 1.0), point(&mut rng, 1.0));
            positions.extend([u, v, v + point(&mut rng, width)].map(|x| x.as_vec3()));
            triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        let partly = check(mesh(positions, triangles), 3, 600);
        assert!(partly > 300, "width {width}: {partly} penumbrae");
    }
}

/// Sheets around the edge from (0, -1, 0) to (0, 1, 0), every second one turned over.
fn book(sheets: u32, welded: bool) -> Mesh {
    let (mut positions, mut triangles) = (vec![], vec![]);
    let spine = [Vec3::NEG_Y, Vec3::Y];
    if welded {
        positions.extend(spine);
    }
    for i in 0..sheets {
        let (s, c) = (i as f32 * 1.1).sin_cos();
        let out = Vec3::new(c, 0.0, s);
        let edge = if welded {
            [0, 1]
        } else {
            positions.extend(spine);
            [positions.len() as u32 - 2, positions.len() as u32 - 1]
        };
        let n = positions.len() as u32;
        positions.extend(spine.map(|v| v + out));
        let [lower, upper] = edge;
        let two = [[lower, n, upper], [upper, n, n + 1]];
        triangles.extend(two.map(|[a, b, c]| if i % 2 == 0 { [a, b, c] } else { [a, c, b] }));
        // Twice the same.
        triangles.push(two[0]);
    }
    mesh(positions, triangles)
}

#[test]
fn sheets_that_share_an_edge_leave_no_slit() {
    for welded in [true, false] {
        for sheets in [1, 3, 5] {
            let partly = check(book(sheets, welded), 4, 500);
            assert!(partly > 100, "{sheets} sheets: {partly} penumbrae");
        }
        // Two sheets of one plane meet in the spine: seen through it they are one wall, however the fan passes.
        let mut wall = book(1, welded);
        let n = wall.positions.len() as u32;
        let (lower, upper) = (Vec3::NEG_Y, Vec3::Y);
        wall.positions
            .extend([lower, upper, lower - Vec3::X, upper - Vec3::X]);
        let spine = if welded { [0, 1] } else { [n, n + 1] };
        wall.triangles
            .extend([[spine[0], spine[1], n + 2], [spine[1], n + 3, n + 2]]);
        let wall = mesh(wall.positions, wall.triangles);
        let (tracer, _) = Tracer::new(&one(wall));
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        for i in 0..3000 {
            let (mut p, mut a, mut b) = (point(&mut rng, 0.4), point(&mut rng, 0.4), point(&mut rng, 0.4));
            (p.z, a.z, b.z) = (-1.0, 1.0, 1.0 + unit(&mut rng));
            match i % 3 {
                // Through the spine at one place of the light, or all along it.
                0 => a.x = -p.x,
                1 => (p.x, a.x, b.x) = (0.0, 0.0, 0.0),
                _ => {}
            }
            assert!(visible(&tracer, p, a, b).is_dark(), "{p} to {a} - {b}");
        }
    }
}

#[test]
fn size_and_place_change_nothing_but_rounding() {
    // Powers of two scale single precision exactly: from a millimetre to 131 km.
    let body = hare(24, 14, MaterialId(0));
    let (tracer, _) = Tracer::new(&one(body.clone()));
    for exponent in [-10, 17] {
        let scale = 2f64.powi(exponent);
        let scaled = mesh(
            body.positions.iter().map(|&v| v * scale as f32).collect(),
            body.triangles.clone(),
        );
        let (other, _) = Tracer::new(&one(scaled));
        let mut rng = Pcg64Mcg::seed_from_u64(6);
        let mut partly = 0;
        for _ in 0..1500 {
            let [p, a, b] = [(); 3].map(|()| point(&mut rng, 1.5));
            let (x, y) = (
                visible(&tracer, p, a, b),
                visible(&other, p * scale, a * scale, b * scale),
            );
            assert_eq!(x, y, "scaled by {scale}: {p} to {a} - {b}");
            partly += u32::from(x.discontinuities() > 0);
        }
        assert!(partly > 150, "{partly} penumbrae");
    }
    // A thousand kilometres away only a sixteenth of a metre is left; where the body is that coarse, nothing else differs.
    let grid = |v: Vec3| (v * 1024.0).round() / 16.0;
    let coarse = |offset: Vec3| {
        mesh(
            body.positions.iter().map(|&v| grid(v) + offset).collect(),
            body.triangles.clone(),
        )
    };
    let far = Vec3::new(1e6, -1e6, 5e5);
    let (here, _) = Tracer::new(&one(coarse(Vec3::ZERO)));
    let (there, _) = Tracer::new(&one(coarse(far)));
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let mut partly = 0;
    for _ in 0..1500 {
        // Rounded, so that the points are the same seen from both places.
        let [p, a, b] = [(); 3].map(|()| (point(&mut rng, 100.0) * 1024.0).round() / 1024.0);
        let o = far.as_dvec3();
        let (x, y) = (visible(&here, p, a, b), visible(&there, p + o, a + o, b + o));
        assert_eq!(
            x.panels().len(),
            y.panels().len(),
            "{p} to {a} - {b}: {x:?}, {y:?}"
        );
        for (u, v) in x.panels().iter().zip(y.panels()) {
            assert!(
                (u.start - v.start).abs() < 1e-9 && (u.end - v.end).abs() < 1e-9,
                "{p} to {a} - {b}: {x:?}, {y:?}"
            );
        }
        partly += u32::from(x.discontinuities() > 0);
    }
    assert!(partly > 150, "{partly} penumbrae");
}

/// Rational arithmetic hides the light from this parameter on: there it leaves the plane of the first triangle, in which p and all
/// of the light lie up to 1e-17. The second triangle hides nothing; its edges only make brute force look at stretches of their own.
#[test]
fn a_fan_all_but_in_a_triangle_is_hidden_in_one_stretch() {
    const FIRST_HIDDEN: f64 = 0.886_497_957_295_678_6;
    let positions = vec![
        Vec3::new(-0.2175826, -0.3799105, -0.624998),
        Vec3::new(-0.18167315, -0.15319464, -0.5269965),
        Vec3::new(0.22504568, -0.4710082, -0.21518467),
        Vec3::new(0.9351092, 0.67411554, 0.64304173),
        Vec3::new(1.5938951, 0.5033708, 0.2965939),
        Vec3::new(0.70430326, 1.031302, 1.2152036),
    ];
    let scene = one(mesh(positions, vec![[0, 1, 2], [3, 4, 5]]));
    let p = DVec3::new(-0.053597028466086216, -0.38772186371419914, -0.46599506975508);
    let a = DVec3::new(-0.18741490200021188, -0.36355882567833786, -0.5908265320171713);
    let b = DVec3::new(-0.00859080018952929, -0.34935848987457274, -0.4111519781196925);
    let (tracer, _) = Tracer::new(&scene);
    let found = visible(&tracer, p, a, b);
    let ends: Vec<[f64; 2]> = found.panels().iter().map(|x| [x.start, x.end]).collect();
    assert!(
        matches!(ends[..], [[0.0, end]] if (end - FIRST_HIDDEN).abs() < 1e-15),
        "{found:?}"
    );
    let cells = fan_cells(&world_triangles(&scene), p, a, b);
    for cell in cells.iter().filter(|cell| cell.lo < cell.hi) {
        let middle = 0.5 * (cell.lo + cell.hi);
        assert_eq!(cell.blocked, middle > FIRST_HIDDEN, "{cell:?}");
    }
    let difference = disagreement(&cells, &found, 1e-9);
    assert_eq!((difference.missed, difference.invented), (0.0, 0.0));
    assert!(difference.compared >= 2, "{difference:?}");
}

/// The light in a triangle's plane, p on a triangle's edge, both up to rounding: where the light's first hidden or last visible point
/// is, the last bits of the coordinates decide, and the query may put it elsewhere, past a place where nothing ends.
#[test]
fn an_end_that_rounding_decides_is_no_occluder_missed() {
    let light_in_plane = (
        [
            [
                Vec3::new(-0.37982884, -0.43108293, -0.647995),
                Vec3::new(-0.25355595, -0.851699, 0.52232),
                Vec3::new(-0.47280216, -0.18458489, 0.7857394),
            ],
            [
                Vec3::new(-0.25355595, -0.851699, 0.52232),
                Vec3::new(0.4781655, 0.12458834, 0.7942515),
                Vec3::new(-0.47280216, -0.18458489, 0.7857394),
            ],
        ],
        [
            DVec3::new(-1.0618554375328797, -0.7583137364572763, -0.5458874684348666),
            DVec3::new(-0.3741985562152491, -0.46461904700645534, -0.05891884400454345),
            DVec3::new(-0.3823705041079049, -0.428438120350555, -0.4601045235889162),
        ],
        // By rational arithmetic.
        0.4461876233617545,
        0.002,
    );
    let point_on_edge = (
        [
            [
                Vec3::new(0.5172647, -0.1817675, -0.5117595),
                Vec3::new(0.32052004, -0.33435726, -0.5342959),
                Vec3::new(0.52340186, -0.15301356, -0.76002455),
            ],
            [
                Vec3::new(-0.0061371326, -0.028753936, 0.24826507),
                Vec3::new(-0.16026002, 0.16717863, 0.26714796),
                Vec3::new(-0.0061371326, -0.028753936, 0.24826507),
            ],
        ],
        [
            DVec3::new(0.5205286271236911, -0.16647532460205017, -0.6437939894967355),
            DVec3::new(-0.2693795535207275, 1.047054546355781, 0.6930195958038754),
            DVec3::new(-1.0, -1.0, 1.25),
        ],
        0.32088858341372845,
        0.6,
    );
    for (triangles, [p, a, b], end, contested) in [light_in_plane, point_on_edge] {
        let scene = one(mesh(triangles.concat(), vec![[0, 1, 2], [3, 4, 5]]));
        let cells = fan_cells(&world_triangles(&scene), p, a, b);
        let wide: Vec<_> = cells.iter().filter(|cell| cell.lo < cell.hi).collect();
        let changes: Vec<_> = wide
            .windows(2)
            .filter(|pair| pair[0].blocked != pair[1].blocked)
            .collect();
        let [[before, _]] = changes[..] else {
            panic!("one end: {cells:?}");
        };
        assert!((before.hi - end).abs() < 1e-12, "{before:?}");
        assert!(before.hi_condition > 1e15, "{before:?}");
        let (tracer, _) = Tracer::new(&scene);
        let found = disagreement(&cells, &visible(&tracer, p, a, b), 1e-9);
        assert_eq!((found.missed, found.invented), (0.0, 0.0), "{found:?}");
        // A tolerance that does not reach across what is contested finds it missed.
        let strict = disagreement(&cells, &Partition::lit(), contested / before.hi_condition);
        assert!(strict.missed > contested, "{strict:?}");
    }
}
