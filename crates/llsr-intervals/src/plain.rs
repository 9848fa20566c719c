//! The tree as Bala et al. (2003, section 6.4) describe it, for comparison.

use crate::{IntervalVec3, Viewpoint};
use glam::{DVec3, Vec3};

/// A binary tree over edges that bounds normals and positions by interval vectors.
///
/// Nodes are split on the axis of the normals that leaves the smallest children; with `sharp_high` an edge whose
/// normals span more than half of a node's range on some axis stays at that node. A
/// [`PlaneTree`](crate::PlaneTree) answers the same questions several times faster.
#[derive(Clone, Debug)]
pub struct PlainTree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Node {
    normals: IntervalVec3<f32>,
    positions: IntervalVec3<f32>,
    /// Items stored at this node.
    items: (u32, u32),
    /// The left child is the next node.
    right: Option<u32>,
}

/// What a query of a plain tree did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlainStatistics {
    /// Nodes visited.
    pub nodes: usize,
    /// Items tested.
    pub items: usize,
}

/// One item while the tree is built.
#[derive(Clone, Copy)]
struct Entry {
    normals: [Vec3; 2],
    positions: [Vec3; 2],
    item: u32,
}

impl Entry {
    fn middle(&self, axis: usize) -> f32 {
        self.normals[0][axis] + self.normals[1][axis]
    }
}

impl PlainTree {
    /// Builds the tree of items `0..count`; `normals` gives the unit normals of an item's two faces and
    /// `positions` two opposite corners of a box around the points that the views are taken from.
    ///
    /// Normals are rounded to single precision, which the nodes allow for.
    pub fn build(
        count: u32,
        normals: impl Fn(u32) -> [DVec3; 2],
        positions: impl Fn(u32) -> [Vec3; 2],
        leaf: usize,
        sharp_high: bool,
    ) -> Self {
        let mut entries: Vec<Entry> = (0..count)
            .map(|item| Entry {
                normals: normals(item).map(|n| n.as_vec3()),
                positions: positions(item),
                item,
            })
            .collect();
        let mut tree = Self {
            nodes: Vec::new(),
            items: Vec::with_capacity(entries.len()),
        };
        if !entries.is_empty() {
            tree.add(&mut entries, leaf.max(1), sharp_high);
        }
        tree
    }

    fn add(&mut self, entries: &mut [Entry], leaf: usize, sharp_high: bool) {
        let node = self.nodes.len();
        let normals = hull(entries.iter().flat_map(|e| e.normals));
        let start = self.items.len() as u32;
        self.nodes.push(Node {
            normals: IntervalVec3::new(padded(normals.x), padded(normals.y), padded(normals.z)),
            positions: hull(entries.iter().flat_map(|e| e.positions)),
            items: (start, start),
            right: None,
        });
        let mut below = entries;
        if below.len() > leaf && sharp_high {
            let range = Vec3::new(normals.x.width(), normals.y.width(), normals.z.width());
            let is_sharp = |e: &Entry| (e.normals[0] - e.normals[1]).abs().cmpgt(0.5 * range).any();
            let mut sharp = 0;
            for i in 0..below.len() {
                if is_sharp(&below[i]) {
                    below.swap(sharp, i);
                    sharp += 1;
                }
            }
            self.items.extend(below[..sharp].iter().map(|e| e.item));
            below = &mut below[sharp..];
        }
        if below.len() <= leaf {
            self.items.extend(below.iter().map(|e| e.item));
            self.nodes[node].items.1 = self.items.len() as u32;
            return;
        }
        self.nodes[node].items.1 = self.items.len() as u32;
        let middle = below.len() / 2;
        let size = |entries: &[Entry]| {
            let range = hull(entries.iter().flat_map(|e| e.normals));
            range.x.width() + range.y.width() + range.z.width()
        };
        let axis = (0..3)
            .map(|axis| {
                below.select_nth_unstable_by(middle, |a, b| a.middle(axis).total_cmp(&b.middle(axis)));
                (axis, size(&below[..middle]) + size(&below[middle..]))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(0, |best| best.0);
        below.select_nth_unstable_by(middle, |a, b| a.middle(axis).total_cmp(&b.middle(axis)));
        let (left, right) = below.split_at_mut(middle);
        self.add(left, leaf, sharp_high);
        self.nodes[node].right = Some(self.nodes.len() as u32);
        self.add(right, leaf, sharp_high);
    }

    /// Appends the items for which `test` holds among those whose node may hold a silhouette edge for `viewer`.
    ///
    /// A node is left out if the interval of N · V over its normals and positions does not hold 0.
    pub fn query(
        &self,
        viewer: &Viewpoint,
        mut test: impl FnMut(u32) -> bool,
        found: &mut Vec<u32>,
    ) -> PlainStatistics {
        let mut statistics = PlainStatistics::default();
        let eye = IntervalVec3::from(viewer.position()).narrow();
        let mut stack: Vec<u32> = if self.nodes.is_empty() {
            Vec::new()
        } else {
            vec![0]
        };
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            statistics.nodes += 1;
            let view = if viewer.is_at_infinity() {
                eye
            } else {
                eye - node.positions
            };
            if !node.normals.dot(&view).contains_zero() {
                continue;
            }
            let items = &self.items[node.items.0 as usize..node.items.1 as usize];
            statistics.items += items.len();
            found.extend(items.iter().copied().filter(|&item| test(item)));
            if let Some(right) = node.right {
                stack.extend([right, index + 1]);
            }
        }
        statistics
    }
}

fn hull(points: impl Iterator<Item = Vec3>) -> IntervalVec3<f32> {
    IntervalVec3::of(points.map(|p| p.to_array()))
}

/// Takes in normals that were rounded to single precision after an error of 2⁻³⁰.
fn padded(x: crate::Interval<f32>) -> crate::Interval<f32> {
    x + crate::Interval::of([-2.0 * f32::EPSILON, 2.0 * f32::EPSILON])
}
