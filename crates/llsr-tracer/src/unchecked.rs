//! Indexing that is proved once instead of checked each time, for the innermost loops.
#![expect(
    unsafe_code,
    reason = "unchecked indexing; each index is proved where it is made"
)]

use std::mem::MaybeUninit;

use crate::build::{ChildRef, STACK, WIDTH, WideNode};
use crate::lanes::Simd;

/// One of the six planes of a box: lower x, y, z, upper x, y, z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane(u8);

impl Plane {
    /// The lower or upper plane of axis 0, 1 or 2; other axes count as 2.
    #[inline(always)]
    pub(crate) fn new(axis: usize, upper: bool) -> Self {
        Self(axis.min(2) as u8 + 3 * u8::from(upper))
    }

    /// That plane of each child.
    #[inline(always)]
    pub(crate) fn of(self, node: &WideNode) -> &[f32; WIDTH] {
        self.pick(&node.bounds)
    }

    /// That one of six planes.
    #[inline(always)]
    pub(crate) fn pick<T>(self, planes: &[T; 6]) -> &T {
        // SAFETY: the only constructor makes indices below 6.
        unsafe { planes.get_unchecked(usize::from(self.0)) }
    }
}

/// One of three axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis(u8);

impl Axis {
    /// Axis 0, 1 or 2; other numbers count as 2.
    #[inline(always)]
    pub(crate) fn new(axis: usize) -> Self {
        Self(axis.min(2) as u8)
    }

    /// Its number.
    #[inline(always)]
    pub(crate) fn index(self) -> usize {
        usize::from(self.0)
    }

    #[inline(always)]
    pub(crate) fn of<T>(self, vector: &[T; 3]) -> &T {
        // SAFETY: the only constructor makes indices below 3.
        unsafe { vector.get_unchecked(usize::from(self.0)) }
    }

    #[inline(always)]
    pub(crate) fn of_mut<T>(self, vector: &mut [T; 3]) -> &mut T {
        // SAFETY: as above.
        unsafe { vector.get_unchecked_mut(usize::from(self.0)) }
    }
}

/// References that wait to be visited.
pub(crate) struct Stack {
    entries: [MaybeUninit<ChildRef>; STACK + WIDTH],
    /// At most `STACK`.
    len: usize,
}

impl Stack {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            entries: [const { MaybeUninit::uninit() }; STACK + WIDTH],
            len: 0,
        }
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<ChildRef> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: entries below `len` were written by `push_each`.
        Some(unsafe { self.entries.get_unchecked(self.len).assume_init() })
    }

    /// Pushes the children selected by the low eight bits of `mask`.
    ///
    /// # Panics
    /// If the tree is deeper than the build allows.
    #[inline(always)]
    pub(crate) fn push_each<S: Simd>(&mut self, s: S, node: &WideNode, mask: u32) {
        let mask = mask & 0xff;
        // SAFETY: `len` is at most `STACK`, so eight entries fit behind it; all eight are
        // written.
        unsafe {
            let to = self
                .entries
                .as_mut_ptr()
                .add(self.len)
                .cast::<[ChildRef; WIDTH]>();
            to.write(s.compress(&node.children, mask));
        }
        self.len += mask.count_ones() as usize;
        assert!(
            self.len <= STACK,
            "trees are built so that the stack is large enough"
        );
    }
}

/// One of eight lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lane(u8);

impl Lane {
    /// That of the lowest of the low eight bits that is set; lane 7 if none is.
    #[inline(always)]
    pub(crate) fn lowest(bits: u32) -> Self {
        Self(bits.trailing_zeros().min(7) as u8)
    }

    #[inline(always)]
    pub(crate) fn of<T>(self, row: &[T; 8]) -> &T {
        // SAFETY: the only constructor makes indices below 8.
        unsafe { row.get_unchecked(usize::from(self.0)) }
    }
}

/// References that wait to be visited by some of eight rays.
pub(crate) struct PencilStack {
    children: [MaybeUninit<ChildRef>; STACK + WIDTH],
    rays: [MaybeUninit<u8>; STACK + WIDTH],
    /// At most `STACK`.
    len: usize,
}

impl PencilStack {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            children: [const { MaybeUninit::uninit() }; STACK + WIDTH],
            rays: [const { MaybeUninit::uninit() }; STACK + WIDTH],
            len: 0,
        }
    }

    /// Empties the stack and puts the root of a tree onto it.
    #[inline(always)]
    pub(crate) fn push_root(&mut self, rays: u32) {
        self.children[0].write(ChildRef::default());
        self.rays[0].write(rays as u8);
        self.len = 1;
    }

    /// A reference and its rays, one bit each.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<(ChildRef, u32)> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: entries below `len` were written by `push_root` or `push_each`.
        unsafe {
            let child = self.children.get_unchecked(self.len).assume_init();
            let rays = self.rays.get_unchecked(self.len).assume_init();
            Some((child, u32::from(rays)))
        }
    }

    /// Pushes the children selected by the low eight bits of `mask`, each with its byte of `rays`.
    ///
    /// # Panics
    /// If the tree is deeper than the build allows.
    #[inline(always)]
    pub(crate) fn push_each<S: Simd>(&mut self, s: S, node: &WideNode, mask: u32, rays: u64) {
        let mask = mask & 0xff;
        // SAFETY: `len` is at most `STACK`, so eight entries fit behind it in both arrays; all eight are
        // written.
        unsafe {
            let to = self
                .children
                .as_mut_ptr()
                .add(self.len)
                .cast::<[ChildRef; WIDTH]>();
            to.write(s.compress(&node.children, mask));
            let to = self.rays.as_mut_ptr().add(self.len).cast::<[u8; WIDTH]>();
            to.write(s.compress_byte_lanes(rays, mask).to_le_bytes());
        }
        self.len += mask.count_ones() as usize;
        assert!(
            self.len <= STACK,
            "trees are built so that the stack is large enough"
        );
    }
}
