//! The face tree: which faces may a plane wedge meet?
//!
//! The same wide hierarchy as the edge tree's, ordered by position instead of normals, with both kinds of bounds at
//! its nodes: boxes, which a wedge has to cross, and intervals of normals and offsets, which drop whole subtrees
//! that face away from the light (Bala et al. 2003, section 6.4). Leaves are blocks of sixteen faces, tested together.

mod beam;
mod kernel;
mod registers;
#[cfg(test)]
mod tests;

use glam::{DVec3, Vec3};

use super::hierarchy::{Hierarchy, LANES, map_blocks};
use super::kernel::Instructions;
use super::order::{Key, Ordering};
use super::plane::Plane;
use super::{NODE_PAD, frame_scale, view};
use crate::Viewpoint;
pub use beam::{Beam, NarrowedFaces};
use kernel::Forms;

/// The part of a plane in which a shadow event lies, and who looks at it.
///
/// ```
/// use glam::DVec3;
/// use llsr_intervals::Wedge;
///
/// let (light, edge) = (DVec3::Y * 3.0, [DVec3::new(0.0, 2.0, 0.0), DVec3::new(1.0, 2.0, 0.0)]);
/// assert!(Wedge::cone(light, edge.map(|p| p - light)).is_some());
/// assert!(Wedge::cone(light, [DVec3::X, DVec3::X * 2.0]).is_none(), "no plane");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wedge {
    /// A point of each of the planes below.
    points: [DVec3; 3],
    /// Unit normals of the plane in which the wedge lies and of the two planes that bound it.
    normals: [DVec3; 3],
    /// The mirror image of the wedge at its apex belongs to it.
    double: bool,
}

impl Wedge {
    /// All points apex + alpha d0 + beta d1 with alpha and beta not negative.
    ///
    /// `None` if the directions are parallel up to a part in 10^12, zero, or not finite.
    pub fn cone(apex: DVec3, [d0, d1]: [DVec3; 2]) -> Option<Self> {
        let (u, v) = (d0.try_normalize()?, d1.try_normalize()?);
        let cross = u.cross(v);
        if !apex.is_finite() || cross.length_squared() < 1e-24 {
            return None;
        }
        let normal = cross.normalize();
        // Turned inwards: d1 is on the inner side of the plane through d0, and d0 of that through d1.
        Some(Self {
            points: [apex; 3],
            normals: [normal, normal.cross(u), v.cross(normal)],
            double: false,
        })
    }

    /// A region of a plane that holds all of `wedges`: all that meets one of them is among what it meets.
    ///
    /// `None` without wedges, if they do not lie in one plane up to a part in 10^9 (of `size` for distances, m), if one has a mirror
    /// image, or if no two of their sides have all of them between.
    ///
    /// ```
    /// use glam::DVec3;
    /// use llsr_intervals::Wedge;
    ///
    /// let edge = [DVec3::NEG_X, DVec3::X];
    /// let of = |light: DVec3| Wedge::cone(light, edge.map(|p| p - light)).unwrap();
    /// let both = [of(DVec3::new(-0.5, 2.0, 0.0)), of(DVec3::new(0.5, 2.0, 0.0))];
    /// assert!(Wedge::around(&both, 4.0).is_some());
    /// assert!(Wedge::around(&[both[0], of(DVec3::new(0.5, 2.0, 0.1))], 4.0).is_none(), "another plane");
    /// ```
    pub fn around(wedges: &[Self], size: f64) -> Option<Self> {
        const SAME: f64 = 1e-9;
        let first = wedges.first()?;
        let [apex, normal] = [first.points[0], first.normals[0]];
        let fits = |wedge: &Self| {
            let off = wedge.points.iter().map(|&p| normal.dot(p - apex).abs());
            !wedge.double && wedge.normals[0].distance(normal) < SAME && off.fold(0.0, f64::max) < SAME * size
        };
        if !wedges.iter().all(fits) {
            return None;
        }
        // Directions of a wedge's sides.
        let sides = |wedge: &Self| [wedge.normals[1].cross(normal), normal.cross(wedge.normals[2])];
        let holds = |inwards: DVec3| wedges.iter().flat_map(sides).all(|d| inwards.dot(d) > -SAME);
        let mut result = *first;
        for side in [1, 2] {
            let inwards = wedges
                .iter()
                .map(|wedge| wedge.normals[side])
                .find(|&n| holds(n))?;
            let height = |p: DVec3| inwards.dot(p - apex);
            let lowest = wedges.iter().map(|wedge| wedge.points[side]);
            result.normals[side] = inwards;
            result.points[side] = lowest.min_by(|&p, &q| height(p).total_cmp(&height(q)))?;
        }
        Some(result)
    }

    /// The same with its mirror image at the apex: alpha and beta are both not negative, or both not positive.
    #[must_use]
    pub fn doubled(self) -> Self {
        Self { double: true, ..self }
    }

    /// Normal of the wedge's plane: d0 x d1, of unit length.
    pub fn normal(&self) -> DVec3 {
        self.normals[0]
    }
}

/// What a face query did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaceStatistics {
    /// Nodes tested; each test is of up to sixteen children.
    pub nodes: usize,
    /// Blocks scanned; up to sixteen faces each.
    pub blocks: usize,
}

/// A face that a wedge may meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct FaceHit {
    /// The face.
    pub face: u32,
    /// Its block and its place there.
    place: u32,
}

/// Working memory of face queries, kept so that they do not allocate.
#[derive(Clone, Debug, Default)]
pub struct FaceScratch {
    frontier: Vec<u32>,
    next: Vec<u32>,
    masks: Vec<u16>,
    blocks: Vec<u32>,
}

/// Corners of up to sixteen faces in the tree's frame, rounded to single precision.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct FaceBlock {
    /// Corner, axis, face.
    corners: [[[f32; LANES]; 3]; 3],
    /// The faces; [`NOTHING`] in lanes without one.
    faces: [u32; LANES],
}

/// No face.
const NOTHING: u32 = u32::MAX;

/// Corners of many faces as a structure of arrays: see [`FaceTree::columns`].
#[derive(Clone, Debug, Default)]
pub struct FaceColumns {
    /// Corner, axis; all of the same length.
    columns: [[Vec<f32>; 3]; 3],
}

impl FaceColumns {
    /// Coordinate `axis` of corner `corner` of all faces, in their order, and numbers without a meaning up to a multiple of sixteen
    /// and beyond.
    ///
    /// # Panics
    /// If `corner` or `axis` is above 2.
    #[inline]
    pub fn column(&self, corner: usize, axis: usize) -> &[f32] {
        &self.columns[corner][axis]
    }
}

/// A tree over triangles.
///
/// ```
/// use glam::DVec3;
/// use llsr_intervals::{FaceScratch, FaceTree, Viewpoint, Wedge};
///
/// let floor = [DVec3::ZERO, DVec3::Z, DVec3::X];
/// let tree = FaceTree::build(1, DVec3::ZERO, 1.0, |_| floor);
/// let light = DVec3::new(0.2, 3.0, 0.2);
/// let wedge = Wedge::cone(light, [DVec3::new(-0.1, -1.0, 0.0), DVec3::new(0.1, -1.0, 0.0)]).unwrap();
/// let mut found = Vec::new();
/// let from_above = [Viewpoint::at(light).unwrap()];
/// tree.query(&wedge, &from_above, &mut FaceScratch::default(), &mut found);
/// assert_eq!(found[0].face, 0);
/// ```
#[derive(Clone, Debug)]
pub struct FaceTree {
    hierarchy: Hierarchy<1>,
    blocks: Vec<FaceBlock>,
    center: DVec3,
    scale: f64,
    instructions: Instructions,
}

impl FaceTree {
    /// Builds the tree of faces `0..count` inside a sphere around `center`.
    ///
    /// Faces whose corners lie so near a line that they have no steady normal ([`Plane::of`]) are left out: nothing
    /// that falls on them can be seen. Cost: O(n log n), about 0.3 s for 0.9 million faces on one core; the `rayon`
    /// feature uses all, with the same result.
    pub fn build(count: u32, center: DVec3, radius: f64, corners: impl Fn(u32) -> [DVec3; 3] + Sync) -> Self {
        let scale = frame_scale(radius);
        let local = |face: u32| corners(face).map(|p| (p - center) * scale);
        let extent = |face: u32| {
            let [a, b, c] = local(face).map(|p| p.as_vec3());
            (a.min(b).min(c), a.max(b).max(c))
        };
        let chunk = 1 << 12;
        let keys: Vec<Vec<Option<Key<3>>>> = map_blocks((count as usize).div_ceil(chunk), |part| {
            let first = (part * chunk) as u32;
            (first..count.min(first + chunk as u32))
                .map(|face| {
                    Plane::of(local(face))?;
                    let (min, max) = extent(face);
                    Some(Key {
                        place: (0.5 * (min + max)).to_array(),
                        span: (max - min).to_array(),
                        item: face,
                    })
                })
                .collect()
        });
        let keys: Vec<Key<3>> = keys.into_iter().flatten().flatten().collect();
        let rule = Ordering {
            block: LANES,
            wide_high: true,
            narrow: 0.0,
        };
        let plane = |face: u32| {
            // Faces without a plane are not in the tree.
            [Plane::of(local(face)).map_or([0.0; 4], |plane| plane.coefficients(DVec3::ZERO, 1.0))]
        };
        let hierarchy = Hierarchy::build(keys, rule, plane, extent);
        let blocks = map_blocks(hierarchy.blocks(), |block| {
            let mut result = FaceBlock {
                corners: [[[0.0; LANES]; 3]; 3],
                faces: [NOTHING; LANES],
            };
            for (lane, &face) in hierarchy.block_items(block).iter().enumerate() {
                result.faces[lane] = face;
                for (place, corner) in result.corners.iter_mut().zip(local(face)) {
                    for (axis, x) in corner.as_vec3().to_array().into_iter().enumerate() {
                        place[axis][lane] = x;
                    }
                }
            }
            result
        });
        Self {
            hierarchy,
            blocks,
            center,
            scale,
            instructions: Instructions::detect(),
        }
    }

    /// The same tree, queried with other instructions than the fastest: for tests and measurements. Takes the
    /// portable ones where the processor does not have those asked for.
    #[must_use]
    pub fn with_instructions(mut self, instructions: Instructions) -> Self {
        self.instructions = instructions.or_portable();
        self
    }

    /// Number of faces.
    pub fn len(&self) -> usize {
        self.hierarchy.items.len()
    }

    /// There are no faces.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A point in the frame of [`corners`](Self::corners): relative to the tree's centre, in units of its radius.
    pub fn to_frame(&self, p: DVec3) -> DVec3 {
        (p - self.center) * self.scale
    }

    /// A direction in that frame.
    pub fn direction_to_frame(&self, d: DVec3) -> DVec3 {
        d * self.scale
    }

    /// The corners of a face that was found, rounded to single precision in a frame in which none is larger than 1.
    ///
    /// They lie beside what the query has just read, so that asking for them costs no access to distant memory.
    ///
    /// # Panics
    /// May panic if the face was found in another tree.
    #[inline]
    pub fn corners(&self, hit: FaceHit) -> [Vec3; 3] {
        let (block, lane) = (hit.place as usize / LANES, hit.place as usize % LANES);
        let [a, b, c] = &self.blocks[block].corners;
        let corner = |axes: &[[f32; LANES]; 3]| Vec3::new(axes[0][lane], axes[1][lane], axes[2][lane]);
        [corner(a), corner(b), corner(c)]
    }

    /// Appends to `found` all faces that `wedge` meets, and some that it nearly meets; the order depends on the
    /// tree only.
    ///
    /// With `viewers`, subtrees all of whose faces turn away from each of them are dropped; other faces that turn
    /// away are still among those found. Cost: about 15 ns a node and 10 ns a block.
    pub fn query(
        &self,
        wedge: &Wedge,
        viewers: &[Viewpoint],
        scratch: &mut FaceScratch,
        found: &mut Vec<FaceHit>,
    ) -> FaceStatistics {
        let mut statistics = FaceStatistics::default();
        let tree = &self.hierarchy;
        if tree.links.is_empty() {
            return statistics;
        }
        let forms = self.forms(wedge, viewers);
        scratch.blocks.clear();
        scratch.frontier.clear();
        scratch.frontier.push(0);
        while !scratch.frontier.is_empty() {
            statistics.nodes += scratch.frontier.len();
            kernel::test_nodes(
                self.instructions,
                &tree.planes,
                &tree.bounds,
                &scratch.frontier,
                &forms,
                &mut scratch.masks,
            );
            scratch.next.clear();
            for (&node, &mask) in scratch.frontier.iter().zip(&scratch.masks) {
                let links = &tree.links[node as usize];
                let mut open = mask & u16::MAX >> (LANES as u32 - links.count);
                while open != 0 {
                    let lane = open.trailing_zeros() as usize;
                    open &= open - 1;
                    if links.blocks >> lane & 1 == 1 {
                        scratch.blocks.push(links.child[lane]);
                    } else {
                        scratch.next.push(links.child[lane]);
                    }
                }
            }
            std::mem::swap(&mut scratch.frontier, &mut scratch.next);
        }
        statistics.blocks = scratch.blocks.len();
        self.scan(&forms, scratch, found);
        statistics
    }

    fn forms(&self, wedge: &Wedge, viewers: &[Viewpoint]) -> Forms {
        let plane = |i: usize| form(wedge.normals[i], self.to_frame(wedge.points[i]));
        Forms {
            planes: [plane(0), plane(1), plane(2)],
            double: wedge.double,
            views: self.views(viewers),
            pad: NODE_PAD,
        }
    }

    fn views(&self, viewers: &[Viewpoint]) -> [Option<super::blocks::View>; 2] {
        viewers.iter().take(2).fold([None; 2], |[_, last], viewer| {
            [last, Some(view(viewer, self.center, self.scale))]
        })
    }

    /// Appends the faces of the blocks listed in `scratch` that the wedge may meet.
    fn scan(&self, forms: &Forms, scratch: &FaceScratch, found: &mut Vec<FaceHit>) {
        kernel::scan_blocks(self.instructions, &self.blocks, &scratch.blocks, forms, found);
    }

    /// The corners of faces that were found, as [`corners`](Self::corners) gives them one by one. Replaces what is in `columns`.
    ///
    /// Cost: about 2 ns a face if faces of one block follow each other, as they do where [`query`](Self::query) put them.
    ///
    /// # Panics
    /// May panic if a face was found in another tree.
    pub fn columns(&self, found: &[FaceHit], columns: &mut FaceColumns) {
        // A register may be written behind the last face.
        let room = found.len().next_multiple_of(LANES) + LANES;
        for column in columns.columns.iter_mut().flatten() {
            if column.len() < room {
                column.resize(room, 0.0);
            }
        }
        let columns = columns
            .columns
            .each_mut()
            .map(|axes| axes.each_mut().map(|column| &mut column[..room]));
        kernel::gather_columns(self.instructions, &self.blocks, found, columns);
    }

    /// Box of all faces; empty without any.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        if let (Some(bounds), Some(links)) = (self.hierarchy.bounds.first(), self.hierarchy.links.first()) {
            for lane in 0..links.count as usize {
                min = min.min(Vec3::from_array(bounds.min.map(|row| row[lane])));
                max = max.max(Vec3::from_array(bounds.max.map(|row| row[lane])));
            }
        }
        let back = |p: Vec3| p.as_dvec3() / self.scale + self.center;
        (back(min), back(max))
    }
}

/// Coefficients of at most 1 of the plane through `apex`, to be multiplied with (x, y, z, 1).
fn form(normal: DVec3, apex: DVec3) -> [f32; 4] {
    let offset = -normal.dot(apex);
    let largest = normal.abs().max_element().max(offset.abs());
    let n = normal / largest;
    [n.x as f32, n.y as f32, n.z as f32, (offset / largest) as f32]
}
