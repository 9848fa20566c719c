//! Small files made on the spot.

use std::path::{Path, PathBuf};

use glam::DVec3;
use llsr_io::{Error, LoadOptions, Loaded, WarningKind, load_scene};
use llsr_scene::{Geometry, Scene};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A folder that goes away with its files.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary directory"))
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(&path, bytes).expect("a file");
        path
    }
}

pub(crate) fn try_load(path: &Path) -> Result<Loaded, Error> {
    load_scene(path, &LoadOptions::default())
}

/// Loads one file that stands alone.
pub(crate) fn try_text(name: &str, bytes: impl AsRef<[u8]>) -> Result<Loaded, Error> {
    let folder = Folder::new();
    try_load(&folder.put(name, bytes))
}

pub(crate) fn obj(text: &str) -> Loaded {
    try_text("scene.obj", text).expect("a readable file")
}

/// How often a kind was warned of.
pub(crate) fn count(loaded: &Loaded, kind: WarningKind) -> u64 {
    loaded
        .warnings
        .iter()
        .filter(|w| w.kind == kind)
        .map(|w| w.count)
        .sum()
}

pub(crate) fn assert_no_warnings(loaded: &Loaded) {
    let list: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert!(list.is_empty(), "nothing to warn of: {list:?}");
}

/// Corners of all triangles in the file's frame, with the names of their materials.
pub(crate) fn triangles(scene: &Scene) -> Vec<(String, [DVec3; 3])> {
    let mut list = Vec::new();
    for object in &scene.objects {
        let Geometry::Mesh(id) = object.geometry else {
            continue;
        };
        let mesh = &scene.meshes[id.index()];
        assert!(mesh.is_valid(), "mesh {:?} fits together", mesh.name);
        for (index, material) in mesh.materials.iter().enumerate() {
            let corners = mesh
                .corners(index)
                .map(|p| object.transform.transform_point3(p).as_dvec3() + scene.origin);
            list.push((scene.materials[material.index()].name.clone(), corners));
        }
    }
    list
}

/// Area vector of all triangles together.
pub(crate) fn area_vector(scene: &Scene) -> DVec3 {
    triangles(scene)
        .iter()
        .map(|(_, [a, b, c])| 0.5 * (b - a).cross(c - a))
        .sum()
}

/// Sum of the triangles' areas.
pub(crate) fn area(scene: &Scene) -> f64 {
    triangles(scene)
        .iter()
        .map(|(_, [a, b, c])| 0.5 * (b - a).cross(c - a).length())
        .sum()
}

/// A glTF file under construction.
pub(crate) struct Document {
    pub(crate) json: Value,
    pub(crate) bytes: Vec<u8>,
}

impl Document {
    pub(crate) fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "accessors": [], "bufferViews": [], "meshes": [], "nodes": [], "materials": [],
        });
        Self {
            json,
            bytes: Vec::new(),
        }
    }

    pub(crate) fn push(&mut self, list: &str, value: Value) -> usize {
        let list = &mut self.json[list];
        if list.is_null() {
            *list = json!([]);
        }
        let list = list.as_array_mut().expect("a list");
        list.push(value);
        list.len() - 1
    }

    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.push(
            "bufferViews",
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }),
        )
    }

    pub(crate) fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let width = match shape {
            "VEC2" => 2,
            "VEC3" => 3,
            other => panic!("{other} is not used here"),
        };
        let count = values.len() / width;
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": 5126, "count": count, "type": shape }),
        )
    }

    pub(crate) fn indices(&mut self, values: &[u32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let accessor =
            json!({ "bufferView": view, "componentType": 5125, "count": values.len(), "type": "SCALAR" });
        self.push("accessors", accessor)
    }

    /// A mesh of one primitive.
    pub(crate) fn mesh(&mut self, positions: &[f32], indices: &[u32]) -> usize {
        let positions = self.floats("VEC3", positions);
        let indices = self.indices(indices);
        self.push(
            "meshes",
            json!({ "primitives": [{ "attributes": { "POSITION": positions }, "indices": indices }] }),
        )
    }

    /// The unit right triangle in the xy plane, as a mesh.
    pub(crate) fn triangle(&mut self) -> usize {
        self.mesh(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &[0, 1, 2])
    }

    /// The binary form.
    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if json["buffers"].is_null() {
            json["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        }
        glb(json.to_string().as_bytes(), &self.bytes)
    }

    pub(crate) fn try_load(&self) -> Result<Loaded, Error> {
        try_text("scene.glb", self.glb())
    }

    pub(crate) fn load(&self) -> Loaded {
        self.try_load().expect("a readable file")
    }
}

/// A binary file of the two chunks.
pub(crate) fn glb(json: &[u8], bytes: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], fill: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), fill);
        bytes
    };
    let (json, bytes) = (padded(json, b' '), padded(bytes, 0));
    let mut file = b"glTF".to_vec();
    let length = |n: usize| u32::try_from(n).expect("small").to_le_bytes();
    file.extend(2u32.to_le_bytes());
    file.extend(length(12 + 8 + json.len() + 8 + bytes.len()));
    file.extend(length(json.len()));
    file.extend(b"JSON");
    file.extend(json);
    file.extend(length(bytes.len()));
    file.extend(b"BIN\0");
    file.extend(bytes);
    file
}
