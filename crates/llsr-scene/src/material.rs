//! Surface materials: the metal-rough subset that the shaders use.

use glam::{Mat3, Vec2, Vec3};

use crate::TextureId;

/// A texture and how its coordinates are transformed before the look-up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// The texture.
    pub texture: TextureId,
    /// Maps a mesh's texture coordinates (homogeneous) to the texture's.
    pub transform: Mat3,
}

impl TextureUse {
    /// The texture with untransformed coordinates.
    pub fn plain(texture: TextureId) -> Self {
        Self {
            texture,
            transform: Mat3::IDENTITY,
        }
    }

    /// Applies the transform.
    pub fn coordinates(&self, uv: Vec2) -> Vec2 {
        self.transform.transform_point2(uv)
    }
}

/// A two-sided surface (glTF's metal-rough model).
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file; may be empty.
    pub name: String,
    /// Base colour, linear RGB in [0, 1]; multiplies the texture.
    pub base_color: Vec3,
    /// Base-colour texture.
    pub base_color_texture: Option<TextureUse>,
    /// Metalness in [0, 1].
    pub metallic: f32,
    /// Perceptual roughness in [0, 1].
    pub roughness: f32,
    /// Emitted radiance, linear RGB (cd/m² in a luminous scene, W/(m² sr) in a radiant one).
    pub emission: Vec3,
}

impl Material {
    /// A matte material of the given albedo.
    pub fn diffuse(name: impl Into<String>, base_color: Vec3) -> Self {
        Self {
            name: name.into(),
            base_color,
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            emission: Vec3::ZERO,
        }
    }
}
