//! Reconstruction in the words of the paper: one pixel at a time, by tables. Slow.
//!
//! For reading beside BWG03 section 5 and figure 6, and as the other half of the proof that the fast forms
//! ([`EdgePointImage::reach`], [`interpolate`](EdgePointImage::interpolate), [`antialias`](EdgePointImage::antialias)) do the same.

use glam::Vec3;

use crate::antialias::AROUND;
use crate::code::{PixelClass, Reachability, RegionSide};
use crate::image::EdgePointImage;
use crate::picture::Picture;

/// The 24-bit reachability mask of a pixel: bit i stands for neighbour i of the 5x5 window in scan order, without the centre.
///
/// Needs [`EdgePointImage::classify`] to have run.
///
/// # Panics
/// If the pixel lies outside the image.
pub fn reach_mask(image: &EdgePointImage, x: u32, y: u32) -> u32 {
    let mut window = [[Reachability::default(); 5]; 5];
    let mut mask = 0;
    // Nearest first, so that each pixel comes after those through which it is reached.
    for distance in 1..=4 {
        for bit in 0..24 {
            let tap = bit + isize::from(bit >= 12);
            let (dx, dy) = (tap % 5 - 2, tap / 5 - 2);
            if dx.abs() + dy.abs() != distance {
                continue;
            }
            let (column, row) = ((dx + 2) as usize, (dy + 2) as usize);
            let mut reached = Reachability::default();
            // Propagate from the pixels one step nearer to the centre, over the shared boundary.
            if dx != 0 {
                let step = step(image, (x, y), (dx - dx.signum(), dy), (dx, dy));
                reached = reached.or(match (dx.abs(), dy) {
                    (1, 0) => step,
                    _ => window[row][column.wrapping_add_signed(-dx.signum())].then(step),
                });
            }
            if dy != 0 {
                let step = step(image, (x, y), (dx, dy - dy.signum()), (dx, dy));
                reached = reached.or(match (dx, dy.abs()) {
                    (0, 1) => step,
                    _ => window[row.wrapping_add_signed(-dy.signum())][column].then(step),
                });
            }
            window[row][column] = reached;
            mask |= u32::from(reached.reaches(false, false)) << bit;
        }
    }
    mask
}

/// Reachability between two neighbours, given by their offsets from the centre; nothing reaches out of the image.
fn step(
    image: &EdgePointImage,
    (x, y): (u32, u32),
    from: (isize, isize),
    to: (isize, isize),
) -> Reachability {
    let at = |(dx, dy): (isize, isize)| (x.wrapping_add_signed(dx as i32), y.wrapping_add_signed(dy as i32));
    link(image, at(from), at(to))
}

/// Reachability between two neighbours.
fn link(image: &EdgePointImage, from: (u32, u32), to: (u32, u32)) -> Reachability {
    let (width, height) = image.size();
    let at = |(x, y): (u32, u32)| (x < width && y < height).then(|| image.edge(x, y));
    let (Some(a), Some(b)) = (at(from), at(to)) else {
        return Reachability::default();
    };
    match (to.0.wrapping_sub(from.0) as i32, to.1.wrapping_sub(from.1) as i32) {
        (1, _) => Reachability::right(a, b),
        (-1, _) => Reachability::right(b, a).reversed(),
        (_, 1) => Reachability::down(a, b),
        _ => Reachability::down(b, a).reversed(),
    }
}

/// The interpolated colour of a pixel, and the filter weight that fell on reachable samples, in (0, 1] (section 5.3); none if
/// there is no such sample.
///
/// A complex pixel takes every sample of its window, as if there were no edges (section 5.4).
///
/// # Panics
/// If the pixel lies outside the image.
pub fn interpolate(image: &EdgePointImage, x: u32, y: u32) -> Option<(Vec3, f32)> {
    let (width, height) = image.size();
    let complex = image.class(x, y) == PixelClass::Complex;
    let mask = reach_mask(image, x, y);
    let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
    for tap in 0..25 {
        let (dx, dy) = (tap % 5 - 2, tap / 5 - 2);
        let (u, v) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
        if u >= width || v >= height {
            continue;
        }
        let bit = tap - i32::from(tap > 12);
        let reached = tap == 12 || mask >> bit & 1 != 0;
        let Some(sample) = image.sample(u, v) else {
            continue;
        };
        let usable = image.edge(u, v).side(sample.position) == RegionSide::Primary;
        if complex || reached && usable {
            let weight = image.settings().kernel.weight(dx as isize, dy as isize);
            sum += sample.colour * weight;
            weights += weight;
        }
    }
    (weights > 0.0).then(|| (sum / weights, weights))
}

/// The colour of a simple pixel after anti-aliasing, from a picture before it (section 5.3); none for pixels that stay as they
/// are: those that are not simple, have no colour, or whose secondary region reaches no neighbour with a colour.
///
/// # Panics
/// If the pixel lies outside the image.
pub fn antialias(image: &EdgePointImage, picture: &Picture, x: u32, y: u32) -> Option<Vec3> {
    let (width, height) = image.size();
    let code = image.edge(x, y);
    if code.class() != PixelClass::Simple || !picture.is_coloured(x, y) {
        return None;
    }
    for rank in 0..5 {
        let (dx, dy) = AROUND[code.lender(rank)];
        let (u, v) = (x.wrapping_add_signed(dx as i32), y.wrapping_add_signed(dy as i32));
        if u >= width || v >= height || !picture.is_coloured(u, v) {
            continue;
        }
        let to = |from, to| link(image, from, to);
        let centre = (x, y);
        let reached = if dx == 0 || dy == 0 {
            to(centre, (u, v))
        } else {
            let (beside, beyond) = ((u, y), (x, v));
            let one = to(centre, beside).then(to(beside, (u, v)));
            one.or(to(centre, beyond).then(to(beyond, (u, v))))
        };
        if reached.reaches(true, false) {
            let share = code.primary_share();
            return Some(picture.pixel(x, y) * share + picture.pixel(u, v) * (1.0 - share));
        }
    }
    None
}
