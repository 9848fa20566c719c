//! Geometry with a tree of its own.

use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec3};
use llsr_scene::{Bounds, ObjectId};

use crate::block::{BLOCK, TriangleBlock, TriangleId};
use crate::build::WideTree;
use crate::pages::Pages;
use crate::shape::PlacedShape;

/// Triangles and shapes in one frame, with a tree over them.
#[derive(Clone, Debug)]
pub(crate) struct Geometry {
    pub(crate) tree: WideTree,
    pub(crate) blocks: Pages<TriangleBlock>,
    /// Sixteen a block.
    pub(crate) ids: Pages<TriangleId>,
    pub(crate) shapes: Vec<PlacedShape>,
    /// Largest absolute coordinate (m).
    pub(crate) reach: f32,
}

impl Geometry {
    /// Builds the tree. `triangles` index `positions` and match `ids`; equal positions should have one index.
    pub(crate) fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        ids: &[TriangleId],
        shapes: Vec<PlacedShape>,
    ) -> Self {
        let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
        let boxes: Vec<Bounds> = triangles
            .iter()
            .map(|t| Bounds::of(corners(t)))
            .chain(shapes.iter().map(PlacedShape::bounds))
            .collect();
        let mut blocks = Vec::with_capacity(triangles.len() / 10 + 1);
        let mut block_ids = Vec::with_capacity(blocks.capacity() * BLOCK);
        let tree = WideTree::build(&boxes, triangles, |items| {
            let packed = items.iter().map(|&i| triangles[i as usize]);
            blocks.push(TriangleBlock::new(packed, positions));
            block_ids.extend(items.iter().map(|&i| ids[i as usize]));
            block_ids.resize(blocks.len() * BLOCK, TriangleId::default());
        });
        let bounds = tree.bounds;
        let reach = if bounds.is_empty() {
            0.0
        } else {
            bounds.min.abs().max(bounds.max.abs()).max_element()
        };
        Self {
            tree,
            blocks: Pages::new(&blocks),
            ids: Pages::new(&block_ids),
            shapes,
            reach,
        }
    }
}

/// Where an instance stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) to_world: DAffine3,
    pub(crate) to_local: DAffine3,
    /// Object of the instance.
    pub(crate) object: u32,
}

impl Placement {
    /// `transform` must be invertible.
    pub(crate) fn new(transform: &Affine3A, object: ObjectId) -> Self {
        let to_world = double(transform);
        Self {
            to_world,
            to_local: to_world.inverse(),
            object: object.0,
        }
    }

    pub(crate) fn localize(&self, p: DVec3) -> DVec3 {
        self.to_local.transform_point3(p)
    }
}

/// The same map in double precision.
pub(crate) fn double(transform: &Affine3A) -> DAffine3 {
    DAffine3::from_mat3_translation(
        DMat3::from_cols(
            transform.matrix3.x_axis.as_dvec3(),
            transform.matrix3.y_axis.as_dvec3(),
            transform.matrix3.z_axis.as_dvec3(),
        ),
        transform.translation.as_dvec3(),
    )
}
