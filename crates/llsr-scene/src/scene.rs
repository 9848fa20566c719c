//! The scene: lists of meshes, materials, objects, lights and cameras.

use glam::{Affine3A, DVec3, Vec3, Vec3A};

use crate::{
    Bounds, Camera, Light, Material, MaterialId, Mesh, MeshId, ObjectId, PhotometricUnit, Primitive, Texture,
    TextureId,
};

/// What an object is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Geometry {
    /// A mesh of the scene; several objects may share it.
    Mesh(MeshId),
    /// An analytic primitive.
    Primitive(Primitive),
}

/// A placed piece of geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name in the file; may be empty.
    pub name: String,
    /// Its geometry, in its own frame.
    pub geometry: Geometry,
    /// Maps its own frame to the scene's recentred frame; invertible.
    pub transform: Affine3A,
}

/// Everything a renderer needs to know.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for reports.
    pub name: String,
    /// Meshes, shared by objects.
    pub meshes: Vec<Mesh>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Textures.
    pub textures: Vec<Texture>,
    /// Placed geometry.
    pub objects: Vec<Object>,
    /// Lights.
    pub lights: Vec<Light>,
    /// Cameras; the first is the default.
    pub cameras: Vec<Camera>,
    /// Unit of all fluxes.
    pub unit: PhotometricUnit,
    /// Where the recentred frame's origin lies in the file's frame (m): file = recentred + origin.
    pub origin: DVec3,
}

impl Scene {
    /// An empty scene.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }

    /// Adds a material.
    pub fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId::from(self.materials.len() - 1)
    }

    /// The base colour of a material with the [typical colour](Texture::typical) of its texture.
    ///
    /// # Panics
    /// If the material names a texture that the scene does not have.
    pub fn plain_albedo(&self, material: &Material) -> Vec3 {
        let texture = material.base_color_texture.as_ref();
        let typical = texture.map_or(Vec3::ONE, |texture| {
            self.textures[texture.texture.index()].typical()
        });
        material.base_color * typical
    }

    /// Adds a texture.
    pub fn add_texture(&mut self, texture: Texture) -> TextureId {
        self.textures.push(texture);
        TextureId::from(self.textures.len() - 1)
    }

    /// Adds a mesh and an untransformed object of the same name that shows it.
    pub fn add_mesh(&mut self, mesh: Mesh) -> ObjectId {
        let name = mesh.name.clone();
        self.meshes.push(mesh);
        let geometry = Geometry::Mesh(MeshId::from(self.meshes.len() - 1));
        self.add_object(Object {
            name,
            geometry,
            transform: Affine3A::IDENTITY,
        })
    }

    /// Adds an untransformed primitive.
    pub fn add_primitive(&mut self, name: impl Into<String>, primitive: Primitive) -> ObjectId {
        self.add_object(Object {
            name: name.into(),
            geometry: Geometry::Primitive(primitive),
            transform: Affine3A::IDENTITY,
        })
    }

    /// Adds an object.
    pub fn add_object(&mut self, object: Object) -> ObjectId {
        self.objects.push(object);
        ObjectId::from(self.objects.len() - 1)
    }

    /// Adds a light; an empty name or one in use already gets a number, so that layers of a picture can be told
    /// apart.
    pub fn add_light(&mut self, light: impl Into<Light>) {
        let mut light = light.into();
        let base = if light.name().is_empty() {
            "light".to_owned()
        } else {
            light.name().to_owned()
        };
        let mut name = base.clone();
        let mut number = 1;
        while self.lights.iter().any(|other| other.name() == name) {
            number += 1;
            name = format!("{base}-{number}");
        }
        *light.name_mut() = name;
        self.lights.push(light);
    }

    /// Number of triangles that a camera could see: shared meshes count once for each object.
    pub fn triangle_count(&self) -> usize {
        self.objects
            .iter()
            .map(|object| match object.geometry {
                Geometry::Mesh(mesh) => self.meshes[mesh.index()].triangles.len(),
                Geometry::Primitive(_) => 0,
            })
            .sum()
    }

    /// Number of analytic primitives.
    pub fn primitive_count(&self) -> usize {
        self.objects
            .iter()
            .filter(|object| matches!(object.geometry, Geometry::Primitive(_)))
            .count()
    }

    /// Bounding box of an object in the recentred frame; for a rotated primitive it may be larger than needed.
    ///
    /// # Panics
    /// If there is no such object or mesh.
    pub fn object_bounds(&self, id: ObjectId) -> Bounds {
        let object = &self.objects[id.index()];
        match object.geometry {
            Geometry::Mesh(mesh) => {
                let positions = &self.meshes[mesh.index()].positions;
                Bounds::of(positions.iter().map(|&p| object.transform.transform_point3(p)))
            }
            Geometry::Primitive(primitive) => {
                let corners = primitive.shape.bounds().corners();
                Bounds::of(corners.map(|p| object.transform.transform_point3(p)))
            }
        }
    }

    /// Bounding box of all geometry in the recentred frame; lights do not count.
    pub fn bounds(&self) -> Bounds {
        (0..self.objects.len()).fold(Bounds::EMPTY, |b, i| {
            b.union(self.object_bounds(ObjectId::from(i)))
        })
    }

    /// Moves everything so that the middle of the geometry's bounds (of the lights', without geometry) is the
    /// origin, and keeps the way back in [`origin`](Self::origin).
    pub fn recenter(&mut self) {
        let bounds = self.bounds();
        let center = if bounds.is_empty() {
            let ends = self
                .lights
                .iter()
                .flat_map(|light| <[DVec3; 2]>::from(light.ends()));
            Bounds::of(ends.map(|p| p.as_vec3())).center()
        } else {
            bounds.center()
        };
        if !center.is_finite() || center == Vec3::ZERO {
            return;
        }
        for object in &mut self.objects {
            object.transform.translation -= Vec3A::from(center);
        }
        let offset = -center.as_dvec3();
        for light in &mut self.lights {
            light.translate(offset);
        }
        for camera in &mut self.cameras {
            camera.position += offset;
        }
        self.origin += center.as_dvec3();
    }
}
