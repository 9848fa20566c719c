//! Shafts: what can lie between a group of points and a light, found once for all of them.
//!
//! Neighbouring points of a surface see a light through almost the same part of the scene. The convex hull of the
//! points' box and the light holds all segments between them; what misses it hides nothing from any of the points, so
//! that each point's [fan](crate::FanQuery) needs to be asked only about what is left. Often nothing is, or one
//! surface hides the whole light from all points: then no fan is needed at all.

mod cover;
mod filter;
mod frame;

use glam::DVec3;

use crate::Tracer;
use crate::build::ChildRef;
use crate::lanes::{Kernel, Simd};
use crate::part::Geometry;
use crate::unchecked::Stack;

use frame::ShaftFrame;

pub(crate) use filter::{ShaftFilter, around};

/// The most nodes and leaves that a shaft visits; beyond, the points had better ask on their own.
const VISITS: u32 = 128;

/// The most blocks of triangles and shapes that are kept, and that are looked at more closely first.
const LEAVES: usize = 12;
const LOOKED_AT: usize = 24;

/// What a group of points sees of a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sight {
    /// Nothing is in the way: every point sees all of it.
    Clear,
    /// No point sees any of it.
    Blocked,
    /// What can be in the way is a few things, which the shaft has kept.
    Among,
    /// Too much is in the way, or it was not looked for.
    #[default]
    Unknown,
}

/// A block and the triangles of it, or a shape, that may be in the way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShaftLeaf {
    pub(crate) at: ChildRef,
    pub(crate) lanes: u32,
}

/// What can lie between a group of points and a light. Kept and refilled by [`Tracer::shaft`], so that it allocates only
/// at first.
#[derive(Clone, Debug, Default)]
pub struct Shaft {
    sight: Sight,
    pub(crate) leaves: Vec<ShaftLeaf>,
    /// Triangles among the leaves.
    pub(crate) triangles: u32,
}

impl Shaft {
    /// What is known about all points of the group.
    pub fn sight(&self) -> Sight {
        self.sight
    }

    /// Forgets everything and keeps the memory.
    pub fn clear(&mut self) {
        self.sight = Sight::Unknown;
        self.leaves.clear();
        self.triangles = 0;
    }
}

impl Tracer {
    /// Finds out what can lie between `points` and the convex hull of `light` (m, recentred frame).
    ///
    /// Start from [`Hit::leave`](crate::Hit::leave), as for single points. The answer holds for each segment from one of the points to
    /// one of the hull's: it is proved by separating planes (in the way is nothing) or by one triangle, two triangles
    /// with a common edge, or one convex primitive that all segments cross (everything is hidden), with exact
    /// predicates. Where there is no point, a number is not finite or the scene has instances, nothing is known.
    ///
    /// Cost: about that of one fan query, and of one plane's equation a point where the points' own surface is in the way.
    pub fn shaft(&self, points: &[DVec3], light: &[DVec3], shaft: &mut Shaft) {
        shaft.clear();
        let Some(geometry) = self.only_geometry() else {
            return;
        };
        let (from, to) = (around(points.iter().copied()), around(light.iter().copied()));
        let Some(filter) = ShaftFilter::new(&from, &to, geometry.reach) else {
            return;
        };
        let found = self.level().run(Gather {
            geometry,
            filter: &filter,
            points,
            light,
            shaft,
        });
        if !found {
            shaft.leaves.clear();
            return;
        }
        if !shaft.leaves.is_empty() {
            let frame = ShaftFrame::new(points, light, geometry.reach);
            shaft.leaves.retain_mut(|leaf| {
                if !leaf.at.is_block() {
                    return frame.meets_box(&geometry.shapes[leaf.at.index()].bounds());
                }
                let block = &geometry.blocks[leaf.at.index()];
                let mut lanes = leaf.lanes;
                while lanes != 0 {
                    let lane = lanes.trailing_zeros();
                    lanes &= lanes - 1;
                    if !frame.meets(&block.triangle(lane as usize).map(|v| v.as_dvec3())) {
                        leaf.lanes &= !(1 << lane);
                    }
                }
                leaf.lanes != 0
            });
            if shaft.leaves.len() > LEAVES {
                shaft.leaves.clear();
                return;
            }
        }
        shaft.triangles = shaft.leaves.iter().map(|leaf| leaf.lanes.count_ones()).sum();
        shaft.sight = if shaft.leaves.is_empty() {
            Sight::Clear
        } else if cover::hidden(geometry, &shaft.leaves, points, light) {
            Sight::Blocked
        } else {
            Sight::Among
        };
    }

    /// Keeps every leaf of the scene, as if no box were known; to measure what boxes save. False if the scene has
    /// instances.
    pub fn everything(&self, shaft: &mut Shaft) -> bool {
        shaft.clear();
        let Some(geometry) = self.only_geometry() else {
            return false;
        };
        for (index, block) in geometry.blocks.iter().enumerate() {
            shaft.leaves.push(ShaftLeaf {
                at: ChildRef(ChildRef::BLOCK | index as u32),
                lanes: block.used,
            });
            shaft.triangles += block.used.count_ones();
        }
        for index in 0..geometry.shapes.len() {
            shaft.leaves.push(ShaftLeaf {
                at: ChildRef(ChildRef::ITEM | index as u32),
                lanes: 0,
            });
        }
        shaft.sight = Sight::Among;
        true
    }
}

/// Collects the leaves that may be in the way; false if they are too many.
struct Gather<'a> {
    geometry: &'a Geometry,
    filter: &'a ShaftFilter,
    points: &'a [DVec3],
    light: &'a [DVec3],
    shaft: &'a mut Shaft,
}

impl Kernel for Gather<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let Self {
            geometry,
            filter,
            points,
            light,
            shaft,
        } = self;
        let mut stack = Stack::new();
        let mut next = Some(ChildRef::default());
        let mut visits = 0;
        while let Some(at) = next {
            visits += 1;
            if visits > VISITS {
                return false;
            }
            if at.is_node() {
                let node = &geometry.tree.nodes[at.index()];
                let (mask, _) = filter.meets(s, node, 1.0);
                stack.push_each(s, node, mask);
            } else {
                let mut lanes = 0;
                let mut in_the_way = true;
                if at.is_block() {
                    let block = &geometry.blocks[at.index()];
                    lanes = cover::in_the_way(block, filter.meets_triangles(s, block), points, light);
                    in_the_way = lanes != 0;
                }
                if in_the_way {
                    if shaft.leaves.len() == LOOKED_AT {
                        return false;
                    }
                    shaft.leaves.push(ShaftLeaf { at, lanes });
                }
            }
            next = stack.pop();
        }
        true
    }
}
