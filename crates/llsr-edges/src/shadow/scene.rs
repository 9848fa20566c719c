//! What casts and receives shadows, and where it stands.

use std::sync::Arc;

use glam::{Affine3A, DAffine3, DVec3};
use llsr_scene::{Bounds, Geometry, Light, LightId, Mesh, MeshId, ObjectId, Scene, Shape};

use super::light::ShadowLight;
use super::mesh::ShadowMesh;
use super::tessellate::tessellate;
use crate::view::double;
use crate::{EdgeOptions, MeshEdges};

/// How a scene is prepared for shadows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowOptions {
    /// How the edges of its meshes are prepared.
    pub edges: EdgeOptions,
    /// How far the mesh that stands for an analytic primitive may lie from its surface, relative to the diagonal of
    /// the scene's box. A shadow edge is off by about as much, more where the shadow is larger than what casts it.
    pub primitive_tolerance: f32,
}

impl Default for ShadowOptions {
    fn default() -> Self {
        Self {
            edges: EdgeOptions::default(),
            primitive_tolerance: 2e-5,
        }
    }
}

/// An object that casts and receives shadows.
#[derive(Clone, Debug)]
pub struct ShadowObject {
    pub(super) mesh: Arc<ShadowMesh>,
    pub(super) to_world: DAffine3,
    pub(super) to_object: DAffine3,
    pub(super) bounds: Bounds,
}

impl ShadowObject {
    /// Places a mesh. `None` if the transform has no inverse or is not finite.
    pub fn new(mesh: Arc<ShadowMesh>, transform: Affine3A) -> Option<Self> {
        let to_world = double(&transform);
        let to_object = to_world.inverse();
        if !(to_world.is_finite() && to_object.is_finite()) {
            return None;
        }
        let bounds = mesh.edges().bounds();
        let bounds = if bounds.is_empty() {
            bounds
        } else {
            Bounds::of(bounds.corners().map(|p| transform.transform_point3(p)))
        };
        Some(Self {
            mesh,
            to_world,
            to_object,
            bounds,
        })
    }

    /// Its mesh.
    pub fn mesh(&self) -> &Arc<ShadowMesh> {
        &self.mesh
    }

    /// A box around it in the scene's frame (m).
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }
}

fn of_primitive(shape: &Shape, tolerance: f32, options: EdgeOptions) -> Option<Arc<ShadowMesh>> {
    if !shape.is_valid() {
        return None;
    }
    let edges = MeshEdges::new(&tessellate(shape, tolerance), options).ok()?;
    Some(Arc::new(ShadowMesh::new(Arc::new(edges))))
}

/// The objects and lights of a scene, ready for shadow edges.
///
/// Moving an object or a light is a matter of nanoseconds: trees are in the objects' own frames, and events are
/// brought there.
#[derive(Clone, Debug, Default)]
pub struct ShadowScene {
    objects: Vec<Option<ShadowObject>>,
    lights: Vec<ShadowLight>,
}

impl ShadowScene {
    /// Prepares all meshes, primitives and lights of `scene`.
    ///
    /// Objects with an invalid mesh or primitive, or with a transform without inverse, cast and receive nothing;
    /// their ids are returned too. Meshes that several objects share are prepared once. Cost: that of
    /// [`MeshEdges::new`] and [`ShadowMesh::new`] for each mesh.
    pub fn new(scene: &Scene, options: ShadowOptions) -> (Self, Vec<ObjectId>) {
        let mut edges: Vec<Option<Arc<MeshEdges>>> = vec![None; scene.meshes.len()];
        let of_mesh = |id: MeshId, mesh: &Mesh| {
            let slot = &mut edges[id.index()];
            if slot.is_none() {
                *slot = MeshEdges::new(mesh, options.edges).ok().map(Arc::new);
            }
            slot.clone()
        };
        Self::with_edges(scene, options, of_mesh)
    }

    /// The same with edges that exist already: `edges` gives those of a mesh, or `None` to leave it out.
    pub fn with_edges(
        scene: &Scene,
        options: ShadowOptions,
        mut edges: impl FnMut(MeshId, &Mesh) -> Option<Arc<MeshEdges>>,
    ) -> (Self, Vec<ObjectId>) {
        let mut meshes: Vec<Option<Arc<ShadowMesh>>> = vec![None; scene.meshes.len()];
        let mut left_out = Vec::new();
        let tolerance = options.primitive_tolerance * scene.bounds().diagonal();
        let mut objects = Vec::with_capacity(scene.objects.len());
        for (index, object) in scene.objects.iter().enumerate() {
            let mesh = match object.geometry {
                Geometry::Mesh(id) => scene.meshes.get(id.index()).and_then(|mesh| {
                    let slot = &mut meshes[id.index()];
                    if slot.is_none() {
                        *slot = edges(id, mesh).map(|edges| Arc::new(ShadowMesh::new(edges)));
                    }
                    slot.clone()
                }),
                Geometry::Primitive(primitive) => {
                    // In the object's own frame lengths differ by the transform's scale.
                    let linear = object.transform.matrix3;
                    let scale = [linear.x_axis, linear.y_axis, linear.z_axis]
                        .map(|axis| axis.length())
                        .into_iter()
                        .fold(f32::MIN_POSITIVE, f32::max);
                    of_primitive(&primitive.shape, tolerance / scale, options.edges)
                }
            };
            let placed = mesh.and_then(|mesh| ShadowObject::new(mesh, object.transform));
            if placed.is_none() {
                left_out.push(ObjectId::from(index));
            }
            objects.push(placed);
        }
        let lights = scene.lights.iter().map(ShadowLight::new).collect();
        (Self { objects, lights }, left_out)
    }

    /// A scene of given objects and lights; `None` stands for an object that takes no part.
    pub fn from_parts(objects: Vec<Option<ShadowObject>>, lights: Vec<ShadowLight>) -> Self {
        Self { objects, lights }
    }

    /// The object of that id, if it takes part.
    pub fn object(&self, id: ObjectId) -> Option<&ShadowObject> {
        self.objects.get(id.index())?.as_ref()
    }

    /// The light of that id, if it exists.
    pub fn light(&self, id: LightId) -> Option<&ShadowLight> {
        self.lights.get(id.index())
    }

    /// Ids of the objects that take part.
    pub fn objects(&self) -> impl Iterator<Item = ObjectId> {
        (0..self.objects.len())
            .filter(|&i| self.objects[i].is_some())
            .map(ObjectId::from)
    }

    /// Ids of the lights.
    pub fn lights(&self) -> impl Iterator<Item = LightId> {
        (0..self.lights.len()).map(LightId::from)
    }

    /// Places an object anew. False, and nothing is changed, if it takes no part or the transform has no inverse.
    ///
    /// Tell [`ShadowEdges::object_moved`](super::ShadowEdges::object_moved).
    pub fn move_object(&mut self, id: ObjectId, transform: Affine3A) -> bool {
        let Some(slot @ Some(_)) = self.objects.get_mut(id.index()) else {
            return false;
        };
        let moved = slot
            .as_ref()
            .and_then(|object| ShadowObject::new(object.mesh.clone(), transform));
        if moved.is_some() {
            *slot = moved;
            return true;
        }
        false
    }

    /// Replaces a light. False if there is none of that id.
    ///
    /// Tell [`ShadowEdges::light_moved`](super::ShadowEdges::light_moved).
    pub fn move_light(&mut self, id: LightId, light: &Light) -> bool {
        self.lights
            .get_mut(id.index())
            .map(|slot| *slot = ShadowLight::new(light))
            .is_some()
    }

    /// Diagonal of the box around all objects (m).
    pub fn size(&self) -> f32 {
        let all = self.objects.iter().flatten().map(|object| object.bounds);
        all.fold(Bounds::EMPTY, Bounds::union).diagonal()
    }
}

/// True if the box around the light's corners, in the frame of an object, does not touch the object's box.
pub(super) fn is_outside(object: &ShadowObject, corners: &[DVec3]) -> bool {
    let bounds = object.mesh.edges().bounds();
    let (low, high) = corners
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| {
            (low.min(p), high.max(p))
        });
    low.cmpgt(bounds.max.as_dvec3()).any() || high.cmplt(bounds.min.as_dvec3()).any()
}
