//! Whole frames in a row: the feedback works, and the bits stay.

use glam::Vec3;
use llsr_render_cache::*;

use crate::scene::*;

const SIZE: u32 = 64;

/// A far wall and a disc before it, whose colour depends on `light`.
fn shade(view_x: f32, x: u32, y: u32, light: f32) -> Point {
    let (u, v) = (
        2.0 * (x as f32 + 0.5) / SIZE as f32 - 1.0,
        1.0 - 2.0 * (y as f32 + 0.5) / SIZE as f32,
    );
    let at = |depth: f32| Vec3::new(view_x + u * depth, v * depth, -depth);
    let near = at(2.0);
    let (position, object) = if near.truncate().length() < 0.8 {
        (near, 1)
    } else {
        (at(5.0), 0)
    };
    Point {
        colour: Vec3::new(light, 0.5 * light, 0.2),
        ..point(position, object)
    }
}

struct Loop {
    store: PointStore,
    image: PointImage,
    priorities: Priorities,
    chooser: Chooser,
    requests: Vec<Request>,
    frame: u32,
}

impl Loop {
    fn new(capacity: usize) -> Self {
        Self {
            store: PointStore::new(capacity).expect("capacity"),
            image: PointImage::new(SIZE, SIZE).expect("size"),
            priorities: Priorities::new(SIZE, SIZE).expect("size"),
            chooser: Chooser::new(SIZE, SIZE).expect("size"),
            requests: Vec::new(),
            frame: 0,
        }
    }

    /// One frame from (`x`, 0, 0) with `count` new samples.
    fn step(&mut self, x: f32, count: usize, light: f32) {
        self.store.advance(1, 255);
        for r in &self.requests {
            let sample = shade(x, r.x, r.y, light);
            self.store.insert(&sample, &self.image, &Replacement::default());
        }
        let view = View::new(&matrix(Vec3::new(x, 0.0, 0.0), 0.0), SIZE, SIZE).expect("size");
        self.image.reproject(&self.store, &view, &DepthFilter::default());
        self.priorities.update_by_gaps(&self.image, AgeRule::default());
        let phase = (f64::from(self.frame) * 0.618_033_988_75).fract();
        self.chooser
            .choose(&mut self.priorities, count, phase, 0, &mut self.requests);
        self.frame += 1;
    }

    /// Share of the shown points with the colour that `light` gives.
    fn up_to_date(&self, light: f32) -> f32 {
        let expected = pack_colour(Vec3::new(light, 0.5 * light, 0.2));
        let colours = self.image.colour_plane().iter().zip(self.image.fine_plane());
        let right = colours
            .zip(self.image.region_plane())
            .filter(|((coarse, fine), region)| {
                **region != 0 && (**coarse, **fine) == (expected.coarse, expected.fine)
            })
            .count();
        right as f32 / self.image.counts().occupied as f32
    }
}

#[test]
fn a_still_view_fills_up() {
    let mut frames = Loop::new(4096);
    for _ in 0..60 {
        frames.step(0.0, 82, 1.0);
    }
    // 59 times 82 samples are 4838: a picture filled at random would be full to 1 - exp(-1.18) = 69%.
    let occupied = frames.image.counts().occupied;
    assert!(occupied > 3400, "{occupied} of 4096 pixels after 60 frames of 2%");
}

#[test]
fn changed_light_spreads_faster_than_ageing_alone() {
    let run = |early: u8| {
        let mut frames = Loop::new(4096);
        for _ in 0..80 {
            frames.step(0.0, 82, 1.0);
        }
        for _ in 0..30 {
            frames.store.advance(1, 255);
            for r in &frames.requests {
                let policy = Replacement {
                    early_ageing: early,
                    ..Replacement::default()
                };
                frames
                    .store
                    .insert(&shade(0.0, r.x, r.y, 3.0), &frames.image, &policy);
            }
            let view = *frames.image.view();
            frames
                .image
                .reproject(&frames.store, &view, &DepthFilter::default());
            // Where nothing is missing: only ages count.
            let rule = AgeRule {
                young: 90,
                old: 200,
                highest: 255,
            };
            frames
                .priorities
                .update(&frames.image, rule, |_| &[0; SIZE as usize]);
            let phase = (f64::from(frames.frame) * 0.618_033_988_75).fract();
            frames
                .chooser
                .choose(&mut frames.priorities, 82, phase, 0, &mut frames.requests);
            frames.frame += 1;
        }
        frames.up_to_date(3.0)
    };
    let (with, without) = (run(64), run(0));
    assert!(
        with > 0.4 && with > 3.0 * without,
        "{with} renewed with early ageing, {without} without"
    );
}

#[test]
fn moving_views_recycle_what_is_left_behind() {
    let mut frames = Loop::new(4096);
    for _ in 0..60 {
        frames.step(0.0, 82, 1.0);
    }
    for i in 1..200 {
        frames.step(0.02 * i as f32, 82, 1.0);
        assert!(frames.store.len() <= 4096, "never more than there is room for");
        let occupied = frames.image.counts().occupied;
        assert!(occupied > 2200, "frame {i}: {occupied} of 4096 pixels");
    }
    // All that is shown was seen from here or hardly moved: no point of the wall over the middle of the disc.
    let centre = 32 * frames.image.stride() + 32;
    assert!(
        frames.image.depth_plane()[centre] > 4.0,
        "the disc is out of sight by now"
    );
}

/// The bits of a short run, as they were when this test was written: a change of the order in which anything happens
/// shows here.
#[test]
fn value_stability() {
    let mut frames = Loop::new(1000);
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |value: u32| hash = (hash ^ u64::from(value)).wrapping_mul(0x0100_0000_01b3);
    for i in 0..40 {
        frames.step(0.01 * i as f32, 60, 1.0 + 0.1 * (i / 10) as f32);
        frames.image.depth_plane().iter().for_each(|d| add(d.to_bits()));
        frames.image.slot_plane().iter().for_each(|s| add(*s));
        // Without a point colours are anything.
        let regions = frames.image.region_plane();
        let there = |(region, colour): (&u8, u32)| if *region == 0 { 0 } else { colour };
        let colours = frames.image.colour_plane().iter().copied();
        regions.iter().zip(colours).map(there).for_each(&mut add);
        let fine = frames.image.fine_plane().iter().map(|c| u32::from(*c));
        regions.iter().zip(fine).map(there).for_each(&mut add);
        frames
            .image
            .region_plane()
            .iter()
            .for_each(|r| add(u32::from(*r)));
        frames.requests.iter().for_each(|r| add(r.x << 16 | r.y));
    }
    assert_eq!(hash, 0x9f17_6d53_6b31_f6a1, "the run has changed: {hash:#x}");
}
