//! Reprojection against a slow one in double precision, in parts, and with wild input.

use glam::{Mat4, Vec3, Vec4};
use llsr_render_cache::*;
use proptest::prelude::*;

use crate::scene::*;

/// Per pixel: region byte without its mark, depth and slot of the nearest point.
type Expected = Vec<Option<(u8, f64, u32)>>;

fn reproject_slowly(store: &PointStore, matrix: &Mat4, width: u32, height: u32) -> Expected {
    let mut pixels: Expected = vec![None; (width * height) as usize];
    for (slot, point) in store.iter() {
        let Some((x, y, depth)) = project_slowly(matrix, width, height, point.position) else {
            continue;
        };
        if x < 0.0 || y < 0.0 || x >= f64::from(4 * width) || y >= f64::from(4 * height) {
            continue;
        }
        let halves = ((2.0 * y) as usize as u8 & 1) << 1 | (2.0 * x) as usize as u8 & 1;
        let (x, y) = (x as usize, y as usize);
        let pixel = &mut pixels[y / 4 * width as usize + x / 4];
        if pixel.is_none_or(|(_, d, _)| depth < d) {
            *pixel = Some(((y % 4 * 4 + x % 4) as u8 | halves << 5, depth, slot));
        }
    }
    pixels
}

/// Points in a box around the eye, none of them so close to a border between regions that single precision might decide
/// otherwise, or so close to another in depth.
fn scattered(seed: u64, count: usize, matrix: &Mat4, width: u32, height: u32) -> PointStore {
    let mut random = Random(seed);
    let mut store = PointStore::new(count).expect("capacity");
    let mut depths = std::collections::BTreeSet::new();
    while store.len() < count {
        let mut coordinate = || 8.0 * random.next() - 4.0;
        let position = Vec3::new(coordinate(), coordinate(), coordinate());
        if let Some((x, y, depth)) = project_slowly(matrix, width, height, position) {
            let near_border = |v: f64| (2.0 * v - (2.0 * v).round()).abs() < 0.02;
            if near_border(x) || near_border(y) || depth < 0.01 || !depths.insert((depth * 1e5) as u64) {
                continue;
            }
        }
        put(&mut store, &point(position, 3));
    }
    store
}

fn check(image: &PointImage, store: &PointStore, expected: &Expected) {
    let (width, height) = image.size();
    assert_eq!(image.stride() % 64, 0, "rows begin on whole words");
    let mut occupied = 0;
    for y in 0..height as usize {
        for x in 0..image.stride() {
            let i = y * image.stride() + x;
            let found = (
                image.region_plane()[i],
                image.slot_plane()[i],
                PackedColour {
                    coarse: image.colour_plane()[i],
                    fine: image.fine_plane()[i],
                },
                image.age_plane()[i],
            );
            let depth = image.depth_plane()[i];
            match (x < width as usize)
                .then(|| expected[y * width as usize + x])
                .flatten()
            {
                None => assert_eq!(
                    (found.0, found.1, found.3, depth),
                    (0, NO_SLOT, 0, f32::INFINITY),
                    "({x}, {y}) is empty"
                ),
                Some((region, expected_depth, slot)) => {
                    let colour = pack_colour(store.point(slot).expect("a point").colour);
                    let age = store.age(slot).expect("a point");
                    assert_eq!(found, (OCCUPIED | region, slot, colour, age), "({x}, {y})");
                    assert!(
                        (f64::from(depth) / expected_depth - 1.0).abs() < 1e-5,
                        "({x}, {y}): {depth}"
                    );
                    occupied += 1;
                }
            }
        }
    }
    assert_eq!(
        image.counts(),
        Counts { occupied, hidden: 0 },
        "as many as there are"
    );
}

#[test]
fn nearest_point_of_each_pixel() {
    for (width, height, count) in [(64, 48, 20_000), (129, 5, 3000), (1, 1, 300), (3, 200, 5000)] {
        let matrix = matrix(Vec3::new(0.3, -0.1, 0.5), 0.4);
        let mut store = scattered(u64::from(width), count, &matrix, width, height);
        store.advance(9, 255);
        let mut image = PointImage::new(width, height).expect("size");
        let view = View::new(&matrix, width, height).expect("size");
        image.reproject(&store, &view, &OFF);
        check(&image, &store, &reproject_slowly(&store, &matrix, width, height));
    }
}

#[test]
fn parts_give_the_same_bits() {
    let matrix = matrix(Vec3::ZERO, 0.2);
    let (width, height) = (100, 70);
    let mut store = scattered(5, 30_000, &matrix, width, height);
    store.advance(5, 255);
    let view = View::new(&matrix, width, height).expect("size");
    for reach in [0, 2, 5] {
        let filter = DepthFilter {
            reach,
            ..DepthFilter::default()
        };
        let mut whole = PointImage::new(width, height).expect("size");
        whole.reproject(&store, &view, &filter);
        assert!(
            reach == 0 || whole.counts().hidden > 50,
            "the filter works: {:?}",
            whole.counts()
        );
        let mut parts = PointImage::new(9, 9).expect("size");
        for (chunks, bands) in [(1, 1), (2, 2), (3, 5), (7, 70), (100, 1000), (0, 0)] {
            // Backwards, as threads might.
            let mut chunks: Vec<_> = parts.project_chunks(&store, &view, &filter, chunks).collect();
            while let Some(chunk) = chunks.pop() {
                chunk.run();
            }
            drop(chunks);
            std::thread::scope(|scope| {
                for band in parts.resolve_bands(bands) {
                    scope.spawn(|| band.run());
                }
            });
            let mut bands: Vec<_> = parts.finish_bands(&store, bands).collect();
            while let Some(band) = bands.pop() {
                band.run();
            }
            drop(bands);
            assert_eq!(parts.counts(), whole.counts(), "counts");
            assert_eq!(parts.region_plane(), whole.region_plane(), "regions");
            assert_eq!(parts.depth_plane(), whole.depth_plane(), "depths");
            assert_eq!(parts.slot_plane(), whole.slot_plane(), "slots");
            assert_eq!(parts.colour_plane(), whole.colour_plane(), "colours");
            assert_eq!(parts.fine_plane(), whole.fine_plane(), "low bits of colours");
            assert_eq!(parts.age_plane(), whole.age_plane(), "ages");
        }
    }
}

#[test]
fn parallel_projection_takes_its_depth_from_elsewhere() {
    // x and y in [-1, 1] fill the picture; the view goes along -z from z = 10.
    let matrix = Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::ZERO, Vec4::new(0.0, 0.0, 1.0, 1.0));
    let view = View::new(&matrix, 8, 8)
        .expect("size")
        .with_depth(Vec4::new(0.0, 0.0, -1.0, 10.0));
    let mut store = PointStore::new(10).expect("capacity");
    let far = put(&mut store, &point(Vec3::new(-0.9, 0.9, 2.0), 1));
    let near = put(&mut store, &point(Vec3::new(-0.9, 0.9, 3.0), 1));
    put(&mut store, &point(Vec3::new(-0.9, 0.9, 11.0), 1));
    let mut image = PointImage::new(8, 8).expect("size");
    image.reproject(&store, &view, &OFF);
    assert_eq!(
        (image.slot_plane()[0], image.depth_plane()[0]),
        (near, 7.0),
        "nearest in front"
    );
    store.invalidate_box(Vec3::new(-1.0, 0.0, 2.5), Vec3::new(1.0, 1.0, 3.5), Fate::Remove);
    image.reproject(&store, &view, &OFF);
    assert_eq!(
        (image.slot_plane()[0], image.depth_plane()[0]),
        (far, 8.0),
        "what lay behind it"
    );
}

#[test]
fn sizes_are_checked() {
    for (width, height) in [(0, 5), (5, 0), (MAX_SIDE + 1, 5), (5, u32::MAX)] {
        let expected = Some(Error::Size { width, height });
        assert_eq!(View::new(&Mat4::IDENTITY, width, height).err(), expected, "view");
        assert_eq!(PointImage::new(width, height).err(), expected, "image");
        assert_eq!(Priorities::new(width, height).err(), expected, "priorities");
        assert_eq!(Chooser::new(width, height).err(), expected, "chooser");
        assert_eq!(Prediction::new(width, height).err(), expected, "prediction");
    }
    for capacity in [0, MAX_CAPACITY + 1, usize::MAX] {
        assert_eq!(
            PointStore::new(capacity).err(),
            Some(Error::Capacity(capacity)),
            "store"
        );
    }
    let text = Error::Size { width: 0, height: 5 }.to_string();
    assert!(text.contains("0 x 5") && text.contains("16384"), "{text}");
}

/// Anything that a float can be, often the odd values.
fn wild() -> impl Strategy<Value = f32> {
    prop_oneof![
        any::<f32>(),
        -2.0..2.0f32,
        Just(0.0),
        Just(f32::NAN),
        Just(f32::INFINITY),
        Just(-f32::MAX)
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn wild_input_is_survived(
        elements in prop::array::uniform16(wild()),
        positions in prop::collection::vec(prop::array::uniform3(wild()), 1..200),
        width in 1..70u32, height in 1..40u32, reach in 0..12u8, tolerance in wild(),
    ) {
        let view = View::new(&Mat4::from_cols_array(&elements), width, height).expect("size");
        let mut store = PointStore::new(50).expect("capacity");
        let mut image = PointImage::new(width, height).expect("size");
        let filter = DepthFilter { reach, tolerance, fresh: 0 };
        for position in positions {
            let position = Vec3::from_array(position);
            let sample = Point { colour: position, ..point(position, 1) };
            let inserted = store.insert(&sample, &image, &Replacement::default());
            prop_assert_eq!(inserted.is_some(), position.is_finite());
            image.reproject(&store, &view, &filter);
        }
        let Counts { occupied, hidden } = image.counts();
        prop_assert!(occupied + hidden <= store.len());
        for (i, slot) in image.slot_plane().iter().enumerate() {
            prop_assert_eq!(*slot == NO_SLOT, image.region_plane()[i] == 0);
            prop_assert!(*slot == NO_SLOT || (image.depth_plane()[i] > 0.0 && store.point(*slot).is_some()));
        }
    }
}
