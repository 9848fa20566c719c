//! Shadow edges of point, linear and area lights (Bala et al. 2003, sections 6.3 to 6.5 and appendix A).
//!
//! A light and a blocker have shadow *events*: wedges in which what is seen of the light changes its kind. Where a
//! wedge meets a receiver there is a shadow *edge*.
//!
//! ```
//! use glam::{DVec3, Vec3};
//! use llsr_edges::{ShadowEdges, ShadowKind, ShadowOptions, ShadowScene};
//! use llsr_scene::{LinearLight, Material, Mesh, Scene};
//!
//! let mut scene = Scene::new("a box above a floor");
//! let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
//! let corners = [[-5.0, -5.0], [-5.0, 5.0], [5.0, 5.0], [5.0, -5.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
//! scene.add_mesh(Mesh::quad("floor", corners, grey));
//! scene.add_mesh(Mesh::cuboid("box", Vec3::new(-0.5, 1.0, -0.5), Vec3::new(0.5, 1.2, 0.5), grey));
//! scene.add_light(LinearLight::new(
//!     "tube", DVec3::new(-0.3, 3.0, 0.1), DVec3::new(0.4, 3.1, -0.2), 3000.0,
//! ));
//!
//! let (prepared, left_out) = ShadowScene::new(&scene, ShadowOptions::default());
//! assert!(left_out.is_empty());
//! let mut shadows = ShadowEdges::compute(&prepared, prepared.all_triples());
//! for edge in shadows.iter() {
//!     let [from, to]: [Vec3; 2] = edge.segment;
//!     assert!(from.y.abs() < 1e-5 && to.y.abs() < 1e-5, "all of them lie on the floor");
//!     assert_ne!(edge.kind, ShadowKind::Hard, "a linear light has soft shadows");
//! }
//! assert!(shadows.iter().any(|edge| edge.kind == ShadowKind::Umbral));
//!
//! // The box moves up: the same triples, computed again.
//! let box_id = prepared.objects().nth(1).unwrap();
//! let mut prepared = prepared;
//! prepared.move_object(box_id, glam::Affine3A::from_translation(Vec3::Y));
//! let done = shadows.object_moved(&prepared, box_id);
//! assert!(done.events > 0 && done.edges == shadows.len());
//! ```

mod corner;
mod envelope;
mod events;
mod gaps;
mod importance;
mod intersect;
mod lanes;
mod light;
mod mesh;
mod scene;
mod section;
mod store;
mod tessellate;
mod triples;

use glam::Vec3;
use llsr_intervals::FaceStatistics;
use llsr_scene::{ObjectId, Triple};

pub use gaps::Gaps;
pub use importance::{DroppedEdge, ImportanceReport};
pub use light::ShadowLight;
pub use mesh::ShadowMesh;
pub use scene::{ShadowObject, ShadowOptions, ShadowScene};
pub use store::ShadowEdges;

/// What changes at a shadow edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ShadowKind {
    /// Between lit and dark: the light is a point.
    Hard,
    /// Between partly hidden and dark.
    Umbral,
    /// Between lit and partly hidden.
    Penumbral,
}

/// What makes a shadow edge: parts of the light (of [`ShadowLight`]) and of the blocker
/// ([`MeshEdges`](crate::MeshEdges)).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ShadowSource {
    /// A VE event.
    Edge {
        /// Corner of the light.
        corner: u32,
        /// Edge of the blocker.
        edge: u32,
    },
    /// An EV event.
    Vertex {
        /// Side of the light.
        side: u32,
        /// Welded vertex of the blocker.
        vertex: u32,
    },
    /// An EEE event: a gap between two edges that closes ([`ShadowScene::closing_gaps`]).
    Gap {
        /// The object whose edge is nearer to the light; the other is the blocker.
        near: ObjectId,
        /// Its edge.
        near_edge: u32,
        /// Edge of the blocker.
        far_edge: u32,
    },
}

/// A segment on a receiver at which what it sees of a light changes its kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowEdge {
    /// What changes.
    pub kind: ShadowKind,
    /// Its ends in the scene's frame (m).
    pub segment: [Vec3; 2],
    /// Light, blocker and receiver.
    pub triple: Triple,
    /// What makes it.
    pub source: ShadowSource,
    /// Face of the receiver on which it lies.
    pub face: u32,
}

/// What a computation of shadow edges did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShadowStatistics {
    /// Pairs of light and blocker whose edges were computed.
    pub pairs: usize,
    /// Their events.
    pub events: usize,
    /// Intersections of an event with a receiver.
    pub queries: usize,
    /// What these did in the trees of faces.
    pub trees: FaceStatistics,
    /// Faces looked at one by one.
    pub faces: usize,
    /// Faces that events met, before nearer ones hid others.
    pub pieces: usize,
    /// Edges found.
    pub edges: usize,
}

impl ShadowStatistics {
    fn add(&mut self, other: &Self) {
        self.queries += other.queries;
        self.trees.nodes += other.trees.nodes;
        self.trees.blocks += other.trees.blocks;
        self.faces += other.faces;
        self.pieces += other.pieces;
        self.edges += other.edges;
    }
}
