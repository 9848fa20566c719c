//! The fast passes do what the paper's forms do, in any number of bands.

use glam::{Vec2, Vec3};
use llsr_epi::{
    CELL, EdgeList, EdgePointImage, Kernel, NO_DONOR, Occlusion, Picture, PixelClass, Point, RegionSide,
    SampleValues, ScreenSegment, Settings, UNREACHED, paper,
};
use llsr_testkit::epi::edge_sets::{hatching, thicket};
use llsr_testkit::epi::windows::Stream;

const SIZES: [(u32, u32); 6] = [(1, 1), (7, 5), (64, 9), (130, 33), (300, 21), (31, 70)];

/// Edges and samples at random, from few to many of both.
fn scene(width: u32, height: u32, seed: u64) -> (EdgePointImage, EdgeList) {
    let mut stream = Stream::new(seed);
    let settings = Settings {
        fallback: Vec3::new(9.0, 8.0, 7.0),
        kernel: if seed.is_multiple_of(2) {
            Kernel::PEAKED
        } else {
            Kernel::new(8.0, 3.0, 1.0).unwrap()
        },
        ..Settings::default()
    };
    let mut image = EdgePointImage::new(width, height, settings).unwrap();
    let count = width * height / [60, 25, 8][seed as usize % 3];
    let mut edges = thicket(width, height, count as usize, 14.0);
    if seed % 4 == 3 {
        edges = hatching(width, height, 2.5);
    }
    let mut list = EdgeList::new(width, height);
    for edge in edges {
        list.push(ScreenSegment {
            a: edge.a,
            b: edge.b,
            depth_a: 0.7 + stream.unit(),
            depth_b: 0.7 + stream.unit(),
        });
    }
    let density = [0.05, 0.4, 0.9][(seed / 3) as usize % 3];
    for y in 0..height {
        for x in 0..width {
            if stream.unit() < density {
                let position = Vec2::new(x as f32 + stream.unit(), y as f32 + stream.unit());
                let colour = Vec3::new(stream.unit(), 50.0 * stream.unit(), 1e-3 * stream.unit());
                let depth = 1.0 + 0.2 * stream.unit();
                image.insert(&Point {
                    position,
                    depth,
                    colour,
                });
            }
        }
    }
    (image, list)
}

/// The nearest samples, in reach or `all`, found pixel by pixel through what the image says of single pixels.
fn donor(image: &EdgePointImage, x: u32, y: u32, all: bool) -> Option<Vec<(u32, u32)>> {
    let (width, height) = image.size();
    let all = all || image.class(x, y) == PixelClass::Complex;
    let mut found: Option<(i32, Vec<(u32, u32)>)> = None;
    for i in 0..25i32 {
        let (dx, dy) = (i % 5 - 2, i / 5 - 2);
        let (u, v) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
        if u >= width || v >= height {
            continue;
        }
        let bit = if i > 12 { i - 1 } else { i };
        let Some(sample) = image.sample(u, v) else {
            continue;
        };
        let code = image.edge(u, v);
        let usable =
            image.class(u, v) != PixelClass::Complex && code.side(sample.position) == RegionSide::Primary;
        let reached = i == 12 || image.reach_mask(x, y) >> bit & 1 != 0;
        if all || usable && reached {
            let distance = dx * dx + dy * dy;
            match &mut found {
                Some((nearest, all)) if *nearest == distance => all.push((u, v)),
                Some((nearest, _)) if *nearest < distance => {}
                _ => found = Some((distance, vec![(u, v)])),
            }
        }
    }
    found.map(|(_, all)| all)
}

#[test]
fn donors_are_the_nearest_samples_in_reach() {
    let (mut none, mut some) = (0, 0);
    for seed in 0..18 {
        let (width, height) = SIZES[seed as usize % SIZES.len()];
        let (mut image, edges) = scene(width, height, seed);
        image.rasterize(&edges, None);
        image.classify();
        image.reach();
        let mut picture = Picture::new(width, height);
        image.interpolate(&mut picture);
        let stride = width as usize + 3;
        // Each sample its own value, or pieces of picture with one value.
        let value = |n: u32| match seed % 3 {
            0 => n,
            1 => n % stride as u32 / 90 + 100 * (n / stride as u32 / 20),
            _ => n % stride as u32 / 150,
        };
        let values: Vec<u32> = (0..stride as u32 * height).map(value).collect();
        let of_samples = SampleValues {
            values: &values,
            stride,
        };
        let (mut rows, mut complex) = (Vec::new(), Vec::new());
        for band in image.donor_bands(&mut picture, of_samples, 3) {
            band.run(|row| {
                assert_eq!(rows.len(), row.y as usize, "rows come in order");
                rows.push(row.values.to_vec());
                complex.push(row.complex.to_vec());
                row.colours.red.fill(row.y as f32);
            });
        }
        for y in 0..height {
            for x in 0..width {
                let found = rows[y as usize][x as usize];
                let what = format!("seed {seed}, ({x}, {y})");
                let is_complex = complex[y as usize][x as usize / 64] >> (x % 64) & 1 != 0;
                assert_eq!(is_complex, image.class(x, y) == PixelClass::Complex, "{what}");
                assert_eq!(picture.pixel(x, y).x, y as f32, "{what}: the row was handed out");
                match donor(&image, x, y, false).or_else(|| donor(&image, x, y, true)) {
                    None => {
                        none += 1;
                        assert_eq!(found, NO_DONOR, "{what}");
                    }
                    Some(nearest) => {
                        some += 1;
                        let numbers = nearest.iter().map(|&(u, v)| value(v * stride as u32 + u));
                        assert!(
                            numbers.clone().any(|n| n == found),
                            "{what}: {found} of {nearest:?}"
                        );
                    }
                }
            }
        }
    }
    assert!(none > 100 && some > 1000, "{none} and {some}");
}

#[test]
fn interpolation_and_priorities_are_the_papers() {
    let (mut pixels, mut unreached) = (0, 0);
    for seed in 0..18 {
        let (width, height) = SIZES[seed as usize % SIZES.len()];
        let (mut image, edges) = scene(width, height, seed);
        image.rasterize(&edges, None);
        let mut picture = Picture::new(width, height);
        image.classify();
        image.reach();
        image.interpolate(&mut picture);
        let kernel = image.settings().kernel;
        for y in 0..height {
            for x in 0..width {
                let (found, priority) = (picture.pixel(x, y), picture.priorities(y)[x as usize]);
                let what = format!("seed {seed}, ({x}, {y})");
                let Some((colour, weight)) = paper::interpolate(&image, x, y) else {
                    assert_eq!(
                        (found, priority),
                        (image.settings().fallback, UNREACHED),
                        "{what}"
                    );
                    assert!(!picture.is_coloured(x, y), "{what}");
                    unreached += 1;
                    continue;
                };
                assert!(picture.is_coloured(x, y), "{what}");
                let error = (found - colour).abs();
                assert!(
                    error.cmple(1e-5 * colour + 1e-9).all(),
                    "{what}: {found} instead of {colour}"
                );
                pixels += 1;
                if priority > 0 {
                    // Falls in a line from 254 with no weight to 1 with all weight but that of the centre.
                    let expected = 254.0 - 253.0 * weight / (1.0 - kernel.weight(0, 0));
                    let expected = expected.max(1.0);
                    assert!(
                        (f32::from(priority) - expected).abs() <= 1.01,
                        "{what}: {priority} {expected}"
                    );
                } else {
                    assert!(
                        image.sample(x, y).is_some(),
                        "{what}: priority 0 without a sample"
                    );
                }
            }
        }
    }
    assert!(pixels > 15_000 && unreached > 100, "{pixels} {unreached}");
}

#[test]
fn anti_aliasing_is_the_papers() {
    let (mut blended, mut left) = (0, 0);
    for seed in 0..18 {
        let (width, height) = SIZES[seed as usize % SIZES.len()];
        let (mut image, edges) = scene(width, height, seed);
        image.rasterize(&edges, None);
        let mut picture = Picture::new(width, height);
        image.classify();
        image.reach();
        image.interpolate(&mut picture);
        let before = picture.clone();
        image.antialias(&mut picture);
        for y in 0..height {
            for x in 0..width {
                let expected = paper::antialias(&image, &before, x, y);
                blended += usize::from(expected.is_some());
                left += usize::from(expected.is_none());
                let expected = expected.unwrap_or(before.pixel(x, y));
                let found = picture.pixel(x, y);
                assert!(
                    (found - expected).abs().cmple(1e-6 * expected).all(),
                    "seed {seed}, ({x}, {y}): {found} instead of {expected}"
                );
            }
        }
    }
    assert!(blended > 1_500 && left > 10_000, "{blended} {left}");
}

/// The bits of what comes out.
fn facts(image: &EdgePointImage, picture: &Picture) -> (Vec<u32>, Vec<u32>) {
    let (width, height) = image.size();
    let pixels = || (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)));
    let masks = pixels().flat_map(|(x, y)| {
        let crossings = image.crossings(x, y);
        let four = [
            crossings.above,
            crossings.left,
            crossings.through,
            crossings.middle,
        ];
        [
            u32::from_le_bytes(four),
            u32::from(image.edge(x, y).bits()),
            image.reach_mask(x, y),
            u32::from(picture.priorities(y)[x as usize]),
        ]
    });
    let colours = pixels().flat_map(|(x, y)| picture.pixel(x, y).to_array().map(f32::to_bits));
    (masks.collect(), colours.collect())
}

#[test]
fn any_number_of_bands_gives_the_same_bits() {
    for seed in 0..12 {
        let (width, height) = SIZES[seed as usize % SIZES.len()];
        let (image, edges) = scene(width, height, seed);
        let occlusion = (seed % 2 == 0).then(Occlusion::default);
        let mut whole = image.clone();
        whole.rasterize(&edges, occlusion);
        let mut expected = Picture::new(width, height);
        whole.reconstruct(&mut expected);
        let expected = facts(&whole, &expected);
        for bands in [2, 3, 7, 1000] {
            let mut image = image.clone();
            let mut picture = Picture::new(width, height);
            // Backwards, for the order must not matter.
            macro_rules! run {
                ($bands:expr) => {
                    run!($bands, |band| band.run())
                };
                ($bands:expr, $run:expr) => {
                    let mut all: Vec<_> = $bands.collect();
                    all.reverse();
                    all.into_iter().for_each($run);
                };
            }
            run!(image.rasterize_bands(&edges, occlusion, bands));
            run!(image.classify_bands(bands));
            run!(image.reach_bands(bands));
            run!(image.interpolate_bands(&mut picture, bands));
            run!(image.fill_bands(&picture, bands));
            image.apply(&mut picture);
            run!(image.complex_bands(&picture, bands), |band| band
                .run(|_, _| Vec3::ONE));
            image.apply(&mut picture);
            run!(image.antialias_bands(&picture, bands));
            image.apply(&mut picture);
            let found = facts(&image, &picture);
            assert_eq!(found.0, expected.0, "seed {seed}, {bands} bands: masks");
            assert_eq!(found.1, expected.1, "seed {seed}, {bands} bands: colours");
        }
    }
}

/// The limit of a pixel by its definition, as a depth: the largest in the 4x4 around its 2x2, times the offset.
fn limit(image: &EdgePointImage, occlusion: Occlusion, x: u32, y: u32) -> f32 {
    let (width, height) = image.size();
    let (left, top) = (x / 2 * 2, y / 2 * 2);
    let (mut depth, mut count) = (0.0f32, 0.0f32);
    for v in top.saturating_sub(1)..(top + 3).min(height) {
        for u in left.saturating_sub(1)..(left + 3).min(width) {
            if let Some(sample) = image.sample(u, v) {
                depth = depth.max(sample.depth);
                count += 1.0;
            }
        }
    }
    if count == 0.0 {
        return f32::INFINITY;
    }
    depth * (1.0 + occlusion.slack + occlusion.sparse_slack * (16.0 / count - 1.0))
}

#[test]
fn edges_are_hidden_where_they_lie_behind_all_samples_around() {
    let mut stream = Stream::new(31);
    let (mut hidden, mut seen) = (0, 0);
    for round in 0..400 {
        let (width, height) = (3 + stream.below(20), 3 + stream.below(20));
        let occlusion = Occlusion {
            slack: 0.1 * stream.unit(),
            sparse_slack: 0.1 * stream.unit(),
        };
        let mut image = EdgePointImage::new(width, height, Settings::default()).unwrap();
        for y in 0..height {
            for x in 0..width {
                if stream.below(4) > round % 4 {
                    image.insert(&Point {
                        position: Vec2::new(x as f32 + 0.5, y as f32 + 0.5),
                        depth: 1.0 + 2.0 * stream.unit() * stream.unit(),
                        colour: Vec3::ONE,
                    });
                }
            }
        }
        let depth = 0.8 + 2.0 * stream.unit();
        let column = stream.below(width);
        let across = ScreenSegment {
            a: Vec2::new(column as f32 + 0.3, -1.0),
            b: Vec2::new(column as f32 + 0.3, height as f32 + 1.0),
            depth_a: depth,
            depth_b: depth,
        };
        let mut list = EdgeList::new(width, height);
        list.push(across);
        // In every other round something else says how far one sees, in some of the cells.
        let (columns, rows) = (width.div_ceil(CELL as u32), height.div_ceil(CELL as u32));
        let bounds: Vec<f32> = (0..(columns * rows) * (round % 2))
            .map(|_| match stream.below(3) {
                0 => f32::INFINITY,
                _ => 0.8 + 2.0 * stream.unit(),
            })
            .collect();
        image.bound_depths(&bounds);
        image.rasterize(&list, Some(occlusion));
        for y in 0..=height {
            let cell = y.min(height - 1) / CELL as u32 * columns + column / CELL as u32;
            let bound = bounds.get(cell as usize).copied().unwrap_or(f32::INFINITY);
            let limit = limit(&image, occlusion, column, y.min(height - 1)).min(bound);
            let there = image.crossings(column, y).above != 0;
            // Limits are stored to the nearer side of 1%, depths to 0.1%.
            if depth > limit * 1.011 {
                hidden += 1;
                assert!(!there, "round {round}, row {y}: {depth} lies behind {limit}");
            } else if depth < limit * 0.999 {
                seen += 1;
                assert!(there, "round {round}, row {y}: {depth} lies before {limit}");
            }
        }
    }
    assert!(hidden > 500 && seen > 500, "{hidden} hidden, {seen} seen");
}

#[test]
fn blind_filling_leaves_no_pixel_without_a_colour_and_touches_no_other() {
    let mut filled = 0;
    for (seed, (width, height)) in (0..24).zip(SIZES.into_iter().cycle()) {
        let (mut image, list) = scene(width, height, seed);
        image.rasterize(&list, None);
        image.classify();
        image.reach();
        let mut picture = Picture::new(width, height);
        image.interpolate(&mut picture);
        image.fill(&mut picture, 2);
        let before = picture.clone();
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let holes = pixels().filter(|&(x, y)| !before.is_coloured(x, y)).count();
        let count = image.fill_blindly(&mut picture);
        let sampled = holes < pixels().count();
        assert_eq!(
            count,
            if sampled { holes } else { 0 },
            "holes filled, seed {seed}"
        );
        let colours: Vec<Vec3> = pixels()
            .filter(|&(x, y)| before.is_coloured(x, y))
            .map(|(x, y)| before.pixel(x, y))
            .collect();
        let most = colours.iter().fold(Vec3::ZERO, |most, &c| most.max(c));
        for (x, y) in pixels() {
            if before.is_coloured(x, y) {
                assert_eq!(picture.pixel(x, y), before.pixel(x, y), "({x}, {y})");
            } else if sampled {
                assert!(picture.is_coloured(x, y), "a hole at ({x}, {y}), seed {seed}");
                let colour = picture.pixel(x, y);
                assert!(colour.cmple(most * 1.0001).all(), "{colour} at ({x}, {y})");
            }
        }
        filled += count;
    }
    assert!(filled > 100, "{filled} pixels filled");
}

#[test]
fn what_all_edges_cut_off_takes_colours_from_where_some_do_not() {
    // A dark left half and a bright right half with an outline between them; on the right a strip that another edge cuts off holds
    // no sample.
    let (width, height) = (24u32, 9u32);
    let vertical = |x: f32| ScreenSegment {
        a: Vec2::new(x, -1.0),
        b: Vec2::new(x, 10.0),
        depth_a: 1.0,
        depth_b: 1.0,
    };
    let mut image = EdgePointImage::new(width, height, Settings::default()).unwrap();
    for y in 0..height {
        for x in (0..width).filter(|&x| !(9..14).contains(&x)) {
            image.insert(&Point {
                position: Vec2::new(x as f32 + 0.5, y as f32 + 0.5),
                depth: 1.0,
                colour: if x < 12 { Vec3::X } else { Vec3::Y },
            });
        }
    }
    let mut picture = Picture::new(width, height);
    let mut run = |keep: bool| {
        let mut list = EdgeList::new(width, height);
        list.push(vertical(9.5));
        image.rasterize(&list, None);
        image.classify();
        image.reach();
        if keep {
            image.keep_reach();
        }
        list.push(vertical(13.5));
        image.rasterize(&list, None);
        image.classify();
        image.reach();
        image.interpolate(&mut picture);
        image.fill(&mut picture, 4);
        assert!(!picture.is_coloured(11, 4), "all edges together cut it off");
        for _ in 0..4 {
            image.fill_bands(&picture, 2).for_each(|band| band.kept().run());
            image.apply(&mut picture);
        }
        [9, 10, 11, 12, 13].map(|x| picture.is_coloured(x, 4).then(|| picture.pixel(x, 4)))
    };
    let without = run(false);
    assert_eq!(without[1..4], [None; 3], "nothing was kept");
    let with = run(true);
    assert_eq!(
        with[1..4],
        [Some(Vec3::Y); 3],
        "light from the right, never from over the outline"
    );
}
