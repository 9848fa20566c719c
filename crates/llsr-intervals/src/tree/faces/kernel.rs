//! The two inner loops of a face query.
#![cfg_attr(
    target_arch = "x86_64",
    expect(
        unsafe_code,
        reason = "calls of copies compiled for instructions that were asked for"
    )
)]

use super::super::blocks::View;
use super::super::hierarchy::{BoundsLanes, LANES, PlaneLanes};
use super::super::kernel::Instructions;
use super::registers::{Portable, Register};
use super::{FaceBlock, FaceHit};

/// A query's linear forms in the tree's frame, with coefficients of at most 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forms {
    /// The wedge's plane, and the planes that bound it, positive inside.
    pub(super) planes: [[f32; 4]; 3],
    /// Points outside of both of the latter count as inside.
    pub(super) double: bool,
    /// Viewers; a face that turns away from each is not wanted. None: all are wanted.
    pub(super) views: [Option<View>; 2],
    /// Bounds the rounding errors of a form's value.
    pub(super) pad: f32,
}

/// For each node of `frontier`, the children that may hold a face of interest; lanes without a child give
/// arbitrary bits.
pub(super) fn test_nodes(
    instructions: Instructions,
    planes: &[PlaneLanes<1>],
    bounds: &[BoundsLanes],
    frontier: &[u32],
    forms: &Forms,
    masks: &mut Vec<u16>,
) {
    masks.clear();
    match instructions {
        // SAFETY: `Instructions` other than portable are used only where they are available.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => unsafe { nodes_avx512(planes, bounds, frontier, forms, masks) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { nodes_avx2(planes, bounds, frontier, forms, masks) },
        _ => nodes::<Portable>(planes, bounds, frontier, forms, masks),
    }
}

/// A beam's bounds, positive inside, and who looks at it, as in [`Forms`].
#[derive(Clone, Copy, Debug)]
pub(super) struct BeamForms {
    pub(super) planes: [[f32; 4]; 4],
    pub(super) views: [Option<View>; 2],
    pub(super) pad: f32,
}

/// For each node of `frontier`, the children that may hold a face of interest for a wedge in the beam; lanes without a
/// child give arbitrary bits.
pub(super) fn test_nodes_in_beam(
    instructions: Instructions,
    planes: &[PlaneLanes<1>],
    bounds: &[BoundsLanes],
    frontier: &[u32],
    forms: &BeamForms,
    masks: &mut Vec<u16>,
) {
    masks.clear();
    match instructions {
        // SAFETY: `Instructions` other than portable are used only where they are available.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => unsafe { beam_avx512(planes, bounds, frontier, forms, masks) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { beam_avx2(planes, bounds, frontier, forms, masks) },
        _ => beam::<Portable>(planes, bounds, frontier, forms, masks),
    }
}

/// For each group of boxes, those that may meet the wedge, whoever looks.
pub(super) fn test_boxes(
    instructions: Instructions,
    bounds: &[BoundsLanes],
    forms: &Forms,
    masks: &mut Vec<u16>,
) {
    masks.clear();
    match instructions {
        // SAFETY: `Instructions` other than portable are used only where they are available.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => unsafe { boxes_avx512(bounds, forms, masks) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { boxes_avx2(bounds, forms, masks) },
        _ => boxes::<Portable>(bounds, forms, masks),
    }
}

/// Appends the faces of the blocks of `list` that may meet the wedge.
pub(super) fn scan_blocks(
    instructions: Instructions,
    blocks: &[FaceBlock],
    list: &[u32],
    forms: &Forms,
    found: &mut Vec<FaceHit>,
) {
    match instructions {
        // SAFETY: `Instructions` other than portable are used only where they are available.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => unsafe { blocks_avx512(blocks, list, forms, found) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { blocks_avx2(blocks, list, forms, found) },
        _ => scan::<Portable>(blocks, list, forms, found),
    }
}

/// Columns of coordinates by corner and axis.
pub(super) type Columns<'a> = [[&'a mut [f32]; 3]; 3];

/// Writes the corners of faces one after the other into columns that are longer by [`LANES`].
pub(super) fn gather_columns(
    instructions: Instructions,
    blocks: &[FaceBlock],
    found: &[FaceHit],
    columns: Columns<'_>,
) {
    match instructions {
        // SAFETY: `Instructions` other than portable are used only where they are available.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => unsafe { gather_avx512(blocks, found, columns) },
        _ => gather::<Portable>(blocks, found, columns),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn nodes_avx512(
    planes: &[PlaneLanes<1>],
    bounds: &[BoundsLanes],
    frontier: &[u32],
    forms: &Forms,
    masks: &mut Vec<u16>,
) {
    nodes::<super::registers::Avx512>(planes, bounds, frontier, forms, masks);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn nodes_avx2(
    planes: &[PlaneLanes<1>],
    bounds: &[BoundsLanes],
    frontier: &[u32],
    forms: &Forms,
    masks: &mut Vec<u16>,
) {
    nodes::<super::registers::Avx2>(planes, bounds, frontier, forms, masks);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn beam_avx512(
    planes: &[PlaneLanes<1>],
    bounds: &[BoundsLanes],
    frontier: &[u32],
    forms: &BeamForms,
    masks: &mut Vec<u16>,
) {
    beam::<super::registers::Avx512>(planes, bounds, frontier, forms, masks);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn beam_avx2(
    planes: &[PlaneLanes<1>],
    bounds: &[BoundsLanes],
    frontier: &[u32],
    forms: &BeamForms,
    masks: &mut Vec<u16>,
) {
    beam::<super::registers::Avx2>(planes, bounds, frontier, forms, masks);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn boxes_avx512(bounds: &[BoundsLanes], forms: &Forms, masks: &mut Vec<u16>) {
    boxes::<super::registers::Avx512>(bounds, forms, masks);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn boxes_avx2(bounds: &[BoundsLanes], forms: &Forms, masks: &mut Vec<u16>) {
    boxes::<super::registers::Avx2>(bounds, forms, masks);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn blocks_avx512(blocks: &[FaceBlock], list: &[u32], forms: &Forms, found: &mut Vec<FaceHit>) {
    scan::<super::registers::Avx512>(blocks, list, forms, found);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512vl")]
fn gather_avx512(blocks: &[FaceBlock], found: &[FaceHit], columns: Columns<'_>) {
    gather::<super::registers::Avx512>(blocks, found, columns);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn blocks_avx2(blocks: &[FaceBlock], list: &[u32], forms: &Forms, found: &mut Vec<FaceHit>) {
    scan::<super::registers::Avx2>(blocks, list, forms, found);
}

// No closures below: one that is not inlined would be compiled without the instructions of its caller.

/// The larger end of a form over the boxes of all children; the smaller with `low` and `high` exchanged.
#[inline(always)]
fn extreme<R: Register>(form: &[f32; 4], low: &[[f32; LANES]; 3], high: &[[f32; LANES]; 3]) -> R {
    let mut sum = R::splat(form[3]);
    for axis in 0..3 {
        let end = if form[axis] >= 0.0 { high } else { low };
        sum = R::load(&end[axis]).mul_add(R::splat(form[axis]), sum);
    }
    sum
}

/// A form at sixteen points.
#[inline(always)]
fn value<R: Register>(form: &[f32; 4], points: &[[f32; LANES]; 3]) -> R {
    let mut sum = R::splat(form[3]);
    for axis in 0..3 {
        sum = R::load(&points[axis]).mul_add(R::splat(form[axis]), sum);
    }
    sum
}

/// Which are outside of the wedge's sides, given what is surely outside and surely inside of each.
#[inline(always)]
fn beyond(outside: [u16; 2], inside: [u16; 2], double: bool) -> u16 {
    if double {
        outside[0] & inside[1] | inside[0] & outside[1]
    } else {
        outside[0] | outside[1]
    }
}

/// Which boxes the wedge surely does not meet.
#[inline(always)]
fn misses<R: Register>(BoundsLanes { min, max }: &BoundsLanes, forms: &Forms) -> u16 {
    let (above, below) = (R::splat(forms.pad), R::splat(-forms.pad));
    let [plane, sides @ ..] = &forms.planes;
    let mut out = below.exceeds(extreme::<R>(plane, min, max));
    out |= extreme::<R>(plane, max, min).exceeds(above);
    let (mut outside, mut inside) = ([0u16; 2], [0u16; 2]);
    for i in 0..2 {
        outside[i] = below.exceeds(extreme::<R>(&sides[i], min, max));
        if forms.double {
            inside[i] = extreme::<R>(&sides[i], max, min).exceeds(above);
        }
    }
    out | beyond(outside, inside, forms.double)
}

/// Which children turn away from all viewers; none without viewers.
#[inline(always)]
fn turned_away<R: Register>(lanes: &PlaneLanes<1>, views: &[Option<View>; 2], pad: f32) -> u16 {
    let below = R::splat(-pad);
    let mut away = u16::MAX;
    for view in views.iter().flatten() {
        let mut most = R::splat(0.0);
        for (k, &factor) in view.iter().enumerate() {
            let end = if factor >= 0.0 {
                &lanes.hi[0][k]
            } else {
                &lanes.lo[0][k]
            };
            most = R::load(end).mul_add(R::splat(factor), most);
        }
        away &= below.exceeds(most);
    }
    away
}

#[inline(always)]
fn nodes<R: Register>(
    planes: &[PlaneLanes<1>],
    bounds: &[BoundsLanes],
    frontier: &[u32],
    forms: &Forms,
    masks: &mut Vec<u16>,
) {
    for &node in frontier {
        let mut out = misses::<R>(&bounds[node as usize], forms);
        if forms.views[1].is_some() {
            out |= turned_away::<R>(&planes[node as usize], &forms.views, forms.pad);
        }
        masks.push(!out);
    }
}

#[inline(always)]
fn beam<R: Register>(
    planes: &[PlaneLanes<1>],
    bounds: &[BoundsLanes],
    frontier: &[u32],
    forms: &BeamForms,
    masks: &mut Vec<u16>,
) {
    let below = R::splat(-forms.pad);
    for &node in frontier {
        let BoundsLanes { min, max } = &bounds[node as usize];
        let mut out = 0;
        for plane in &forms.planes {
            out |= below.exceeds(extreme::<R>(plane, min, max));
        }
        if forms.views[1].is_some() {
            out |= turned_away::<R>(&planes[node as usize], &forms.views, forms.pad);
        }
        masks.push(!out);
    }
}

#[inline(always)]
fn boxes<R: Register>(bounds: &[BoundsLanes], forms: &Forms, masks: &mut Vec<u16>) {
    for lanes in bounds {
        masks.push(!misses::<R>(lanes, forms));
    }
}

#[inline(always)]
fn scan<R: Register>(blocks: &[FaceBlock], list: &[u32], forms: &Forms, found: &mut Vec<FaceHit>) {
    let (above, below) = (R::splat(forms.pad), R::splat(-forms.pad));
    let [plane, sides @ ..] = &forms.planes;
    for i in 0..list.len() {
        if let Some(&later) = list.get(i + 6) {
            R::prefetch(&blocks[later as usize]);
        }
        let FaceBlock { corners, faces } = &blocks[list[i] as usize];
        let (mut all_above, mut all_below) = (u16::MAX, u16::MAX);
        for corner in corners {
            let height = value::<R>(plane, corner);
            all_above &= height.exceeds(above);
            all_below &= below.exceeds(height);
        }
        let mut out = all_above | all_below;
        if out != u16::MAX {
            let (mut outside, mut inside) = ([u16::MAX; 2], [u16::MAX; 2]);
            for k in 0..2 {
                for corner in corners {
                    let distance = value::<R>(&sides[k], corner);
                    outside[k] &= below.exceeds(distance);
                    inside[k] &= distance.exceeds(above);
                }
            }
            out |= beyond(outside, inside, forms.double);
        }
        R::push_hits(faces, !out, list[i] * LANES as u32, found);
    }
}

#[inline(always)]
fn gather<R: Register>(blocks: &[FaceBlock], found: &[FaceHit], columns: Columns<'_>) {
    let mut at = 0;
    while at < found.len() {
        let block = found[at].place / LANES as u32;
        let (mut mask, start) = (0u16, at);
        while at < found.len() && found[at].place / LANES as u32 == block {
            let bit = 1 << (found[at].place % LANES as u32);
            // Only lanes in their order are one run.
            if mask >= bit {
                break;
            }
            mask |= bit;
            at += 1;
        }
        let corners = &blocks[block as usize].corners;
        for corner in 0..3 {
            for axis in 0..3 {
                if let Some(to) = columns[corner][axis][start..].first_chunk_mut() {
                    R::compress(&corners[corner][axis], mask, to);
                }
            }
        }
    }
}
