//! The lower ends of binary trees, rearranged so that blocks are full.
//!
//! Clustering gives subtrees of any size, and the largest that fit a block fill about half of it. Here the topology of each
//! subtree of up to [`MOST`] triangles is made anew from above: a sweep over the three axes takes the split with the least
//! surface area times the number of blocks on either side, which falls where blocks are full. Fuller blocks
//! make fewer of them, fewer nodes and less memory.

use llsr_scene::Bounds;

use super::binary::{BinaryNode, BinaryTree};
use crate::block::BLOCK;

/// The most triangles of a subtree that is made anew.
const MOST: usize = 128;
/// How many triangles of a connected patch a block holds, whose vertices are limited too.
const PATCH: usize = 13;

/// Rearranges every largest subtree of at most [`MOST`] items that are all triangles.
///
/// Cost: about 0.2 microseconds a triangle.
pub(super) fn fill_blocks(tree: &mut BinaryTree, boxes: &[Bounds], triangles: &[[u32; 3]]) {
    let mut repack = Repack {
        boxes,
        triangles,
        sorted: [const { Vec::new() }; 3],
        areas: Vec::new(),
        vertices: Vec::new(),
        stack: Vec::new(),
    };
    let mut index = 0;
    while index < tree.nodes.len() {
        let node = tree.nodes[index];
        let (first, count) = (node.first as usize, node.count as usize);
        let items = &tree.order[first..first + count];
        if (2..=MOST).contains(&count) && items.iter().all(|&i| (i as usize) < triangles.len()) {
            repack.subtree(tree, index);
            index += 2 * count - 1;
        } else {
            index += 1;
        }
    }
}

struct Repack<'a> {
    boxes: &'a [Bounds],
    triangles: &'a [[u32; 3]],
    /// Items by the middle of their boxes along each axis.
    sorted: [Vec<(f32, u32)>; 3],
    /// Half the area of the box around all items from one on.
    areas: Vec<f32>,
    vertices: Vec<u32>,
    /// Node, its first item and how many.
    stack: Vec<(usize, usize, usize)>,
}

impl Repack<'_> {
    /// Rearranges the nodes and items below `root`, which take the same places as before.
    fn subtree(&mut self, tree: &mut BinaryTree, root: usize) {
        let node = tree.nodes[root];
        self.stack.push((root, node.first as usize, node.count as usize));
        while let Some((index, first, count)) = self.stack.pop() {
            let items = &mut tree.order[first..first + count];
            let bounds = around(self.boxes, items);
            let left = if count > 1 { self.split(items) } else { 0 };
            let right = if count > 1 { index + 2 * left } else { 0 };
            tree.nodes[index] = BinaryNode {
                bounds,
                first: first as u32,
                count: count as u32,
                right: right as u32,
            };
            if count > 1 {
                self.stack.push((right, first + left, count - left));
                self.stack.push((index + 1, first, left));
            }
        }
    }

    /// Orders the items so that the first few, which are counted, make the left side.
    fn split(&mut self, items: &mut [u32]) -> usize {
        let centers = Bounds::of(items.iter().map(|&i| self.boxes[i as usize].center()));
        let size = centers.size();
        let longest = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
        // What fits one block is hardly ever split.
        let (axes, capacity) = match self.capacity(items) {
            Some(capacity) => (0..3, capacity),
            None => (longest..longest + 1, 1),
        };
        let mut best = (f32::INFINITY, longest, items.len() / 2);
        for axis in axes {
            self.sort(items, axis);
            let (cost, left) = self.sweep(axis, capacity);
            if cost < best.0 {
                best = (cost, axis, left);
            }
        }
        let (_, axis, left) = best;
        for (item, &(_, sorted)) in items.iter_mut().zip(&self.sorted[axis]) {
            *item = sorted;
        }
        left
    }

    /// How many triangles of this kind a block holds; `None` if one block holds all.
    fn capacity(&mut self, items: &[u32]) -> Option<usize> {
        self.vertices.clear();
        self.vertices
            .extend(items.iter().flat_map(|&i| self.triangles[i as usize]));
        self.vertices.sort_unstable();
        self.vertices.dedup();
        let vertices = self.vertices.len();
        if items.len() <= BLOCK && vertices <= BLOCK {
            return None;
        }
        // Triangles without common vertices take three each; a large patch has half as many vertices as triangles.
        let loose = BLOCK * items.len() / vertices;
        Some(loose.clamp(BLOCK / 3, PATCH))
    }

    fn sort(&mut self, items: &[u32], axis: usize) {
        let sorted = &mut self.sorted[axis];
        sorted.clear();
        sorted.extend(items.iter().map(|&i| (self.boxes[i as usize].center()[axis], i)));
        sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// The least cost of a split of the sorted items, and how many are on its left.
    fn sweep(&mut self, axis: usize, capacity: usize) -> (f32, usize) {
        let sorted = &self.sorted[axis];
        let n = sorted.len();
        self.areas.clear();
        self.areas.resize(n, 0.0);
        let mut right = Bounds::EMPTY;
        for i in (1..n).rev() {
            right = right.union(self.boxes[sorted[i].1 as usize]);
            self.areas[i] = half_area(&right);
        }
        let mut best = (f32::INFINITY, n / 2);
        let mut left = Bounds::EMPTY;
        for i in 1..n {
            left = left.union(self.boxes[sorted[i - 1].1 as usize]);
            let blocks = |count: usize| count.div_ceil(capacity) as f32;
            let cost = half_area(&left) * blocks(i) + self.areas[i] * blocks(n - i);
            if cost < best.0 {
                best = (cost, i);
            }
        }
        best
    }
}

fn around(boxes: &[Bounds], items: &[u32]) -> Bounds {
    items
        .iter()
        .fold(Bounds::EMPTY, |all, &i| all.union(boxes[i as usize]))
}

fn half_area(bounds: &Bounds) -> f32 {
    let size = bounds.size();
    size.x * size.y + size.y * size.z + size.z * size.x
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// The boxes and triangles of a flat grid of `n` by `n` squares.
    fn grid(n: u32) -> (Vec<Bounds>, Vec<[u32; 3]>) {
        let at = |v: u32| Vec3::new((v % (n + 1)) as f32, 0.0, (v / (n + 1)) as f32);
        let mut triangles = Vec::new();
        for i in 0..n * n {
            let corner = i / n * (n + 1) + i % n;
            triangles.push([corner, corner + 1, corner + n + 2]);
            triangles.push([corner, corner + n + 2, corner + n + 1]);
        }
        let boxes = triangles.iter().map(|t| Bounds::of(t.map(at))).collect();
        (boxes, triangles)
    }

    /// Every item once, counts and bounds right.
    fn check(tree: &BinaryTree, boxes: &[Bounds]) {
        let mut order = tree.order.clone();
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..boxes.len() as u32), "every item once");
        for (index, node) in tree.nodes.iter().enumerate() {
            let items = &tree.order[node.first as usize..][..node.count as usize];
            assert_eq!(node.bounds, around(boxes, items), "bounds of node {index}");
            if node.is_leaf() {
                assert_eq!(node.count, 1, "a leaf has one item");
                continue;
            }
            let (left, right) = (&tree.nodes[index + 1], &tree.nodes[node.right as usize]);
            assert_eq!(left.count + right.count, node.count, "counts of node {index}");
            assert_eq!(
                (left.first, right.first),
                (node.first, node.first + left.count),
                "items of node {index}"
            );
        }
    }

    #[test]
    fn subtrees_stay_whole_and_blocks_get_full() {
        let (boxes, triangles) = grid(40);
        let mut tree = BinaryTree::clustered(&boxes);
        fill_blocks(&mut tree, &boxes, &triangles);
        check(&tree, &boxes);
        // The largest subtrees that fit a block.
        let fits = |node: &BinaryNode| {
            let items = &tree.order[node.first as usize..][..node.count as usize];
            let mut vertices: Vec<u32> = items.iter().flat_map(|&i| triangles[i as usize]).collect();
            vertices.sort_unstable();
            vertices.dedup();
            items.len() <= BLOCK && vertices.len() <= BLOCK
        };
        let (mut blocks, mut index) = (0, 0);
        while index < tree.nodes.len() {
            let node = &tree.nodes[index];
            if fits(node) {
                blocks += 1;
                index += 2 * node.count as usize - 1;
            } else {
                index += 1;
            }
        }
        let filled = triangles.len() as f32 / blocks as f32;
        assert!(filled > 9.0, "{filled} triangles a block");
    }

    #[test]
    fn coincident_boxes_and_other_items_are_kept() {
        let (mut boxes, triangles) = grid(3);
        let same = boxes[0];
        boxes.fill(same);
        // Two items that are no triangles.
        boxes.extend([same; 2]);
        let mut tree = BinaryTree::clustered(&boxes);
        fill_blocks(&mut tree, &boxes, &triangles);
        check(&tree, &boxes);
    }
}
