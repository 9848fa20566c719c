//! Projection by AVX2 (8 points at a time) and AVX-512 (16).
//!
//! Products and sums are kept apart, in the order of [`View::project`]: the results are those of the scalar twin to
//! the last bit.
#![expect(
    unsafe_code,
    reason = "SIMD intrinsics, and loads and stores whose bounds `project` asserts"
)]

use std::arch::x86_64::*;

use super::{EIGHTH_SHIFT, Entries, Level, ListMut, REGION_SHIFT, SETTLED, Task, select_scalar};
use crate::view::EIGHTHS;

/// For each mask of 8 lanes, the lanes whose bit is set, in order; the rest is 0.
static COMPRESS: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][count] = lane as u32;
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// Called by `super::project` only, which has checked that the slots exist, that the list has room for them and
/// one group more, and that both ends are multiples of 16.
pub(super) fn project(level: Level, task: &Task<'_>, range: (usize, usize), list: &mut ListMut<'_>) -> usize {
    match level {
        // SAFETY: a `Level` above `Scalar` comes from `Level::detect` or is compared with it; bounds as said above.
        Level::Avx512 => unsafe { avx512(task, range, list) },
        // SAFETY: likewise.
        _ => unsafe { avx2(task, range, list) },
    }
}

/// # Safety
/// AVX-512F must be there; `range` and `list` as `super::project` asserts.
#[target_feature(enable = "avx512f")]
unsafe fn avx512(task: &Task<'_>, (first, end): (usize, usize), list: &mut ListMut<'_>) -> usize {
    let (store, view) = (task.store, &task.view);
    let rows = view.rows.map(|r| r.to_array().map(|v| _mm512_set1_ps(v)));
    let right = _mm512_set1_ps(EIGHTHS * view.width as f32);
    let bottom = _mm512_set1_ps(EIGHTHS * view.height as f32);
    let (zero, infinity) = (_mm512_setzero_ps(), _mm512_set1_ps(f32::INFINITY));
    let (quarters, odd) = (_mm512_set1_epi32(6), _mm512_set1_epi32(1));
    let fresh = _mm512_set1_epi32(i32::from(task.fresh));
    let settled = _mm512_set1_epi32(SETTLED as i32);
    let stride = _mm512_set1_epi32(task.stride as i32);
    let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    let mut count = 0;
    for i in (first..end).step_by(16) {
        // SAFETY: `i + 16 <= end`, and there are `end` slots.
        let (x, y, z, age) = unsafe {
            (
                _mm512_loadu_ps(store.x.as_ptr().add(i)),
                _mm512_loadu_ps(store.y.as_ptr().add(i)),
                _mm512_loadu_ps(store.z.as_ptr().add(i)),
                _mm512_cvtepu8_epi32(_mm_loadu_si128(store.age.as_ptr().add(i).cast())),
            )
        };
        let [across, down, w, depth] = rows.map(|[a, b, c, d]| {
            let left = _mm512_add_ps(_mm512_mul_ps(a, x), _mm512_mul_ps(b, y));
            _mm512_add_ps(left, _mm512_add_ps(_mm512_mul_ps(c, z), d))
        });
        let inverse = _mm512_div_ps(_mm512_set1_ps(1.0), w);
        let (across, down) = (_mm512_mul_ps(across, inverse), _mm512_mul_ps(down, inverse));
        let inside = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(w, zero)
            & _mm512_cmp_ps_mask::<_CMP_GT_OQ>(depth, zero)
            & _mm512_cmp_ps_mask::<_CMP_LT_OQ>(depth, infinity)
            & _mm512_cmp_ps_mask::<_CMP_GE_OQ>(across, zero)
            & _mm512_cmp_ps_mask::<_CMP_GE_OQ>(down, zero)
            & _mm512_cmp_ps_mask::<_CMP_LT_OQ>(across, right)
            & _mm512_cmp_ps_mask::<_CMP_LT_OQ>(down, bottom);
        let (across, down) = (_mm512_cvttps_epi32(across), _mm512_cvttps_epi32(down));
        let row = _mm512_mullo_epi32(_mm512_srli_epi32::<3>(down), stride);
        let pixel = _mm512_add_epi32(row, _mm512_srli_epi32::<3>(across));
        let region = _mm512_or_si512(
            _mm512_slli_epi32::<{ REGION_SHIFT + 1 }>(_mm512_and_si512(down, quarters)),
            _mm512_slli_epi32::<{ REGION_SHIFT - 1 }>(_mm512_and_si512(across, quarters)),
        );
        let eighth = _mm512_or_si512(
            _mm512_slli_epi32::<{ EIGHTH_SHIFT + 1 }>(_mm512_and_si512(down, odd)),
            _mm512_slli_epi32::<{ EIGHTH_SHIFT }>(_mm512_and_si512(across, odd)),
        );
        let slot = _mm512_add_epi32(_mm512_set1_epi32(i as i32), lanes);
        let old = _mm512_cmpge_epi32_mask(age, fresh);
        let slot = _mm512_mask_or_epi32(slot, old, slot, settled);
        let tag = _mm512_or_si512(_mm512_or_si512(region, eighth), slot);
        // SAFETY: at most `i - first` entries are there, and the list has room for 16 more than `end - first`.
        // Compression in the register: compressing stores are slow on some machines.
        unsafe {
            let store = |list: &mut [u32], value| {
                let compressed = _mm512_maskz_compress_epi32(inside, value);
                _mm512_storeu_si512(list.as_mut_ptr().add(count).cast(), compressed);
            };
            store(list.pixel, pixel);
            store(list.depth, _mm512_castps_si512(depth));
            store(list.tag, tag);
        }
        count += inside.count_ones() as usize;
    }
    count
}

/// # Safety
/// AVX2 must be there; `range` and `list` as `super::project` asserts.
#[target_feature(enable = "avx2")]
unsafe fn avx2(task: &Task<'_>, (first, end): (usize, usize), list: &mut ListMut<'_>) -> usize {
    let (store, view) = (task.store, &task.view);
    let rows = view.rows.map(|r| r.to_array().map(|v| _mm256_set1_ps(v)));
    let right = _mm256_set1_ps(EIGHTHS * view.width as f32);
    let bottom = _mm256_set1_ps(EIGHTHS * view.height as f32);
    let (zero, infinity) = (_mm256_setzero_ps(), _mm256_set1_ps(f32::INFINITY));
    let (quarters, odd) = (_mm256_set1_epi32(6), _mm256_set1_epi32(1));
    let fresh = _mm256_set1_epi32(i32::from(task.fresh));
    let settled = _mm256_set1_epi32(SETTLED as i32);
    let stride = _mm256_set1_epi32(task.stride as i32);
    let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let mut count = 0;
    for i in (first..end).step_by(8) {
        // SAFETY: `i + 8 <= end`, and there are `end` slots.
        let (x, y, z, age) = unsafe {
            (
                _mm256_loadu_ps(store.x.as_ptr().add(i)),
                _mm256_loadu_ps(store.y.as_ptr().add(i)),
                _mm256_loadu_ps(store.z.as_ptr().add(i)),
                _mm256_cvtepu8_epi32(_mm_loadl_epi64(store.age.as_ptr().add(i).cast())),
            )
        };
        let [across, down, w, depth] = rows.map(|[a, b, c, d]| {
            let left = _mm256_add_ps(_mm256_mul_ps(a, x), _mm256_mul_ps(b, y));
            _mm256_add_ps(left, _mm256_add_ps(_mm256_mul_ps(c, z), d))
        });
        let inverse = _mm256_div_ps(_mm256_set1_ps(1.0), w);
        let (across, down) = (_mm256_mul_ps(across, inverse), _mm256_mul_ps(down, inverse));
        let inside = [
            _mm256_cmp_ps::<_CMP_GT_OQ>(w, zero),
            _mm256_cmp_ps::<_CMP_GT_OQ>(depth, zero),
            _mm256_cmp_ps::<_CMP_LT_OQ>(depth, infinity),
            _mm256_cmp_ps::<_CMP_GE_OQ>(across, zero),
            _mm256_cmp_ps::<_CMP_GE_OQ>(down, zero),
            _mm256_cmp_ps::<_CMP_LT_OQ>(across, right),
            _mm256_cmp_ps::<_CMP_LT_OQ>(down, bottom),
        ];
        let inside = inside.into_iter().reduce(|a, b| _mm256_and_ps(a, b));
        let inside = _mm256_movemask_ps(inside.unwrap_or(zero)) as usize & 255;
        let (across, down) = (_mm256_cvttps_epi32(across), _mm256_cvttps_epi32(down));
        let row = _mm256_mullo_epi32(_mm256_srli_epi32::<3>(down), stride);
        let pixel = _mm256_add_epi32(row, _mm256_srli_epi32::<3>(across));
        let region = _mm256_or_si256(
            _mm256_slli_epi32::<{ REGION_SHIFT as i32 + 1 }>(_mm256_and_si256(down, quarters)),
            _mm256_slli_epi32::<{ REGION_SHIFT as i32 - 1 }>(_mm256_and_si256(across, quarters)),
        );
        let eighth = _mm256_or_si256(
            _mm256_slli_epi32::<{ EIGHTH_SHIFT as i32 + 1 }>(_mm256_and_si256(down, odd)),
            _mm256_slli_epi32::<{ EIGHTH_SHIFT as i32 }>(_mm256_and_si256(across, odd)),
        );
        let slot = _mm256_add_epi32(_mm256_set1_epi32(i as i32), lanes);
        let slot = _mm256_or_si256(slot, _mm256_andnot_si256(_mm256_cmpgt_epi32(fresh, age), settled));
        let tag = _mm256_or_si256(_mm256_or_si256(region, eighth), slot);
        // SAFETY: at most `i - first` entries are there, and the list has room for 16 more than `end - first`.
        unsafe {
            let order = _mm256_loadu_si256(COMPRESS[inside].as_ptr().cast());
            let store = |list: &mut [u32], value| {
                let compressed = _mm256_permutevar8x32_epi32(value, order);
                _mm256_storeu_si256(list.as_mut_ptr().add(count).cast(), compressed);
            };
            store(list.pixel, pixel);
            store(list.depth, _mm256_castps_si256(depth));
            store(list.tag, tag);
        }
        count += inside.count_ones() as usize;
    }
    count
}

/// Called by `super::select` only, which has checked that the parts of `from` are equally long and that the list has
/// room for them and one group more.
pub(super) fn select(level: Level, from: Entries<'_>, pixels: (u32, u32), list: &mut ListMut<'_>) -> usize {
    match level {
        // SAFETY: a `Level` above `Scalar` comes from `Level::detect` or is compared with it; bounds as said above.
        Level::Avx512 => unsafe { select_avx512(from, pixels, list) },
        // SAFETY: likewise.
        _ => unsafe { select_avx2(from, pixels, list) },
    }
}

/// # Safety
/// AVX-512F must be there; `from` and `list` as `super::select` asserts.
#[target_feature(enable = "avx512f")]
unsafe fn select_avx512(from: Entries<'_>, (first, pixels): (u32, u32), list: &mut ListMut<'_>) -> usize {
    let len = from[0].len();
    let (first, pixels) = (_mm512_set1_epi32(first as i32), _mm512_set1_epi32(pixels as i32));
    let mut count = 0;
    for i in (0..len).step_by(16) {
        let there = u16::MAX >> 16usize.saturating_sub(len - i);
        // SAFETY: only entries below `len` are loaded; at most `i` entries are in the list, which has room for
        // `len + 16`.
        unsafe {
            let load = |part: &[u32]| _mm512_maskz_loadu_epi32(there, part.as_ptr().add(i).cast());
            let pixel = _mm512_sub_epi32(load(from[0]), first);
            let inside = _mm512_mask_cmplt_epu32_mask(there, pixel, pixels);
            let store = |list: &mut [u32], value| {
                let compressed = _mm512_maskz_compress_epi32(inside, value);
                _mm512_storeu_si512(list.as_mut_ptr().add(count).cast(), compressed);
            };
            store(list.pixel, pixel);
            store(list.depth, load(from[1]));
            store(list.tag, load(from[2]));
            count += inside.count_ones() as usize;
        }
    }
    count
}

/// # Safety
/// AVX2 must be there; `from` and `list` as `super::select` asserts.
#[target_feature(enable = "avx2")]
unsafe fn select_avx2(from: Entries<'_>, (first, pixels): (u32, u32), list: &mut ListMut<'_>) -> usize {
    let len = from[0].len();
    let (start, size) = (_mm256_set1_epi32(first as i32), _mm256_set1_epi32(pixels as i32));
    let mut count = 0;
    let whole = len / 8 * 8;
    for i in (0..whole).step_by(8) {
        // SAFETY: `i + 8 <= len`; at most `i` entries are in the list, which has room for `len + 16`.
        unsafe {
            let load = |part: &[u32]| _mm256_loadu_si256(part.as_ptr().add(i).cast());
            let pixel = _mm256_sub_epi32(load(from[0]), start);
            // Unsigned: the pixel is inside if it is not the larger of the two, nor equal.
            let outside = _mm256_cmpeq_epi32(_mm256_max_epu32(pixel, size), pixel);
            let inside = !_mm256_movemask_ps(_mm256_castsi256_ps(outside)) as usize & 255;
            let order = _mm256_loadu_si256(COMPRESS[inside].as_ptr().cast());
            let store = |list: &mut [u32], value| {
                let compressed = _mm256_permutevar8x32_epi32(value, order);
                _mm256_storeu_si256(list.as_mut_ptr().add(count).cast(), compressed);
            };
            store(list.pixel, pixel);
            store(list.depth, load(from[1]));
            store(list.tag, load(from[2]));
            count += inside.count_ones() as usize;
        }
    }
    let mut rest = ListMut {
        pixel: &mut list.pixel[count..],
        depth: &mut list.depth[count..],
        tag: &mut list.tag[count..],
    };
    count + select_scalar(from.map(|part| &part[whole..]), (first, pixels), &mut rest)
}
