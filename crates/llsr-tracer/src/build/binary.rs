//! Binary trees over boxes; the only module that knows obvhs.
//!
//! obvhs clusters boxes bottom-up and then improves the tree by reinsertion. Left alone it meets inputs that take
//! quadratic time: where many unions cost the same, clusters merge one pair a round, and where many boxes
//! overlap, reinsertion looks at every node for every candidate. So it never sees the boxes themselves, only
//! copies scaled to the unit cube, each face moved outwards by its own pseudo-random hair (which breaks all
//! ties, keeps flat boxes from having no area, and keeps large coordinates from overflowing), and reinsertion
//! is rationed by how much the boxes overlap. The result is only a topology: every bound is computed anew
//! from the true boxes.

use glam::{Vec3, Vec3A};
use llsr_scene::Bounds;
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// A node of a [`BinaryTree`]; the left child of node `i` is `i + 1`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BinaryNode {
    pub(crate) bounds: Bounds,
    /// First entry of [`BinaryTree::order`] below this node.
    pub(crate) first: u32,
    /// Number of items below this node; a leaf has one.
    pub(crate) count: u32,
    /// Right child; zero for a leaf.
    pub(crate) right: u32,
}

impl BinaryNode {
    pub(crate) fn is_leaf(&self) -> bool {
        self.right == 0
    }
}

/// A binary tree with one item a leaf, nodes in depth-first order.
#[derive(Clone, Debug, Default)]
pub(crate) struct BinaryTree {
    pub(crate) nodes: Vec<BinaryNode>,
    /// Items in depth-first order: below every node they are contiguous.
    pub(crate) order: Vec<u32>,
}

struct Perturbed(Aabb);

impl Boundable for Perturbed {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// Share of the nodes that reinsertion tries to place better.
const REINSERTION_SHARE: f32 = 0.05;
/// Reinsertion's budget in visited nodes, beyond what a clean scene needs.
const REINSERTION_BUDGET: f64 = 3e7;

impl BinaryTree {
    /// Builds a tree over finite, non-empty boxes. Cost: about a microsecond a box.
    pub(crate) fn clustered(boxes: &[Bounds]) -> Self {
        if boxes.len() < 2 {
            return Self::from_topology(boxes, |_| None);
        }
        let whole = boxes.iter().fold(Bounds::EMPTY, |b, &c| b.union(c));
        let center = whole.center();
        let scale = 1.0 / (0.5 * whole.size().max_element()).max(f32::MIN_POSITIVE);
        let scale = if scale.is_finite() { scale } else { 1.0 };
        let perturbed: Vec<Perturbed> = boxes
            .iter()
            .enumerate()
            .map(|(index, b)| perturbed(b, index, center, scale))
            .collect();
        let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &perturbed,
            (0..boxes.len() as u32).collect(),
            SortPrecision::U64,
            3,
        );
        let share = reinsertion_share(&perturbed);
        if share > 0.0 {
            ReinsertionOptimizer::default().run(&mut bvh, share, None);
        }
        Self::from_bvh2(boxes, &bvh)
    }

    /// Builds a balanced tree by splitting at the median; its depth is at most 32.
    pub(crate) fn balanced(boxes: &[Bounds]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity((2 * boxes.len()).saturating_sub(1));
        // (first, count, node whose right child this is)
        let mut stack = vec![(0usize, boxes.len(), None::<usize>)];
        while let Some((first, count, parent)) = stack.pop() {
            if count == 0 {
                break;
            }
            let index = nodes.len();
            if let Some(parent) = parent {
                let parent: &mut BinaryNode = &mut nodes[parent];
                parent.right = index as u32;
            }
            nodes.push(BinaryNode {
                bounds: Bounds::EMPTY,
                first: first as u32,
                count: count as u32,
                right: 0,
            });
            if count == 1 {
                continue;
            }
            let items = &mut order[first..first + count];
            let centers = Bounds::of(items.iter().map(|&i| boxes[i as usize].center()));
            let size = centers.size();
            let axis = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
            let half = count / 2;
            items.select_nth_unstable_by(half, |&i, &j| {
                let key = |k: u32| boxes[k as usize].center()[axis];
                key(i).total_cmp(&key(j)).then(i.cmp(&j))
            });
            stack.push((first + half, count - half, Some(index)));
            stack.push((first, half, None));
        }
        let mut tree = Self { nodes, order };
        tree.refit(boxes);
        tree
    }

    fn from_bvh2(boxes: &[Bounds], bvh: &Bvh2) -> Self {
        Self::from_topology(boxes, |node| {
            let node = &bvh.nodes[node as usize];
            if node.is_leaf() {
                Some(Err(bvh.primitive_indices[node.first_index as usize]))
            } else {
                Some(Ok(node.first_index))
            }
        })
    }

    /// `children(node)` is the first of two adjacent children, or the item of a leaf; `None` stands for a tree of
    /// at most one item.
    fn from_topology(boxes: &[Bounds], children: impl Fn(u32) -> Option<Result<u32, u32>>) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity((2 * boxes.len()).saturating_sub(1)),
            order: Vec::with_capacity(boxes.len()),
        };
        let mut stack = Vec::new();
        if !boxes.is_empty() {
            stack.push((0u32, None::<usize>));
        }
        while let Some((source, parent)) = stack.pop() {
            let index = tree.nodes.len();
            if let Some(parent) = parent {
                tree.nodes[parent].right = index as u32;
            }
            let first = tree.order.len() as u32;
            tree.nodes.push(BinaryNode {
                bounds: Bounds::EMPTY,
                first,
                count: 1,
                right: 0,
            });
            match children(source) {
                Some(Ok(left)) => {
                    stack.push((left + 1, Some(index)));
                    stack.push((left, None));
                }
                Some(Err(item)) => tree.order.push(item),
                None => tree.order.push(0),
            }
        }
        tree.refit(boxes);
        tree
    }

    /// Computes bounds, counts and first items from the leaves upwards.
    fn refit(&mut self, boxes: &[Bounds]) {
        for index in (0..self.nodes.len()).rev() {
            let node = self.nodes[index];
            let (bounds, count) = if node.is_leaf() {
                (boxes[self.order[node.first as usize] as usize], 1)
            } else {
                let (left, right) = (self.nodes[index + 1], self.nodes[node.right as usize]);
                (left.bounds.union(right.bounds), left.count + right.count)
            };
            self.nodes[index].bounds = bounds;
            self.nodes[index].count = count;
        }
    }
}

/// A box scaled to the unit cube with each face moved outwards by up to 2^-18 of the cube and 2^-12 of the box.
fn perturbed(b: &Bounds, index: usize, center: Vec3, scale: f32) -> Perturbed {
    let min = (b.min - center) * scale;
    let max = (b.max - center) * scale;
    let step = 2f32.powi(-18) + 2f32.powi(-12) * (max - min).max_element();
    let hair = |salt: u64| {
        // One round of a 64-bit mixer; three 21-bit fractions.
        let mut x = (index as u64 ^ salt).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        x ^= x >> 32;
        let part = |shift: u32| ((x >> shift) & 0x1f_ffff) as f32 * (1.0 / 2_097_152.0);
        Vec3A::new(part(0), part(21), part(42)) * step
    };
    Perturbed(Aabb::new(
        Vec3A::from(min) - hair(0x5851_f42d_4c95_7f2d),
        Vec3A::from(max) + hair(0x1405_7b7e_f767_814f),
    ))
}

/// How large a share of the nodes reinsertion may take on: its search visits about as many nodes as boxes
/// overlap, which is the sum of their areas over the area of the whole.
fn reinsertion_share(boxes: &[Perturbed]) -> f32 {
    let area: f64 = boxes.iter().map(|b| f64::from(b.0.half_area())).sum();
    // The unit cube has half area 12.
    let overlap = (area / 12.0).max(1.0);
    let candidates = (REINSERTION_BUDGET / (overlap * 30.0)).min(1e12);
    let share = candidates / (2.0 * boxes.len() as f64);
    (share as f32).min(REINSERTION_SHARE)
}
