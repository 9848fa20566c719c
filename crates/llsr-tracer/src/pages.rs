//! Large arrays on large pages.
//!
//! A traversal jumps about in tens of megabytes, and on pages of four kilobytes it waits for address translation more
//! than for data. Linux gives large pages to whom asks.
#![expect(
    unsafe_code,
    reason = "an allocation of its own alignment, and one system call"
)]

use std::alloc::{Layout, alloc, dealloc, handle_alloc_error};
use std::fmt;
use std::ops::Deref;
use std::ptr::NonNull;

/// Size and alignment of a large page (bytes).
const LARGE: usize = 2 << 20;

/// A slice that does not change, on large pages if it is large.
pub(crate) struct Pages<T: Copy> {
    data: NonNull<T>,
    len: usize,
}

// SAFETY: the memory belongs to this value alone, as in `Box<[T]>`.
unsafe impl<T: Copy + Send> Send for Pages<T> {}
// SAFETY: as above; shared access only reads.
unsafe impl<T: Copy + Sync> Sync for Pages<T> {}

impl<T: Copy> Pages<T> {
    /// Copies `source`.
    pub(crate) fn new(source: &[T]) -> Self {
        let Some(layout) = Self::layout(source.len()) else {
            return Self {
                data: NonNull::dangling(),
                len: 0,
            };
        };
        // SAFETY: the layout has a size above zero.
        let memory = unsafe { alloc(layout) };
        let Some(data) = NonNull::new(memory.cast::<T>()) else {
            handle_alloc_error(layout)
        };
        if layout.align() == LARGE {
            advise(memory, layout.size());
        }
        // SAFETY: the allocation holds at least `source.len()` values and is new, so it does not overlap.
        unsafe { std::ptr::copy_nonoverlapping(source.as_ptr(), data.as_ptr(), source.len()) };
        Self {
            data,
            len: source.len(),
        }
    }

    /// `None` for nothing.
    fn layout(len: usize) -> Option<Layout> {
        let layout = Layout::array::<T>(len).ok()?;
        if layout.size() == 0 {
            return None;
        }
        if layout.size() < LARGE {
            return Some(layout);
        }
        // Whole pages, so that the last is large too.
        Layout::from_size_align(layout.size().next_multiple_of(LARGE), LARGE.max(layout.align())).ok()
    }
}

/// Asks for large pages; if there are none, nothing changes.
fn advise(memory: *mut u8, bytes: usize) {
    #[cfg(all(target_os = "linux", not(miri)))]
    {
        use std::ffi::{c_int, c_void};
        unsafe extern "C" {
            fn madvise(address: *mut c_void, length: usize, advice: c_int) -> c_int;
        }
        const MADV_HUGEPAGE: c_int = 14;
        // SAFETY: the range is an allocation of ours in whole pages; the advice does not change its contents.
        unsafe { madvise(memory.cast(), bytes, MADV_HUGEPAGE) };
    }
    #[cfg(not(all(target_os = "linux", not(miri))))]
    let _ = (memory, bytes);
}

impl<T: Copy> Drop for Pages<T> {
    fn drop(&mut self) {
        if let Some(layout) = Self::layout(self.len) {
            // SAFETY: the memory came from `alloc` with this layout.
            unsafe { dealloc(self.data.as_ptr().cast(), layout) };
        }
    }
}

impl<T: Copy> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: `len` values were written when this was made (or the pointer dangles and `len` is zero).
        unsafe { std::slice::from_raw_parts(self.data.as_ptr(), self.len) }
    }
}

impl<T: Copy> Default for Pages<T> {
    fn default() -> Self {
        Self::new(&[])
    }
}

impl<T: Copy> Clone for Pages<T> {
    fn clone(&self) -> Self {
        Self::new(self)
    }
}

impl<T: Copy + fmt::Debug> fmt::Debug for Pages<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_survive_whatever_the_size() {
        for len in [0usize, 1, 1000, 300_000, 600_000] {
            let source: Vec<u64> = (0..len as u64).collect();
            let pages = Pages::new(&source);
            assert_eq!(&*pages, source.as_slice(), "{len} numbers");
            let copy = pages.clone();
            drop(pages);
            assert_eq!(&*copy, source.as_slice(), "a copy of {len} numbers");
        }
    }
}
