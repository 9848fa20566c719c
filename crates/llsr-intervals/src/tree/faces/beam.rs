//! Many wedges with one apex: the parts of the tree that matter to any of them, found once.
//!
//! The shadow events of neighbouring silhouette edges meet nearly the same faces. A beam around their wedges is walked
//! down the tree first; what it meets is kept as a list of boxes without levels, in which each wedge then looks.

use glam::DVec3;

use super::super::NODE_PAD;
use super::super::hierarchy::{BoundsLanes, LANES};
use super::kernel::{self, BeamForms};
use super::{FaceHit, FaceScratch, FaceStatistics, FaceTree, Wedge, form};
use crate::Viewpoint;

/// All of its directions are at most about 75 degrees from the middle one.
const LEAST_COSINE: f64 = 0.25;

/// A pyramid that holds wedges with one apex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    apex: DVec3,
    /// Of the planes through the apex that bound it; they point inwards.
    normals: [DVec3; 4],
}

impl Beam {
    /// A beam that holds all points apex + alpha d with alpha not negative, and those between them, for each d of
    /// `directions` (of any length). `None` if they are not finite, or spread over more than a part of a half-space.
    pub fn around(apex: DVec3, directions: impl Iterator<Item = DVec3> + Clone) -> Option<Self> {
        let sum: DVec3 = directions.clone().map(|d| d.normalize_or_zero()).sum();
        let middle = sum.try_normalize()?;
        if !apex.is_finite() {
            return None;
        }
        // Along the longest extent, so that a row of edges has a narrow beam.
        let far = directions.clone().fold(DVec3::ZERO, |far, d| {
            let off = d.normalize_or_zero() - middle;
            if off.length_squared() > far.length_squared() {
                off
            } else {
                far
            }
        });
        let across = middle
            .cross(far)
            .try_normalize()
            .unwrap_or_else(|| middle.any_orthonormal_vector());
        let along = across.cross(middle);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for d in directions {
            let depth = middle.dot(d);
            if depth.is_nan() || depth < LEAST_COSINE * d.length() || depth <= 0.0 {
                return None;
            }
            for (k, axis) in [along, across].into_iter().enumerate() {
                let x = axis.dot(d) / depth;
                (low[k], high[k]) = (low[k].min(x), high[k].max(x));
            }
        }
        // Far more than double precision loses here, far less than single precision does later.
        let room = 1e-10;
        let inwards = |axis: DVec3, k: usize| {
            [
                (axis - middle * (low[k] - room)).normalize(),
                (middle * (high[k] + room) - axis).normalize(),
            ]
        };
        let ([a, b], [c, d]) = (inwards(along, 0), inwards(across, 1));
        Some(Self {
            apex,
            normals: [a, b, c, d],
        })
    }
}

/// The blocks of a tree that a beam meets: see [`FaceTree::narrow`].
#[derive(Clone, Debug, Default)]
pub struct NarrowedFaces {
    bounds: Vec<BoundsLanes>,
    blocks: Vec<u32>,
}

impl NarrowedFaces {
    fn push(&mut self, from: &BoundsLanes, lane: usize, block: u32) {
        let to = self.blocks.len() % LANES;
        if to == 0 {
            self.bounds.push(BoundsLanes {
                min: [[f32::INFINITY; LANES]; 3],
                max: [[f32::NEG_INFINITY; LANES]; 3],
            });
        }
        self.blocks.push(block);
        if let Some(last) = self.bounds.last_mut() {
            for axis in 0..3 {
                last.min[axis][to] = from.min[axis][lane];
                last.max[axis][to] = from.max[axis][lane];
            }
        }
    }
}

impl FaceTree {
    /// Writes to `narrowed` the parts of the tree that `beam` meets and that do not turn away from all `viewers`, as in
    /// [`query`](Self::query). `None` if there are more than `most` blocks: then wedges are asked for one by one.
    ///
    /// Cost: about 20 ns a node and 10 ns a block.
    pub fn narrow(
        &self,
        beam: &Beam,
        viewers: &[Viewpoint],
        most: usize,
        scratch: &mut FaceScratch,
        narrowed: &mut NarrowedFaces,
    ) -> Option<FaceStatistics> {
        narrowed.bounds.clear();
        narrowed.blocks.clear();
        let mut statistics = FaceStatistics::default();
        let tree = &self.hierarchy;
        if tree.links.is_empty() {
            return Some(statistics);
        }
        let apex = self.to_frame(beam.apex);
        let forms = BeamForms {
            planes: beam.normals.map(|normal| form(normal, apex)),
            views: self.views(viewers),
            pad: NODE_PAD,
        };
        scratch.frontier.clear();
        scratch.frontier.push(0);
        while !scratch.frontier.is_empty() {
            statistics.nodes += scratch.frontier.len();
            if scratch.frontier.len() > most {
                return None;
            }
            kernel::test_nodes_in_beam(
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
                        narrowed.push(&tree.bounds[node as usize], lane, links.child[lane]);
                    } else {
                        scratch.next.push(links.child[lane]);
                    }
                }
                if narrowed.blocks.len() > most {
                    return None;
                }
            }
            std::mem::swap(&mut scratch.frontier, &mut scratch.next);
        }
        Some(statistics)
    }

    /// What [`query`](Self::query) finds for a wedge inside the beam that `narrowed` was made for, with the same
    /// viewers. Cost: about 1 ns for each block that the beam meets, and 10 ns for each that the wedge meets.
    pub fn query_narrowed(
        &self,
        narrowed: &NarrowedFaces,
        wedge: &Wedge,
        scratch: &mut FaceScratch,
        found: &mut Vec<FaceHit>,
    ) -> FaceStatistics {
        let forms = self.forms(wedge, &[]);
        kernel::test_boxes(self.instructions, &narrowed.bounds, &forms, &mut scratch.masks);
        scratch.blocks.clear();
        for (blocks, &mask) in narrowed.blocks.chunks(LANES).zip(&scratch.masks) {
            let mut open = mask & u16::MAX >> (LANES - blocks.len());
            while open != 0 {
                scratch.blocks.push(blocks[open.trailing_zeros() as usize]);
                open &= open - 1;
            }
        }
        self.scan(&forms, scratch, found);
        FaceStatistics {
            nodes: narrowed.bounds.len(),
            blocks: scratch.blocks.len(),
        }
    }

    /// The tree has one node at most: there is nothing to narrow.
    pub fn is_shallow(&self) -> bool {
        self.hierarchy.links.len() < 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beams_hold_their_directions_and_refuse_what_spreads() {
        let apex = DVec3::new(1.0, 2.0, 3.0);
        let directions = [
            DVec3::new(0.1, -1.0, 0.0),
            DVec3::new(0.3, -2.0, 0.05),
            DVec3::new(0.2, -0.5, -0.1),
        ];
        let beam = Beam::around(apex, directions.into_iter()).expect("they are near each other");
        for d in directions {
            assert!(beam.normals.iter().all(|n| n.dot(d) >= 0.0), "{d} is inside");
            assert!(
                beam.normals.iter().any(|n| n.dot(-d) < 0.0),
                "{d} turned round is not"
            );
        }
        assert!(
            Beam::around(apex, [DVec3::X, DVec3::NEG_X].into_iter()).is_none(),
            "opposite"
        );
        assert!(
            Beam::around(apex, [DVec3::X, DVec3::new(-1.0, 0.2, 0.0)].into_iter()).is_none(),
            "wide"
        );
        assert!(
            Beam::around(apex, [DVec3::X, DVec3::NAN].into_iter()).is_none(),
            "nowhere"
        );
        assert!(
            Beam::around(apex, [DVec3::X, DVec3::ZERO].into_iter()).is_none(),
            "no direction"
        );
    }
}
