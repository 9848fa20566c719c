//! An allocator that counts, each thread for itself: a test's harness and other tests allocate when they like.
#![expect(unsafe_code, reason = "a global allocator that counts")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static MADE: Cell<Made> = const { Cell::new(Made { allocations: 0, bytes: 0 }) };
}

/// What a thread has asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Made {
    /// How often memory was asked for; memory that grows counts again.
    pub allocations: usize,
    /// How many bytes altogether, those that were given back too.
    pub bytes: usize,
}

/// Runs `work` and says what it asked for on this thread, beside its result.
///
/// # Panics
/// If no [`Counting`] is the global allocator: nothing would be counted whatever `work` does.
pub fn count<T>(work: impl FnOnce() -> T) -> (T, Made) {
    let before = MADE.get();
    drop(std::hint::black_box(Box::new(0u64)));
    let began = MADE.get();
    assert!(began != before, "the counting allocator is not the global one");
    let result = work();
    let ended = MADE.get();
    let made = Made {
        allocations: ended.allocations - began.allocations,
        bytes: ended.bytes - began.bytes,
    };
    (result, made)
}

/// The system's allocator, with a count:
/// `#[global_allocator] static COUNTING: Counting = Counting;`
#[derive(Clone, Copy, Debug, Default)]
pub struct Counting;

// SAFETY: hands everything on to the system's allocator; the count is a constant-initialised thread local without a
// destructor, so that touching it allocates nothing. Growing and zeroing come through `alloc`.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let Made { allocations, bytes } = MADE.get();
        MADE.set(Made {
            allocations: allocations + 1,
            bytes: bytes + layout.size(),
        });
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(pointer, layout) }
    }
}
