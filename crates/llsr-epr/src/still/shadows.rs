//! Shadow edges that a picture needs: where light jumps within a few pixels.
//!
//! Far from what casts it the shadow of a tube is so soft that samples describe it well; near the contact it hardens
//! (BWG03 section 6.3 and figure 9) until it is a jump. Only there edges keep samples apart.

use glam::{DVec3, Vec3};
use llsr_edges::{
    ImportanceReport, SceneEdges, ShadowEdge, ShadowEdges, ShadowKind, ShadowOptions, ShadowScene,
    ShadowSource,
};
use llsr_scene::{Camera, Projection, Scene, Triple, Viewport};
use llsr_shading::Settings;
use llsr_tracer::Tracer;

use crate::importance::{DroppedContrast, drop_outshone, dropped_contrast};

/// A shadow edge counts if its penumbra is narrower than this, in pixels.
const NARROW: f64 = 3.0;
/// Lights that together give less than this share of the light at an edge have no shadow edges there.
const UNIMPORTANT: f64 = 0.05;

/// Shadow edges that a picture needs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NarrowShadows {
    /// The edges (m, recentred frame).
    pub segments: Vec<[Vec3; 2]>,
    /// Shadow edges, narrow or not, that were left out because other lights outshine theirs.
    pub dropped: usize,
    /// How strong the shadows of those are.
    pub dropped_contrast: DroppedContrast,
}

/// The shadow edges (m, recentred frame) of `triples` that are narrow as `camera` sees them: their penumbra takes less than three
/// pixels. `edges` are those of the scene.
///
/// Left out are edges outside the picture, on sides of surfaces that face away from the camera, and of lights that together give less than
/// 5% of the light there. Edges hidden behind something are among them. Cost: that of [`ShadowEdges::compute`] and, for each
/// edge, a look at all lights.
pub fn narrow_shadow_edges(
    scene: &Scene,
    tracer: &Tracer,
    edges: &SceneEdges,
    triples: Vec<Triple>,
    camera: &Camera,
    viewport: Viewport,
) -> NarrowShadows {
    if triples.is_empty() {
        return NarrowShadows::default();
    }
    let (prepared, _) =
        ShadowScene::with_edges(scene, ShadowOptions::default(), |mesh, _| edges.shared_mesh(mesh));
    let mut shadows = ShadowEdges::compute(&prepared, triples);
    let report = if scene.lights.len() > 1 {
        drop_outshone(scene, tracer, &prepared, &mut shadows, UNIMPORTANT)
    } else {
        ImportanceReport::default()
    };
    let narrow = |edge: &&ShadowEdge| {
        edge.kind == ShadowKind::Hard
            || places(edge).any(|at| {
                pixel(camera, viewport, at).is_some_and(|pixel| {
                    width(scene, &prepared, edge, at).is_none_or(|width| width < NARROW * pixel)
                })
            })
    };
    let seen = |edge: &&ShadowEdge| faces(scene, &prepared, edge, camera).unwrap_or(true);
    let kept = shadows.iter().filter(narrow).filter(seen);
    NarrowShadows {
        segments: kept.map(|edge| edge.segment).collect(),
        dropped: report.dropped,
        dropped_contrast: dropped_contrast(scene, tracer, &Settings::default(), &report.sample, UNIMPORTANT),
    }
}

/// Does the camera look at the side of the receiver on which the light falls?
fn faces(scene: &Scene, prepared: &ShadowScene, edge: &ShadowEdge, camera: &Camera) -> Option<bool> {
    let normal = normal(scene, prepared, edge)?;
    let at = middle(edge);
    let lights = prepared.light(edge.triple.light)?.corners();
    let to_viewer = match camera.projection {
        Projection::Perspective(_) => camera.position - at,
        Projection::Orthographic { .. } => -camera.forward(),
    };
    Some(
        lights
            .iter()
            .any(|light| normal.dot(*light - at) * normal.dot(to_viewer) > 0.0),
    )
}

/// A normal of the receiver's face, of any length.
fn normal(scene: &Scene, prepared: &ShadowScene, edge: &ShadowEdge) -> Option<DVec3> {
    let receiver = edge.triple.receiver;
    let mesh = prepared.object(receiver)?.mesh().edges();
    let transform = &scene.objects.get(receiver.index())?.transform;
    let corners = mesh.corners(edge.face);
    let [a, b, c] = corners.map(|p| transform.transform_point3(p.as_vec3()).as_dvec3());
    Some((b - a).cross(c - a))
}

fn middle(edge: &ShadowEdge) -> DVec3 {
    let [a, b] = edge.segment.map(|p| p.as_dvec3());
    0.5 * (a + b)
}

/// Places along an edge, from its middle on: part of a long one may lie outside the picture.
fn places(edge: &ShadowEdge) -> impl Iterator<Item = DVec3> {
    let [a, b] = edge.segment.map(|p| p.as_dvec3());
    let at = [0.5, 0.25, 0.75, 0.1, 0.9, 0.4, 0.6, 0.0, 1.0];
    at.into_iter().map(move |t| a + (b - a) * t)
}

/// About so wide (m) is the penumbra at a place of an edge, across it on its receiver. `None` if what casts it is not known.
///
/// Where an edge of the blocker casts it, that is how far apart the ends of the light throw the shadow of that edge, which is nothing
/// for a light along it, however long; but at most the light seen through a hole in the blocker, as for a corner's.
fn width(scene: &Scene, prepared: &ShadowScene, edge: &ShadowEdge, at: DVec3) -> Option<f64> {
    let blocker = edge.triple.blocker;
    let mesh = prepared.object(blocker)?.mesh().edges();
    let transform = &scene.objects.get(blocker.index())?.transform;
    let [a, b] = match edge.source {
        ShadowSource::Edge { edge, .. } => mesh.segment(edge),
        ShadowSource::Vertex { vertex, .. } => [*mesh.positions().get(vertex as usize)?; 2],
        ShadowSource::Gap { far_edge, .. } => mesh.segment(far_edge),
    }
    .map(|p| transform.transform_point3(p).as_dvec3());
    let along = b - a;
    let t = (at - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
    let near = at.distance(a + along * t.clamp(0.0, 1.0));
    let corners = prepared.light(edge.triple.light)?.corners();
    let extent = corners.iter().map(|c| c.distance(corners[0])).fold(0.0, f64::max);
    let far = corners.iter().map(|c| c.distance(at)).fold(f64::MAX, f64::min);
    let most = extent * near / (far - near).max(1e-6 * far);
    if !matches!(edge.source, ShadowSource::Edge { .. }) {
        return Some(most);
    }
    let [from, to] = edge.segment.map(|p| p.as_dvec3());
    let across = normal(scene, prepared, edge)?
        .cross(to - from)
        .normalize_or_zero();
    let apart = corners.iter().map(|&corner| {
        // Where the plane through this end of the light and the blocker's edge meets the line across the shadow's.
        let plane = (a - corner).cross(along);
        (plane.dot(a - at) / plane.dot(across)).abs()
    });
    let widest = apart.fold(0.0, |widest: f64, x| if x <= widest { widest } else { x });
    Some(if widest < most { widest } else { most })
}

/// The size of a pixel (m) at a point; `None` outside the picture.
fn pixel(camera: &Camera, viewport: Viewport, point: DVec3) -> Option<f64> {
    let (x, y, _) = camera.project(viewport, point)?;
    let inside = x >= -1.0
        && y >= -1.0
        && x <= f64::from(viewport.width) + 1.0
        && y <= f64::from(viewport.height) + 1.0;
    if !inside {
        return None;
    }
    let beside = |dx: f64| {
        let (origin, direction) = camera.ray(viewport, x + dx, y);
        origin + direction * (point - origin).length()
    };
    Some(beside(-0.5).distance(beside(0.5)))
}

#[cfg(test)]
mod tests {
    use llsr_edges::SceneEdgeOptions;
    use llsr_scene::{LightId, ObjectId, demo};

    use super::*;

    #[test]
    fn the_shadow_of_a_ledge_along_a_tube_is_narrow_and_reaches_into_a_recess() {
        let scene = demo::build("subway").expect("a built-in scene");
        let edges = SceneEdges::new(&scene, &SceneEdgeOptions::with_crease_degrees(30.0));
        // The shell hides the far tube from itself: its ledge throws a shadow on the door behind the wall, where only the tube's
        // middle comes in.
        let triple = Triple {
            light: LightId(0),
            blocker: ObjectId(1),
            receiver: ObjectId(1),
        };
        let viewport = Viewport {
            width: 512,
            height: 512,
        };
        let camera = &scene.cameras[0];
        let (tracer, _) = Tracer::new(&scene);
        let found = narrow_shadow_edges(&scene, &tracer, &edges, vec![triple], camera, viewport).segments;
        // From the tube (y 2.3, z -0.95) past the ledge's edge (y 2.12, z -1.38) to the door's plane at z = -1.72.
        let height = 2.12 - 0.34 * 0.18 / 0.43;
        for i in 0..12 {
            let x = 1.0 + 0.1 * i as f32;
            let covers = |[a, b]: &[Vec3; 2]| {
                let on = |p: &Vec3| (p.z + 1.72).abs() < 1e-4 && (p.y - height).abs() < 1e-3;
                on(a) && on(b) && a.x.min(b.x) <= x && x <= a.x.max(b.x)
            };
            assert!(found.iter().any(covers), "no shadow edge on the door at x = {x}");
        }
    }
}
