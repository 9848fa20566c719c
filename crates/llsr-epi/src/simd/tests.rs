//! Every level gives the bits of the portable one.

use glam::{Vec2, Vec3};
use llsr_testkit::epi::windows::Stream;

use super::Level;
use crate::image::EdgePointImage;
use crate::{EdgeList, Occlusion, Picture, Point, SampleValues, ScreenSegment, Settings};

/// Sizes on both sides of words, vectors and tiles.
const SIZES: [(u32, u32); 10] = [
    (1, 1),
    (5, 3),
    (63, 9),
    (64, 8),
    (65, 7),
    (257, 12),
    (300, 40),
    (512, 16),
    (1030, 11),
    (2070, 5),
];

/// Everything that the passes leave behind, as bits.
fn rebuilt(
    level: Level,
    (width, height): (u32, u32),
    seed: u64,
    settings: Settings,
    passes: usize,
) -> (Vec<u32>, Vec<u32>) {
    let mut stream = Stream::new(seed);
    let mut image = EdgePointImage::with_level(width, height, settings, level).unwrap();
    let mut edges = EdgeList::new(width, height);
    let size = Vec2::new(width as f32, height as f32);
    let mut unit = || Vec2::new(stream.unit(), stream.unit());
    for _ in 0..width * height / 20 + 1 {
        let a = unit() * size;
        let b = a + (unit() - 0.5) * 20.0;
        edges.push(ScreenSegment {
            a,
            b,
            depth_a: 0.5 + unit().x * 2.0,
            depth_b: 1.5,
        });
    }
    for _ in 0..width * height / 4 + 1 {
        let colour = Vec3::new(unit().x, unit().y * 100.0, unit().x * 1e-3);
        image.insert(&Point {
            position: unit() * size,
            depth: 1.0 + unit().x,
            colour,
        });
    }
    image.rasterize(&edges, Some(Occlusion::default()));
    let mut picture = Picture::new(width, height);
    image.classify();
    image.reach();
    image.interpolate(&mut picture);
    let mut facts = Vec::new();
    for y in 0..height {
        facts.extend((0..width).map(|x| {
            u32::from(image.edge(x, y).bits()) << 16 | u32::from(picture.priorities(y)[x as usize])
        }));
        facts.extend((0..width).map(|x| image.reach_mask(x, y)));
        facts.extend((0..width).map(|x| u32::from(picture.is_coloured(x, y))));
    }
    // Words of pixels with one value, and with many.
    let value = |i: u32| {
        if (i / width / 9).is_multiple_of(2) {
            i % width / 70
        } else {
            i.wrapping_mul(0x9e37_79b9)
        }
    };
    let values: Vec<u32> = (0..width * height).map(value).collect();
    let of_samples = SampleValues {
        values: &values,
        stride: width as usize,
    };
    for band in image.donor_bands(&mut picture, of_samples, 2) {
        band.run(|row| {
            facts.extend(row.values);
            facts.extend(row.complex.iter().map(|&word| word as u32));
            row.colours.green.iter_mut().for_each(|green| *green *= 0.5);
        });
    }
    image.fill(&mut picture, passes);
    image.filter_complex(&mut picture, |x, y| Vec3::new(x as f32, y as f32, 1.0));
    let colours = (0..height)
        .flat_map(|y| picture.row(y))
        .flatten()
        .map(|c| c.to_bits())
        .collect();
    (facts, colours)
}

#[test]
fn all_levels_give_the_same_bits() {
    let levels = Level::available();
    println!("levels: {levels:?}");
    let cases = SIZES.into_iter().enumerate();
    for ((seed, size), linear) in cases.flat_map(|case| [(case, false), (case, true)]) {
        let settings = Settings {
            linear,
            ..Settings::default()
        };
        let portable = rebuilt(Level::Portable, size, seed as u64, settings, 2);
        assert!(
            portable.1.iter().any(|&bits| bits != 0),
            "{size:?}: the picture is not black"
        );
        for &level in &levels[1..] {
            let wide = rebuilt(level, size, seed as u64, settings, 2);
            assert_eq!(
                wide.0, portable.0,
                "{level:?}, {size:?}: codes, masks, priorities"
            );
            assert_eq!(wide.1, portable.1, "{level:?}, {size:?}: colours");
        }
    }
}

#[test]
fn pixels_without_a_colour_lend_nothing() {
    // What stands in their place must not matter, not even if it is no number.
    let mut without = 0;
    for (level, size) in Level::available()
        .into_iter()
        .flat_map(|l| SIZES.map(|size| (l, size)))
    {
        let with_fallback = |fallback| {
            let settings = Settings {
                fallback,
                ..Settings::default()
            };
            rebuilt(level, size, 5, settings, 0).1
        };
        let (black, none) = (with_fallback(Vec3::ZERO), with_fallback(Vec3::NAN));
        for (&black, &none) in black.iter().zip(&none) {
            let left_out = f32::from_bits(none).is_nan();
            assert!(
                left_out || none == black,
                "{level:?}, {size:?}: {none:#x}, {black:#x}"
            );
            assert!(
                !left_out || black == 0,
                "{level:?}, {size:?}: {black:#x} became no number"
            );
            without += usize::from(left_out);
        }
    }
    assert!(without > 300, "only {without} components without a colour");
}

/// A coordinate in the frame around a picture: anywhere, or on a border between eighths, halves or pixels.
fn coordinate(stream: &mut Stream, size: u32) -> f32 {
    let grain = [1, 32, 128, 256][stream.below(4) as usize];
    let steps = (size + 4) * 256 / grain;
    (stream.below(steps + 1) * grain) as f32 / 256.0 - 2.0
}

#[test]
fn all_levels_mark_the_same_crossings() {
    // Edges of all lengths and depths, in bands, with and without half-pixel lines and limits; lists that end within a block.
    let mut stream = Stream::new(71);
    let mut marked = 0;
    for round in 0..160u32 {
        let (width, height) = SIZES[(round % 10) as usize];
        let half_lines = round % 3 != 0;
        let mut edges = EdgeList::new(width, height);
        for _ in 0..stream.below(200) {
            let a = Vec2::new(coordinate(&mut stream, width), coordinate(&mut stream, height));
            let b = match stream.below(6) {
                0 => Vec2::new(a.x, coordinate(&mut stream, height)),
                1 => Vec2::new(coordinate(&mut stream, width), a.y),
                2 => Vec2::new(coordinate(&mut stream, width), coordinate(&mut stream, height)),
                _ => a + 4.0 * Vec2::new(stream.unit() - 0.5, stream.unit() - 0.5),
            };
            let mut depth =
                || [0.0, f32::INFINITY, 1e-35, 1.0, 2.0 * stream.unit()][stream.below(5) as usize];
            let (depth_a, depth_b) = (depth(), depth());
            edges.push(ScreenSegment {
                a,
                b,
                depth_a,
                depth_b,
            });
        }
        let settings = Settings {
            half_lines,
            ..Settings::default()
        };
        let occlusion = (round % 4 != 1).then(Occlusion::default);
        let points: Vec<Point> = (0..width * height / 8)
            .map(|_| Point {
                position: Vec2::new(stream.unit(), stream.unit()) * Vec2::new(width as f32, height as f32),
                depth: [f32::INFINITY, 0.5 + stream.unit()][usize::from(stream.below(8) > 0)],
                colour: Vec3::ONE,
            })
            .collect();
        let draw = |level| {
            let mut image = EdgePointImage::with_level(width, height, settings, level).unwrap();
            for point in &points {
                image.insert(point);
            }
            let bands = 1 + round as usize % 4;
            image
                .rasterize_bands(&edges, occlusion, bands)
                .for_each(|band| band.run());
            let all = (
                image.crossings.horizontal.clone(),
                image.crossings.vertical.clone(),
            );
            image
                .rasterize_bands(&edges, occlusion, bands)
                .for_each(|band| band.whole_lines().run());
            for y in 0..=height {
                let start = y as usize * image.crossings.lines * image.crossings.stride;
                let line = start..start + width as usize;
                assert!(
                    image.crossings.above(y as usize)[..width as usize] == all.0[line],
                    "{level:?}, round {round}, line {y}: whole lines are those among all"
                );
            }
            for y in 0..height as usize {
                let start = y * image.crossings.lines * (image.crossings.stride + 1);
                let line = start..start + width as usize + 1;
                assert!(
                    image.crossings.left(y)[..width as usize + 1] == all.1[line],
                    "{level:?}, round {round}, row {y}: whole lines are those among all"
                );
                if half_lines {
                    let none = |line: &[u8]| line.iter().all(|&byte| byte == 0);
                    assert!(
                        none(image.crossings.through(y)) && none(image.crossings.middle(y)),
                        "{level:?}, round {round}, row {y}: no half-pixel lines"
                    );
                }
            }
            all
        };
        let portable = draw(Level::Portable);
        marked += portable.0.iter().filter(|&&byte| byte != 0).count();
        for level in Level::available() {
            assert!(
                draw(level) == portable,
                "{level:?}, round {round}: {width}x{height}, {} edges",
                edges.len()
            );
        }
    }
    assert!(marked > 3000, "only {marked} bytes of horizontal lines");
}

#[test]
fn edges_projected_together_are_those_projected_one_by_one() {
    let mut stream = Stream::new(72);
    let (mut kept, mut short, mut cut) = (0, 0, 0);
    for round in 0..60 {
        let (width, height) = SIZES[round % 10];
        let mut unit = || 2.0 * stream.unit() - 1.0;
        let eye = Vec3::new(unit(), unit(), 3.0);
        let aspect = width as f32 / height as f32;
        let projection = glam::camera::rh::proj::directx::perspective(0.9, aspect, 0.1, 100.0);
        let matrix = projection * glam::camera::rh::view::look_at_mat4(eye, Vec3::ZERO, Vec3::Y);
        // Some in the picture, some across its border or the plane of the eye, some with ends that coincide or are not finite.
        let segments: Vec<[Vec3; 2]> = (0..203)
            .map(|i| {
                let a = Vec3::new(unit(), unit(), unit()) * [0.3, 2.0, 8.0][i % 3];
                let b = match i % 7 {
                    0 => a,
                    1 => Vec3::new(unit(), unit(), unit()) * 8.0,
                    2 if i % 35 == 2 => Vec3::new(f32::NAN, unit(), f32::INFINITY),
                    3 => eye + (a - eye) * unit(),
                    _ => a + Vec3::new(unit(), unit(), unit()) * 0.1,
                };
                [a, b]
            })
            .collect();
        let facts = |list: &EdgeList| {
            let both = list.ends.iter().zip(&list.keys);
            let mut facts: Vec<_> = both.map(|(&ends, keys)| (ends, keys.map(f32::to_bits))).collect();
            facts.sort_unstable();
            (facts, list.len())
        };
        let mut together = EdgeList::new(width, height);
        together.extend_world(&matrix, &segments);
        // Groups that are not whole take the plain form.
        let mut single = EdgeList::new(width, height);
        for segment in &segments {
            single.extend_world(&matrix, std::slice::from_ref(segment));
        }
        assert_eq!(
            facts(&together),
            facts(&single),
            "round {round}: {width}x{height}"
        );
        kept += single.len();
        short += single.between;
        let border = |p: i32, size: u32| p == -512 || p == (size as i32 + 2) * 256;
        let at_border = |e: &&[i32; 4]| border(e[0].max(e[2]), width) || border(e[1].min(e[3]), height);
        cut += single.ends.iter().filter(at_border).count();
    }
    assert!(
        kept > 2000 && short > 20 && cut > 200,
        "{kept} edges kept, {short} of them between lines, {cut} cut"
    );
}
