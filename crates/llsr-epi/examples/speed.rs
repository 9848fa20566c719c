//! Time of each pass, in milliseconds: `cargo run --release -p llsr-epi --example speed -- [table|sizes|threads|all]`.
//!
//! Edges are synthetic sets with the counts of BWG03 table 3, repeated every 512 pixels for other sizes. Half of the pixels
//! have a sample. Each number is the median of some rounds, in which all passes run one after the other as in a frame.

use std::time::Instant;

use glam::{Vec2, Vec3};
use llsr_epi::{EdgeList, EdgePointImage, Kernel, Occlusion, Picture, Point, ScreenSegment, Settings};
use llsr_testkit::epi::edge_sets::{EdgeSet, Segment, hatching, thicket, tiled};
use llsr_testkit::epi::windows::Stream;

const ROUNDS: usize = 41;
const PASSES: [&str; 8] = [
    "project", "raster", "classify", "reach", "interp", "fill", "complex", "antial",
];

/// How the bands of a pass run.
#[derive(Clone, Copy)]
enum How {
    /// On as many threads.
    AtOnce,
    /// One after the other; the longest counts, which is what threads that do not disturb each other would take.
    OneByOne,
}

struct Frame {
    image: EdgePointImage,
    picture: Picture,
    list: EdgeList,
    segments: Vec<ScreenSegment>,
}

impl Frame {
    fn new(width: u32, height: u32, edges: &[Segment], density: f32) -> Option<Self> {
        let mut settings = Settings::default();
        if std::env::args().nth(2).is_some_and(|arg| arg == "linear") {
            (settings.linear, settings.kernel) = (true, Kernel::SHARP);
        }
        let mut image = EdgePointImage::new(width, height, settings).ok()?;
        let mut stream = Stream::new(9);
        for y in 0..height {
            for x in 0..width {
                if stream.unit() >= density {
                    continue;
                }
                let position = Vec2::new(x as f32 + stream.unit(), y as f32 + stream.unit());
                image.insert(&Point {
                    position,
                    depth: 2.0,
                    colour: Vec3::new(stream.unit(), 0.5, x as f32 / width as f32),
                });
            }
        }
        let segments = edges.iter().map(|e| ScreenSegment {
            a: e.a,
            b: e.b,
            depth_a: e.depth[0],
            depth_b: e.depth[1],
        });
        Some(Self {
            image,
            picture: Picture::new(width, height),
            list: EdgeList::new(width, height),
            segments: segments.collect(),
        })
    }

    /// Milliseconds of each pass in `bands` bands.
    fn run(&mut self, bands: usize, how: How) -> [f64; PASSES.len()] {
        let Self {
            image,
            picture,
            list,
            segments,
        } = self;
        let mut times = [0.0; PASSES.len()];
        let milliseconds = |start: Instant| start.elapsed().as_secs_f64() * 1e3;
        let start = Instant::now();
        list.clear();
        list.extend(segments);
        times[0] = milliseconds(start);
        macro_rules! pass {
            ($number:expr, $bands:expr) => {
                pass!($number, $bands, |band| band.run())
            };
            ($number:expr, $bands:expr, |$band:ident| $run:expr) => {
                match how {
                    How::AtOnce => {
                        let start = Instant::now();
                        rayon::in_place_scope(|scope| {
                            let mut bands = $bands;
                            let first = bands.next();
                            for $band in bands {
                                scope.spawn(move |_| $run);
                            }
                            if let Some($band) = first {
                                $run;
                            }
                        });
                        times[$number] = milliseconds(start);
                    }
                    How::OneByOne => {
                        for $band in $bands {
                            let start = Instant::now();
                            $run;
                            times[$number] = milliseconds(start).max(times[$number]);
                        }
                    }
                }
            };
        }
        let apply = |image: &mut EdgePointImage, picture: &mut Picture| {
            let start = Instant::now();
            image.apply(picture);
            milliseconds(start)
        };
        pass!(1, image.rasterize_bands(list, Some(Occlusion::default()), bands));
        pass!(2, image.classify_bands(bands));
        pass!(3, image.reach_bands(bands));
        pass!(4, image.interpolate_bands(picture, bands));
        pass!(5, image.fill_bands(picture, bands));
        times[5] += apply(image, picture);
        pass!(6, image.complex_bands(picture, bands), |band| band
            .run(|_, _| Vec3::ONE));
        times[6] += apply(image, picture);
        pass!(7, image.antialias_bands(picture, bands));
        times[7] += apply(image, picture);
        times
    }

    fn medians(&mut self, bands: usize, how: How, rounds: usize) -> [f64; PASSES.len()] {
        self.run(bands, how);
        let mut all: Vec<[f64; PASSES.len()]> = (0..rounds).map(|_| self.run(bands, how)).collect();
        std::array::from_fn(|pass| {
            all.sort_by(|a, b| a[pass].total_cmp(&b[pass]));
            all[rounds / 2][pass]
        })
    }

    fn percent(&self) -> [f64; 2] {
        let counts = self.image.class_counts();
        let all = (counts.empty + counts.simple + counts.complex) as f64;
        [counts.simple, counts.complex].map(|count| 100.0 * count as f64 / all)
    }
}

fn head(first: &str) {
    let names: String = PASSES.iter().map(|name| format!("{name:>9}")).collect();
    println!("{first:<24}{:>8} simple% complex%{names}    total", "edges");
}

fn line(name: &str, frame: &Frame, times: &[f64]) {
    let [simple, complex] = frame.percent();
    let values: String = times.iter().map(|time| format!("{time:9.3}")).collect();
    let total: f64 = times.iter().sum();
    println!(
        "{name:<24}{:8} {simple:7.2} {complex:8.2}{values}{total:9.3}",
        frame.segments.len()
    );
}

/// All passes on each set at 512x512, then scenes that are as bad as can be.
fn table() {
    head("512x512, one thread");
    let sets = EdgeSet::ALL.map(|set| (format!("{set:?}"), set.edges()));
    let worst = [
        ("no edges".to_owned(), Vec::new()),
        ("lines 1.5 apart".to_owned(), hatching(512, 512, 1.5)),
        ("lines 3 apart".to_owned(), hatching(512, 512, 3.0)),
        ("thicket 20k".to_owned(), thicket(512, 512, 20_000, 6.0)),
        ("thicket 200k".to_owned(), thicket(512, 512, 200_000, 6.0)),
    ];
    for (name, edges) in sets.into_iter().chain(worst) {
        let Some(mut frame) = Frame::new(512, 512, &edges, 0.5) else {
            return;
        };
        let times = frame.medians(1, How::OneByOne, ROUNDS);
        line(&name, &frame, &times);
    }
}

/// Time a pixel for growing pictures.
fn sizes() {
    println!("\nnanoseconds a pixel, one thread, chains repeated every 512 pixels");
    let chains = EdgeSet::Chains.edges();
    for (width, height) in [(256, 256), (512, 512), (1024, 1024), (1920, 1080), (3840, 2160)] {
        let Some(mut frame) = Frame::new(width, height, &tiled(&chains, width, height), 0.5) else {
            return;
        };
        let pixels = f64::from(width * height);
        let rounds = (ROUNDS * 512 * 512 / (width * height) as usize).clamp(7, ROUNDS);
        let times = frame
            .medians(1, How::OneByOne, rounds)
            .map(|ms| ms * 1e6 / pixels);
        if width == 256 {
            head("");
        }
        line(&format!("{width}x{height}"), &frame, &times);
    }
}

/// One thread against two.
fn threads() {
    println!("\none thread and two");
    head("");
    for (set, (width, height)) in [
        (EdgeSet::Chains, (512, 512)),
        (EdgeSet::Dragon, (512, 512)),
        (EdgeSet::Chains, (1920, 1080)),
    ] {
        let edges = tiled(&set.edges(), width, height);
        let Some(mut frame) = Frame::new(width, height, &edges, 0.5) else {
            return;
        };
        let one = frame.medians(1, How::OneByOne, ROUNDS);
        line(&format!("{set:?} {width}x{height}"), &frame, &one);
        let sum = |times: &[f64]| times[1..].iter().sum::<f64>();
        for (name, how) in [
            ("  two threads", How::AtOnce),
            ("  longer of two bands", How::OneByOne),
        ] {
            let two = frame.medians(2, how, ROUNDS);
            line(name, &frame, &two);
            println!("{:>24}: {:.2}x without projecting", "", sum(&one) / sum(&two));
        }
    }
}

fn main() {
    let what = std::env::args().nth(1).unwrap_or_else(|| "all".to_owned());
    rayon::ThreadPoolBuilder::new().num_threads(2).build_global().ok();
    if what == "table" || what == "all" {
        table();
    }
    if what == "sizes" || what == "all" {
        sizes();
    }
    if what == "threads" || what == "all" {
        threads();
    }
}
