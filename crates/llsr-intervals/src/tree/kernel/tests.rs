//! All kernels against the portable one.

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::tree::blocks::BLOCK;
use crate::tree::hierarchy::LANES;

const FAST: [Instructions; 2] = [Instructions::Avx2, Instructions::Avx512];

fn uniform(random: &mut Pcg64Mcg) -> f32 {
    (random.next_u32() >> 8) as f32 / (1u32 << 23) as f32 - 1.0
}

fn views(random: &mut Pcg64Mcg, count: usize) -> Vec<View> {
    (0..count)
        .map(|i| std::array::from_fn(|k| if (i + k) % 5 == 4 { 0.0 } else { uniform(random) }))
        .collect()
}

#[test]
fn nodes_agree() {
    let random = &mut Pcg64Mcg::seed_from_u64(1);
    let nodes: Vec<PlaneLanes<2>> = (0..200)
        .map(|_| {
            let mut lanes = PlaneLanes {
                lo: [[[0.0; LANES]; 4]; 2],
                hi: [[[0.0; LANES]; 4]; 2],
            };
            for (lo, hi) in lanes
                .lo
                .iter_mut()
                .flatten()
                .flatten()
                .zip(lanes.hi.iter_mut().flatten().flatten())
            {
                let (a, b) = (uniform(random), 0.2 * uniform(random));
                (*lo, *hi) = (a.min(a + b), a.max(a + b));
            }
            lanes
        })
        .collect();
    let frontier: Vec<u32> = (0..200).rev().collect();
    let views = views(random, 3);
    let (mut expected, mut masks) = (Vec::new(), Vec::new());
    // No sum lies within rounding of a pad of this size for this seed, so fused and plain sums agree.
    test_nodes(
        Instructions::Portable,
        &nodes,
        &frontier,
        &views,
        1e-6,
        &mut expected,
    );
    assert!(
        expected
            .iter()
            .any(|m| m.some_front != 0 && m.some_front != m.all_front),
        "all kinds of nodes"
    );
    for set in FAST.into_iter().filter(|set| set.is_available()) {
        test_nodes(set, &nodes, &frontier, &views, 1e-6, &mut masks);
        assert_eq!(masks, expected, "{set:?}");
    }
}

#[test]
fn blocks_agree_where_they_are_sure() {
    let random = &mut Pcg64Mcg::seed_from_u64(2);
    let blocks: Vec<PlaneBlock<2>> = (0..50)
        .map(|i| {
            let width = f64::from(uniform(random)) * 0.5f64.powi(i % 12);
            let mut plane = || std::array::from_fn(|_| 0.3 + width * f64::from(uniform(random)));
            let planes: Vec<[[f64; 4]; 2]> = (0..BLOCK).map(|_| [plane(), plane()]).collect();
            PlaneBlock::new(planes.into_iter())
        })
        .collect();
    let list: Vec<u32> = (0..50).collect();
    let views = views(random, 2);
    let (mut expected, mut masks) = (Vec::new(), Vec::new());
    scan_blocks(Instructions::Portable, &blocks, &list, &views, &mut expected);
    for set in FAST.into_iter().filter(|set| set.is_available()) {
        scan_blocks(set, &blocks, &list, &views, &mut masks);
        assert_eq!(masks.len(), expected.len(), "{set:?}");
        for (found, expected) in masks.iter().zip(&expected) {
            let sure = !(found.unsure | expected.unsure);
            assert_eq!(found.front & sure, expected.front & sure, "{set:?}");
            assert_eq!(found.back & sure, expected.back & sure, "{set:?}");
        }
    }
}

#[test]
fn emission_agrees() {
    let random = &mut Pcg64Mcg::seed_from_u64(3);
    for length in [1, 15, 16, 17, 40, 63, 64] {
        let items: Vec<u32> = (0..length).map(|_| random.next_u32()).collect();
        for mask in [0, 1, u64::MAX, random.next_u64(), random.next_u64()] {
            let mask = mask & (u64::MAX >> (64 - length));
            let mut expected = vec![7];
            portable::emit(&items, mask, &mut expected);
            for set in FAST.into_iter().filter(|set| set.is_available()) {
                let mut found = vec![7];
                emit(set, &items, mask, &mut found);
                assert_eq!(found, expected, "{set:?}, {length} items, mask {mask:x}");
            }
        }
    }
}
