//! Nothing is allocated after the first frames.

use glam::{Mat4, Vec3};
use llsr_render_cache::*;
use llsr_testkit::allocations::{Counting, count};

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn frames_do_not_allocate() {
    let (width, height) = (100, 60);
    let matrix = Mat4::from_cols_array_2d(&[
        [1., 0., 0., 0.],
        [0., 1., 0., 0.],
        [0., 0., 0., -1.],
        [0., 0., 0.1, 0.],
    ]);
    let mut store = PointStore::new(900).expect("capacity");
    let mut image = PointImage::new(width, height).expect("size");
    let mut priorities = Priorities::new(width, height).expect("size");
    let mut chooser = Chooser::new(width, height).expect("size");
    let mut prediction = Prediction::new(width, height).expect("size");
    let (mut requests, mut ahead) = (Vec::new(), Vec::new());
    let mut recycled = 0;
    for frame in 0..60 {
        let ((), made) = count(|| {
            store.advance(1, 200);
            for r in &requests {
                let Request { x, y } = *r;
                let (u, v) = (x as f32 / 50.0 - 1.0, 1.0 - y as f32 / 30.0);
                let depth = 1.0 + (x * y % 5) as f32;
                let colour = Vec3::splat(1.0 + (frame / 7) as f32);
                let position = Vec3::new(u, v, -1.0) * depth;
                let point = Point {
                    position,
                    colour,
                    surface: 0,
                    object: x % 3,
                    lights: 1,
                };
                let inserted = store.insert(&point, &image, &Replacement::default());
                recycled += usize::from(inserted.is_some_and(|i| i.place == Place::Recycled));
            }
            if frame % 9 == 0 {
                store.invalidate_object(1, Fate::Remove);
            }
            let camera = matrix * Mat4::from_translation(Vec3::X * 0.01 * frame as f32);
            let view = View::new(&camera, width, height).expect("size");
            if frame % 2 == 0 {
                image.reproject(&store, &view, &DepthFilter::default());
            } else {
                image
                    .project_chunks(&store, &view, &DepthFilter::default(), 3)
                    .for_each(|chunk| chunk.run());
                image.resolve_bands(2).for_each(|band| band.run());
                image.finish_bands(&store, 4).for_each(|band| band.run());
            }
            priorities.update_by_gaps(&image, AgeRule::default());
            chooser.choose(&mut priorities, 150, 0.5, 1, &mut requests);
            prediction.update(&store, &view, 4, frame, 13);
            prediction.choose(20, 0.5, &mut ahead);
        });
        let allocated = made.allocations;
        assert!(
            frame < 4 || allocated == 0,
            "{allocated} allocations in frame {frame}"
        );
    }
    assert!(recycled > 100, "{recycled} slots recycled: that is part of it");
}
