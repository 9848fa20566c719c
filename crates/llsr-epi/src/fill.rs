//! Colours for pixels that reach no sample: passed on by neighbours.

use glam::Vec4;

use crate::antialias::colour;
use crate::classify::{CLASS_PLANES, COMPLEX};
use crate::kernel::Kernel;
use crate::lanes::Lanes;
use crate::patch::Patches;
use crate::picture::Picture;
use crate::planes::{Planes, outside_of_last_word};
use crate::reach::{FORWARD, REACH_PLANES};

/// One pass over some rows: every pixel without a colour takes the filtered colours of the neighbours that it
/// reaches and that have one; with `blind`, of all that have one.
///
/// Neighbour by neighbour for all holes of a word at once: which holes take a neighbour is one mask, and only those that do
/// are looked at.
pub(crate) fn fill(
    classes: &Planes<CLASS_PLANES>,
    reach: &Planes<REACH_PLANES>,
    kernel: &Kernel,
    picture: &Picture,
    blind: bool,
    rows: std::ops::Range<usize>,
    patches: &mut Patches,
) {
    for y in rows {
        let row = y as isize;
        let coloured = picture.coloured.row(row).plane(0);
        for (word, coloured) in coloured.iter().enumerate().take(classes.words + 1).skip(1) {
            let mut holes = !coloured;
            if word == classes.words {
                holes &= !outside_of_last_word(picture.width);
            }
            if holes == 0 {
                continue;
            }
            let free = if blind {
                u64::MAX
            } else {
                classes.row(row).plane(COMPLEX)[word]
            };
            // Weighted colours and weight of each pixel.
            let mut sums = [Vec4::ZERO; 64];
            for tap in 0..2 * REACH_PLANES {
                // In scan order: first those whose planes hold the pair, seen from the other end.
                let ((dx, dy), reached) = match tap.checked_sub(REACH_PLANES) {
                    Some(plane) => (FORWARD[plane], reach.row(row).plane(plane)[word]),
                    None => {
                        let plane = REACH_PLANES - 1 - tap;
                        let (dx, dy) = FORWARD[plane];
                        let pairs = reach.row(row - dy).plane(plane);
                        ((-dx, -dy), u64::load_beside(pairs, word, -dx))
                    }
                };
                let there = u64::load_beside(picture.coloured.row(row + dy).plane(0), word, dx);
                let mut takers = holes & there & (reached | free);
                let weight = kernel.weight(dx, dy);
                while takers != 0 {
                    let bit = takers.trailing_zeros() as usize;
                    takers &= takers - 1;
                    let (nx, ny) = ((word - 1) * 64 + bit, y.wrapping_add_signed(dy));
                    let neighbour = ny * picture.stride + nx.wrapping_add_signed(dx);
                    sums[bit] += colour(picture, neighbour).extend(1.0) * weight;
                }
            }
            while holes != 0 {
                let bit = holes.trailing_zeros() as usize;
                holes &= holes - 1;
                let sum = sums[bit];
                if sum.w > 0.0 {
                    let x = (word - 1) * 64 + bit;
                    patches.push(y * picture.stride + x, sum.truncate() / sum.w);
                }
            }
        }
    }
}
