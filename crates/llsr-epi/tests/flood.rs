//! Nothing is used across an edge, and little that can be used is left out: against a flood fill at 16x16 cells a pixel.

use glam::{Vec2, Vec3};
use llsr_epi::{
    EdgeCode, EdgePointImage, Picture, PixelClass, Point, Reachability, RegionSide, Settings, UNREACHED,
};
use llsr_testkit::epi::flood::{Flood, Moves, Pixel, Side, larger_side, side_of_position};
use llsr_testkit::epi::windows::{Boundaries, Stream};

/// The sides that the oracle calls primary and secondary for an edge code.
fn sides(secondary: bool) -> Side {
    if secondary { Side::Minus } else { Side::Plus }
}

fn painted(code: EdgeCode) -> Pixel {
    // The oracle takes the ends in the order of the code, so that primary is Plus.
    Pixel {
        edge: code.segments().map(|(a, b)| [a, b]),
        blocked: code.class() == PixelClass::Complex,
    }
}

/// Where the edge of a code crosses a side of its pixel.
fn crossing(code: EdgeCode, side: u8) -> Option<u8> {
    let (first, second) = code.segments()?;
    [first, second].into_iter().find(|s| s / 8 == side).map(|s| s % 8)
}

#[test]
fn neighbour_reachability_is_the_flood_fills_for_all_pairs_of_codes() {
    let mut codes = vec![EdgeCode::EMPTY, EdgeCode::COMPLEX];
    codes.extend((0..32).flat_map(|first| (0..32).filter_map(move |second| EdgeCode::new(first, second))));
    let mut pairs = 0;
    for &a in &codes {
        for &b in &codes {
            for (side_a, side_b, columns) in [(1, 3, 2), (2, 0, 1)] {
                let complex = a == EdgeCode::COMPLEX || b == EdgeCode::COMPLEX;
                if !complex && crossing(a, side_a) != crossing(b, side_b) {
                    continue;
                }
                pairs += 1;
                let found = if columns == 2 {
                    Reachability::right(a, b)
                } else {
                    Reachability::down(a, b)
                };
                // Codes that differ only in the order of their ends differ only in names: fill for one order of each.
                if swapped(a) || swapped(b) {
                    let ordered = if columns == 2 {
                        Reachability::right(ordered(a), ordered(b))
                    } else {
                        Reachability::down(ordered(a), ordered(b))
                    };
                    for (from, to) in [(false, false), (false, true), (true, false), (true, true)] {
                        assert_eq!(
                            found.reaches(from, to),
                            ordered.reaches(from ^ swapped(a), to ^ swapped(b)),
                            "{a:?} {b:?}: exchanged regions"
                        );
                    }
                    continue;
                }
                let mut flood = Flood::new(columns, &[painted(a), painted(b)]);
                for from in [false, true] {
                    flood.clear();
                    flood.fill(0, sides(from), Moves::All);
                    for to in [false, true] {
                        // A pixel without an edge has no secondary region.
                        let expected = flood.reached(1, sides(to));
                        assert_eq!(found.reaches(from, to), expected, "{a:?} {b:?}, {from} to {to}");
                    }
                }
            }
        }
    }
    assert!(pairs > 300_000, "only {pairs} pairs");
}

fn swapped(code: EdgeCode) -> bool {
    code.segments().is_some_and(|(first, second)| first > second)
}

fn ordered(code: EdgeCode) -> EdgeCode {
    if swapped(code) { code.reversed() } else { code }
}

/// A random window, in the image and as the oracle sees it.
struct Window {
    image: EdgePointImage,
    picture: Picture,
}

/// What the oracle says of one window.
struct Truth {
    flood: Flood,
    /// Side and position of the usable sample of each pixel.
    samples: [Option<(Side, u8)>; 25],
    centre: Option<Side>,
}

impl Window {
    fn new() -> Self {
        Self {
            image: EdgePointImage::new(5, 5, Settings::default()).unwrap(),
            picture: Picture::new(5, 5),
        }
    }

    /// Edges and sample positions at random; the oracle works everything out for itself.
    fn draw(&mut self, stream: &mut Stream) -> (Truth, [Option<u8>; 25]) {
        let mut boundaries = Boundaries::new(5, 5);
        boundaries.wander(stream);
        self.image.clear_edges();
        self.image.clear_samples();
        for y in 0..6 {
            for x in 0..6 {
                for eighth in 0..8 {
                    if x < 5 && boundaries.above[y * 5 + x] >> eighth & 1 != 0 {
                        self.image.mark_above(x as u32, y as u32, eighth);
                    }
                    if y < 5 && boundaries.left[y * 6 + x] >> eighth & 1 != 0 {
                        self.image.mark_left(x as u32, y as u32, eighth);
                    }
                }
            }
        }
        let positions: [Option<u8>; 25] =
            std::array::from_fn(|_| (stream.below(3) != 0).then(|| stream.below(16) as u8));

        let pixels: [Pixel; 25] =
            std::array::from_fn(|i| match boundaries.crossings(i % 5, i / 5).as_slice() {
                [] => Pixel::default(),
                &[a, b] if a / 8 != b / 8 => Pixel {
                    edge: Some([a, b]),
                    blocked: false,
                },
                _ => Pixel {
                    edge: None,
                    blocked: true,
                },
            });
        let side = |i: usize, position: u8| match pixels[i].edge {
            _ if pixels[i].blocked => None,
            Some(edge) => side_of_position(edge, position),
            None => Some(Side::Plus),
        };
        let samples = std::array::from_fn(|i| {
            let position = positions[i]?;
            side(i, position).map(|side| (side, position))
        });
        // The primary region of the centre: with the sample, else the larger, of equal ones the one at the upper left corner,
        // which lies on the Plus side of an edge from a lower to a higher segment.
        let centre = match (samples[12], pixels[12].edge) {
            _ if pixels[12].blocked => None,
            (Some((side, _)), _) => Some(side),
            (None, Some(edge)) => Some(larger_side(edge).unwrap_or(Side::Plus)),
            (None, None) => Some(Side::Plus),
        };
        (
            Truth {
                flood: Flood::new(5, &pixels),
                samples,
                centre,
            },
            positions,
        )
    }

    fn insert(&mut self, i: usize, position: u8, colour: Vec3) {
        let quarter = |i: u8| (f32::from(i) + 0.5) / 4.0;
        let corner = Vec2::new((i % 5) as f32, (i / 5) as f32);
        let position = corner + Vec2::new(quarter(position % 4), quarter(position / 4));
        assert!(
            self.image.insert(&Point {
                position,
                depth: 1.0,
                colour,
            }),
            "{position} is inside"
        );
    }

    /// Does the image say that the centre may use the sample of pixel `i`?
    fn uses(&self, i: usize) -> bool {
        let (x, y) = ((i % 5) as u32, (i / 5) as u32);
        let usable = self
            .image
            .sample(x, y)
            .is_some_and(|s| self.image.edge(x, y).side(s.position) == RegionSide::Primary);
        let bit = i - usize::from(i > 12);
        usable && (i == 12 || self.image.reach_mask(2, 2) >> bit & 1 != 0)
    }
}

#[test]
fn no_sample_is_used_across_an_edge_in_random_windows() {
    let mut stream = Stream::new(5);
    let mut window = Window::new();
    let (mut simple, mut used, mut kept_apart) = (0, 0, 0);
    let (mut round, mut checked) = (0, 0);
    while checked < 100_000 {
        round += 1;
        let (mut truth, positions) = window.draw(&mut stream);
        // A complex centre takes every sample.
        let Some(centre) = truth.centre else { continue };
        checked += 1;
        truth.flood.fill(12, centre, Moves::All);
        // Red what the fill reaches, green what it does not.
        for (i, position) in positions.into_iter().enumerate() {
            let Some(position) = position else { continue };
            let reached = truth.samples[i].is_some_and(|(side, at)| truth.flood.reached_at(i, side, at));
            window.insert(i, position, if reached { Vec3::X } else { Vec3::Y });
            kept_apart += usize::from(!reached);
        }
        window.image.classify();
        window.image.reach();
        window.image.interpolate(&mut window.picture);
        let centre = window.picture.pixel(2, 2);
        assert_eq!(
            centre.y, 0.0,
            "round {round}: the picture holds a sample from behind an edge"
        );
        for i in 0..25 {
            if window.uses(i) {
                used += 1;
                let (side, at) =
                    truth.samples[i].unwrap_or_else(|| panic!("round {round}: unusable sample {i}"));
                assert!(
                    truth.flood.reached_at(i, side, at),
                    "round {round}: sample {i} is used across an edge"
                );
            }
        }
        assert_eq!(
            centre.x > 0.0,
            (0..25).any(|i| window.uses(i)),
            "round {round}: used is what the masks say"
        );
        assert_eq!(
            centre.x > 0.0,
            window.picture.priorities(2)[2] != UNREACHED,
            "round {round}: priority"
        );
        simple += usize::from(window.image.class(2, 2) == PixelClass::Simple);
    }
    println!("{simple} simple centres, {used} samples used, {kept_apart} kept apart");
    assert!(
        simple > 15_000 && used > 500_000 && kept_apart > 200_000,
        "{simple} {used} {kept_apart}"
    );
}

#[test]
fn what_a_monotone_path_reaches_is_found() {
    let mut stream = Stream::new(6);
    let mut window = Window::new();
    let (mut reachable, mut found, mut anyhow) = (0, 0, 0);
    for _ in 0..5_000 {
        let (mut truth, positions) = window.draw(&mut stream);
        let Some(centre) = truth.centre else { continue };
        for (i, position) in positions.into_iter().enumerate() {
            if let Some(position) = position {
                window.insert(i, position, Vec3::ONE);
            }
        }
        window.image.classify();
        window.image.reach();
        for moves in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
            truth.flood.fill(12, centre, Moves::Monotone(moves.0, moves.1));
        }
        let count = |flood: &Flood| {
            let reached =
                |i: &usize| truth.samples[*i].is_some_and(|(side, at)| flood.reached_at(*i, side, at));
            let reached: Vec<usize> = (0..25).filter(reached).collect();
            (reached.len(), reached.iter().filter(|&&i| window.uses(i)).count())
        };
        let (all, uses) = count(&truth.flood);
        reachable += all;
        found += uses;
        truth.flood.fill(12, centre, Moves::All);
        anyhow += count(&truth.flood).0;
    }
    let share = f64::from(found as u32) / f64::from(reachable as u32);
    println!(
        "of {reachable} samples on monotone paths {found} are found: {:.2}%; on any path inside the window {anyhow}: {:.2}%",
        100.0 * share,
        100.0 * f64::from(found as u32) / f64::from(anyhow as u32)
    );
    assert!(
        share >= 0.9,
        "only {share} of the samples on monotone paths are found"
    );
}
