//! Closest hits of rays with a common origin, in one traversal.

use glam::DVec3;

use crate::block::TriangleId;
use crate::build::{ChildRef, STACK};
use crate::exact::SeenTriangle;
use crate::hit::Hit;
use crate::lanes::{Floats, Kernel, Simd};
use crate::part::Geometry;
use crate::shaft::{ShaftFilter, around};
use crate::sheaf::{RAYS, Sheaf};
use crate::traverse::{Closest, comes_first};
use crate::{Tracer, block::BLOCK};

impl Tracer {
    /// The first surface on each of the rays `origin + t directions[i]` with 0 < t <= `t_max`, in `hits[i]`.
    ///
    /// The answers are those of [`closest`](Self::closest), bit for bit. Rays that run together (those of neighbouring
    /// pixels) go through the tree in packets of sixteen, which costs a fraction of single rays; for others it is
    /// no dearer.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn closest_each(&self, origin: DVec3, directions: &[DVec3], t_max: f64, hits: &mut [Option<Hit>]) {
        assert_eq!(directions.len(), hits.len(), "one answer per ray");
        for (directions, hits) in directions.chunks(RAYS).zip(hits.chunks_mut(RAYS)) {
            let mut found = [None; RAYS];
            let done = match self.only_geometry() {
                Some(geometry) if directions.len() > 2 => self.level().run(ClosestHits {
                    geometry,
                    origin,
                    directions,
                    t_max,
                    found: &mut found,
                }),
                _ => false,
            };
            if done {
                let mut face = None;
                for (hit, found) in hits.iter_mut().zip(&found) {
                    *hit = found.as_ref().map(|found| self.complete(found, &mut face));
                }
            } else {
                for (hit, &direction) in hits.iter_mut().zip(directions) {
                    *hit = self.closest(origin, direction, t_max);
                }
            }
        }
    }
}

/// The closest hits of up to sixteen rays; false if they do not run together.
struct ClosestHits<'a> {
    geometry: &'a Geometry,
    origin: DVec3,
    directions: &'a [DVec3],
    t_max: f64,
    found: &'a mut [Option<Closest>; RAYS],
}

impl Kernel for ClosestHits<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let Self {
            geometry,
            origin,
            directions,
            t_max,
            found,
        } = self;
        let bounds = &geometry.tree.bounds;
        if bounds.is_empty() {
            return true;
        }
        let Some(sheaf) = Sheaf::new(s, origin, directions, geometry.reach) else {
            return false;
        };
        // All rays end outside the geometry, or at `t_max`.
        let (near, far) = (bounds.min.as_dvec3() - origin, bounds.max.as_dvec3() - origin);
        let farthest = near.abs().max(far.abs()).length() * 1.001;
        let shortest = directions
            .iter()
            .map(|d| d.length_squared())
            .fold(f64::INFINITY, f64::min)
            .sqrt();
        let whole = (farthest / shortest).min(t_max);
        // A comparison with NaN is false.
        if !(whole > 0.0 && whole < 1e18) {
            return false;
        }
        let ends = around(directions.iter().map(|&d| origin + d * whole));
        let Some(filter) = ShaftFilter::new(&around([origin]), &ends, geometry.reach) else {
            return false;
        };
        let all = (1u32 << directions.len()) - 1;
        let mut t_best = [t_max; RAYS];
        let mut reach = [0f32; RAYS];
        for (lane, reach) in reach.iter_mut().enumerate() {
            *reach = sheaf.parameter(lane, whole);
        }
        // The fraction of the way at which the last of the best hits lies.
        let mut s_max = 1f32;
        // Where an entry is entered, what it is, and the rays that may meet it.
        let mut stack = [(0f32, ChildRef::default(), all); STACK];
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let (enter, at, rays) = stack[len];
            if enter > s_max {
                continue;
            }
            if at.is_node() {
                let node = &geometry.tree.nodes[at.index()];
                let (mut mask, enter) = filter.meets(s, node, s_max);
                let enter = enter.store();
                let t_max = S::W::load(s, &reach);
                let first = len;
                while mask != 0 {
                    let slot = (mask.trailing_zeros() & 7) as usize;
                    mask &= mask - 1;
                    let child = node.children[slot];
                    let rays = if child.is_node() {
                        all
                    } else {
                        all & sheaf.enters(s, node, slot, t_max)
                    };
                    if rays == 0 {
                        continue;
                    }
                    // Insertion keeps the nearest on top.
                    let entry = (enter[slot], child, rays);
                    let mut place = len;
                    while place > first && stack[place - 1].0 < entry.0 {
                        stack[place] = stack[place - 1];
                        place -= 1;
                    }
                    stack[place] = entry;
                    len += 1;
                }
                continue;
            }
            let mut changed = 0u32;
            if at.is_block() {
                let index = at.index();
                let block = &geometry.blocks[index];
                let moved = sheaf.moved(s, block);
                let mut lanes = if block.used.count_ones() > 2 {
                    filter.meets_triangles(s, block)
                } else {
                    block.used
                };
                while lanes != 0 {
                    let lane = (lanes.trailing_zeros() & 15) as usize;
                    lanes &= lanes - 1;
                    let hits = sheaf.meets(s, block, &moved, lane, S::W::load(s, &reach));
                    let mut met = (hits.sure | hits.doubtful) & rays;
                    if met == 0 {
                        continue;
                    }
                    let triangle = SeenTriangle::new(origin, block.triangle(lane));
                    while met != 0 {
                        let ray = (met.trailing_zeros() & 15) as usize;
                        met &= met - 1;
                        let Some(hit) = triangle.meets(directions[ray]) else {
                            continue;
                        };
                        let id = geometry.ids[index * BLOCK + lane];
                        let best = &mut found[ray];
                        if hit.t > 0.0
                            && (hit.t < t_best[ray]
                                || (hit.t == t_best[ray] && comes_first(geometry, *best, id)))
                        {
                            t_best[ray] = hit.t;
                            reach[ray] = sheaf.parameter(ray, hit.t);
                            changed |= 1 << ray;
                            *best = Some(Closest::Triangle {
                                t: hit.t,
                                id,
                                block: index,
                                lane,
                                barycentrics: hit.barycentrics,
                            });
                        }
                    }
                }
            } else {
                let index = at.index();
                let shape = &geometry.shapes[index];
                let mut rays = rays;
                while rays != 0 {
                    let ray = (rays.trailing_zeros() & 15) as usize;
                    rays &= rays - 1;
                    let Some(hit) = shape.closest(origin, directions[ray], t_best[ray]) else {
                        continue;
                    };
                    let id = TriangleId {
                        object: shape.object.0,
                        triangle: 0,
                    };
                    let best = &mut found[ray];
                    if hit.t < t_best[ray] || comes_first(geometry, *best, id) {
                        t_best[ray] = hit.t;
                        reach[ray] = sheaf.parameter(ray, hit.t);
                        changed |= 1 << ray;
                        *best = Some(Closest::Shape { index, hit });
                    }
                }
            }
            if changed != 0 {
                let last = t_best[..directions.len()]
                    .iter()
                    .fold(0.0, |x, &t| f64::max(x, t));
                s_max = ((last / whole) as f32 * (1.0 + 8.0 * f32::EPSILON)).min(1.0);
            }
        }
        true
    }
}
