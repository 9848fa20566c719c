//! Shadow edges that are kept from frame to frame (BWG03 section 6.5).

use glam::{Affine3A, Vec3};
use llsr_edges::{SceneEdges, ShadowEdges, ShadowOptions, ShadowScene};
use llsr_scene::{Light, LightId, ObjectId, Scene, Triple};

/// The shadow edges of all triples that shaders have met.
#[derive(Debug)]
pub(crate) struct Shadows {
    scene: ShadowScene,
    edges: ShadowEdges,
    /// All edges, to be projected in one go.
    segments: Vec<[Vec3; 2]>,
    /// What happened since they were last brought up to date.
    met: Vec<Triple>,
    moved_objects: Vec<ObjectId>,
    moved_lights: Vec<LightId>,
}

impl Shadows {
    /// No triple is known yet. The edges of meshes are those of `edges`.
    pub(crate) fn new(scene: &Scene, edges: &SceneEdges) -> Self {
        let (prepared, _) =
            ShadowScene::with_edges(scene, ShadowOptions::default(), |mesh, _| edges.shared_mesh(mesh));
        Self {
            scene: prepared,
            edges: ShadowEdges::default(),
            segments: Vec::new(),
            met: Vec::new(),
            moved_objects: Vec::new(),
            moved_lights: Vec::new(),
        }
    }

    pub(crate) fn meet(&mut self, triples: &[Triple]) {
        self.met.extend_from_slice(triples);
    }

    pub(crate) fn move_object(&mut self, object: ObjectId, transform: Affine3A) {
        if self.scene.move_object(object, transform) {
            self.moved_objects.push(object);
        }
    }

    pub(crate) fn move_light(&mut self, light: LightId, to: &Light) {
        if self.scene.move_light(light, to) {
            self.moved_lights.push(light);
        }
    }

    /// Computes again what has moved, and for the first time what was met. Returns all edges (m, recentred frame) and for how
    /// many pairs of light and blocker there was something to compute.
    pub(crate) fn update(&mut self) -> (&[[Vec3; 2]], usize) {
        let mut pairs = 0;
        if !(self.moved_objects.is_empty() && self.moved_lights.is_empty()) {
            let done = self
                .edges
                .moved(&self.scene, &self.moved_lights, &self.moved_objects);
            pairs += done.pairs;
            self.moved_objects.clear();
            self.moved_lights.clear();
        }
        if !self.met.is_empty() {
            pairs += self.edges.add(&self.scene, self.met.iter().copied()).pairs;
            self.met.clear();
        }
        if pairs > 0 {
            self.segments.clear();
            self.segments.extend(self.edges.iter().map(|edge| edge.segment));
        }
        (&self.segments, pairs)
    }
}
