//! Surface points, ready to be lit.

use glam::{Affine3A, DVec3, Vec3};
use llsr_scene::{Geometry, MaterialId, ObjectId, Scene};
use llsr_tracer::{Hit, Surface};

/// A point of a surface with all that the shaders want to know; normals are turned to the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point (m, recentred frame).
    pub position: DVec3,
    /// The point to trace from: just off the surface, on the viewer's side.
    pub origin: DVec3,
    /// Unit normal of the face.
    pub geometric_normal: DVec3,
    /// Unit normal for shading: the file's where it has one, else that of the face.
    pub shading_normal: DVec3,
    /// Unit direction to the viewer.
    pub to_viewer: DVec3,
    /// Distance from the viewer (m).
    pub distance: f64,
    /// Base colour, linear RGB, texture included.
    pub albedo: Vec3,
    /// Emitted radiance, linear RGB.
    pub emission: Vec3,
    /// The object.
    pub object: ObjectId,
    /// Its material here.
    pub material: MaterialId,
    /// The triangle of its mesh, if a texture was looked up on it.
    pub textured: Option<u32>,
}

impl SurfacePoint {
    /// Looks up what `scene` says of a hit by a ray of unit `direction`.
    ///
    /// # Panics
    /// If the hit is not one of this scene.
    pub fn new(scene: &Scene, hit: &Hit, direction: DVec3) -> Self {
        let transform = &scene.objects[hit.object.index()].transform;
        Self::placed(scene, transform, hit, direction)
    }

    /// The same for an object that stands where `transform` puts it, whatever the scene says.
    ///
    /// # Panics
    /// If the hit is not one of this scene.
    pub fn placed(scene: &Scene, transform: &Affine3A, hit: &Hit, direction: DVec3) -> Self {
        let object = &scene.objects[hit.object.index()];
        let towards = |normal: DVec3| {
            if normal.dot(direction) > 0.0 {
                -normal
            } else {
                normal
            }
        };
        let geometric_normal = towards(hit.normal);
        let mut shading_normal = geometric_normal;
        let (mut uv, mut textured) = (None, None);
        let material = match (object.geometry, hit.surface) {
            (
                Geometry::Mesh(mesh),
                Surface::Triangle {
                    index,
                    barycentrics: [u, v],
                },
            ) => {
                let mesh = &scene.meshes[mesh.index()];
                let corners = mesh.triangles[index as usize].map(|vertex| vertex as usize);
                let weights = [1.0 - u - v, u, v];
                if !mesh.normals.is_empty() {
                    let sum: DVec3 = std::iter::zip(corners, weights)
                        .map(|(corner, weight)| mesh.normals[corner].as_dvec3() * weight)
                        .sum();
                    // Normals go with the inverse transpose.
                    let inverse = transform.matrix3.inverse().transpose();
                    let normal = glam::DMat3::from_cols(
                        inverse.x_axis.as_dvec3(),
                        inverse.y_axis.as_dvec3(),
                        inverse.z_axis.as_dvec3(),
                    ) * sum;
                    if let Some(normal) = normal.try_normalize() {
                        shading_normal = if normal.dot(geometric_normal) < 0.0 {
                            -normal
                        } else {
                            normal
                        };
                    }
                }
                if !mesh.uvs.is_empty() {
                    uv = Some(
                        std::iter::zip(corners, weights)
                            .map(|(corner, weight)| mesh.uvs[corner] * weight as f32)
                            .sum(),
                    );
                }
                mesh.materials[index as usize]
            }
            (Geometry::Primitive(primitive), _) => primitive.material,
            (Geometry::Mesh(mesh), Surface::Primitive) => scene.meshes[mesh.index()].materials[0],
        };
        let paint = &scene.materials[material.index()];
        let mut albedo = paint.base_color;
        if let (Some(texture), Some(uv)) = (paint.base_color_texture, uv) {
            let image = &scene.textures[texture.texture.index()];
            albedo *= image.sample(texture.coordinates(uv));
            if let Surface::Triangle { index, .. } = hit.surface {
                textured = Some(index);
            }
        }
        Self {
            position: hit.position,
            origin: hit.leave(-direction),
            geometric_normal,
            shading_normal,
            to_viewer: -direction,
            distance: hit.t,
            albedo,
            emission: paint.emission,
            object: hit.object,
            material,
            textured,
        }
    }
}
