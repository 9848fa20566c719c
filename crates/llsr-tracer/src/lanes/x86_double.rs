//! Eight lanes of double precision as AVX2 and AVX-512 registers.
#![expect(
    unsafe_code,
    reason = "vector instructions; their presence is proved by the token's existence"
)]

use std::arch::x86_64::*;

use super::double::{DoubleLanes, Doubles};
use super::x86::{Avx2, Avx512};

/// Eight doubles in a 512-bit register.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Zmmd(__m512d, Avx512);

/// Eight doubles in two 256-bit registers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paird(__m256d, __m256d, Avx2);

impl Doubles for Zmmd {
    type Token = Avx512;

    #[inline(always)]
    fn splat(token: Avx512, x: f64) -> Self {
        // SAFETY: the token proves AVX-512 F; so it does below.
        Self(unsafe { _mm512_set1_pd(x) }, token)
    }
    #[inline(always)]
    fn widen(token: Avx512, from: &[f32; 8]) -> Self {
        // SAFETY: as above; the array is as large as the 256-bit register.
        Self(unsafe { _mm512_cvtps_pd(_mm256_loadu_ps(from.as_ptr())) }, token)
    }
    #[inline(always)]
    fn load(token: Avx512, from: &[f64; 8]) -> Self {
        // SAFETY: as above; the array is as large as the register.
        Self(unsafe { _mm512_loadu_pd(from.as_ptr()) }, token)
    }
    #[inline(always)]
    fn store(self) -> [f64; 8] {
        let mut to = [0.0; 8];
        // SAFETY: as above; the array is as large as the register.
        unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) };
        to
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        // SAFETY: the token inside proves AVX-512 F; so it does below.
        Self(unsafe { _mm512_add_pd(self.0, b.0) }, self.1)
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_sub_pd(self.0, b.0) }, self.1)
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_mul_pd(self.0, b.0) }, self.1)
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_div_pd(self.0, b.0) }, self.1)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_abs_pd(self.0) }, self.1)
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        // SAFETY: as above.
        unsafe { u32::from(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, b.0)) }
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        // SAFETY: as above.
        unsafe { u32::from(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, b.0)) }
    }
    #[inline(always)]
    fn or_else(self, mask: u32, other: Self) -> Self {
        // SAFETY: as above.
        Self(
            unsafe { _mm512_mask_blend_pd(mask as u8, other.0, self.0) },
            self.1,
        )
    }
}

impl Doubles for Paird {
    type Token = Avx2;

    #[inline(always)]
    fn splat(token: Avx2, x: f64) -> Self {
        // SAFETY: the token proves AVX2; so it does below.
        let half = unsafe { _mm256_set1_pd(x) };
        Self(half, half, token)
    }
    #[inline(always)]
    fn widen(token: Avx2, from: &[f32; 8]) -> Self {
        // SAFETY: as above; the array is as large as two 128-bit registers.
        unsafe {
            Self(
                _mm256_cvtps_pd(_mm_loadu_ps(from.as_ptr())),
                _mm256_cvtps_pd(_mm_loadu_ps(from.as_ptr().add(4))),
                token,
            )
        }
    }
    #[inline(always)]
    fn load(token: Avx2, from: &[f64; 8]) -> Self {
        // SAFETY: as above; the array is as large as two registers.
        unsafe {
            Self(
                _mm256_loadu_pd(from.as_ptr()),
                _mm256_loadu_pd(from.as_ptr().add(4)),
                token,
            )
        }
    }
    #[inline(always)]
    fn store(self) -> [f64; 8] {
        let mut to = [0.0; 8];
        // SAFETY: as above; the array is as large as two registers.
        unsafe {
            _mm256_storeu_pd(to.as_mut_ptr(), self.0);
            _mm256_storeu_pd(to.as_mut_ptr().add(4), self.1);
        }
        to
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        // SAFETY: the token inside proves AVX2; so it does below.
        unsafe { Self(_mm256_add_pd(self.0, b.0), _mm256_add_pd(self.1, b.1), self.2) }
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        // SAFETY: as above.
        unsafe { Self(_mm256_sub_pd(self.0, b.0), _mm256_sub_pd(self.1, b.1), self.2) }
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        // SAFETY: as above.
        unsafe { Self(_mm256_mul_pd(self.0, b.0), _mm256_mul_pd(self.1, b.1), self.2) }
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        // SAFETY: as above.
        unsafe { Self(_mm256_div_pd(self.0, b.0), _mm256_div_pd(self.1, b.1), self.2) }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as above.
        unsafe {
            let sign = _mm256_set1_pd(-0.0);
            Self(
                _mm256_andnot_pd(sign, self.0),
                _mm256_andnot_pd(sign, self.1),
                self.2,
            )
        }
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        // SAFETY: as above.
        unsafe {
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, b.0));
            let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.1, b.1));
            (low | high << 4) as u32
        }
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        // SAFETY: as above.
        unsafe {
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, b.0));
            let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.1, b.1));
            (low | high << 4) as u32
        }
    }
    #[inline(always)]
    fn or_else(self, mask: u32, other: Self) -> Self {
        // SAFETY: as above.
        unsafe {
            // Each lane's bit moved to the sign.
            let mask = _mm256_set1_epi64x(i64::from(mask));
            let low = _mm256_sllv_epi64(mask, _mm256_set_epi64x(60, 61, 62, 63));
            let high = _mm256_sllv_epi64(mask, _mm256_set_epi64x(56, 57, 58, 59));
            Self(
                _mm256_blendv_pd(other.0, self.0, _mm256_castsi256_pd(low)),
                _mm256_blendv_pd(other.1, self.1, _mm256_castsi256_pd(high)),
                self.2,
            )
        }
    }
}

/// The parts that need no more than AVX2 and BMI2.
macro_rules! bytes_and_bits {
    () => {
        #[inline(always)]
        fn compress_bytes(self, from: &[u8; 16], mask: u32) -> u64 {
            let whole = u128::from_le_bytes(*from);
            let below = (mask & 0xff).count_ones();
            // SAFETY: the token proves BMI2.
            let (low, high) = unsafe {
                (
                    _pext_u64(whole as u64, self.spread(mask)),
                    _pext_u64((whole >> 64) as u64, self.spread(mask >> 8)),
                )
            };
            // Where the low half fills all lanes nothing of the high half is left.
            low | high.checked_shl(8 * below).unwrap_or(0)
        }

        #[inline(always)]
        fn compress_bits(self, from: u32, mask: u32) -> u32 {
            // SAFETY: the token proves BMI2.
            unsafe { _pext_u32(from, mask) }
        }

        #[inline(always)]
        fn spread(self, bits: u32) -> u64 {
            // SAFETY: the token proves BMI2.
            unsafe { _pdep_u64(u64::from(bits & 0xff), 0x0101_0101_0101_0101) }.wrapping_mul(0xff)
        }

        #[inline(always)]
        fn prefetch<T>(self, at: &T) {
            let start = std::ptr::from_ref(at).cast::<i8>();
            for line in (0..size_of::<T>()).step_by(64) {
                // SAFETY: the address lies inside `at`; fetching has no effect that a program can see.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(start.add(line)) };
            }
        }
    };
}

impl DoubleLanes for Avx512 {
    type D = Zmmd;

    bytes_and_bits!();

    #[inline(always)]
    fn permute_bits(self, bits: u32, indices: &[u8; 16]) -> u32 {
        // SAFETY: the token proves AVX-512 BW and VL; the array is as large as the register.
        unsafe {
            let low = _mm_and_si128(_mm_loadu_si128(indices.as_ptr().cast()), _mm_set1_epi8(15));
            let moved = _mm_shuffle_epi8(_mm_movm_epi8(bits as u16), low);
            u32::from(_mm_movepi8_mask(moved))
        }
    }

    #[inline(always)]
    fn pick(self, table: &[Zmmd; 2], indices: u64) -> Zmmd {
        // SAFETY: the token proves AVX-512 F. The instruction looks at the low four bits.
        unsafe {
            let lanes = _mm512_cvtepu8_epi64(_mm_cvtsi64_si128(indices as i64));
            Zmmd(_mm512_permutex2var_pd(table[0].0, lanes, table[1].0), self)
        }
    }
}

impl DoubleLanes for Avx2 {
    type D = Paird;

    bytes_and_bits!();

    #[inline(always)]
    fn permute_bits(self, bits: u32, indices: &[u8; 16]) -> u32 {
        // SAFETY: the token proves AVX2; the array is as large as the register.
        unsafe {
            let low = _mm_and_si128(_mm_loadu_si128(indices.as_ptr().cast()), _mm_set1_epi8(15));
            // The low byte of the mask in the lower eight bytes, the high byte in the others; each keeps its own bit.
            let halves = _mm_set_epi64x(0x0101_0101_0101_0101, 0);
            let bytes = _mm_shuffle_epi8(_mm_cvtsi32_si128(bits as i32), halves);
            let own = _mm_set1_epi64x(0x8040_2010_0804_0201_u64 as i64);
            let set = _mm_cmpeq_epi8(_mm_and_si128(bytes, own), own);
            _mm_movemask_epi8(_mm_shuffle_epi8(set, low)) as u32
        }
    }

    #[inline(always)]
    fn pick(self, table: &[Paird; 2], indices: u64) -> Paird {
        let (low, high) = (table[0].store(), table[1].store());
        let picked = indices.to_le_bytes().map(|i| {
            let i = usize::from(i & 15);
            if i < 8 { low[i & 7] } else { high[i & 7] }
        });
        Paird::load(self, &picked)
    }
}
