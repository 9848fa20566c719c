//! Rasterising sixteen crossings at a time with AVX-512: what [`raster::mark`](crate::raster::mark) does, with the same bits.
//!
//! Most edges cross few lines, so lanes stand for crossings: the ends of a block of edges lie in columns of numbers, and a list
//! says which edge crosses which line for the how-manieth time. Edges that cross more lines than a few get lanes for
//! themselves. Only the last step, setting a bit of a byte, goes one by one. The arithmetic, and why it is exact, is that of the plain form.
#![expect(unsafe_code, reason = "loads and stores; every block says why it is sound")]

use std::arch::x86_64::*;

use crate::crossings::BandCrossings;
use crate::edges::{EdgeList, UNITS};
use crate::occlusion::{BandLimits, SHARED};
use crate::raster::{EIGHTH, SHIFT, SHIFT_EIGHTHS};

/// Lanes.
const LANES: usize = 16;
/// Edges in a block: two registers to a column.
const EDGES: usize = 2 * LANES;
/// Crossings of an edge with the lines of one axis that are listed.
const FEW: usize = 4;
/// A limit that hides nothing: infinity.
const NO_LIMIT: u16 = 0x7f80;
/// Crossings that wait to be marked.
const WAITING: usize = 1024;
/// Binary logarithm of [`SHARED`].
const SHARED_SHIFT: u32 = SHARED.trailing_zeros();

/// Bits of the list: number of the edge in its block, and above it how many lines were crossed before.
const NUMBER_BITS: u32 = 8;

/// A column of numbers of a block.
type Column = [__m512i; 2];

/// The lines of one axis within a band, and the bytes that hold its crossings.
struct Axis<'a> {
    /// Lines are horizontal, a byte to a column of pixels.
    horizontal: bool,
    /// Binary logarithm of the number of lines to a pixel.
    half_lines: u32,
    /// First line and the one after the last.
    lines: (i32, i32),
    /// First row and the one after the last.
    rows: (i32, i32),
    width: i32,
    /// Bytes from one horizontal line, or one row of vertical lines, to the next.
    pitch: i32,
    /// Columns of limits.
    columns: i32,
    /// Mask of the numbers of limits.
    cells: i32,
    /// Upper halves of the keys of limits.
    limits: &'a [u16],
    bytes: &'a mut [u8],
    waiting: Waiting,
}

/// A block of edges as they cross the lines of one axis: positions across the lines and along them, and depth keys.
struct Block {
    from: Column,
    to: Column,
    start: Column,
    end: Column,
    near: Column,
    far: Column,
    first: Column,
}

/// Most bytes for either kind of lines: bits are numbered in 32 bits.
pub(crate) const MOST_BYTES: usize = 1 << 29;

/// Marks the crossings of all edges with the lines of one band, which has at most [`MOST_BYTES`]. `clear` the band first.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
pub(crate) fn mark(edges: &EdgeList, limits: Option<&BandLimits<'_>>, band: &mut BandCrossings<'_>) {
    let lines = band.lines as i32;
    let rows = (band.first_row as i32, band.end_row as i32);
    let first_line = rows.0 * lines;
    let end_line = first_line + band.horizontal_lines() as i32;
    let (columns, limits) = limits.map_or((0, &[NO_LIMIT][..]), BandLimits::columns_and_keys);
    let mut across = Axis {
        horizontal: true,
        half_lines: lines.trailing_zeros(),
        lines: (first_line, end_line),
        rows,
        width: band.width as i32,
        pitch: band.stride as i32,
        columns: columns as i32,
        cells: if columns > 0 { -1 } else { 0 },
        limits,
        bytes: band.horizontal,
        waiting: Waiting::NONE,
    };
    let mut down = Axis {
        horizontal: false,
        lines: (0, band.width as i32 * lines + 1),
        pitch: band.pitch as i32,
        bytes: band.vertical,
        waiting: Waiting::NONE,
        ..across
    };
    let top = _mm512_set1_epi32(rows.0 * UNITS);
    let bottom = _mm512_set1_epi32(rows.1 * UNITS);
    // The last block is filled up with edges without a length.
    let (mut last_ends, mut last_keys) = ([[0; 4]; EDGES], [[0.0; 2]; EDGES]);
    for (ends, keys) in edges.ends.chunks(EDGES).zip(edges.keys.chunks(EDGES)) {
        let (ends, keys) = match (ends.first_chunk(), keys.first_chunk()) {
            (Some(ends), Some(keys)) => (ends, keys),
            _ => {
                last_ends[..ends.len()].copy_from_slice(ends);
                last_keys[..keys.len()].copy_from_slice(keys);
                (&last_ends, &last_keys)
            }
        };
        let [x0, y0, x1, y1] = columns_of_ends(ends);
        let [near, far] = columns_of_keys(keys);
        let mut within = [0; 2];
        for half in 0..2 {
            let (low, high) = (
                _mm512_min_epi32(y0[half], y1[half]),
                _mm512_max_epi32(y0[half], y1[half]),
            );
            within[half] = _mm512_cmpge_epi32_mask(high, top) & _mm512_cmple_epi32_mask(low, bottom);
        }
        if within == [0; 2] {
            continue;
        }
        across.mark_block([y0, y1], [x0, x1], [near, far], within);
        down.mark_block([x0, x1], [y0, y1], [near, far], within);
    }
    across.set_bits();
    down.set_bits();
}

/// The four coordinates of a block of edges.
#[inline]
#[target_feature(enable = "avx512f")]
fn columns_of_ends(ends: &[[i32; 4]; EDGES]) -> [Column; 4] {
    let mut columns = [[_mm512_setzero_si512(); 2]; 4];
    for half in 0..2 {
        // SAFETY: sixteen edges of four numbers each lie behind sixteen times `half`, four to a load.
        let [a, b, c, d] = unsafe {
            let at = ends[LANES * half..].as_ptr().cast::<__m512i>();
            [
                _mm512_loadu_si512(at),
                _mm512_loadu_si512(at.add(1)),
                _mm512_loadu_si512(at.add(2)),
                _mm512_loadu_si512(at.add(3)),
            ]
        };
        // Number `column` of the eight edges in two registers.
        let every_fourth = _mm512_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28, 0, 4, 8, 12, 16, 20, 24, 28);
        for (number, column) in columns.iter_mut().enumerate() {
            let places = _mm512_add_epi32(every_fourth, _mm512_set1_epi32(number as i32));
            let low = _mm512_permutex2var_epi32(a, places, b);
            let high = _mm512_permutex2var_epi32(c, places, d);
            column[half] = _mm512_mask_mov_epi32(low, 0xff00, high);
        }
    }
    columns
}

/// The two keys of a block of edges, as bits.
#[inline]
#[target_feature(enable = "avx512f")]
fn columns_of_keys(keys: &[[f32; 2]; EDGES]) -> [Column; 2] {
    let mut columns = [[_mm512_setzero_si512(); 2]; 2];
    for half in 0..2 {
        // SAFETY: sixteen edges of two numbers each lie behind sixteen times `half`, eight to a load.
        let [a, b] = unsafe {
            let at = keys[LANES * half..].as_ptr().cast::<__m512i>();
            [_mm512_loadu_si512(at), _mm512_loadu_si512(at.add(1))]
        };
        let every_second = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
        for (number, column) in columns.iter_mut().enumerate() {
            let places = _mm512_add_epi32(every_second, _mm512_set1_epi32(number as i32));
            column[half] = _mm512_permutex2var_epi32(a, places, b);
        }
    }
    columns
}

/// The numbers of a column at `places`, of which five bits count.
#[inline]
#[target_feature(enable = "avx512f")]
fn pick([low, high]: &Column, places: __m512i) -> __m512i {
    _mm512_permutex2var_epi32(*low, places, *high)
}

impl Axis<'_> {
    /// Binary logarithm of the distance between lines in grid units.
    fn spacing(&self) -> u32 {
        UNITS.trailing_zeros() - self.half_lines
    }

    /// Marks the crossings of a block of edges, of those that are `within` the band.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn mark_block(&mut self, across: [Column; 2], along: [Column; 2], keys: [Column; 2], within: [u16; 2]) {
        let [from, to] = across;
        let spacing = _mm_cvtsi32_si128(self.spacing() as i32);
        let one = _mm512_set1_epi32(1);
        let (mut first, mut count) = ([_mm512_setzero_si512(); 2], [_mm512_setzero_si512(); 2]);
        for half in 0..2 {
            // A line is crossed if one end lies above it (left of it) and the other on it or beyond.
            let beyond = |v| _mm512_add_epi32(_mm512_sra_epi32(v, spacing), one);
            let (low, high) = (
                beyond(_mm512_min_epi32(from[half], to[half])),
                beyond(_mm512_max_epi32(from[half], to[half])),
            );
            first[half] = _mm512_max_epi32(low, _mm512_set1_epi32(self.lines.0));
            let end = _mm512_min_epi32(high, _mm512_set1_epi32(self.lines.1));
            count[half] = _mm512_maskz_sub_epi32(within[half], end, first[half]);
        }
        let block = Block {
            from,
            to,
            start: along[0],
            end: along[1],
            near: keys[0],
            far: keys[1],
            first,
        };

        let mut list = [0i32; FEW * EDGES + LANES];
        let mut len = 0;
        let numbers = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        for nth in 0..FEW as i32 {
            let before = len;
            for (half, &count) in count.iter().enumerate() {
                let crossed = _mm512_cmpgt_epi32_mask(count, _mm512_set1_epi32(nth));
                let entry = (nth << NUMBER_BITS) + (half * LANES) as i32;
                let entries = _mm512_add_epi32(numbers, _mm512_set1_epi32(entry));
                // SAFETY: the list is a register longer than all entries that there can be.
                unsafe {
                    let entries = _mm512_maskz_compress_epi32(crossed, entries);
                    _mm512_storeu_si512(list[len..len + LANES].as_mut_ptr().cast(), entries);
                }
                len += crossed.count_ones() as usize;
            }
            if len == before {
                break;
            }
        }
        for at in (0..len).step_by(LANES) {
            // SAFETY: as above.
            let entries = unsafe { _mm512_loadu_si512(list[at..at + LANES].as_ptr().cast()) };
            self.mark_listed(&block, entries, (len - at).min(LANES));
        }
        for half in 0..2 {
            let mut long = _mm512_cmpgt_epi32_mask(count[half], _mm512_set1_epi32(FEW as i32));
            while long != 0 {
                let place = _mm512_set1_epi32((half * LANES) as i32 + long.trailing_zeros() as i32);
                let count = _mm_cvtsi128_si32(_mm512_castsi512_si128(pick(&count, place)));
                self.mark_long(&block, place, count);
                long &= long - 1;
            }
        }
    }

    /// Marks the first `lanes` of a list of crossings.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn mark_listed(&mut self, block: &Block, entries: __m512i, lanes: usize) {
        let (from, to) = (pick(&block.from, entries), pick(&block.to, entries));
        let (start, end) = (pick(&block.start, entries), pick(&block.end, entries));
        let nth = _mm512_srli_epi32::<NUMBER_BITS>(entries);
        let line = _mm512_add_epi32(pick(&block.first, entries), nth);
        let spacing = _mm_cvtsi32_si128(self.spacing() as i32);
        let gone = _mm512_sub_epi32(_mm512_sll_epi32(line, spacing), from);
        let zero = _mm512_setzero_si512();

        let (across, along) = (_mm512_sub_epi32(to, from), _mm512_sub_epi32(end, start));
        let turned = _mm512_cmplt_epi32_mask(across, zero);
        let distance = _mm512_abs_epi32(across);
        let slope = _mm512_mask_sub_epi32(along, turned, zero, along);
        let start = _mm512_add_epi32(start, _mm512_set1_epi32(SHIFT));
        // See the plain form: crossings of vertical lines move up where the position grows with the line.
        let up = if self.horizontal {
            0
        } else {
            _mm512_cmpgt_epi32_mask(slope, zero)
        };
        let (mut eighths, mut steps) = ([_mm256_setzero_si256(); 2], [_mm256_setzero_ps(); 2]);
        for half in 0..1 + usize::from(lanes > 8) {
            let float = |v| _mm512_cvtepi32_pd(half_of(v, half));
            let (distance, gone) = (float(distance), float(gone));
            let inverse = _mm512_div_pd(_mm512_set1_pd(1.0), distance);
            let rounding = _mm512_mask_mov_pd(
                _mm512_set1_pd(0.5),
                (up >> (8 * half)) as u8,
                _mm512_set1_pd(-0.5),
            );
            // Exact, so that it does not matter that products are added without rounding them first.
            let place = _mm512_fmadd_pd(float(start), distance, rounding);
            let place = _mm512_fmadd_pd(gone, float(slope), place);
            let scale = _mm512_mul_pd(inverse, _mm512_set1_pd(1.0 / EIGHTH));
            eighths[half] = _mm512_cvttpd_epi32(_mm512_mul_pd(place, scale));
            steps[half] = _mm512_cvtpd_ps(_mm512_mul_pd(gone, inverse));
        }
        let eighth = _mm512_inserti64x4::<1>(_mm512_castsi256_si512(eighths[0]), eighths[1]);
        let t = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(steps[0]), steps[1]);
        let t = _mm512_mask_sub_ps(t, turned, _mm512_setzero_ps(), t);
        let (near, far) = (pick(&block.near, entries), pick(&block.far, entries));
        let keys = (_mm512_castsi512_ps(near), _mm512_castsi512_ps(far));
        self.mark_crossings(eighth, line, t, keys, lanes);
    }

    /// Marks the crossings of edge `place` with lines after the first [`FEW`].
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn mark_long(&mut self, block: &Block, place: __m512i, count: i32) {
        let number = |column| _mm_cvtsi128_si32(_mm512_castsi512_si128(pick(column, place)));
        let (from, to) = (number(&block.from), number(&block.to));
        let (start, end) = (number(&block.start), number(&block.end));
        let (near, far) = (pick(&block.near, place), pick(&block.far, place));
        let keys = (_mm512_castsi512_ps(near), _mm512_castsi512_ps(far));
        // As in the plain form.
        let up = !self.horizontal && (to > from) == (end > start) && start != end;
        let distance = f64::from(to - from).abs();
        let inverse = 1.0 / distance;
        let (slope, step) = if to < from {
            (f64::from(start - end), -inverse)
        } else {
            (f64::from(end - start), inverse)
        };
        let numerator = f64::from(start + SHIFT) * distance + if up { -0.5 } else { 0.5 };
        let (numerator, slope) = (_mm512_set1_pd(numerator), _mm512_set1_pd(slope));
        let (scale, step) = (_mm512_set1_pd(inverse * (1.0 / EIGHTH)), _mm512_set1_pd(step));

        let spacing = _mm_cvtsi32_si128(self.spacing() as i32);
        let numbers = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        let mut line = _mm512_add_epi32(pick(&block.first, place), numbers);
        line = _mm512_add_epi32(line, _mm512_set1_epi32(FEW as i32));
        let mut left = count - FEW as i32;
        while left > 0 {
            let lanes = left.min(LANES as i32) as usize;
            let gone = _mm512_sub_epi32(_mm512_sll_epi32(line, spacing), _mm512_set1_epi32(from));
            let (mut eighths, mut steps) = ([_mm256_setzero_si256(); 2], [_mm256_setzero_ps(); 2]);
            for half in 0..1 + usize::from(lanes > 8) {
                let gone = _mm512_cvtepi32_pd(half_of(gone, half));
                let place = _mm512_fmadd_pd(gone, slope, numerator);
                eighths[half] = _mm512_cvttpd_epi32(_mm512_mul_pd(place, scale));
                steps[half] = _mm512_cvtpd_ps(_mm512_mul_pd(gone, step));
            }
            let eighth = _mm512_inserti64x4::<1>(_mm512_castsi256_si512(eighths[0]), eighths[1]);
            let t = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(steps[0]), steps[1]);
            self.mark_crossings(eighth, line, t, keys, lanes);
            line = _mm512_add_epi32(line, _mm512_set1_epi32(LANES as i32));
            left -= LANES as i32;
        }
    }

    /// Takes crossings in the picture down to be marked. They lie in eighths of a pixel, [`SHIFT_EIGHTHS`] more, on
    /// lines, and at parameters of edges with two depth keys.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn mark_crossings(
        &mut self,
        eighth: __m512i,
        line: __m512i,
        t: __m512,
        (near, far): (__m512, __m512),
        lanes: usize,
    ) {
        let set = _mm512_set1_epi32;
        let eighth = _mm512_sub_epi32(eighth, set(SHIFT_EIGHTHS as i32));
        let pixel = _mm512_srai_epi32::<3>(eighth);
        let half_lines = _mm_cvtsi32_si128(self.half_lines as i32);
        let whole = _mm512_sra_epi32(line, half_lines);
        let (byte, x, row, inside);
        if self.horizontal {
            let last = set(self.rows.1 - 1 - self.rows.0);
            inside = _mm512_cmplt_epu32_mask(pixel, set(self.width));
            (x, row) = (
                pixel,
                _mm512_min_epi32(_mm512_sub_epi32(whole, set(self.rows.0)), last),
            );
            let line = _mm512_sub_epi32(line, set(self.lines.0));
            byte = _mm512_add_epi32(_mm512_mullo_epi32(line, set(self.pitch)), pixel);
        } else {
            row = _mm512_sub_epi32(pixel, set(self.rows.0));
            inside = _mm512_cmplt_epu32_mask(row, set(self.rows.1 - self.rows.0));
            x = _mm512_min_epi32(whole, set(self.width - 1));
            let half = _mm512_and_si512(line, set((1 << self.half_lines) - 1));
            let line = _mm512_add_epi32(_mm512_sll_epi32(row, half_lines), half);
            byte = _mm512_add_epi32(_mm512_mullo_epi32(line, set(self.pitch)), whole);
        }
        let cell = _mm512_add_epi32(
            _mm512_mullo_epi32(_mm512_srli_epi32::<SHARED_SHIFT>(row), set(self.columns)),
            _mm512_srli_epi32::<SHARED_SHIFT>(x),
        );
        let cell = _mm512_and_si512(cell, set(self.cells));
        let key = _mm512_add_ps(near, _mm512_mul_ps(_mm512_sub_ps(far, near), t));
        // A rounded key may be +0.
        let key = _mm512_or_si512(_mm512_castps_si512(key), set(i32::MIN));
        let bit = _mm512_or_si512(_mm512_slli_epi32::<3>(byte), _mm512_and_si512(eighth, set(7)));
        let inside = inside & (u32::MAX >> (32 - lanes)) as u16;
        self.waiting.add(inside, bit, cell, key);
        if self.waiting.len >= WAITING {
            self.set_bits();
        }
    }

    /// Sets the bits that wait, unless they are hidden.
    fn set_bits(&mut self) {
        let Waiting {
            bits,
            cells,
            keys,
            len,
        } = &mut self.waiting;
        for ((&bit, &cell), &key) in bits.iter().zip(&*cells).zip(&*keys).take(*len) {
            // Keys are not positive, so that the larger magnitude is the smaller number. No branches: what is hidden is hard to
            // predict.
            let seen = u8::from(key >= u32::from(self.limits[cell as usize]) << 16);
            self.bytes[(bit >> 3) as usize] |= seen << (bit & 7);
        }
        *len = 0;
    }
}

/// Crossings whose bits are to be set: the numbers of these (eight times the byte, and the bit in it), of the cells of
/// their limits, and their depth keys as bits.
///
/// Set many at a time, they need not wait for each other's memory.
struct Waiting {
    bits: [u32; WAITING + LANES],
    cells: [u32; WAITING + LANES],
    keys: [u32; WAITING + LANES],
    len: usize,
}

impl Waiting {
    const NONE: Self = Self {
        bits: [0; WAITING + LANES],
        cells: [0; WAITING + LANES],
        keys: [0; WAITING + LANES],
        len: 0,
    };

    /// Adds some of sixteen crossings; there must be fewer than [`WAITING`].
    #[inline]
    #[target_feature(enable = "avx512f,popcnt")]
    fn add(&mut self, which: u16, bit: __m512i, cell: __m512i, key: __m512i) {
        let room = self.len..self.len + LANES;
        for (list, numbers) in [
            (&mut self.bits, bit),
            (&mut self.cells, cell),
            (&mut self.keys, key),
        ] {
            let at = list[room.clone()].as_mut_ptr();
            // SAFETY: the slice is as long as the store.
            unsafe { _mm512_storeu_si512(at.cast(), _mm512_maskz_compress_epi32(which, numbers)) };
        }
        self.len += which.count_ones() as usize;
    }
}

/// Eight of sixteen numbers.
#[inline]
#[target_feature(enable = "avx512f")]
fn half_of(numbers: __m512i, half: usize) -> __m256i {
    if half == 0 {
        _mm512_castsi512_si256(numbers)
    } else {
        _mm512_extracti64x4_epi64::<1>(numbers)
    }
}
