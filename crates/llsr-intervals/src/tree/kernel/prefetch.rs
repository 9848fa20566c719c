//! Fetching what a kernel reads soon.
//!
//! Nodes and blocks of a query lie scattered, a kilobyte each; the processor follows a stream only after a few lines.
#![expect(unsafe_code, reason = "an intrinsic that takes a pointer")]

use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

/// How many entries of a list a kernel looks ahead.
pub(super) const AHEAD: usize = 2;

/// Bytes of a cache line.
const LINE: usize = 64;

/// Fetches a value into the nearest cache.
#[inline(always)]
pub(super) fn prefetch<T>(value: &T) {
    let start = std::ptr::from_ref(value).cast::<i8>();
    for offset in (0..size_of::<T>()).step_by(LINE) {
        // SAFETY: prefetching does not read or write in a way that a program could see, and the address lies in `value`.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.add(offset)) };
    }
}
