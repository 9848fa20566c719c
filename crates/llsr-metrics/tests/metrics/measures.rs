//! The other measures on planted differences, the display form, and wrong input.

use crate::common::{busy, picture};
use llsr_metrics::{Error, Image, Options, compare, heat_colour, linear_rmse, percentile};
use proptest::prelude::*;

const SIZE: usize = 16;

fn image(pixels: &[[f32; 3]]) -> Image<'_> {
    Image::new(SIZE, SIZE, pixels).expect("size fits")
}

#[test]
fn planted_difference() {
    // B is 2 everywhere; A is 2.5 in a quarter of the pixels. White is 2, so only one side is clamped.
    let b = picture(SIZE, SIZE, |_, _| [2.0; 3]);
    let a = picture(
        SIZE,
        SIZE,
        |x, y| if x < 8 && y < 8 { [1.5; 3] } else { [2.0; 3] },
    );
    let c = compare(image(&a), image(&b), &Options::default()).expect("comparable");
    assert_eq!(c.white, 2.0, "98th percentile of a flat picture");
    assert!((c.rmse - 0.25).abs() < 1e-12, "{}", c.rmse);
    assert!((c.rel_rmse - 0.125).abs() < 1e-12, "{}", c.rel_rmse);
    // sRGB of 0.75 is 1.055 * 0.75^(1/2.4) - 0.055 = 0.880825.
    let d = 1.0 - 0.880_825;
    assert!((c.max - d).abs() < 1e-5, "{}", c.max);
    let psnr = -10.0 * (0.25 * d * d).log10();
    assert!((c.psnr - psnr).abs() < 1e-3, "{} for {psnr}", c.psnr);
    assert_eq!(c.flip, c.map.mean(), "the mean of the map");
    assert_eq!(
        linear_rmse(image(&a), image(&b)),
        Ok((c.rmse, c.rel_rmse)),
        "the cheap way"
    );
}

#[test]
fn equal_images() {
    let b = busy(SIZE, SIZE, 3);
    let c = compare(image(&b), image(&b), &Options::default()).expect("comparable");
    assert_eq!(
        (c.rmse, c.rel_rmse, c.max, c.flip),
        (0.0, 0.0, 0.0, 0.0),
        "no difference"
    );
    assert_eq!(c.psnr, f64::INFINITY, "no noise");
}

#[test]
fn black_references() {
    let black = picture(SIZE, SIZE, |_, _| [0.0; 3]);
    let grey = picture(SIZE, SIZE, |_, _| [0.5; 3]);
    let c = compare(image(&grey), image(&black), &Options::default()).expect("comparable");
    assert_eq!(
        (c.white, c.rel_rmse),
        (1.0, f64::INFINITY),
        "no scale in the reference"
    );
    let c = compare(image(&black), image(&black), &Options::default()).expect("comparable");
    assert_eq!((c.rel_rmse, c.flip), (0.0, 0.0), "two black pictures are equal");
    // One bright pixel in a black picture: the percentile is 0, the largest value serves.
    let spark = picture(
        SIZE,
        SIZE,
        |x, y| if (x, y) == (3, 9) { [8.0; 3] } else { [0.0; 3] },
    );
    let c = compare(image(&black), image(&spark), &Options::default()).expect("comparable");
    assert_eq!((c.white, c.max), (8.0, 1.0), "white of a nearly black picture");
    let (x, y) = c.map.largest();
    assert!(
        x.abs_diff(3) <= 2 && y.abs_diff(9) <= 2,
        "the error is around the spark, not at ({x}, {y})"
    );
}

#[test]
fn extreme_values_stay_finite() {
    let huge = picture(SIZE, SIZE, |_, _| [f32::MAX; 3]);
    let tiny = picture(SIZE, SIZE, |_, _| [1e-45, -f32::MAX, 0.0]);
    for (a, b) in [(&huge, &tiny), (&tiny, &huge)] {
        let c = compare(image(a), image(b), &Options::default()).expect("comparable");
        assert!(
            c.rmse.is_finite() && (0.0..=1.0).contains(&c.flip) && (0.0..=1.0).contains(&c.max),
            "{c:?}"
        );
    }
}

#[test]
fn non_finite_pixels_are_counted() {
    let good = busy(SIZE, SIZE, 1);
    let mut a = good.clone();
    a[5 * SIZE + 2][1] = f32::NAN;
    a[9 * SIZE + 3] = [f32::INFINITY; 3];
    let mut b = good.clone();
    b[4 * SIZE + 15][2] = f32::NEG_INFINITY;
    let found = compare(image(&a), image(&b), &Options::default()).expect_err("not comparable");
    assert_eq!(
        found,
        Error::NonFinite {
            a: 2,
            b: 1,
            first: (15, 4)
        },
        "counts and place"
    );
    assert_eq!(linear_rmse(image(&a), image(&b)), Err(found), "the cheap way");
    let text = found.to_string();
    assert!(text.contains('2') && text.contains("column 15, row 4"), "{text}");
}

#[test]
fn wrong_sizes() {
    let pixels = busy(SIZE, SIZE, 1);
    assert!(
        matches!(Image::new(0, 4, &pixels), Err(Error::Empty { .. })),
        "no columns"
    );
    assert!(
        matches!(Image::new(4, 0, &[]), Err(Error::Empty { .. })),
        "no rows"
    );
    assert!(
        matches!(
            Image::new(4, 4, &pixels),
            Err(Error::PixelCount { found: 256, .. })
        ),
        "too many"
    );
    assert!(
        matches!(Image::new(usize::MAX, 2, &pixels), Err(Error::PixelCount { .. })),
        "product overflows"
    );
    let wide = Image::new(32, 8, &pixels).expect("size fits");
    let found = compare(wide, image(&pixels), &Options::default()).expect_err("not comparable");
    assert_eq!(
        found,
        Error::Sizes {
            a: (32, 8),
            b: (16, 16)
        },
        "same count, other shape"
    );
}

#[test]
fn white_is_checked() {
    let pixels = busy(SIZE, SIZE, 1);
    for white in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let options = Options {
            white: Some(white),
            ..Options::default()
        };
        let found = compare(image(&pixels), image(&pixels), &options);
        assert!(matches!(found, Err(Error::White(_))), "{white}");
    }
}

#[test]
fn percentile_interpolates_between_ranks() {
    // 0, 1, ... 767 in a scrambled order.
    let pixels = picture(SIZE, SIZE, |x, y| {
        let i = (y * SIZE + x) * 3;
        [0, 1, 2].map(|c| ((i + c) * 5 % 768) as f32)
    });
    for (q, expected) in [
        (0.0, 0.0),
        (100.0, 767.0),
        (50.0, 383.5),
        (98.0, 751.66),
        (-3.0, 0.0),
        (200.0, 767.0),
    ] {
        let found = percentile(image(&pixels), q);
        assert!((found - expected).abs() < 1e-3, "{q}%: {found} for {expected}");
    }
}

#[test]
fn heat_gets_lighter() {
    // Ends and middle of matplotlib's magma: (0, 0, 4), (183, 55, 121), (252, 253, 191).
    for (t, expected) in [
        (0.0, [0, 0, 4]),
        (128.0 / 255.0, [183, 55, 121]),
        (1.0, [252, 253, 191]),
    ] {
        for (f, e) in heat_colour(t).into_iter().zip(expected) {
            assert!(i16::from(f).abs_diff(e) <= 5, "{:?} at {t}", heat_colour(t));
        }
    }
    let lightness = |i: u16| {
        let [r, g, b] = heat_colour(f32::from(i) / 64.0).map(f32::from);
        0.21 * r + 0.72 * g + 0.07 * b
    };
    assert!(
        (0..64).all(|i| lightness(i) < lightness(i + 1)),
        "lightness grows with the error"
    );
    assert_eq!(heat_colour(f32::NAN), heat_colour(0.0), "NaN");
    assert_eq!(
        (heat_colour(-2.0), heat_colour(9.0)),
        (heat_colour(0.0), heat_colour(1.0)),
        "clamped"
    );
}

proptest! {
    /// Scaling both images changes nothing but the linear difference.
    #[test]
    fn display_measures_have_no_unit(scale in 1e-3f32..1e3, seed in 1..9usize) {
        let (a, b) = (busy(SIZE, SIZE, seed), busy(SIZE, SIZE, seed + 1));
        let scaled = |p: &[[f32; 3]]| p.iter().map(|v| v.map(|c| c * scale)).collect::<Vec<_>>();
        let plain = compare(image(&a), image(&b), &Options::default()).expect("comparable");
        let (a, b) = (scaled(&a), scaled(&b));
        let other = compare(image(&a), image(&b), &Options::default()).expect("comparable");
        prop_assert!((other.rmse / f64::from(scale) - plain.rmse).abs() < 1e-5 * plain.rmse);
        prop_assert!((other.rel_rmse - plain.rel_rmse).abs() < 1e-5 * plain.rel_rmse);
        prop_assert!((other.psnr - plain.psnr).abs() < 1e-2);
        prop_assert!((other.flip - plain.flip).abs() < 1e-4);
    }

    /// More of the same difference is never a smaller measure.
    #[test]
    fn measures_grow_with_the_difference(seed in 1..9usize, share in 0.05f32..0.9) {
        let (far, b) = (busy(SIZE, SIZE, seed), busy(SIZE, SIZE, seed + 1));
        let near: Vec<_> =
            far.iter().zip(&b).map(|(f, b)| [0, 1, 2].map(|c| b[c] + share * (f[c] - b[c]))).collect();
        let options = Options { white: Some(1.0), ..Options::default() };
        let near = compare(image(&near), image(&b), &options).expect("comparable");
        let far = compare(image(&far), image(&b), &options).expect("comparable");
        prop_assert!(near.rmse < far.rmse && near.psnr > far.psnr && near.max <= far.max);
        prop_assert!(near.flip < far.flip, "{} and {}", near.flip, far.flip);
    }
}
