//! The occlusion filter against its definition, where it must not act, and where it must.

use llsr_render_cache::*;
use proptest::prelude::*;

use crate::scene::*;

/// Whether the pixel is to lose its point, by the definition in the documentation.
fn surrounded(
    depths: &[f32],
    width: usize,
    height: usize,
    (x, y): (usize, usize),
    filter: &DepthFilter,
) -> bool {
    let own = depths[y * width + x];
    let reach = i64::from(filter.reach.min(DepthFilter::MAX_REACH));
    let nearer = |dx: i64, dy: i64| {
        let (x, y) = (x as i64 + dx, y as i64 + dy);
        let inside = x >= 0 && y >= 0 && x < width as i64 && y < height as i64;
        inside && depths[(y as usize) * width + x as usize] < own * (1.0 - filter.tolerance)
    };
    reach > 0
        && [(1, 1), (1, -1), (-1, 1), (-1, -1)]
            .into_iter()
            .all(|(sx, sy)| (1..=reach).any(|dx| (1..=reach).any(|dy| nearer(sx * dx, sy * dy))))
}

/// One point in each pixel with a depth, in the middle of a random region.
fn store_of(depths: &[f32], width: u32, height: u32, random: &mut Random) -> PointStore {
    let mut store = PointStore::new(depths.len()).expect("capacity");
    for (i, &depth) in depths.iter().enumerate() {
        if depth.is_finite() {
            let (x, y) = ((i as u32 % width) as f32, (i as u32 / width) as f32);
            let mut inside = || 0.125 + 0.25 * random.below(4) as f32;
            let position = position(width, height, x + inside(), y + inside(), depth);
            put(&mut store, &point(position, 1));
        }
    }
    store.advance(20, 255);
    store
}

#[test]
fn does_as_defined() {
    let mut random = Random(11);
    for (width, height, density) in [
        (40, 30, 0.6),
        (65, 9, 0.3),
        (2, 50, 0.9),
        (1, 1, 1.0),
        (30, 64, 0.1),
    ] {
        let depths: Vec<f32> = (0..width * height)
            .map(|_| {
                if random.next() < density {
                    1.0 + 3.0 * random.next().powi(2)
                } else {
                    f32::INFINITY
                }
            })
            .collect();
        let store = store_of(&depths, width, height, &mut random);
        let mut image = PointImage::new(width, height).expect("size");
        for reach in [0, 1, 2, 3, 4, 7, 8, 200] {
            let filter = DepthFilter {
                reach,
                tolerance: 0.05,
                fresh: 1,
            };
            image.reproject(&store, &view(width, height), &filter);
            let mut hidden = 0;
            for y in 0..height as usize {
                for x in 0..width as usize {
                    let depth = depths[y * width as usize + x];
                    let drop = surrounded(&depths, width as usize, height as usize, (x, y), &filter);
                    let shown = image.region_plane()[y * image.stride() + x] != 0;
                    assert_eq!(shown, depth.is_finite() && !drop, "({x}, {y}) at reach {reach}");
                    hidden += usize::from(depth.is_finite() && drop);
                }
            }
            assert_eq!(image.counts().hidden, hidden, "count at reach {reach}");
        }
    }
}

#[test]
fn points_that_shine_through_are_dropped() {
    let (width, height) = (128, 128);
    let mut random = Random(3);
    for density in [0.6, 0.3, 0.15] {
        // A near wall hides a far one; both have points, the near one `density` of the pixels, the far one the rest.
        let depths: Vec<f32> = (0..width * height)
            .map(|_| if random.next() < density { 2.0 } else { 6.0 })
            .collect();
        let store = store_of(&depths, width, height, &mut random);
        let mut image = PointImage::new(width, height).expect("size");
        let filter = DepthFilter::default().for_density(density);
        image.reproject(&store, &view(width, height), &filter);
        let far = depths.iter().filter(|d| **d == 6.0).count();
        let left = image.counts().occupied - (depths.len() - far);
        // Each of four blocks is empty with at most 5%; at the rim blocks are cut off.
        let share = left as f32 / far as f32;
        assert!(
            share < 0.3,
            "{share} of the far points are left at density {density}, reach {}",
            filter.reach
        );
    }
}

#[test]
fn fresh_points_are_spared() {
    let (width, height) = (9, 9);
    let mut depths = vec![2.0; 81];
    depths[4 * 9 + 4] = f32::INFINITY;
    let mut store = store_of(&depths, width, height, &mut Random(1));
    let mut image = PointImage::new(width, height).expect("size");
    // The store is full: the point takes the place of another one, but not of one of the eight around.
    store.invalidate_box(
        position(9, 9, 0.0, 1.0, 2.0),
        position(9, 9, 1.0, 0.0, 2.0),
        Fate::Remove,
    );
    let slot = put(&mut store, &point(position(9, 9, 4.5, 4.5, 6.0), 2));
    let shown = |image: &PointImage| image.slot_plane().contains(&slot);
    let filter = DepthFilter {
        reach: 2,
        tolerance: 0.02,
        fresh: 2,
    };
    for (age, expected) in [(0, true), (1, true), (2, false), (3, false)] {
        image.reproject(&store, &view(width, height), &filter);
        assert_eq!(store.age(slot), Some(age), "age in ticks");
        assert_eq!(shown(&image), expected, "at age {age}");
        store.advance(1, 255);
    }
}

#[test]
fn reach_grows_as_points_get_sparse() {
    let reach = |density| DepthFilter::default().for_density(density).reach;
    assert_eq!(
        [1.0, 0.6, 0.3, 0.2, 0.1, 0.05, 0.0].map(reach),
        [2, 2, 3, 4, 6, 8, 8],
        "as documented"
    );
    assert_eq!(reach(f32::NAN), 8, "not a number");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Beside a straight silhouette, and on tilted planes, nothing is dropped: whatever direction, density, tolerance.
    #[test]
    fn straight_silhouettes_and_planes_are_safe(
        seed in any::<u64>(), angle in 0.0..6.3f32, offset in -20.0..20f32, slope in 0.0..0.4f32,
        reach in 1..9u8, density in 0.1..1.0f32,
    ) {
        let (width, height) = (48u32, 40u32);
        let mut random = Random(seed);
        let mut store = PointStore::new(4000).expect("capacity");
        for _ in 0..4000 {
            if random.next() > density {
                continue;
            }
            let (x, y) = (random.next() * width as f32, random.next() * height as f32);
            let across = (x - 24.0) * angle.cos() + (y - 20.0) * angle.sin();
            // The near side of a line at depth 1; beyond it a plane, for which 1 / depth is linear over the picture.
            let depth = if across > offset { 1.0 } else { 1.0 / (0.5 + slope * across / 40.0) };
            put(&mut store, &point(position(width, height, x, y, depth), 1));
        }
        store.advance(20, 255);
        let mut image = PointImage::new(width, height).expect("size");
        // A tolerance above rounding, below any step of the scene that matters.
        image.reproject(&store, &view(width, height), &DepthFilter { reach, tolerance: 1e-5, fresh: 0 });
        prop_assert_eq!(image.counts().hidden, 0);
    }
}
