//! The kernels with 256-bit instructions.
#![expect(unsafe_code, reason = "intrinsics that load through pointers")]

use std::arch::x86_64::*;

use super::super::blocks::{BLOCK, BlockMasks, Form, PlaneBlock, View};
use super::super::hierarchy::{LANES, PlaneLanes};
use super::prefetch::{AHEAD, prefetch};
use super::{Instructions, NodeMasks};

/// Numbers in a register.
const WIDTH: usize = 8;

pub(super) fn test_nodes<const P: usize>(
    nodes: &[PlaneLanes<P>],
    frontier: &[u32],
    views: &[View],
    pad: f32,
    masks: &mut Vec<NodeMasks>,
) {
    debug_assert!(Instructions::Avx2.is_available(), "no AVX2 here");
    // SAFETY: `Instructions` other than portable are used only where they are available.
    unsafe { test_nodes_inner(nodes, frontier, views, pad, masks) }
}

#[target_feature(enable = "avx2,fma")]
fn test_nodes_inner<const P: usize>(
    nodes: &[PlaneLanes<P>],
    frontier: &[u32],
    views: &[View],
    pad: f32,
    masks: &mut Vec<NodeMasks>,
) {
    let (above, below) = (_mm256_set1_ps(pad), _mm256_set1_ps(-pad));
    for (at, &node) in frontier.iter().enumerate() {
        if let Some(&next) = frontier.get(at + AHEAD) {
            prefetch(&nodes[next as usize]);
        }
        let lanes = &nodes[node as usize];
        let mut result = NodeMasks {
            all_front: !0,
            all_back: !0,
            ..NodeMasks::default()
        };
        for view in views {
            for p in 0..P {
                let (mut front, mut back) = (0u16, 0u16);
                for half in 0..LANES / WIDTH {
                    let (mut least, mut most) = (_mm256_setzero_ps(), _mm256_setzero_ps());
                    for (k, &coefficient) in view.iter().enumerate() {
                        let (lo, hi) = (&lanes.lo[p][k], &lanes.hi[p][k]);
                        let (near, far) = if coefficient >= 0.0 { (lo, hi) } else { (hi, lo) };
                        let factor = _mm256_set1_ps(coefficient);
                        // SAFETY: both arrays hold two registers of numbers.
                        let (near, far) = unsafe {
                            (
                                _mm256_loadu_ps(near.as_ptr().add(half * WIDTH)),
                                _mm256_loadu_ps(far.as_ptr().add(half * WIDTH)),
                            )
                        };
                        least = _mm256_fmadd_ps(near, factor, least);
                        most = _mm256_fmadd_ps(far, factor, most);
                    }
                    let is_front = _mm256_cmp_ps::<_CMP_GT_OQ>(least, above);
                    let is_back = _mm256_cmp_ps::<_CMP_LT_OQ>(most, below);
                    front |= (_mm256_movemask_ps(is_front) as u16) << (half * WIDTH);
                    back |= (_mm256_movemask_ps(is_back) as u16) << (half * WIDTH);
                }
                result.all_front &= front;
                result.all_back &= back;
                result.some_front |= front;
                result.some_back |= back;
            }
        }
        masks.push(result);
    }
}

pub(super) fn scan_blocks<const P: usize>(
    blocks: &[PlaneBlock<P>],
    list: &[u32],
    views: &[View],
    masks: &mut Vec<BlockMasks>,
) {
    debug_assert!(Instructions::Avx2.is_available(), "no AVX2 here");
    // SAFETY: `Instructions` other than portable are used only where they are available.
    unsafe { scan_blocks_inner(blocks, list, views, masks) }
}

#[target_feature(enable = "avx2,fma")]
fn scan_blocks_inner<const P: usize>(
    blocks: &[PlaneBlock<P>],
    list: &[u32],
    views: &[View],
    masks: &mut Vec<BlockMasks>,
) {
    let no_sign = _mm256_castsi256_ps(_mm256_set1_epi32(i32::MAX));
    for (at, &index) in list.iter().enumerate() {
        if let Some(&next) = list.get(at + AHEAD) {
            prefetch(&blocks[next as usize]);
        }
        let block = &blocks[index as usize];
        let mut result = BlockMasks {
            front: !0,
            back: !0,
            unsure: 0,
        };
        for view in views {
            for p in 0..P {
                let Form { offset, slope, error } = block.form(p, view);
                let (offset, error) = (_mm256_set1_ps(offset), _mm256_set1_ps(error));
                let slope = slope.map(|s| _mm256_set1_ps(s));
                let (mut front, mut unsure) = (0u64, 0u64);
                for group in 0..BLOCK / WIDTH {
                    let mut side = offset;
                    for (k, &slope) in slope.iter().enumerate() {
                        // SAFETY: the array holds BLOCK numbers, of which group * WIDTH.. are a register's.
                        let packed = unsafe {
                            _mm_loadu_si128(block.quantised[p][k].as_ptr().add(group * WIDTH).cast())
                        };
                        let value = _mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(packed));
                        side = _mm256_fmadd_ps(value, slope, side);
                    }
                    let is_front = _mm256_cmp_ps::<_CMP_GT_OQ>(side, _mm256_setzero_ps());
                    let is_unsure = _mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_and_ps(side, no_sign), error);
                    front |= u64::from(_mm256_movemask_ps(is_front) as u8) << (group * WIDTH);
                    unsure |= u64::from(_mm256_movemask_ps(is_unsure) as u8) << (group * WIDTH);
                }
                result.front &= front;
                result.back &= !front;
                result.unsure |= unsure;
            }
        }
        masks.push(result);
    }
}
