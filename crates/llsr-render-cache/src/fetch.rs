//! Hints to the memory about what will be looked at soon.
#![expect(unsafe_code, reason = "prefetch instructions, which have no safe form")]

/// Asks for the piece of memory in which `values[i]` lies; does nothing if there is no such value, or no such instruction.
#[inline(always)]
pub(crate) fn fetch<T>(values: &[T], i: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(value) = values.get(i) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a hint that reads and writes nothing; the address is that of a value.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (values, i);
}
