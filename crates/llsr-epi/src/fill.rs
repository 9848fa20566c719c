//! Colours for pixels that reach no sample: passed on by neighbours.

use glam::Vec3;

use crate::antialias::colour;
use crate::classify::{CLASS_PLANES, COMPLEX};
use crate::kernel::Kernel;
use crate::patch::Patches;
use crate::picture::Picture;
use crate::planes::{Planes, outside_of_last_word};
use crate::reach::{self, REACH_PLANES};

/// One pass over some rows: every pixel without a colour takes the filtered colours of the neighbours that it
/// reaches and that have one; with `blind`, of all that have one.
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
        let coloured = picture.coloured.row(y as isize).plane(0);
        for (word, coloured) in coloured.iter().enumerate().take(classes.words + 1).skip(1) {
            let mut holes = !coloured;
            if word == classes.words {
                holes &= !outside_of_last_word(picture.width);
            }
            while holes != 0 {
                let x = (word - 1) * 64 + holes.trailing_zeros() as usize;
                holes &= holes - 1;
                let around = coloured_around(picture, x, y);
                if around == 0 {
                    continue;
                }
                let free = blind || classes.row(y as isize).bit(COMPLEX, x as isize);
                let mask = if free {
                    around
                } else {
                    reach::mask_among(reach, x, y, around)
                };
                if let Some(found) = filtered(picture, kernel, mask, x, y) {
                    patches.push(y * picture.stride + x, found);
                }
            }
        }
    }
}

/// The filtered colour of the pixels of the window among the bits of `mask`, all of which have one.
fn filtered(picture: &Picture, kernel: &Kernel, mut mask: u32, x: usize, y: usize) -> Option<Vec3> {
    let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
    while mask != 0 {
        let bit = mask.trailing_zeros() as isize;
        mask &= mask - 1;
        let tap = bit + isize::from(bit >= 12);
        let (dx, dy) = (tap % 5 - 2, tap / 5 - 2);
        let (nx, ny) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
        let w = kernel.weight(dx, dy);
        sum += colour(picture, ny * picture.stride + nx) * w;
        weight += w;
    }
    (weight > 0.0).then(|| sum / weight)
}

/// Which pixels of the window lie in the picture and have a colour, in the order of the masks of reachability.
fn coloured_around(picture: &Picture, x: usize, y: usize) -> u32 {
    let mut window = 0;
    for i in 0..5 {
        let row = picture.coloured.row(y as isize + i - 2).plane(0);
        // Bit x - 2 comes to 0; rows and words of guard have no bit set.
        let first = x + 64 - 2;
        let (word, shift) = (first / 64, first % 64);
        let low = row[word] >> shift;
        let high = if shift > 59 {
            row[word + 1] << (64 - shift)
        } else {
            0
        };
        window |= ((low | high) as u32 & 31) << (5 * i);
    }
    // Without the centre, bit 12.
    window & 0xfff | window >> 1 & 0xfff000
}
