//! The edges of a mesh, ready to be asked for silhouettes.

mod repair;

use glam::{DVec3, Vec3};
use llsr_intervals::{Plane, PlaneTree, QueryScratch, QueryStatistics, Select, TreeOptions, Viewpoint};
use llsr_scene::{Adjacency, Bounds, Edge, Mesh, NO_FACE};

/// How the edges of a mesh are prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeOptions {
    /// Dihedral angle between neighbouring normals (degrees, 0 to 180) above which an edge is a crease
    /// (Bala et al. 2003, section 6.2: 85). Edges between two materials are creases at any angle.
    pub crease_degrees: f64,
    /// How the trees are built.
    pub tree: TreeOptions,
}

impl Default for EdgeOptions {
    fn default() -> Self {
        Self {
            crease_degrees: 85.0,
            tree: TreeOptions::default(),
        }
    }
}

/// A mesh that edges cannot be found on: an index out of range, a coordinate that is not finite, or lists of
/// different lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidMesh;

impl std::fmt::Display for InvalidMesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the mesh has an index out of range or a coordinate that is not finite")
    }
}

impl std::error::Error for InvalidMesh {}

/// What was found and repaired in a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EdgeReport {
    /// Faces left out because two of their corners coincide.
    pub collapsed_faces: usize,
    /// Faces whose corners lie exactly on a line; their neighbours are joined across them.
    pub flat_faces: usize,
    /// Edges of one face.
    pub boundary_edges: usize,
    /// Edges at which more than two faces meet.
    pub non_manifold_edges: usize,
    /// Edges whose two faces are oriented against each other.
    pub flipped_edges: usize,
    /// Edges between faces in one plane, which can be no silhouette and are left out.
    pub plane_edges: usize,
}

/// Edges found for a view, as numbers of [`MeshEdges::edge`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FoundEdges {
    /// Edges at which the surface turns away from the viewer.
    pub silhouettes: Vec<u32>,
    /// Sharp edges that face the viewer.
    pub creases: Vec<u32>,
}

impl FoundEdges {
    /// Forgets the edges and keeps the memory.
    pub fn clear(&mut self) {
        self.silhouettes.clear();
        self.creases.clear();
    }
}

/// Working memory of silhouette queries.
#[derive(Clone, Debug, Default)]
pub struct EdgeScratch {
    tree: QueryScratch,
    pairs: Vec<u32>,
}

/// The welded edges of a mesh with the trees that find silhouettes and creases among them.
///
/// Everything is in the object's own frame; to ask for an instance, bring the viewer into that frame.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use llsr_edges::{EdgeOptions, EdgeScratch, FoundEdges, MeshEdges};
/// use llsr_intervals::Viewpoint;
/// use llsr_scene::{MaterialId, Mesh};
///
/// let cube = Mesh::cuboid("cube", Vec3::ZERO, Vec3::ONE, MaterialId(0));
/// let edges = MeshEdges::new(&cube, EdgeOptions::default()).unwrap();
/// let mut found = FoundEdges::default();
/// let corner = Viewpoint::at(DVec3::splat(3.0)).unwrap();
/// edges.find(&corner, &mut EdgeScratch::default(), &mut found);
/// assert_eq!(found.silhouettes.len(), 6, "a hexagon");
/// assert_eq!(found.creases.len(), 3, "three edges meet at the near corner");
/// ```
#[derive(Clone, Debug)]
pub struct MeshEdges {
    positions: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    /// Pairs of faces, in the order of their tree unless the mesh has non-manifold edges; then boundary edges.
    edges: Vec<Edge>,
    /// Number of pairs in `edges`.
    pairs: usize,
    /// The ends of all edges once more: a view asks for those of many.
    ends: Vec<[Vec3; 2]>,
    tree: PlaneTree<2>,
    crease_tree: PlaneTree<2>,
    /// The edge of each item of the crease tree.
    creases: Vec<u32>,
    closed: bool,
    bounds: Bounds,
    report: EdgeReport,
}

impl MeshEdges {
    /// Finds and sorts the edges of `mesh`.
    ///
    /// Vertices at equal positions are welded first. Cost: O(n log n), about 0.6 s for 1.3 million edges on one
    /// core; the `rayon` feature uses all, with the same result.
    ///
    /// # Errors
    /// If the mesh is not valid.
    pub fn new(mesh: &Mesh, options: EdgeOptions) -> Result<Self, InvalidMesh> {
        if !mesh.is_valid() {
            return Err(InvalidMesh);
        }
        let adjacency = Adjacency::new(&mesh.positions, &mesh.triangles);
        let closed = adjacency.is_closed();
        let positions: Vec<Vec3> = adjacency
            .weld
            .representative
            .iter()
            .map(|&v| mesh.positions[v as usize])
            .collect();
        let mut report = EdgeReport {
            collapsed_faces: adjacency.degenerate_faces,
            ..EdgeReport::default()
        };
        let Adjacency { faces, mut edges, .. } = adjacency;
        report.flat_faces = repair::join_across_flat_faces(&positions, &faces, &mut edges);

        let corners = |face: u32| faces[face as usize].map(|v| positions[v as usize].as_dvec3());
        let planes = face_planes(faces.len(), |face| Plane::of(corners(face as u32)));
        let plane = |face: u32| planes[face as usize];
        let is_pair = |edge: &Edge| edge.faces[1] != NO_FACE;
        report.boundary_edges = edges.iter().filter(|edge| !is_pair(edge)).count();
        report.non_manifold_edges = count_groups(&edges);
        report.flipped_edges = edges.iter().filter(|edge| edge.flipped).count();
        // Where two materials meet shading jumps, however flat the surface.
        let is_border = |edge: &Edge| {
            let [a, b] = edge.faces;
            is_pair(edge) && mesh.materials[a as usize] != mesh.materials[b as usize]
        };
        let before = edges.len();
        edges.retain(|edge| is_border(edge) || !repair::lies_in_one_plane(edge, &faces, &positions, &planes));
        report.plane_edges = before - edges.len();
        // Stable, so edges keep their order within both parts and entries of one edge stay together.
        edges.sort_by_key(|edge| !is_pair(edge));
        let pairs = edges.partition_point(is_pair);

        let bounds = Bounds::of(positions.iter().copied());
        let center = bounds.center().as_dvec3();
        // Computed in double precision: the box of a huge mesh may have a diagonal beyond single precision.
        let radius = if bounds.is_empty() {
            0.0
        } else {
            (bounds.max.as_dvec3() - center).length() * (1.0 + 1e-6)
        };
        let two_planes = |edge: &Edge| {
            let (a, b) = (plane(edge.faces[0])?, plane(edge.faces[1])?);
            Some([a, if edge.flipped { b.flipped() } else { b }])
        };
        let extent = |edge: &Edge| {
            let [a, b] = edge.vertices.map(|v| positions[v as usize]);
            (a.min(b), a.max(b))
        };
        let build = |count: usize, edge: &(dyn Fn(u32) -> Edge + Sync)| {
            PlaneTree::build(
                count as u32,
                center,
                radius,
                |item| two_planes(&edge(item)),
                |item| extent(&edge(item)),
                options.tree,
            )
        };
        let mut tree = build(pairs, &|item| edges[item as usize]);
        // What is found together is then near each other. Entries of one edge have to stay together.
        if report.non_manifold_edges == 0 {
            let ordered: Vec<Edge> = tree.renumber().iter().map(|&edge| edges[edge as usize]).collect();
            edges[..pairs].copy_from_slice(&ordered);
        }
        let least_cosine = options.crease_degrees.to_radians().cos();
        let is_crease = |edge: &Edge| {
            is_border(edge)
                || two_planes(edge).is_some_and(|[a, b]| a.normal().dot(b.normal()) < least_cosine)
        };
        let creases: Vec<u32> = (0..pairs as u32)
            .filter(|&e| is_crease(&edges[e as usize]))
            .collect();
        let crease_tree = build(creases.len(), &|item| edges[creases[item as usize] as usize]);
        let ends = edges
            .iter()
            .map(|edge| edge.vertices.map(|v| positions[v as usize]));
        Ok(Self {
            ends: ends.collect(),
            tree,
            crease_tree,
            creases,
            positions,
            faces,
            edges,
            pairs,
            closed,
            bounds,
            report,
        })
    }

    /// Number of edges, with one number for each further face of a non-manifold edge.
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// There are no edges.
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// An edge over welded vertices.
    ///
    /// # Panics
    /// If there is no such edge.
    pub fn edge(&self, edge: u32) -> &Edge {
        &self.edges[edge as usize]
    }

    /// The ends of an edge (m).
    ///
    /// Edges that are found together mostly have numbers near each other, and so their ends lie near each other in memory.
    ///
    /// # Panics
    /// If there is no such edge.
    pub fn segment(&self, edge: u32) -> [Vec3; 2] {
        self.ends[edge as usize]
    }

    /// Welded positions (m).
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Faces over welded vertices, in the order of the mesh's triangles.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Corners of a face.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn corners(&self, face: u32) -> [DVec3; 3] {
        // Written out: as a closure in a map it is not always inlined.
        let [a, b, c] = self.faces[face as usize];
        [
            self.positions[a as usize].as_dvec3(),
            self.positions[b as usize].as_dvec3(),
            self.positions[c as usize].as_dvec3(),
        ]
    }

    /// Edges of a single face; they bound the surface from every side, so they are silhouettes of every view.
    pub fn boundaries(&self) -> std::ops::Range<u32> {
        self.pairs as u32..self.edges.len() as u32
    }

    /// All sharp edges, whether they face a viewer or not.
    pub fn all_creases(&self) -> &[u32] {
        &self.creases
    }

    /// True if every edge is shared by exactly two faces of matching orientation, so that no back face is seen
    /// from outside.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Bounding box (m).
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// What was found and repaired.
    pub fn report(&self) -> EdgeReport {
        self.report
    }

    /// The tree over the pairs of faces.
    pub fn tree(&self) -> &PlaneTree<2> {
        &self.tree
    }

    /// True if `viewer` is strictly in front of a face's plane.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn sees_front(&self, viewer: &Viewpoint, face: u32) -> bool {
        viewer.sees_front(self.corners(face))
    }

    /// Do both faces of a pair face the viewer, with the second turned to match the first? (one side each)
    fn fronts(&self, viewer: &Viewpoint, edge: u32) -> [bool; 2] {
        let Edge {
            faces: [first, second],
            flipped,
            ..
        } = self.edges[edge as usize];
        [
            self.sees_front(viewer, first),
            self.sees_front(viewer, second) != flipped,
        ]
    }

    /// Writes to `found` the silhouette edges and the creases that `viewer` may see; those hidden behind other
    /// parts are among them.
    ///
    /// An edge is a silhouette if all its faces lie on one side of it as the viewer sees them: equation 1 of Bala
    /// et al. (2003) for two faces of matching orientation, and its extension to meshes whose orientations do not
    /// match or where more faces meet. Creases are sharp edges whose faces both look at the viewer, and on an open
    /// mesh, whose surfaces are seen from both sides, those that both look away.
    pub fn find(
        &self,
        viewer: &Viewpoint,
        scratch: &mut EdgeScratch,
        found: &mut FoundEdges,
    ) -> QueryStatistics {
        found.clear();
        let statistics = self.silhouettes(viewer, scratch, &mut found.silhouettes);
        self.creases(viewer, scratch, &mut found.creases);
        statistics
    }

    /// Appends the silhouette edges of a view, boundaries left out (they are [`boundaries`](Self::boundaries)).
    pub fn silhouettes(
        &self,
        viewer: &Viewpoint,
        scratch: &mut EdgeScratch,
        found: &mut Vec<u32>,
    ) -> QueryStatistics {
        let exact = |edge: u32| {
            let [a, b] = self.fronts(viewer, edge);
            a != b
        };
        let start = found.len();
        let viewers = std::slice::from_ref(viewer);
        let statistics = self
            .tree
            .query(viewers, Select::Mixed, exact, &mut scratch.tree, found);
        if self.report.non_manifold_edges > 0 {
            self.keep_whole_groups(start, scratch, found);
        }
        statistics
    }

    /// Appends the pairs that may be silhouettes for some point in the convex hull of `viewers`.
    ///
    /// Entries of non-manifold edges are not put together.
    pub fn possible_silhouettes(
        &self,
        viewers: &[Viewpoint],
        scratch: &mut EdgeScratch,
        found: &mut Vec<u32>,
    ) -> QueryStatistics {
        let exact = |edge: u32| {
            let mut fronts = viewers.iter().flat_map(|viewer| self.fronts(viewer, edge));
            let first = fronts.next();
            fronts.any(|front| Some(front) != first)
        };
        self.tree
            .query(viewers, Select::Mixed, exact, &mut scratch.tree, found)
    }

    fn creases(&self, viewer: &Viewpoint, scratch: &mut EdgeScratch, found: &mut Vec<u32>) {
        let start = found.len();
        let viewers = std::slice::from_ref(viewer);
        let sides: &[(Select, bool)] = if self.closed {
            &[(Select::AllFront, true)]
        } else {
            &[(Select::AllFront, true), (Select::AllBack, false)]
        };
        for &(select, front) in sides {
            let exact = |item: u32| self.fronts(viewer, self.creases[item as usize]) == [front; 2];
            self.crease_tree
                .query(viewers, select, exact, &mut scratch.tree, found);
        }
        for item in &mut found[start..] {
            *item = self.creases[*item as usize];
        }
        if self.report.non_manifold_edges > 0 {
            // One number for each edge, whichever of its pairs is sharp.
            found[start..].sort_unstable();
            let mut last = None;
            let mut kept = start;
            for i in start..found.len() {
                let edge = found[i];
                let first = self.group(edge).start;
                if last != Some(first) {
                    found[kept] = edge;
                    kept += 1;
                }
                last = Some(first);
            }
            found.truncate(kept);
        }
    }

    /// The entries that stand for the same edge as `edge`: several at a non-manifold edge.
    fn group(&self, edge: u32) -> std::ops::Range<u32> {
        let this = &self.edges[edge as usize];
        if !this.non_manifold {
            return edge..edge + 1;
        }
        let same = |other: &Edge| other.non_manifold && same_ends(other, this);
        let before = self.edges[..edge as usize]
            .iter()
            .rev()
            .take_while(|e| same(e))
            .count() as u32;
        let after = self.edges[edge as usize..].iter().take_while(|e| same(e)).count() as u32;
        edge - before..edge + after
    }

    /// Of the non-manifold entries in `found[start..]` keeps one for each edge all of whose entries are there:
    /// only then do all its faces lie on one side.
    fn keep_whole_groups(&self, start: usize, scratch: &mut EdgeScratch, found: &mut Vec<u32>) {
        let pairs = &mut scratch.pairs;
        pairs.clear();
        let mut kept = start;
        for i in start..found.len() {
            if self.edges[found[i] as usize].non_manifold {
                pairs.push(found[i]);
            } else {
                found[kept] = found[i];
                kept += 1;
            }
        }
        found.truncate(kept);
        pairs.sort_unstable();
        let mut rest = pairs.as_slice();
        while let Some(&edge) = rest.first() {
            let group = self.group(edge);
            let present = rest.iter().take_while(|&&e| e < group.end).count();
            if present == group.len() {
                found.push(edge);
            }
            rest = &rest[present..];
        }
    }
}

fn same_ends(a: &Edge, b: &Edge) -> bool {
    a.vertices == b.vertices || (a.vertices[0] == b.vertices[1] && a.vertices[1] == b.vertices[0])
}

/// Number of edges that stand several times.
fn count_groups(edges: &[Edge]) -> usize {
    edges
        .iter()
        .filter(|edge| edge.non_manifold)
        .fold((0, None::<&Edge>), |(count, last), edge| {
            let new = last.is_none_or(|last| !same_ends(last, edge));
            (count + usize::from(new), Some(edge))
        })
        .0
}

fn face_planes(count: usize, plane: impl Fn(usize) -> Option<Plane> + Sync) -> Vec<Option<Plane>> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (0..count)
            .into_par_iter()
            .with_min_len(4096)
            .map(&plane)
            .collect()
    }
    #[cfg(not(feature = "rayon"))]
    (0..count).map(plane).collect()
}
