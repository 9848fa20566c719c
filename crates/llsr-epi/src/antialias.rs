//! Anti-aliasing of simple pixels (BWG03 section 5.3).

use glam::Vec3;

use crate::classify::{CLASS_PLANES, COMPLEX, CROSSED};
use crate::code::EdgeCode;
use crate::patch::Patches;
use crate::picture::Picture;
use crate::pixels::Pixels;
use crate::planes::Planes;
use crate::tables;

/// Offsets of the eight neighbours, clockwise from the one above.
const AROUND: [(isize, isize); 8] = [
    (0, -1),
    (1, -1),
    (1, 0),
    (1, 1),
    (0, 1),
    (-1, 1),
    (-1, 0),
    (-1, -1),
];
/// Primary region of the first pixel, secondary region of the second; see the tables' generator.
const PS: u8 = 2;
/// Secondary region of the first pixel, primary region of the second.
const SP: u8 = 4;

/// Blends the simple pixels of some rows: primary colour and the colour of a neighbour, by area.
///
/// The neighbour is the first on the list of the edge whose primary region the pixel's secondary region reaches and which has a colour.
/// Where none does, the pixel stays as it is.
pub(crate) fn antialias(
    pixels: &Pixels,
    classes: &Planes<CLASS_PLANES>,
    picture: &Picture,
    rows: std::ops::Range<usize>,
    patches: &mut Patches,
) {
    for y in rows {
        let row = classes.row(y as isize);
        let coloured = picture.coloured.row(y as isize).plane(0);
        let planes = row.plane(CROSSED).iter().zip(row.plane(COMPLEX)).zip(coloured);
        for (word, ((crossed, complex), coloured)) in planes.enumerate().skip(1) {
            let mut simple = crossed & !complex & coloured;
            while simple != 0 {
                let x = (word - 1) * 64 + simple.trailing_zeros() as usize;
                simple &= simple - 1;
                let code = pixels.code(x, y);
                let Some(secondary) = secondary_colour(pixels, picture, code, x, y) else {
                    continue;
                };
                let index = y * pixels.stride + x;
                let share = code.primary_share();
                patches.push(index, colour(picture, index) * share + secondary * (1.0 - share));
            }
        }
    }
}

#[inline]
pub(crate) fn colour(picture: &Picture, index: usize) -> Vec3 {
    Vec3::new(picture.red[index], picture.green[index], picture.blue[index])
}

fn secondary_colour(pixels: &Pixels, picture: &Picture, code: EdgeCode, x: usize, y: usize) -> Option<Vec3> {
    for rank in 0..5 {
        let (dx, dy) = AROUND[code.lender(rank)];
        let (nx, ny) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
        if nx >= pixels.width || ny >= pixels.height || !picture.coloured.row(ny as isize).bit(0, nx as isize)
        {
            continue;
        }
        if lends(pixels, code.corners(), (x, y), (dx, dy)) {
            return Some(colour(picture, ny * pixels.stride + nx));
        }
    }
    None
}

/// Does the secondary region of a pixel reach the primary region of its neighbour?
fn lends(pixels: &Pixels, corners: u8, (x, y): (usize, usize), (dx, dy): (isize, isize)) -> bool {
    let corners_at = |dx: isize, dy: isize| {
        pixels
            .code(x.wrapping_add_signed(dx), y.wrapping_add_signed(dy))
            .corners()
    };
    let across = |from: u8, to: u8, dx: isize| match dx {
        1 => tables::right(from, to),
        _ => tables::transpose(tables::right(to, from)),
    };
    let along = |from: u8, to: u8, dy: isize| match dy {
        1 => tables::down(from, to),
        _ => tables::transpose(tables::down(to, from)),
    };
    let there = corners_at(dx, dy);
    match (dx, dy) {
        (1, 0) => tables::right(corners, there) & SP != 0,
        (-1, 0) => tables::right(there, corners) & PS != 0,
        (0, 1) => tables::down(corners, there) & SP != 0,
        (0, -1) => tables::down(there, corners) & PS != 0,
        _ => {
            let (beside, above) = (corners_at(dx, 0), corners_at(0, dy));
            let one = tables::chain(across(corners, beside, dx), along(beside, there, dy));
            let other = tables::chain(along(corners, above, dy), across(above, there, dx));
            (one | other) & SP != 0
        }
    }
}
