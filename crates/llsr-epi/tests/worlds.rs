//! Whole pictures of flat worlds whose truth is known: inside and outside of overlapping outlines.

use glam::{Vec2, Vec3};
use llsr_epi::{EdgeList, EdgePointImage, Picture, PixelClass, Point, ScreenSegment, Settings};
use llsr_testkit::epi::windows::Stream;

const SIZE: u32 = 96;

/// Overlapping outlines; a point is bright if it lies in an odd number of them.
struct World {
    outlines: Vec<Vec<Vec2>>,
    /// Pixels with a sharp corner inside: their two crossings are joined by a straight line, as the paper has it, which cuts
    /// the corner off.
    cornered: Vec<(u32, u32)>,
}

impl World {
    /// Ellipses and stars between 8 and 60 pixels wide.
    fn new(stream: &mut Stream, count: u32) -> Self {
        let mut cornered = Vec::new();
        let outlines: Vec<Vec<Vec2>> = (0..count)
            .map(|_| {
                let centre = Vec2::new(stream.unit(), stream.unit()) * SIZE as f32;
                let radii = 4.0 + 26.0 * Vec2::new(stream.unit(), stream.unit());
                let (corners, dent) = if stream.below(2) == 0 {
                    (40, 1.0)
                } else {
                    (10, 0.5)
                };
                let turn = Vec2::from_angle(stream.unit() * 6.3);
                (0..corners)
                    .map(|i| {
                        let angle = i as f32 / corners as f32 * std::f32::consts::TAU;
                        let radius = if i % 2 == 1 { dent } else { 1.0 };
                        // On the grid of the rasteriser.
                        let p = centre + turn.rotate(radii * Vec2::from_angle(angle) * radius);
                        let p = (p * 256.0).round() / 256.0;
                        if corners == 10 {
                            cornered.push((p.x as u32, p.y as u32));
                        }
                        p
                    })
                    .collect()
            })
            .collect();
        Self { outlines, cornered }
    }

    fn is_bright(&self, p: Vec2) -> bool {
        let mut bright = false;
        for outline in &self.outlines {
            for (i, &a) in outline.iter().enumerate() {
                let b = outline[(i + 1) % outline.len()];
                if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y) {
                    bright = !bright;
                }
            }
        }
        bright
    }

    fn value(&self, p: Vec2) -> f32 {
        f32::from(u8::from(self.is_bright(p)))
    }

    /// Does the point lie in a spike or gap narrower than an eighth of a pixel? The image cannot know of that: both sides of it may
    /// cross the boundary of the pixel in the same eighth.
    fn is_narrow(&self, p: Vec2) -> bool {
        let here = self.is_bright(p);
        (0..8).any(|i| {
            let step = Vec2::from_angle(i as f32 * std::f32::consts::PI / 8.0) / 8.0;
            let differs = |sign: f32| {
                [1.0, 0.5]
                    .iter()
                    .any(|k| self.is_bright(p + sign * step * k) != here)
            };
            differs(1.0) && differs(-1.0)
        })
    }

    /// Bright share of a pixel, by 16x16 points.
    fn share(&self, x: u32, y: u32) -> f32 {
        let place = |i: u32| (i as f32 + 0.5) / 16.0;
        let points = (0..256).map(|i| Vec2::new(x as f32 + place(i % 16), y as f32 + place(i / 16)));
        points.map(|p| self.value(p)).sum::<f32>() / 256.0
    }

    fn image(&self, stream: &mut Stream, density: f32) -> EdgePointImage {
        let mut image = EdgePointImage::new(SIZE, SIZE, Settings::default()).unwrap();
        for y in 0..SIZE {
            for x in 0..SIZE {
                let position = Vec2::new(x as f32 + stream.unit(), y as f32 + stream.unit());
                let known = !self.cornered.contains(&(x, y)) && !self.is_narrow(position);
                if stream.unit() < density && known {
                    let colour = Vec3::splat(self.value(position));
                    image.insert(&Point {
                        position,
                        depth: 1.0,
                        colour,
                    });
                }
            }
        }
        let mut list = EdgeList::new(SIZE, SIZE);
        for outline in &self.outlines {
            for (i, &a) in outline.iter().enumerate() {
                list.push(ScreenSegment {
                    a,
                    b: outline[(i + 1) % outline.len()],
                    depth_a: 1.0,
                    depth_b: 1.0,
                });
            }
        }
        image.rasterize(&list, None);
        image
    }
}

/// Mean absolute errors of simple pixels, complex pixels and complex pixels before their filter.
#[derive(Debug, Default)]
struct Errors {
    simple: (f32, f32),
    complex: (f32, f32),
    before: (f32, f32),
}

fn mean((sum, count): (f32, f32)) -> f32 {
    sum / count
}

#[test]
fn nothing_leaks_and_edges_are_smooth() {
    let mut stream = Stream::new(41);
    let mut errors = Errors::default();
    let (mut empty, mut missing) = (0, 0);
    for round in 0..24 {
        let outlines = 1 + stream.below(8);
        let world = World::new(&mut stream, outlines);
        let mut image = world.image(&mut stream, [0.1, 0.3, 0.9][round % 3]);
        let mut picture = Picture::new(SIZE, SIZE);
        image.classify();
        image.reach();
        image.interpolate(&mut picture);
        image.fill(&mut picture, 2);
        let simple_filter = picture.clone();
        image.filter_complex(&mut picture, |_, _| Vec3::ONE);
        image.antialias(&mut picture);
        for y in 0..SIZE {
            for x in 0..SIZE {
                let found = picture.pixel(x, y).x;
                if !picture.is_coloured(x, y) {
                    missing += 1;
                    continue;
                }
                let add = |sum: &mut (f32, f32), found: f32, truth: f32| {
                    sum.0 += (found - truth).abs();
                    sum.1 += 1.0;
                };
                match image.class(x, y) {
                    PixelClass::Empty => {
                        empty += 1;
                        let truth = world.value(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                        assert!(
                            (found - truth).abs() < 1e-5,
                            "round {round}: a leak at ({x}, {y}): {found} instead of {truth}"
                        );
                    }
                    PixelClass::Simple => add(&mut errors.simple, found, world.share(x, y)),
                    PixelClass::Complex => {
                        let truth = world.share(x, y);
                        add(&mut errors.complex, found, truth);
                        add(&mut errors.before, simple_filter.pixel(x, y).x, truth);
                    }
                }
            }
        }
    }
    println!("{errors:?}, {empty} empty pixels, {missing} without a colour");
    let (simple, complex, before) = (mean(errors.simple), mean(errors.complex), mean(errors.before));
    println!("mean errors: simple {simple}, complex {complex}, before its filter {before}");
    assert!(
        empty > 150_000 && errors.simple.1 > 8_000.0 && errors.complex.1 > 400.0,
        "too little to judge"
    );
    assert!(missing * 50 < empty, "{missing} pixels without a colour");
    // An edge known to an eighth, with its ends in the middle of them, leaves 1/64 or so; the rest is unusable colours.
    assert!(simple < 0.05, "simple pixels: {simple}");
    assert!(
        complex < 0.8 * before,
        "complex pixels: {complex}, before {before}"
    );
}

#[test]
fn the_filter_for_complex_pixels_does_not_reach_over_edges() {
    // Outlines that keep their distance from each other, in a world whose inside is red and whose outside is green: a complex
    // pixel whose truth is one of both must not get the other, unless it is mixed itself.
    let mut stream = Stream::new(42);
    let (mut checked, mut pure) = (0, 0);
    for _ in 0..60 {
        let world = World::new(&mut stream, 2);
        let mut image = world.image(&mut stream, 0.8);
        let mut picture = Picture::new(SIZE, SIZE);
        image.classify();
        image.reach();
        image.interpolate(&mut picture);
        let before = picture.clone();
        image.filter_complex(&mut picture, |_, _| Vec3::ONE);
        for (x, y) in image.complex_pixels() {
            if !picture.is_coloured(x, y) {
                continue;
            }
            let (found, truth) = (picture.pixel(x, y).x, world.share(x, y));
            checked += 1;
            assert!(
                (-1e-5..=1.0 + 1e-5).contains(&found),
                "({x}, {y}): {found} is no mixture"
            );
            // Never farther from the truth than the plain average, up to the eighths of the edges.
            let (error, was) = ((found - truth).abs(), (before.pixel(x, y).x - truth).abs());
            pure += usize::from(error <= was + 0.02);
        }
    }
    println!("{pure} of {checked} complex pixels not worse than before");
    assert!(checked > 400, "only {checked} complex pixels");
    assert!(pure * 100 >= checked * 85, "{pure} of {checked}");
}
