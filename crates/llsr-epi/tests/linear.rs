//! Means taken to the centres of pixels, beside planted slopes and the same in double precision.

use glam::{Vec2, Vec3};
use llsr_epi::{
    EdgeList, EdgePointImage, Kernel, Picture, PixelClass, Point, RegionSide, ScreenSegment, Settings,
};
use llsr_testkit::epi::edge_sets::thicket;
use llsr_testkit::epi::windows::Stream;

/// The ridge and the share that the documentation of the fit states.
const RIDGE: f64 = 1.0 / 32.0;
const MOST: f64 = 0.25;

fn image(width: u32, height: u32, linear: bool) -> EdgePointImage {
    let settings = Settings {
        linear,
        ..Settings::default()
    };
    EdgePointImage::new(width, height, settings).unwrap()
}

/// Samples in about `share` of the pixels, in the middle of an eighth of the pixel each way where they are kept, coloured by their places.
fn scatter(
    images: &mut [&mut EdgePointImage],
    share: f32,
    stream: &mut Stream,
    mut colour: impl FnMut(Vec2) -> Vec3,
) {
    let (width, height) = images[0].size();
    for y in 0..height {
        for x in 0..width {
            if stream.unit() >= share {
                continue;
            }
            let eighth = Vec2::new(stream.unit(), stream.unit()) * 8.0;
            let position = Vec2::new(x as f32, y as f32) + (eighth.floor() + 0.5) / 8.0;
            let colour = colour(position);
            for image in &mut *images {
                image.insert(&Point {
                    position,
                    depth: 1.0,
                    colour,
                });
            }
        }
    }
}

#[test]
fn a_planted_slope_comes_out_straight() {
    // Steep, and between 256 and 511, where packed colours are whole numbers.
    let (width, height) = (40, 24);
    let plane = |p: Vec2| Vec3::new(1.0, 0.75, 0.5) * (390.0 - 3.0 * p.x + 5.0 * p.y);
    let (mut fitted, mut mean) = (image(width, height, true), image(width, height, false));
    scatter(&mut [&mut fitted, &mut mean], 0.5, &mut Stream::new(5), plane);
    let mut errors = [0.0f64; 2];
    for (image, error) in [&mut fitted, &mut mean].into_iter().zip(&mut errors) {
        let mut picture = Picture::new(width, height);
        image.classify();
        image.reach();
        image.interpolate(&mut picture);
        let mut count = 0.0;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            if picture.is_coloured(x, y) {
                let expected = plane(Vec2::new(x as f32, y as f32) + 0.5);
                *error += f64::from((picture.pixel(x, y) - expected).length_squared());
                count += 1.0;
            }
        }
        *error = (*error / count).sqrt();
    }
    println!("root mean square error: fitted {}, mean {}", errors[0], errors[1]);
    // What stays is the rounding of colours, 0.5 over all channels, the ridge, and windows with one or two samples.
    assert!(errors[0] < 1.5, "the fit is off by {}", errors[0]);
    assert!(errors[1] > 3.0 * errors[0], "the mean is as good: {errors:?}");
}

/// Where a mean lies, and its luminance.
#[derive(Clone, Copy)]
struct Mean {
    place: [f64; 2],
    luminance: f64,
}

fn luminance(c: Vec3) -> f64 {
    0.2126 * f64::from(c.x) + 0.7152 * f64::from(c.y) + 0.0722 * f64::from(c.z)
}

/// Does pixel (x, y) reach the one at (dx, dy) from it?
fn reaches(image: &EdgePointImage, (x, y): (u32, u32), (dx, dy): (i32, i32)) -> bool {
    let tap = (dy + 2) * 5 + dx + 2;
    tap == 12 || image.reach_mask(x, y) >> (tap - i32::from(tap > 12)) & 1 != 0
}

fn beside(image: &EdgePointImage, (x, y): (u32, u32), (dx, dy): (i32, i32)) -> Option<(u32, u32)> {
    let (u, v) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
    let (width, height) = image.size();
    (u < width && v < height).then_some((u, v))
}

/// Places of the samples that a pixel reaches, with their weights.
fn centroid(image: &EdgePointImage, pixel: (u32, u32), kernel: &Kernel) -> [f64; 2] {
    let (mut sum, mut total) = ([0.0; 2], 0.0);
    for (dx, dy) in (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy))) {
        let Some((u, v)) = beside(image, pixel, (dx, dy)) else {
            continue;
        };
        if !reaches(image, pixel, (dx, dy)) || image.class(u, v) == PixelClass::Complex {
            continue;
        }
        let Some(sample) = image.sample(u, v) else {
            continue;
        };
        if image.edge(u, v).side(sample.position) != RegionSide::Primary {
            continue;
        }
        let weight = f64::from(kernel.weight(dx as isize, dy as isize));
        let place = |d: i32, eighth: u8| f64::from(d) + (f64::from(eighth) + 0.5) / 8.0 - 0.5;
        sum[0] += weight * place(dx, sample.position % 4 * 2 + sample.eighth % 2);
        sum[1] += weight * place(dy, sample.position / 4 * 2 + sample.eighth / 2);
        total += weight;
    }
    sum.map(|sum| sum / total)
}

/// The factor of a mean among those to the left, right, above and below.
fn factor(own: Mean, around: [Option<Mean>; 4], kernel: &Kernel) -> f64 {
    let (mut a, mut b) = ([[RIDGE, 0.0], [0.0, RIDGE]], [0.0; 2]);
    let step = |place: [f64; 2], from: [f64; 2]| [place[0] - from[0], place[1] - from[1]];
    for pair in around.chunks(2) {
        let (before, after) = (pair[0].unwrap_or(own), pair[1].unwrap_or(own));
        let d = step(after.place, before.place);
        for i in 0..2 {
            for j in 0..2 {
                a[i][j] += d[i] * d[j];
            }
            b[i] += d[i] * (after.luminance - before.luminance);
        }
    }
    // By elimination.
    let share = a[1][0] / a[0][0];
    let down = (b[1] - share * b[0]) / (a[1][1] - share * a[0][1]);
    let across = (b[0] - a[0][1] * down) / a[0][0];
    // What is left of luminance without the slope, and its second differences.
    let level = |mean: Mean| mean.luminance - across * mean.place[0] - down * mean.place[1];
    let mut bend = 0.0;
    for pair in around.chunks(2) {
        if let [Some(before), Some(after)] = pair {
            bend += level(*before) + level(*after) - 2.0 * level(own);
        }
    }
    let variance: f64 = [-2, -1, 0, 1, 2]
        .map(|d: isize| f64::from(kernel.weight(d, 0) / kernel.weight(0, 0).sqrt()) * (d * d) as f64)
        .iter()
        .sum();
    let found = level(own) - 0.5 * variance * bend / 4.0;
    (found / own.luminance).clamp(1.0 - MOST, 1.0 + MOST)
}

#[test]
fn means_are_taken_to_their_centres_among_edges() {
    let (mut by_class, mut complex, mut limited) = ([0; 2], 0, 0);
    for (seed, (width, height, density, spread)) in [
        (70, 40, 0.1, 1.0),
        (300, 30, 0.5, 1.0),
        (64, 64, 0.9, 1.0),
        (300, 30, 0.3, 9.0),
        (2100, 6, 0.5, 1.0),
    ]
    .into_iter()
    .enumerate()
    {
        let mut stream = Stream::new(seed as u64);
        let (mut fitted, mut mean) = (image(width, height, true), image(width, height, false));
        let mut list = EdgeList::new(width, height);
        for edge in thicket(width, height, (width * height / 50) as usize, 14.0) {
            list.push(ScreenSegment {
                a: edge.a,
                b: edge.b,
                depth_a: 1.0,
                depth_b: 1.0,
            });
        }
        let mut colours = Stream::new(99 + seed as u64);
        let colour = |_| {
            Vec3::new(
                colours.unit(),
                3.0 + spread * colours.unit(),
                0.01 * colours.unit(),
            )
        };
        scatter(&mut [&mut fitted, &mut mean], density, &mut stream, colour);
        let mut pictures = [Picture::new(width, height), Picture::new(width, height)];
        for (image, picture) in [&mut fitted, &mut mean].into_iter().zip(&mut pictures) {
            image.rasterize(&list, None);
            image.classify();
            image.reach();
            image.interpolate(picture);
        }
        // The same for any number of bands.
        let mut banded = Picture::new(width, height);
        fitted
            .interpolate_bands(&mut banded, 3)
            .for_each(|band| band.run());
        let kernel = Kernel::PEAKED;
        let mean = |pixel: (u32, u32)| {
            let (x, y) = pixel;
            let known = pictures[1].is_coloured(x, y) && fitted.class(x, y) != PixelClass::Complex;
            known.then(|| Mean {
                place: centroid(&fitted, pixel, &kernel),
                luminance: luminance(pictures[1].pixel(x, y)),
            })
        };
        for pixel in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let (x, y) = pixel;
            let found = pictures[0].pixel(x, y);
            assert_eq!(banded.pixel(x, y), found, "({x}, {y}) in bands");
            assert_eq!(
                pictures[0].is_coloured(x, y),
                pictures[1].is_coloured(x, y),
                "({x}, {y})"
            );
            assert_eq!(pictures[0].priorities(y), pictures[1].priorities(y), "row {y}");
            let Some(own) = mean(pixel) else {
                assert_eq!(found, pictures[1].pixel(x, y), "({x}, {y}) keeps what it has");
                complex += usize::from(fitted.class(x, y) == PixelClass::Complex);
                continue;
            };
            let around = [(-2, 0), (2, 0), (0, -2), (0, 2)].map(|d| {
                let there = beside(&fitted, pixel, d).filter(|_| reaches(&fitted, pixel, d))?;
                let other = mean(there)?;
                let place = [other.place[0] + f64::from(d.0), other.place[1] + f64::from(d.1)];
                Some(Mean { place, ..other })
            });
            by_class[usize::from(fitted.class(x, y) == PixelClass::Simple)] += 1;
            let factor = factor(own, around, &kernel);
            limited += usize::from((factor - 1.0).abs() == MOST);
            let expected = pictures[1].pixel(x, y) * factor as f32;
            let error = (found - expected).abs().max_element();
            assert!(
                error <= 1e-3 * expected.max_element(),
                "({x}, {y}): {found} instead of {expected}"
            );
        }
    }
    println!("corrected empty and simple pixels: {by_class:?}, at the limit {limited}; complex: {complex}");
    assert!(
        by_class.iter().all(|&n| n > 500) && complex > 100 && limited > 100,
        "all cases: {by_class:?}, {limited}, {complex}"
    );
}
