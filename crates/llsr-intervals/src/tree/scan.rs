//! The linear scan over single-precision planes that a tree has to beat.
#![cfg_attr(
    target_arch = "x86_64",
    expect(
        unsafe_code,
        reason = "calls of copies compiled for instructions that were asked for"
    )
)]

use glam::DVec3;

use super::kernel::{Instructions, emit};
use super::{Plane, frame_scale, view};
use crate::Viewpoint;

/// Items tested together.
const WIDTH: usize = 64;

/// The planes of items as a structure of arrays, tested one after another: 32 bytes an edge.
///
/// For a mesh of a few hundred edges, and to measure a [`PlaneTree`](super::PlaneTree) against. It gives the same
/// items.
#[derive(Clone, Debug)]
pub struct PlaneScan {
    /// For both planes, normal and offset.
    columns: [[Vec<f32>; 4]; 2],
    items: Vec<u32>,
    /// Items without a steady plane.
    unsteady: Vec<u32>,
    center: DVec3,
    scale: f64,
    instructions: Instructions,
}

/// Error of a side: four products of numbers of at most 1, each off by two roundings, their sum, and the planes.
const ERROR: f32 = 24.0 * (0.5 * f32::EPSILON) + 4e-9;

impl PlaneScan {
    /// Lists the planes of items `0..count`; arguments as for [`PlaneTree::build`](super::PlaneTree::build).
    pub fn new(count: u32, center: DVec3, radius: f64, planes: impl Fn(u32) -> Option<[Plane; 2]>) -> Self {
        let scale = frame_scale(radius);
        let mut scan = Self {
            columns: Default::default(),
            items: Vec::new(),
            unsteady: Vec::new(),
            center,
            scale,
            instructions: Instructions::detect(),
        };
        for item in 0..count {
            let Some(planes) = planes(item) else {
                scan.unsteady.push(item);
                continue;
            };
            scan.items.push(item);
            for (column, plane) in scan.columns.iter_mut().zip(planes) {
                for (numbers, x) in column.iter_mut().zip(plane.coefficients(center, scale)) {
                    numbers.push(x as f32);
                }
            }
        }
        scan
    }

    /// Appends the items of which one plane faces `viewer` and the other does not; `exact` as for
    /// [`PlaneTree::query`](super::PlaneTree::query). Returns how often it was asked.
    pub fn query(
        &self,
        viewer: &Viewpoint,
        mut exact: impl FnMut(u32) -> bool,
        found: &mut Vec<u32>,
    ) -> usize {
        let view = view(viewer, self.center, self.scale);
        let mut asked = self.unsteady.len();
        let mut start = 0;
        let mut rows = [[&[] as &[f32]; 4]; 2];
        while start < self.items.len() {
            let end = (start + WIDTH).min(self.items.len());
            for (row, column) in rows.iter_mut().flatten().zip(self.columns.iter().flatten()) {
                *row = &column[start..end];
            }
            let (mut hits, mut unsure) = masks(self.instructions, &rows, &view);
            let items = &self.items[start..end];
            asked += unsure.count_ones() as usize;
            while unsure != 0 {
                let bit = unsure.trailing_zeros();
                let hit = u64::from(exact(items[bit as usize]));
                hits = hits & !(1 << bit) | hit << bit;
                unsure &= unsure - 1;
            }
            if hits != 0 {
                emit(self.instructions, items, hits, found);
            }
            start = end;
        }
        found.extend(self.unsteady.iter().copied().filter(|&item| exact(item)));
        asked
    }
}

/// Of up to 64 items: those whose planes lie on different sides, and those that are not sure.
fn masks(instructions: Instructions, rows: &[[&[f32]; 4]; 2], view: &[f32; 4]) -> (u64, u64) {
    #[cfg(target_arch = "x86_64")]
    match instructions {
        // SAFETY: `Instructions` other than portable are used only where they are available.
        Instructions::Avx512 => return unsafe { masks_avx512(rows, view) },
        // SAFETY: as above.
        Instructions::Avx2 => return unsafe { masks_avx2(rows, view) },
        Instructions::Portable => {}
    }
    let _ = instructions;
    masks_portable(rows, view)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn masks_avx2(rows: &[[&[f32]; 4]; 2], view: &[f32; 4]) -> (u64, u64) {
    masks_portable(rows, view)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn masks_avx512(rows: &[[&[f32]; 4]; 2], view: &[f32; 4]) -> (u64, u64) {
    use std::arch::x86_64::*;
    let count = rows[0][0].len();
    if count < WIDTH {
        return masks_portable(rows, view);
    }
    let factors = view.map(|x| _mm512_set1_ps(x));
    let error = _mm512_set1_ps(ERROR);
    let (mut hits, mut unsure) = (0u64, 0u64);
    for group in 0..WIDTH / 16 {
        let mut front = [0u16; 2];
        for (p, row) in rows.iter().enumerate() {
            let mut side = _mm512_setzero_ps();
            for k in 0..4 {
                // SAFETY: the row has 64 numbers.
                let numbers = unsafe { _mm512_loadu_ps(row[k].as_ptr().add(group * 16)) };
                side = _mm512_fmadd_ps(numbers, factors[k], side);
            }
            front[p] = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(side, _mm512_setzero_ps());
            unsure |= u64::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(_mm512_abs_ps(side), error)) << (group * 16);
        }
        hits |= u64::from(front[0] ^ front[1]) << (group * 16);
    }
    (hits, unsure)
}

#[inline(always)]
fn masks_portable(rows: &[[&[f32]; 4]; 2], view: &[f32; 4]) -> (u64, u64) {
    let count = rows[0][0].len();
    let mut sides = [[0f32; WIDTH]; 2];
    for (side, row) in sides.iter_mut().zip(rows) {
        let [x, y, z, d] = row.map(|numbers| &numbers[..count]);
        for (i, side) in side[..count].iter_mut().enumerate() {
            *side = (x[i] * view[0] + y[i] * view[1]) + (z[i] * view[2] + d[i] * view[3]);
        }
    }
    let (mut hits, mut unsure) = (0u64, 0u64);
    for (i, (&a, &b)) in sides[0].iter().zip(&sides[1]).enumerate().take(count) {
        hits |= u64::from((a > 0.0) != (b > 0.0)) << i;
        unsure |= u64::from(a.abs().min(b.abs()) <= ERROR) << i;
    }
    (hits, unsure)
}
