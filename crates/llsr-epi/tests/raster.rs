//! Edges cross the boundaries of pixels where exact arithmetic says, whatever their position.

use glam::{Mat4, Vec2, Vec3};
use llsr_epi::{EdgeList, EdgePointImage, MAX_SIZE, PixelClass, Point, ScreenSegment, Settings, SizeError};
use llsr_testkit::epi::crossings::{Grid, UNITS, of_horizontal, of_vertical};
use llsr_testkit::epi::windows::Stream;

fn segment(a: Grid, b: Grid) -> ScreenSegment {
    let pixels = |p: Grid| Vec2::new(p.0 as f32, p.1 as f32) / UNITS as f32;
    ScreenSegment {
        a: pixels(a),
        b: pixels(b),
        depth_a: 1.0,
        depth_b: 1.0,
    }
}

fn rasterized(width: u32, height: u32, half_lines: bool, edges: &[ScreenSegment]) -> EdgePointImage {
    let settings = Settings {
        half_lines,
        ..Settings::default()
    };
    let mut image = EdgePointImage::new(width, height, settings).unwrap();
    let mut list = EdgeList::new(width, height);
    list.extend(edges);
    image.rasterize(&list, None);
    image
}

/// Compares all masks with the oracle's.
fn check(image: &EdgePointImage, edges: &[[Grid; 2]], what: &str) -> usize {
    let (width, height) = image.size();
    let all = |mask: &dyn Fn([Grid; 2]) -> u8| edges.iter().fold(0, |bits, &edge| bits | mask(edge));
    let half = UNITS / 2;
    let mut crossed = 0;
    for y in 0..=height {
        for x in 0..=width {
            let found = image.crossings(x, y);
            let corner = (i64::from(x) * UNITS, i64::from(y) * UNITS);
            let (inside_x, inside_y) = (x < width, y < height);
            if inside_x {
                let expected = all(&|e| of_horizontal(e, corner, UNITS));
                assert_eq!(found.above, expected, "{what}: above ({x}, {y}), {edges:?}");
            }
            if inside_y {
                let expected = all(&|e| of_vertical(e, corner, UNITS));
                assert_eq!(found.left, expected, "{what}: left of ({x}, {y}), {edges:?}");
            }
            if inside_x && inside_y && image.settings().half_lines {
                let expected = all(&|e| of_horizontal(e, (corner.0, corner.1 + half), UNITS));
                assert_eq!(found.through, expected, "{what}: through ({x}, {y}), {edges:?}");
                let expected = all(&|e| of_vertical(e, (corner.0 + half, corner.1), UNITS));
                assert_eq!(found.middle, expected, "{what}: middle of ({x}, {y}), {edges:?}");
            }
            crossed += usize::from(found != Default::default());
        }
    }
    crossed
}

/// A coordinate in the frame of two pixels: anywhere, on eighths, on half pixels or on boundaries.
fn coordinate(stream: &mut Stream, size: u32) -> i64 {
    let span = (i64::from(size) + 4) * UNITS;
    let grain = [1, 32, 128, 256][stream.below(4) as usize];
    i64::from(stream.below((span / grain) as u32 + 1)) * grain - 2 * UNITS
}

#[test]
fn crossings_are_exact_in_all_special_positions() {
    let mut stream = Stream::new(21);
    let mut crossed = 0;
    for round in 0..6_000 {
        let (width, height) = (1 + stream.below(9), 1 + stream.below(7));
        let edges: Vec<[Grid; 2]> = (0..1 + stream.below(3))
            .map(|_| {
                let mut point = || (coordinate(&mut stream, width), coordinate(&mut stream, height));
                let a = point();
                // Some are points, some run along an axis.
                let b = point();
                match round % 5 {
                    0 => [a, (a.0, b.1)],
                    1 => [a, (b.0, a.1)],
                    2 if round % 35 == 2 => [a, a],
                    _ => [a, b],
                }
            })
            .collect();
        let segments: Vec<_> = edges.iter().map(|&[a, b]| segment(a, b)).collect();
        let image = rasterized(width, height, round % 2 == 0, &segments);
        crossed += check(&image, &edges, &format!("round {round}"));
    }
    assert!(crossed > 20_000, "only {crossed} pixels with crossings");
}

#[test]
fn closed_outlines_enter_and_leave_every_pixel() {
    // Each pixel that an outline crosses has an even number of crossings, unless two fall into one eighth.
    let mut stream = Stream::new(22);
    let (mut simple, mut odd, mut all) = (0, 0, 0);
    for _ in 0..300 {
        let (width, height) = (24, 16);
        let corners: Vec<Grid> = (0..3 + stream.below(4))
            .map(|_| (coordinate(&mut stream, width), coordinate(&mut stream, height)))
            .collect();
        let edges: Vec<_> = (0..corners.len())
            .map(|i| segment(corners[i], corners[(i + 1) % corners.len()]))
            .collect();
        let mut image = rasterized(width, height, true, &edges);
        image.classify();
        for y in 0..height {
            for x in 0..width {
                let (here, right, below) = (
                    image.crossings(x, y),
                    image.crossings(x + 1, y),
                    image.crossings(x, y + 1),
                );
                let count = (here.above.count_ones() + here.left.count_ones())
                    + (right.left.count_ones() + below.above.count_ones());
                simple += usize::from(image.class(x, y) == PixelClass::Simple);
                odd += usize::from(count % 2 == 1);
                all += usize::from(count > 0);
            }
        }
    }
    assert!(
        simple * 10 > all * 7 && odd * 20 < all,
        "{simple} simple and {odd} odd pixels of {all}"
    );
}

#[test]
fn parts_outside_are_cut_off_and_nothing_else() {
    // Far ends: the line inside is that of the long segment, to an eighth.
    let mut stream = Stream::new(23);
    let (width, height) = (40u32, 30u32);
    let mut compared = 0;
    for round in 0..400 {
        let middle = Vec2::new(stream.unit() * 40.0, stream.unit() * 30.0);
        let direction = Vec2::from_angle(stream.unit() * 6.3);
        let reach = if round % 2 == 0 { 1e3 } else { 3e5 };
        let (a, b) = (middle - direction * reach, middle + direction * reach * 0.7);
        let long = ScreenSegment {
            a,
            b,
            depth_a: 1.0,
            depth_b: 1.0,
        };
        let image = rasterized(width, height, true, &[long]);
        for y in 0..height {
            let line = f64::from(y);
            let (a, b) = (a.as_dvec2(), b.as_dvec2());
            let t = (line - a.y) / (b.y - a.y);
            let x = a.x + (b.x - a.x) * t;
            // Nearly parallel lines and what lies at the border decide nothing.
            let slope = ((b.x - a.x) / (b.y - a.y)).abs();
            if !(0.5..f64::from(width) - 0.5).contains(&x) || slope > 20.0 || !(0.0..1.0).contains(&t) {
                continue;
            }
            let eighths: Vec<f64> = (0..width)
                .flat_map(|px| {
                    let mask = image.crossings(px, y).above;
                    (0..8)
                        .filter(move |i| mask >> i & 1 != 0)
                        .map(move |i| f64::from(px) + (f64::from(i) + 0.5) / 8.0)
                })
                .collect();
            let tolerance = 1.0 / 16.0 + 0.02 * (1.0 + slope);
            let ok = eighths.len() == 1 && (eighths[0] - x).abs() <= tolerance;
            assert!(ok, "round {round}, row {y}: {eighths:?}, not {x}");
            compared += 1;
        }
    }
    assert!(compared > 3_000, "only {compared} crossings compared");
}

/// A camera at the origin that looks along -z, 90 degrees wide.
const LOOK: Mat4 = Mat4::from_cols_array_2d(&[
    [1., 0., 0., 0.],
    [0., 1., 0., 0.],
    [0., 0., 0., -1.],
    [0., 0., 0.1, 0.],
]);

#[test]
fn edges_behind_and_through_the_plane_of_the_camera() {
    let (width, height) = (32, 32);
    let lists = |edges: &[[Vec3; 2]]| {
        let mut list = EdgeList::new(width, height);
        list.extend_world(&LOOK, edges);
        list
    };
    let behind = [
        [Vec3::new(-1.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 2.0)],
        [Vec3::new(0.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 3.0)],
        [Vec3::new(5.0, 0.0, -1.0), Vec3::new(9.0, 1.0, -2.0)],
        [Vec3::splat(f32::NAN), Vec3::NEG_Z],
        [Vec3::new(f32::INFINITY, 0.0, -1.0), Vec3::NEG_Z],
        [Vec3::splat(f32::MAX), Vec3::NEG_Z],
    ];
    assert_eq!(lists(&behind[..3]).len(), 0, "nothing is seen");
    // What is not finite must do no harm, and what is seen of a finite edge may stay.
    let mut image = EdgePointImage::new(width, height, Settings::default()).unwrap();
    image.rasterize(&lists(&behind), None);

    // Through the plane of the camera: as its part in front.
    let mut stream = Stream::new(24);
    let mut seen = 0;
    for _ in 0..300 {
        let mut unit = || 2.0 * stream.unit() - 1.0;
        let front = Vec3::new(unit(), unit(), -1.5 + unit());
        let back = Vec3::new(3.0 * unit(), 3.0 * unit(), 1.0 + unit().abs());
        // Cut by hand where the edge is about to leave the view: at depth 1e-3.
        let t = (-1e-3 - front.z) / (back.z - front.z);
        let cut = front + (back - front) * t;
        let mut images = [[front, back], [front, cut]].map(|edge| {
            let mut image = EdgePointImage::new(width, height, Settings::default()).unwrap();
            image.rasterize(&lists(&[edge]), None);
            image.classify();
            image
        });
        let [whole, part] = &mut images;
        let crossed = |image: &EdgePointImage| {
            (0..height)
                .flat_map(|y| (0..width).map(move |x| (x, y)))
                .filter(|&(x, y)| image.class(x, y) != PixelClass::Empty)
                .collect::<Vec<_>>()
        };
        let (whole, part) = (crossed(whole), crossed(part));
        // Rounding may move a crossing over a corner.
        let differ = whole.iter().filter(|p| !part.contains(p)).count()
            + part.iter().filter(|p| !whole.contains(p)).count();
        assert!(
            differ <= 4,
            "{front} to {back}: {differ} of {} pixels differ",
            whole.len()
        );
        seen += whole.len();
    }
    assert!(seen > 2_000, "only {seen} pixels crossed");
}

#[test]
fn a_million_edges_in_one_pixel_and_extreme_sizes() {
    let mut stream = Stream::new(25);
    let edges: Vec<ScreenSegment> = (0..1_000_000)
        .map(|_| {
            let mut point = || Vec2::new(3.0 + stream.unit(), 2.0 + stream.unit());
            let (a, b) = (point(), point());
            ScreenSegment {
                a,
                b,
                depth_a: 1.0,
                depth_b: 1.0,
            }
        })
        .collect();
    let mut image = rasterized(8, 8, true, &edges);
    image.classify();
    let counts = image.class_counts();
    assert_eq!(image.crossings(3, 2).through, 0xff, "crossed everywhere inside");
    assert!(counts.empty >= 64 - 9, "nothing far from the pixel: {counts:?}");

    for (width, height) in [(1, 1), (MAX_SIZE, 16), (16, MAX_SIZE), (3, 1), (1, 3)] {
        let across = ScreenSegment {
            a: Vec2::ZERO,
            b: Vec2::new(width as f32, height as f32),
            depth_a: 1.0,
            depth_b: 1.0,
        };
        let mut image = rasterized(width, height, true, &[across]);
        image.insert(&Point {
            position: Vec2::new(width as f32 - 0.1, 0.1),
            depth: 1.0,
            colour: Vec3::ONE,
        });
        let mut picture = llsr_epi::Picture::new(width, height);
        image.reconstruct(&mut picture);
        let counts = image.class_counts();
        let crossed = counts.simple + counts.complex;
        assert!(
            crossed >= width.max(height) as usize && crossed <= (width + height) as usize,
            "{width}x{height}: {counts:?}"
        );
        assert!(
            picture.is_coloured(width - 1, 0),
            "{width}x{height}: the sample shows"
        );
    }
    for (width, height, expected) in [
        (0, 5, SizeError::Zero),
        (5, 0, SizeError::Zero),
        (MAX_SIZE + 1, 5, SizeError::TooLarge),
    ] {
        let refused = EdgePointImage::new(width, height, Settings::default()).err();
        assert_eq!(refused, Some(expected), "{width}x{height}");
    }
}
