//! Which parts of edges are hidden, exactly along each.

use llsr_scene::SegmentOracle;
use llsr_visibility::Partition;

use super::{Part, Stroke};
use crate::Eye;

/// From where hidden parts are judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// The viewer.
    pub eye: Eye,
    /// Diagonal of the scene's bounding box (m).
    pub diagonal: f64,
    /// Edges are moved towards the viewer by this share of their distance, or of the diagonal if that is less.
    ///
    /// The faces of an edge touch it and must not hide it. In exact arithmetic they do not, as they end there; but the
    /// edge's ends are rounded when an instance is put into the scene, and neighbours that only almost meet (a frame on its
    /// wall, two meshes with one border) should not hide each other either. Moved along its own lines of sight an edge looks
    /// the same, and what lies nearer in front of it than this hides nothing.
    pub lift: f64,
}

/// For parallel rays a viewer this many diagonals away stands in, for pieces of an edge of at most 1/64 of a diagonal:
/// rays then end within 2^-16 of a diagonal of where parallel ones would.
const FAR: f64 = 1024.0;
const PIECE: f64 = 1.0 / 64.0;

impl Sight {
    /// For edges of objects, which are off by the rounding of single precision only: a lift of 2^-20.
    pub fn of_edges(eye: Eye, diagonal: f64) -> Self {
        Self {
            eye,
            diagonal,
            lift: 1.0 / f64::from(1 << 20),
        }
    }

    /// For lines that lie somewhere on a surface, as shadow edges do, and are rounded to either side of it: 2^-15.
    ///
    /// A surface seen at an angle of d radians then hides nothing of a line that rounding put up to 2^-15 d of the distance
    /// below it.
    pub fn of_lines_on_surfaces(eye: Eye, diagonal: f64) -> Self {
        Self {
            eye,
            diagonal,
            lift: 1.0 / f64::from(1 << 15),
        }
    }

    /// Appends to `parts` the visible and hidden stretches of stroke number `index`, in order; together they cover it.
    fn split<O: SegmentOracle>(
        &self,
        index: u32,
        stroke: &Stroke,
        oracle: &O,
        memory: &mut Memory<O::Scratch>,
        parts: &mut Vec<Part>,
    ) {
        let [a, b] = stroke.ends;
        let visible = &mut memory.visible;
        visible.clear();
        let mut add = |lo: f64, hi: f64| match visible.last_mut() {
            Some(last) if lo <= last[1] => last[1] = last[1].max(hi),
            _ => visible.push([lo, hi]),
        };
        match self.eye {
            Eye::At(p) => {
                let distance = p.distance(a).max(p.distance(b));
                let lift = self.lift * (self.diagonal / distance).min(1.0);
                let [a, b] = [a, b].map(|x| x + (p - x) * lift);
                oracle.visible_part(p, a, b, &mut memory.scratch, &mut memory.partition);
                for panel in memory.partition.panels() {
                    add(panel.start, panel.end);
                }
            }
            Eye::Towards(direction) => {
                let towards = direction.normalize_or_zero() * self.diagonal;
                let count = (a.distance(b) / (PIECE * self.diagonal)).ceil().clamp(1.0, 1e4);
                let at = |i: f64| stroke.at(i / count) + towards * self.lift;
                for i in 0..count as u32 {
                    let i = f64::from(i);
                    let p = at(i + 0.5) + towards * FAR;
                    oracle.visible_part(p, at(i), at(i + 1.0), &mut memory.scratch, &mut memory.partition);
                    for panel in memory.partition.panels() {
                        add((i + panel.start) / count, (i + panel.end) / count);
                    }
                }
            }
        }
        let mut from = 0.0;
        let mut push = |hidden: bool, from: f64, to: f64| {
            if from < to {
                parts.push(Part {
                    stroke: index,
                    hidden,
                    t: [from, to],
                });
            }
        };
        for &[lo, hi] in &memory.visible {
            push(true, from, lo);
            push(false, lo, hi);
            from = hi;
        }
        push(true, from, 1.0);
    }
}

/// Working memory of one thread.
struct Memory<S> {
    scratch: S,
    partition: Partition,
    visible: Vec<[f64; 2]>,
}

/// Strokes handled together, a unit of parallel work.
const CHUNK: usize = 64;

/// Splits strokes where something begins or ceases to hide them, in their order.
///
/// `oracle` sees the scene in which the strokes are edges; one query a stroke from a point, some more for parallel rays. The places of
/// the splits are as exact as the oracle's answer; what is nearer in front of a stroke than the sight's
/// [`lift`](Sight::lift) does not hide it, so that neither an edge's own faces nor faces that touch it do. The `rayon`
/// feature uses all threads, with the same result.
pub fn split_hidden<O: SegmentOracle + Sync>(strokes: &[Stroke], sight: &Sight, oracle: &O) -> Vec<Part> {
    let chunk = |memory: &mut Memory<O::Scratch>, number: usize, strokes: &[Stroke]| {
        let mut parts = Vec::with_capacity(strokes.len() + 8);
        for (index, stroke) in (number * CHUNK..).zip(strokes) {
            sight.split(index as u32, stroke, oracle, memory, &mut parts);
        }
        parts
    };
    let memory = || Memory {
        scratch: O::Scratch::default(),
        partition: Partition::dark(),
        visible: Vec::new(),
    };
    #[cfg(feature = "rayon")]
    let parts: Vec<Vec<Part>> = {
        use rayon::prelude::*;
        strokes
            .par_chunks(CHUNK)
            .enumerate()
            .map_init(memory, |memory, (number, strokes)| chunk(memory, number, strokes))
            .collect()
    };
    #[cfg(not(feature = "rayon"))]
    let parts: Vec<Vec<Part>> = {
        let mut memory = memory();
        let chunks = strokes.chunks(CHUNK).enumerate();
        chunks
            .map(|(number, strokes)| chunk(&mut memory, number, strokes))
            .collect()
    };
    parts.concat()
}
