//! Indexed triangle meshes.

use glam::{Vec2, Vec3};

use crate::{Bounds, MaterialId};

/// Triangles over shared vertices; positions, normals and texture coordinates use the same index.
///
/// Vertices at equal positions may stand several times (a seam of normals or texture coordinates); see
/// [`Weld`](crate::Weld) for adjacency across seams.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Name in the file; may be empty.
    pub name: String,
    /// Vertex positions in the object's frame (m).
    pub positions: Vec<Vec3>,
    /// Shading normals of unit length, one a vertex, or none: then triangles are flat.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one a vertex, or none.
    pub uvs: Vec<Vec2>,
    /// Vertex indices of each triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub materials: Vec<MaterialId>,
}

impl Mesh {
    /// Flat-shaded triangles of one material.
    pub fn new(
        name: impl Into<String>,
        positions: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
        material: MaterialId,
    ) -> Self {
        let materials = vec![material; triangles.len()];
        Self {
            name: name.into(),
            positions,
            triangles,
            materials,
            ..Self::default()
        }
    }

    /// A planar quadrilateral of two triangles; corners in counter-clockwise order seen from the front.
    pub fn quad(name: impl Into<String>, corners: [Vec3; 4], material: MaterialId) -> Self {
        Self::new(name, corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]], material)
    }

    /// An axis-aligned closed box of twelve triangles with outward orientation.
    pub fn cuboid(name: impl Into<String>, min: Vec3, max: Vec3, material: MaterialId) -> Self {
        let corners = Bounds { min, max }.corners().to_vec();
        let quads = [
            [0u32, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let triangles = quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        Self::new(name, corners, triangles, material)
    }

    /// The corner positions of triangle `index`.
    ///
    /// # Panics
    /// If there is no such triangle or vertex.
    pub fn corners(&self, index: usize) -> [Vec3; 3] {
        self.triangles[index].map(|v| self.positions[v as usize])
    }

    /// Bounding box in the object's frame.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.positions.iter().copied())
    }

    /// Appends the triangles of `other`; missing normals or texture coordinates on one side are dropped on both.
    pub fn append(&mut self, other: &Self) {
        let base = self.positions.len() as u32;
        let was_empty = self.positions.is_empty();
        let both = |mine: bool, theirs: bool| (was_empty || mine) && theirs;
        if both(!self.normals.is_empty(), !other.normals.is_empty()) {
            self.normals.extend_from_slice(&other.normals);
        } else {
            self.normals.clear();
        }
        if both(!self.uvs.is_empty(), !other.uvs.is_empty()) {
            self.uvs.extend_from_slice(&other.uvs);
        } else {
            self.uvs.clear();
        }
        self.positions.extend_from_slice(&other.positions);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
        self.materials.extend_from_slice(&other.materials);
    }

    /// True if lists have matching lengths, indices are in range and positions are finite.
    pub fn is_valid(&self) -> bool {
        let n = self.positions.len();
        self.materials.len() == self.triangles.len()
            && (self.normals.is_empty() || self.normals.len() == n)
            && (self.uvs.is_empty() || self.uvs.len() == n)
            && self.triangles.iter().flatten().all(|&v| (v as usize) < n)
            && self.positions.iter().all(|p| p.is_finite())
    }
}
