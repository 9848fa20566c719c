//! Writing scenes.

use std::f64::consts::PI;
use std::io::Cursor;
use std::path::Path;

use base64::Engine as _;
use glam::{DMat3, DQuat, DVec3, Mat3, Vec3};
use image::{ExtendedColorType, ImageEncoder as _};
use llsr_scene::{
    AreaShape, Camera, FieldOfView, Geometry, Light, Material, Mesh, PhotometricUnit, Projection, Scene,
    Texture, TextureUse, Wrap,
};
use serde_json::{Map, Value, json};

use super::extras::{AssetExtras, CameraExtras, NodeExtras, PrimitiveExtras, Unit};
use super::tessellate::tessellate;
use crate::error::Error;
use crate::files;

const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;

/// Writes a scene as glTF 2.0, in the file's frame that [`Scene::origin`] leads back to: text with everything embedded for
/// `.gltf`, binary for `.glb`.
///
/// [`load_scene`](crate::load_scene) reads all of it back. Linear lights are `KHR_lights_punctual` point lights with
/// `extras.llsr` (length, emission, radius); analytic primitives are tessellated meshes with `extras.llsr.primitive` beside
/// them, which replaces the mesh on reading. Other programs see point lights and meshes. Triangles of a mesh with
/// several materials are sorted by material.
///
/// The file takes its name only when it is complete; the same scene gives the same bytes.
///
/// # Errors
/// If the ending is neither `.gltf` nor `.glb`, a mesh is not [valid](Mesh::is_valid), a texture transform has a
/// shear, the data do not fit into 4 GiB, or the file cannot be written.
pub fn write_gltf(path: &Path, scene: &Scene) -> Result<(), Error> {
    let ending = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_ascii_lowercase();
    let binary = match ending.as_str() {
        "glb" => true,
        "gltf" => false,
        _ => {
            let (what, use_instead) = ("scenes to write", ".gltf or .glb");
            return Err(Error::Ending {
                path: path.to_owned(),
                what,
                ending,
                use_instead,
            });
        }
    };
    let mut document = Document {
        path,
        json: Map::new(),
        lists: Map::new(),
        bytes: Vec::new(),
        uses: Vec::new(),
    };
    document.scene(scene)?;
    let (json, bytes) = document.finish(scene, binary);
    files::write_atomically(path, |writer| {
        if !binary {
            serde_json::to_writer_pretty(&mut *writer, &json)?;
            return writer.write_all(b"\n");
        }
        let glb = gltf::Glb {
            header: gltf::binary::Header {
                magic: *b"glTF",
                version: 2,
                length: 0,
            },
            json: serde_json::to_vec(&json)?.into(),
            bin: (!bytes.is_empty()).then(|| bytes.as_slice().into()),
        };
        glb.to_writer(writer)
            .map_err(|error| std::io::Error::other(error.to_string()))
    })
}

struct Document<'a> {
    path: &'a Path,
    json: Map<String, Value>,
    /// Top-level arrays.
    lists: Map<String, Value>,
    bytes: Vec<u8>,
    /// Extensions in use.
    uses: Vec<&'static str>,
}

impl Document<'_> {
    /// Appends to a top-level array; the position there.
    fn push(&mut self, list: &str, value: Value) -> usize {
        let entry = self.lists.entry(list).or_insert_with(|| Value::Array(Vec::new()));
        match entry {
            Value::Array(values) => {
                values.push(value);
                values.len() - 1
            }
            _ => unreachable!("all lists are arrays"),
        }
    }

    fn use_extension(&mut self, name: &'static str) {
        if !self.uses.contains(&name) {
            self.uses.push(name);
        }
    }

    fn scene(&mut self, scene: &Scene) -> Result<(), Error> {
        for texture in &scene.textures {
            self.texture(texture)?;
        }
        for material in &scene.materials {
            self.material(material)?;
        }
        let mut mesh_numbers = Vec::new();
        for mesh in &scene.meshes {
            if !mesh.is_valid() {
                let cause = format!(
                    "mesh {:?} has lists that do not fit together or numbers that are not finite",
                    mesh.name
                );
                return Err(Error::unwritable(self.path, cause));
            }
            // The format has no empty meshes.
            mesh_numbers.push(if mesh.triangles.is_empty() {
                None
            } else {
                Some(self.mesh(mesh)?)
            });
        }
        let mut nodes = Vec::new();
        for object in &scene.objects {
            let mut node = named(&object.name);
            match object.geometry {
                Geometry::Mesh(id) => match mesh_numbers[id.index()] {
                    Some(mesh) => node.insert("mesh".to_owned(), json!(mesh)),
                    None => continue,
                },
                Geometry::Primitive(primitive) => {
                    let mesh = self.mesh(&tessellate(&primitive.shape, primitive.material))?;
                    node.insert("mesh".to_owned(), json!(mesh));
                    let shape = Some(PrimitiveExtras::from(&primitive.shape));
                    insert_extras(
                        &mut node,
                        &NodeExtras {
                            primitive: shape,
                            ..NodeExtras::default()
                        },
                    )
                }
            };
            let transform = object.transform;
            if transform.matrix3 != glam::Mat3A::IDENTITY {
                let columns = glam::Mat4::from(transform).to_cols_array().map(short);
                node.insert("matrix".to_owned(), json!(columns));
            } else if transform.translation != glam::Vec3A::ZERO {
                node.insert(
                    "translation".to_owned(),
                    json!(transform.translation.to_array().map(short)),
                );
            }
            nodes.push(self.push("nodes", node.into()));
        }
        let mut lights = Vec::new();
        for light in &scene.lights {
            nodes.push(self.light(light, &mut lights));
        }
        for camera in &scene.cameras {
            nodes.push(self.camera(camera));
        }
        if !lights.is_empty() {
            self.use_extension("KHR_lights_punctual");
            self.json.insert(
                "extensions".to_owned(),
                json!({ "KHR_lights_punctual": { "lights": lights } }),
            );
        }
        if scene.origin != DVec3::ZERO && !nodes.is_empty() {
            let mut origin = named("origin");
            origin.insert("translation".to_owned(), json!(scene.origin.to_array()));
            origin.insert("children".to_owned(), json!(nodes));
            nodes = vec![self.push("nodes", origin.into())];
        }
        let mut shown = named(&scene.name);
        shown.insert("nodes".to_owned(), json!(nodes));
        self.push("scenes", shown.into());
        Ok(())
    }

    /// Appends bytes as a view; its number.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    fn accessor(&mut self, bytes: &[u8], count: usize, shape: &str, bounds: Option<[Vec3; 2]>) -> usize {
        let is_index = shape == "SCALAR";
        let view = self.view(
            bytes,
            Some(if is_index {
                ELEMENT_ARRAY_BUFFER
            } else {
                ARRAY_BUFFER
            }),
        );
        let component = if is_index { UNSIGNED_INT } else { FLOAT };
        let mut accessor =
            json!({ "bufferView": view, "componentType": component, "count": count, "type": shape });
        if let Some([min, max]) = bounds {
            accessor["min"] = json!(min.to_array().map(short));
            accessor["max"] = json!(max.to_array().map(short));
        }
        self.push("accessors", accessor)
    }

    fn mesh(&mut self, mesh: &Mesh) -> Result<usize, Error> {
        let floats =
            |numbers: &mut dyn Iterator<Item = f32>| numbers.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
        let bounds = mesh.bounds();
        let count = mesh.positions.len();
        let positions = floats(&mut mesh.positions.iter().flat_map(|p| p.to_array()));
        let mut attributes = Map::new();
        let number = self.accessor(&positions, count, "VEC3", Some([bounds.min, bounds.max]));
        attributes.insert("POSITION".to_owned(), json!(number));
        if !mesh.normals.is_empty() {
            let normals = floats(&mut mesh.normals.iter().flat_map(|n| n.to_array()));
            attributes.insert(
                "NORMAL".to_owned(),
                json!(self.accessor(&normals, count, "VEC3", None)),
            );
        }
        if !mesh.uvs.is_empty() {
            let uvs = floats(&mut mesh.uvs.iter().flat_map(|uv| uv.to_array()));
            attributes.insert(
                "TEXCOORD_0".to_owned(),
                json!(self.accessor(&uvs, count, "VEC2", None)),
            );
        }
        let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        order.sort_by_key(|&t| mesh.materials[t as usize]);
        let mut primitives = Vec::new();
        for run in order.chunk_by(|&a, &b| mesh.materials[a as usize] == mesh.materials[b as usize]) {
            let indices = run
                .iter()
                .flat_map(|&t| mesh.triangles[t as usize])
                .flat_map(u32::to_le_bytes);
            let indices = self.accessor(&indices.collect::<Vec<u8>>(), 3 * run.len(), "SCALAR", None);
            let material = mesh.materials[run[0] as usize].0;
            primitives.push(json!({ "attributes": attributes, "indices": indices, "material": material }));
        }
        self.check_size()?;
        let mut json = named(&mesh.name);
        json.insert("primitives".to_owned(), primitives.into());
        Ok(self.push("meshes", json.into()))
    }

    /// Lengths in the binary format have 32 bits.
    fn check_size(&self) -> Result<(), Error> {
        if self.bytes.len() as u64 > (u64::from(u32::MAX) - (256 << 20)) {
            return Err(Error::unwritable(
                self.path,
                "its data do not fit into the format's 4 GiB",
            ));
        }
        Ok(())
    }

    fn texture(&mut self, texture: &Texture) -> Result<(), Error> {
        let mut png = Vec::new();
        let pixels = texture.pixels.as_flattened();
        image::codecs::png::PngEncoder::new(Cursor::new(&mut png))
            .write_image(pixels, texture.width, texture.height, ExtendedColorType::Rgb8)
            .map_err(|error| Error::unwritable(self.path, format!("texture {:?}: {error}", texture.name)))?;
        let view = self.view(&png, None);
        self.check_size()?;
        let mut image = named(&texture.name);
        image.insert("bufferView".to_owned(), json!(view));
        image.insert("mimeType".to_owned(), json!("image/png"));
        let image = self.push("images", image.into());
        let [s, t] = texture.wrap.map(|wrap| match wrap {
            Wrap::Repeat => 10_497,
            Wrap::Mirror => 33_648,
            Wrap::Clamp => 33_071,
        });
        let sampler = self.push("samplers", json!({ "wrapS": s, "wrapT": t }));
        self.push("textures", json!({ "source": image, "sampler": sampler }));
        Ok(())
    }

    fn material(&mut self, material: &Material) -> Result<(), Error> {
        let color = material.base_color;
        let mut pbr = json!({
            "baseColorFactor": [short(color.x), short(color.y), short(color.z), 1.0],
            "metallicFactor": short(material.metallic),
            "roughnessFactor": short(material.roughness),
        });
        if let Some(texture) = &material.base_color_texture {
            pbr["baseColorTexture"] = self.texture_use(texture, &material.name)?;
        }
        let mut json = named(&material.name);
        json.insert("pbrMetallicRoughness".to_owned(), pbr);
        json.insert("doubleSided".to_owned(), json!(true));
        let strongest = material.emission.max_element();
        if strongest > 1.0 {
            let factor = (material.emission / strongest).to_array().map(short);
            json.insert("emissiveFactor".to_owned(), json!(factor));
            self.use_extension("KHR_materials_emissive_strength");
            let strength =
                json!({ "KHR_materials_emissive_strength": { "emissiveStrength": short(strongest) } });
            json.insert("extensions".to_owned(), strength);
        } else if strongest > 0.0 {
            json.insert(
                "emissiveFactor".to_owned(),
                json!(material.emission.to_array().map(short)),
            );
        }
        self.push("materials", json.into());
        Ok(())
    }

    fn texture_use(&mut self, texture: &TextureUse, material: &str) -> Result<Value, Error> {
        let mut info = json!({ "index": texture.texture.0 });
        if texture.transform == Mat3::IDENTITY {
            return Ok(info);
        }
        // The inverse of what the reader composes: scaled, turned, moved.
        let m = texture.transform;
        let (u, v) = (m.x_axis.truncate(), m.y_axis.truncate());
        let scale_u = u.length();
        let rotation = (-u.y).atan2(u.x);
        let (sin, cos) = rotation.sin_cos();
        let scale_v = v.dot(glam::Vec2::new(sin, cos));
        let skew = v.dot(glam::Vec2::new(cos, -sin)).abs();
        if skew > 1e-4 * v.length() || !m.is_finite() {
            let cause = format!("the texture transform of material {material:?} has a shear");
            return Err(Error::unwritable(self.path, cause));
        }
        self.use_extension("KHR_texture_transform");
        info["extensions"] = json!({ "KHR_texture_transform": {
            "offset": [short(m.z_axis.x), short(m.z_axis.y)],
            "rotation": short(rotation),
            "scale": [short(scale_u), short(scale_v)],
        }});
        Ok(info)
    }

    /// Adds a light to `lights` and a node for it; the node's number.
    fn light(&mut self, light: &Light, lights: &mut Vec<Value>) -> usize {
        let color = light.color();
        let color = color / color.max_element().max(f32::MIN_POSITIVE);
        let mut node = named(light.name());
        match light {
            Light::Point(light) => {
                node.insert("translation".to_owned(), json!(light.position.to_array()));
            }
            Light::Linear(light) => {
                let (a, b) = (light.a, light.b);
                node.insert("translation".to_owned(), json!((0.5 * (a + b)).to_array()));
                let axis = (b - a).normalize_or(DVec3::X);
                let rotation = DQuat::from_rotation_arc(DVec3::X, axis);
                node.insert("rotation".to_owned(), json!(rotation.to_array()));
                let extras = NodeExtras {
                    length: Some(light.length()),
                    emission: Some(light.emission.into()),
                    radius: Some(light.radius),
                    ..NodeExtras::default()
                };
                insert_extras(&mut node, &extras);
            }
            Light::Area(light) => {
                let (center, x, facing, extras) = match light.shape {
                    AreaShape::Rect {
                        corner,
                        along,
                        across,
                    } => {
                        let sides = Some([across.length(), along.length()]);
                        let extras = NodeExtras {
                            rect: sides,
                            ..NodeExtras::default()
                        };
                        let center = corner + 0.5 * (along + across);
                        (center, across.normalize_or(DVec3::X), along.cross(across), extras)
                    }
                    AreaShape::Disc {
                        center,
                        normal,
                        radius,
                    } => {
                        let extras = NodeExtras {
                            disc: Some(radius),
                            ..NodeExtras::default()
                        };
                        (center, normal.any_orthonormal_vector(), normal, extras)
                    }
                };
                let z = -facing.normalize_or(-DVec3::Z);
                let rotation = DQuat::from_mat3(&glam::DMat3::from_cols(x, z.cross(x), z));
                node.insert("translation".to_owned(), json!(center.to_array()));
                node.insert("rotation".to_owned(), json!(rotation.to_array()));
                insert_extras(&mut node, &extras);
            }
        }
        lights.push(json!({
            "type": "point",
            "name": light.name(),
            "color": color.to_array().map(short),
            "intensity": light.flux() / (4.0 * PI),
        }));
        let number = lights.len() - 1;
        node.insert(
            "extensions".to_owned(),
            json!({ "KHR_lights_punctual": { "light": number } }),
        );
        self.push("nodes", node.into())
    }

    /// Adds a camera and a node for it; the node's number.
    fn camera(&mut self, camera: &Camera) -> usize {
        let mut json = named(&camera.name);
        match camera.projection {
            Projection::Perspective(field) => {
                let angle = match field {
                    FieldOfView::Vertical(angle) => angle,
                    FieldOfView::Horizontal(angle) => {
                        // The format knows vertical angles only; this one is right for a square picture.
                        insert_extras(
                            &mut json,
                            &CameraExtras {
                                horizontal: Some(angle),
                            },
                        );
                        angle
                    }
                };
                json.insert("type".to_owned(), json!("perspective"));
                json.insert("perspective".to_owned(), json!({ "yfov": angle, "znear": 0.01 }));
            }
            Projection::Orthographic { height } => {
                let half = 0.5 * height;
                json.insert("type".to_owned(), json!("orthographic"));
                let lens = json!({ "xmag": half, "ymag": half, "znear": 0.01, "zfar": 1e5 });
                json.insert("orthographic".to_owned(), lens);
            }
        }
        let number = self.push("cameras", json.into());
        let mut node = named(&camera.name);
        node.insert("camera".to_owned(), json!(number));
        node.insert("translation".to_owned(), json!(camera.position.to_array()));
        if camera.axes != DMat3::IDENTITY {
            node.insert(
                "rotation".to_owned(),
                json!(DQuat::from_mat3(&camera.axes).to_array()),
            );
        }
        self.push("nodes", node.into())
    }

    /// The whole document and the binary chunk, which is empty for text.
    fn finish(mut self, scene: &Scene, binary: bool) -> (Value, Vec<u8>) {
        let mut asset = Map::new();
        asset.insert("version".to_owned(), json!("2.0"));
        asset.insert("generator".to_owned(), json!("llsr"));
        if scene.unit == PhotometricUnit::Radiant {
            insert_extras(
                &mut asset,
                &AssetExtras {
                    unit: Some(Unit::Radiant),
                },
            );
        }
        self.json.insert("asset".to_owned(), asset.into());
        self.json.insert("scene".to_owned(), json!(0));
        self.json.append(&mut self.lists);
        if !self.uses.is_empty() {
            self.json.insert("extensionsUsed".to_owned(), json!(self.uses));
        }
        if !self.bytes.is_empty() {
            let mut buffer = json!({ "byteLength": self.bytes.len() });
            if !binary {
                let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
                buffer["uri"] = json!(format!("data:application/octet-stream;base64,{data}"));
            }
            self.json.insert("buffers".to_owned(), json!([buffer]));
        }
        (self.json.into(), self.bytes)
    }
}

/// An object with a name, if there is one.
fn named(name: &str) -> Map<String, Value> {
    let mut map = Map::new();
    if !name.is_empty() {
        map.insert("name".to_owned(), json!(name));
    }
    map
}

fn insert_extras(target: &mut Map<String, Value>, extras: &impl serde::Serialize) -> Option<Value> {
    let extras = serde_json::to_value(extras).expect("plain numbers and names");
    target.insert("extras".to_owned(), json!({ "llsr": extras }))
}

/// The double with the shortest text that gives the same single.
fn short(x: f32) -> f64 {
    x.to_string().parse().unwrap_or_else(|_| f64::from(x))
}
