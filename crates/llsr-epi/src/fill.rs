//! Colours for pixels that reach no sample: passed on by neighbours.

use glam::{Vec3, Vec4};

use crate::antialias::colour;
use crate::classify::{CLASS_PLANES, COMPLEX};
use crate::fit::Floats;
use crate::interpolate::BLOCK;
use crate::kernel::Kernel;
use crate::lanes::Lanes;
use crate::patch::Patches;
use crate::picture::Picture;
use crate::planes::{Planes, outside_of_last_word};
use crate::reach::{FORWARD, REACH_PLANES};

/// Neighbours of a pixel.
const TAPS: usize = 2 * REACH_PLANES;

/// Words of 64 pixels that are looked at together, at most.
const MOST_WORDS: usize = 8;

/// What filling reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'a> {
    pub(crate) classes: &'a Planes<CLASS_PLANES>,
    pub(crate) reach: &'a Planes<REACH_PLANES>,
    pub(crate) kernel: &'a Kernel,
    pub(crate) picture: &'a Picture,
    /// Over edges, too.
    pub(crate) blind: bool,
}

/// One pass over some rows: every pixel without a colour takes the filtered colours of the neighbours that it
/// reaches and that have one; if it is blind, of all that have one.
///
/// Neighbour by neighbour for all holes of some words at once: which holes take a neighbour are bits. If `wide`, colours are added up for
/// sixteen pixels at a time, else for each hole; the bits are the same.
#[inline(always)]
pub(crate) fn fill<F: Floats, L: Lanes>(
    source: Source<'_>,
    wide: bool,
    rows: std::ops::Range<usize>,
    patches: &mut Patches,
) {
    let (picture, words) = (source.picture, source.classes.words);
    for y in rows {
        let coloured = picture.coloured.row(y as isize).plane(0);
        let mut first = 1;
        while first <= words {
            // As many words at once as there are.
            let lanes = first + L::WORDS <= words + 1;
            let count = if lanes { L::WORDS } else { 1 };
            let mut holes = [0; MOST_WORDS];
            let mut any = 0;
            for (i, holes) in holes[..count].iter_mut().enumerate() {
                *holes = !coloured[first + i];
                if first + i == words {
                    *holes &= !outside_of_last_word(picture.width);
                }
                any |= *holes;
            }
            if any != 0 {
                let mut takers = [[0; MOST_WORDS]; TAPS];
                if lanes {
                    source.takers::<L>(first, y, &holes, &mut takers);
                } else {
                    source.takers::<u64>(first, y, &holes, &mut takers);
                }
                for i in 0..count {
                    let mut of_word = [0; TAPS];
                    let mut some = 0;
                    for (of_word, takers) in of_word.iter_mut().zip(&takers) {
                        *of_word = takers[i];
                        some |= takers[i];
                    }
                    if some != 0 {
                        source.fill_word::<F>((first + i, y), &of_word, some, wide, patches);
                    }
                }
            }
            first += count;
        }
    }
}

/// Neighbours in scan order.
const fn offset(tap: usize) -> (isize, isize) {
    if tap < REACH_PLANES {
        let (dx, dy) = FORWARD[REACH_PLANES - 1 - tap];
        (-dx, -dy)
    } else {
        FORWARD[tap - REACH_PLANES]
    }
}

impl Source<'_> {
    /// For each neighbour, which holes of some words, from `first` on, take its colour.
    #[inline(always)]
    fn takers<L: Lanes>(
        self,
        first: usize,
        y: usize,
        holes: &[u64; MOST_WORDS],
        takers: &mut [[u64; MOST_WORDS]; TAPS],
    ) {
        let row = y as isize;
        let holes = L::load(holes, 0);
        let free = if self.blind {
            L::ones()
        } else {
            L::load(self.classes.row(row).plane(COMPLEX), first)
        };
        for (tap, takers) in takers.iter_mut().enumerate() {
            // First those whose planes hold the pair, seen from the other end.
            let (dx, dy) = offset(tap);
            let reached = match tap.checked_sub(REACH_PLANES) {
                Some(plane) => L::load(self.reach.row(row).plane(plane), first),
                None => {
                    let pairs = self.reach.row(row + dy).plane(REACH_PLANES - 1 - tap);
                    L::load_beside(pairs, first, dx)
                }
            };
            let there = L::load_beside(self.picture.coloured.row(row + dy).plane(0), first, dx);
            holes.and(there).and(reached.or(free)).store(takers, 0);
        }
    }

    /// Fills `some` holes of a word, counted from the guard.
    #[inline(always)]
    fn fill_word<F: Floats>(
        self,
        (word, y): (usize, usize),
        takers: &[u64; TAPS],
        some: u64,
        wide: bool,
        patches: &mut Patches,
    ) {
        let picture = self.picture;
        let first = y * picture.stride + (word - 1) * 64;
        // Neighbours of the first and the last rows may lie beyond the planes.
        let reach = 2 * picture.stride + 2;
        if !wide || first < reach || first + 64 + reach > picture.red.len() {
            self.fill_each(first, takers, some, patches);
            return;
        }
        for block in 0..64 / BLOCK {
            let shift = block * BLOCK;
            if some >> shift & 0xffff != 0 {
                self.fill_block::<F>(first + shift, takers, shift, patches);
            }
        }
    }

    /// Fills `some` holes of the word of pixels that begins at `first`, one taker at a time.
    #[inline(always)]
    fn fill_each(self, first: usize, takers: &[u64; TAPS], mut some: u64, patches: &mut Patches) {
        // Weighted colours and weight of each pixel.
        let mut sums = [Vec4::ZERO; 64];
        for (tap, &takers) in takers.iter().enumerate() {
            let (dx, dy) = offset(tap);
            let weight = self.kernel.weight(dx, dy);
            let mut takers = takers;
            while takers != 0 {
                let bit = takers.trailing_zeros() as usize;
                takers &= takers - 1;
                let step = dy * self.picture.stride as isize + dx;
                let neighbour = (first + bit).wrapping_add_signed(step);
                sums[bit] += colour(self.picture, neighbour).extend(1.0) * weight;
            }
        }
        while some != 0 {
            let bit = some.trailing_zeros() as usize;
            some &= some - 1;
            let sum = sums[bit];
            if sum.w > 0.0 {
                patches.push(first + bit, sum.truncate() / sum.w);
            }
        }
    }

    /// Fills the holes of the block of pixels that begins at `first`, which is bit `shift` of the takers.
    #[inline(always)]
    fn fill_block<F: Floats>(self, first: usize, takers: &[u64; TAPS], shift: usize, patches: &mut Patches) {
        let Picture { red, green, blue, .. } = self.picture;
        let zero = F::splat(0.0);
        let mut sums = [zero; 4];
        for (tap, &takers) in takers.iter().enumerate() {
            let bits = (takers >> shift) as u16;
            if bits == 0 {
                continue;
            }
            let (dx, dy) = offset(tap);
            let at = first.wrapping_add_signed(dy * self.picture.stride as isize + dx);
            let weight = F::splat(self.kernel.weight(dx, dy));
            for (sum, plane) in sums.iter_mut().zip([red, green, blue]) {
                *sum = sum.plus(F::load_under(bits, plane, at).times(weight));
            }
            sums[3] = sums[3].plus(weight.or(bits, zero));
        }
        let [red, green, blue, weight] = sums;
        let mut filled = weight.above(zero);
        let mut colours = [[0.0; BLOCK]; 3];
        for (sum, colours) in [red, green, blue].into_iter().zip(&mut colours) {
            sum.over(weight).store(colours, 0);
        }
        let [red, green, blue] = &colours;
        while filled != 0 {
            let bit = filled.trailing_zeros() as usize;
            filled &= filled - 1;
            patches.push(first + bit, Vec3::new(red[bit], green[bit], blue[bit]));
        }
    }
}
