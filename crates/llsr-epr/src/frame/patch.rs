//! Colours for pixels that nothing reaches.
//!
//! A pixel can be walled in by edges with no point among them, or reach only such pixels. Until its point comes it takes
//! the mean colour of what surrounds it, edges or not: wrong by a little is better than a hole.

use glam::Vec3;
use llsr_epi::{Picture, UNREACHED};

/// Rings of pixels that are coloured with care; what lies deeper takes the colour of its row or column.
const RINGS: usize = 8;

/// Working memory of [`patch`].
#[derive(Clone, Debug, Default)]
pub(crate) struct PatchScratch {
    waiting: Vec<(u32, u32)>,
    found: Vec<(u32, u32, Vec3)>,
}

/// Colours all pixels without a colour from the rim of the coloured ones inwards. Returns how many were coloured, and
/// how many had to stay as they are because the picture has no colour at all.
pub(crate) fn patch(picture: &mut Picture, scratch: &mut PatchScratch) -> (usize, usize) {
    let (width, height) = picture.size();
    let PatchScratch { waiting, found } = scratch;
    waiting.clear();
    for y in 0..height {
        let row = picture.priorities(y);
        for (block, values) in row.chunks(64).enumerate() {
            if !values.contains(&UNREACHED) {
                continue;
            }
            for (i, &value) in values.iter().enumerate() {
                let x = (block * 64 + i) as u32;
                if value == UNREACHED && !picture.is_coloured(x, y) {
                    waiting.push((x, y));
                }
            }
        }
    }
    let all = waiting.len();
    if all == picture.size().0 as usize * height as usize {
        return (0, all);
    }
    for _ in 0..RINGS {
        if waiting.is_empty() {
            break;
        }
        found.clear();
        waiting.retain(|&(x, y)| {
            let (mut sum, mut count) = (Vec3::ZERO, 0.0);
            for v in y.saturating_sub(1)..(y + 2).min(height) {
                for u in x.saturating_sub(1)..(x + 2).min(width) {
                    if picture.is_coloured(u, v) {
                        sum += picture.pixel(u, v);
                        count += 1.0;
                    }
                }
            }
            if count > 0.0 {
                found.push((x, y, sum / count));
            }
            count == 0.0
        });
        // Set after the pass, so that the order of the pixels does not matter.
        for &(x, y, colour) in &*found {
            picture.set_pixel(x, y, colour);
        }
    }
    // In the order of scan lines, down and back: one coloured pixel is enough to reach all.
    let mut take = |x: u32, y: u32, from: [(u32, u32); 2]| {
        let inside = |&(u, v): &(u32, u32)| u < width && v < height;
        if let Some((u, v)) = from
            .into_iter()
            .filter(inside)
            .find(|&(u, v)| picture.is_coloured(u, v))
            && !picture.is_coloured(x, y)
        {
            picture.set_pixel(x, y, picture.pixel(u, v));
        }
    };
    for &(x, y) in &*waiting {
        take(x, y, [(x.wrapping_sub(1), y), (x, y.wrapping_sub(1))]);
    }
    for &(x, y) in waiting.iter().rev() {
        take(x, y, [(x + 1, y), (x, y + 1)]);
    }
    (all, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_spreads_over_everything_and_no_colour_stays_none() {
        let mut scratch = PatchScratch::default();
        let mut picture = Picture::new(70, 50);
        assert_eq!(patch(&mut picture, &mut scratch), (0, 3500), "nothing to take");
        picture.set_pixel(3, 42, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(patch(&mut picture, &mut scratch), (3499, 0), "all others");
        for y in 0..50 {
            for x in 0..70 {
                assert_eq!(picture.pixel(x, y), Vec3::new(1.0, 2.0, 3.0), "({x}, {y})");
            }
        }
        let mut halves = Picture::new(3, 1);
        halves.set_pixel(0, 0, Vec3::ZERO);
        halves.set_pixel(2, 0, Vec3::ONE);
        assert_eq!(patch(&mut halves, &mut scratch), (1, 0), "the middle");
        assert_eq!(halves.pixel(1, 0), Vec3::splat(0.5), "the mean of both sides");
    }
}
