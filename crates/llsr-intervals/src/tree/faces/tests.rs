//! Queries against a test of every face.

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;

fn uniform(random: &mut Pcg64Mcg) -> f64 {
    f64::from(random.next_u32()) / f64::from(1u32 << 31) - 1.0
}

fn vector(random: &mut Pcg64Mcg) -> DVec3 {
    DVec3::new(uniform(random), uniform(random), uniform(random))
}

/// Faces of all sizes around `center`.
fn faces(random: &mut Pcg64Mcg, count: usize, center: DVec3) -> Vec<[DVec3; 3]> {
    (0..count)
        .map(|_| {
            let at = center + vector(random);
            let size = 10f64.powf(-1.5 + 1.5 * uniform(random));
            // Mesh corners are single-precision numbers.
            [at, at + size * vector(random), at + size * vector(random)].map(|p| p.as_vec3().as_dvec3())
        })
        .collect()
}

/// Part of the line in which a face crosses the wedge's plane that lies inside, if longer than `least`.
fn meets(face: [DVec3; 3], apex: DVec3, d: [DVec3; 2], least: f64) -> bool {
    let normal = d[0].cross(d[1]).normalize();
    let height = face.map(|p| normal.dot(p - apex));
    let ends: Vec<DVec3> = (0..3)
        .filter_map(|i| {
            let j = (i + 1) % 3;
            (height[i] * height[j] < 0.0)
                .then(|| face[i] + (face[j] - face[i]) * (height[i] / (height[i] - height[j])))
        })
        .collect();
    let &[p, q] = ends.as_slice() else { return false };
    let inside = |x: DVec3| {
        let across = |u: DVec3, v: DVec3| normal.dot(u.cross(v));
        across(d[0], x - apex) > least && across(x - apex, d[1]) > least
    };
    (0..=64).any(|i| inside(p + (q - p) * (f64::from(i) / 64.0)))
}

#[test]
fn no_face_is_missed_and_most_others_are_left_out() {
    let random = &mut Pcg64Mcg::seed_from_u64(8);
    for center in [DVec3::ZERO, DVec3::new(300.0, -20.0, 7000.0)] {
        let faces = faces(random, 3000, center);
        let radius = 5.0;
        let tree = FaceTree::build(3000, center, radius, |face| faces[face as usize]);
        let (min, max) = tree.bounds();
        assert!(
            faces
                .iter()
                .flatten()
                .all(|p| (*p - min).min_element() > -1e-2 && (max - *p).min_element() > -1e-2),
            "bounds hold all faces"
        );
        let mut scratch = FaceScratch::default();
        let (mut met, mut looked_at) = (0, 0);
        for _ in 0..200 {
            let apex = center + 3.0 * vector(random);
            let d0 = center + vector(random) - apex;
            let d = [d0, d0 + 0.3 * vector(random)];
            let wedge = Wedge::cone(apex, d).expect("a wedge");
            let double = uniform(random) > 0.0;
            let wedge = if double { wedge.doubled() } else { wedge };
            let all: Vec<u32> = (0..3000)
                .filter(|&f| {
                    let face = faces[f as usize];
                    meets(face, apex, d, 1e-9) || double && meets(face, apex, d.map(|x| -x), 1e-9)
                })
                .collect();
            let viewer = Viewpoint::at(apex).expect("finite");
            let front = |f: u32| viewer.sees_front(faces[f as usize]);
            for viewers in [&[][..], &[viewer][..]] {
                let mut found = Vec::new();
                tree.query(&wedge, viewers, &mut scratch, &mut found);
                for &hit in &found {
                    let back = tree.corners(hit).map(|p| center + radius * p.as_dvec3());
                    let off = (0..3).map(|k| back[k].distance(faces[hit.face as usize][k]));
                    assert!(off.fold(0.0, f64::max) < 1e-5, "corners of face {}", hit.face);
                }
                let mut found: Vec<u32> = found.iter().map(|hit| hit.face).collect();
                looked_at += found.len();
                let before = found.len();
                found.sort_unstable();
                found.dedup();
                assert_eq!(found.len(), before, "each face once");
                for &face in &all {
                    if viewers.is_empty() || front(face) {
                        met += 1;
                        assert!(found.binary_search(&face).is_ok(), "face {face} from {apex}");
                    }
                }
            }
        }
        assert!(met > 2000, "{met} faces were met");
        assert!(looked_at < 4 * met, "{looked_at} found for {met} met");
    }
}

#[test]
fn instructions_agree_up_to_rounding() {
    let random = &mut Pcg64Mcg::seed_from_u64(9);
    let faces = faces(random, 2000, DVec3::ZERO);
    let tree = FaceTree::build(2000, DVec3::ZERO, 5.0, |face| faces[face as usize]);
    let mut scratch = FaceScratch::default();
    let mut total = 0;
    for _ in 0..100 {
        let apex = 3.0 * vector(random);
        let d0 = vector(random) - apex;
        let wedge = Wedge::cone(apex, [d0, d0 + 0.5 * vector(random)]).expect("a wedge");
        let viewers = [
            Viewpoint::at(apex).expect("finite"),
            Viewpoint::at(apex + 0.5).expect("finite"),
        ];
        let all: Vec<Vec<FaceHit>> = [Instructions::Portable, Instructions::Avx2, Instructions::Avx512]
            .into_iter()
            .map(|instructions| {
                let mut found = Vec::new();
                tree.clone().with_instructions(instructions).query(
                    &wedge,
                    &viewers,
                    &mut scratch,
                    &mut found,
                );
                found
            })
            .collect();
        total += all[0].len();
        // No face of this seed lies within rounding of a bound.
        assert_eq!(all[0], all[1], "AVX2");
        assert_eq!(all[0], all[2], "AVX-512");
    }
    assert!(total > 1000, "{total} faces found");
}

#[test]
fn columns_hold_the_corners_of_the_faces_found() {
    let random = &mut Pcg64Mcg::seed_from_u64(10);
    let faces = faces(random, 2000, DVec3::ZERO);
    let tree = FaceTree::build(2000, DVec3::ZERO, 5.0, |face| faces[face as usize]);
    let mut scratch = FaceScratch::default();
    let mut columns = FaceColumns::default();
    for instructions in [Instructions::Portable, Instructions::Avx2, Instructions::Avx512] {
        let tree = tree.clone().with_instructions(instructions);
        let mut total = 0;
        for round in 0..60 {
            let apex = 3.0 * vector(random);
            let d0 = vector(random) - apex;
            let wedge = Wedge::cone(apex, [d0, d0 + 0.5 * vector(random)]).expect("a wedge");
            let mut found = Vec::new();
            tree.query(&wedge, &[], &mut scratch, &mut found);
            // In other orders, too: places of a block may go down and come twice.
            match round % 3 {
                0 => found.reverse(),
                1 => found.sort_by_key(|hit| hit.place % 7),
                _ => {}
            }
            tree.columns(&found, &mut columns);
            for (number, &hit) in found.iter().enumerate() {
                let corners = [0, 1, 2].map(|corner| {
                    Vec3::from_array([0, 1, 2].map(|axis| columns.column(corner, axis)[number]))
                });
                assert_eq!(corners, tree.corners(hit), "{instructions:?}, face {}", hit.face);
            }
            total += found.len();
        }
        assert!(total > 300, "{total} faces found");
    }
}

#[test]
fn what_holds_wedges_of_one_plane_meets_what_each_meets() {
    let random = &mut Pcg64Mcg::seed_from_u64(11);
    let center = DVec3::new(300.0, -20.0, 7000.0);
    let faces = faces(random, 3000, center);
    let tree = FaceTree::build(3000, center, 5.0, |face| faces[face as usize]);
    let mut scratch = FaceScratch::default();
    let (mut met, mut together, mut alone) = (0, 0, 0);
    for _ in 0..200 {
        let (a, b) = (center + vector(random), center + vector(random));
        let (from, step) = (center + 3.0 * vector(random), 0.25 * vector(random));
        // Places of a line in one plane with the edge a-b.
        let along = (b - a).normalize() * step.length() + 0.05 * (from - a);
        let apexes: Vec<DVec3> = (0..5u8).map(|i| from + along * f64::from(i)).collect();
        let cones: Option<Vec<Wedge>> = apexes
            .iter()
            .map(|&apex| Wedge::cone(apex, [a - apex, b - apex]))
            .collect();
        let cones = cones.expect("wedges");
        let around = Wedge::around(&cones, 5.0).expect("they lie in one plane");
        let ends = [apexes[0], apexes[4]].map(|p| Viewpoint::at(p).expect("finite"));
        let mut all = Vec::new();
        tree.query(&around, &ends, &mut scratch, &mut all);
        together += all.len();
        let order = |hit: &FaceHit| all.iter().position(|other| other == hit);
        for (&apex, cone) in apexes.iter().zip(&cones) {
            let viewer = Viewpoint::at(apex).expect("finite");
            let mut own = Vec::new();
            tree.query(cone, &[viewer], &mut scratch, &mut own);
            alone += own.len();
            let d = [a - apex, b - apex];
            own.retain(|hit| {
                meets(faces[hit.face as usize], apex, d, 1e-9) && viewer.sees_front(faces[hit.face as usize])
            });
            met += own.len();
            let places: Option<Vec<usize>> = own.iter().map(order).collect();
            let places = places.expect("what a wedge meets is among what all meet");
            assert!(places.is_sorted(), "and in the same order");
        }
    }
    assert!(met > 2000, "{met} faces were met");
    assert!(2 * together < alone, "{together} together, {alone} one by one");
}

#[test]
fn facing_away_drops_subtrees() {
    // Two parallel sheets of many faces, the upper turned up, the lower turned down.
    let under = 30.0 * DVec3::Y;
    let faces: Vec<[DVec3; 3]> = (0..2048)
        .map(|i| {
            let (x, z) = (f64::from(i % 32), f64::from(i / 2 % 1024 / 32 * 2));
            let low = DVec3::new(x, 0.0, z);
            if i % 2 == 0 {
                [low, low + DVec3::Z, low + DVec3::X]
            } else {
                [low - under, low - under + DVec3::X, low - under + DVec3::Z]
            }
        })
        .collect();
    let tree = FaceTree::build(2048, DVec3::new(16.0, 0.0, 32.0), 60.0, |face| {
        faces[face as usize]
    });
    let light = DVec3::new(16.0, 40.0, 32.0);
    let wedge =
        Wedge::cone(light, [DVec3::new(-1.0, -2.0, 0.12), DVec3::new(1.0, -2.0, 0.12)]).expect("a wedge");
    let mut scratch = FaceScratch::default();
    let (mut all, mut front) = (Vec::new(), Vec::new());
    tree.query(&wedge, &[], &mut scratch, &mut all);
    tree.query(
        &wedge,
        &[Viewpoint::at(light).expect("finite")],
        &mut scratch,
        &mut front,
    );
    assert!(front.len() < all.len(), "{} of {}", front.len(), all.len());
    assert!(
        all.iter().any(|f| f.face % 2 == 1) && front.iter().any(|f| f.face % 2 == 0),
        "both sheets are met"
    );
    assert!(!front.is_empty(), "the upper sheet stays");
    let nothing = FaceTree::build(0, DVec3::ZERO, 0.0, |_| [DVec3::ZERO; 3]);
    front.clear();
    nothing.query(&wedge, &[], &mut scratch, &mut front);
    assert!(nothing.is_empty() && front.is_empty(), "an empty tree");
}

#[test]
fn narrowed_queries_find_all_that_is_met() {
    let random = &mut Pcg64Mcg::seed_from_u64(10);
    let faces = faces(random, 4000, DVec3::ZERO);
    let tree = FaceTree::build(4000, DVec3::ZERO, 5.0, |face| faces[face as usize]);
    let (mut scratch, mut narrowed) = (FaceScratch::default(), NarrowedFaces::default());
    let (mut total, mut few, mut dropped) = (0, 0, 0);
    for instructions in [Instructions::Portable, Instructions::Avx2, Instructions::Avx512] {
        let tree = tree.clone().with_instructions(instructions);
        for round in 0..60 {
            let apex = 3.0 * vector(random);
            let d0 = vector(random) - apex;
            let viewer = Viewpoint::at(apex).expect("finite");
            let viewers = if round % 2 == 0 { &[][..] } else { &[viewer][..] };
            let wedges: Vec<[DVec3; 2]> = (0..8)
                .map(|_| [d0 + 0.05 * vector(random), d0 + 0.05 * vector(random)])
                .collect();
            let Some(beam) = Beam::around(apex, wedges.iter().flatten().copied()) else {
                continue;
            };
            let all = tree.narrow(&beam, viewers, usize::MAX, &mut scratch, &mut narrowed);
            assert!(all.is_some(), "no limit");
            for &d in &wedges {
                let wedge = Wedge::cone(apex, d).expect("a wedge");
                let (mut whole, mut part) = (Vec::new(), Vec::new());
                tree.query(&wedge, viewers, &mut scratch, &mut whole);
                tree.query_narrowed(&narrowed, &wedge, &mut scratch, &mut part);
                assert!(part.iter().all(|hit| whole.contains(hit)), "none else");
                for hit in whole.iter().filter(|hit| !part.contains(hit)) {
                    // Near the wedge, but not in it.
                    let met = meets(faces[hit.face as usize], apex, d, 1e-9);
                    assert!(!met, "face {} from {apex} along {d0}", hit.face);
                    dropped += 1;
                }
                total += part.len();
            }
            few += usize::from(
                tree.narrow(&beam, viewers, 3, &mut scratch, &mut narrowed)
                    .is_none(),
            );
        }
    }
    assert!(total > 5000, "{total} found");
    assert!(dropped * 10 < total, "{dropped} near the wedges");
    assert!(few > 20, "{few} beams with more than three blocks");
}
