//! Colours for pixels that nothing reaches.
//!
//! A pixel can be walled in by edges with no point among them, or reach only such pixels. Until its point comes it takes
//! the mean colour of what surrounds it, edges or not: wrong by a little is better than a hole.

use llsr_epi::{EdgePointImage, Picture};

use crate::frame::share::share;

/// Rings of pixels that are coloured with care; what lies deeper takes the colour of its row or column.
const RINGS: usize = 8;

/// Working memory of [`patch`].
#[derive(Clone, Debug, Default)]
pub(crate) struct PatchScratch {
    waiting: Vec<(u32, u32)>,
}

/// Colours all pixels without a colour from the rim of the coloured ones inwards, in about `bands` bands. Returns how many were coloured,
/// and how many had to stay as they are because the picture has no colour at all.
///
/// Of `image` the size and the working memory count.
pub(crate) fn patch(
    image: &mut EdgePointImage,
    picture: &mut Picture,
    bands: usize,
    scratch: &mut PatchScratch,
) -> (usize, usize) {
    let (width, height) = picture.size();
    let all = picture.uncoloured();
    if all == width as usize * height as usize {
        return (0, all);
    }
    let mut left = all;
    for _ in 0..RINGS {
        if left == 0 {
            return (all, 0);
        }
        share(image.fill_bands(picture, bands), &|band| band.evenly().run());
        left -= image.apply(picture);
    }
    let PatchScratch { waiting } = scratch;
    waiting.clear();
    for y in 0..height {
        waiting.extend((0..width).filter(|&x| !picture.is_coloured(x, y)).map(|x| (x, y)));
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
    use glam::Vec3;
    use llsr_epi::Settings;

    use super::*;

    /// Patches a picture with an image of its size.
    fn patched(picture: &mut Picture) -> (usize, usize) {
        let (width, height) = picture.size();
        let mut image = EdgePointImage::new(width, height, Settings::default()).unwrap();
        patch(&mut image, picture, 2, &mut PatchScratch::default())
    }

    #[test]
    fn a_colour_spreads_over_everything_and_no_colour_stays_none() {
        let mut picture = Picture::new(70, 50);
        assert_eq!(patched(&mut picture), (0, 3500), "nothing to take");
        picture.set_pixel(3, 42, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(patched(&mut picture), (3499, 0), "all others");
        for y in 0..50 {
            for x in 0..70 {
                assert_eq!(picture.pixel(x, y), Vec3::new(1.0, 2.0, 3.0), "({x}, {y})");
            }
        }
        let mut halves = Picture::new(3, 1);
        halves.set_pixel(0, 0, Vec3::ZERO);
        halves.set_pixel(2, 0, Vec3::ONE);
        assert_eq!(patched(&mut halves), (1, 0), "the middle");
        assert_eq!(halves.pixel(1, 0), Vec3::splat(0.5), "the mean of both sides");
    }

    #[test]
    fn rings_take_the_mean_of_what_is_around() {
        // By pixels, in the plain way.
        let (width, height) = (130u32, 20u32);
        let mut picture = Picture::new(width, height);
        let mut state = 12345u32;
        let mut colours = vec![None; (width * height) as usize];
        for y in 0..height {
            for x in 0..width {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                if state >> 28 == 0 {
                    let colour = Vec3::new((state >> 8) as f32, x as f32 * 0.3, 0.1);
                    picture.set_pixel(x, y, colour);
                    colours[(y * width + x) as usize] = Some(colour);
                }
            }
        }
        let before = colours.iter().filter(|colour| colour.is_none()).count();
        while colours.contains(&None) {
            let old = colours.clone();
            for y in 0..height {
                for x in 0..width {
                    let around = (y.saturating_sub(1)..(y + 2).min(height))
                        .flat_map(|v| (x.saturating_sub(1)..(x + 2).min(width)).map(move |u| v * width + u));
                    let found: Vec<Vec3> = around.filter_map(|i| old[i as usize]).collect();
                    let place = &mut colours[(y * width + x) as usize];
                    if place.is_none() && !found.is_empty() {
                        let sum = found.iter().fold(Vec3::ZERO, |sum, &colour| sum + colour);
                        *place = Some(sum / found.len() as f32);
                    }
                }
            }
        }
        assert_eq!(patched(&mut picture), (before, 0));
        for y in 0..height {
            for x in 0..width {
                let expected = colours[(y * width + x) as usize];
                assert_eq!(Some(picture.pixel(x, y)), expected, "({x}, {y})");
            }
        }
    }
}
