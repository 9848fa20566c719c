//! Lanes as AVX2 and AVX-512 registers.
#![expect(
    unsafe_code,
    reason = "vector instructions; their presence is proved by the token's existence"
)]

use std::arch::x86_64::*;

use super::{Floats, Kernel, Simd};
use crate::build::ChildRef;

/// Proof that AVX2, FMA, BMI, LZCNT and POPCNT exist.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

/// Proof that AVX-512 F, VL, DQ and BW exist, besides those of [`Avx2`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512(());

/// Eight lanes in a 256-bit register, made from a token of type `T`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ymm<T>(__m256, T);

/// Sixteen lanes in two 256-bit registers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair(__m256, __m256, Avx2);

/// Sixteen lanes in a 512-bit register.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Zmm(__m512, Avx512);

impl Avx2 {
    pub(crate) fn detect() -> Option<Self> {
        let found = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        found.then_some(Self(()))
    }

    #[inline(always)]
    pub(crate) fn vectorize<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn inner<K: Kernel>(simd: Avx2, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: the token proves that the instructions exist.
        unsafe { inner(self, kernel) }
    }
}

impl Avx512 {
    pub(crate) fn detect() -> Option<Self> {
        let found = Avx2::detect().is_some()
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw");
        found.then_some(Self(()))
    }

    #[inline(always)]
    pub(crate) fn vectorize<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
        fn inner<K: Kernel>(simd: Avx512, kernel: K) -> K::Output {
            kernel.run(simd)
        }
        // SAFETY: the token proves that the instructions exist.
        unsafe { inner(self, kernel) }
    }
}

/// Operations on one register.
macro_rules! register {
    ($token:ty, $array:ty, $make:expr, $array_zero:expr, $load:ident, $store:ident, $set1:ident, $add:ident, $sub:ident,
     $mul:ident, $div:ident, $fma:ident, $fms:ident, $fnma:ident, $min:ident, $max:ident) => {
        type Token = $token;
        type Array = $array;

        #[inline(always)]
        fn splat(token: $token, x: f32) -> Self {
            // SAFETY: the token proves the instruction.
            $make(unsafe { $set1(x) }, token)
        }
        #[inline(always)]
        fn load(token: $token, from: &$array) -> Self {
            // SAFETY: the token proves the instruction; the array is as large as the register.
            $make(unsafe { $load(from.as_ptr()) }, token)
        }
        #[inline(always)]
        fn store(self) -> $array {
            let mut to = $array_zero;
            // SAFETY: the token inside proves the instruction; the array is as large as the register.
            unsafe { $store(to.as_mut_ptr(), self.0) };
            to
        }
        #[inline(always)]
        fn add(self, b: Self) -> Self {
            // SAFETY: the token inside proves the instruction.
            $make(unsafe { $add(self.0, b.0) }, self.1)
        }
        #[inline(always)]
        fn sub(self, b: Self) -> Self {
            // SAFETY: the token inside proves the instruction.
            $make(unsafe { $sub(self.0, b.0) }, self.1)
        }
        #[inline(always)]
        fn mul(self, b: Self) -> Self {
            // SAFETY: the token inside proves the instruction.
            $make(unsafe { $mul(self.0, b.0) }, self.1)
        }
        #[inline(always)]
        fn div(self, b: Self) -> Self {
            // SAFETY: the token inside proves the instruction.
            $make(unsafe { $div(self.0, b.0) }, self.1)
        }
        #[inline(always)]
        fn mul_add(self, b: Self, c: Self) -> Self {
            // SAFETY: the token inside proves the instruction.
            $make(unsafe { $fma(self.0, b.0, c.0) }, self.1)
        }
        #[inline(always)]
        fn mul_sub(self, b: Self, c: Self) -> Self {
            // SAFETY: the token inside proves the instruction.
            $make(unsafe { $fms(self.0, b.0, c.0) }, self.1)
        }
        #[inline(always)]
        fn neg_mul_add(self, b: Self, c: Self) -> Self {
            // SAFETY: the token inside proves the instruction.
            $make(unsafe { $fnma(self.0, b.0, c.0) }, self.1)
        }
        #[inline(always)]
        fn min(self, b: Self) -> Self {
            // SAFETY: the token inside proves the instruction.
            $make(unsafe { $min(self.0, b.0) }, self.1)
        }
        #[inline(always)]
        fn max(self, b: Self) -> Self {
            // SAFETY: the token inside proves the instruction.
            $make(unsafe { $max(self.0, b.0) }, self.1)
        }
    };
}

macro_rules! ymm {
    ($token:ty) => {
        register!(
            $token,
            [f32; 8],
            Ymm,
            [0.0; 8],
            _mm256_loadu_ps,
            _mm256_storeu_ps,
            _mm256_set1_ps,
            _mm256_add_ps,
            _mm256_sub_ps,
            _mm256_mul_ps,
            _mm256_div_ps,
            _mm256_fmadd_ps,
            _mm256_fmsub_ps,
            _mm256_fnmadd_ps,
            _mm256_min_ps,
            _mm256_max_ps
        );

        #[inline(always)]
        fn abs(self) -> Self {
            // SAFETY: the token inside proves AVX2.
            Ymm(
                unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) },
                self.1,
            )
        }
        #[inline(always)]
        fn copysign(self, sign: Self) -> Self {
            // SAFETY: the token inside proves AVX2.
            let bits = unsafe {
                let mask = _mm256_set1_ps(-0.0);
                _mm256_or_ps(_mm256_and_ps(mask, sign.0), _mm256_andnot_ps(mask, self.0))
            };
            Ymm(bits, self.1)
        }
        #[inline(always)]
        fn min_bits(self, b: Self) -> Self {
            // SAFETY: the token inside proves AVX2.
            let bits = unsafe { _mm256_min_epi32(_mm256_castps_si256(self.0), _mm256_castps_si256(b.0)) };
            // SAFETY: as above.
            Ymm(unsafe { _mm256_castsi256_ps(bits) }, self.1)
        }
        #[inline(always)]
        fn max_bits(self, b: Self) -> Self {
            // SAFETY: the token inside proves AVX2.
            let bits = unsafe { _mm256_max_epi32(_mm256_castps_si256(self.0), _mm256_castps_si256(b.0)) };
            // SAFETY: as above.
            Ymm(unsafe { _mm256_castsi256_ps(bits) }, self.1)
        }
    };
}

impl Floats for Ymm<Avx2> {
    ymm!(Avx2);

    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        // SAFETY: the token inside proves AVX2.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0)) as u32 }
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        // SAFETY: the token inside proves AVX2.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, b.0)) as u32 }
    }
}

impl Floats for Ymm<Avx512> {
    ymm!(Avx512);

    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        // SAFETY: the token inside proves AVX-512 VL.
        unsafe { u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(self.0, b.0)) }
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        // SAFETY: the token inside proves AVX-512 VL.
        unsafe { u32::from(_mm256_cmp_ps_mask::<_CMP_LT_OQ>(self.0, b.0)) }
    }
}

impl Floats for Zmm {
    register!(
        Avx512,
        [f32; 16],
        Zmm,
        [0.0; 16],
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        _mm512_set1_ps,
        _mm512_add_ps,
        _mm512_sub_ps,
        _mm512_mul_ps,
        _mm512_div_ps,
        _mm512_fmadd_ps,
        _mm512_fmsub_ps,
        _mm512_fnmadd_ps,
        _mm512_min_ps,
        _mm512_max_ps
    );

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: the token inside proves AVX-512 F.
        Zmm(unsafe { _mm512_abs_ps(self.0) }, self.1)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        // SAFETY: the token inside proves AVX-512 F and DQ.
        let bits = unsafe {
            let mask = _mm512_set1_ps(-0.0);
            _mm512_or_ps(_mm512_and_ps(mask, sign.0), _mm512_andnot_ps(mask, self.0))
        };
        Zmm(bits, self.1)
    }
    #[inline(always)]
    fn min_bits(self, b: Self) -> Self {
        // SAFETY: the token inside proves AVX-512 F.
        let bits = unsafe { _mm512_min_epi32(_mm512_castps_si512(self.0), _mm512_castps_si512(b.0)) };
        // SAFETY: as above.
        Zmm(unsafe { _mm512_castsi512_ps(bits) }, self.1)
    }
    #[inline(always)]
    fn max_bits(self, b: Self) -> Self {
        // SAFETY: the token inside proves AVX-512 F.
        let bits = unsafe { _mm512_max_epi32(_mm512_castps_si512(self.0), _mm512_castps_si512(b.0)) };
        // SAFETY: as above.
        Zmm(unsafe { _mm512_castsi512_ps(bits) }, self.1)
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        // SAFETY: the token inside proves AVX-512 F.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, b.0)) }
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        // SAFETY: the token inside proves AVX-512 F.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, b.0)) }
    }
}

impl Pair {
    #[inline(always)]
    fn halves(self) -> [Ymm<Avx2>; 2] {
        [Ymm(self.0, self.2), Ymm(self.1, self.2)]
    }

    #[inline(always)]
    fn join(low: Ymm<Avx2>, high: Ymm<Avx2>) -> Self {
        Self(low.0, high.0, low.1)
    }
}

macro_rules! pairwise {
    ($($name:ident($($arg:ident),*);)*) => {$(
        #[inline(always)]
        fn $name(self, $($arg: Self),*) -> Self {
            let [low, high] = self.halves();
            Self::join(low.$name($($arg.halves()[0]),*), high.$name($($arg.halves()[1]),*))
        }
    )*};
}

impl Floats for Pair {
    type Token = Avx2;
    type Array = [f32; 16];

    pairwise! {
        add(b);
        sub(b);
        mul(b);
        div(b);
        mul_add(b, c);
        mul_sub(b, c);
        neg_mul_add(b, c);
        min(b);
        max(b);
        min_bits(b);
        max_bits(b);
        copysign(sign);
        abs();
    }

    #[inline(always)]
    fn splat(token: Avx2, x: f32) -> Self {
        let half = Ymm::splat(token, x);
        Self::join(half, half)
    }
    #[inline(always)]
    fn load(token: Avx2, from: &[f32; 16]) -> Self {
        // SAFETY: the token proves AVX2; the array is as large as two registers.
        unsafe {
            Self(
                _mm256_loadu_ps(from.as_ptr()),
                _mm256_loadu_ps(from.as_ptr().add(8)),
                token,
            )
        }
    }
    #[inline(always)]
    fn store(self) -> [f32; 16] {
        let mut to = [0.0; 16];
        // SAFETY: the token inside proves AVX2; the array is as large as two registers.
        unsafe {
            _mm256_storeu_ps(to.as_mut_ptr(), self.0);
            _mm256_storeu_ps(to.as_mut_ptr().add(8), self.1);
        }
        to
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        let ([a0, a1], [b0, b1]) = (self.halves(), b.halves());
        a0.le(b0) | a1.le(b1) << 8
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        let ([a0, a1], [b0, b1]) = (self.halves(), b.halves());
        a0.lt(b0) | a1.lt(b1) << 8
    }
}

impl Simd for Avx2 {
    type F = Ymm<Self>;
    type W = Pair;

    #[inline(always)]
    fn compress(self, from: &[ChildRef; 8], mask: u32) -> [ChildRef; 8] {
        let mut to = [ChildRef::default(); 8];
        // SAFETY: the token proves AVX2 and BMI2; both arrays are eight `u32` (`ChildRef` is transparent).
        unsafe {
            // The lane numbers selected by the mask, one a byte: expand the mask to bytes and pick.
            let bytes = _pdep_u64(u64::from(mask & 0xff), 0x0101_0101_0101_0101).wrapping_mul(0xff);
            let lanes = _pext_u64(0x0706_0504_0302_0100, bytes);
            let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes as i64));
            let all = _mm256_loadu_si256(from.as_ptr().cast());
            _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(all, lanes));
        }
        to
    }

    #[inline(always)]
    fn bits_to_bytes(self, mask: u32) -> u64 {
        // SAFETY: the token proves BMI2.
        unsafe { _pdep_u64(u64::from(mask & 0xff), 0x0101_0101_0101_0101) }
    }

    #[inline(always)]
    fn compress_byte_lanes(self, from: u64, mask: u32) -> u64 {
        // SAFETY: the token proves BMI2.
        unsafe {
            let bytes = _pdep_u64(u64::from(mask & 0xff), 0x0101_0101_0101_0101).wrapping_mul(0xff);
            _pext_u64(from, bytes)
        }
    }

    #[inline(always)]
    fn permute(self, from: Pair, indices: &[u8; 16]) -> Pair {
        // SAFETY: the token proves AVX2; the array is as large as the 128-bit register.
        unsafe {
            let bytes = _mm_loadu_si128(indices.as_ptr().cast());
            let half = |bytes: __m128i| _mm256_cvtepu8_epi32(bytes);
            let (low, high) = (half(bytes), half(_mm_unpackhi_epi64(bytes, bytes)));
            Pair(
                permute_pair(self, from, low),
                permute_pair(self, from, high),
                self,
            )
        }
    }
}

#[inline(always)]
fn permute_pair(_: Avx2, from: Pair, indices: __m256i) -> __m256 {
    // SAFETY: the token proves AVX2.
    unsafe {
        let low = _mm256_permutevar8x32_ps(from.0, indices);
        let high = _mm256_permutevar8x32_ps(from.1, indices);
        // Bit 3 of the index chooses the register.
        let choose = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(indices));
        _mm256_blendv_ps(low, high, choose)
    }
}

impl Simd for Avx512 {
    type F = Ymm<Self>;
    type W = Zmm;

    #[inline(always)]
    fn compress(self, from: &[ChildRef; 8], mask: u32) -> [ChildRef; 8] {
        let mut to = [ChildRef::default(); 8];
        // SAFETY: the token proves AVX-512 VL; both arrays are eight `u32` (`ChildRef` is transparent).
        unsafe {
            // Compress in the register: the form that writes to memory is slow on some processors.
            let all = _mm256_loadu_si256(from.as_ptr().cast());
            _mm256_storeu_si256(
                to.as_mut_ptr().cast(),
                _mm256_maskz_compress_epi32(mask as u8, all),
            );
        }
        to
    }

    #[inline(always)]
    fn bits_to_bytes(self, mask: u32) -> u64 {
        // SAFETY: the token proves BMI2.
        unsafe { _pdep_u64(u64::from(mask & 0xff), 0x0101_0101_0101_0101) }
    }

    #[inline(always)]
    fn compress_byte_lanes(self, from: u64, mask: u32) -> u64 {
        // SAFETY: the token proves BMI2.
        unsafe {
            let bytes = _pdep_u64(u64::from(mask & 0xff), 0x0101_0101_0101_0101).wrapping_mul(0xff);
            _pext_u64(from, bytes)
        }
    }

    #[inline(always)]
    fn permute(self, from: Zmm, indices: &[u8; 16]) -> Zmm {
        // SAFETY: the token proves AVX-512 F; the array is as large as the 128-bit register.
        unsafe {
            let indices = _mm512_cvtepu8_epi32(_mm_loadu_si128(indices.as_ptr().cast()));
            Zmm(_mm512_permutexvar_ps(indices, from.0), self)
        }
    }
}
