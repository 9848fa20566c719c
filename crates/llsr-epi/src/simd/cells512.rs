//! The complex filter with AVX-512.
//!
//! What a lane reaches lies in the 5x5 cells around its own. Boards whose rows have six bits instead of eight, moved so that the lane's
//! window begins at bit 0, hold these in 32 bits: eight lanes in half a register.
#![expect(
    unsafe_code,
    reason = "intrinsics and unaligned loads; every block says why it is sound"
)]

use std::arch::x86_64::*;

use glam::Vec3;

use super::avx512::Avx512;
use crate::board::{Board, CELLS, Sides};
use crate::complex::{BLOCKS, Cells, LANES, Sums, WEIGHTS};
use crate::crossings::Crossings;

/// Bits of a row of a window.
const PITCH: i32 = 6;
/// Where the windows of the lanes begin on a board with such rows.
const SHIFTS: [i64; LANES] = [0, 0, 1, 1, 6, 6, 7, 7];
/// Five rows of five bits.
const WINDOW: i32 = 0x1f | 0x1f << PITCH | 0x1f << (2 * PITCH) | 0x1f << (3 * PITCH) | 0x1f << (4 * PITCH);
/// The lane's own cell.
const CENTRE: i32 = 2 * PITCH + 2;
/// [`BLOCKS`] as the lanes see them.
const BLOCK_WINDOWS: [[u32; LANES]; 9] = block_windows();

const fn block_windows() -> [[u32; LANES]; 9] {
    let mut windows = [[0; LANES]; 9];
    let mut pixel = 0;
    while pixel < 9 {
        // From rows of eight bits to rows of six.
        let (mut board, mut row) = (0, 0);
        while row < 6 {
            board |= (BLOCKS[pixel] >> (8 * row) & 0x3f) << (PITCH * row);
            row += 1;
        }
        let mut lane = 0;
        while lane < LANES {
            windows[pixel][lane] = (board >> SHIFTS[lane]) as u32 & WINDOW as u32;
            lane += 1;
        }
        pixel += 1;
    }
    windows
}

/// Boards as the lanes see them; beyond the window there may be more.
#[inline(always)]
fn windows<const N: usize>(boards: [u64; N]) -> [__m256i; N] {
    // SAFETY: there are eight shifts; the CPU has AVX-512 (see `Avx512`).
    unsafe {
        let shifts = _mm512_loadu_si512(SHIFTS.as_ptr().cast());
        let mut windows = [_mm256_setzero_si256(); N];
        for (window, board) in windows.iter_mut().zip(boards) {
            let board = _mm512_set1_epi64(_pext_u64(board, CELLS) as i64);
            *window = _mm512_cvtepi64_epi32(_mm512_srlv_epi64(board, shifts));
        }
        windows
    }
}

/// The links of a board, for all lanes: A to A, A to B, B to A, B to B.
struct Links {
    right: [__m256i; 4],
    down: [__m256i; 4],
}

impl Links {
    /// Regions A and B reached in one quadrant; four steps lead to its far corner. What lies beyond the window may be reached, too,
    /// but leads no more into it.
    #[inline(always)]
    fn quadrant<const RIGHT: bool, const DOWN: bool>(&self, start: [__m256i; 2]) -> [__m256i; 2] {
        let [mut a, mut b] = start;
        for _ in 0..4 {
            let beside = step::<1, RIGHT>(&self.right, a, b);
            let beyond = step::<PITCH, DOWN>(&self.down, a, b);
            // SAFETY: the CPU has AVX-512 (see `Avx512`).
            unsafe {
                a = _mm256_or_si256(a, _mm256_or_si256(beside[0], beyond[0]));
                b = _mm256_or_si256(b, _mm256_or_si256(beside[1], beyond[1]));
            }
        }
        [a, b]
    }
}

/// The regions that links lead to, a step along them or against them.
#[inline(always)]
fn step<const BITS: i32, const ALONG: bool>(
    [aa, ab, ba, bb]: &[__m256i; 4],
    a: __m256i,
    b: __m256i,
) -> [__m256i; 2] {
    // SAFETY: the CPU has AVX-512 (see `Avx512`).
    unsafe {
        if ALONG {
            let to_a = _mm256_or_si256(_mm256_and_si256(a, *aa), _mm256_and_si256(b, *ba));
            let to_b = _mm256_or_si256(_mm256_and_si256(a, *ab), _mm256_and_si256(b, *bb));
            [_mm256_slli_epi32::<BITS>(to_a), _mm256_slli_epi32::<BITS>(to_b)]
        } else {
            let (a, b) = (_mm256_srli_epi32::<BITS>(a), _mm256_srli_epi32::<BITS>(b));
            let to_a = _mm256_or_si256(_mm256_and_si256(a, *aa), _mm256_and_si256(b, *ab));
            let to_b = _mm256_or_si256(_mm256_and_si256(a, *ba), _mm256_and_si256(b, *bb));
            [to_a, to_b]
        }
    }
}

/// Four bytes.
///
/// # Safety
/// `at` and the three bytes behind it must lie in one piece of memory.
#[inline(always)]
unsafe fn four_bytes(at: *const u8) -> __m128i {
    // SAFETY: as the caller promises.
    unsafe { _mm_cvtsi32_si128(at.cast::<i32>().read_unaligned()) }
}

impl Cells for Avx512 {
    type Reached = [__m256i; 2];
    type Met = __m256i;
    type Sums = [__m256; 4];

    #[inline(always)]
    fn sides(crossings: &Crossings, x: usize, y: usize) -> Sides {
        let (stride, pitch) = (crossings.stride, crossings.stride + 1);
        if x == 0 || y == 0 || x + 1 >= crossings.width || y + 1 >= crossings.height {
            return Sides::around::<Self>(crossings, x, y);
        }
        let across = 2 * (y - 1) * stride + x - 1;
        let down = 2 * (y - 1) * pitch + x - 1;
        // Four bytes are read of each line, of some one more than needed.
        let ends = (across + 6 * stride + 4, down + 5 * pitch + 4);
        if ends.0 > crossings.horizontal.len() || ends.1 > crossings.vertical.len() {
            return Sides::around::<Self>(crossings, x, y);
        }
        // SAFETY: the last four bytes of either kind lie in the memory of the lines, as was just asked; the others lie before.
        // The CPU has AVX-512 (see `Avx512`).
        unsafe {
            let at = crossings.horizontal.as_ptr().add(across);
            let two = |line: usize| {
                let next = four_bytes(at.add((line + 1) * stride));
                _mm_unpacklo_epi64(four_bytes(at.add(line * stride)), next)
            };
            let last = four_bytes(at.add(6 * stride));
            let first_four = _mm256_inserti128_si256::<1>(_mm256_castsi128_si256(two(0)), two(2));
            let last_three = _mm256_inserti128_si256::<1>(_mm256_castsi128_si256(two(4)), last);
            let lines = _mm512_inserti64x4::<1>(_mm512_castsi256_si512(first_four), last_three);
            // Either half of the three bytes of a line in a byte for itself.
            let twice = _mm512_set4_epi32(
                0xffff_0a0au32 as i32,
                0x0909_0808,
                0xffff_0202u32 as i32,
                0x0101_0000,
            );
            let halves = _mm512_set4_epi32(
                0x0000_f00f,
                0xf00f_f00fu32 as i32,
                0x0000_f00f,
                0xf00f_f00fu32 as i32,
            );
            let lines = _mm512_and_si512(_mm512_shuffle_epi8(lines, twice), halves);

            let at = crossings.vertical.as_ptr().add(down);
            // Whole and half lines in turn, once for the upper half of each and once for the lower.
            let both = |row: usize| {
                let at = at.add(2 * row * pitch);
                let alternate = _mm_unpacklo_epi8(four_bytes(at), four_bytes(at.add(pitch)));
                _mm_unpacklo_epi64(alternate, alternate)
            };
            let first_two = _mm256_inserti128_si256::<1>(_mm256_castsi128_si256(both(0)), both(1));
            let last = _mm256_zextsi128_si256(both(2));
            let columns = _mm512_inserti64x4::<1>(_mm512_castsi256_si512(first_two), last);
            let halves = _mm512_set4_epi32(0x00f0_f0f0, 0xf0f0_f0f0u32 as i32, 0x000f_0f0f, 0x0f0f_0f0f);
            let columns = _mm512_and_si512(columns, halves);

            let less = _mm512_set1_epi8(-1);
            Sides {
                lines: _mm512_test_epi8_mask(lines, lines),
                columns: _mm512_test_epi8_mask(columns, columns),
                many_lines: _mm512_test_epi8_mask(lines, _mm512_add_epi8(lines, less)),
                many_columns: _mm512_test_epi8_mask(columns, _mm512_add_epi8(columns, less)),
                outside: 0,
            }
        }
    }

    #[inline(always)]
    fn spread(board: &Board, starts: &[u64; LANES]) -> [__m256i; 2] {
        // SAFETY: there are eight starts; the CPU has AVX-512 (see `Avx512`).
        unsafe {
            let links = Links {
                right: windows(board.right),
                down: windows(board.down),
            };
            let starts = _mm512_loadu_si512(starts.as_ptr().cast());
            let there = _mm512_test_epi64_mask(starts, starts);
            let centre = _mm256_set1_epi32(1 << CENTRE);
            let start = [
                _mm256_maskz_mov_epi32(there & 0x55, centre),
                _mm256_maskz_mov_epi32(there & 0xaa, centre),
            ];
            let right_down = links.quadrant::<true, true>(start);
            let right_up = links.quadrant::<true, false>(start);
            let left_down = links.quadrant::<false, true>(start);
            let left_up = links.quadrant::<false, false>(start);
            let mut reached = start;
            for (region, all) in reached.iter_mut().enumerate() {
                let right = _mm256_or_si256(right_down[region], right_up[region]);
                let left = _mm256_or_si256(left_down[region], left_up[region]);
                *all = _mm256_and_si256(_mm256_or_si256(right, left), _mm256_set1_epi32(WINDOW));
            }
            reached
        }
    }

    #[inline(always)]
    fn meet([in_a, in_b]: [__m256i; 2], (a, b): (u64, u64)) -> __m256i {
        // SAFETY: the CPU has AVX-512 (see `Avx512`).
        unsafe {
            let [a, b] = windows([a, b]);
            _mm256_or_si256(_mm256_and_si256(in_a, a), _mm256_and_si256(in_b, b))
        }
    }

    #[inline(always)]
    fn nothing() -> Self::Sums {
        // SAFETY: the CPU has AVX-512 (see `Avx512`).
        unsafe { [_mm256_setzero_ps(); 4] }
    }

    #[inline(always)]
    fn lend(met: __m256i, pixel: usize, colour: Vec3, sums: &mut Self::Sums) {
        // SAFETY: the tables have eight lanes for each pixel; the CPU has AVX-512 (see `Avx512`).
        unsafe {
            let block = _mm256_loadu_si256(BLOCK_WINDOWS[pixel].as_ptr().cast());
            let lanes = _mm256_test_epi32_mask(met, block);
            let weights = _mm256_loadu_ps(WEIGHTS[pixel].as_ptr());
            let [red, green, blue, all] = sums;
            for (sum, part) in [(red, colour.x), (green, colour.y), (blue, colour.z)] {
                let lent = _mm256_mul_ps(weights, _mm256_set1_ps(part));
                *sum = _mm256_mask_add_ps(*sum, lanes, *sum, lent);
            }
            *all = _mm256_mask_add_ps(*all, lanes, *all, weights);
        }
    }

    #[inline(always)]
    fn sums(sums: Self::Sums) -> Sums {
        let mut out = [[0.0; LANES]; 4];
        for (out, sum) in out.iter_mut().zip(sums) {
            // SAFETY: eight lanes; the CPU has AVX-512 (see `Avx512`).
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), sum) };
        }
        out
    }

    #[inline(always)]
    fn blend([red, green, blue, all]: Self::Sums, shares: &[f32; LANES]) -> (Vec3, f32) {
        let mut sums = [0.0; 4];
        // SAFETY: there are eight shares and room for four sums; the CPU has AVX-512 (see `Avx512`).
        unsafe {
            let some = _mm256_cmp_ps_mask::<_CMP_GT_OQ>(all, _mm256_setzero_ps());
            let reached = _mm256_maskz_loadu_ps(some, shares.as_ptr());
            let scale = _mm256_div_ps(reached, _mm256_mask_mov_ps(_mm256_set1_ps(1.0), some, all));
            let [red, green, blue] = [
                _mm256_mul_ps(red, scale),
                _mm256_mul_ps(green, scale),
                _mm256_mul_ps(blue, scale),
            ];
            // Lane by lane, in the order of the plain form: red, green, blue and share of lanes 0 and 4, 1 and 5, ...
            let (low, high) = (_mm256_unpacklo_ps(red, green), _mm256_unpackhi_ps(red, green));
            let (low_2, high_2) = (
                _mm256_unpacklo_ps(blue, reached),
                _mm256_unpackhi_ps(blue, reached),
            );
            let lanes = [
                _mm256_shuffle_ps::<0b01_00_01_00>(low, low_2),
                _mm256_shuffle_ps::<0b11_10_11_10>(low, low_2),
                _mm256_shuffle_ps::<0b01_00_01_00>(high, high_2),
                _mm256_shuffle_ps::<0b11_10_11_10>(high, high_2),
            ];
            let mut sum = _mm_setzero_ps();
            for lane in lanes {
                sum = _mm_add_ps(sum, _mm256_castps256_ps128(lane));
            }
            for lane in lanes {
                sum = _mm_add_ps(sum, _mm256_extractf128_ps::<1>(lane));
            }
            _mm_storeu_ps(sums.as_mut_ptr(), sum);
        }
        let [red, green, blue, share] = sums;
        (Vec3::new(red, green, blue), share)
    }
}
