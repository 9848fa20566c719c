//! What an image takes, and that nothing is allocated after the first picture.

use glam::{Vec2, Vec3};
use llsr_epi::{EdgeList, EdgePointImage, Occlusion, Picture, Point, ScreenSegment, Settings};
use llsr_testkit::allocations::{Counting, count};
use llsr_testkit::epi::edge_sets::thicket;
use llsr_testkit::epi::windows::Stream;

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn bytes_a_pixel_and_allocations() {
    let pixels = 2048.0 * 1024.0;
    for (half_lines, at_most) in [(true, 17.0), (false, 15.0)] {
        let settings = Settings {
            half_lines,
            ..Settings::default()
        };
        let (image, made) = count(|| EdgePointImage::new(2048, 1024, settings).unwrap());
        let bytes = made.bytes as f64 / pixels;
        // 10 for the pixel, 2.5 for masks, 0.5 for depth limits, 4 or 2 for crossings; the guards of the bit planes and the
        // lower border come on top.
        println!("{bytes:.3} bytes a pixel, half lines: {half_lines}");
        assert!(bytes <= at_most + 0.2, "{bytes} bytes a pixel");
        drop(image);
    }

    let (width, height) = (200, 90);
    let settings = Settings {
        linear: true,
        ..Settings::default()
    };
    let mut image = EdgePointImage::new(width, height, settings).unwrap();
    let mut picture = Picture::new(width, height);
    let mut list = EdgeList::new(width, height);
    let edges = thicket(width, height, 1_500, 9.0);
    let mut stream = Stream::new(2);
    let mut frame = |points: u32, edges: usize, all: &[_]| {
        image.clear_samples();
        for _ in 0..points {
            let unit = Vec2::new(stream.unit(), stream.unit());
            image.insert(&Point {
                position: unit * Vec2::new(width as f32, height as f32),
                depth: 1.0,
                colour: Vec3::ONE,
            });
        }
        list.clear();
        for edge in &all[..edges] {
            let edge: &llsr_testkit::epi::edge_sets::Segment = edge;
            list.push(ScreenSegment {
                a: edge.a,
                b: edge.b,
                depth_a: 0.9,
                depth_b: 1.1,
            });
        }
        image
            .rasterize_bands(&list, Some(Occlusion::default()), 3)
            .for_each(|band| band.run());
        image.reconstruct(&mut picture);
        image.class_counts()
    };
    let counts = frame(600, 1_500, &edges);
    assert!(counts.complex > 500 && counts.simple > 500, "{counts:?}");
    let ((), made) = count(|| {
        for points in [600, 900, 3_000] {
            frame(points, 1_400, &edges);
        }
    });
    let more = made.allocations;
    // Lists of changed pixels may still grow a few times, as the number of gaps changes with the samples.
    assert!(more <= 2, "{more} allocations after the first frame");
}
