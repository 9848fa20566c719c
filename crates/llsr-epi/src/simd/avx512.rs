//! AVX-512: sixteen pixels in a register.
#![expect(
    unsafe_code,
    reason = "intrinsics and unaligned loads; every block says why it is sound"
)]

use std::arch::x86_64::*;

use crate::classify::Masks;
use crate::code::EdgeCode;
use crate::colour::FINE;
use crate::fit::Floats;
use crate::interpolate::{
    BLOCK, Blocks, CHANNELS, Output, PackedBlock, ROW, TAP_GROUPS, TapMasks, TileRow, group_weights,
};
use crate::kernel::Kernel;
use crate::lanes::Lanes;
use crate::pixels::SAMPLE;

/// To be used only behind [`super::Level::Avx512`], which stands for the instructions used here.
#[derive(Debug)]
pub(crate) struct Avx512;

/// Sixteen floats from `at` on.
#[inline(always)]
fn load(floats: &[f32], at: usize) -> __m512 {
    let block: &[f32] = &floats[at..at + BLOCK];
    // SAFETY: the slice has 16 floats; the load needs no alignment. The CPU has AVX-512 (see `Avx512`).
    unsafe { _mm512_loadu_ps(block.as_ptr()) }
}

#[inline(always)]
fn store(floats: &mut [f32], at: usize, v: __m512) {
    let block: &mut [f32] = &mut floats[at..at + BLOCK];
    // SAFETY: as for `load`.
    unsafe { _mm512_storeu_ps(block.as_mut_ptr(), v) }
}

/// Operations of one instruction; see `Avx512` for when they may be used.
macro_rules! operations {
    ($($name:ident: $intrinsic:ident),*) => {$(
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            // SAFETY: the CPU has AVX-512 (see `Avx512`).
            unsafe { $intrinsic(self, other) }
        }
    )*};
}

impl Floats for __m512 {
    operations!(plus: _mm512_add_ps, minus: _mm512_sub_ps, times: _mm512_mul_ps, over: _mm512_div_ps, least: _mm512_min_ps, most: _mm512_max_ps);

    #[inline(always)]
    fn load(floats: &[f32], at: usize) -> Self {
        load(floats, at)
    }

    #[inline(always)]
    fn store(self, floats: &mut [f32], at: usize) {
        store(floats, at, self);
    }

    #[inline(always)]
    fn window(floats: &[f32; ROW], at: usize) -> [Self; 5] {
        shifted(&floats[at - BLOCK..at + 2 * BLOCK])
    }

    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: the CPU has AVX-512 (see `Avx512`).
        unsafe { _mm512_set1_ps(value) }
    }

    #[inline(always)]
    fn load_under(bits: u16, floats: &[f32], at: usize) -> Self {
        let block: &[f32] = &floats[at..at + BLOCK];
        // SAFETY: as for `load`.
        unsafe { _mm512_maskz_loadu_ps(bits, block.as_ptr()) }
    }

    #[inline(always)]
    fn above(self, other: Self) -> u16 {
        // SAFETY: the CPU has AVX-512 (see `Avx512`).
        unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self, other) }
    }

    #[inline(always)]
    fn or(self, bits: u16, other: Self) -> Self {
        // SAFETY: the CPU has AVX-512 (see `Avx512`).
        unsafe { _mm512_mask_mov_ps(other, bits, self) }
    }
}

/// The second block of three, and what lies one and two floats to either side of it: loads that do not lie on lines of the cache take twice as
/// long.
#[inline(always)]
fn shifted(blocks: &[f32]) -> [__m512; 5] {
    let (before, here, after) = (load(blocks, 0), load(blocks, BLOCK), load(blocks, 2 * BLOCK));
    // SAFETY: the CPU has AVX-512 (see `Avx512`).
    unsafe {
        let (before, here) = (_mm512_castps_si512(before), _mm512_castps_si512(here));
        let after = _mm512_castps_si512(after);
        [
            _mm512_castsi512_ps(_mm512_alignr_epi32::<14>(here, before)),
            _mm512_castsi512_ps(_mm512_alignr_epi32::<15>(here, before)),
            _mm512_castsi512_ps(here),
            _mm512_castsi512_ps(_mm512_alignr_epi32::<1>(after, here)),
            _mm512_castsi512_ps(_mm512_alignr_epi32::<2>(after, here)),
        ]
    }
}

/// centre * c + near * (b + d) + far * (a + e), in the order of the portable form.
#[inline(always)]
fn five_taps([a, b, c, d, e]: [__m512; 5], [centre, near, far]: [f32; 3]) -> __m512 {
    // SAFETY: the CPU has AVX-512 (see `Avx512`).
    unsafe {
        let centre = _mm512_mul_ps(_mm512_set1_ps(centre), c);
        let near = _mm512_mul_ps(_mm512_set1_ps(near), _mm512_add_ps(b, d));
        let far = _mm512_mul_ps(_mm512_set1_ps(far), _mm512_add_ps(a, e));
        _mm512_add_ps(_mm512_add_ps(centre, near), far)
    }
}

/// The mantissa of each lane, from high and low bits, times its unit.
#[inline(always)]
fn mantissa(high: __m512i, low: __m512i, unit: __m512) -> __m512 {
    // SAFETY: the CPU has AVX-512 (see `Avx512`).
    unsafe {
        let high = _mm512_and_si512(high, _mm512_set1_epi32(0x1ff << FINE));
        let bits = _mm512_or_si512(high, _mm512_and_si512(low, _mm512_set1_epi32(0x1f)));
        _mm512_mul_ps(_mm512_cvtepi32_ps(bits), unit)
    }
}

/// Eight words of a bit plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Words(__m512i);

impl Lanes for Words {
    const WORDS: usize = 8;

    #[inline(always)]
    fn load(plane: &[u64], at: usize) -> Self {
        let words: &[u64] = &plane[at..at + Self::WORDS];
        // SAFETY: the slice has eight words; the CPU has AVX-512 (see `Avx512`).
        Self(unsafe { _mm512_loadu_si512(words.as_ptr().cast()) })
    }

    #[inline(always)]
    fn store(self, plane: &mut [u64], at: usize) {
        let words: &mut [u64] = &mut plane[at..at + Self::WORDS];
        // SAFETY: as for `load`.
        unsafe { _mm512_storeu_si512(words.as_mut_ptr().cast(), self.0) }
    }

    #[inline(always)]
    fn ones() -> Self {
        // SAFETY: the CPU has AVX-512 (see `Avx512`), as in all that follow.
        Self(unsafe { _mm512_set1_epi64(-1) })
    }

    #[inline(always)]
    fn splat(word: u64) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm512_set1_epi64(word as i64) })
    }

    #[inline(always)]
    fn and(self, other: Self) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm512_and_si512(self.0, other.0) })
    }

    #[inline(always)]
    fn or(self, other: Self) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm512_or_si512(self.0, other.0) })
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm512_andnot_si512(other.0, self.0) })
    }

    #[inline(always)]
    fn up<const K: u32>(self) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm512_slli_epi64::<K>(self.0) })
    }

    #[inline(always)]
    fn down<const K: u32>(self) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm512_srli_epi64::<K>(self.0) })
    }
}

impl Masks for Avx512 {
    #[inline(always)]
    fn nonzero(bytes: &[u8; 64]) -> u64 {
        // SAFETY: the array is as long as the load; the CPU has AVX-512 (see `Avx512`).
        unsafe {
            let bytes = _mm512_loadu_si512(bytes.as_ptr().cast());
            _mm512_test_epi8_mask(bytes, bytes)
        }
    }

    #[inline(always)]
    fn multiple(bytes: &[u8; 64]) -> u64 {
        // SAFETY: as for `nonzero`.
        unsafe {
            let bytes = _mm512_loadu_si512(bytes.as_ptr().cast());
            _mm512_test_epi8_mask(bytes, _mm512_add_epi8(bytes, _mm512_set1_epi8(-1)))
        }
    }

    #[inline(always)]
    fn clear_codes(words: &mut [u16; 64]) -> u64 {
        let mut samples = 0;
        for half in [0, 32] {
            // SAFETY: 32 words lie behind `half` in the array; the CPU has AVX-512 (see `Avx512`).
            unsafe {
                let at = words[half..].as_mut_ptr();
                let words = _mm512_loadu_si512(at.cast());
                let kept = _mm512_and_si512(words, _mm512_set1_epi16(!EdgeCode::BITS as i16));
                _mm512_storeu_si512(at.cast(), kept);
                samples |= u64::from(_mm512_test_epi16_mask(words, _mm512_set1_epi16(SAMPLE as i16))) << half;
            }
        }
        samples
    }
}

/// The window of a block for taps under masks; `at` keeps off the ends of the rows by two floats at least.
struct Window<'a> {
    rows: [&'a TileRow; 5],
    at: usize,
    masks: &'a TapMasks,
    shift: usize,
}

impl Window<'_> {
    /// Adds the samples at one tap, and their number.
    #[inline(always)]
    fn add(&self, parts: &mut [__m512; CHANNELS], (column, row): (usize, usize)) {
        let mask = (self.masks[5 * row + column] >> self.shift) as u16;
        for (part, values) in parts.iter_mut().zip(&self.rows[row].0).take(CHANNELS - 1) {
            // SAFETY: two floats more on either side of the block lie in the row; the CPU has AVX-512 (see `Avx512`).
            unsafe {
                let values = _mm512_loadu_ps(values.as_ptr().add(self.at + column - 2));
                *part = _mm512_mask_add_ps(*part, mask, *part, values);
            }
        }
        let count = &mut parts[CHANNELS - 1];
        // SAFETY: the CPU has AVX-512 (see `Avx512`).
        *count = unsafe { _mm512_mask_add_ps(*count, mask, *count, _mm512_set1_ps(1.0)) };
    }
}

#[inline(always)]
fn weigh(sums: &mut [__m512; CHANNELS], weight: f32, parts: [__m512; CHANNELS]) {
    for (sum, part) in sums.iter_mut().zip(parts) {
        // SAFETY: the CPU has AVX-512 (see `Avx512`).
        *sum = unsafe { _mm512_add_ps(*sum, _mm512_mul_ps(_mm512_set1_ps(weight), part)) };
    }
}

impl Blocks for Avx512 {
    type Sums = [__m512; CHANNELS];
    type Floats = __m512;

    #[inline(always)]
    fn take(bits: u64, values: &[u32], from: isize, out: &mut [u32; 64]) {
        if bits == 0 {
            return;
        }
        let first = from + bits.trailing_zeros() as isize;
        let last = from + 63 - bits.leading_zeros() as isize;
        assert!(
            first >= 0 && (last as usize) < values.len(),
            "a value that is not there"
        );
        for (i, out) in out.as_chunks_mut::<BLOCK>().0.iter_mut().enumerate() {
            let mask = (bits >> (BLOCK * i)) as u16;
            // SAFETY: only values whose bit is set are read, and these are there, as was asked above; the pointer is used for nothing
            // else. `out` has sixteen values. The CPU has AVX-512 (see `Avx512`).
            unsafe {
                let before = _mm512_loadu_si512(out.as_ptr().cast());
                let from = values.as_ptr().wrapping_offset(from + (BLOCK * i) as isize);
                let after = _mm512_mask_loadu_epi32(before, mask, from.cast());
                _mm512_storeu_si512(out.as_mut_ptr().cast(), after);
            }
        }
    }

    #[inline(always)]
    fn all_are(bits: u64, values: &[u32], from: usize, value: u32) -> bool {
        if bits == 0 {
            return true;
        }
        let last = from + 63 - bits.leading_zeros() as usize;
        assert!(last < values.len(), "a value that is not there");
        let mut others = 0;
        for i in 0..64 / BLOCK {
            let mask = (bits >> (BLOCK * i)) as u16;
            // SAFETY: only values whose bit is set are read, and these are there, as was asked above; the pointer is used for nothing
            // else. The CPU has AVX-512 (see `Avx512`).
            unsafe {
                let values = values.as_ptr().wrapping_add(from + BLOCK * i);
                let found = _mm512_maskz_loadu_epi32(mask, values.cast());
                others |= _mm512_mask_cmpneq_epi32_mask(mask, found, _mm512_set1_epi32(value as i32));
            }
        }
        others == 0
    }

    #[inline(always)]
    fn unpack((words, colours, cache): PackedBlock<'_>, row: &mut TileRow, at: usize) {
        // SAFETY: the arrays are as long as the loads. The CPU has AVX-512 (see `Avx512`).
        let channels = unsafe {
            let packed = _mm512_loadu_si512(colours.as_ptr().cast());
            let fine = _mm512_loadu_si512(cache.as_ptr().cast());
            let exponent = _mm512_add_epi32(_mm512_srli_epi32::<27>(packed), _mm512_set1_epi32(127 - 25));
            let unit = _mm512_castsi512_ps(_mm512_slli_epi32::<23>(exponent));
            let words = _mm256_loadu_si256(words.as_ptr().cast());
            let present = _mm256_test_epi16_mask(words, _mm256_set1_epi16(SAMPLE as i16));
            [
                mantissa(_mm512_slli_epi32::<FINE>(packed), fine, unit),
                mantissa(
                    _mm512_srli_epi32::<{ 9 - FINE }>(packed),
                    _mm512_srli_epi32::<FINE>(fine),
                    unit,
                ),
                mantissa(
                    _mm512_srli_epi32::<{ 18 - FINE }>(packed),
                    _mm512_srli_epi32::<{ 2 * FINE }>(fine),
                    unit,
                ),
                _mm512_maskz_mov_ps(present, _mm512_set1_ps(1.0)),
            ]
        };
        for (row, channel) in row.0.iter_mut().zip(channels) {
            store(row, at, channel);
        }
    }

    #[inline(always)]
    fn down(rows: [&TileRow; 5], at: usize, taps: [f32; 3], out: &mut TileRow) {
        for (channel, out) in out.0.iter_mut().enumerate() {
            let [a, b, c, d, e] = rows;
            let window = [
                load(&a.0[channel], at),
                load(&b.0[channel], at),
                load(&c.0[channel], at),
                load(&d.0[channel], at),
                load(&e.0[channel], at),
            ];
            store(out, at, five_taps(window, taps));
        }
    }

    #[inline(always)]
    fn across(row: &TileRow, at: usize, taps: [f32; 3]) -> Self::Sums {
        // SAFETY: the CPU has AVX-512 (see `Avx512`).
        let mut sums = unsafe { [_mm512_setzero_ps(); CHANNELS] };
        for (row, sum) in row.0.iter().zip(&mut sums) {
            *sum = five_taps(shifted(&row[at - BLOCK..at + 2 * BLOCK]), taps);
        }
        sums
    }

    #[inline(always)]
    fn masked(rows: [&TileRow; 5], at: usize, masks: &TapMasks, shift: usize, kernel: &Kernel) -> Self::Sums {
        assert!(
            (BLOCK..=ROW - 2 * BLOCK).contains(&at),
            "blocks lie between the margins"
        );
        let window = Window {
            rows,
            at,
            masks,
            shift,
        };
        // SAFETY: the CPU has AVX-512 (see `Avx512`).
        let nothing = unsafe { [_mm512_setzero_ps(); CHANNELS] };
        let (mut sums, mut centre) = (nothing, nothing);
        window.add(&mut centre, (2, 2));
        weigh(&mut sums, kernel.weight(0, 0), centre);
        for pair in &TAP_GROUPS {
            let (mut first, mut second) = (nothing, nothing);
            for (&one, &other) in pair[0].iter().zip(&pair[1]) {
                window.add(&mut first, one);
                window.add(&mut second, other);
            }
            let weights = group_weights(kernel, pair);
            weigh(&mut sums, weights[0], first);
            weigh(&mut sums, weights[1], second);
        }
        sums
    }

    #[inline(always)]
    fn finish(sums: Self::Sums, own: u16, out: Output<'_>, scale: f32, fallback: [f32; 3]) -> u16 {
        let [red, green, blue, weight] = sums;
        // SAFETY: the output arrays are as long as the stores. The CPU has AVX-512 (see `Avx512`).
        unsafe {
            let one = _mm512_set1_ps(1.0);
            let coloured = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(weight, _mm512_setzero_ps());
            let inverse = _mm512_div_ps(one, weight);
            store(out.inverse, 0, inverse);
            let channels = [(red, out.red), (green, out.green), (blue, out.blue)];
            for ((sum, out), fallback) in channels.into_iter().zip(fallback) {
                let colour = _mm512_mul_ps(sum, inverse);
                store(
                    out,
                    0,
                    _mm512_mask_blend_ps(coloured, _mm512_set1_ps(fallback), colour),
                );
            }
            let priority = _mm512_sub_ps(
                _mm512_set1_ps(254.0),
                _mm512_mul_ps(_mm512_set1_ps(scale), weight),
            );
            let priority = _mm512_cvttps_epi32(_mm512_max_ps(priority, one));
            let priority = _mm512_maskz_mov_epi32(!own, priority);
            let unreached = _mm512_set1_epi32(i32::from(crate::picture::UNREACHED));
            let priority = _mm512_mask_blend_epi32(coloured, unreached, priority);
            _mm_storeu_si128(out.priority.as_mut_ptr().cast(), _mm512_cvtepi32_epi8(priority));
            coloured
        }
    }
}
