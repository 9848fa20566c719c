//! Traversals of one geometry by rays.

use glam::DVec3;

use crate::block::TriangleId;
use crate::build::{ChildRef, STACK, WIDTH, WideNode};
use crate::exact::{ray_meets_triangle, segment_cuts_triangle};
use crate::lanes::Simd;
use crate::part::Geometry;
use crate::ray::RayFilter;
use crate::shape::ShapeHit;

/// References that wait to be visited. It cannot overflow: trees are built so that [`STACK`] entries are enough.
pub(crate) struct Stack {
    entries: [ChildRef; STACK],
    len: usize,
}

impl Stack {
    #[inline(always)]
    pub(crate) fn new(root: ChildRef) -> Self {
        let mut entries = [ChildRef::default(); STACK];
        entries[0] = root;
        Self { entries, len: 1 }
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<ChildRef> {
        self.len = self.len.checked_sub(1)?;
        Some(self.entries[self.len])
    }

    #[inline(always)]
    pub(crate) fn push_each<S: Simd>(&mut self, s: S, node: &WideNode, mask: u32) {
        let to = &mut self.entries[self.len..self.len + WIDTH];
        if let Ok(to) = <&mut [ChildRef; WIDTH]>::try_from(to) {
            s.compress(&node.children, mask, to);
            self.len += mask.count_ones() as usize;
        }
    }
}

/// Does anything cut the open segment `p`-`q`?
#[inline(always)]
pub(crate) fn segment_is_cut<S: Simd>(s: S, geometry: &Geometry, p: DVec3, q: DVec3) -> bool {
    let Some((ray, length)) = RayFilter::new(p, q - p, geometry.reach) else {
        return false;
    };
    let t_max = length as f32;
    // Rounded up, for the boxes.
    let t_box = t_max * (1.0 + 2.0 * f32::EPSILON);
    let mut stack = Stack::new(ChildRef::default());
    while let Some(at) = stack.pop() {
        if at.is_node() {
            let node = &geometry.tree.nodes[at.index()];
            let (mask, _) = ray.enters(s, node, t_box);
            stack.push_each(s, node, mask);
        } else if at.is_block() {
            let block = &geometry.blocks[at.index()];
            let hits = ray.meets(s, block, t_max);
            if hits.sure != 0 {
                return true;
            }
            let mut doubtful = hits.doubtful;
            while doubtful != 0 {
                let lane = doubtful.trailing_zeros() as usize;
                doubtful &= doubtful - 1;
                if segment_cuts_triangle(p, q, block.triangle(lane)) {
                    return true;
                }
            }
        } else if geometry.shapes[at.index()].cuts_segment(p, q) {
            return true;
        }
    }
    false
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
    let (ray, scale) = RayFilter::new(origin, direction, geometry.reach)?;
    let mut best: Option<Closest> = None;
    let mut t_best = t_max;
    // The same in the filter's parameter, rounded up for the boxes.
    let mut t_box = (t_best * scale) as f32 * (1.0 + 2.0 * f32::EPSILON);
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
            let enter = s.store(enter);
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
                let id = geometry.ids[index * WIDTH + lane];
                if hit.t > 0.0 && (hit.t < t_best || (hit.t == t_best && comes_first(geometry, best, id))) {
                    t_best = hit.t;
                    t_box = (t_best * scale) as f32 * (1.0 + 2.0 * f32::EPSILON);
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
                    t_box = (t_best * scale) as f32 * (1.0 + 2.0 * f32::EPSILON);
                    best = Some(Closest::Shape { index, hit });
                }
            }
        }
    }
    best
}

/// Whether the surface `id` wins against an equally near one.
fn comes_first(geometry: &Geometry, best: Option<Closest>, id: TriangleId) -> bool {
    match best {
        None => true,
        Some(Closest::Triangle { id: other, .. }) => id < other,
        Some(Closest::Shape { index, .. }) => id.object < geometry.shapes[index].object.0,
    }
}
