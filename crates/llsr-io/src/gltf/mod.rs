//! glTF 2.0, text and binary.

mod accessor;
mod container;
mod extras;
mod material;
mod mesh;
mod node;
mod tessellate;
mod write;

pub use self::write::write_gltf;

use std::path::Path;

use glam::{DMat3, DVec3};
use llsr_scene::{Camera, FieldOfView, Projection};
use serde::Deserialize;
use serde_json::value::RawValue;

use self::accessor::Reader;
use self::extras::AssetExtras;
use crate::error::Error;
use crate::import::{FARTHEST, Import};
use crate::warning::{WarningKind, Warnings};

/// Reads a file and what it names beside it.
///
/// The library's structures are used, but not its validation, which panics on some bad indices and refuses a
/// whole file for one bad part: each index, size and type is checked here before it is followed.
pub(crate) fn read(path: &Path, bytes: Vec<u8>, warnings: &mut Warnings) -> Result<Import, Error> {
    let container = container::split(path, bytes)?;
    let (root, precise) = container::parse(path, &container.json)?;
    drop(container.json);
    if !root.asset.version.starts_with("2.") {
        let cause = format!("is {:?}; only glTF 2 is read", root.asset.version);
        return Err(Error::malformed(path, "asset.version", cause));
    }
    container::check_extensions(path, &root, warnings)?;
    let buffers = container::buffers(path, &root, container.blob, warnings);
    let document = gltf::Document::from_json_without_validation(root);
    let root = document.as_json();

    let mut import = Import::default();
    if !root.animations.is_empty() {
        warnings.add_many(WarningKind::RestPose, root.animations.len() as u64, || {
            "animations".to_owned()
        });
    }
    let materials = material::read(path, root, &buffers, &mut import, warnings);
    let mut reader = Reader::new(&document, &buffers);
    let meshes = mesh::read(path, &mut reader, &materials, &mut import, warnings)?;
    node::read(
        path,
        root,
        &precise,
        &meshes,
        materials.default,
        &mut import,
        warnings,
    )?;

    match extras::read::<AssetExtras>(&root.asset.extras) {
        Some(Ok(extras)) => import.unit = extras.unit.map(Into::into),
        Some(Err(cause)) => warnings.add(WarningKind::BadPart, || format!("asset: {cause}")),
        None => {}
    }
    if let Some(extras) = &root.asset.extras {
        match renderer_camera(extras) {
            Ok(camera) => import.cameras.extend(camera),
            Err(cause) => warnings.add(WarningKind::BadCamera, || format!("asset.extras: {cause}")),
        }
    }
    Ok(import)
}

/// A camera as some converters of Mitsuba scenes leave it.
#[derive(Deserialize)]
struct CameraExtras {
    /// Rows of a 4x4 matrix: the camera looks along +z, with +x to the left.
    #[serde(rename = "camera_toWorld_mitsuba")]
    to_world: Option<Numbers>,
    /// Horizontal field of view.
    #[serde(rename = "camera_fov_deg_x")]
    degrees: Option<Numbers>,
}

/// Numbers in any of the ways they are found.
#[derive(Deserialize)]
#[serde(untagged)]
enum Numbers {
    One(f64),
    List(Vec<f64>),
    Text(String),
}

impl Numbers {
    fn list(&self) -> Option<Vec<f64>> {
        match self {
            Self::One(x) => Some(vec![*x]),
            Self::List(list) => Some(list.clone()),
            Self::Text(text) => text
                .split_ascii_whitespace()
                .map(|word| word.parse().ok())
                .collect(),
        }
    }
}

/// The camera of `asset.extras.camera_toWorld_mitsuba` and `camera_fov_deg_x`, if there is one.
fn renderer_camera(extras: &RawValue) -> Result<Option<Camera>, String> {
    let Ok(extras) = serde_json::from_str::<CameraExtras>(extras.get()) else {
        return Ok(None);
    };
    let Some(to_world) = extras.to_world else {
        return Ok(None);
    };
    let numbers = to_world
        .list()
        .ok_or("camera_toWorld_mitsuba holds something else than numbers")?;
    let rows: [f64; 16] = numbers
        .try_into()
        .map_err(|list: Vec<f64>| format!("camera_toWorld_mitsuba has {} numbers, not 16", list.len()))?;
    let degrees = extras
        .degrees
        .and_then(|n| n.list())
        .and_then(|list| list.first().copied())
        .unwrap_or(50.0);
    if !(degrees > 0.0 && degrees < 180.0) {
        return Err(format!("camera_fov_deg_x is {degrees}"));
    }
    let column = |c: usize| DVec3::new(rows[c], rows[4 + c], rows[8 + c]);
    let axes = node::upright_axes(DMat3::from_cols(-column(0), column(1), -column(2)))
        .ok_or("camera_toWorld_mitsuba is no rotation")?;
    let position = column(3);
    if !(position.is_finite() && position.abs().max_element() <= FARTHEST) {
        return Err("camera_toWorld_mitsuba puts the camera nowhere".to_owned());
    }
    let projection = Projection::Perspective(FieldOfView::horizontal_degrees(degrees));
    Ok(Some(Camera {
        name: "camera_toWorld_mitsuba".to_owned(),
        position,
        axes,
        projection,
    }))
}
