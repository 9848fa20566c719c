//! Projecting sixteen edges at a time with AVX-512: what the plain form in [`edges`](crate::edges) does, with the same bits.
#![expect(unsafe_code, reason = "loads and stores; every block says why it is sound")]

use std::arch::x86_64::*;

use glam::{Mat4, Vec3};

use crate::edges::{EdgeList, LINE_BITS, NEAREST, ROUND, UNITS};

/// Edges projected together.
const LANES: usize = 16;
/// Share of its terms by which a rounded sum may be off, and some more.
const ROUNDING: f32 = 1e-6;

/// One coordinate of sixteen points in clip space.
#[derive(Clone, Copy)]
struct Points {
    x: __m512,
    y: __m512,
    w: __m512,
}

/// Adds those of `segments` that lie within the frame, whose half sizes are given in clip space; leaves out what lies wholly beyond one of
/// its sides or behind the eye, and hands the others to `cut`. Does as many as make whole groups, and returns their number.
///
/// The edges of a group that are cut come after the others.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
pub(crate) fn extend(
    list: &mut EdgeList,
    matrix: &Mat4,
    frame: [f32; 2],
    segments: &[[Vec3; 2]],
    cut: impl Fn(&mut EdgeList, [Vec3; 2]),
) -> usize {
    let (groups, _) = segments.as_chunks::<LANES>();
    let (width, height) = list.size();
    let size = [width, height].map(|side| _mm512_set1_pd(f64::from(side)));
    let frame = frame.map(|half| _mm512_set1_ps(half));
    for group in groups {
        let [a, b] = load(group).map(|point| transform(matrix, point));
        let inside = within(a, frame) & within(b, frame);
        let mut rest = !inside & !beyond([a, b], frame);
        if inside != 0 {
            let ends = [snapped(a, size), snapped(b, size)];
            push(list, inside, ends, [key(a.w), key(b.w)]);
        }
        while rest != 0 {
            cut(list, group[rest.trailing_zeros() as usize]);
            rest &= rest - 1;
        }
    }
    groups.len() * LANES
}

/// The coordinates of both ends of sixteen edges.
#[inline]
#[target_feature(enable = "avx512f")]
fn load(group: &[[Vec3; 2]; LANES]) -> [[__m512; 3]; 2] {
    // SAFETY: the edges are 6 * 16 floats one after the other, since `Vec3` is made of three in C's layout.
    let parts: [__m512; 6] = unsafe {
        let at = group.as_ptr().cast::<f32>();
        [
            _mm512_loadu_ps(at),
            _mm512_loadu_ps(at.add(16)),
            _mm512_loadu_ps(at.add(32)),
            _mm512_loadu_ps(at.add(48)),
            _mm512_loadu_ps(at.add(64)),
            _mm512_loadu_ps(at.add(80)),
        ]
    };
    let every_sixth = _mm512_setr_epi32(0, 6, 12, 18, 24, 30, 36, 42, 48, 54, 60, 66, 72, 78, 84, 90);
    let mut columns = [[_mm512_setzero_ps(); 3]; 2];
    for (number, column) in columns.as_flattened_mut().iter_mut().enumerate() {
        // Two registers hold 32 numbers, and five bits of a place choose among them.
        let places = _mm512_add_epi32(every_sixth, _mm512_set1_epi32(number as i32));
        let pairs = [
            _mm512_permutex2var_ps(parts[0], places, parts[1]),
            _mm512_permutex2var_ps(parts[2], places, parts[3]),
            _mm512_permutex2var_ps(parts[4], places, parts[5]),
        ];
        let second = _mm512_cmpge_epi32_mask(places, _mm512_set1_epi32(32));
        let third = _mm512_cmpge_epi32_mask(places, _mm512_set1_epi32(64));
        let first_two = _mm512_mask_mov_ps(pairs[0], second, pairs[1]);
        *column = _mm512_mask_mov_ps(first_two, third, pairs[2]);
    }
    columns
}

/// As the product of matrix and vector does it: column by column.
#[inline]
#[target_feature(enable = "avx512f")]
fn transform(matrix: &Mat4, [x, y, z]: [__m512; 3]) -> Points {
    let row = |number: usize| {
        let [a, b, c, d] = matrix.row(number).to_array();
        let sum = _mm512_mul_ps(_mm512_set1_ps(a), x);
        let sum = _mm512_add_ps(sum, _mm512_mul_ps(_mm512_set1_ps(b), y));
        let sum = _mm512_add_ps(sum, _mm512_mul_ps(_mm512_set1_ps(c), z));
        _mm512_add_ps(sum, _mm512_set1_ps(d))
    };
    Points {
        x: row(0),
        y: row(1),
        w: row(3),
    }
}

/// The points that lie in the frame, in front of the eye.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
fn within(p: Points, [frame_x, frame_y]: [__m512; 2]) -> u16 {
    let in_x = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(_mm512_abs_ps(p.x), _mm512_mul_ps(frame_x, p.w));
    let in_y = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(_mm512_abs_ps(p.y), _mm512_mul_ps(frame_y, p.w));
    in_x & in_y & _mm512_cmp_ps_mask::<_CMP_GT_OQ>(p.w, _mm512_setzero_ps())
}

/// The edges both of whose ends certainly lie beyond the same side of the frame, or behind the eye.
#[inline]
#[target_feature(enable = "avx512f,avx512dq")]
fn beyond(ends: [Points; 2], [frame_x, frame_y]: [__m512; 2]) -> u16 {
    let zero = _mm512_setzero_ps();
    let mut all = [u16::MAX; 5];
    for p in ends {
        for (axis, (place, frame)) in [(p.x, frame_x), (p.y, frame_y)].into_iter().enumerate() {
            let side = _mm512_mul_ps(frame, p.w);
            let terms = _mm512_add_ps(_mm512_abs_ps(place), _mm512_abs_ps(side));
            let least = _mm512_mul_ps(terms, _mm512_set1_ps(ROUNDING));
            let past = _mm512_sub_ps(place, side);
            let before = _mm512_sub_ps(_mm512_sub_ps(zero, place), side);
            all[2 * axis] &= _mm512_cmp_ps_mask::<_CMP_GT_OQ>(past, least);
            all[2 * axis + 1] &= _mm512_cmp_ps_mask::<_CMP_GT_OQ>(before, least);
        }
        all[4] &= _mm512_cmp_ps_mask::<_CMP_LE_OQ>(p.w, zero);
    }
    all.into_iter().fold(0, |any, side| any | side)
}

/// Positions in grid units.
#[inline]
#[target_feature(enable = "avx512f")]
fn snapped(p: Points, [width, height]: [__m512d; 2]) -> [__m512i; 2] {
    let one = _mm512_set1_pd(1.0);
    let mut halves = [[_mm256_setzero_si256(); 2]; 2];
    for (half, units) in halves.iter_mut().enumerate() {
        let of = |v: __m512| {
            let v = _mm512_castps_pd(v);
            let eight = if half == 0 {
                _mm512_castpd512_pd256(v)
            } else {
                _mm512_extractf64x4_pd::<1>(v)
            };
            _mm512_cvtps_pd(_mm256_castpd_ps(eight))
        };
        let (x, y, w) = (of(p.x), of(p.y), of(p.w));
        let x = _mm512_add_pd(_mm512_div_pd(x, w), one);
        let y = _mm512_sub_pd(one, _mm512_div_pd(y, w));
        for (axis, (place, size)) in [(x, width), (y, height)].into_iter().enumerate() {
            let pixels = _mm512_mul_pd(_mm512_mul_pd(place, _mm512_set1_pd(0.5)), size);
            let exact = _mm512_mul_pd(pixels, _mm512_set1_pd(f64::from(UNITS)));
            let rounded = _mm512_add_pd(exact, _mm512_set1_pd(ROUND));
            units[axis] = _mm512_cvtepi64_epi32(_mm512_castpd_si512(rounded));
        }
    }
    let [first, second] = halves;
    let join = |axis: usize| _mm512_inserti64x4::<1>(_mm512_castsi256_si512(first[axis]), second[axis]);
    [join(0), join(1)]
}

/// Depth keys of points in front of the eye, as bits.
#[inline]
#[target_feature(enable = "avx512f")]
fn key(w: __m512) -> __m512i {
    let key = _mm512_div_ps(_mm512_set1_ps(-1.0), w);
    _mm512_castps_si512(_mm512_max_ps(key, _mm512_set1_ps(NEAREST)))
}

/// Adds some of sixteen edges.
#[inline]
#[target_feature(enable = "avx512f,popcnt")]
fn push(list: &mut EdgeList, which: u16, ends: [[__m512i; 2]; 2], keys: [__m512i; 2]) {
    let [[x0, y0], [x1, y1]] = ends;
    let moved = _mm512_or_si512(_mm512_xor_si512(x0, x1), _mm512_xor_si512(y0, y1));
    let crossing = _mm512_mask_test_epi32_mask(which, moved, _mm512_set1_epi32(LINE_BITS));
    list.between += (which & !crossing).count_ones() as usize;
    let which = crossing;
    let chosen = |numbers| _mm512_maskz_compress_epi32(which, numbers);
    let pairs = [[chosen(x0), chosen(y0)], [chosen(x1), chosen(y1)]];
    let [near, far] = keys.map(chosen);
    let (mut all, mut depths) = ([[0; 4]; LANES], [[0.0; 2]; LANES]);
    let alternate = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    let in_pairs = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
    for half in 0..2 {
        let alternate = _mm512_add_epi32(alternate, _mm512_set1_epi32(8 * half as i32));
        let [start, end] = pairs.map(|[x, y]| _mm512_permutex2var_epi32(x, alternate, y));
        let places = [in_pairs, _mm512_add_epi64(in_pairs, _mm512_set1_epi64(4))];
        let four = places.map(|places| _mm512_permutex2var_epi64(start, places, end));
        // SAFETY: eight edges lie behind eight times `half` in either array, four to a store of ends.
        unsafe {
            let at = all[8 * half..].as_mut_ptr().cast::<__m512i>();
            _mm512_storeu_si512(at, four[0]);
            _mm512_storeu_si512(at.add(1), four[1]);
            let keys = _mm512_permutex2var_epi32(near, alternate, far);
            _mm512_storeu_si512(depths[8 * half..].as_mut_ptr().cast(), keys);
        }
    }
    let count = which.count_ones() as usize;
    list.ends.extend_from_slice(&all[..count]);
    list.keys.extend_from_slice(&depths[..count]);
}
