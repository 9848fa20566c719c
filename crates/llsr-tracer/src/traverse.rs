//! Traversals of one geometry by rays.

use glam::DVec3;

use crate::block::{BLOCK, TriangleId};
use crate::build::{ChildRef, STACK};
use crate::exact::{ray_meets_triangle, segment_cuts_triangle};
use crate::lanes::{Floats, Simd};
use crate::part::Geometry;
use crate::ray::RayFilter;
use crate::shape::ShapeHit;
use crate::unchecked::Stack;

/// Lanes of blocks and single items that the filter could not decide.
struct Doubts {
    entries: [(ChildRef, u32); DOUBTS],
    len: usize,
}

/// Most rays have one doubt: the triangle that they start from.
const DOUBTS: usize = 8;

impl Doubts {
    #[inline(always)]
    fn new() -> Self {
        Self {
            entries: [(ChildRef::default(), 0); DOUBTS],
            len: 0,
        }
    }

    /// Decides all that waits, in double precision: does any of it cut the open segment `p`-`q`?
    #[inline(never)]
    fn settle(&mut self, geometry: &Geometry, p: DVec3, q: DVec3) -> bool {
        let entries = &self.entries[..self.len];
        self.len = 0;
        entries.iter().any(|&(at, mut lanes)| {
            if !at.is_block() {
                return geometry.shapes[at.index()].cuts_segment(p, q);
            }
            let block = &geometry.blocks[at.index()];
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                if segment_cuts_triangle(p, q, block.triangle(lane)) {
                    return true;
                }
            }
            false
        })
    }
}

/// Does anything cut the open segment `p`-`q`?
#[inline(always)]
pub(crate) fn segment_is_cut<S: Simd>(s: S, geometry: &Geometry, p: DVec3, q: DVec3) -> bool {
    let Some((ray, t_max)) = RayFilter::new(s, p, q - p, 1.0, geometry.reach) else {
        return false;
    };
    // Rounded up, for the boxes.
    let t_box = t_max * (1.0 + 4.0 * f32::EPSILON);
    let (nodes, blocks) = (&*geometry.tree.nodes, &*geometry.blocks);
    let mut stack = Stack::new();
    let mut doubts = Doubts::new();
    let mut at = ChildRef::default();
    loop {
        if at.is_node() {
            let node = &nodes[at.index()];
            let (mask, _) = ray.enters(s, node, t_box);
            if mask != 0 {
                // The first child is followed at once, the rest waits.
                at = node.children[mask.trailing_zeros() as usize & 7];
                stack.push_each(s, node, mask & (mask - 1));
                continue;
            }
        } else {
            // Decisions are put off until the filter has found nothing: that is rarely needed, and keeps calls out of
            // this loop.
            let mut doubtful = 1;
            if at.is_block() {
                let hits = ray.meets(s, &blocks[at.index()], t_max);
                if hits.sure != 0 {
                    return true;
                }
                doubtful = hits.doubtful;
            }
            if doubtful != 0 {
                if doubts.len == DOUBTS && doubts.settle(geometry, p, q) {
                    return true;
                }
                doubts.entries[doubts.len & (DOUBTS - 1)] = (at, doubtful);
                doubts.len += 1;
            }
        }
        match stack.pop() {
            Some(next) => at = next,
            None => return doubts.len != 0 && doubts.settle(geometry, p, q),
        }
    }
}

/// The closest hit of one geometry, in its own frame.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Closest {
    Triangle {
        t: f64,
        id: TriangleId,
        block: usize,
        lane: usize,
        barycentrics: [f64; 2],
    },
    Shape {
        index: usize,
        hit: ShapeHit,
    },
}

impl Closest {
    pub(crate) fn t(&self) -> f64 {
        match self {
            Self::Triangle { t, .. } => *t,
            Self::Shape { hit, .. } => hit.t,
        }
    }
}

/// The first hit with 0 < t <= `t_max`; of equal ones, that of the smallest object and triangle.
#[inline(always)]
pub(crate) fn closest<S: Simd>(
    s: S,
    geometry: &Geometry,
    origin: DVec3,
    direction: DVec3,
    t_max: f64,
) -> Option<Closest> {
    let (ray, scale) = RayFilter::new(s, origin, direction, t_max as f32, geometry.reach)?;
    let mut best: Option<Closest> = None;
    let mut t_best = t_max;
    // The same in the filter's parameter, rounded up for the boxes.
    let mut t_box = (t_best as f32) * scale * (1.0 + 4.0 * f32::EPSILON);
    let mut stack = [(0f32, ChildRef::default()); STACK];
    let mut len = 1;
    while len > 0 {
        len -= 1;
        let (enter, at) = stack[len];
        if enter > t_box {
            continue;
        }
        if at.is_node() {
            let node = &geometry.tree.nodes[at.index()];
            let (mut mask, enter) = ray.enters(s, node, t_box);
            let enter = enter.store();
            let first = len;
            while mask != 0 {
                let slot = (mask.trailing_zeros() & 7) as usize;
                mask &= mask - 1;
                // Insertion keeps the nearest on top; a ray enters about two children.
                let entry = (enter[slot], node.children[slot]);
                let mut place = len;
                while place > first && stack[place - 1].0 < entry.0 {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = entry;
                len += 1;
            }
        } else if at.is_block() {
            let index = at.index();
            let block = &geometry.blocks[index];
            let hits = ray.meets(s, block, t_box);
            let mut lanes = hits.sure | hits.doubtful;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let Some(hit) = ray_meets_triangle(origin, direction, block.triangle(lane)) else {
                    continue;
                };
                let id = geometry.ids[index * BLOCK + lane];
                if hit.t > 0.0 && (hit.t < t_best || (hit.t == t_best && comes_first(geometry, best, id))) {
                    t_best = hit.t;
                    t_box = (t_best as f32) * scale * (1.0 + 4.0 * f32::EPSILON);
                    best = Some(Closest::Triangle {
                        t: hit.t,
                        id,
                        block: index,
                        lane,
                        barycentrics: hit.barycentrics,
                    });
                }
            }
        } else {
            let index = at.index();
            let shape = &geometry.shapes[index];
            if let Some(hit) = shape.closest(origin, direction, t_best) {
                let id = TriangleId {
                    object: shape.object.0,
                    triangle: 0,
                };
                if hit.t < t_best || comes_first(geometry, best, id) {
                    t_best = hit.t;
                    t_box = (t_best as f32) * scale * (1.0 + 4.0 * f32::EPSILON);
                    best = Some(Closest::Shape { index, hit });
                }
            }
        }
    }
    best
}

/// Whether the surface `id` wins against an equally near one.
pub(crate) fn comes_first(geometry: &Geometry, best: Option<Closest>, id: TriangleId) -> bool {
    match best {
        None => true,
        Some(Closest::Triangle { id: other, .. }) => id < other,
        Some(Closest::Shape { index, .. }) => id.object < geometry.shapes[index].object.0,
    }
}
