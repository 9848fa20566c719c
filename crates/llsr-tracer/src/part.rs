//! Geometry with a tree of its own.

use glam::{DAffine3, DVec3};
use llsr_scene::Bounds;

use crate::block::{TriangleBlock, TriangleId};
use crate::build::WideTree;
use crate::shape::PlacedShape;

/// Triangles and shapes in one frame, with a tree over them.
#[derive(Clone, Debug)]
pub(crate) struct Geometry {
    pub(crate) tree: WideTree,
    pub(crate) blocks: Vec<TriangleBlock>,
    /// Eight a block.
    pub(crate) ids: Vec<TriangleId>,
    pub(crate) shapes: Vec<PlacedShape>,
    /// Largest absolute coordinate (m).
    pub(crate) reach: f32,
}

impl Geometry {
    /// Builds the tree. `triangles` and `ids` match.
    pub(crate) fn new(triangles: &[[glam::Vec3; 3]], ids: &[TriangleId], shapes: Vec<PlacedShape>) -> Self {
        let boxes: Vec<Bounds> = triangles
            .iter()
            .map(|&t| Bounds::of(t))
            .chain(shapes.iter().map(PlacedShape::bounds))
            .collect();
        let mut blocks = Vec::with_capacity(triangles.len() / 5 + 1);
        let mut block_ids = Vec::with_capacity(blocks.capacity() * crate::build::WIDTH);
        let mut tree = WideTree::build(
            &boxes,
            |item| (item as usize) < triangles.len(),
            |items| {
                blocks.push(TriangleBlock::new(items.iter().map(|&i| triangles[i as usize])));
                block_ids.extend(items.iter().map(|&i| ids[i as usize]));
                block_ids.resize(blocks.len() * crate::build::WIDTH, TriangleId::default());
            },
        );
        tree.rebase_items(triangles.len());
        let bounds = tree.bounds;
        let reach = if bounds.is_empty() {
            0.0
        } else {
            bounds.min.abs().max(bounds.max.abs()).max_element()
        };
        Self {
            tree,
            blocks,
            ids: block_ids,
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
    pub(crate) fn localize(&self, p: DVec3) -> DVec3 {
        self.to_local.transform_point3(p)
    }
}
