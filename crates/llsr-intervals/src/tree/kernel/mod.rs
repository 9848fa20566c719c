//! The two inner loops of a query, for AVX-512, AVX2 and any processor.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;
#[cfg(target_arch = "x86_64")]
mod prefetch;
#[cfg(test)]
mod tests;

use super::blocks::{BlockMasks, PlaneBlock, View};
use super::hierarchy::PlaneLanes;

/// Instruction sets with a kernel of their own.
///
/// All give the same answers; a slower one is chosen by hand only to measure or to test it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// What every processor has.
    Portable,
    /// 256-bit x86 with fused multiplication and addition.
    Avx2,
    /// 512-bit x86.
    Avx512,
}

impl Instructions {
    /// The fastest that this processor has.
    pub fn detect() -> Self {
        [Self::Avx512, Self::Avx2]
            .into_iter()
            .find(|set| set.is_available())
            .unwrap_or(Self::Portable)
    }

    /// These, or the portable ones where the processor does not have them.
    pub(crate) fn or_portable(self) -> Self {
        if self.is_available() { self } else { Self::Portable }
    }

    /// True if this processor has them.
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => {
                std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                std::arch::is_x86_feature_detected!("avx512f")
                    && std::arch::is_x86_feature_detected!("avx512bw")
                    && std::arch::is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }
}

/// What is certain about the children of a node: a bit a child.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct NodeMasks {
    /// Every plane of every item faces every viewer.
    pub(crate) all_front: u16,
    /// No plane of any item faces any viewer.
    pub(crate) all_back: u16,
    /// For some plane and viewer, that plane of every item faces it.
    pub(crate) some_front: u16,
    /// For some plane and viewer, that plane of no item faces it.
    pub(crate) some_back: u16,
}

/// Tests the nodes of `frontier` and writes the masks of each to `masks`.
///
/// `pad` bounds the rounding errors of the sums; lanes without a child give arbitrary bits.
pub(crate) fn test_nodes<const P: usize>(
    instructions: Instructions,
    nodes: &[PlaneLanes<P>],
    frontier: &[u32],
    views: &[View],
    pad: f32,
    masks: &mut Vec<NodeMasks>,
) {
    masks.clear();
    match instructions {
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => avx512::test_nodes(nodes, frontier, views, pad, masks),
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => avx2::test_nodes(nodes, frontier, views, pad, masks),
        _ => portable::test_nodes(nodes, frontier, views, pad, masks),
    }
}

/// Scans the blocks of `list` and writes the masks of each to `masks`; bits beyond a block's items are arbitrary.
pub(crate) fn scan_blocks<const P: usize>(
    instructions: Instructions,
    blocks: &[PlaneBlock<P>],
    list: &[u32],
    views: &[View],
    masks: &mut Vec<BlockMasks>,
) {
    masks.clear();
    match instructions {
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => avx512::scan_blocks(blocks, list, views, masks),
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => avx2::scan_blocks(blocks, list, views, masks),
        _ => portable::scan_blocks(blocks, list, views, masks),
    }
}

/// Appends the items whose bit is set, in order.
#[inline]
pub(crate) fn emit(instructions: Instructions, items: &[u32], mask: u64, out: &mut Vec<u32>) {
    match instructions {
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => avx512::emit(items, mask, out),
        _ => portable::emit(items, mask, out),
    }
}
