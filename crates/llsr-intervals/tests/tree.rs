//! Exact sides against big numbers, and the tree against testing every item.

use std::cmp::Ordering;

use glam::{DVec3, Vec3};
use llsr_intervals::{
    Instructions, PlainTree, Plane, PlaneScan, PlaneTree, QueryScratch, Select, TreeOptions, Viewpoint,
    orientation,
};
use llsr_testkit::intervals::Dyadic;
use proptest::prelude::*;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn exact_orientation([a, b, c, p]: [DVec3; 4]) -> Ordering {
    let row = |q: DVec3| {
        [0, 1, 2].map(|k| &Dyadic::new(q[k]).expect("finite") - &Dyadic::new(p[k]).expect("finite"))
    };
    let (x, y, z) = (row(a), row(b), row(c));
    let minor = |j: usize, k: usize| &(&y[j] * &z[k]) - &(&y[k] * &z[j]);
    let sum = &(&(&x[0] * &minor(1, 2)) + &(&x[1] * &minor(2, 0))) + &(&x[2] * &minor(0, 1));
    0.cmp(&sum.signum())
}

/// Numbers too small for the promise count as 0.
fn flushed(x: f64) -> f64 {
    if x.abs() < 1e-75 { 0.0 } else { x }
}

/// Coordinates that often coincide or differ by a few units in the last place.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-4i32..5).prop_map(f64::from),
        (-4i32..5, 0u32..4).prop_map(|(x, steps)| (0..steps).fold(f64::from(x) * 0.1, |x, _| x.next_up())),
        -1.0..1.0f64,
        (-60i32..60, -1.0..1.0f64).prop_map(|(e, x)| x * 2f64.powi(e)),
    ]
}

fn point() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(|p| DVec3::from_array(p.map(flushed)))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn orientation_is_exact(points in prop::array::uniform4(point())) {
        let [a, b, c, p] = points;
        prop_assert_eq!(orientation(a, b, c, p), exact_orientation(points));
    }

    #[test]
    fn orientation_is_exact_near_a_plane(a in point(), b in point(), c in point(), s in 0..9i32, t in 0..9i32, k in 0..7u32) {
        // A point that lies in the plane but for rounding, and a step or two off.
        let p = a + (b - a) * (f64::from(s) / 8.0) + (c - a) * (f64::from(t) / 8.0);
        let p = DVec3::new((0..k % 3).fold(p.x, |x, _| x.next_up()), p.y, p.z).map(flushed);
        prop_assert_eq!(orientation(a, b, c, p), exact_orientation([a, b, c, p]));
    }

    #[test]
    fn a_direction_is_a_point_far_away(a in point(), b in point(), c in point(), direction in point()) {
        prop_assume!(direction != DVec3::ZERO);
        let zero = DVec3::ZERO;
        let viewer = Viewpoint::towards(direction).expect("not zero");
        // Seen from infinity only the normal counts; shift the plane into the origin without rounding: the
        // determinant of (a, b, c) with rows b - a, c - a, direction.
        let row = |q: DVec3, r: DVec3| [0, 1, 2].map(|k| &Dyadic::new(q[k]).expect("finite") - &Dyadic::new(r[k]).expect("finite"));
        let (x, y, z) = (row(b, a), row(c, a), row(direction, zero));
        let minor = |j: usize, k: usize| &(&x[j] * &y[k]) - &(&x[k] * &y[j]);
        let sum = &(&(&z[0] * &minor(1, 2)) + &(&z[1] * &minor(2, 0))) + &(&z[2] * &minor(0, 1));
        prop_assert_eq!(viewer.side([a, b, c]), sum.signum().cmp(&0));
    }
}

#[test]
fn viewpoints_refuse_what_they_cannot_decide() {
    assert!(Viewpoint::at(DVec3::new(f64::NAN, 0.0, 0.0)).is_none(), "NaN");
    assert!(Viewpoint::at(DVec3::splat(1e76)).is_none(), "too large");
    assert!(Viewpoint::towards(DVec3::ZERO).is_none(), "no direction");
    assert!(
        Viewpoint::towards(DVec3::splat(1e-80)).is_none(),
        "too small to be a direction"
    );
    let near = Viewpoint::at(DVec3::splat(1e-80)).expect("tiny coordinates count as zero");
    assert_eq!(near.position(), DVec3::ZERO, "set to zero");
}

#[test]
fn needles_have_no_steady_plane() {
    let needle = |height: f64| Plane::of([DVec3::ZERO, DVec3::X, DVec3::new(0.5, height, 0.0)]);
    assert!(needle(1e-3).is_some(), "thin");
    assert!(needle(1e-7).is_none(), "too thin");
    assert!(needle(0.0).is_none(), "a line");
    assert!(Plane::of([DVec3::ONE; 3]).is_none(), "a point");
    let tiny = Plane::of([DVec3::ZERO, DVec3::X * 1e-40, DVec3::Y * 1e-40]).expect("small but well shaped");
    assert_eq!(tiny.normal(), DVec3::Z, "a small face has a plane");
    assert_eq!(tiny.flipped().normal(), -DVec3::Z, "turned over");
}

/// Two triangles that share the corners 0 and 1.
type Roof = [DVec3; 4];

struct Case {
    roofs: Vec<Roof>,
    center: DVec3,
    radius: f64,
}

impl Case {
    fn faces(&self, item: u32) -> [[DVec3; 3]; 2] {
        let [a, b, c, d] = self.roofs[item as usize];
        [[a, b, c], [b, a, d]]
    }

    fn planes(&self, item: u32) -> Option<[Plane; 2]> {
        let [f, g] = self.faces(item).map(Plane::of);
        Some([f?, g?])
    }

    fn tree(&self, options: TreeOptions) -> PlaneTree<2> {
        let bounds = |item: u32| {
            let [a, b, ..] = self.roofs[item as usize].map(|p| p.as_vec3());
            (a.min(b), a.max(b))
        };
        PlaneTree::build(
            self.roofs.len() as u32,
            self.center,
            self.radius,
            |item| self.planes(item),
            bounds,
            options,
        )
    }

    fn selects(&self, viewers: &[Viewpoint], select: Select, item: u32) -> bool {
        let fronts: Vec<bool> = viewers
            .iter()
            .flat_map(|viewer| self.faces(item).map(|face| viewer.sees_front(face)))
            .collect();
        match select {
            Select::Mixed => fronts.contains(&true) && fronts.contains(&false),
            Select::AllFront => !fronts.contains(&false),
            Select::AllBack => !fronts.contains(&true),
        }
    }
}

/// Roofs of which many share planes, some are needles or flat, with one size and offset for all.
fn case(count: usize, size: f64, offset: f64, seed: u64) -> Case {
    let random = &mut Pcg64Mcg::seed_from_u64(seed);
    let mut draw = || (random.next_u32() >> 8) as f64 / f64::from(1 << 23) - 1.0;
    let roofs: Vec<Roof> = (0..count)
        .map(|i| {
            let mut point = || DVec3::new(draw(), draw(), draw());
            let center = point();
            let mut roof = [
                center,
                center + 0.1 * point(),
                center + 0.1 * point(),
                center + 0.1 * point(),
            ];
            if i % 3 == 0 {
                // Across an axis, on a coarse grid: views meet these planes edge-on.
                let height = (4.0 * center.y).round() / 4.0;
                roof[..3].iter_mut().for_each(|p| p.y = height);
            }
            if i % 31 == 0 {
                roof[2] = roof[0] + 0.5 * (roof[1] - roof[0]) + 1e-9 * (roof[3] - roof[0]);
            }
            // Vertices are single precision numbers, as in a mesh.
            roof.map(|p| (p * size + DVec3::splat(offset)).as_vec3().as_dvec3())
        })
        .collect();
    let center = DVec3::splat(offset);
    let radius = roofs
        .iter()
        .flatten()
        .map(|p| (*p - center).length())
        .fold(0.0, f64::max)
        * 1.000_001;
    Case {
        roofs,
        center,
        radius,
    }
}

#[test]
fn the_tree_finds_what_testing_every_item_finds() {
    for (seed, size, offset) in [
        (1, 1.0, 0.0),
        (2, 1e-3, 0.0),
        (3, 1e5, 0.0),
        (4, 1.0, 1e6),
        (5, 1e-30, 0.0),
        (6, 1e30, 0.0),
    ] {
        let case = case(3000, size, offset, seed);
        let all = |viewers: &[Viewpoint], select: Select| -> Vec<u32> {
            (0..case.roofs.len() as u32)
                .filter(|&item| case.selects(viewers, select, item))
                .collect()
        };
        let at =
            |x: f64, y: f64, z: f64| Viewpoint::at(case.center + size * DVec3::new(x, y, z)).expect("finite");
        let towards = |d: DVec3| Viewpoint::towards(d).expect("a direction");
        let views: [&[Viewpoint]; 9] = [
            &[at(2.0, 1.0, 3.0)],
            &[at(0.1, 0.3, -0.2)],
            &[at(0.3, 0.25, 0.4)],
            &[at(1e5, 2e4, -1e6)],
            &[towards(DVec3::new(0.3, 0.2, -0.9))],
            &[towards(DVec3::X)],
            &[at(2.0, 0.5, 0.0), at(-1.0, 0.5, 0.3)],
            &[at(2.0, 2.0, 0.0), at(2.0, 2.0, 1.0), at(3.0, 2.0, 1.0)],
            // A viewer at a vertex, edge-on to all faces there.
            &[Viewpoint::at(case.roofs[7][0]).expect("finite")],
        ];
        for options in [
            TreeOptions::default(),
            TreeOptions {
                sharp_high: false,
                ..TreeOptions::default()
            },
        ] {
            let tree = case.tree(options);
            assert_eq!(tree.len(), case.roofs.len(), "no item is lost");
            for set in [Instructions::Portable, Instructions::Avx2, Instructions::Avx512] {
                let tree = tree.clone().with_instructions(set);
                let mut scratch = QueryScratch::default();
                for (v, viewers) in views.iter().enumerate() {
                    for select in [Select::Mixed, Select::AllFront, Select::AllBack] {
                        let mut found = Vec::new();
                        let exact = |item: u32| case.selects(viewers, select, item);
                        let statistics = tree.query(viewers, select, exact, &mut scratch, &mut found);
                        found.sort_unstable();
                        assert_eq!(
                            found,
                            all(viewers, select),
                            "seed {seed}, view {v}, {select:?}, {set:?}"
                        );
                        // Faces without a plane or seen edge-on need the exact test; elsewhere it is rare. Far from
                        // the origin single precision leaves few roofs a plane.
                        assert!(
                            v > 1 || offset > 0.0 || statistics.exact < case.roofs.len() / 15,
                            "{statistics:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn new_numbers_are_of_the_same_items_in_the_order_found() {
    let case = case(3000, 1.0, 0.0, 12);
    let tree = case.tree(TreeOptions::default());
    let mut renumbered = tree.clone();
    let before = renumbered.renumber();
    let mut sorted = before.clone();
    sorted.sort_unstable();
    assert!(
        sorted.into_iter().eq(0..case.roofs.len() as u32),
        "each item once"
    );
    let mut scratch = QueryScratch::default();
    for select in [Select::Mixed, Select::AllFront] {
        let viewers = [Viewpoint::at(case.center + DVec3::new(2.0, 1.0, 3.0)).expect("finite")];
        let (mut old, mut new) = (Vec::new(), Vec::new());
        tree.query(
            &viewers,
            select,
            |item| case.selects(&viewers, select, item),
            &mut scratch,
            &mut old,
        );
        let exact = |item: u32| case.selects(&viewers, select, before[item as usize]);
        renumbered.query(&viewers, select, exact, &mut scratch, &mut new);
        let numbers: Vec<u32> = new.iter().map(|&item| before[item as usize]).collect();
        assert!(!old.is_empty() && numbers == old, "{select:?}");
        let apart = new
            .windows(2)
            .map(|pair| u64::from(pair[0].abs_diff(pair[1])))
            .sum::<u64>();
        let scattered = old
            .windows(2)
            .map(|pair| u64::from(pair[0].abs_diff(pair[1])))
            .sum::<u64>();
        assert!(4 * apart < scattered, "{apart} apart, {scattered} before");
    }
}

#[test]
fn scan_and_plain_tree_find_the_same() {
    let case = case(2000, 1.0, 0.0, 9);
    let count = case.roofs.len() as u32;
    let scan = PlaneScan::new(count, case.center, case.radius, |item| case.planes(item));
    // The plain tree wants normals: needles stay out of it.
    let steady: Vec<u32> = (0..count).filter(|&item| case.planes(item).is_some()).collect();
    let normals = |i: u32| {
        case.planes(steady[i as usize])
            .expect("steady")
            .map(|p| p.normal())
    };
    let positions = |i: u32| {
        let points = case.roofs[steady[i as usize] as usize].map(|p| p.as_vec3());
        [
            points.iter().copied().fold(Vec3::INFINITY, Vec3::min),
            points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max),
        ]
    };
    for position in [
        DVec3::new(2.0, 1.0, 3.0),
        DVec3::new(0.1, 0.3, -0.2),
        DVec3::new(50.0, 0.0, 1.0),
    ] {
        let viewer = Viewpoint::at(position).expect("finite");
        let hit = |item: u32| case.selects(&[viewer], Select::Mixed, item);
        let expected: Vec<u32> = (0..count).filter(|&item| hit(item)).collect();
        let mut found = Vec::new();
        scan.query(&viewer, hit, &mut found);
        found.sort_unstable();
        assert_eq!(found, expected, "scan from {position}");
        for sharp_high in [false, true] {
            let tree = PlainTree::build(steady.len() as u32, normals, positions, 8, sharp_high);
            let mut found = Vec::new();
            let statistics = tree.query(&viewer, |i| hit(steady[i as usize]), &mut found);
            let mut found: Vec<u32> = found.iter().map(|&i| steady[i as usize]).collect();
            found.sort_unstable();
            let expected: Vec<u32> = expected
                .iter()
                .copied()
                .filter(|item| steady.binary_search(item).is_ok())
                .collect();
            assert_eq!(found, expected, "plain tree from {position}");
            assert!(
                statistics.items < steady.len() || sharp_high || position.x < 10.0,
                "from afar some nodes are left out"
            );
        }
    }
}

#[test]
fn trees_of_nothing_and_of_one_item_work() {
    let empty = PlaneTree::<2>::build(
        0,
        DVec3::ZERO,
        0.0,
        |_| None,
        |_| (Vec3::ZERO, Vec3::ZERO),
        TreeOptions::default(),
    );
    let viewer = Viewpoint::at(DVec3::ONE).expect("finite");
    let mut found = Vec::new();
    let statistics = empty.query(
        &[viewer],
        Select::Mixed,
        |_| true,
        &mut QueryScratch::default(),
        &mut found,
    );
    assert!(
        empty.is_empty() && found.is_empty() && statistics.nodes == 0,
        "nothing to find"
    );
    // The first is a needle, which is in no block.
    let two = case(2, 1.0, 0.0, 3);
    assert!(
        two.planes(0).is_none() && two.planes(1).is_some(),
        "a needle and a roof"
    );
    let tree = two.tree(TreeOptions::default());
    assert_eq!((tree.size(), tree.len()), ((1, 1), 2), "one node, one block");
}
