//! Every level gives the bits of the portable one.

use glam::{Vec2, Vec3};
use llsr_testkit::epi::windows::Stream;

use super::Level;
use crate::image::EdgePointImage;
use crate::{EdgeList, Occlusion, Picture, Point, ScreenSegment, Settings};

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
fn rebuilt(level: Level, (width, height): (u32, u32), seed: u64, linear: bool) -> (Vec<u32>, Vec<u32>) {
    let mut stream = Stream::new(seed);
    let settings = Settings {
        linear,
        ..Settings::default()
    };
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
            tag: 7,
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
        let portable = rebuilt(Level::Portable, size, seed as u64, linear);
        assert!(
            portable.1.iter().any(|&bits| bits != 0),
            "{size:?}: the picture is not black"
        );
        for &level in &levels[1..] {
            let wide = rebuilt(level, size, seed as u64, linear);
            assert_eq!(
                wide.0, portable.0,
                "{level:?}, {size:?}: codes, masks, priorities"
            );
            assert_eq!(wide.1, portable.1, "{level:?}, {size:?}: colours");
        }
    }
}
