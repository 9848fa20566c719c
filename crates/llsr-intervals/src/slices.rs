//! Dot products of many boxes with one, on structures of arrays.
#![expect(
    unsafe_code,
    reason = "calls of the copy compiled for AVX2 after the processor was asked for it"
)]

use crate::vector::dot_ends;
use crate::{IntervalVec3, Real};

/// Many boxes of vectors as six arrays of equal length.
#[derive(Clone, Copy, Debug)]
pub struct IntervalSlices<'a, F> {
    lo: [&'a [F]; 3],
    hi: [&'a [F]; 3],
}

impl<'a, F: Real> IntervalSlices<'a, F> {
    /// Boxes whose lower ends on x, y, z are `lo` and upper ends `hi`.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn new(lo: [&'a [F]; 3], hi: [&'a [F]; 3]) -> Self {
        let length = lo[0].len();
        assert!(
            lo.iter().chain(&hi).all(|s| s.len() == length),
            "interval slices of different lengths"
        );
        Self { lo, hi }
    }

    /// Number of boxes.
    pub fn len(&self) -> usize {
        self.lo[0].len()
    }

    /// There is no box.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes to `lo` and `hi` the ends of the dot product of each box with `v`.
    ///
    /// Encloses the exact range as [`IntervalVec3::dot`] does and gives the same bits, except that a box with an
    /// empty range gives everything. About 1 ns a box with AVX2, 3 ns without; the processor is asked at run time.
    ///
    /// # Panics
    /// If the outputs differ in length from the boxes, or `v` is empty.
    pub fn dot_into(&self, v: &IntervalVec3<F>, lo: &mut [F], hi: &mut [F]) {
        assert!(!v.is_empty(), "dot product with no vector");
        assert!(
            lo.len() == self.len() && hi.len() == self.len(),
            "outputs as long as the boxes"
        );
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            unsafe { self.dot_avx2(v, lo, hi) };
            return;
        }
        self.dot_portable(v, lo, hi);
    }

    /// The same body, compiled with 256-bit instructions.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn dot_avx2(&self, v: &IntervalVec3<F>, lo: &mut [F], hi: &mut [F]) {
        self.dot_portable(v, lo, hi);
    }

    #[inline(always)]
    pub(crate) fn dot_portable(&self, v: &IntervalVec3<F>, lo: &mut [F], hi: &mut [F]) {
        let n = self.len();
        // Slices cut to one length let the compiler drop the bounds checks in the loop.
        let (ax, ay, az) = (&self.lo[0][..n], &self.lo[1][..n], &self.lo[2][..n]);
        let (bx, by, bz) = (&self.hi[0][..n], &self.hi[1][..n], &self.hi[2][..n]);
        let (lo, hi) = (&mut lo[..n], &mut hi[..n]);
        let (v_lo, v_hi) = (v.lo(), v.hi());
        for i in 0..n {
            (lo[i], hi[i]) = dot_ends([ax[i], ay[i], az[i]], [bx[i], by[i], bz[i]], v_lo, v_hi);
        }
    }
}
