//! A shaded disc before a gradient, rebuilt from one sample in ten pixels and the disc's outline.

use glam::{Vec2, Vec3};
use llsr_epi::{EdgeList, EdgePointImage, Picture, Point, ScreenSegment, Settings, SizeError};

const SIZE: u32 = 48;

/// What a renderer would shade: brightness and depth.
fn shade(p: Vec2) -> (f32, f32) {
    let from_centre = (p - 24.0) / 15.3;
    match from_centre.length_squared() < 1.0 {
        true => (0.9 - 0.3 * from_centre.y, 1.0),
        false => (0.4 * p.x / SIZE as f32, 2.0),
    }
}

fn main() -> Result<(), SizeError> {
    let mut image = EdgePointImage::new(SIZE, SIZE, Settings::default())?;
    // One point in ten pixels, scattered by a multiplicative sequence.
    for i in 0..SIZE * SIZE / 10 {
        let fraction = |factor: f32| (i as f32 * factor).fract() * SIZE as f32;
        let position = Vec2::new(fraction(0.754_877_7), fraction(0.569_840_3));
        let (value, depth) = shade(position);
        image.insert(&Point {
            position,
            depth,
            colour: Vec3::splat(value),
        });
    }

    let mut edges = EdgeList::new(SIZE, SIZE);
    let rim = |i: u32| 24.0 + 15.3 * Vec2::from_angle(i as f32 / 60.0 * std::f32::consts::TAU);
    for i in 0..60 {
        edges.push(ScreenSegment {
            a: rim(i),
            b: rim((i + 1) % 60),
            depth_a: 1.0,
            depth_b: 1.0,
        });
    }

    image.rasterize(&edges, None);
    let mut picture = Picture::new(SIZE, SIZE);
    image.reconstruct(&mut picture);

    for y in (0..SIZE).step_by(2) {
        let line: String = (0..SIZE)
            .map(|x| {
                let value = 0.5 * (picture.pixel(x, y).x + picture.pixel(x, y + 1).x);
                char::from(b" .:-=+*#%@"[(value * 8.0) as usize % 10])
            })
            .collect();
        println!("{line}");
    }
    println!("{:?}", image.class_counts());
    Ok(())
}
