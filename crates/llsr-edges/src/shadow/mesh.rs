//! A mesh ready to cast and to receive shadows.

use std::cmp::Ordering;
use std::sync::Arc;

use glam::DVec3;
use llsr_intervals::{FaceTree, orientation};
use llsr_scene::NO_FACE;

use crate::MeshEdges;

/// Edges, the faces around each vertex, and the tree of faces that shadow events are intersected with.
#[derive(Clone, Debug)]
pub struct ShadowMesh {
    edges: Arc<MeshEdges>,
    /// What is around vertex v is in `star[starts[v]..starts[v + 1]]`.
    starts: Vec<u32>,
    star: Vec<u32>,
    /// A bit for each vertex whose star is a ring.
    rings: Vec<u64>,
    /// A bit for each convex edge.
    convex: Vec<u64>,
    faces: FaceTree,
    /// Every part is closed and looks outwards, so that each concave edge lies inside the solid's reach.
    solid: bool,
}

/// What is around a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Star<'a> {
    /// Its faces close up: the vertices around it, in the order in which its faces join each to the next.
    Ring(&'a [u32]),
    /// Its faces.
    Faces(&'a [u32]),
}

/// Most vertices in a ring, so that a bit for each fits a word.
pub(super) const RING: usize = 64;

impl ShadowMesh {
    /// Prepares a mesh whose edges are known. Cost: O(n log n), about as much as the edges.
    pub fn new(edges: Arc<MeshEdges>) -> Self {
        let usable = |face: &[u32; 3]| face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
        let mut starts = vec![0u32; edges.positions().len() + 1];
        for &v in edges.faces().iter().filter(|f| usable(f)).flatten() {
            starts[v as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut star = vec![0u32; starts.last().map_or(0, |&n| n as usize)];
        let mut next = starts.clone();
        for (face, corners) in edges.faces().iter().enumerate() {
            if usable(corners) {
                for &v in corners {
                    star[next[v as usize] as usize] = face as u32;
                    next[v as usize] += 1;
                }
            }
        }
        let (star, rings) = rings(&edges, &starts, &star);
        let convex = bits(edges.len(), |edge| is_convex(&edges, edge as u32));
        let bounds = edges.bounds();
        let center = bounds.center().as_dvec3();
        let radius = if bounds.is_empty() {
            0.0
        } else {
            (bounds.max.as_dvec3() - center).length() * (1.0 + 1e-6)
        };
        let count = u32::try_from(edges.faces().len()).unwrap_or(u32::MAX);
        let faces = FaceTree::build(count, center, radius, |face| edges.corners(face));
        let solid = edges.is_closed() && looks_outwards(&edges);
        Self {
            edges,
            starts,
            star,
            rings,
            convex,
            faces,
            solid,
        }
    }

    /// Its edges.
    pub fn edges(&self) -> &Arc<MeshEdges> {
        &self.edges
    }

    /// The tree of its faces.
    pub fn faces(&self) -> &FaceTree {
        &self.faces
    }

    /// True if every part is closed and encloses a positive volume: then nothing outside sees a back face.
    pub fn is_solid(&self) -> bool {
        self.solid
    }

    /// The faces or vertices around a vertex.
    pub(super) fn star(&self, vertex: u32) -> Star<'_> {
        let star =
            &self.star[self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize];
        if is_set(&self.rings, vertex) {
            Star::Ring(star)
        } else {
            Star::Faces(star)
        }
    }

    pub(super) fn position(&self, vertex: u32) -> DVec3 {
        self.edges.positions()[vertex as usize].as_dvec3()
    }

    /// The corner of a face that is not on the edge a-b.
    pub(super) fn opposite(&self, face: u32, ends: [u32; 2]) -> Option<u32> {
        opposite(&self.edges, face, ends)
    }

    /// True if the faces of an edge enclose less than 180 degrees behind them. False for boundaries, and where two
    /// faces lie in one plane.
    pub(super) fn is_convex(&self, edge: u32) -> bool {
        is_set(&self.convex, edge)
    }
}

fn opposite(edges: &MeshEdges, face: u32, [a, b]: [u32; 2]) -> Option<u32> {
    let corners = edges.faces().get(face as usize)?;
    corners.iter().copied().find(|&v| v != a && v != b)
}

fn is_convex(edges: &MeshEdges, edge: u32) -> bool {
    let edge = edges.edge(edge);
    if edge.faces[1] == NO_FACE {
        return false;
    }
    let Some(far) = opposite(edges, edge.faces[1], edge.vertices) else {
        return false;
    };
    let [a, b, c] = edges.corners(edge.faces[0]);
    orientation(a, b, c, edges.positions()[far as usize].as_dvec3()) == Ordering::Less
}

fn is_set(bits: &[u64], number: u32) -> bool {
    bits[number as usize / 64] >> (number % 64) & 1 == 1
}

/// A bit for each number below `count`.
fn bits(count: usize, is_set: impl Fn(usize) -> bool + Sync) -> Vec<u64> {
    chunks(count.div_ceil(64), |word| {
        (64 * word..count.min(64 * word + 64)).fold(0, |bits, i| bits | u64::from(is_set(i)) << (i % 64))
    })
}

/// `f` of every number below `count`; on all threads with the `rayon` feature.
fn chunks<T: Send>(count: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().with_min_len(64).map(&f).collect()
    }
    #[cfg(not(feature = "rayon"))]
    (0..count).map(f).collect()
}

/// The same stars with rings of vertices in place of the faces that close up, and a bit for each of these.
fn rings(edges: &MeshEdges, starts: &[u32], star: &[u32]) -> (Vec<u32>, Vec<u64>) {
    let parts = chunks(edges.positions().len().div_ceil(64), |word| {
        let (mut part, mut bits) = (Vec::new(), 0u64);
        let mut arms = Vec::new();
        let vertices = 64 * word..edges.positions().len().min(64 * word + 64);
        for vertex in vertices {
            let faces = &star[starts[vertex] as usize..starts[vertex + 1] as usize];
            if ring(edges, vertex as u32, faces, &mut arms) {
                bits |= 1 << (vertex % 64);
                part.extend(arms.iter().map(|arm| arm[0]));
            } else {
                part.extend(faces);
            }
        }
        (part, bits)
    });
    let bits = parts.iter().map(|(_, bits)| *bits).collect();
    (parts.into_iter().flat_map(|(part, _)| part).collect(), bits)
}

/// Puts the other two corners of the faces at `vertex` in the order in which these follow each other. False if they do
/// not close up to one ring of faces of matching orientation.
fn ring(edges: &MeshEdges, vertex: u32, faces: &[u32], arms: &mut Vec<[u32; 2]>) -> bool {
    if !(3..=RING).contains(&faces.len()) {
        return false;
    }
    arms.clear();
    for &face in faces {
        let corners = edges.faces()[face as usize];
        let Some(place) = corners.iter().position(|&v| v == vertex) else {
            return false;
        };
        arms.push([corners[(place + 1) % 3], corners[(place + 2) % 3]]);
    }
    for i in 1..arms.len() {
        let end = arms[i - 1][1];
        let Some(next) = (i..arms.len()).find(|&k| arms[k][0] == end) else {
            return false;
        };
        arms.swap(i, next);
        // Back at the start before all faces are there: several rings.
        if arms[i - 1][1] == arms[0][0] {
            return false;
        }
    }
    arms[arms.len() - 1][1] == arms[0][0]
}

/// Does every connected part enclose a positive volume?
fn looks_outwards(edges: &MeshEdges) -> bool {
    let count = edges.positions().len();
    let mut parent: Vec<u32> = (0..count as u32).collect();
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            let up = parent[parent[v as usize] as usize];
            parent[v as usize] = up;
            v = up;
        }
        v
    }
    for &[a, b, c] in edges.faces() {
        let (x, y) = (root(&mut parent, a), root(&mut parent, b));
        parent[x.max(y) as usize] = x.min(y);
        let (x, y) = (root(&mut parent, a), root(&mut parent, c));
        parent[x.max(y) as usize] = x.min(y);
    }
    let mut volume = vec![0.0f64; count];
    for (face, corners) in edges.faces().iter().enumerate() {
        let part = root(&mut parent, corners[0]);
        // From a point of the part itself, so that a place far from the origin does not cost digits.
        let origin = edges.positions()[part as usize].as_dvec3();
        let [a, b, c] = edges.corners(face as u32).map(|p| p - origin);
        volume[part as usize] += a.dot(b.cross(c));
    }
    (0..count as u32).all(|v| {
        let used = parent[v as usize] == v && volume[v as usize] != 0.0;
        !used || volume[v as usize] > 0.0
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use llsr_scene::{MaterialId, Mesh};

    use super::*;
    use crate::EdgeOptions;

    fn prepare(mesh: &Mesh) -> ShadowMesh {
        ShadowMesh::new(Arc::new(
            MeshEdges::new(mesh, EdgeOptions::default()).expect("valid"),
        ))
    }

    #[test]
    fn solids_are_told_from_shells_and_rooms() {
        let cube = |at: f32| Mesh::cuboid("", Vec3::splat(at), Vec3::splat(at + 1.0), MaterialId(0));
        let mut two = cube(0.0);
        two.append(&cube(100.0));
        assert!(prepare(&two).is_solid(), "two cubes");
        let mut room = cube(100.0);
        room.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!(!prepare(&room).is_solid(), "a box that looks inwards");
        two.append(&room);
        assert!(!prepare(&two).is_solid(), "one part of three looks inwards");
        let mut open = cube(0.0);
        open.triangles.pop();
        open.materials.pop();
        assert!(!prepare(&open).is_solid(), "a face is missing");
    }

    #[test]
    fn stars_and_convexity_of_a_cube() {
        let mesh = prepare(&Mesh::cuboid("", Vec3::ZERO, Vec3::ONE, MaterialId(0)));
        for v in 0..8 {
            let Star::Ring(ring) = mesh.star(v) else {
                panic!("faces close up around {v}");
            };
            assert!((3..=6).contains(&ring.len()), "{} faces at a corner", ring.len());
            for i in 0..ring.len() {
                let [a, b] = [ring[i], ring[(i + 1) % ring.len()]];
                let turned = |f: &[u32; 3]| [[f[0], f[1], f[2]], [f[1], f[2], f[0]], [f[2], f[0], f[1]]];
                assert!(
                    mesh.edges()
                        .faces()
                        .iter()
                        .any(|f| turned(f).contains(&[v, a, b])),
                    "a face joins {a} to {b} around {v}"
                );
            }
        }
        let mut open = Mesh::cuboid("", Vec3::ZERO, Vec3::ONE, MaterialId(0));
        let gone = open.triangles.pop().expect("twelve");
        open.materials.pop();
        let open = prepare(&open);
        for v in 0..8u32 {
            let at_hole = gone.iter().any(|&c| {
                mesh.position(v)
                    == Mesh::cuboid("", Vec3::ZERO, Vec3::ONE, MaterialId(0)).positions[c as usize].as_dvec3()
            });
            assert_eq!(matches!(open.star(v), Star::Faces(_)), at_hole, "corner {v}");
        }
        assert!(
            (0..12).all(|e| mesh.is_convex(e)),
            "all edges of a cube are convex"
        );
        assert_eq!(mesh.edges().len(), 12, "diagonals lie in planes");
    }
}
