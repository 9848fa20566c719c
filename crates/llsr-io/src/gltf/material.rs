//! Materials and their base-colour textures.

use std::collections::HashMap;
use std::path::Path;

use glam::{Mat3, Vec3};
use gltf::json::Root;
use gltf::json::material::AlphaMode;
use gltf::json::texture::{Info, WrappingMode};
use gltf::json::validation::Checked;
use llsr_scene::{Material, MaterialId, Texture, TextureId, TextureUse, Wrap, srgb_to_linear};

use super::accessor::view_bytes;
use super::container::resolve;
use super::mesh::MaterialTable;
use crate::import::Import;
use crate::texture::Decoder;
use crate::warning::{WarningKind, Warnings};

/// Reflectance of primitives without a material.
const GREY: f32 = 0.8;

/// Bytes of one image file.
const LARGEST_IMAGE: u64 = 256 << 20;

/// Bytes of all image files.
const LARGEST_IMAGES: u64 = 4 << 30;

/// Reads all materials, in the order of the file, and one more for primitives that have none.
pub(super) fn read(
    path: &Path,
    root: &Root,
    buffers: &[Option<Vec<u8>>],
    import: &mut Import,
    warnings: &mut Warnings,
) -> MaterialTable {
    let mut textures = Textures {
        path,
        root,
        buffers,
        decoder: Decoder::default(),
        unread: LARGEST_IMAGES,
        known: HashMap::new(),
    };
    let mut uv_sets = Vec::new();
    for (index, source) in root.materials.iter().enumerate() {
        let name = match &source.name {
            Some(name) if !name.is_empty() => name.clone(),
            _ => format!("material-{index}"),
        };
        let place = || format!("material {name:?}");
        let extensions = source.extensions.as_ref();
        let model = Model::of(source);
        let mut unit = |value: f32| {
            if !(0.0..=1.0).contains(&value) {
                warnings.add(WarningKind::ClampedMaterial, place);
            }
            if value.is_nan() {
                0.0
            } else {
                value.clamp(0.0, 1.0)
            }
        };
        let [r, g, b, _] = model.color;
        let base_color = Vec3::new(unit(r), unit(g), unit(b));
        let (metallic, roughness) = (unit(model.metallic), unit(model.roughness));
        if !matches!(source.alpha_mode, Checked::Valid(AlphaMode::Opaque)) {
            warnings.add(WarningKind::Transparency, place);
        }
        let unused = [
            model.has_surface_texture,
            source.normal_texture.is_some(),
            source.occlusion_texture.is_some(),
        ];
        if unused.contains(&true) {
            warnings.add(WarningKind::UnusedTexture, place);
        }

        let mut uv_set = 0;
        let base_color_texture = model.color_texture.and_then(|info| {
            let (texture, set) = textures.texture_use(info, &place, import, warnings)?;
            uv_set = set;
            Some(texture)
        });
        uv_sets.push(uv_set);

        let strength = extensions
            .and_then(|e| e.emissive_strength.as_ref())
            .map_or(1.0, |e| e.emissive_strength.0);
        let mut emission = Vec3::from_array(source.emissive_factor.0) * strength;
        if !(emission.is_finite() && emission.min_element() >= 0.0) {
            warnings.add(WarningKind::ClampedMaterial, place);
            emission = Vec3::ZERO;
        }
        if let Some(info) = source
            .emissive_texture
            .as_ref()
            .filter(|_| emission != Vec3::ZERO)
        {
            warnings.add(WarningKind::EmissiveTexture, place);
            if let Some(texture) = textures.load(info.index.value(), &place, import, warnings) {
                emission *= mean(&import.textures[texture.index()]);
            }
        }
        import.materials.push(Material {
            name,
            base_color,
            base_color_texture,
            metallic,
            roughness,
            emission,
        });
    }
    let default = MaterialId::from(import.materials.len());
    if root.meshes.iter().flat_map(|mesh| &mesh.primitives).any(|p| {
        p.material
            .is_none_or(|material| material.value() >= root.materials.len())
    }) {
        import.materials.push(Material::diffuse("", Vec3::splat(GREY)));
    }
    MaterialTable { uv_sets, default }
}

/// The numbers of either model of a surface.
struct Model<'a> {
    color: [f32; 4],
    color_texture: Option<&'a Info>,
    metallic: f32,
    roughness: f32,
    has_surface_texture: bool,
}

impl<'a> Model<'a> {
    /// The older specular-glossiness model goes first, as its extension demands; it has no metals.
    fn of(source: &'a gltf::json::Material) -> Self {
        let older = source
            .extensions
            .as_ref()
            .and_then(|e| e.pbr_specular_glossiness.as_ref());
        if let Some(older) = older {
            return Self {
                color: older.diffuse_factor.0,
                color_texture: older.diffuse_texture.as_ref(),
                metallic: 0.0,
                roughness: 1.0 - older.glossiness_factor.0,
                has_surface_texture: older.specular_glossiness_texture.is_some(),
            };
        }
        let pbr = &source.pbr_metallic_roughness;
        Self {
            color: pbr.base_color_factor.0,
            color_texture: pbr.base_color_texture.as_ref(),
            metallic: pbr.metallic_factor.0,
            roughness: pbr.roughness_factor.0,
            has_surface_texture: pbr.metallic_roughness_texture.is_some(),
        }
    }
}

/// Mean linear colour.
fn mean(texture: &Texture) -> Vec3 {
    let mut counts = [[0u64; 256]; 3];
    for pixel in &texture.pixels {
        for (counts, &value) in counts.iter_mut().zip(pixel) {
            counts[value as usize] += 1;
        }
    }
    let total = texture.pixels.len().max(1) as f64;
    let channel = |counts: [u64; 256]| {
        let sum: f64 = counts
            .iter()
            .enumerate()
            .map(|(value, &n)| n as f64 * f64::from(srgb_to_linear(value as f32 / 255.0)))
            .sum();
        (sum / total) as f32
    };
    Vec3::from_array(counts.map(channel))
}

/// Decodes each image once for each way to repeat it.
struct Textures<'a> {
    path: &'a Path,
    root: &'a Root,
    buffers: &'a [Option<Vec<u8>>],
    decoder: Decoder,
    /// Bytes of image files that may still be read.
    unread: u64,
    known: HashMap<(usize, [Wrap; 2]), Option<TextureId>>,
}

impl Textures<'_> {
    /// A texture with its transform, and its set of texture coordinates.
    fn texture_use(
        &mut self,
        info: &Info,
        place: &dyn Fn() -> String,
        import: &mut Import,
        warnings: &mut Warnings,
    ) -> Option<(TextureUse, u32)> {
        let texture = self.load(info.index.value(), place, import, warnings)?;
        let extension = info
            .extensions
            .as_ref()
            .and_then(|e| e.texture_transform.as_ref());
        let Some(transform) = extension else {
            return Some((TextureUse::plain(texture), info.tex_coord));
        };
        let set = transform.tex_coord.unwrap_or(info.tex_coord);
        let ([ou, ov], [su, sv]) = (transform.offset.0, transform.scale.0);
        let (sin, cos) = transform.rotation.0.sin_cos();
        // Scaled, then turned against v, which runs downwards, then moved.
        let matrix = Mat3::from_cols(
            Vec3::new(su * cos, -su * sin, 0.0),
            Vec3::new(sv * sin, sv * cos, 0.0),
            Vec3::new(ou, ov, 1.0),
        );
        if !matrix.is_finite() {
            warnings.add(WarningKind::ClampedMaterial, || {
                format!("texture transform of {}", place())
            });
            return Some((TextureUse::plain(texture), set));
        }
        Some((
            TextureUse {
                texture,
                transform: matrix,
            },
            set,
        ))
    }

    fn load(
        &mut self,
        index: usize,
        place: &dyn Fn() -> String,
        import: &mut Import,
        warnings: &mut Warnings,
    ) -> Option<TextureId> {
        let texture = self.find(index).and_then(|(image, wrap)| {
            if let Some(known) = self.known.get(&(image, wrap)) {
                return known.ok_or_else(|| format!("image {image} cannot be read"));
            }
            let decoded = self.decode(index, image, wrap).map(|texture| {
                import.textures.push(texture);
                TextureId::from(import.textures.len() - 1)
            });
            self.known.insert((image, wrap), decoded.as_ref().ok().copied());
            decoded
        });
        texture
            .map_err(|cause| {
                warnings.add(WarningKind::MissingTexture, || {
                    format!("texture {index} of {}: {cause}", place())
                });
            })
            .ok()
    }

    /// The image of a texture and how it repeats.
    fn find(&self, index: usize) -> Result<(usize, [Wrap; 2]), String> {
        let texture = self
            .root
            .textures
            .get(index)
            .ok_or("there is none of that number")?;
        let sampler = texture
            .sampler
            .and_then(|sampler| self.root.samplers.get(sampler.value()));
        let wrap = sampler.map_or([Wrap::Repeat; 2], |sampler| {
            [sampler.wrap_s, sampler.wrap_t].map(wrapping)
        });
        Ok((texture.source.value(), wrap))
    }

    fn decode(&mut self, texture: usize, image: usize, wrap: [Wrap; 2]) -> Result<Texture, String> {
        let image = self.root.images.get(image).ok_or("its image does not exist")?;
        let name = image
            .name
            .as_deref()
            .or(self.root.textures[texture].name.as_deref());
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                let bytes = resolve(self.path, uri, LARGEST_IMAGE.min(self.unread))?;
                self.unread = self.unread.saturating_sub(bytes.len() as u64);
                let name = name.unwrap_or(if uri.starts_with("data:") { "" } else { uri });
                self.decoder.decode(name, &bytes, wrap)
            }
            (None, Some(view)) => {
                let bytes = view_bytes(self.root, self.buffers, view.value())?;
                self.decoder.decode(name.unwrap_or(""), bytes, wrap)
            }
            (None, None) => Err("its image has no data".to_owned()),
        }
    }
}

fn wrapping(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}
