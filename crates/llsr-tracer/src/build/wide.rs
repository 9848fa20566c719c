//! Eight-way trees collapsed from binary ones.
//!
//! Which binary nodes become children of which wide node is chosen by dynamic programming over the surface-area
//! cost (Ylitie, Karras, Laine 2017, section 4.1): `cost(n, k)` is the least cost of the subtree at `n` as at most
//! `k` children of one wide node. A leaf is one block of up to sixteen triangles and costs the same however
//! full it is, because all lanes are tested at once.

use llsr_scene::Bounds;

use super::binary::BinaryTree;
use super::repack::fill_blocks;
use crate::block::BLOCK;
use crate::pages::Pages;

/// Children of a wide node.
pub(crate) const WIDTH: usize = 8;

/// The most entries that a traversal may have on its stack.
pub(crate) const STACK: usize = 248;

/// What a child reference points to; the upper two bits of a [`ChildRef`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Child {
    /// Another wide node.
    Node(usize),
    /// A block of triangles.
    Block(usize),
    /// A single item that is not a triangle: a shape, or a part in the tree of parts.
    Item(usize),
}

/// A packed [`Child`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct ChildRef(pub(crate) u32);

impl ChildRef {
    const KIND: u32 = 30;
    const INDEX: u32 = (1 << Self::KIND) - 1;
    pub(crate) const BLOCK: u32 = 1 << Self::KIND;
    pub(crate) const ITEM: u32 = 2 << Self::KIND;

    pub(crate) fn new(child: Child) -> Self {
        let (kind, index) = match child {
            Child::Node(i) => (0, i),
            Child::Block(i) => (Self::BLOCK, i),
            Child::Item(i) => (Self::ITEM, i),
        };
        assert!(index <= Self::INDEX as usize, "a tree has fewer than 2^30 nodes");
        Self(kind | index as u32)
    }

    #[inline(always)]
    pub(crate) fn is_node(self) -> bool {
        self.0 < Self::BLOCK
    }

    #[inline(always)]
    pub(crate) fn is_block(self) -> bool {
        self.0 & Self::BLOCK != 0
    }

    #[inline(always)]
    pub(crate) fn index(self) -> usize {
        (self.0 & Self::INDEX) as usize
    }
}

/// Eight boxes in structure-of-arrays form; an unused slot holds the empty box and is never entered.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct WideNode {
    /// Lower x, y, z, then upper x, y, z of each child (m).
    pub(crate) bounds: [[f32; WIDTH]; 6],
    pub(crate) children: [ChildRef; WIDTH],
}

impl WideNode {
    fn empty() -> Self {
        let (lo, hi) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Self {
            bounds: [lo, lo, lo, hi, hi, hi],
            children: [ChildRef::default(); WIDTH],
        }
    }

    fn set(&mut self, slot: usize, bounds: Bounds, child: Child) {
        for axis in 0..3 {
            self.bounds[axis][slot] = bounds.min[axis];
            self.bounds[axis + 3][slot] = bounds.max[axis];
        }
        self.children[slot] = ChildRef::new(child);
    }
}

/// An eight-way tree; node 0 is the root.
#[derive(Clone, Debug, Default)]
pub(crate) struct WideTree {
    pub(crate) nodes: Pages<WideNode>,
    pub(crate) bounds: Bounds,
}

/// Costs relative to each other: testing eight boxes, testing a block.
const NODE_COST: f32 = 1.0;
const BLOCK_COST: f32 = 1.3;

struct Collapse<'a> {
    tree: &'a BinaryTree,
    /// Vertices of the first items, which may share blocks; the others stand alone.
    triangles: &'a [[u32; 3]],
    /// `costs[n][k - 1]` for k = 1..=7.
    costs: Vec<[f32; WIDTH - 1]>,
    /// Whether the subtree may become one block.
    fits: Vec<bool>,
}

/// The different vertices of a few triangles, sorted; or too many of them.
#[derive(Clone, Copy)]
struct VertexSet {
    vertices: [u32; BLOCK],
    /// [`VertexSet::MANY`] if the set is no longer kept.
    len: usize,
}

impl VertexSet {
    const MANY: usize = usize::MAX;
    const NONE: Self = Self {
        vertices: [0; BLOCK],
        len: Self::MANY,
    };

    fn of(triangle: [u32; 3]) -> Self {
        let mut triangle = triangle;
        triangle.sort_unstable();
        let mut set = Self::NONE;
        set.vertices[..3].copy_from_slice(&triangle);
        set.len = 3;
        set
    }

    fn union(&self, other: &Self) -> Self {
        let mut set = Self::NONE;
        if self.len == Self::MANY || other.len == Self::MANY {
            return set;
        }
        let (mut left, mut right) = (&self.vertices[..self.len], &other.vertices[..other.len]);
        let mut len = 0;
        while let Some(&next) = match (left.first(), right.first()) {
            (Some(l), Some(r)) => Some(l.min(r)),
            (l, r) => l.or(r),
        } {
            if len == BLOCK {
                return set;
            }
            set.vertices[len] = next;
            len += 1;
            left = &left[usize::from(left.first() == Some(&next))..];
            right = &right[usize::from(right.first() == Some(&next))..];
        }
        set.len = len;
        set
    }
}

impl WideTree {
    /// Builds a tree over `boxes`. The first of them belong to `triangles`, which come in blocks: `block` receives the
    /// items of each new block, in the order of the block's index. The others stand alone as [`Child::Item`], counted from
    /// the first that is no triangle.
    ///
    /// No traversal needs more than [`STACK`] entries.
    pub(crate) fn build(boxes: &[Bounds], triangles: &[[u32; 3]], mut block: impl FnMut(&[u32])) -> Self {
        if boxes.is_empty() {
            return Self {
                nodes: Pages::new(&[WideNode::empty()]),
                bounds: Bounds::EMPTY,
            };
        }
        let mut tree = BinaryTree::clustered(boxes);
        fill_blocks(&mut tree, boxes, triangles);
        let mut plan = Collapse::new(&tree, triangles).plan();
        if plan.stack_needed() > STACK {
            tree = BinaryTree::balanced(boxes);
            plan = Collapse::new(&tree, triangles).plan();
        }
        let bounds = tree.nodes[0].bounds;
        for &(first, count) in &plan.blocks {
            block(&tree.order[first as usize..(first + count) as usize]);
        }
        Self {
            nodes: Pages::new(&plan.nodes),
            bounds,
        }
    }
}

/// The collapsed nodes and the item ranges of the blocks.
struct Plan {
    nodes: Vec<WideNode>,
    blocks: Vec<(u32, u32)>,
    depth: usize,
}

impl Plan {
    fn stack_needed(&self) -> usize {
        // On each level all children but the one entered wait on the stack, and eight are written at a time.
        (WIDTH - 1) * self.depth + WIDTH
    }
}

impl<'a> Collapse<'a> {
    fn new(tree: &'a BinaryTree, triangles: &'a [[u32; 3]]) -> Self {
        let n = tree.nodes.len();
        let mut this = Self {
            tree,
            triangles,
            costs: vec![[0.0; WIDTH - 1]; n],
            fits: vec![false; n],
        };
        // Backwards, both subtrees of a node come just before it, the left one last.
        let mut sets: Vec<VertexSet> = Vec::new();
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            let set = if node.is_leaf() {
                let item = tree.order[node.first as usize] as usize;
                triangles.get(item).map_or(VertexSet::NONE, |&t| VertexSet::of(t))
            } else {
                match (sets.pop(), sets.pop()) {
                    (Some(left), Some(right)) if node.count as usize <= BLOCK => left.union(&right),
                    _ => VertexSet::NONE,
                }
            };
            this.fits[index] = set.len != VertexSet::MANY;
            sets.push(set);
            this.cost(index);
        }
        this
    }

    /// Half the surface area.
    fn area(&self, index: usize) -> f32 {
        let size = self.tree.nodes[index].bounds.size();
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    fn cost(&mut self, index: usize) {
        let node = &self.tree.nodes[index];
        let area = self.area(index);
        if node.is_leaf() {
            self.costs[index] = [area * BLOCK_COST; WIDTH - 1];
            return;
        }
        let (left, right) = (index + 1, node.right as usize);
        let (l, r) = (self.costs[left], self.costs[right]);
        let mut costs = [0.0f32; WIDTH - 1];
        let mut best = area * NODE_COST + split(&l, &r, WIDTH).0;
        if self.fits[index] {
            best = best.min(area * BLOCK_COST);
        }
        costs[0] = best;
        for slots in 2..WIDTH {
            best = best.min(split(&l, &r, slots).0);
            costs[slots - 1] = best;
        }
        self.costs[index] = costs;
    }

    /// Replays the choices from the root downwards.
    fn plan(&self) -> Plan {
        let mut plan = Plan {
            nodes: Vec::new(),
            blocks: Vec::new(),
            depth: 0,
        };
        // (binary node, where to hang it, depth)
        let mut stack = vec![(0usize, None::<(usize, usize)>, 1usize)];
        let mut children = Vec::with_capacity(WIDTH);
        while let Some((index, place, depth)) = stack.pop() {
            let child = if place.is_some() && self.is_final(index) {
                let node = &self.tree.nodes[index];
                if self.fits[index] {
                    plan.blocks.push((node.first, node.count));
                    Child::Block(plan.blocks.len() - 1)
                } else {
                    Child::Item(self.tree.order[node.first as usize] as usize - self.triangles.len())
                }
            } else {
                plan.depth = plan.depth.max(depth);
                plan.nodes.push(WideNode::empty());
                let wide = plan.nodes.len() - 1;
                children.clear();
                self.children(index, &mut children);
                // The last pushed is taken first: children lie in memory in slot order.
                for (slot, &child) in children.iter().enumerate().rev() {
                    stack.push((child, Some((wide, slot)), depth + 1));
                }
                Child::Node(wide)
            };
            if let Some((wide, slot)) = place {
                plan.nodes[wide].set(slot, self.tree.nodes[index].bounds, child);
            }
        }
        plan
    }

    /// Whether a node that fills one slot is a block or a single item.
    fn is_final(&self, index: usize) -> bool {
        self.tree.nodes[index].is_leaf()
            || (self.fits[index] && self.costs[index][0] >= self.area(index) * BLOCK_COST)
    }

    /// The binary nodes that fill the slots of the wide node made from `index`.
    fn children(&self, index: usize, children: &mut Vec<usize>) {
        let node = &self.tree.nodes[index];
        if node.is_leaf() {
            children.push(index);
            return;
        }
        let mut stack = vec![(index, WIDTH, true)];
        while let Some((index, slots, open)) = stack.pop() {
            let node = &self.tree.nodes[index];
            // A subtree with no better use for its slots takes one.
            let mut slots = slots;
            if !open {
                while slots > 1 && self.costs[index][slots - 2] <= self.costs[index][slots - 1] {
                    slots -= 1;
                }
            }
            if slots == 1 || node.is_leaf() {
                children.push(index);
                continue;
            }
            let (left, right) = (index + 1, node.right as usize);
            let (_, given) = split(&self.costs[left], &self.costs[right], slots);
            stack.push((right, slots - given, false));
            stack.push((left, given, false));
        }
    }
}

/// The cheapest way to share `slots` between two subtrees, and how many the first gets.
fn split(l: &[f32; WIDTH - 1], r: &[f32; WIDTH - 1], slots: usize) -> (f32, usize) {
    let mut best = (f32::INFINITY, 1);
    for given in 1..slots {
        let cost = l[given - 1] + r[slots - given - 1];
        if cost < best.0 {
            best = (cost, given);
        }
    }
    best
}
