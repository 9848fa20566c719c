//! The fast form of reachability does what the paper's form does, on windows full of edges and at every border.

use glam::{Vec2, Vec3};
use llsr_epi::{EdgeList, EdgePointImage, Point, ScreenSegment, Settings, paper};

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn below(&mut self, end: u32) -> u32 {
        (self.next() % u64::from(end)) as u32
    }

    fn unit(&mut self) -> f32 {
        self.below(1 << 20) as f32 / (1 << 20) as f32
    }
}

fn sample(image: &mut EdgePointImage, random: &mut Random) {
    let (width, height) = image.size();
    let position = Vec2::new(random.unit() * width as f32, random.unit() * height as f32);
    image.insert(&Point {
        position,
        depth: 1.0,
        colour: Vec3::ONE,
    });
}

fn check(image: &mut EdgePointImage, what: &str) {
    image.classify();
    image.reach();
    let (width, height) = image.size();
    for y in 0..height {
        for x in 0..width {
            let (fast, paper) = (image.reach_mask(x, y), paper::reach_mask(image, x, y));
            assert_eq!(
                fast, paper,
                "{what}: masks at ({x}, {y}) of {width}x{height}: {fast:024b} {paper:024b}"
            );
        }
    }
}

#[test]
fn masks_equal_the_papers_for_random_edges() {
    let mut random = Random(1);
    for round in 0..60 {
        let (width, height) = (1 + random.below(300), 1 + random.below(40));
        let mut image = EdgePointImage::new(width, height, Settings::default()).unwrap();
        let mut edges = EdgeList::new(width, height);
        let length = 1.0 + 30.0 * random.unit();
        for _ in 0..random.below(width * height / 8 + 2) {
            let a = Vec2::new(random.unit() * width as f32, random.unit() * height as f32);
            let b = a + (Vec2::new(random.unit(), random.unit()) - 0.5) * length;
            edges.push(ScreenSegment {
                a,
                b,
                depth_a: 1.0,
                depth_b: 1.0,
            });
        }
        image.rasterize(&edges, None);
        for _ in 0..random.below(width * height) {
            sample(&mut image, &mut random);
        }
        check(&mut image, &format!("edges, round {round}"));
    }
}

#[test]
fn masks_equal_the_papers_for_random_crossings() {
    let mut random = Random(2);
    for round in 0..60 {
        let (width, height) = (1 + random.below(200), 1 + random.below(30));
        let mut image = EdgePointImage::new(width, height, Settings::default()).unwrap();
        // From a few crossings to mostly complex pixels.
        for _ in 0..random.below(width * height * 2 + 1) {
            let eighth = random.below(8) as u8;
            if random.below(2) == 0 {
                image.mark_above(random.below(width), random.below(height + 1), eighth);
            } else {
                image.mark_left(random.below(width + 1), random.below(height), eighth);
            }
        }
        for _ in 0..random.below(width * height) {
            sample(&mut image, &mut random);
        }
        check(&mut image, &format!("crossings, round {round}"));
    }
}

#[test]
fn without_edges_everything_inside_is_reached() {
    for (width, height) in [
        (1, 1),
        (2, 1),
        (1, 3),
        (63, 4),
        (64, 5),
        (65, 6),
        (66, 3),
        (128, 9),
        (300, 7),
    ] {
        let mut image = EdgePointImage::new(width, height, Settings::default()).unwrap();
        check(&mut image, "no edges");
        let inside = |x: u32, y: u32, bit: u32| {
            let tap = bit + u32::from(bit >= 12);
            let (column, row) = (x + tap % 5, y + tap / 5);
            (2..width + 2).contains(&column) && (2..height + 2).contains(&row)
        };
        for (x, y) in [
            (0, 0),
            (width - 1, height - 1),
            (width / 2, height / 2),
            (0, height / 2),
        ] {
            let expected = (0..24).fold(0, |mask, bit| mask | u32::from(inside(x, y, bit)) << bit);
            assert_eq!(image.reach_mask(x, y), expected, "({x}, {y}) of {width}x{height}");
        }
    }
}
