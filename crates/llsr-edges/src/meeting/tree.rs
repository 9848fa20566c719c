//! Boxes of triangles in a tree that is asked which of them overlap.

use llsr_scene::Bounds;

use crate::meeting::halves;

/// Boxes in a leaf at most.
const LEAF: u32 = 4;
/// Part of a node that has boxes of more than one.
const MIXED: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// The part that all its boxes belong to, or [`MIXED`].
    part: u32,
    /// Positions of its boxes in the order.
    start: u32,
    end: u32,
    /// Its second child; the first is the next node. 0 in leaves.
    second: u32,
}

/// A tree of boxes that belong to parts.
#[derive(Debug)]
pub(super) struct BoxTree<'a> {
    boxes: &'a [Bounds],
    parts: &'a [u32],
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl<'a> BoxTree<'a> {
    /// `parts` has the part of each box.
    pub(super) fn new(boxes: &'a [Bounds], parts: &'a [u32]) -> Self {
        let mut tree = Self {
            boxes,
            parts,
            nodes: Vec::new(),
            order: (0..boxes.len() as u32).collect(),
        };
        if !boxes.is_empty() {
            // Halved by number, so it is never deeper than 32.
            tree.build(0..boxes.len() as u32);
        }
        tree
    }

    fn build(&mut self, range: std::ops::Range<u32>) -> (Bounds, u32) {
        let at = self.nodes.len();
        self.nodes.push(Node {
            bounds: Bounds::EMPTY,
            part: MIXED,
            start: range.start,
            end: range.end,
            second: 0,
        });
        let joined = |a: u32, b: u32| if a == b { a } else { MIXED };
        let (bounds, part);
        if range.end - range.start <= LEAF {
            let mut of = self.order[range.start as usize..range.end as usize]
                .iter()
                .map(|&i| (self.boxes[i as usize], self.parts[i as usize]));
            let first = of.next().unwrap_or((Bounds::EMPTY, MIXED));
            (bounds, part) = of.fold(first, |all, next| (all.0.union(next.0), joined(all.1, next.1)));
        } else {
            let [left, right] = halves(range.clone());
            self.split(range, left.end);
            let first = self.build(left);
            self.nodes[at].second = self.nodes.len() as u32;
            let second = self.build(right);
            (bounds, part) = (first.0.union(second.0), joined(first.1, second.1));
        }
        (self.nodes[at].bounds, self.nodes[at].part) = (bounds, part);
        (bounds, part)
    }

    /// Sorts the boxes of a range into those before and after its middle, along the longest side of their centres' box.
    fn split(&mut self, range: std::ops::Range<u32>, middle: u32) {
        let order = &mut self.order[range.start as usize..range.end as usize];
        let center = |i: u32| self.boxes[i as usize].center();
        let size = Bounds::of(order.iter().map(|&i| center(i))).size();
        let axis = size.max_position();
        let key = |i: u32| (center(i)[axis], i);
        order.select_nth_unstable_by((middle - range.start) as usize, |&a, &b| {
            let ((a, i), (b, j)) = (key(a), key(b));
            a.total_cmp(&b).then(i.cmp(&j))
        });
    }

    /// Calls `met` for each pair of boxes of different parts that overlap or touch, once. False if there were more than `most`
    /// pairs of boxes or nodes to look at.
    pub(super) fn pairs(&self, most: u64, mut met: impl FnMut(u32, u32)) -> bool {
        let mut stack = vec![(0u32, 0u32)];
        if self.nodes.is_empty() {
            return true;
        }
        let mut looked = 0;
        while let Some((a, b)) = stack.pop() {
            let (one, other) = (&self.nodes[a as usize], &self.nodes[b as usize]);
            looked += 1;
            if looked > most {
                return false;
            }
            let same_part = one.part == other.part && one.part != MIXED;
            if same_part || (a != b && !overlap(&one.bounds, &other.bounds)) {
                continue;
            }
            match (one.second, other.second) {
                (0, 0) => {
                    for i in one.start..one.end {
                        let from = if a == b { i + 1 } else { other.start };
                        for j in from..other.end {
                            let [i, j] = [i, j].map(|i| self.order[i as usize]);
                            let apart = self.parts[i as usize] != self.parts[j as usize];
                            if apart && overlap(&self.boxes[i as usize], &self.boxes[j as usize]) {
                                looked += 1;
                                met(i.min(j), i.max(j));
                            }
                        }
                    }
                }
                (second, _) if a == b => stack.extend([(a + 1, a + 1), (second, second), (a + 1, second)]),
                (0, second) => stack.extend([(a, b + 1), (a, second)]),
                (second, 0) => stack.extend([(a + 1, b), (second, b)]),
                (of_a, of_b) => {
                    // The larger one is opened.
                    if one.end - one.start > other.end - other.start {
                        stack.extend([(a + 1, b), (of_a, b)]);
                    } else {
                        stack.extend([(a, b + 1), (a, of_b)]);
                    }
                }
            }
        }
        true
    }
}

fn overlap(a: &Bounds, b: &Bounds) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}
