//! Synthetic edges with the counts and the pixel classes of the scenes of BWG03 tables 1 to 3.
//!
//! Sizes scale with the picture, so that the share of pixels with edges stays what it is at 512x512 only for the number
//! of edges given there; [`tiled`] repeats the 512x512 set to keep the share at any size.

use glam::Vec2;

use super::windows::Stream;

/// An edge on the screen with the depths of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// One end in pixels, y downwards.
    pub a: Vec2,
    /// The other.
    pub b: Vec2,
    /// Depths of the ends.
    pub depth: [f32; 2],
}

/// A named set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeSet {
    /// About 28 thousand short edges in smooth closed curves, as of rings and their shadows.
    Chains,
    /// About 9 thousand edges of all lengths, many parallel and crossing, as of furniture.
    Rooms,
    /// About 120 thousand tiny edges, half of them behind the others, as of a scanned dragon.
    Dragon,
}

impl EdgeSet {
    /// All sets.
    pub const ALL: [Self; 3] = [Self::Chains, Self::Rooms, Self::Dragon];

    /// The edges for a picture of 512x512 pixels; always the same.
    pub fn edges(self) -> Vec<Segment> {
        let mut stream = Stream::new(self as u64 + 11);
        let mut edges = Vec::new();
        match self {
            Self::Chains => {
                while edges.len() < 28_000 {
                    let centre = point(&mut stream, Vec2::ZERO, Vec2::splat(512.0));
                    let radii = Vec2::new(8.0 + 40.0 * stream.unit(), 6.0 + 20.0 * stream.unit());
                    closed_curve(&mut edges, &mut stream, (centre, radii), 0.55, 0.04);
                }
            }
            Self::Rooms => {
                while edges.len() < 9_000 {
                    let centre = point(&mut stream, Vec2::ZERO, Vec2::splat(512.0));
                    match stream.below(4) {
                        0 => parallel_lines(&mut edges, &mut stream, centre),
                        1 => closed_curve(&mut edges, &mut stream, (centre, Vec2::new(6.0, 4.0)), 1.0, 0.0),
                        _ => closed_curve(&mut edges, &mut stream, (centre, Vec2::new(2.0, 3.0)), 0.6, 0.1),
                    }
                }
            }
            Self::Dragon => {
                while edges.len() < 120_000 {
                    let at = point(&mut stream, Vec2::new(60.0, 140.0), Vec2::new(450.0, 380.0));
                    let radii = Vec2::new(2.0 + 10.0 * stream.unit(), 2.0 + 6.0 * stream.unit());
                    // Most lie inside the body, behind its surface.
                    let depth = if stream.below(8) == 0 { 1.0 } else { 3.0 };
                    let first = edges.len();
                    closed_curve(&mut edges, &mut stream, (at, radii), 0.3, 0.3);
                    edges[first..].iter_mut().for_each(|e| e.depth = [depth; 2]);
                }
            }
        }
        edges
    }
}

/// The set repeated over a picture of `width` x `height`, every 512 pixels; what lies outside is left out.
pub fn tiled(edges: &[Segment], width: u32, height: u32) -> Vec<Segment> {
    let mut all = Vec::new();
    for y in 0..height.div_ceil(512) {
        for x in 0..width.div_ceil(512) {
            let offset = Vec2::new((512 * x) as f32, (512 * y) as f32);
            let moved = edges.iter().map(|e| Segment {
                a: e.a + offset,
                b: e.b + offset,
                ..*e
            });
            all.extend(moved.filter(|e| e.a.x < width as f32 && e.a.y < height as f32));
        }
    }
    all
}

/// Edges everywhere: `count` chords of up to `length` pixels, which make nearly all pixels complex when there are enough.
pub fn thicket(width: u32, height: u32, count: usize, length: f32) -> Vec<Segment> {
    let mut stream = Stream::new(3);
    (0..count)
        .map(|_| {
            let a = point(&mut stream, Vec2::ZERO, Vec2::new(width as f32, height as f32));
            let b = a + point(&mut stream, Vec2::splat(-length), Vec2::splat(length));
            Segment {
                a,
                b,
                depth: [1.0; 2],
            }
        })
        .collect()
}

/// Parallel lines `spacing` pixels apart across the picture, slightly slanted: simple pixels nearly everywhere for 2 or less.
pub fn hatching(width: u32, height: u32, spacing: f32) -> Vec<Segment> {
    let (w, h) = (width as f32, height as f32);
    let lines = ((w + 0.3 * h) / spacing) as usize;
    (0..lines)
        .map(|i| {
            let x = i as f32 * spacing - 0.3 * h;
            Segment {
                a: Vec2::new(x, -1.0),
                b: Vec2::new(x + 0.3 * h, h + 1.0),
                depth: [1.0; 2],
            }
        })
        .collect()
}

fn point(stream: &mut Stream, from: Vec2, to: Vec2) -> Vec2 {
    from + (to - from) * Vec2::new(stream.unit(), stream.unit())
}

/// A rotated ellipse in steps of about `step` pixels, its radius shaken by up to `noise` of itself.
fn closed_curve(
    edges: &mut Vec<Segment>,
    stream: &mut Stream,
    (centre, radii): (Vec2, Vec2),
    step: f32,
    noise: f32,
) {
    let rotation = Vec2::from_angle(stream.unit() * std::f32::consts::TAU);
    let count = (4.4 * (radii.x + radii.y) / 2.0 * 1.4 / step).max(3.0) as usize;
    let depth = 1.0 + stream.unit();
    let mut corner = |i: usize| {
        let angle = i as f32 / count as f32 * std::f32::consts::TAU;
        let shaken = 1.0 + noise * (stream.unit() - 0.5) * step / radii.x.max(radii.y) * 8.0;
        centre + rotation.rotate(radii * Vec2::from_angle(angle)) * shaken.clamp(0.5, 1.5)
    };
    let first = corner(0);
    let mut a = first;
    for i in 1..=count {
        let b = if i == count { first } else { corner(i) };
        edges.push(Segment {
            a,
            b,
            depth: [depth; 2],
        });
        a = b;
    }
}

/// A few parallel lines close together, cut into pieces by what crosses them.
fn parallel_lines(edges: &mut Vec<Segment>, stream: &mut Stream, at: Vec2) {
    let direction = Vec2::from_angle(stream.unit() * std::f32::consts::TAU);
    let length = 4.0 + 60.0 * stream.unit() * stream.unit();
    for i in 0..1 + stream.below(3) {
        let a = at + direction.perp() * i as f32 * 1.7;
        let depth = [1.0 + stream.unit(), 1.0 + stream.unit()];
        edges.push(Segment {
            a,
            b: a + direction * length,
            depth,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_have_their_counts_and_stay_near_the_picture() {
        for (set, count) in EdgeSet::ALL.into_iter().zip([28_000, 9_000, 120_000]) {
            let edges = set.edges();
            assert!(
                edges.len() >= count && edges.len() < count + 1_000,
                "{set:?}: {}",
                edges.len()
            );
            assert!(
                edges
                    .iter()
                    .all(|e| e.a.is_finite() && e.a.abs().max_element() < 700.0),
                "{set:?}: strays"
            );
            assert_eq!(edges, set.edges(), "{set:?} is always the same");
        }
        assert_eq!(tiled(&[], 1000, 700).len(), 0, "nothing to repeat");
    }
}
