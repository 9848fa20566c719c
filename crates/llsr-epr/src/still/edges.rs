//! The edges of a view, in the recentred frame.

use glam::Vec3;
use llsr_edges::{
    MeetingOptions, Meetings, SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView,
};
use llsr_scene::{Camera, Scene, Viewport};

/// The segments (m, recentred frame) of all edges that `camera` may see: silhouettes, boundaries and creases of meshes,
/// contours and rims of primitives, and where surfaces of meshes run into each other. Edges hidden behind something are among them.
///
/// Creases are edges with more than `crease_degrees` between the normals of their faces. A mesh that edges cannot be found
/// on has none. Cost: O(n log n) in the edges of the meshes.
pub fn view_edges(scene: &Scene, camera: &Camera, viewport: Viewport, crease_degrees: f64) -> Vec<[Vec3; 2]> {
    let edges = SceneEdges::new(scene, &SceneEdgeOptions::with_crease_degrees(crease_degrees));
    segments(&edges, camera, viewport)
}

/// The same of edges that are there already.
pub(crate) fn segments(edges: &SceneEdges, camera: &Camera, viewport: Viewport) -> Vec<[Vec3; 2]> {
    let mut found = SceneFound::default();
    let view = SceneView::Picture { camera, viewport };
    edges.find(view, None, &mut SceneScratch::default(), &mut found);
    let mut segments = found.segments().to_vec();
    let meetings = Meetings::new(edges, MeetingOptions::default());
    segments.extend(meetings.iter().map(|meeting| meeting.segment));
    segments
}
