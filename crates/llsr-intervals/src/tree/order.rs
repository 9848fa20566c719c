//! Top-down ordering of items into blocks, with wide-ranging items stored high.
//!
//! Bala et al. (2003, section 6.4) split a node on one axis of the normals and store an edge at a node if its
//! normals span more than half of the node's range. The same rule serves any items with a place and an extent:
//! for faces it keeps large triangles out of the boxes of small ones.

/// Where an item lies and how far it extends on the first three axes of that place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Key<const K: usize> {
    /// Place; axes are scaled so that equal lengths are equally worth a split.
    pub(crate) place: [f32; K],
    /// Full extent on the first three axes.
    pub(crate) span: [f32; 3],
    /// The item.
    pub(crate) item: u32,
}

/// How to order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ordering {
    /// Largest number of items in a block.
    pub(crate) block: usize,
    /// Whether wide-ranging items are stored high.
    pub(crate) wide_high: bool,
    /// Items that extend no further than this are never wide.
    pub(crate) narrow: f32,
}

/// The tree that the ordering found, over positions in the ordered list.
#[derive(Debug)]
pub(crate) enum Shape {
    /// Consecutive items.
    Block { start: usize, end: usize },
    /// Two or three parts, with the number of blocks in them.
    Split { parts: Vec<Shape>, blocks: usize },
}

impl Shape {
    fn split(parts: Vec<Self>) -> Self {
        let blocks = parts.iter().map(Self::blocks).sum();
        Self::Split { parts, blocks }
    }

    /// Number of blocks.
    pub(crate) fn blocks(&self) -> usize {
        match self {
            Self::Block { .. } => 1,
            Self::Split { blocks, .. } => *blocks,
        }
    }

    /// First position and the one after the last.
    pub(crate) fn range(&self) -> (usize, usize) {
        match self {
            Self::Block { start, end } => (*start, *end),
            Self::Split { parts, .. } => {
                let first = parts.first().map_or(0, |p| p.range().0);
                (first, parts.last().map_or(0, |p| p.range().1))
            }
        }
    }
}

/// An item is wide if it spans more than this share of its node's range (Bala et al. 2003, section 6.4).
const WIDE: f32 = 0.5;
/// Below this many blocks a node keeps its wide items: they would fill no block of their own.
const FEWEST_BLOCKS: usize = 4;
/// Subtrees of at least this many items are worth a thread.
#[cfg(feature = "rayon")]
const PARALLEL: usize = 1 << 14;

/// Sorts `keys` into blocks. Cost: O(n log n).
pub(crate) fn order<const K: usize>(keys: &mut [Key<K>], rule: Ordering) -> Shape {
    subtree(keys, 0, rule)
}

fn subtree<const K: usize>(keys: &mut [Key<K>], start: usize, rule: Ordering) -> Shape {
    if keys.len() <= rule.block {
        let end = start + keys.len();
        return Shape::Block { start, end };
    }
    let extent = extent(keys);
    if rule.wide_high && keys.len() > FEWEST_BLOCKS * rule.block {
        let wide = gather_wide(keys, &extent, rule.narrow);
        // Without gathering below: what is wide here is of all sizes relative to its own kind.
        if wide >= rule.block / 2 && wide < keys.len() {
            let below = Ordering {
                wide_high: false,
                ..rule
            };
            let (high, rest) = keys.split_at_mut(wide);
            let smaller = high.len().min(rest.len());
            let (high, rest) = both(
                || subtree(high, start, below),
                || subtree(rest, start + wide, rule),
                smaller,
            );
            return Shape::split(match rest {
                Shape::Split { parts, .. } if parts.len() == 2 => {
                    std::iter::once(high).chain(parts).collect()
                }
                rest => vec![high, rest],
            });
        }
    }
    let axis = (0..K).fold(0, |best, k| if extent[k] > extent[best] { k } else { best });
    // A whole number of blocks to the left keeps all blocks but one full.
    let middle = keys.len().div_ceil(rule.block) / 2 * rule.block;
    keys.select_nth_unstable_by(middle, |a, b| a.place[axis].total_cmp(&b.place[axis]));
    let (left, right) = keys.split_at_mut(middle);
    let size = right.len();
    let (left, right) = both(
        || subtree(left, start, rule),
        || subtree(right, start + middle, rule),
        size,
    );
    Shape::split(vec![left, right])
}

/// Runs both, on two threads if the smaller has work for one.
fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send, size: usize) -> (A, B) {
    #[cfg(feature = "rayon")]
    if size >= PARALLEL {
        return rayon::join(a, b);
    }
    let _ = size;
    (a(), b())
}

fn extent<const K: usize>(keys: &[Key<K>]) -> [f32; K] {
    let mut lo = [f32::INFINITY; K];
    let mut hi = [f32::NEG_INFINITY; K];
    for key in keys {
        for k in 0..K {
            lo[k] = if key.place[k] < lo[k] { key.place[k] } else { lo[k] };
            hi[k] = if key.place[k] > hi[k] { key.place[k] } else { hi[k] };
        }
    }
    std::array::from_fn(|k| hi[k] - lo[k])
}

/// Moves the wide items to the front and returns their number.
fn gather_wide<const K: usize>(keys: &mut [Key<K>], extent: &[f32; K], narrow: f32) -> usize {
    let limit: [f32; 3] = std::array::from_fn(|k| (WIDE * extent[k]).max(narrow));
    let mut wide = 0;
    for i in 0..keys.len() {
        let span = keys[i].span;
        if span[0] > limit[0] || span[1] > limit[1] || span[2] > limit[2] {
            keys.swap(wide, i);
            wide += 1;
        }
    }
    wide
}
