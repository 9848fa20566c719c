//! The kernels with 512-bit instructions.
#![expect(unsafe_code, reason = "intrinsics that load and store through pointers")]

use std::arch::x86_64::*;

use super::super::blocks::{BLOCK, BlockMasks, Form, PlaneBlock, View};
use super::super::hierarchy::{LANES, PlaneLanes};
use super::prefetch::{AHEAD, prefetch};
use super::{Instructions, NodeMasks};

pub(super) fn test_nodes<const P: usize>(
    nodes: &[PlaneLanes<P>],
    frontier: &[u32],
    views: &[View],
    pad: f32,
    masks: &mut Vec<NodeMasks>,
) {
    debug_assert!(Instructions::Avx512.is_available(), "no AVX-512 here");
    // SAFETY: `Instructions` other than portable are used only where they are available.
    unsafe { test_nodes_inner(nodes, frontier, views, pad, masks) }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn test_nodes_inner<const P: usize>(
    nodes: &[PlaneLanes<P>],
    frontier: &[u32],
    views: &[View],
    pad: f32,
    masks: &mut Vec<NodeMasks>,
) {
    let (above, below) = (_mm512_set1_ps(pad), _mm512_set1_ps(-pad));
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
                let (mut least, mut most) = (_mm512_setzero_ps(), _mm512_setzero_ps());
                for (k, &coefficient) in view.iter().enumerate() {
                    let (lo, hi) = (&lanes.lo[p][k], &lanes.hi[p][k]);
                    let (near, far) = if coefficient >= 0.0 { (lo, hi) } else { (hi, lo) };
                    let factor = _mm512_set1_ps(coefficient);
                    // SAFETY: both arrays hold one register of numbers.
                    let (near, far) =
                        unsafe { (_mm512_loadu_ps(near.as_ptr()), _mm512_loadu_ps(far.as_ptr())) };
                    least = _mm512_fmadd_ps(near, factor, least);
                    most = _mm512_fmadd_ps(far, factor, most);
                }
                let front = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(least, above);
                let back = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(most, below);
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
    debug_assert!(Instructions::Avx512.is_available(), "no AVX-512 here");
    // SAFETY: `Instructions` other than portable are used only where they are available.
    unsafe { scan_blocks_inner(blocks, list, views, masks) }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn scan_blocks_inner<const P: usize>(
    blocks: &[PlaneBlock<P>],
    list: &[u32],
    views: &[View],
    masks: &mut Vec<BlockMasks>,
) {
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
                let (offset, error) = (_mm512_set1_ps(offset), _mm512_set1_ps(error));
                let slope = slope.map(|s| _mm512_set1_ps(s));
                let (mut front, mut unsure) = (0u64, 0u64);
                for group in 0..BLOCK / LANES {
                    let mut side = offset;
                    for (k, &slope) in slope.iter().enumerate() {
                        // SAFETY: the array holds BLOCK numbers, of which group * LANES.. are a register's.
                        let packed = unsafe {
                            _mm256_loadu_si256(block.quantised[p][k].as_ptr().add(group * LANES).cast())
                        };
                        let value = _mm512_cvtepi32_ps(_mm512_cvtepu16_epi32(packed));
                        side = _mm512_fmadd_ps(value, slope, side);
                    }
                    let is_front = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(side, _mm512_setzero_ps());
                    let is_unsure = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(_mm512_abs_ps(side), error);
                    front |= u64::from(is_front) << (group * LANES);
                    unsure |= u64::from(is_unsure) << (group * LANES);
                }
                result.front &= front;
                result.back &= !front;
                result.unsure |= unsure;
            }
        }
        masks.push(result);
    }
}

pub(super) fn emit(items: &[u32], mask: u64, out: &mut Vec<u32>) {
    debug_assert!(Instructions::Avx512.is_available(), "no AVX-512 here");
    // SAFETY: `Instructions` other than portable are used only where they are available.
    unsafe { emit_inner(items, mask, out) }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn emit_inner(items: &[u32], mask: u64, out: &mut Vec<u32>) {
    // Room for a whole register beyond the last item, as each store writes sixteen.
    out.reserve(mask.count_ones() as usize + LANES);
    let mut length = out.len();
    for (group, sixteen) in items.chunks(LANES).enumerate() {
        let picked = (mask >> (group * LANES)) as u16;
        if picked == 0 {
            continue;
        }
        let present = (1u32 << sixteen.len()).wrapping_sub(1) as u16;
        // SAFETY: masked lanes are not read. At most `count_ones` items are kept, and the room for sixteen more
        // was reserved, so the store stays inside the vector's memory.
        unsafe {
            let values = _mm512_maskz_loadu_epi32(present, sixteen.as_ptr().cast());
            let packed = _mm512_maskz_compress_epi32(picked, values);
            _mm512_storeu_si512(out.as_mut_ptr().add(length).cast(), packed);
        }
        length += (picked & present).count_ones() as usize;
    }
    // SAFETY: the first `length` numbers have been written, and `length` is within the capacity.
    unsafe { out.set_len(length) };
}
