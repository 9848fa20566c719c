//! The edges of a view, in the recentred frame.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use llsr_edges::{EdgeOptions, EdgeScratch, FoundEdges, MeshEdges};
use llsr_intervals::Viewpoint;
use llsr_scene::{Camera, Geometry, Mesh, Projection, Scene, Viewport};
use rayon::prelude::*;

use crate::outline::{Eye, outline};

/// The segments (m, recentred frame) of all edges that `camera` may see: silhouettes, boundaries and creases of meshes,
/// contours and rims of primitives. Edges hidden behind something are among them.
///
/// Creases are edges with more than `crease_degrees` between the normals of their faces. A mesh that edges cannot be found
/// on has none. Cost: O(n log n) in the edges of the meshes.
pub fn view_edges(scene: &Scene, camera: &Camera, viewport: Viewport, crease_degrees: f64) -> Vec<[Vec3; 2]> {
    let eye = match camera.projection {
        Projection::Perspective(_) => Eye::At(camera.position),
        Projection::Orthographic { .. } => Eye::Towards(-camera.forward()),
    };
    let options = EdgeOptions {
        crease_degrees,
        ..EdgeOptions::default()
    };
    let mut used = vec![false; scene.meshes.len()];
    for object in &scene.objects {
        if let Geometry::Mesh(mesh) = object.geometry {
            used[mesh.index()] = true;
        }
    }
    let prepare = |(mesh, used): (&Mesh, bool)| used.then(|| MeshEdges::new(mesh, options).ok()).flatten();
    let meshes: Vec<Option<MeshEdges>> = scene.meshes.par_iter().zip(used).map(prepare).collect();
    let mut scratch = EdgeScratch::default();
    let mut found = FoundEdges::default();
    let mut out = Vec::new();
    for object in &scene.objects {
        let transform = &object.transform;
        match object.geometry {
            Geometry::Mesh(mesh) => {
                let Some(edges) = &meshes[mesh.index()] else {
                    continue;
                };
                let to_world = DAffine3::from_mat3_translation(
                    DMat3::from_cols(
                        transform.matrix3.x_axis.as_dvec3(),
                        transform.matrix3.y_axis.as_dvec3(),
                        transform.matrix3.z_axis.as_dvec3(),
                    ),
                    transform.translation.as_dvec3(),
                );
                let to_object = to_world.inverse();
                let viewer = match eye {
                    Eye::At(position) => Viewpoint::at(to_object.transform_point3(position)),
                    Eye::Towards(direction) => Viewpoint::towards(to_object.transform_vector3(direction)),
                };
                let Some(viewer) = viewer else { continue };
                edges.find(&viewer, &mut scratch, &mut found);
                let all = found
                    .silhouettes
                    .iter()
                    .chain(&found.creases)
                    .copied()
                    .chain(edges.boundaries());
                out.extend(all.map(|edge| edges.segment(edge).map(|p| transform.transform_point3(p))));
            }
            Geometry::Primitive(primitive) => {
                let bounds = primitive.shape.bounds();
                let corners = bounds.corners().map(|p| transform.transform_point3(p).as_dvec3());
                let radius = radius_pixels(camera, viewport, &corners);
                outline(&primitive.shape, transform, eye, radius, &mut out);
            }
        }
    }
    out
}

/// Upper bound of the radius in pixels of what lies between `corners`, as far as it can matter.
fn radius_pixels(camera: &Camera, viewport: Viewport, corners: &[DVec3]) -> f64 {
    let largest = 4.0 * f64::from(viewport.width.max(viewport.height));
    let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
    for &corner in corners {
        let Some((x, y, _)) = camera.project(viewport, corner) else {
            return largest;
        };
        low = (low.0.min(x), low.1.min(y));
        high = (high.0.max(x), high.1.max(y));
    }
    (high.0 - low.0).hypot(high.1 - low.1).min(largest)
}
