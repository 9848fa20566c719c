//! Reachability in the words of the paper: one pixel at a time, by tables. Slow.
//!
//! For reading beside BWG03 section 5.2 and figure 6, and as the other half of the proof that the fast form
//! ([`EdgePointImage::reach`]) does the same.

use crate::code::Reachability;
use crate::image::EdgePointImage;

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
    let (width, height) = image.size();
    let at = |(dx, dy): (isize, isize)| {
        let x = i64::from(x) + dx as i64;
        let y = i64::from(y) + dy as i64;
        let inside = x >= 0 && y >= 0 && x < i64::from(width) && y < i64::from(height);
        inside.then(|| image.edge(x as u32, y as u32))
    };
    let (Some(a), Some(b)) = (at(from), at(to)) else {
        return Reachability::default();
    };
    match (to.0 - from.0, to.1 - from.1) {
        (1, _) => Reachability::right(a, b),
        (-1, _) => Reachability::right(b, a).reversed(),
        (_, 1) => Reachability::down(a, b),
        _ => Reachability::down(b, a).reversed(),
    }
}
