//! The tree that finds the edges or faces whose planes lie on given sides of a viewer.
//!
//! Inner nodes bound the planes of what is below them by intervals: for each plane of an item one interval vector
//! of normals and one interval of offsets. A normal and an offset decide the side of a viewer just as the normals
//! and positions of Bala et al. (2003, section 6.4) do, but by one linear form, so that faces of one plane need no
//! room however far they extend, and what a node's intervals say holds without the correlation between position
//! and normal being lost. Nodes have sixteen children, tested together. Leaves are blocks of 64 items whose planes
//! are quantised to 16 bits; the few that lie within a quantisation step of the viewer's side are decided by an
//! exact test of the caller's, so the answer is that of testing every item exactly.

mod blocks;
mod faces;
mod hierarchy;
mod kernel;
mod order;
mod plane;
mod scan;

pub use faces::{Beam, FaceColumns, FaceHit, FaceScratch, FaceStatistics, FaceTree, NarrowedFaces, Wedge};
pub use kernel::Instructions;
pub use plane::Plane;
pub use scan::PlaneScan;

use glam::{DVec3, Vec3};

use crate::Viewpoint;
use blocks::{BLOCK, BlockMasks, PlaneBlock, View};
use hierarchy::{Hierarchy, map_blocks};
use kernel::NodeMasks;
use order::{Key, Ordering};

/// Which items a query returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Select {
    /// Those of which some plane faces some viewer and some does not: silhouette edges of one viewer, and all
    /// that may be one for some viewer in the hull of several.
    Mixed,
    /// Those of which every plane faces every viewer.
    AllFront,
    /// Those of which no plane faces any viewer.
    AllBack,
}

/// How a tree is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeOptions {
    /// Store items high whose normals span more than half of their node's range. Bala et al. (2003) name it for
    /// scanned meshes; it is worth 1.4 times on the dragon.
    pub sharp_high: bool,
    /// What a difference of offsets of the mesh's radius counts for in ordering, against one of 1 in normals.
    pub offset_weight: f32,
}

impl Default for TreeOptions {
    fn default() -> Self {
        Self {
            sharp_high: true,
            offset_weight: 0.8,
        }
    }
}

/// What a query did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueryStatistics {
    /// Nodes tested; each test is of up to sixteen children.
    pub nodes: usize,
    /// Blocks scanned; up to 64 items each.
    pub blocks: usize,
    /// Items returned because their node's intervals decided, without looking at them.
    pub taken_whole: usize,
    /// Items decided by the exact test.
    pub exact: usize,
}

/// Working memory of queries, kept so that they do not allocate.
#[derive(Clone, Debug, Default)]
pub struct QueryScratch {
    views: Vec<View>,
    frontier: Vec<u32>,
    next: Vec<u32>,
    node_masks: Vec<NodeMasks>,
    blocks: Vec<u32>,
    block_masks: Vec<BlockMasks>,
}

/// A tree over items of `P` planes each: two for an edge between two faces.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use llsr_intervals::{Plane, PlaneTree, QueryScratch, Select, TreeOptions, Viewpoint};
///
/// // A roof's ridge.
/// let left = [DVec3::ZERO, DVec3::X, DVec3::new(0.0, -1.0, 1.0)];
/// let right = [DVec3::X, DVec3::ZERO, DVec3::new(0.0, -1.0, -1.0)];
/// let planes = [left, right].map(|corners| Plane::of(corners).unwrap());
/// let tree = PlaneTree::build(
///     1, DVec3::ZERO, 1.5, |_| Some(planes), |_| (Vec3::ZERO, Vec3::X), TreeOptions::default(),
/// );
/// let mut found = Vec::new();
/// let viewer = Viewpoint::at(DVec3::new(0.5, -0.9, 3.0)).unwrap();
/// let exact = |_item| viewer.sees_front(left) != viewer.sees_front(right);
/// tree.query(&[viewer], Select::Mixed, exact, &mut QueryScratch::default(), &mut found);
/// assert_eq!(found, [0], "from below the eaves' height the ridge is a silhouette");
/// ```
#[derive(Clone, Debug)]
pub struct PlaneTree<const P: usize> {
    hierarchy: Hierarchy<P>,
    blocks: Vec<PlaneBlock<P>>,
    /// Items without a steady plane, always decided exactly.
    unsteady: Vec<u32>,
    center: DVec3,
    scale: f64,
    instructions: Instructions,
}

/// Bounds the rounding of a node's test: four products of numbers of at most 1, each off by two roundings, and
/// their sum, with a factor of two to spare.
const NODE_PAD: f32 = 32.0 * (0.5 * f32::EPSILON);

/// Spans of normals (radians) below which an item is never stored high.
const NARROW: f32 = 0.02;

impl<const P: usize> PlaneTree<P> {
    /// Builds the tree of items `0..count`.
    ///
    /// `center` and `radius` are of a sphere around all corners of the items' planes. `planes` gives an item's
    /// planes, or `None` if one of them is too thin to have a steady normal ([`Plane::of`]); such items are
    /// decided exactly in each query. `bounds` gives an item's bounding box. Cost: O(n log n), about 0.4 s for
    /// 1.3 million edges on one core; the `rayon` feature uses all, with the same result.
    pub fn build(
        count: u32,
        center: DVec3,
        radius: f64,
        planes: impl Fn(u32) -> Option<[Plane; P]> + Sync,
        bounds: impl Fn(u32) -> (Vec3, Vec3) + Sync,
        options: TreeOptions,
    ) -> Self {
        let scale = frame_scale(radius);
        let local = |item: u32| {
            planes(item).map(|planes| in_order(planes.map(|plane| plane.coefficients(center, scale))))
        };
        let chunk = 1 << 12;
        let keys: Vec<Vec<Option<Key<4>>>> = map_blocks((count as usize).div_ceil(chunk), |part| {
            let first = (part * chunk) as u32;
            (first..count.min(first + chunk as u32))
                .map(|item| local(item).map(|planes| key(&planes, item, options.offset_weight)))
                .collect()
        });
        let mut unsteady = Vec::new();
        let mut steady = Vec::with_capacity(count as usize);
        for (item, key) in (0..count).zip(keys.into_iter().flatten()) {
            match key {
                Some(key) => steady.push(key),
                None => unsteady.push(item),
            }
        }
        let rule = Ordering {
            block: BLOCK,
            wide_high: options.sharp_high,
            narrow: NARROW,
        };
        // Only items with planes are in the tree.
        let known = |item| local(item).unwrap_or([[0.0; 4]; P]);
        let hierarchy = Hierarchy::build(steady, rule, known, bounds);
        let blocks = map_blocks(hierarchy.blocks(), |block| {
            PlaneBlock::new(hierarchy.block_items(block).iter().map(|&item| known(item)))
        });
        Self {
            hierarchy,
            blocks,
            unsteady,
            center,
            scale,
            instructions: Instructions::detect(),
        }
    }

    /// Numbers the items anew, so that those that are found together have numbers near each other; returns their numbers before, in the
    /// order of the new ones.
    ///
    /// What is kept for each item is then best put into this order: a query of a large tree would otherwise be followed by an access to
    /// distant memory for each item found.
    pub fn renumber(&mut self) -> Vec<u32> {
        let mut before = Vec::with_capacity(self.len());
        for items in [&mut self.hierarchy.items, &mut self.unsteady] {
            for item in items {
                let number = before.len() as u32;
                before.push(std::mem::replace(item, number));
            }
        }
        before
    }

    /// The same tree, queried with other instructions than the fastest: for tests and measurements. Takes the
    /// portable ones where the processor does not have those asked for.
    #[must_use]
    pub fn with_instructions(mut self, instructions: Instructions) -> Self {
        self.instructions = instructions.or_portable();
        self
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.hierarchy.items.len() + self.unsteady.len()
    }

    /// There are no items.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of nodes and of blocks.
    pub fn size(&self) -> (usize, usize) {
        (self.hierarchy.links.len(), self.blocks.len())
    }

    /// Appends to `found` the items that `select` names for `viewers`, in an order that depends on the tree only.
    ///
    /// `exact` decides one item; it is asked about the few that the tree's planes leave open, and about those
    /// without a steady plane. Its answer must be that of [`Viewpoint::sees_front`] on the items' planes: then
    /// the result is exactly the set of items that satisfy `select`.
    ///
    /// Cost: about 10 ns a node and 25 ns a block of 64 items for each viewer.
    pub fn query(
        &self,
        viewers: &[Viewpoint],
        select: Select,
        mut exact: impl FnMut(u32) -> bool,
        scratch: &mut QueryScratch,
        found: &mut Vec<u32>,
    ) -> QueryStatistics {
        let mut statistics = QueryStatistics::default();
        scratch.views.clear();
        scratch
            .views
            .extend(viewers.iter().map(|viewer| view(viewer, self.center, self.scale)));
        scratch.blocks.clear();
        scratch.frontier.clear();
        if !self.hierarchy.links.is_empty() {
            scratch.frontier.push(0);
        }
        while !scratch.frontier.is_empty() {
            statistics.nodes += scratch.frontier.len();
            self.descend(select, scratch, found, &mut statistics);
        }
        statistics.blocks = scratch.blocks.len();
        kernel::scan_blocks(
            self.instructions,
            &self.blocks,
            &scratch.blocks,
            &scratch.views,
            &mut scratch.block_masks,
        );
        for (&block, masks) in scratch.blocks.iter().zip(&scratch.block_masks) {
            let items = self.hierarchy.block_items(block as usize);
            let present = u64::MAX >> (BLOCK - items.len());
            let mut hits = present
                & match select {
                    Select::Mixed => !(masks.front | masks.back),
                    Select::AllFront => masks.front,
                    Select::AllBack => masks.back,
                };
            let mut unsure = masks.unsure & present;
            statistics.exact += unsure.count_ones() as usize;
            while unsure != 0 {
                let bit = unsure.trailing_zeros();
                let hit = u64::from(exact(items[bit as usize]));
                hits = hits & !(1 << bit) | hit << bit;
                unsure &= unsure - 1;
            }
            if hits != 0 {
                kernel::emit(self.instructions, items, hits, found);
            }
        }
        statistics.exact += self.unsteady.len();
        found.extend(self.unsteady.iter().copied().filter(|&item| exact(item)));
        statistics
    }

    /// Tests the frontier; its open children are the next frontier and more blocks.
    fn descend(
        &self,
        select: Select,
        scratch: &mut QueryScratch,
        found: &mut Vec<u32>,
        statistics: &mut QueryStatistics,
    ) {
        let tree = &self.hierarchy;
        kernel::test_nodes(
            self.instructions,
            &tree.planes,
            &scratch.frontier,
            &scratch.views,
            NODE_PAD,
            &mut scratch.node_masks,
        );
        scratch.next.clear();
        for (&node, masks) in scratch.frontier.iter().zip(&scratch.node_masks) {
            let links = &tree.links[node as usize];
            let present = u16::MAX >> (hierarchy::LANES as u32 - links.count);
            let (none, whole) = match select {
                Select::Mixed => (
                    masks.all_front | masks.all_back,
                    masks.some_front & masks.some_back,
                ),
                Select::AllFront => (masks.some_back, masks.all_front),
                Select::AllBack => (masks.some_front, masks.all_back),
            };
            let mut taken = present & whole;
            while taken != 0 {
                let lane = taken.trailing_zeros() as usize;
                taken &= taken - 1;
                let child = links.child[lane] as usize;
                let (start, end) = if links.blocks >> lane & 1 == 1 {
                    (tree.starts[child], tree.starts[child + 1])
                } else {
                    tree.links[child].range
                };
                statistics.taken_whole += (end - start) as usize;
                found.extend_from_slice(&tree.items[start as usize..end as usize]);
            }
            let mut open = present & !none & !whole;
            while open != 0 {
                let lane = open.trailing_zeros() as usize;
                open &= open - 1;
                if links.blocks >> lane & 1 == 1 {
                    scratch.blocks.push(links.child[lane]);
                } else {
                    scratch.next.push(links.child[lane]);
                }
            }
        }
        std::mem::swap(&mut scratch.frontier, &mut scratch.next);
    }
}

/// Lengths times this are at most 1.
fn frame_scale(radius: f64) -> f64 {
    if radius > 0.0 { radius.recip() } else { 1.0 }
}

/// Coefficients of at most 1 whose dot product with a plane (normal, offset) has the sign of the viewer's side.
fn view(viewer: &Viewpoint, center: DVec3, scale: f64) -> View {
    let (direction, w) = if viewer.is_at_infinity() {
        (viewer.position(), 0.0)
    } else {
        ((viewer.position() - center) * scale, 1.0)
    };
    let largest = direction.abs().max_element().max(w);
    let d = direction / largest;
    [d.x as f32, d.y as f32, d.z as f32, (-w / largest) as f32]
}

/// Planes of an item in an order that like items share, so that each has its own interval in a node.
fn in_order<const P: usize>(mut planes: [[f64; 4]; P]) -> [[f64; 4]; P] {
    // Any direction that is not special for rooms or solids will do.
    let rank = |plane: &[f64; 4]| 0.6 * plane[0] + 0.5 * plane[1] + 0.62 * plane[2];
    planes.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    planes
}

fn key<const P: usize>(planes: &[[f64; 4]; P], item: u32, offset_weight: f32) -> Key<4> {
    let mean = |k: usize| (planes.iter().map(|plane| plane[k]).sum::<f64>() / P as f64) as f32;
    let span = |k: usize| {
        let (lo, hi) = planes
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), plane| {
                (lo.min(plane[k]), hi.max(plane[k]))
            });
        (hi - lo) as f32
    };
    Key {
        place: [mean(0), mean(1), mean(2), mean(3) * offset_weight],
        span: [span(0), span(1), span(2)],
        item,
    }
}
