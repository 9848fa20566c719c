//! Fits of planes, beside planted planes and least squares in double precision.

use glam::{Vec2, Vec3};
use llsr_epi::{
    EdgeList, EdgePointImage, Kernel, Picture, PixelClass, Point, RegionSide, ScreenSegment, Settings,
};
use llsr_testkit::epi::edge_sets::thicket;
use llsr_testkit::epi::windows::Stream;

/// The ridge and the share that the documentation of the fit states.
const RIDGE: f64 = 1.0 / 128.0;
const FAR: f64 = 0.125;

fn image(width: u32, height: u32, linear: bool) -> EdgePointImage {
    let settings = Settings {
        linear,
        ..Settings::default()
    };
    EdgePointImage::new(width, height, settings).unwrap()
}

/// Samples in about `share` of the pixels, in the middle of a quarter where they are kept, coloured by their places.
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
            let quarter = Vec2::new(stream.unit(), stream.unit()) * 4.0;
            let position = Vec2::new(x as f32, y as f32) + (quarter.floor() + 0.5) / 4.0;
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

/// Place, value and weight.
type Weighted = ([f64; 2], f64, f64);

/// The weighted least-squares fit of luminance at the origin over its mean, by elimination.
fn least_squares(samples: &[Weighted]) -> f64 {
    let total: f64 = samples.iter().map(|s| s.2).sum();
    let mean_of = |f: &dyn Fn(&Weighted) -> f64| samples.iter().map(|s| s.2 * f(s)).sum::<f64>() / total;
    let (x, y, mean) = (mean_of(&|s| s.0[0]), mean_of(&|s| s.0[1]), mean_of(&|s| s.1));
    // Unknown: slopes along x and y.
    let (mut a, mut b) = ([[RIDGE, 0.0], [0.0, RIDGE]], [0.0; 2]);
    for &([px, py], value, weight) in samples {
        let (d, weight) = ([px - x, py - y], weight / total);
        for i in 0..2 {
            for j in 0..2 {
                a[i][j] += weight * d[i] * d[j];
            }
            b[i] += weight * d[i] * (value - mean);
        }
    }
    let factor = a[1][0] / a[0][0];
    let slope_y = (b[1] - factor * b[0]) / (a[1][1] - factor * a[0][1]);
    let slope_x = (b[0] - a[0][1] * slope_y) / a[0][0];
    let darkest = samples.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
    let brightest = samples.iter().map(|s| s.1).fold(0.0, f64::max);
    let ratio = darkest / brightest;
    let slack = f64::min(0.5 * (1.0 - ratio), ratio - 0.5).max(0.0);
    let fit = mean - slope_x * x - slope_y * y;
    if (fit / mean - 1.0).abs() > FAR {
        fit.clamp((1.0 - slack) * darkest, (1.0 + slack) * brightest) / mean
    } else {
        fit / mean
    }
}

#[test]
fn fits_are_least_squares_among_edges() {
    let (mut by_class, mut complex) = ([0; 2], 0);
    for (seed, (width, height, density)) in [(70, 40, 0.1), (300, 30, 0.5), (64, 64, 0.9)]
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
        let colour = |_| Vec3::new(colours.unit(), 3.0 + colours.unit(), 0.01 * colours.unit());
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
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let found = pictures[0].pixel(x, y);
            assert_eq!(banded.pixel(x, y), found, "({x}, {y}) in bands");
            assert_eq!(
                pictures[0].is_coloured(x, y),
                pictures[1].is_coloured(x, y),
                "({x}, {y})"
            );
            assert_eq!(pictures[0].priorities(y), pictures[1].priorities(y), "row {y}");
            if fitted.class(x, y) == PixelClass::Complex {
                assert_eq!(found, pictures[1].pixel(x, y), "complex ({x}, {y})");
                complex += 1;
                continue;
            }
            if !pictures[0].is_coloured(x, y) {
                continue;
            }
            let mask = fitted.reach_mask(x, y);
            let mut samples = Vec::new();
            for tap in 0..25u32 {
                let reached = tap == 12 || mask >> (tap - u32::from(tap > 12)) & 1 != 0;
                let (dx, dy) = (tap as i32 % 5 - 2, tap as i32 / 5 - 2);
                let (u, v) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
                if !reached || u >= width || v >= height || fitted.class(u, v) == PixelClass::Complex {
                    continue;
                }
                let Some(sample) = fitted.sample(u, v) else {
                    continue;
                };
                if fitted.edge(u, v).side(sample.position) != RegionSide::Primary {
                    continue;
                }
                let place = |d: i32, quarter: u8| f64::from(d) + (f64::from(quarter) + 0.5) / 4.0 - 0.5;
                let at = [place(dx, sample.position % 4), place(dy, sample.position / 4)];
                samples.push((
                    at,
                    sample.colour,
                    f64::from(kernel.weight(dx as isize, dy as isize)),
                ));
            }
            by_class[usize::from(fitted.class(x, y) == PixelClass::Simple)] += 1;
            let luminance =
                |c: Vec3| 0.2126 * f64::from(c.x) + 0.7152 * f64::from(c.y) + 0.0722 * f64::from(c.z);
            let one: Vec<_> = samples
                .iter()
                .map(|&(at, c, weight)| (at, luminance(c), weight))
                .collect();
            let expected = pictures[1].pixel(x, y) * least_squares(&one) as f32;
            let error = (found - expected).abs().max_element();
            assert!(
                error <= 1e-3 * expected.max_element(),
                "({x}, {y}): {found} instead of {expected} from {one:?}"
            );
        }
    }
    println!("fitted empty and simple pixels: {by_class:?}, complex: {complex}");
    assert!(
        by_class.iter().all(|&n| n > 500) && complex > 100,
        "all classes: {by_class:?}, {complex}"
    );
}
