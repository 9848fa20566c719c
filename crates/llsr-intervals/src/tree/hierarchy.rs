//! The wide tree: nodes of sixteen children in structure-of-arrays form over blocks of items.

use glam::Vec3;

use super::order::{Key, Ordering, Shape, order};

/// Children of a node.
pub(crate) const LANES: usize = 16;

/// Bounds of one child's planes: intervals of (normal, offset) for each of the `P` planes of its items.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlaneBox<const P: usize> {
    pub(crate) lo: [[f32; 4]; P],
    pub(crate) hi: [[f32; 4]; P],
}

impl<const P: usize> PlaneBox<P> {
    pub(crate) const EMPTY: Self = Self {
        lo: [[f32::INFINITY; 4]; P],
        hi: [[f32::NEG_INFINITY; 4]; P],
    };

    /// Takes in the planes of an item, rounded outwards.
    pub(crate) fn include(&mut self, planes: &[[f64; 4]; P]) {
        for (p, plane) in planes.iter().enumerate() {
            for (k, &x) in plane.iter().enumerate() {
                let near = x as f32;
                let below = if f64::from(near) > x {
                    near.next_down()
                } else {
                    near
                };
                let above = if f64::from(near) < x { near.next_up() } else { near };
                self.lo[p][k] = self.lo[p][k].min(below);
                self.hi[p][k] = self.hi[p][k].max(above);
            }
        }
    }

    fn hull(&mut self, other: &Self) {
        for p in 0..P {
            for k in 0..4 {
                self.lo[p][k] = self.lo[p][k].min(other.lo[p][k]);
                self.hi[p][k] = self.hi[p][k].max(other.hi[p][k]);
            }
        }
    }
}

/// The plane boxes of a node's children. Lanes without a child hold empty boxes, which no test lets pass.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct PlaneLanes<const P: usize> {
    pub(crate) lo: [[[f32; LANES]; 4]; P],
    pub(crate) hi: [[[f32; LANES]; 4]; P],
}

/// The bounding boxes of a node's children.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct BoundsLanes {
    pub(crate) min: [[f32; LANES]; 3],
    pub(crate) max: [[f32; LANES]; 3],
}

/// What a node's children are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Links {
    /// Node or block number of each child.
    pub(crate) child: [u32; LANES],
    /// Bit set: the child is a block.
    pub(crate) blocks: u16,
    /// Number of children.
    pub(crate) count: u32,
    /// Items below the node, as positions in [`Hierarchy::items`].
    pub(crate) range: (u32, u32),
}

/// Nodes over blocks of items; generic over the number of planes of an item (two for an edge, one for a face).
#[derive(Clone, Debug)]
pub(crate) struct Hierarchy<const P: usize> {
    pub(crate) planes: Vec<PlaneLanes<P>>,
    pub(crate) bounds: Vec<BoundsLanes>,
    pub(crate) links: Vec<Links>,
    /// Items of block `b` are `items[starts[b]..starts[b + 1]]`.
    pub(crate) starts: Vec<u32>,
    pub(crate) items: Vec<u32>,
}

/// Bounds of everything below a node or in a block.
#[derive(Clone, Copy)]
struct Summary<const P: usize> {
    planes: PlaneBox<P>,
    min: Vec3,
    max: Vec3,
}

impl<const P: usize> Hierarchy<P> {
    /// Orders `keys` and bounds the result; `planes` and `bounds` describe an item.
    ///
    /// Planes are (unit normal, offset) in a frame in which all offsets are at most about 1.
    pub(crate) fn build<const K: usize>(
        mut keys: Vec<Key<K>>,
        rule: Ordering,
        planes: impl Fn(u32) -> [[f64; 4]; P] + Sync,
        bounds: impl Fn(u32) -> (Vec3, Vec3) + Sync,
    ) -> Self {
        let shape = order(&mut keys, rule);
        let items: Vec<u32> = keys.iter().map(|key| key.item).collect();
        drop(keys);
        let mut starts = Vec::with_capacity(items.len() / rule.block + 2);
        if !items.is_empty() {
            collect_starts(&shape, &mut starts);
        }
        starts.push(items.len() as u32);

        let summarize = |block: usize| {
            let mut summary = Summary {
                planes: PlaneBox::EMPTY,
                min: Vec3::INFINITY,
                max: Vec3::NEG_INFINITY,
            };
            for &item in &items[starts[block] as usize..starts[block + 1] as usize] {
                summary.planes.include(&planes(item));
                let (min, max) = bounds(item);
                summary.min = summary.min.min(min);
                summary.max = summary.max.max(max);
            }
            summary
        };
        let summaries: Vec<Summary<P>> = map_blocks(starts.len() - 1, summarize);

        let mut tree = Self {
            planes: Vec::new(),
            bounds: Vec::new(),
            links: Vec::new(),
            starts: Vec::new(),
            items: Vec::new(),
        };
        if !items.is_empty() {
            tree.add_node(&shape, &starts, &summaries);
        }
        Self {
            starts,
            items,
            ..tree
        }
    }

    /// Number of blocks.
    pub(crate) fn blocks(&self) -> usize {
        self.starts.len() - 1
    }

    /// The items of a block.
    pub(crate) fn block_items(&self, block: usize) -> &[u32] {
        &self.items[self.starts[block] as usize..self.starts[block + 1] as usize]
    }

    /// Appends the node for `shape` and what is below it.
    fn add_node(&mut self, shape: &Shape, starts: &[u32], blocks: &[Summary<P>]) -> (u32, Summary<P>) {
        // Children are the largest subtrees of at most 16^k blocks, with the k that makes them just fit: so nodes
        // are well filled at every level, most of all at the lowest, where most nodes are.
        let mut largest_child = 1;
        while largest_child * LANES < shape.blocks() {
            largest_child *= LANES;
        }
        let mut parts = vec![shape];
        while let Some((at, split)) = parts
            .iter()
            .enumerate()
            .filter_map(|(at, part)| match part {
                Shape::Split {
                    parts: split, blocks, ..
                } if *blocks > largest_child && parts.len() + split.len() - 1 <= LANES => Some((at, split)),
                _ => None,
            })
            .max_by_key(|(at, _)| (parts[*at].blocks(), std::cmp::Reverse(*at)))
        {
            parts.splice(at..=at, split.iter());
        }

        let node = self.links.len();
        let (first, last) = shape.range();
        self.planes.push(PlaneLanes {
            lo: [[[f32::INFINITY; LANES]; 4]; P],
            hi: [[[f32::NEG_INFINITY; LANES]; 4]; P],
        });
        self.bounds.push(BoundsLanes {
            min: [[f32::INFINITY; LANES]; 3],
            max: [[f32::NEG_INFINITY; LANES]; 3],
        });
        self.links.push(Links {
            child: [0; LANES],
            blocks: 0,
            count: parts.len() as u32,
            range: (first as u32, last as u32),
        });
        let mut whole = Summary {
            planes: PlaneBox::EMPTY,
            min: Vec3::INFINITY,
            max: Vec3::NEG_INFINITY,
        };
        for (lane, part) in parts.iter().enumerate() {
            let (child, summary) = match part {
                Shape::Block { start, .. } => {
                    let block = starts.partition_point(|&s| (s as usize) < *start);
                    self.links[node].blocks |= 1 << lane;
                    (block as u32, blocks[block])
                }
                split => self.add_node(split, starts, blocks),
            };
            self.links[node].child[lane] = child;
            for p in 0..P {
                for k in 0..4 {
                    self.planes[node].lo[p][k][lane] = summary.planes.lo[p][k];
                    self.planes[node].hi[p][k][lane] = summary.planes.hi[p][k];
                }
            }
            for axis in 0..3 {
                self.bounds[node].min[axis][lane] = summary.min[axis];
                self.bounds[node].max[axis][lane] = summary.max[axis];
            }
            whole.planes.hull(&summary.planes);
            whole.min = whole.min.min(summary.min);
            whole.max = whole.max.max(summary.max);
        }
        (node as u32, whole)
    }
}

fn collect_starts(shape: &Shape, starts: &mut Vec<u32>) {
    match shape {
        Shape::Block { start, .. } => starts.push(*start as u32),
        Shape::Split { parts, .. } => parts.iter().for_each(|part| collect_starts(part, starts)),
    }
}

/// `f` of every block number, in order; on all threads with the `rayon` feature.
pub(crate) fn map_blocks<T: Send>(count: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().with_min_len(256).map(&f).collect()
    }
    #[cfg(not(feature = "rayon"))]
    (0..count).map(f).collect()
}
