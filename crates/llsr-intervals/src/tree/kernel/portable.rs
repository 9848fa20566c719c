//! The kernels without special instructions; also the reference for the others.

use super::super::blocks::{BLOCK, BlockMasks, Form, PlaneBlock, View};
use super::super::hierarchy::{LANES, PlaneLanes};
use super::NodeMasks;

pub(super) fn test_nodes<const P: usize>(
    nodes: &[PlaneLanes<P>],
    frontier: &[u32],
    views: &[View],
    pad: f32,
    masks: &mut Vec<NodeMasks>,
) {
    for &node in frontier {
        let lanes = &nodes[node as usize];
        let mut result = NodeMasks {
            all_front: !0,
            all_back: !0,
            ..NodeMasks::default()
        };
        for view in views {
            for p in 0..P {
                let (lo, hi) = (&lanes.lo[p], &lanes.hi[p]);
                let (mut least, mut most) = ([0f32; LANES], [0f32; LANES]);
                for k in 0..4 {
                    // The sign of the view says which ends of the box give the ends of the product.
                    let (near, far) = if view[k] >= 0.0 {
                        (&lo[k], &hi[k])
                    } else {
                        (&hi[k], &lo[k])
                    };
                    for lane in 0..LANES {
                        least[lane] += near[lane] * view[k];
                        most[lane] += far[lane] * view[k];
                    }
                }
                let (mut front, mut back) = (0u16, 0u16);
                for lane in 0..LANES {
                    front |= u16::from(least[lane] > pad) << lane;
                    back |= u16::from(most[lane] < -pad) << lane;
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
    for &index in list {
        let block = &blocks[index as usize];
        let mut result = BlockMasks {
            front: !0,
            back: !0,
            unsure: 0,
        };
        for view in views {
            for p in 0..P {
                let Form { offset, slope, error } = block.form(p, view);
                let [x, y, z, w] = &block.quantised[p];
                let (mut front, mut unsure) = (0u64, 0u64);
                for i in 0..BLOCK {
                    let side = (f32::from(x[i]) * slope[0] + f32::from(y[i]) * slope[1])
                        + (f32::from(z[i]) * slope[2] + f32::from(w[i]) * slope[3])
                        + offset;
                    front |= u64::from(side > 0.0) << i;
                    unsure |= u64::from(side.abs() <= error) << i;
                }
                result.front &= front;
                result.back &= !front;
                result.unsure |= unsure;
            }
        }
        masks.push(result);
    }
}

pub(super) fn emit(items: &[u32], mut mask: u64, out: &mut Vec<u32>) {
    while mask != 0 {
        out.push(items[mask.trailing_zeros() as usize]);
        mask &= mask - 1;
    }
}
