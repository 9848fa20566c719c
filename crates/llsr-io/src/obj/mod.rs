//! Wavefront OBJ and MTL.

mod clean;
mod material;

use std::path::Path;

use glam::{DAffine3, DVec3, Vec2};
use llsr_scene::{Geometry, Mesh, MeshId};

use crate::error::Error;
use crate::import::{Import, ImportMesh, ImportObject};
use crate::polygon::{self, Outcome};
use crate::warning::{WarningKind, Warnings};

/// Reads the text of an OBJ file and what it names beside it.
pub(crate) fn read(path: &Path, bytes: &[u8], warnings: &mut Warnings) -> Result<Import, Error> {
    let cleaned = clean::clean(bytes, warnings);
    let mut import = Import::default();
    let material_ids = material::read(path, &cleaned, &mut import, warnings)?;

    let options = tobj::LoadOptions {
        single_index: true,
        ..tobj::LoadOptions::default()
    };
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut cleaned.reader(), &options, no_materials).map_err(|cause| {
        // Cleaned text that tobj still refuses is beyond what has been foreseen: refuse it too.
        Error::malformed(path, "OBJ text", cause.to_string())
    })?;

    let center = middle(&models);
    // One mesh for each object, two if only some of its faces have normals: those must not be invented.
    let mut meshes: Vec<[Option<Mesh>; 2]> = Vec::new();
    meshes.resize_with(cleaned.objects.len(), Default::default);
    let mut pieces = Vec::new();
    for model in models {
        let Some(bucket) = model
            .name
            .parse()
            .ok()
            .and_then(|i: usize| cleaned.buckets.get(i))
        else {
            continue;
        };
        let name = &cleaned.objects[bucket.object];
        let slot = &mut meshes[bucket.object][usize::from(bucket.kind.normal)];
        let mesh = slot.get_or_insert_with(|| Mesh {
            name: name.clone(),
            ..Mesh::default()
        });
        let base = mesh.positions.len() as u32;
        let source = model.mesh;
        let positions: Vec<DVec3> = source.positions.chunks_exact(3).map(DVec3::from_slice).collect();
        mesh.positions
            .extend(positions.iter().map(|&p| (p - center).as_vec3()));
        mesh.normals.extend(
            source
                .normals
                .chunks_exact(3)
                .map(|n| DVec3::from_slice(n).normalize_or_zero().as_vec3()),
        );
        // The file's v runs upwards, a texture's downwards.
        if bucket.kind.uv && mesh.uvs.len() < base as usize {
            mesh.uvs.resize(base as usize, Vec2::ZERO);
        }
        mesh.uvs.extend(
            source
                .texcoords
                .chunks_exact(2)
                .map(|t| Vec2::new(t[0] as f32, 1.0 - t[1] as f32)),
        );
        if !bucket.kind.uv && !mesh.uvs.is_empty() {
            mesh.uvs.resize(mesh.positions.len(), Vec2::ZERO);
        }

        let start = mesh.triangles.len();
        let mut rest = &source.indices[..];
        for (face, &line) in bucket.lines.iter().enumerate() {
            let arity = source.face_arities.get(face).map_or(3, |&n| n as usize);
            let Some((corners, tail)) = rest.split_at_checked(arity) else {
                break;
            };
            rest = tail;
            if let [a, b, c] = *corners {
                mesh.triangles.push([base + a, base + b, base + c]);
                continue;
            }
            let corner_positions: Vec<DVec3> = corners.iter().map(|&v| positions[v as usize]).collect();
            pieces.clear();
            match polygon::triangulate(&corner_positions, &mut pieces) {
                Outcome::Plain => {}
                Outcome::Empty => warnings.add(WarningKind::BadPolygon, || format!("line {line}")),
                Outcome::NonPlanar => warnings.add(WarningKind::NonPlanarPolygon, || format!("line {line}")),
                Outcome::Fan => warnings.add(WarningKind::FannedPolygon, || format!("line {line}")),
            }
            mesh.triangles
                .extend(pieces.iter().map(|t| t.map(|i| base + corners[i as usize])));
        }
        let material = material_ids.of(bucket.material);
        mesh.materials
            .extend(std::iter::repeat_n(material, mesh.triangles.len() - start));
    }

    for mesh in meshes.into_iter().flatten().flatten() {
        let name = mesh.name.clone();
        let geometry = Geometry::Mesh(MeshId::from(import.meshes.len()));
        import.meshes.push(ImportMesh { mesh, center });
        import.objects.push(ImportObject {
            name,
            geometry,
            transform: DAffine3::IDENTITY,
        });
    }
    Ok(import)
}

/// Middle of the bounds of everything.
fn middle(models: &[tobj::Model]) -> DVec3 {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for position in models
        .iter()
        .flat_map(|model| model.mesh.positions.chunks_exact(3))
    {
        let position = DVec3::from_slice(position);
        min = min.min(position);
        max = max.max(position);
    }
    if min.cmple(max).all() {
        0.5 * min + 0.5 * max
    } else {
        DVec3::ZERO
    }
}
