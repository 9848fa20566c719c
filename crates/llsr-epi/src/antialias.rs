//! Anti-aliasing of simple pixels (BWG03 section 5.3).
//!
//! Which neighbours may lend their colour is worked out for all pixels of some words at once, on bit planes, as reachability is;
//! [`paper`](crate::paper) has the form with tables.

use glam::Vec3;

use crate::classify::{CLASS_PLANES, COMPLEX, CROSSED};
use crate::code::EdgeCode;
use crate::lanes::Lanes;
use crate::patch::Patches;
use crate::picture::Picture;
use crate::pixels::Pixels;
use crate::planes::{PlaneRow, Planes};
use crate::reach::{Link, link_down, link_right};
use crate::tables;

/// Offsets of the eight neighbours, clockwise from the one above.
pub(crate) const AROUND: [(isize, isize); 8] = [
    (0, -1),
    (1, -1),
    (1, 0),
    (1, 1),
    (0, 1),
    (-1, 1),
    (-1, 0),
    (-1, -1),
];
/// Words that the widest lanes handle at once.
const MOST_WORDS: usize = 8;
/// For each neighbour, the bits of the pixels whose secondary region reaches its primary one.
type Lenders = [[u64; MOST_WORDS]; AROUND.len()];

/// What anti-aliasing reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'a> {
    pub(crate) pixels: &'a Pixels,
    pub(crate) classes: &'a Planes<CLASS_PLANES>,
    pub(crate) picture: &'a Picture,
}

/// Blends the simple pixels of some rows: primary colour and the colour of a neighbour, by area.
///
/// The neighbour is the first on the list of the edge whose primary region the pixel's secondary region reaches and which has a colour.
/// Where none does, the pixel stays as it is.
#[inline(always)]
pub(crate) fn antialias<W: Lanes>(source: Source<'_>, rows: std::ops::Range<usize>, patches: &mut Patches) {
    let words = source.classes.words;
    for y in rows {
        let row = source.classes.row(y as isize);
        let (crossed, complex) = (row.plane(CROSSED), row.plane(COMPLEX));
        let coloured = source.picture.coloured.row(y as isize).plane(0);
        let simple = |word: usize| crossed[word] & !complex[word] & coloured[word];
        let mut at = 1;
        while at <= words {
            let count = if at + W::WORDS <= words + 1 { W::WORDS } else { 1 };
            if (at..at + count).any(|word| simple(word) != 0) {
                let mut lenders = [[0; MOST_WORDS]; AROUND.len()];
                if count == W::WORDS {
                    find_lenders::<W>(source, at, y, &mut lenders);
                } else {
                    find_lenders::<u64>(source, at, y, &mut lenders);
                }
                for i in 0..count {
                    let first = y * source.pixels.stride + (at + i - 1) * 64;
                    blend_word(source, simple(at + i), &lenders, i, first, patches);
                }
            }
            at += count;
        }
    }
}

/// Blends the pixels `simple` of a word, number `i` among `lenders`, whose first pixel has the index `first`.
#[inline(always)]
fn blend_word(
    source: Source<'_>,
    mut simple: u64,
    lenders: &Lenders,
    i: usize,
    first: usize,
    patches: &mut Patches,
) {
    let stride = source.pixels.stride as isize;
    while simple != 0 {
        let bit = simple.trailing_zeros();
        simple &= simple - 1;
        let index = first + bit as usize;
        let code = EdgeCode::from_word(source.pixels.words[index]);
        let ranked = (0..5).map(|rank| code.lender(rank));
        let Some(lender) = ranked.into_iter().find(|&d| lenders[d][i] >> bit & 1 != 0) else {
            continue;
        };
        let (dx, dy) = AROUND[lender];
        let primary = colour(source.picture, index);
        let secondary = colour(source.picture, index.wrapping_add_signed(dy * stride + dx));
        let share = f32::from(tables::AREA[code.index()]) / 512.0;
        patches.push(index, primary * share + secondary * (1.0 - share));
    }
}

/// The neighbours that may lend to the pixels of words `at..` of row `y`.
#[inline(always)]
fn find_lenders<W: Lanes>(source: Source<'_>, at: usize, y: usize, lenders: &mut Lenders) {
    let rows: [PlaneRow<'_, CLASS_PLANES>; 3] =
        std::array::from_fn(|i| source.classes.row((y + i) as isize - 1));
    let [above, here, below] = rows;
    let east = link_right::<W>(here, at, 0);
    let west = link_right::<W>(here, at, -1).back();
    let south = link_down::<W>(here, below, at, 0);
    let north = link_down::<W>(above, here, at, 0).back();
    // From the direct neighbours on to the one at the corner, along both ways.
    let corner = |a: Link<W>, then_a: Link<W>, b: Link<W>, then_b: Link<W>| {
        let ways = a.start_secondary().then(then_a);
        ways.or(b.start_secondary().then(then_b)).primary
    };
    let reached = [
        north.sp,
        corner(
            east,
            link_down(above, here, at, 1).back(),
            north,
            link_right(above, at, 0),
        ),
        east.sp,
        corner(
            east,
            link_down(here, below, at, 1),
            south,
            link_right(below, at, 0),
        ),
        south.sp,
        corner(
            west,
            link_down(here, below, at, -1),
            south,
            link_right(below, at, -1).back(),
        ),
        west.sp,
        corner(
            west,
            link_down(above, here, at, -1).back(),
            north,
            link_right(above, at, -1).back(),
        ),
    ];
    for ((reached, (dx, dy)), lender) in reached.into_iter().zip(AROUND).zip(lenders) {
        let coloured = source.picture.coloured.row(y as isize + dy).plane(0);
        reached.and(W::load_beside(coloured, at, dx)).store(lender, 0);
    }
}

#[inline]
pub(crate) fn colour(picture: &Picture, index: usize) -> Vec3 {
    Vec3::new(picture.red[index], picture.green[index], picture.blue[index])
}
