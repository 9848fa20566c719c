//! Tubes of geometry that become linear lights.

use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use llsr_scene::{EmissionLaw, Geometry, LinearLight, MaterialId, Mesh, MeshId, Shape, Weld, luminance};

use crate::error::Error;
use crate::import::{Import, ImportMesh, MOST_LIGHTS, drop_unused_vertices, retain_triangles};
use crate::load::LoadOptions;
use crate::warning::{WarningKind, Warnings};

/// A tube is at least this many times as long as its larger cross extent.
const LENGTH_RATIO: f64 = 10.0;

/// Its cross extents differ by at most this factor.
const CROSS_RATIO: f64 = 1.5;

/// Most triangles of emissive and tube materials that are looked at, over all objects: shared meshes multiply them.
const MOST_MEASURED: usize = 100_000_000;

/// Most triangles of meshes made anew because a shared mesh lost different parts in different places.
const MOST_COPIED: usize = 10_000_000;

/// What the parts of a material are to become.
#[derive(Clone, Copy, Debug)]
enum Wish {
    /// Position in the requests.
    Asked(usize),
    /// Linear RGB radiance.
    Emissive(Vec3),
}

/// A straight thin part.
#[derive(Clone, Copy, Debug)]
struct Tube {
    a: DVec3,
    b: DVec3,
    radius: f64,
    /// Surface (m²).
    area: f64,
}

/// Takes tubes of emissive materials and of materials asked for out of the geometry and adds them as lights.
/// Returns whether any light came from an emissive material.
pub(crate) fn extract(
    path: &Path,
    import: &mut Import,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<bool, Error> {
    let wishes = wishes(import, options);
    let mut run = Run {
        import,
        options,
        warnings,
        wishes,
        copied: 0,
        found: vec![(0, 0); options.tubes.len()],
        emissive: false,
    };
    if !run.wishes.is_empty() {
        run.objects(path)?;
    }
    let (found, emissive) = (run.found, run.emissive);
    for (request, (tubes, others)) in options.tubes.iter().zip(found) {
        let asked = request.material.clone();
        if tubes == 0 && others == 0 {
            let known = nearest_names(&asked, import);
            return Err(Error::UnknownMaterial {
                path: path.to_owned(),
                asked,
                known,
            });
        }
        if tubes == 0 {
            return Err(Error::NoTube {
                path: path.to_owned(),
                asked,
                parts: others,
            });
        }
        warnings.add_many(WarningKind::NotATube, others as u64, || {
            format!("material {asked:?}")
        });
    }
    Ok(emissive)
}

/// The materials whose parts are looked at; a request goes before emission.
fn wishes(import: &Import, options: &LoadOptions) -> BTreeMap<u32, Wish> {
    let mut wishes = BTreeMap::new();
    for (index, material) in import.materials.iter().enumerate() {
        let asked = options
            .tubes
            .iter()
            .position(|request| request.material == material.name);
        if let Some(request) = asked {
            wishes.insert(index as u32, Wish::Asked(request));
        } else if material.emission.max_element() > 0.0 {
            wishes.insert(index as u32, Wish::Emissive(material.emission));
        }
    }
    wishes
}

struct Run<'a> {
    import: &'a mut Import,
    options: &'a LoadOptions,
    warnings: &'a mut Warnings,
    wishes: BTreeMap<u32, Wish>,
    /// Triangles copied so far.
    copied: usize,
    /// For each request, how many tubes and how many other parts have its material.
    found: Vec<(usize, usize)>,
    emissive: bool,
}

impl Run<'_> {
    fn objects(&mut self, path: &Path) -> Result<(), Error> {
        let parts_of = self.parts_of_meshes(path)?;
        // A mesh without these of its parts.
        let mut reduced: HashMap<(u32, Vec<u32>), MeshId> = HashMap::new();
        let mut kept = Vec::with_capacity(self.import.objects.len());
        for mut object in std::mem::take(&mut self.import.objects) {
            match object.geometry {
                Geometry::Primitive(primitive) => {
                    if let Some(&wish) = self.wishes.get(&primitive.material.0) {
                        let tube = cylinder_tube(&primitive.shape, &object.transform);
                        if self.settle(wish, primitive.material, tube, &object.name) {
                            continue;
                        }
                    }
                }
                Geometry::Mesh(id) => {
                    let parts = &parts_of[&id.0];
                    let source = &self.import.meshes[id.index()];
                    let tubes: Vec<Option<Tube>> = parts
                        .iter()
                        .map(|part| measure(source, &part.triangles, &object.transform))
                        .collect();
                    let facts: Vec<(Wish, MaterialId)> = parts
                        .iter()
                        .map(|part| (self.wishes[&part.material.0], part.material))
                        .collect();
                    let mut removed: Vec<u32> = Vec::new();
                    for (index, (tube, (wish, material))) in tubes.into_iter().zip(facts).enumerate() {
                        if self.settle(wish, material, tube, &object.name) {
                            removed.push(index as u32);
                        }
                    }
                    if !removed.is_empty() {
                        let import = &mut *self.import;
                        let mesh = *reduced.entry((id.0, removed)).or_insert_with_key(|(_, removed)| {
                            let source = &import.meshes[id.index()];
                            let gone = removed.iter().flat_map(|&part| &parts[part as usize].triangles);
                            let mesh = without(&source.mesh, gone.copied());
                            let center = source.center;
                            self.copied += mesh.triangles.len();
                            import.meshes.push(ImportMesh { mesh, center });
                            MeshId::from(import.meshes.len() - 1)
                        });
                        if self.copied > MOST_COPIED {
                            return Err(too_many(path, "copied", MOST_COPIED));
                        }
                        if self.import.meshes[mesh.index()].mesh.triangles.is_empty() {
                            continue;
                        }
                        object.geometry = Geometry::Mesh(mesh);
                    }
                }
            }
            kept.push(object);
            if self.import.lights.len() > MOST_LIGHTS {
                let cause = format!("there are more than {MOST_LIGHTS} tubes");
                return Err(Error::malformed(path, "lights", cause));
            }
        }
        self.import.objects = kept;
        Ok(())
    }

    /// The parts of each mesh in use, if they can be looked at wherever it stands.
    fn parts_of_meshes(&self, path: &Path) -> Result<HashMap<u32, Vec<Part>>, Error> {
        let mut parts_of: HashMap<u32, Vec<Part>> = HashMap::new();
        let mut measured = 0;
        for object in &self.import.objects {
            let Geometry::Mesh(id) = object.geometry else {
                continue;
            };
            let parts = parts_of
                .entry(id.0)
                .or_insert_with(|| parts(&self.import.meshes[id.index()].mesh, &self.wishes));
            measured += parts.iter().map(|part| part.triangles.len()).sum::<usize>();
            if measured > MOST_MEASURED {
                return Err(too_many(path, "looked at", MOST_MEASURED));
            }
        }
        Ok(parts_of)
    }

    /// Decides about one part; true if it became a light.
    fn settle(&mut self, wish: Wish, material: MaterialId, tube: Option<Tube>, object: &str) -> bool {
        let name = self.import.materials[material.index()].name.clone();
        match (wish, tube) {
            (Wish::Asked(request), None) => {
                self.found[request].1 += 1;
                false
            }
            (Wish::Emissive(_), None) => {
                self.warnings.add(WarningKind::DarkEmitter, || {
                    format!("material {name:?} on {object:?}")
                });
                false
            }
            (Wish::Asked(request), Some(tube)) => {
                self.found[request].0 += 1;
                let mut light =
                    LinearLight::new(name, tube.a, tube.b, self.options.tubes[request].flux.value);
                light.emission = self.options.emission;
                light.radius = tube.radius;
                self.import.add_linear(light, self.warnings);
                true
            }
            (Wish::Emissive(radiance), Some(tube)) => {
                let brightness = luminance(radiance);
                let flux = PI * f64::from(brightness) * tube.area;
                let mut light = LinearLight::new(name, tube.a, tube.b, flux);
                light.color = radiance / brightness;
                light.emission = EmissionLaw::Diffuse;
                light.radius = tube.radius;
                self.emissive = true;
                self.import.add_linear(light, self.warnings);
                true
            }
        }
    }
}

fn too_many(path: &Path, done: &str, limit: usize) -> Error {
    let cause = format!(
        "for tubes among shared meshes more than {limit} triangles would have to be {done}; share them less"
    );
    Error::malformed(path, "lights", cause)
}

/// A connected set of triangles of one material.
#[derive(Debug)]
struct Part {
    material: MaterialId,
    triangles: Vec<u32>,
}

/// The connected parts of the materials in `wishes`, by first triangle; corners at equal positions connect.
fn parts(mesh: &Mesh, wishes: &BTreeMap<u32, Wish>) -> Vec<Part> {
    if !mesh
        .materials
        .iter()
        .any(|material| wishes.contains_key(&material.0))
    {
        return Vec::new();
    }
    let weld = Weld::new(&mesh.positions);
    // A vertex connects triangles of one material only, so each material has vertices of its own.
    let mut vertex_numbers: HashMap<(u32, u32), u32> = HashMap::new();
    let mut parents: Vec<u32> = Vec::new();
    fn root(parents: &mut [u32], mut v: u32) -> u32 {
        while parents[v as usize] != v {
            let grandparent = parents[parents[v as usize] as usize];
            parents[v as usize] = grandparent;
            v = grandparent;
        }
        v
    }
    let mut first_corners = Vec::new();
    for (index, (triangle, material)) in mesh.triangles.iter().zip(&mesh.materials).enumerate() {
        if !wishes.contains_key(&material.0) {
            continue;
        }
        let corners = triangle.map(|v| {
            let next = parents.len() as u32;
            let number = *vertex_numbers
                .entry((material.0, weld.welded[v as usize]))
                .or_insert(next);
            if number == next {
                parents.push(next);
            }
            number
        });
        let a = root(&mut parents, corners[0]);
        for other in [corners[1], corners[2]] {
            let b = root(&mut parents, other);
            let a = root(&mut parents, a);
            parents[a.max(b) as usize] = a.min(b);
        }
        first_corners.push((index as u32, *material, corners[0]));
    }
    let mut part_of_root: HashMap<u32, usize> = HashMap::new();
    let mut parts: Vec<Part> = Vec::new();
    for (triangle, material, corner) in first_corners {
        let root = root(&mut parents, corner);
        let part = *part_of_root.entry(root).or_insert_with(|| {
            parts.push(Part {
                material,
                triangles: Vec::new(),
            });
            parts.len() - 1
        });
        parts[part].triangles.push(triangle);
    }
    parts
}

/// The tube that these triangles form in the file's frame, if they do.
///
/// The axis is the direction in which the surface (not its vertices: ends may be finer than the rest) spreads most,
/// through the surface's centroid.
fn measure(source: &ImportMesh, triangles: &[u32], transform: &DAffine3) -> Option<Tube> {
    let mesh = &source.mesh;
    let position = |v: u32| transform.matrix3 * mesh.positions[v as usize].as_dvec3();
    let corners = |&t: &u32| mesh.triangles[t as usize].map(position);
    // Relative to one of the corners: squares of far coordinates would swallow the part.
    let base = position(mesh.triangles[*triangles.first()? as usize][0]);
    let (mut area, mut first) = (0.0, DVec3::ZERO);
    let mut second = DMat3::ZERO;
    let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    for [p, q, r] in triangles.iter().map(corners) {
        let (p, q, r) = (p - base, q - base, r - base);
        let triangle_area = 0.5 * (q - p).cross(r - p).length();
        let sum = p + q + r;
        area += triangle_area;
        first += sum * (triangle_area / 3.0);
        second += (outer(p) + outer(q) + outer(r) + outer(sum)) * (triangle_area / 12.0);
    }
    if !(area > 0.0 && area.is_finite()) {
        return None;
    }
    let centroid = first / area;
    let axes = principal_axes(second * (1.0 / area) - outer(centroid))?;
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in triangles.iter().flat_map(corners) {
        let local = axes.transpose() * (p - base - centroid);
        low = low.min(local);
        high = high.max(local);
    }
    let extent = high - low;
    let (length, thick, thin) = (extent.x, extent.y.max(extent.z), extent.y.min(extent.z));
    if length < LENGTH_RATIO * thick || thick > CROSS_RATIO * thin || !length.is_finite() {
        return None;
    }
    // One of two directions, always the same one.
    let mut axis = axes.x_axis;
    let (mut from, mut to) = (low.x, high.x);
    let leading = axis.abs();
    let largest = if leading.x >= leading.y.max(leading.z) {
        axis.x
    } else if leading.y >= leading.z {
        axis.y
    } else {
        axis.z
    };
    if largest < 0.0 {
        axis = -axis;
        (from, to) = (-to, -from);
    }
    let middle = transform.transform_point3(source.center) + base + centroid;
    Some(Tube {
        a: middle + axis * from,
        b: middle + axis * to,
        radius: 0.25 * (thick + thin),
        area,
    })
}

/// The tube that a cylinder forms, if it is long and thin.
fn cylinder_tube(shape: &Shape, transform: &DAffine3) -> Option<Tube> {
    let Shape::Cylinder { a, b, radius, capped } = *shape else {
        return None;
    };
    let (a, b, radius) = (a.as_dvec3(), b.as_dvec3(), f64::from(radius));
    let (u, v) = (b - a).try_normalize()?.any_orthonormal_pair();
    let across = [u, v].map(|w| (transform.matrix3 * w).length() * radius);
    let (thick, thin) = (across[0].max(across[1]), across[0].min(across[1]));
    let (a, b) = (transform.transform_point3(a), transform.transform_point3(b));
    let length = a.distance(b);
    if length < LENGTH_RATIO * 2.0 * thick || thick > CROSS_RATIO * thin {
        return None;
    }
    let radius = 0.5 * (thick + thin);
    let caps = if capped { 2.0 * PI * radius * radius } else { 0.0 };
    Some(Tube {
        a,
        b,
        radius,
        area: 2.0 * PI * radius * length + caps,
    })
}

/// Orthonormal eigenvectors of a symmetric matrix, the one of the largest eigenvalue first; cyclic Jacobi rotations.
fn principal_axes(matrix: DMat3) -> Option<DMat3> {
    let scale = matrix
        .to_cols_array()
        .into_iter()
        .fold(0.0f64, |m, x| m.max(x.abs()));
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let mut a = matrix * (1.0 / scale);
    let mut vectors = DMat3::IDENTITY;
    // Converges quadratically: six sweeps are enough, the rest is for safety.
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = a.col(p)[q];
            if off.abs() < 1e-300 {
                continue;
            }
            // The rotation that makes this element zero (Golub and Van Loan, Matrix Computations, section 8.5).
            let theta: f64 = (a.col(q)[q] - a.col(p)[p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            let mut rotation = DMat3::IDENTITY;
            rotation.col_mut(p)[p] = c;
            rotation.col_mut(q)[q] = c;
            rotation.col_mut(q)[p] = s;
            rotation.col_mut(p)[q] = -s;
            a = rotation.transpose() * a * rotation;
            vectors *= rotation;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a.col(j)[j].total_cmp(&a.col(i)[i]));
    Some(DMat3::from_cols(
        vectors.col(order[0]),
        vectors.col(order[1]),
        vectors.col(order[2]),
    ))
}

/// The mesh without some triangles.
fn without(mesh: &Mesh, gone: impl Iterator<Item = u32>) -> Mesh {
    let mut mesh = mesh.clone();
    let mut keep = vec![true; mesh.triangles.len()];
    gone.for_each(|triangle| keep[triangle as usize] = false);
    let mut flags = keep.into_iter();
    retain_triangles(&mut mesh.triangles, &mut mesh.materials, |_| {
        flags.next().unwrap_or(true)
    });
    drop_unused_vertices(&mut mesh);
    mesh
}

/// Names of the materials that geometry uses, those most like `asked` first.
fn nearest_names(asked: &str, import: &Import) -> Vec<String> {
    let mut used = vec![false; import.materials.len()];
    for object in &import.objects {
        match object.geometry {
            Geometry::Primitive(primitive) => used[primitive.material.index()] = true,
            Geometry::Mesh(id) => {
                for material in &import.meshes[id.index()].mesh.materials {
                    used[material.index()] = true;
                }
            }
        }
    }
    let mut names: Vec<String> = import
        .materials
        .iter()
        .zip(used)
        .filter(|(material, used)| *used && !material.name.is_empty())
        .map(|(material, _)| material.name.clone())
        .collect();
    names.sort();
    names.dedup();
    names.sort_by_cached_key(|name| distance(asked, name));
    names
}

/// Insertions, deletions and changes of letters that lead from one name to the other, whatever their case; only the
/// first 64 letters count.
fn distance(a: &str, b: &str) -> usize {
    let letters = |s: &str| {
        s.chars()
            .take(64)
            .flat_map(char::to_lowercase)
            .collect::<Vec<_>>()
    };
    let (a, b) = (letters(a), letters(b));
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let change = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
