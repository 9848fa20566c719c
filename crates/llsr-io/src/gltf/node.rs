//! Nodes: where meshes, lights and cameras stand.

use std::f64::consts::PI;
use std::path::Path;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Vec3};
use gltf::json::Root;
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as PunctualLight, Type as LightType};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;
use llsr_scene::{
    AreaLight, AreaShape, Camera, FieldOfView, Geometry, LinearLight, MaterialId, MeshId, PointLight,
    Primitive, Projection, Shape, luminance,
};

use super::container::{Precise, PreciseNode};
use super::extras::{self, CameraExtras, NodeExtras};
use super::mesh::label;
use crate::error::Error;
use crate::import::{FARTHEST, Import, ImportObject};
use crate::warning::{WarningKind, Warnings};

/// Walks the default scene, each node once, and adds what it finds.
pub(super) fn read(
    path: &Path,
    root: &Root,
    precise: &Precise,
    meshes: &[Vec<MeshId>],
    default_material: MaterialId,
    import: &mut Import,
    warnings: &mut Warnings,
) -> Result<(), Error> {
    let mut visited = vec![false; root.nodes.len()];
    let mut walk = Walk {
        root,
        meshes,
        default_material,
        import,
        warnings,
    };
    // Depth first in the order of the file.
    let mut stack: Vec<(usize, DAffine3)> = walk
        .roots(path)?
        .into_iter()
        .rev()
        .map(|n| (n, DAffine3::IDENTITY))
        .collect();
    while let Some((index, parent)) = stack.pop() {
        let Some(node) = root.nodes.get(index) else {
            walk.warnings.add(WarningKind::BadPart, || {
                format!("node {index}, which does not exist")
            });
            continue;
        };
        if std::mem::replace(&mut visited[index], true) {
            walk.warnings.add(WarningKind::NodeGraph, || {
                label("node", index, node.name.as_deref())
            });
            continue;
        }
        let transform = precise
            .nodes
            .get(index)
            .map_or(DAffine3::IDENTITY, local_transform);
        let transform = parent * transform;
        walk.node(index, node, transform);
        stack.extend(
            node.children
                .iter()
                .flatten()
                .rev()
                .map(|child| (child.value(), transform)),
        );
    }
    Ok(())
}

/// A node's own transform in double precision.
fn local_transform(node: &PreciseNode) -> DAffine3 {
    if let Some(matrix) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(matrix));
    }
    // Files round quaternions to single precision.
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| {
        let q = DQuat::from_array(q);
        if q.length() > 0.0 && q.is_finite() {
            q.normalize()
        } else {
            DQuat::IDENTITY
        }
    });
    let scale = node.scale.map_or(DVec3::ONE, DVec3::from_array);
    let translation = node.translation.map_or(DVec3::ZERO, DVec3::from_array);
    DAffine3::from_scale_rotation_translation(scale, rotation, translation)
}

struct Walk<'a> {
    root: &'a Root,
    meshes: &'a [Vec<MeshId>],
    default_material: MaterialId,
    import: &'a mut Import,
    warnings: &'a mut Warnings,
}

impl Walk<'_> {
    /// The nodes that the shown scene starts from; without scenes, all that are nobody's children.
    fn roots(&mut self, path: &Path) -> Result<Vec<usize>, Error> {
        let scenes = &self.root.scenes;
        if scenes.is_empty() {
            let mut is_child = vec![false; self.root.nodes.len()];
            for child in self
                .root
                .nodes
                .iter()
                .flat_map(|node| node.children.iter().flatten())
            {
                if let Some(flag) = is_child.get_mut(child.value()) {
                    *flag = true;
                }
            }
            let roots = is_child
                .iter()
                .enumerate()
                .filter(|(_, is_child)| !**is_child)
                .map(|(index, _)| index);
            return Ok(roots.collect());
        }
        let shown = self.root.scene.map_or(0, |scene| scene.value());
        let scene = scenes.get(shown).ok_or_else(|| {
            Error::malformed(
                path,
                "scene",
                format!("is {shown}, but there are only {}", scenes.len()),
            )
        })?;
        for (index, other) in scenes.iter().enumerate().filter(|(index, _)| *index != shown) {
            self.warnings.add(WarningKind::OtherScenes, || {
                label("scene", index, other.name.as_deref())
            });
        }
        Ok(scene.nodes.iter().map(|node| node.value()).collect())
    }

    fn node(&mut self, index: usize, node: &Node, transform: DAffine3) {
        let place = label("node", index, node.name.as_deref());
        let own = match extras::read::<NodeExtras>(&node.extras) {
            Some(Ok(extras)) => Some(extras),
            Some(Err(cause)) => {
                self.warnings
                    .add(WarningKind::BadPart, || format!("{place}: {cause}"));
                None
            }
            None => None,
        };
        let light = node
            .extensions
            .as_ref()
            .and_then(|e| e.khr_lights_punctual.as_ref())
            .map(|l| l.light.value());
        let is_primitive = own.as_ref().is_some_and(|own| own.primitive.is_some());
        if node.mesh.is_none() && light.is_none() && node.camera.is_none() && !is_primitive {
            return;
        }
        if node.skin.is_some() {
            self.warnings.add(WarningKind::RestPose, || place.clone());
        }
        let invertible = transform.is_finite() && transform.inverse().is_finite();
        if !invertible || transform.translation.abs().max_element() > FARTHEST {
            self.warnings.add(WarningKind::BadTransform, || place);
            return;
        }
        let name = node.name.clone().unwrap_or_default();
        let primitive = own.as_ref().and_then(|own| own.primitive.as_ref());
        match (primitive, node.mesh) {
            (Some(primitive), mesh) => {
                self.primitive(
                    name.clone(),
                    Shape::from(primitive),
                    mesh.map(|m| m.value()),
                    transform,
                    &place,
                );
            }
            (None, Some(mesh)) => self.mesh(&name, mesh.value(), transform, &place),
            (None, None) => {}
        }
        if let Some(light) = light {
            self.light(&name, light, own, transform, &place);
        }
        if let Some(camera) = node.camera {
            self.camera(name, camera.value(), transform, &place);
        }
    }

    fn mesh(&mut self, name: &str, mesh: usize, transform: DAffine3, place: &str) {
        let Some(list) = self.meshes.get(mesh) else {
            self.warnings.add(WarningKind::BadPart, || {
                format!("{place}: there is no mesh {mesh}")
            });
            return;
        };
        for &id in list {
            let mesh_name = &self.import.meshes[id.index()].mesh.name;
            let name = if name.is_empty() {
                mesh_name.clone()
            } else {
                name.to_owned()
            };
            self.import.objects.push(ImportObject {
                name,
                geometry: Geometry::Mesh(id),
                transform,
            });
        }
    }

    /// An analytic primitive; its material is that of the mesh that stands for it elsewhere.
    fn primitive(
        &mut self,
        name: String,
        shape: Shape,
        mesh: Option<usize>,
        transform: DAffine3,
        place: &str,
    ) {
        if !shape.is_valid() {
            self.warnings.add(WarningKind::BadPart, || {
                format!("{place}: extras.llsr.primitive has unusable numbers")
            });
            return;
        }
        let material = mesh
            .and_then(|mesh| self.root.meshes.get(mesh)?.primitives.first()?.material)
            .filter(|material| material.value() < self.root.materials.len())
            .map_or_else(
                || self.default_material(),
                |material| MaterialId::from(material.value()),
            );
        let geometry = Geometry::Primitive(Primitive { shape, material });
        self.import.objects.push(ImportObject {
            name,
            geometry,
            transform,
        });
    }

    fn default_material(&mut self) -> MaterialId {
        if self.import.materials.len() == self.default_material.index() {
            self.import
                .materials
                .push(llsr_scene::Material::diffuse("", Vec3::splat(0.8)));
        }
        self.default_material
    }

    fn light(
        &mut self,
        node_name: &str,
        light: usize,
        own: Option<NodeExtras>,
        transform: DAffine3,
        place: &str,
    ) {
        let lights = self
            .root
            .extensions
            .as_ref()
            .and_then(|e| e.khr_lights_punctual.as_ref())
            .map(|l| &l.lights[..]);
        let Some(source) = lights.and_then(|lights| lights.get(light)) else {
            self.warnings.add(WarningKind::BadPart, || {
                format!("{place}: there is no light {light}")
            });
            return;
        };
        let name = match &source.name {
            _ if !node_name.is_empty() => node_name.to_owned(),
            Some(name) => name.clone(),
            None => String::new(),
        };
        if !matches!(source.type_, Checked::Valid(LightType::Point)) {
            self.warnings
                .add(WarningKind::UnsupportedLight, || place.to_owned());
            return;
        }
        let Some((flux, color)) = self.power(source, place) else {
            return;
        };
        let shared = match extras::read::<NodeExtras>(&source.extras) {
            Some(Ok(extras)) => extras,
            Some(Err(cause)) => {
                self.warnings.add(WarningKind::BadPart, || {
                    format!("{}: {cause}", label("light", light, None))
                });
                NodeExtras::default()
            }
            None => NodeExtras::default(),
        };
        // The node's entries go before those of the light, which nodes may share.
        let own = own.unwrap_or_default();
        let shape = own
            .rect
            .or(shared.rect)
            .map(Area::Rect)
            .or(own.disc.or(shared.disc).map(Area::Disc));
        if let Some(shape) = shape {
            let Some(shape) = shape.placed(transform) else {
                self.warnings.add(WarningKind::BadLight, || {
                    format!("{place}: rect or disc without an area")
                });
                return;
            };
            self.import.lights.push(
                AreaLight {
                    name,
                    shape,
                    flux,
                    color,
                }
                .into(),
            );
            return;
        }
        let Some(length) = own.length.or(shared.length) else {
            self.import.lights.push(
                PointLight {
                    name,
                    position: transform.translation,
                    flux,
                    color,
                }
                .into(),
            );
            return;
        };
        let half = if length.is_finite() && length >= 0.0 {
            0.5 * length
        } else {
            self.warnings
                .add(WarningKind::BadLight, || format!("{place}: length {length}"));
            return;
        };
        let [a, b] = [-half, half].map(|x| transform.transform_point3(DVec3::new(x, 0.0, 0.0)));
        let mut light = LinearLight::new(name, a, b, flux);
        light.color = color;
        light.emission = own.emission.or(shared.emission).unwrap_or_default().into();
        light.radius = own.radius.or(shared.radius).unwrap_or(0.0);
        self.import.add_linear(light, self.warnings);
    }

    /// Flux and colour of luminance 1; intensity is the mean over all directions.
    fn power(&mut self, source: &PunctualLight, place: &str) -> Option<(f64, Vec3)> {
        let intensity = f64::from(source.intensity);
        if !(intensity.is_finite() && intensity >= 0.0) {
            self.warnings.add(WarningKind::BadLight, || {
                format!("{place}: intensity {intensity}")
            });
            return None;
        }
        let color = Vec3::from_array(source.color);
        let brightness = luminance(color);
        let usable = color.is_finite() && color.min_element() >= 0.0 && brightness > 0.0;
        let color = if usable { color / brightness } else { Vec3::ONE };
        if !usable || !color.is_finite() {
            self.warnings.add(WarningKind::BadLight, || {
                format!("{place}: its colour became white")
            });
            return Some((4.0 * PI * intensity, Vec3::ONE));
        }
        Some((4.0 * PI * intensity, color))
    }

    fn camera(&mut self, node_name: String, camera: usize, transform: DAffine3, place: &str) {
        let projection = self.root.cameras.get(camera).and_then(|source| {
            let projection = match (source.type_, &source.perspective, &source.orthographic) {
                (Checked::Valid(CameraType::Perspective), Some(p), _) => {
                    let horizontal = match extras::read::<CameraExtras>(&source.extras) {
                        Some(Ok(extras)) => extras.horizontal,
                        _ => None,
                    };
                    let angle = horizontal.unwrap_or(f64::from(p.yfov));
                    let field = match horizontal {
                        Some(angle) => FieldOfView::Horizontal(angle),
                        None => FieldOfView::Vertical(angle),
                    };
                    (0.0 < angle && angle < PI).then_some(Projection::Perspective(field))
                }
                (Checked::Valid(CameraType::Orthographic), _, Some(o)) => {
                    // Some exporters write negative magnifications.
                    let height = 2.0 * f64::from(o.ymag.abs());
                    (0.0 < height && height < FARTHEST).then_some(Projection::Orthographic { height })
                }
                _ => None,
            };
            projection.map(|projection| (projection, source.name.clone()))
        });
        let Some((projection, name)) = projection else {
            self.warnings.add(WarningKind::BadCamera, || place.to_owned());
            return;
        };
        let name = if node_name.is_empty() {
            name.unwrap_or_default()
        } else {
            node_name
        };
        match upright_axes(transform.matrix3) {
            Some(axes) => {
                let position = transform.translation;
                self.import.cameras.push(Camera {
                    name,
                    position,
                    axes,
                    projection,
                });
            }
            None => self.warnings.add(WarningKind::BadCamera, || place.to_owned()),
        }
    }
}

/// Orthonormal right-handed axes that keep the third axis' direction and the second's side: scale, shear and mirrors go.
pub(super) fn upright_axes(matrix: DMat3) -> Option<DMat3> {
    let backward = matrix.z_axis.try_normalize()?;
    let right = matrix.y_axis.cross(backward).try_normalize()?;
    Some(DMat3::from_cols(right, backward.cross(right), backward))
}

/// The surface of an area light in its node's frame: it shines along the local -z axis.
enum Area {
    Rect([f64; 2]),
    Disc(f64),
}

impl Area {
    /// Its place in the file's frame; `None` if it has no area there.
    fn placed(&self, transform: DAffine3) -> Option<AreaShape> {
        let [x, y] = [DVec3::X, DVec3::Y].map(|axis| transform.transform_vector3(axis));
        let center = transform.translation;
        let facing = y.cross(x).try_normalize()?;
        match *self {
            Self::Rect([width, height]) => {
                let (along, across) = (y * height, x * width);
                // A shear is straightened: the sides of a rectangle are at right angles.
                let across = across - along * (across.dot(along) / along.length_squared());
                let area = along.cross(across).dot(facing);
                let corner = center - 0.5 * (along + across);
                (area.is_finite() && area > 0.0 && width > 0.0).then_some(AreaShape::Rect {
                    corner,
                    along,
                    across,
                })
            }
            Self::Disc(radius) => {
                let radius = radius * x.cross(y).length().sqrt();
                (radius.is_finite() && radius > 0.0).then_some(AreaShape::Disc {
                    center,
                    normal: facing,
                    radius,
                })
            }
        }
    }
}
