//! What the readers hand over, and how a scene is made of it: everything is placed in double precision first.

use std::collections::{HashMap, HashSet};

use glam::{DAffine3, DMat3, DVec3, Vec3};
use llsr_scene::{
    Bounds, Camera, Geometry, Light, LinearLight, Material, MaterialId, Mesh, MeshId, Object,
    PhotometricUnit, PointLight, Scene, Texture,
};

use crate::warning::{WarningKind, Warnings};

/// Coordinates beyond this many metres are taken for damage: nothing of a scene's detail is left there.
pub(crate) const FARTHEST: f64 = 1e15;

/// More lights than this are taken for damage.
pub(crate) const MOST_LIGHTS: usize = 1_000_000;

/// A mesh whose single-precision positions are relative to a point of its own frame.
#[derive(Debug)]
pub(crate) struct ImportMesh {
    pub(crate) mesh: Mesh,
    /// Own frame = position + center.
    pub(crate) center: DVec3,
}

/// A placed piece of geometry, in the file's frame.
#[derive(Clone, Debug)]
pub(crate) struct ImportObject {
    pub(crate) name: String,
    pub(crate) geometry: Geometry,
    /// Own frame (for a mesh: without its center) to the file's frame; finite and invertible.
    pub(crate) transform: DAffine3,
}

/// The contents of a file, in the file's frame.
#[derive(Debug, Default)]
pub(crate) struct Import {
    pub(crate) name: String,
    pub(crate) meshes: Vec<ImportMesh>,
    pub(crate) materials: Vec<Material>,
    pub(crate) textures: Vec<Texture>,
    pub(crate) objects: Vec<ImportObject>,
    pub(crate) lights: Vec<Light>,
    pub(crate) cameras: Vec<Camera>,
    /// Unit that the file states itself.
    pub(crate) unit: Option<PhotometricUnit>,
}

impl Import {
    /// Takes the lights' numbers through a last check and adds one; `place` names it in warnings.
    pub(crate) fn add_linear(&mut self, mut light: LinearLight, warnings: &mut Warnings) {
        let far = |p: DVec3| !p.is_finite() || p.abs().max_element() > FARTHEST;
        if far(light.a) || far(light.b) || !light.flux.is_finite() || light.flux < 0.0 {
            warnings.add(WarningKind::BadLight, || format!("light {:?}", light.name));
            return;
        }
        if !(light.radius.is_finite() && light.radius >= 0.0) {
            warnings.add(WarningKind::BadLight, || {
                format!("radius of light {:?}", light.name)
            });
            light.radius = 0.0;
        }
        if light.a == light.b {
            warnings.add(WarningKind::ShortLight, || format!("light {:?}", light.name));
            let LinearLight {
                name, a, flux, color, ..
            } = light;
            self.lights.push(
                PointLight {
                    name,
                    position: a,
                    flux,
                    color,
                }
                .into(),
            );
        } else {
            self.lights.push(light.into());
        }
    }

    /// Finishes the scene: moves its middle to the origin and rounds to single precision.
    pub(crate) fn into_scene(mut self, warnings: &mut Warnings) -> Scene {
        let bounds = self.drop_unplaceable(warnings);
        let origin = self.middle(&bounds);
        let uses = self.uses();
        let mut scene = Scene::new(self.name);
        scene.materials = self.materials;
        scene.textures = self.textures;
        scene.unit = self.unit.unwrap_or_default();
        scene.origin = origin;
        let mut meshes: Vec<Option<ImportMesh>> = self.meshes.into_iter().map(Some).collect();
        let mut placed = vec![None; meshes.len()];
        for object in self.objects {
            let mut transform = object.transform;
            transform.translation -= origin;
            let geometry = match object.geometry {
                Geometry::Primitive(_) => object.geometry,
                Geometry::Mesh(id) => {
                    if let Some(source) = meshes[id.index()].take() {
                        let mut mesh = source.mesh;
                        if uses[id.index()] == 1 {
                            bake(&mut mesh, source.center, &transform);
                        }
                        tidy(&mut mesh, warnings);
                        scene.meshes.push(mesh);
                        placed[id.index()] = Some((MeshId::from(scene.meshes.len() - 1), source.center));
                    }
                    let (mesh, center) = placed[id.index()].expect("set at the mesh's first use");
                    transform.translation += transform.matrix3 * center;
                    if uses[id.index()] == 1 {
                        transform = DAffine3::IDENTITY;
                    }
                    if scene.meshes[mesh.index()].triangles.is_empty() {
                        warnings.add(WarningKind::EmptyPart, || format!("{:?}", object.name));
                        continue;
                    }
                    Geometry::Mesh(mesh)
                }
            };
            let transform = transform.as_affine3().into();
            scene.add_object(Object {
                name: object.name,
                geometry,
                transform,
            });
        }
        name_apart(&mut self.lights);
        for mut light in self.lights {
            light.translate(-origin);
            scene.lights.push(light);
        }
        for mut camera in self.cameras {
            camera.position -= origin;
            scene.cameras.push(camera);
        }
        scene
    }

    /// Middle of the bounds of all geometry, of the lights if there is none.
    fn middle(&self, bounds: &[(DVec3, DVec3)]) -> DVec3 {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &(low, high) in bounds {
            min = min.min(low);
            max = max.max(high);
        }
        if !min.cmple(max).all() {
            for (a, b) in self.lights.iter().map(Light::ends) {
                min = min.min(a.min(b));
                max = max.max(a.max(b));
            }
        }
        let middle = 0.5 * min + 0.5 * max;
        if middle.is_finite() { middle } else { DVec3::ZERO }
    }
}

impl Import {
    /// Smallest and largest coordinates of each object in the file's frame: exact for meshes shown once, around the
    /// turned box for others.
    fn bounds(&self) -> Vec<(DVec3, DVec3)> {
        let mut boxes: Vec<Option<Bounds>> = vec![None; self.meshes.len()];
        let uses = self.uses();
        let around = |points: &mut dyn Iterator<Item = DVec3>| {
            points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
                (min.min(p), max.max(p))
            })
        };
        let objects = self.objects.iter();
        objects
            .map(|object| match object.geometry {
                Geometry::Mesh(id) => {
                    let source = &self.meshes[id.index()];
                    let start = object.transform.transform_point3(source.center);
                    let place = |p: Vec3| start + object.transform.matrix3 * p.as_dvec3();
                    if uses[id.index()] == 1 {
                        return around(&mut used_positions(&source.mesh).map(place));
                    }
                    let own =
                        boxes[id.index()].get_or_insert_with(|| Bounds::of(used_positions(&source.mesh)));
                    if own.is_empty() {
                        around(&mut std::iter::empty())
                    } else {
                        around(&mut own.corners().into_iter().map(place))
                    }
                }
                Geometry::Primitive(primitive) => {
                    let corners = primitive.shape.bounds().corners().into_iter();
                    around(&mut corners.map(|p| object.transform.transform_point3(p.as_dvec3())))
                }
            })
            .collect()
    }

    /// How many objects show each mesh.
    fn uses(&self) -> Vec<u32> {
        let mut uses = vec![0; self.meshes.len()];
        for object in &self.objects {
            if let Geometry::Mesh(mesh) = object.geometry {
                uses[mesh.index()] += 1;
            }
        }
        uses
    }

    /// Leaves out objects that single precision cannot hold, and returns the bounds of the others.
    fn drop_unplaceable(&mut self, warnings: &mut Warnings) -> Vec<(DVec3, DVec3)> {
        let mut kept = Vec::new();
        let mut all = self.bounds().into_iter();
        self.objects.retain(|object| {
            let (min, max) = all.next().expect("bounds for each object");
            let single = object.transform.as_affine3a();
            // An empty mesh has infinite bounds the wrong way round, and is dealt with later.
            let near = min.cmpgt(max).any() || min.abs().max(max.abs()).max_element() <= FARTHEST;
            let fits = near && single.is_finite() && single.inverse().is_finite();
            if fits {
                kept.push((min, max));
            } else {
                warnings.add(WarningKind::BadTransform, || format!("{:?}", object.name));
            }
            fits
        });
        kept
    }
}

/// Gives each light a name of its own, as `Scene::add_light` does, but in linear time.
fn name_apart(lights: &mut [Light]) {
    let mut numbers: HashMap<String, u32> = HashMap::new();
    let mut taken: HashSet<String> = HashSet::new();
    for light in lights {
        let name = match light {
            Light::Linear(light) => &mut light.name,
            Light::Point(light) => &mut light.name,
            Light::Area(light) => &mut light.name,
        };
        if name.is_empty() {
            "light".clone_into(name);
        }
        let base = name.clone();
        while !taken.insert(name.clone()) {
            let number = numbers.entry(base.clone()).or_insert(1);
            *number += 1;
            *name = format!("{base}-{number}");
        }
    }
}

fn used_positions(mesh: &Mesh) -> impl Iterator<Item = Vec3> {
    mesh.triangles
        .iter()
        .flatten()
        .map(|&v| mesh.positions[v as usize])
}

/// Moves a mesh that is shown once to where it is shown.
fn bake(mesh: &mut Mesh, center: DVec3, transform: &DAffine3) {
    let start = transform.transform_point3(center);
    for position in &mut mesh.positions {
        *position = (start + transform.matrix3 * position.as_dvec3()).as_vec3();
    }
    if transform.matrix3 != DMat3::IDENTITY {
        let to_normal = transform.matrix3.inverse().transpose();
        for normal in &mut mesh.normals {
            *normal = (to_normal * normal.as_dvec3()).normalize_or_zero().as_vec3();
        }
        // A mirror turns the front of a triangle to the back.
        if transform.matrix3.determinant() < 0.0 {
            for triangle in &mut mesh.triangles {
                triangle.swap(1, 2);
            }
        }
    }
}

/// Takes out collapsed triangles and unused vertices, and counts needles.
fn tidy(mesh: &mut Mesh, warnings: &mut Warnings) {
    let (mut collapsed, mut needles) = (0, 0);
    let positions = &mesh.positions;
    retain_triangles(&mut mesh.triangles, &mut mesh.materials, |triangle| {
        let [a, b, c] = triangle.map(|v| positions[v as usize]);
        if a == b || b == c || c == a {
            collapsed += 1;
            return false;
        }
        // Exact zero only: thin triangles are somebody's detail.
        let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
        needles += u64::from((b - a).cross(c - a) == DVec3::ZERO);
        true
    });
    warnings.add_many(WarningKind::CollapsedTriangle, collapsed, || {
        format!("mesh {:?}", mesh.name)
    });
    warnings.add_many(WarningKind::Needle, needles, || format!("mesh {:?}", mesh.name));
    drop_unused_vertices(mesh);
}

/// Keeps the triangles for which `keep` holds, and their materials.
pub(crate) fn retain_triangles(
    triangles: &mut Vec<[u32; 3]>,
    materials: &mut Vec<MaterialId>,
    mut keep: impl FnMut([u32; 3]) -> bool,
) {
    let mut kept = 0;
    for index in 0..triangles.len() {
        if keep(triangles[index]) {
            triangles[kept] = triangles[index];
            materials[kept] = materials[index];
            kept += 1;
        }
    }
    triangles.truncate(kept);
    materials.truncate(kept);
}

/// Renumbers the vertices so that only those of triangles are left.
pub(crate) fn drop_unused_vertices(mesh: &mut Mesh) {
    const UNUSED: u32 = u32::MAX;
    let mut number = vec![UNUSED; mesh.positions.len()];
    for &v in mesh.triangles.iter().flatten() {
        number[v as usize] = 0;
    }
    if !number.contains(&UNUSED) {
        return;
    }
    for (n, next) in number.iter_mut().filter(|n| **n != UNUSED).zip(0..) {
        *n = next;
    }
    fn keep<T>(list: &mut Vec<T>, number: &[u32]) {
        let mut index = 0;
        list.retain(|_| {
            index += 1;
            number[index - 1] != UNUSED
        });
    }
    keep(&mut mesh.positions, &number);
    keep(&mut mesh.normals, &number);
    keep(&mut mesh.uvs, &number);
    for v in mesh.triangles.iter_mut().flatten() {
        *v = number[*v as usize];
    }
}
