//! AVX2: eight pixels in a register, two registers for a block.
#![expect(
    unsafe_code,
    reason = "intrinsics and unaligned loads; every block says why it is sound"
)]

use std::arch::x86_64::*;

use glam::Vec3;

use crate::board::Board;
use crate::classify::Masks;
use crate::code::EdgeCode;
use crate::colour::FINE;
use crate::complex::{self, BLOCKS, Cells, LANES, Reached, Sums, WEIGHTS};
use crate::fit::Floats;
use crate::interpolate::{
    BLOCK, Blocks, CHANNELS, Output, PackedBlock, ROW, TAP_GROUPS, TapMasks, TileRow, group_weights,
};
use crate::kernel::Kernel;
use crate::lanes::Lanes;
use crate::pixels::{SAMPLE, SAMPLE_SHIFT};

/// To be used only behind [`super::Level::Avx2`], which stands for the instructions used here.
#[derive(Debug)]
pub(crate) struct Avx2;

/// Floats in a register.
const WIDTH: usize = 8;

/// Operations of one instruction on either half; see `Avx2` for when they may be used.
macro_rules! operations {
    ($($name:ident: $intrinsic:ident),*) => {$(
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            // SAFETY: the CPU has AVX2 (see `Avx2`).
            unsafe { [$intrinsic(self[0], other[0]), $intrinsic(self[1], other[1])] }
        }
    )*};
}

/// All bits of the lanes whose bit is set, for either half.
#[inline(always)]
fn lanes_of(bits: u16) -> [__m256; 2] {
    // SAFETY: the CPU has AVX2 (see `Avx2`).
    unsafe {
        let lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let half = |bits: u16| {
            let bits = _mm256_and_si256(_mm256_set1_epi32(i32::from(bits)), lane);
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(bits, lane))
        };
        [half(bits), half(bits >> 8)]
    }
}

impl Floats for [__m256; 2] {
    operations!(plus: _mm256_add_ps, minus: _mm256_sub_ps, times: _mm256_mul_ps, over: _mm256_div_ps, least: _mm256_min_ps, most: _mm256_max_ps);

    #[inline(always)]
    fn load(floats: &[f32], at: usize) -> Self {
        [load(floats, at), load(floats, at + WIDTH)]
    }

    #[inline(always)]
    fn store(self, floats: &mut [f32], at: usize) {
        store(floats, at, self[0]);
        store(floats, at + WIDTH, self[1]);
    }

    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        unsafe { [_mm256_set1_ps(value); 2] }
    }

    #[inline(always)]
    fn load_under(bits: u16, floats: &[f32], at: usize) -> Self {
        let ([a, b], [low, high]) = (Self::load(floats, at), lanes_of(bits));
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        unsafe { [_mm256_and_ps(low, a), _mm256_and_ps(high, b)] }
    }

    #[inline(always)]
    fn above(self, other: Self) -> u16 {
        let ([a, b], [c, d]) = (self, other);
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        let [low, high] = unsafe {
            [
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(a, c)),
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(b, d)),
            ]
        };
        (low | high << 8) as u16
    }

    #[inline(always)]
    fn or(self, bits: u16, other: Self) -> Self {
        let [low, high] = lanes_of(bits);
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        unsafe {
            [
                _mm256_blendv_ps(other[0], self[0], low),
                _mm256_blendv_ps(other[1], self[1], high),
            ]
        }
    }
}

/// Eight floats from `at` on.
#[inline(always)]
fn load(floats: &[f32], at: usize) -> __m256 {
    let block: &[f32] = &floats[at..at + WIDTH];
    // SAFETY: the slice has eight floats; the load needs no alignment. The CPU has AVX2 (see `Avx2`).
    unsafe { _mm256_loadu_ps(block.as_ptr()) }
}

#[inline(always)]
fn store(floats: &mut [f32], at: usize, v: __m256) {
    let block: &mut [f32] = &mut floats[at..at + WIDTH];
    // SAFETY: as for `load`.
    unsafe { _mm256_storeu_ps(block.as_mut_ptr(), v) }
}

/// centre * c + near * (b + d) + far * (a + e), in the order of the portable form.
#[inline(always)]
fn five_taps([a, b, c, d, e]: [__m256; 5], [centre, near, far]: [f32; 3]) -> __m256 {
    // SAFETY: the CPU has AVX2 (see `Avx2`).
    unsafe {
        let centre = _mm256_mul_ps(_mm256_set1_ps(centre), c);
        let near = _mm256_mul_ps(_mm256_set1_ps(near), _mm256_add_ps(b, d));
        let far = _mm256_mul_ps(_mm256_set1_ps(far), _mm256_add_ps(a, e));
        _mm256_add_ps(_mm256_add_ps(centre, near), far)
    }
}

/// [`FINE`] as these instructions want it.
const LOW: i32 = FINE as i32;

/// The mantissa of each lane, from high and low bits, times its unit.
#[inline(always)]
fn mantissa(high: __m256i, low: __m256i, unit: __m256) -> __m256 {
    // SAFETY: the CPU has AVX2 (see `Avx2`).
    unsafe {
        let high = _mm256_and_si256(high, _mm256_set1_epi32(0x1ff << FINE));
        let bits = _mm256_or_si256(high, _mm256_and_si256(low, _mm256_set1_epi32(0x1f)));
        _mm256_mul_ps(_mm256_cvtepi32_ps(bits), unit)
    }
}

/// All bits of a lane set where its bit of `bits` is.
#[inline(always)]
fn lanes(bits: u8) -> __m256 {
    // SAFETY: the CPU has AVX2 (see `Avx2`).
    unsafe {
        let each = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let bits = _mm256_and_si256(_mm256_set1_epi32(i32::from(bits)), each);
        _mm256_castsi256_ps(_mm256_cmpeq_epi32(bits, each))
    }
}

/// Four words of a bit plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Words(__m256i);

impl Lanes for Words {
    const WORDS: usize = 4;

    #[inline(always)]
    fn load(plane: &[u64], at: usize) -> Self {
        let words: &[u64] = &plane[at..at + Self::WORDS];
        // SAFETY: the slice has four words; the CPU has AVX2 (see `Avx2`).
        Self(unsafe { _mm256_loadu_si256(words.as_ptr().cast()) })
    }

    #[inline(always)]
    fn store(self, plane: &mut [u64], at: usize) {
        let words: &mut [u64] = &mut plane[at..at + Self::WORDS];
        // SAFETY: as for `load`.
        unsafe { _mm256_storeu_si256(words.as_mut_ptr().cast(), self.0) }
    }

    #[inline(always)]
    fn ones() -> Self {
        // SAFETY: the CPU has AVX2 (see `Avx2`), as in all that follow.
        Self(unsafe { _mm256_set1_epi64x(-1) })
    }

    #[inline(always)]
    fn splat(word: u64) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm256_set1_epi64x(word as i64) })
    }

    #[inline(always)]
    fn and(self, other: Self) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm256_and_si256(self.0, other.0) })
    }

    #[inline(always)]
    fn or(self, other: Self) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm256_or_si256(self.0, other.0) })
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        // SAFETY: see `ones`.
        Self(unsafe { _mm256_andnot_si256(other.0, self.0) })
    }

    #[inline(always)]
    fn up<const K: u32>(self) -> Self {
        // SAFETY: see `ones`; a count in a register, for the immediate has another type here.
        Self(unsafe { _mm256_sll_epi64(self.0, _mm_cvtsi32_si128(K as i32)) })
    }

    #[inline(always)]
    fn down<const K: u32>(self) -> Self {
        // SAFETY: see `up`.
        Self(unsafe { _mm256_srl_epi64(self.0, _mm_cvtsi32_si128(K as i32)) })
    }
}

/// Applies a function to two halves of 32 bytes and joins the signs of the bytes that come out.
#[inline(always)]
fn halves(bytes: &[u8; 64], zero_where: impl Fn(__m256i) -> __m256i) -> u64 {
    let mut bits = 0;
    for half in [0, 32] {
        // SAFETY: 32 bytes lie behind `half`; the CPU has AVX2 (see `Avx2`).
        unsafe {
            let bytes = _mm256_loadu_si256(bytes[half..].as_ptr().cast());
            let zero = _mm256_cmpeq_epi8(zero_where(bytes), _mm256_setzero_si256());
            bits |= u64::from(!_mm256_movemask_epi8(zero) as u32) << half;
        }
    }
    bits
}

impl Masks for Avx2 {
    #[inline(always)]
    fn nonzero(bytes: &[u8; 64]) -> u64 {
        halves(bytes, |bytes| bytes)
    }

    #[inline(always)]
    fn multiple(bytes: &[u8; 64]) -> u64 {
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        halves(bytes, |bytes| unsafe {
            _mm256_and_si256(bytes, _mm256_add_epi8(bytes, _mm256_set1_epi8(-1)))
        })
    }

    #[inline(always)]
    fn clear_codes(words: &mut [u16; 64]) -> u64 {
        let mut samples = 0;
        for part in [0, 32] {
            // SAFETY: 32 words lie behind `part`; the CPU has AVX2 (see `Avx2`).
            unsafe {
                let at: *mut __m256i = words[part..].as_mut_ptr().cast();
                let (low, high) = (_mm256_loadu_si256(at), _mm256_loadu_si256(at.add(1)));
                let keep = _mm256_set1_epi16(!EdgeCode::BITS as i16);
                _mm256_storeu_si256(at, _mm256_and_si256(low, keep));
                _mm256_storeu_si256(at.add(1), _mm256_and_si256(high, keep));
                // The sample bit to the sign, 16-bit signs to byte signs; packing works in 128-bit lanes, so put these in order.
                let to_sign = 15 - SAMPLE_SHIFT as i32;
                let shift = _mm_cvtsi32_si128(to_sign);
                let signs = _mm256_packs_epi16(
                    _mm256_srai_epi16::<15>(_mm256_sll_epi16(low, shift)),
                    _mm256_srai_epi16::<15>(_mm256_sll_epi16(high, shift)),
                );
                let signs = _mm256_permute4x64_epi64::<0b11_01_10_00>(signs);
                samples |= u64::from(_mm256_movemask_epi8(signs) as u32) << part;
            }
        }
        samples
    }
}

impl Cells for Avx2 {
    type Reached = Reached;
    type Met = [__m256i; 2];
    type Sums = [__m256; 4];

    #[inline(always)]
    fn spread(board: &Board, starts: &[u64; LANES]) -> Reached {
        complex::spread::<Words>(board, starts)
    }

    #[inline(always)]
    fn meet(reached: Reached, (a, b): (u64, u64)) -> [__m256i; 2] {
        // SAFETY: four lanes lie behind either half of the arrays; the CPU has AVX2 (see `Avx2`).
        unsafe {
            let (a, b) = (_mm256_set1_epi64x(a as i64), _mm256_set1_epi64x(b as i64));
            let mut met = [_mm256_setzero_si256(); 2];
            for (met, half) in met.iter_mut().zip([0, 4]) {
                let in_a = _mm256_loadu_si256(reached.a[half..].as_ptr().cast());
                let in_b = _mm256_loadu_si256(reached.b[half..].as_ptr().cast());
                *met = _mm256_or_si256(_mm256_and_si256(in_a, a), _mm256_and_si256(in_b, b));
            }
            met
        }
    }

    #[inline(always)]
    fn nothing() -> Self::Sums {
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        unsafe { [_mm256_setzero_ps(); 4] }
    }

    #[inline(always)]
    fn lend([low, high]: [__m256i; 2], pixel: usize, colour: Vec3, sums: &mut Self::Sums) {
        // SAFETY: the weights of a pixel have eight lanes; the CPU has AVX2 (see `Avx2`).
        unsafe {
            let block = _mm256_set1_epi64x(BLOCKS[pixel] as i64);
            let zero = _mm256_setzero_si256();
            let low = _mm256_cmpeq_epi64(_mm256_and_si256(low, block), zero);
            let high = _mm256_cmpeq_epi64(_mm256_and_si256(high, block), zero);
            // One half of each 64-bit mask; shuffling works in 128-bit lanes, so put these in order.
            let (low, high) = (_mm256_castsi256_ps(low), _mm256_castsi256_ps(high));
            let missed = _mm256_shuffle_ps::<0b10_00_10_00>(low, high);
            let missed = _mm256_permute4x64_pd::<0b11_01_10_00>(_mm256_castps_pd(missed));
            let missed = _mm256_castpd_ps(missed);
            let weights = _mm256_loadu_ps(WEIGHTS[pixel].as_ptr());
            let lent = |part| _mm256_andnot_ps(missed, _mm256_mul_ps(weights, _mm256_set1_ps(part)));
            let [red, green, blue, all] = sums;
            *red = _mm256_add_ps(*red, lent(colour.x));
            *green = _mm256_add_ps(*green, lent(colour.y));
            *blue = _mm256_add_ps(*blue, lent(colour.z));
            *all = _mm256_add_ps(*all, _mm256_andnot_ps(missed, weights));
        }
    }

    #[inline(always)]
    fn sums(sums: Self::Sums) -> Sums {
        let mut out = [[0.0; LANES]; 4];
        for (out, sum) in out.iter_mut().zip(sums) {
            // SAFETY: eight lanes; the CPU has AVX2 (see `Avx2`).
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), sum) };
        }
        out
    }
}

/// The window of eight pixels for taps under masks; `at` keeps off the ends of the rows by two floats at least.
struct Window<'a> {
    rows: [&'a TileRow; 5],
    at: usize,
    masks: &'a TapMasks,
    shift: usize,
}

impl Window<'_> {
    /// Adds the samples at one tap, and their number.
    #[inline(always)]
    fn add(&self, parts: &mut [__m256; CHANNELS], (column, row): (usize, usize)) {
        let mask = lanes((self.masks[5 * row + column] >> self.shift) as u8);
        for (part, values) in parts.iter_mut().zip(&self.rows[row].0).take(CHANNELS - 1) {
            // SAFETY: two floats more on either side of the block lie in the row; the CPU has AVX2 (see `Avx2`).
            unsafe {
                let values = _mm256_loadu_ps(values.as_ptr().add(self.at + column - 2));
                *part = _mm256_add_ps(*part, _mm256_and_ps(mask, values));
            }
        }
        let count = &mut parts[CHANNELS - 1];
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        *count = unsafe { _mm256_add_ps(*count, _mm256_and_ps(mask, _mm256_set1_ps(1.0))) };
    }
}

#[inline(always)]
fn weigh(sums: &mut [__m256; CHANNELS], weight: f32, parts: [__m256; CHANNELS]) {
    for (sum, part) in sums.iter_mut().zip(parts) {
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        *sum = unsafe { _mm256_add_ps(*sum, _mm256_mul_ps(_mm256_set1_ps(weight), part)) };
    }
}

impl Blocks for Avx2 {
    type Sums = [[__m256; 2]; CHANNELS];
    type Floats = [__m256; 2];

    #[inline(always)]
    fn unpack((words, colours, cache): PackedBlock<'_>, row: &mut TileRow, at: usize) {
        for half in [0, WIDTH] {
            // SAFETY: eight pixels lie behind `half` in the arrays. The CPU has AVX2 (see `Avx2`).
            let channels = unsafe {
                let packed = _mm256_loadu_si256(colours[half..].as_ptr().cast());
                let fine = _mm256_loadu_si256(cache[half..].as_ptr().cast());
                let exponent = _mm256_add_epi32(_mm256_srli_epi32::<27>(packed), _mm256_set1_epi32(127 - 25));
                let unit = _mm256_castsi256_ps(_mm256_slli_epi32::<23>(exponent));
                let words = _mm256_cvtepu16_epi32(_mm_loadu_si128(words[half..].as_ptr().cast()));
                let sample = _mm256_set1_epi32(i32::from(SAMPLE));
                let present = _mm256_cmpeq_epi32(_mm256_and_si256(words, sample), sample);
                [
                    mantissa(_mm256_slli_epi32::<LOW>(packed), fine, unit),
                    mantissa(
                        _mm256_srli_epi32::<{ 9 - LOW }>(packed),
                        _mm256_srli_epi32::<LOW>(fine),
                        unit,
                    ),
                    mantissa(
                        _mm256_srli_epi32::<{ 18 - LOW }>(packed),
                        _mm256_srli_epi32::<{ 2 * LOW }>(fine),
                        unit,
                    ),
                    _mm256_and_ps(_mm256_castsi256_ps(present), _mm256_set1_ps(1.0)),
                ]
            };
            for (row, channel) in row.0.iter_mut().zip(channels) {
                store(row, at + half, channel);
            }
        }
    }

    #[inline(always)]
    fn down(rows: [&TileRow; 5], at: usize, taps: [f32; 3], out: &mut TileRow) {
        for (channel, out) in out.0.iter_mut().enumerate() {
            for at in [at, at + WIDTH] {
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
    }

    #[inline(always)]
    fn across(row: &TileRow, at: usize, taps: [f32; 3]) -> Self::Sums {
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        let mut sums = unsafe { [[_mm256_setzero_ps(); 2]; CHANNELS] };
        for (row, sums) in row.0.iter().zip(&mut sums) {
            let row = &row[at - 2..at + BLOCK + 2];
            for (sum, i) in sums.iter_mut().zip([0, WIDTH]) {
                let window = [
                    load(row, i),
                    load(row, i + 1),
                    load(row, i + 2),
                    load(row, i + 3),
                    load(row, i + 4),
                ];
                *sum = five_taps(window, taps);
            }
        }
        sums
    }

    #[inline(always)]
    fn masked(rows: [&TileRow; 5], at: usize, masks: &TapMasks, shift: usize, kernel: &Kernel) -> Self::Sums {
        assert!(
            (BLOCK..=ROW - 2 * BLOCK).contains(&at),
            "blocks lie between the margins"
        );
        // SAFETY: the CPU has AVX2 (see `Avx2`).
        let mut all = unsafe { [[_mm256_setzero_ps(); 2]; CHANNELS] };
        for half in 0..2 {
            let window = Window {
                rows,
                at: at + half * WIDTH,
                masks,
                shift: shift + half * WIDTH,
            };
            // SAFETY: see above.
            let nothing = unsafe { [_mm256_setzero_ps(); CHANNELS] };
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
            for (all, sum) in all.iter_mut().zip(sums) {
                all[half] = sum;
            }
        }
        all
    }

    #[inline(always)]
    fn finish(sums: Self::Sums, own: u16, out: Output<'_>, scale: f32, fallback: [f32; 3]) -> u16 {
        let [red, green, blue, weight] = sums;
        let mut coloured = 0;
        for half in [0, WIDTH] {
            let i = half / WIDTH;
            let weight = weight[i];
            // SAFETY: the CPU has AVX2 (see `Avx2`); eight bytes lie behind `half` in the priorities.
            unsafe {
                let one = _mm256_set1_ps(1.0);
                let some = _mm256_cmp_ps::<_CMP_GT_OQ>(weight, _mm256_setzero_ps());
                let inverse = _mm256_div_ps(one, weight);
                store(out.inverse, half, inverse);
                let channels = [
                    (red, &mut *out.red),
                    (green, &mut *out.green),
                    (blue, &mut *out.blue),
                ];
                for ((sum, out), fallback) in channels.into_iter().zip(fallback) {
                    let colour = _mm256_mul_ps(sum[i], inverse);
                    store(
                        out,
                        half,
                        _mm256_blendv_ps(_mm256_set1_ps(fallback), colour, some),
                    );
                }
                let priority = _mm256_sub_ps(
                    _mm256_set1_ps(254.0),
                    _mm256_mul_ps(_mm256_set1_ps(scale), weight),
                );
                let priority = _mm256_cvttps_epi32(_mm256_max_ps(priority, one));
                let own = _mm256_castps_si256(lanes((own >> half) as u8));
                let priority = _mm256_andnot_si256(own, priority);
                let unreached = _mm256_set1_epi32(i32::from(crate::picture::UNREACHED));
                let priority = _mm256_blendv_epi8(unreached, priority, _mm256_castps_si256(some));
                // Eight times 32 bits to eight bytes, through both 128-bit lanes.
                let words = _mm256_packus_epi32(priority, priority);
                let bytes = _mm256_packus_epi16(words, words);
                let low = _mm256_castsi256_si128(bytes);
                let high = _mm256_extracti128_si256::<1>(bytes);
                _mm_storel_epi64(
                    out.priority[half..].as_mut_ptr().cast(),
                    _mm_unpacklo_epi32(low, high),
                );
                coloured |= (_mm256_movemask_ps(some) as u16 & 0xff) << half;
            }
        }
        coloured
    }
}
