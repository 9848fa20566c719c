//! Shadow edges that are kept from frame to frame (BWG03 section 6.5).

use glam::{Affine3A, DVec3, Vec3};
use llsr_edges::{ImportanceReport, SceneEdges, ShadowEdges, ShadowOptions, ShadowScene};
use llsr_scene::{Light, LightId, ObjectId, Scene, Triple};

/// Frames between two looks at what was met.
const PATIENCE: u32 = 7;

/// Middle (m) and flux of a light.
fn strength(light: &Light) -> (DVec3, f64) {
    let (a, b) = light.ends();
    (0.5 * (a + b), light.flux())
}

/// The shadow edges of all triples that shaders have met.
#[derive(Debug)]
pub(crate) struct Shadows {
    scene: ShadowScene,
    edges: ShadowEdges,
    /// All edges, to be projected in one go.
    segments: Vec<[Vec3; 2]>,
    /// What happened since they were last brought up to date.
    met: Vec<Triple>,
    /// All triples that were added, sorted.
    known: Vec<Triple>,
    /// Updates since triples were last added.
    waited: u32,
    /// For each light its middle (m) and its flux.
    lights: Vec<(DVec3, f64)>,
    least_share: f64,
    /// What was left out for it, last.
    dropped: ImportanceReport,
    moved_objects: Vec<ObjectId>,
    moved_lights: Vec<LightId>,
}

impl Shadows {
    /// No triple is known yet. The edges of meshes are those of `edges`.
    /// Edges whose shadows change the light by less than `least_share` are left out.
    pub(crate) fn new(scene: &Scene, edges: &SceneEdges, least_share: f64) -> Self {
        let (prepared, _) =
            ShadowScene::with_edges(scene, ShadowOptions::default(), |mesh, _| edges.shared_mesh(mesh));
        Self {
            scene: prepared,
            edges: ShadowEdges::default(),
            segments: Vec::new(),
            met: Vec::new(),
            known: Vec::new(),
            waited: PATIENCE,
            lights: scene.lights.iter().map(strength).collect(),
            least_share,
            dropped: ImportanceReport::default(),
            moved_objects: Vec::new(),
            moved_lights: Vec::new(),
        }
    }

    pub(crate) fn meet(&mut self, triples: &[Triple]) {
        let new = |triple: &&Triple| self.known.binary_search(triple).is_err();
        self.met.extend(triples.iter().filter(new));
    }

    pub(crate) fn move_object(&mut self, object: ObjectId, transform: Affine3A) {
        if self.scene.move_object(object, transform) {
            self.moved_objects.push(object);
        }
    }

    pub(crate) fn move_light(&mut self, light: LightId, to: &Light) {
        if self.scene.move_light(light, to) {
            self.lights[light.index()] = strength(to);
            self.moved_lights.push(light);
        }
    }

    /// All edges (m, recentred frame), as of the last [`update`](Self::update).
    pub(crate) fn segments(&self) -> &[[Vec3; 2]] {
        &self.segments
    }

    /// The edges of outshone lights that are left out, and some of those that were last.
    pub(crate) fn dropped(&self) -> (usize, &ImportanceReport) {
        (self.edges.dropped(), &self.dropped)
    }

    /// Computes again what has moved, and for the first time what was met. Returns for how many pairs of light and blocker there
    /// was something to compute.
    pub(crate) fn update(&mut self) -> usize {
        let mut pairs = 0;
        if !(self.moved_objects.is_empty() && self.moved_lights.is_empty()) {
            let done = self
                .edges
                .moved(&self.scene, &self.moved_lights, &self.moved_objects);
            pairs += done.pairs;
            self.moved_objects.clear();
            self.moved_lights.clear();
        }
        // What is met comes in dribs and drabs, and each time all that a light and a blocker share is computed.
        self.waited += 1;
        if !self.met.is_empty() && self.waited > PATIENCE {
            self.waited = 0;
            pairs += self.edges.add(&self.scene, self.met.iter().copied()).pairs;
            self.known.append(&mut self.met);
            self.known.sort_unstable();
            self.known.dedup();
        }
        if pairs > 0 {
            if self.least_share > 0.0 && self.lights.len() > 1 {
                let lights = &self.lights;
                let irradiance = |light: LightId, point: DVec3, normal: DVec3| {
                    let (middle, flux) = lights[light.index()];
                    let to = middle - point;
                    let square = to.length_squared().max(f64::MIN_POSITIVE);
                    flux * normal.dot(to).max(0.0) / (square * square.sqrt())
                };
                // Frames know nothing of visibility: strong lights are taken as seen.
                self.dropped =
                    self.edges
                        .drop_unimportant(&self.scene, self.least_share, irradiance, irradiance);
            }
            self.segments.clear();
            self.segments.extend(self.edges.iter().map(|edge| edge.segment));
        }
        pairs
    }
}
