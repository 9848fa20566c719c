//! Meshes: indexed or not, lists, strips and fans, any index type, sparse and interleaved data.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec2, Vec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use llsr_scene::{MaterialId, Mesh, MeshId};

use super::accessor::Reader;
use crate::error::Error;
use crate::import::{FARTHEST, Import, ImportMesh};
use crate::warning::{WarningKind, Warnings};

/// Bytes that a vertex and a triangle come to.
const VERTEX_BYTES: u64 = 32;
const TRIANGLE_BYTES: u64 = 16;

/// What meshes need to know about materials.
pub(super) struct MaterialTable {
    /// Set of texture coordinates that each material of the file uses.
    pub(super) uv_sets: Vec<u32>,
    /// Material of primitives that name none.
    pub(super) default: MaterialId,
}

/// Reads each mesh of the file; for each the meshes it became: one, or two if only some of its primitives have normals.
pub(super) fn read(
    path: &Path,
    reader: &mut Reader<'_>,
    materials: &MaterialTable,
    import: &mut Import,
    warnings: &mut Warnings,
) -> Result<Vec<Vec<MeshId>>, Error> {
    let mut ids = Vec::new();
    let document = reader.document;
    for (index, source) in document.as_json().meshes.iter().enumerate() {
        let label = label("mesh", index, source.name.as_deref());
        let mut halves: [Option<(Mesh, DVec3)>; 2] = [None, None];
        for (number, primitive) in source.primitives.iter().enumerate() {
            let place = || format!("{label}, primitive {number}");
            if primitive
                .targets
                .as_ref()
                .is_some_and(|targets| !targets.is_empty())
            {
                warnings.add(WarningKind::RestPose, place);
            }
            match read_primitive(path, reader, primitive, materials, warnings, &place)? {
                Ok(Some(part)) => {
                    let half = &mut halves[usize::from(!part.normals.is_empty())];
                    add(half, part, source.name.as_deref().unwrap_or(""));
                }
                Ok(None) => {}
                Err(cause) => warnings.add(WarningKind::BadPart, || format!("{}: {cause}", place())),
            }
        }
        let mut list = Vec::new();
        for (mesh, center) in halves.into_iter().flatten() {
            list.push(MeshId::from(import.meshes.len()));
            import.meshes.push(ImportMesh { mesh, center });
        }
        ids.push(list);
    }
    Ok(ids)
}

/// A name for messages.
pub(super) fn label(what: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{what} {name:?}"),
        _ => format!("{what} {index}"),
    }
}

/// The triangles of one primitive, with no vertex unused.
struct Part {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    material: MaterialId,
}

/// Adds a part; the first one decides where the mesh's center is.
fn add(half: &mut Option<(Mesh, DVec3)>, part: Part, name: &str) {
    let (mesh, center) = half.get_or_insert_with(|| {
        let mesh = Mesh {
            name: name.to_owned(),
            ..Mesh::default()
        };
        (mesh, far_center(&part.positions))
    });
    let base = mesh.positions.len() as u32;
    mesh.positions
        .extend(part.positions.iter().map(|p| (p.as_dvec3() - *center).as_vec3()));
    mesh.normals.extend(part.normals);
    if !part.uvs.is_empty() {
        mesh.uvs.resize(base as usize, Vec2::ZERO);
        mesh.uvs.extend(part.uvs);
    } else if !mesh.uvs.is_empty() {
        mesh.uvs.resize(mesh.positions.len(), Vec2::ZERO);
    }
    mesh.materials
        .extend(std::iter::repeat_n(part.material, part.triangles.len()));
    mesh.triangles
        .extend(part.triangles.iter().map(|t| t.map(|v| base + v)));
}

/// The middle of positions that lie far from their origin compared to their size; zero for others, which then keep
/// their exact values.
fn far_center(positions: &[Vec3]) -> DVec3 {
    let bounds = llsr_scene::Bounds::of(positions.iter().copied());
    let center = bounds.center();
    if center.length() > 4.0 * bounds.diagonal() {
        center.as_dvec3()
    } else {
        DVec3::ZERO
    }
}

type PartResult = Result<Option<Part>, String>;

/// Reads one primitive: `Ok(None)` if it draws no surface, `Err` with the cause if it cannot be read.
fn read_primitive(
    path: &Path,
    reader: &mut Reader<'_>,
    primitive: &Primitive,
    materials: &MaterialTable,
    warnings: &mut Warnings,
    place: &dyn Fn() -> String,
) -> Result<PartResult, Error> {
    let Checked::Valid(mode) = primitive.mode else {
        return Ok(Err("has an unknown mode".to_owned()));
    };
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        warnings.add(WarningKind::Ignored, || format!("points and lines ({})", place()));
        return Ok(Ok(None));
    }
    let attribute = |semantic| {
        primitive
            .attributes
            .get(&Checked::Valid(semantic))
            .map(|index| index.value())
    };
    let Some(positions) = attribute(Semantic::Positions) else {
        return Ok(Err("has no positions".to_owned()));
    };
    let position_facts = match reader.facts(positions) {
        Ok(facts) => facts,
        Err(cause) => return Ok(Err(cause)),
    };
    if (position_facts.component, position_facts.dimensions) != (DataType::F32, Dimensions::Vec3) {
        return Ok(Err(format!(
            "accessor {positions} holds no positions: they must be vectors of three floats"
        )));
    }
    let vertex_count = position_facts.count;
    if position_facts.sparse {
        // Three attributes at most, each read step by step.
        reader.book(4 * vertex_count as u64, path)?;
    }

    // Which vertices make which triangles.
    let index_count = match primitive.indices {
        None => vertex_count,
        Some(index) => match reader.facts(index.value()) {
            Ok(facts) => facts.count,
            Err(cause) => return Ok(Err(cause)),
        },
    };
    reader.book(4 * index_count as u64, path)?;
    let order = match primitive.indices {
        None => (0..vertex_count as u32).collect(),
        Some(index) => match read_indices(reader, index.value()) {
            Ok(order) => order,
            Err(cause) => return Ok(Err(cause)),
        },
    };
    reader.book(TRIANGLE_BYTES * order.len() as u64, path)?;
    let mut triangles = assemble(&order, mode);
    drop(order);
    let before = triangles.len();
    triangles.retain(|t| t.iter().all(|&v| (v as usize) < vertex_count));
    warnings.add_many(WarningKind::BadIndex, (before - triangles.len()) as u64, place);

    // Only vertices in use: many primitives may share one long list.
    reader.book(
        VERTEX_BYTES * (3 * triangles.len()).min(vertex_count) as u64,
        path,
    )?;
    let used = renumber(&mut triangles, vertex_count, reader, path)?;
    let mut part = Part {
        positions: gather::<[f32; 3], Vec3>(reader, positions, &used),
        normals: Vec::new(),
        uvs: Vec::new(),
        triangles,
        material: primitive.material.map_or(materials.default, |material| {
            let index = material.value();
            if index < materials.uv_sets.len() {
                MaterialId::from(index)
            } else {
                materials.default
            }
        }),
    };
    if part.positions.len() != used.len() {
        return Ok(Err(format!("accessor {positions} ends too early")));
    }

    if let Some(index) = attribute(Semantic::Normals) {
        match read_normals(reader, index, vertex_count, &used) {
            Ok(normals) => part.normals = normals,
            Err(cause) => warnings.add(WarningKind::BadAttribute, || format!("{}: {cause}", place())),
        }
    }
    let set = materials.uv_sets.get(part.material.index()).copied().unwrap_or(0);
    if let Some(index) = attribute(Semantic::TexCoords(set)) {
        match read_uvs(reader, index, vertex_count, &used) {
            Ok(uvs) => part.uvs = uvs,
            Err(cause) => warnings.add(WarningKind::BadAttribute, || format!("{}: {cause}", place())),
        }
    }
    if attribute(Semantic::Colors(0)).is_some() {
        warnings.add(WarningKind::Ignored, || format!("vertex colours ({})", place()));
    }

    // Vertices that are nowhere take their triangles with them.
    let far = |p: &Vec3| !p.is_finite() || p.abs().max_element() > FARTHEST as f32;
    let bad = part.positions.iter().filter(|p| far(p)).count();
    if bad > 0 {
        warnings.add_many(WarningKind::BadVertex, bad as u64, place);
        let positions = &part.positions;
        part.triangles
            .retain(|t| t.iter().all(|&v| !far(&positions[v as usize])));
        // Unused now, but they would spoil the bounds.
        for position in part.positions.iter_mut().filter(|p| far(p)) {
            *position = Vec3::ZERO;
        }
    }
    Ok(Ok((!part.triangles.is_empty()).then_some(part)))
}

fn read_indices(reader: &Reader<'_>, index: usize) -> Result<Vec<u32>, String> {
    let facts = reader.facts(index)?;
    let wrong = || format!("accessor {index} holds no indices: they must be unsigned integers");
    if facts.dimensions != Dimensions::Scalar {
        return Err(wrong());
    }
    let list = match facts.component {
        DataType::U8 => reader
            .elements::<u8>(index)
            .map(|list| list.map(u32::from).collect()),
        DataType::U16 => reader
            .elements::<u16>(index)
            .map(|list| list.map(u32::from).collect()),
        DataType::U32 => reader.elements::<u32>(index).map(Iterator::collect),
        _ => return Err(wrong()),
    };
    list.ok_or_else(|| format!("accessor {index} cannot be read"))
}

/// Triangles of a list, strip or fan; an odd end is left over.
fn assemble(order: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => order
            .windows(3)
            .enumerate()
            .map(|(i, w)| {
                if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[1], w[0], w[2]]
                }
            })
            .collect(),
        Mode::TriangleFan => match order.split_first() {
            Some((&hub, rim)) => rim.windows(2).map(|w| [w[0], w[1], hub]).collect(),
            None => Vec::new(),
        },
        _ => order.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

/// Renumbers the corners from 0 in the order of the file and returns the old numbers.
fn renumber(
    triangles: &mut [[u32; 3]],
    vertex_count: usize,
    reader: &mut Reader<'_>,
    path: &Path,
) -> Result<Vec<u32>, Error> {
    let corners = 3 * triangles.len();
    let mut used: Vec<u32>;
    if corners < vertex_count / 4 {
        used = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let numbers: HashMap<u32, u32> = used.iter().zip(0..).map(|(&old, new)| (old, new)).collect();
        for v in triangles.iter_mut().flatten() {
            *v = numbers[v];
        }
    } else {
        // At most four entries for each corner, which has been booked.
        reader.book(4 * vertex_count as u64, path)?;
        const UNUSED: u32 = u32::MAX;
        let mut numbers = vec![UNUSED; vertex_count];
        for &v in triangles.iter().flatten() {
            numbers[v as usize] = 0;
        }
        used = Vec::new();
        for (old, number) in numbers
            .iter_mut()
            .enumerate()
            .filter(|(_, number)| **number != UNUSED)
        {
            *number = used.len() as u32;
            used.push(old as u32);
        }
        for v in triangles.iter_mut().flatten() {
            *v = numbers[*v as usize];
        }
    }
    Ok(used)
}

/// The elements of an accessor at ascending positions.
fn gather<T: gltf::accessor::Item, U: From<T>>(reader: &Reader<'_>, index: usize, used: &[u32]) -> Vec<U> {
    let Some(mut elements) = reader.elements::<T>(index) else {
        return Vec::new();
    };
    let mut next = 0;
    let mut list = Vec::with_capacity(used.len());
    for &wanted in used {
        let skipped = (wanted - next) as usize;
        next = wanted + 1;
        let Some(element) = elements.nth(skipped) else {
            break;
        };
        list.push(element.into());
    }
    list
}

fn read_normals(
    reader: &Reader<'_>,
    index: usize,
    vertex_count: usize,
    used: &[u32],
) -> Result<Vec<Vec3>, String> {
    let facts = reader.facts(index)?;
    if (facts.component, facts.dimensions) != (DataType::F32, Dimensions::Vec3) || facts.count < vertex_count
    {
        return Err(format!("accessor {index} does not hold a normal for each vertex"));
    }
    let normals: Vec<Vec3> = gather::<[f32; 3], Vec3>(reader, index, used);
    let normals: Option<Vec<Vec3>> = normals
        .into_iter()
        .map(|n| n.as_dvec3().try_normalize().map(|n| n.as_vec3()))
        .collect();
    normals
        .filter(|n| n.len() == used.len())
        .ok_or_else(|| format!("accessor {index} has a normal without a length"))
}

fn read_uvs(
    reader: &Reader<'_>,
    index: usize,
    vertex_count: usize,
    used: &[u32],
) -> Result<Vec<Vec2>, String> {
    let facts = reader.facts(index)?;
    let wrong = || format!("accessor {index} does not hold texture coordinates for each vertex");
    if facts.dimensions != Dimensions::Vec2 || facts.count < vertex_count {
        return Err(wrong());
    }
    struct Uv(Vec2);
    impl From<[f32; 2]> for Uv {
        fn from(uv: [f32; 2]) -> Self {
            Self(Vec2::from_array(uv))
        }
    }
    impl From<[u8; 2]> for Uv {
        fn from(uv: [u8; 2]) -> Self {
            Self(Vec2::from_array(uv.map(|x| f32::from(x) / 255.0)))
        }
    }
    impl From<[u16; 2]> for Uv {
        fn from(uv: [u16; 2]) -> Self {
            Self(Vec2::from_array(uv.map(|x| f32::from(x) / 65535.0)))
        }
    }
    let uvs: Vec<Uv> = match (facts.component, facts.normalized) {
        (DataType::F32, _) => gather::<[f32; 2], Uv>(reader, index, used),
        (DataType::U8, true) => gather::<[u8; 2], Uv>(reader, index, used),
        (DataType::U16, true) => gather::<[u16; 2], Uv>(reader, index, used),
        _ => return Err(wrong()),
    };
    if uvs.len() != used.len() || uvs.iter().any(|uv| !uv.0.is_finite()) {
        return Err(format!("accessor {index} has coordinates that are not finite"));
    }
    Ok(uvs.into_iter().map(|uv| uv.0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_orientation() {
        let order = [0, 1, 2, 3, 4];
        assert_eq!(
            assemble(&order, Mode::TriangleStrip),
            [[0, 1, 2], [2, 1, 3], [2, 3, 4]],
            "every second one turned"
        );
        assert_eq!(
            assemble(&order, Mode::TriangleFan),
            [[1, 2, 0], [2, 3, 0], [3, 4, 0]],
            "around the first"
        );
        assert_eq!(
            assemble(&order, Mode::Triangles),
            [[0, 1, 2]],
            "the rest is no triangle"
        );
        assert!(assemble(&[], Mode::TriangleFan).is_empty(), "nothing of nothing");
    }
}
