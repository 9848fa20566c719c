//! Occlusion of several points of a segment from one point, in one traversal.
//!
//! Near its root and around the common origin the rays of a pencil meet the same nodes; there each of the eight boxes of a
//! node is tested against all rays, one a lane. Each child goes on with the rays that may meet it, and where few are
//! left, a node is one test of eight boxes a ray, as for single rays. In a block what does not depend on the ray
//! is computed once.

use glam::DVec3;

use crate::Tracer;
use crate::block::{BLOCK, TriangleBlock};
use crate::build::{ChildRef, WIDTH, WideNode};
use crate::exact::segment_cuts_triangle;
use crate::lanes::{Floats, Kernel, Simd};
use crate::part::Geometry;
use crate::ray::{AXES, BlockHits, Edges, U};
use crate::tracer::Part;
use crate::traverse::segment_is_cut;
use crate::unchecked::{Lane, PencilStack};

/// The most rays of a pencil.
pub(crate) const RAYS: usize = 8;

/// Fewer rays than this are asked one by one.
const FEWEST: usize = 3;

/// So many rays are tested against a node one after the other, eight boxes at a time; more at once, box by box.
const FEW: u32 = 4;

impl Tracer {
    /// Does any surface cut the open segments from `from` to the points of `a`-`b` at parameters `ts`?
    ///
    /// Writes the answer for `ts[i]` to `blocked[i]`; it is that of [`occluded`](Self::occluded) for `a + (b - a) * t`.
    /// Up to eight rays at a time go through the tree together, which takes about two thirds of the time of single rays.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn occluded_pencil(&self, from: DVec3, a: DVec3, b: DVec3, ts: &[f64], blocked: &mut [bool]) {
        assert_eq!(ts.len(), blocked.len(), "one answer per question");
        let along = b - a;
        for (ts, blocked) in ts.chunks(RAYS).zip(blocked.chunks_mut(RAYS)) {
            if ts.len() < FEWEST {
                for (answer, &t) in blocked.iter_mut().zip(ts) {
                    *answer = self.occluded(from, a + along * t);
                }
                continue;
            }
            let targets = Targets::new(a, along, ts);
            let cut = match self.only_geometry() {
                Some(geometry) => {
                    let rays = targets.all();
                    self.level().run(Pencil {
                        geometry,
                        from,
                        targets,
                        rays,
                    })
                }
                None => self.cut_in_parts(from, targets),
            };
            for (ray, blocked) in blocked.iter_mut().enumerate() {
                *blocked = cut >> ray & 1 == 1;
            }
        }
    }

    fn cut_in_parts(&self, from: DVec3, targets: Targets) -> u32 {
        let mut cut = 0;
        let on_parts = PencilOnParts {
            tracer: self,
            from,
            targets,
            visit: &mut |part, rays| {
                let (mut from, mut targets) = (from, targets);
                if let Some(placement) = &part.placement {
                    from = placement.localize(from);
                    for ray in 0..RAYS {
                        targets.set(ray, placement.localize(targets.get(ray)));
                    }
                }
                let geometry = &part.geometry;
                let found = self.level().run(Pencil {
                    geometry,
                    from,
                    targets,
                    rays,
                });
                cut |= found;
                found
            },
        };
        if !self.level().run(on_parts) {
            for ray in 0..targets.count {
                cut |= u32::from(self.occluded(from, targets.get(ray))) << ray;
            }
        }
        cut
    }
}

/// Where the rays of a pencil end, by axes.
#[derive(Clone, Copy)]
struct Targets {
    rows: [[f64; RAYS]; 3],
    count: usize,
}

impl Targets {
    /// At most eight points of a line, and at least one.
    #[inline(always)]
    fn new(a: DVec3, along: DVec3, ts: &[f64]) -> Self {
        let count = ts.len().clamp(1, RAYS);
        let mut each = [ts[0]; RAYS];
        each[..count].copy_from_slice(&ts[..count]);
        let (a, along) = (a.to_array(), along.to_array());
        let mut rows = [[0.0; RAYS]; 3];
        for (row, (a, along)) in rows.iter_mut().zip(a.into_iter().zip(along)) {
            for (x, t) in row.iter_mut().zip(each) {
                *x = a + along * t;
            }
        }
        Self { rows, count }
    }

    #[inline(always)]
    fn get(&self, ray: usize) -> DVec3 {
        let [x, y, z] = &self.rows;
        DVec3::new(x[ray & 7], y[ray & 7], z[ray & 7])
    }

    #[inline(always)]
    fn set(&mut self, ray: usize, target: DVec3) {
        for (row, x) in self.rows.iter_mut().zip(target.to_array()) {
            row[ray & 7] = x;
        }
    }

    #[inline(always)]
    fn all(&self) -> u32 {
        (1 << self.count) - 1
    }
}

/// Which of the segments `rays` from one point are cut.
struct Pencil<'a> {
    geometry: &'a Geometry,
    from: DVec3,
    targets: Targets,
    rays: u32,
}

impl Kernel for Pencil<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> u32 {
        let Self {
            geometry,
            from,
            targets,
            rays,
        } = self;
        let (mut cut, mut alone) = (0, rays);
        if let Some(prepared) = Rays::new(s, from, &targets, geometry.reach) {
            (cut, alone) = prepared.cut(s, geometry, from, &targets, rays);
        }
        while alone != 0 {
            let ray = alone.trailing_zeros();
            alone &= alone - 1;
            cut |= u32::from(segment_is_cut(s, geometry, from, targets.get(ray as usize))) << ray;
        }
        cut
    }
}

/// Visits the parts that rays of a pencil may meet, in no order, with those of the rays; `visit` says which are cut.
/// False if the rays must be asked alone.
struct PencilOnParts<'a> {
    tracer: &'a Tracer,
    from: DVec3,
    targets: Targets,
    visit: &'a mut dyn FnMut(&Part, u32) -> u32,
}

impl Kernel for PencilOnParts<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let top = &self.tracer.top;
        if top.bounds.is_empty() {
            return true;
        }
        let reach = top.bounds.min.abs().max(top.bounds.max.abs()).max_element();
        let Some(prepared) = Rays::new(s, self.from, &self.targets, reach) else {
            return false;
        };
        let mut free = self.targets.all();
        let mut walk = Walk::new(&top.nodes, free);
        while let Some((at, rays)) = walk.leaf(s, &prepared, free) {
            free &= !(self.visit)(&self.tracer.parts[at.index()], rays);
        }
        true
    }
}

/// One number a ray.
type Row = [f32; RAYS];

/// The rays of a pencil, prepared for the filters. As for single rays, each is scaled so that its direction's largest
/// component is 1.
struct Rays<S: Simd> {
    /// Reciprocal directions, and what to add to lower and upper planes times these: with the padding, which
    /// moves the planes apart.
    inverse: [S::F; 3],
    lower: [S::F; 3],
    upper: [S::F; 3],
    /// Parameters of the tips, rounded up.
    tips: S::F,
    /// The same by rays, and what triangles need besides.
    rows: Rows,
    origin: [f32; 3],
    /// The rays whose direction is largest on each axis.
    along: [u32; 3],
}

struct Rows {
    inverse: [Row; 3],
    lower: [Row; 3],
    upper: [Row; 3],
    tips: Row,
    /// Scaled directions.
    direction: [Row; 3],
    /// Parameters of the tips.
    length: Row,
    error: Row,
}

impl<S: Simd> Rays<S> {
    /// `None` if a segment has no length or a number is not finite or near the ends of the range.
    #[inline(always)]
    fn new(s: S, from: DVec3, targets: &Targets, reach: f32) -> Option<Self> {
        let origin = from.as_vec3().to_array();
        let mut way = [[0.0; RAYS]; 3];
        for (way, (ends, start)) in way.iter_mut().zip(targets.rows.iter().zip(from.to_array())) {
            for (way, end) in way.iter_mut().zip(ends) {
                *way = (end - start) as f32;
            }
        }
        let mut d = load(s, &way);
        let splat = |x: f32| S::F::splat(s, x);
        let longest = d[0].abs().max(d[1].abs()).max(d[2].abs());
        // These are false for NaN.
        let sound = splat(1e-18).lt(longest) & longest.lt(splat(1e18));
        if sound != 0xff || !origin.iter().all(|x| x.is_finite()) {
            return None;
        }
        let x = longest.le(d[0].abs());
        let y = longest.le(d[1].abs()) & !x;
        let start = origin[0].abs().max(origin[1].abs()).max(origin[2].abs());
        let scale = reach + start;
        let padding = 16.0 * U * scale;
        let one = splat(1.0);
        let shrink = one.div(longest);
        let (mut inverse, mut lower, mut upper) = (d, d, d);
        for axis in 0..3 {
            const TINY: f32 = 1.0 / (1u32 << 22) as f32;
            let scaled = d[axis].mul(shrink);
            d[axis] = scaled.abs().max(splat(TINY)).copysign(scaled);
            inverse[axis] = one.div(d[axis]);
            lower[axis] = inverse[axis].mul(splat(-origin[axis] - padding));
            upper[axis] = inverse[axis].mul(splat(-origin[axis] + padding));
        }
        let tips = longest.mul(splat(1.0 + 4.0 * f32::EPSILON));
        let error = longest
            .min(splat(scale))
            .mul_add(splat(6.0 * U), splat(2.5 * U * start + 2.0 * f32::MIN_POSITIVE));
        Some(Self {
            inverse,
            lower,
            upper,
            tips,
            rows: Rows {
                inverse: store(&inverse),
                lower: store(&lower),
                upper: store(&upper),
                tips: tips.store(),
                direction: store(&d),
                length: longest.store(),
                error: error.store(),
            },
            origin,
            along: [x, y, !(x | y)],
        })
    }

    /// Those of `all` that something cuts, and those that must be asked alone.
    #[inline(always)]
    fn cut(&self, s: S, geometry: &Geometry, from: DVec3, targets: &Targets, all: u32) -> (u32, u32) {
        let blocks = &*geometry.blocks;
        let (mut free, mut alone) = (all, 0);
        let mut doubts = Doubts::new();
        let mut walk = Walk::new(&geometry.tree.nodes, all);
        while let Some((at, rays)) = walk.leaf(s, self, free) {
            if !at.is_block() {
                if !doubts.add(at, 1, rays) {
                    free &= !rays;
                    alone |= rays;
                }
                continue;
            }
            let block = &blocks[at.index()];
            for axis in 0..3 {
                let mut left = rays & self.along[axis];
                if left == 0 {
                    continue;
                }
                let seen = Seen::new(s, block, &self.origin, axis);
                while left != 0 {
                    let ray = Lane::lowest(left);
                    let bit = left & left.wrapping_neg();
                    left ^= bit;
                    let hits = self.meets(s, block, &seen, axis, ray);
                    if hits.sure != 0 {
                        free ^= bit;
                    } else if hits.doubtful != 0 && !doubts.add(at, hits.doubtful, bit) {
                        free ^= bit;
                        alone |= bit;
                    }
                }
            }
        }
        let cut = all & !free & !alone;
        if doubts.len == 0 {
            return (cut, alone);
        }
        (cut | doubts.settle(free, geometry, from, targets), alone)
    }

    /// The rays that may enter the box of each child, a byte a child. An unused slot means nothing.
    #[inline(always)]
    fn enter(&self, s: S, node: &WideNode) -> u64 {
        let mut entering = 0;
        for slot in (0..WIDTH).rev() {
            let mut enter = S::F::splat(s, 0.0);
            let mut leave = self.tips;
            for axis in 0..3 {
                let lower = S::F::splat(s, node.bounds[axis][slot]);
                let upper = S::F::splat(s, node.bounds[axis + 3][slot]);
                let lower = lower.mul_add(self.inverse[axis], self.lower[axis]);
                let upper = upper.mul_add(self.inverse[axis], self.upper[axis]);
                enter = enter.max_bits(lower.min_bits(upper));
                leave = leave.min_bits(lower.max_bits(upper));
            }
            entering = entering << 8 | u64::from(enter.le(leave));
        }
        entering
    }

    /// The same for a few rays, one after the other; also the children that any of them may enter.
    #[inline(always)]
    fn few_enter(&self, s: S, node: &WideNode, rays: u32) -> (u32, u64) {
        let (mut left, mut children, mut entering) = (rays, 0, 0);
        while left != 0 {
            let ray = Lane::lowest(left);
            let bit = left & left.wrapping_neg();
            left ^= bit;
            let entered = self.enters(s, node, ray);
            children |= entered;
            entering |= s.bits_to_bytes(entered) * u64::from(bit);
        }
        (children, entering)
    }

    /// The children whose boxes one ray may enter. An unused slot means nothing.
    #[inline(always)]
    fn enters(&self, s: S, node: &WideNode, ray: Lane) -> u32 {
        let rows = &self.rows;
        let mut enter = S::F::splat(s, 0.0);
        let mut leave = S::F::splat(s, *ray.of(&rows.tips));
        for axis in 0..3 {
            let inverse = S::F::splat(s, *ray.of(&rows.inverse[axis]));
            let lower = S::F::load(s, &node.bounds[axis])
                .mul_add(inverse, S::F::splat(s, *ray.of(&rows.lower[axis])));
            let upper = S::F::load(s, &node.bounds[axis + 3])
                .mul_add(inverse, S::F::splat(s, *ray.of(&rows.upper[axis])));
            enter = enter.max_bits(lower.min_bits(upper));
            leave = leave.min_bits(lower.max_bits(upper));
        }
        enter.le(leave)
    }

    /// Tests a block's triangles for a ray whose direction is largest on `axis`.
    #[inline(always)]
    fn meets(&self, s: S, block: &TriangleBlock, seen: &Seen<S>, axis: usize, ray: Lane) -> BlockHits {
        let rows = &self.rows;
        let [x, y, z] = AXES[axis];
        let sign = 1f32.copysign(*ray.of(&rows.direction[usize::from(z)]));
        let x = S::W::splat(s, *ray.of(&rows.direction[usize::from(x)]) * sign);
        let y = S::W::splat(s, *ray.of(&rows.direction[usize::from(y)]) * sign);
        let mut corners = [(x, y); 3];
        for (to, [across, along, depth]) in corners.iter_mut().zip(seen.corners) {
            *to = (x.neg_mul_add(depth, across), y.neg_mul_add(depth, along));
        }
        let edges = Edges::new(block, corners, *ray.of(&rows.error));
        let candidates = edges.candidates(s, block);
        if candidates == 0 {
            return BlockHits::default();
        }
        let [[_, _, a], [_, _, b], [_, _, c]] = seen.corners;
        edges.decide(s, candidates, (a, b, c), sign, *ray.of(&rows.length))
    }
}

/// A traversal that stands before a leaf.
struct Walk<'a> {
    nodes: &'a [WideNode],
    stack: PencilStack,
}

impl<'a> Walk<'a> {
    #[inline(always)]
    fn new(nodes: &'a [WideNode], rays: u32) -> Self {
        let mut stack = PencilStack::new();
        stack.push_root(rays);
        Self { nodes, stack }
    }

    /// The next leaf that some of the rays `free` may meet, and which they are.
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, s: S, prepared: &Rays<S>, free: u32) -> Option<(ChildRef, u32)> {
        loop {
            let (mut at, rays) = self.stack.pop()?;
            let mut rays = rays & free;
            if rays == 0 {
                continue;
            }
            loop {
                if !at.is_node() {
                    return Some((at, rays));
                }
                let node = &self.nodes[at.index()];
                let (children, entering) = if rays.count_ones() <= FEW {
                    prepared.few_enter(s, node, rays)
                } else {
                    let entering = prepared.enter(s, node) & (u64::from(rays) * EACH);
                    (nonzero(entering), entering)
                };
                let children = children & node_used(s, node);
                if children == 0 {
                    break;
                }
                // The first child is followed at once, the rest waits.
                let first = children.trailing_zeros() & 7;
                at = node.children[first as usize];
                rays = (entering >> (8 * first)) as u32 & 0xff;
                self.stack.push_each(s, node, children & (children - 1), entering);
            }
        }
    }
}

/// The corners of a block's triangles relative to the origin, axes permuted so that a given one is the last.
struct Seen<S: Simd> {
    corners: [[S::W; 3]; 3],
}

impl<S: Simd> Seen<S> {
    #[inline(always)]
    fn new(s: S, block: &TriangleBlock, origin: &[f32; 3], axis: usize) -> Self {
        let mut moved = [S::W::splat(s, 0.0); 3];
        for (to, axis) in moved.iter_mut().zip(AXES[axis]) {
            let axis = usize::from(axis);
            *to = S::W::load(s, &block.vertices[axis]).sub(S::W::splat(s, origin[axis]));
        }
        let mut corners = [moved; 3];
        for (to, places) in corners.iter_mut().zip(&block.corners) {
            for (to, &from) in to.iter_mut().zip(&moved) {
                *to = s.permute(from, places);
            }
        }
        Self { corners }
    }
}

#[inline(always)]
fn load<S: Simd>(s: S, rows: &[Row; 3]) -> [S::F; 3] {
    let [x, y, z] = rows;
    [S::F::load(s, x), S::F::load(s, y), S::F::load(s, z)]
}

#[inline(always)]
fn store<F: Floats<Array = Row>>(rows: &[F; 3]) -> [Row; 3] {
    let [x, y, z] = rows;
    [x.store(), y.store(), z.store()]
}

/// One in each byte.
const EACH: u64 = 0x0101_0101_0101_0101;

/// Bit i is set if byte i is not zero.
#[inline(always)]
fn nonzero(bytes: u64) -> u32 {
    let highest = ((bytes & 0x7f7f_7f7f_7f7f_7f7f) + 0x7f7f_7f7f_7f7f_7f7f) | bytes;
    let lowest = (highest >> 7) & EACH;
    (lowest.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u32
}

/// The slots in use.
#[inline(always)]
fn node_used<S: Simd>(s: S, node: &WideNode) -> u32 {
    S::F::load(s, &node.bounds[0]).le(S::F::load(s, &node.bounds[3]))
}

/// Lanes of blocks and single items that the filter could not decide for some rays.
struct Doubts {
    entries: [(ChildRef, u16, u8); DOUBTS],
    len: usize,
}

const DOUBTS: usize = 32;
const _: () = assert!(BLOCK <= 16 && RAYS <= 8, "lanes and rays fit");

impl Doubts {
    #[inline(always)]
    fn new() -> Self {
        Self {
            entries: [(ChildRef::default(), 0, 0); DOUBTS],
            len: 0,
        }
    }

    /// False if there is no room.
    #[inline(always)]
    fn add(&mut self, at: ChildRef, lanes: u32, rays: u32) -> bool {
        let Some(entry) = self.entries.get_mut(self.len) else {
            return false;
        };
        *entry = (at, lanes as u16, rays as u8);
        self.len += 1;
        true
    }

    /// Decides in double precision: which of the rays in question are cut?
    #[inline(never)]
    fn settle(&self, rays: u32, geometry: &Geometry, from: DVec3, targets: &Targets) -> u32 {
        let mut cut = 0;
        for &(at, lanes, which) in &self.entries[..self.len] {
            let mut left = u32::from(which) & rays & !cut;
            while left != 0 {
                let ray = left.trailing_zeros();
                left &= left - 1;
                let target = targets.get(ray as usize);
                let mut lanes = lanes;
                let mut is_cut = false;
                if at.is_block() {
                    let block = &geometry.blocks[at.index()];
                    while lanes != 0 && !is_cut {
                        let lane = lanes.trailing_zeros() as usize;
                        lanes &= lanes - 1;
                        is_cut = segment_cuts_triangle(from, target, block.triangle(lane));
                    }
                } else {
                    is_cut = geometry.shapes[at.index()].cuts_segment(from, target);
                }
                cut |= u32::from(is_cut) << ray;
            }
        }
        cut
    }
}
