//! Shadow edges of a drawing.

use glam::Vec3;
use llsr_edges::{
    DroppedEdge, SceneEdgeOptions, SceneEdges, ShadowEdges, ShadowKind, ShadowOptions, ShadowScene,
    onto_surface,
};
use llsr_epr::drop_outshone;
use llsr_scene::{Geometry, ObjectId, Scene};
use llsr_tracer::Tracer;

use super::Layer;
use crate::clock::Stopwatch;
use crate::failure::Failure;
use crate::progress::Progress;

/// Edges are left out of lights that give less than this share of the light where they fall.
pub(crate) const UNIMPORTANT: f64 = 0.01;

/// The shadow edges that matter, with the objects that they lie on.
#[derive(Default)]
pub(crate) struct Shadows {
    /// In the scene's recentred frame (m); on curved primitives in short pieces.
    pub(crate) edges: Vec<(Layer, ObjectId, [Vec3; 2])>,
    /// Number of edges in each layer, before they were cut into pieces.
    pub(crate) counts: [usize; 6],
    /// Edges left out because other lights outshine theirs.
    pub(crate) dropped: usize,
    /// Some of these.
    pub(crate) dropped_sample: Vec<DroppedEdge>,
    /// What it took.
    pub(crate) milliseconds: f64,
}

impl Shadows {
    /// All shadow edges of a scene, light by light; none without lights.
    pub(crate) fn of(
        scene: &Scene,
        tracer: &Tracer,
        edges: &SceneEdges,
        options: &SceneEdgeOptions,
        quiet: bool,
    ) -> Result<Self, Failure> {
        if scene.lights.is_empty() {
            return Ok(Self::default());
        }
        let watch = Stopwatch::start();
        let options = ShadowOptions {
            edges: options.edges,
            ..ShadowOptions::default()
        };
        let (prepared, _) = ShadowScene::with_edges(scene, options, |id, _| edges.shared_mesh(id));
        let mut triples = prepared.all_triples_and_hiders();
        triples.sort_unstable();
        let mut shadows = ShadowEdges::default();
        let progress = Progress::new("shadows", scene.lights.len() as u64, quiet);
        for of_light in triples.chunk_by(|a, b| a.light == b.light) {
            shadows.add(&prepared, of_light.iter().copied());
            if !progress.step() {
                return Err(Failure::Interrupted);
            }
        }
        progress.finish();
        let report = drop_outshone(scene, tracer, &prepared, &mut shadows, UNIMPORTANT);
        let mut edges = Vec::with_capacity(shadows.len());
        let mut counts = [0; 6];
        for edge in shadows.iter() {
            let layer = match edge.kind {
                ShadowKind::Hard => Layer::Hard,
                ShadowKind::Umbral => Layer::Umbral,
                ShadowKind::Penumbral => Layer::Penumbral,
            };
            counts[layer.index()] += 1;
            let receiver = edge.triple.receiver;
            let object = &scene.objects[receiver.index()];
            match object.geometry {
                Geometry::Mesh(_) => edges.push((layer, receiver, edge.segment)),
                // They were found on a mesh in its place.
                Geometry::Primitive(primitive) => {
                    onto_surface(&primitive.shape, &object.transform, edge.segment, |piece| {
                        edges.push((layer, receiver, piece));
                    });
                }
            }
        }
        Ok(Self {
            edges,
            counts,
            dropped: report.dropped,
            dropped_sample: report.sample,
            milliseconds: 1e3 * watch.read().wall,
        })
    }
}
