//! Edges found in a scene, class by class.

use glam::Vec3;
use llsr_scene::ObjectId;

/// Why an edge is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum EdgeClass {
    /// The surface turns away from the viewer.
    Silhouette,
    /// A sharp edge of which the viewer sees both faces.
    Crease,
    /// The border of an open surface.
    Boundary,
}

impl EdgeClass {
    /// All classes, in the order in which they are found.
    pub const ALL: [Self; 3] = [Self::Silhouette, Self::Crease, Self::Boundary];

    /// The class in one word of lower-case letters.
    pub fn name(self) -> &'static str {
        match self {
            Self::Silhouette => "silhouette",
            Self::Crease => "crease",
            Self::Boundary => "boundary",
        }
    }
}

/// Consecutive edges of one object and class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeRun {
    /// The object.
    pub object: ObjectId,
    /// Their class.
    pub class: EdgeClass,
    /// Position of the first in [`SceneFound::segments`] and [`SceneFound::edges`].
    pub start: u32,
    /// Position after the last.
    pub end: u32,
}

impl EdgeRun {
    /// The positions.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// One edge that a viewer may see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewedEdge {
    /// The object that it belongs to.
    pub object: ObjectId,
    /// Why it is drawn.
    pub class: EdgeClass,
    /// Number of the edge in its [`MeshEdges`](crate::MeshEdges); for a primitive, of the curve that it is a piece of (see
    /// [`outline`](crate::outline)).
    pub edge: u32,
    /// Its ends (m, recentred frame).
    pub segment: [Vec3; 2],
}

/// Edges found in a scene, as a structure of arrays.
///
/// Edges of one object that meet have bitwise equal ends there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneFound {
    segments: Vec<[Vec3; 2]>,
    edges: Vec<u32>,
    runs: Vec<EdgeRun>,
}

impl SceneFound {
    /// Forgets the edges and keeps the memory.
    pub fn clear(&mut self) {
        self.segments.clear();
        self.edges.clear();
        self.runs.clear();
    }

    /// Number of edges.
    pub fn len(&self) -> usize {
        self.segments.len()
    }

    /// There are no edges.
    pub fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// The ends of all edges (m, recentred frame).
    pub fn segments(&self) -> &[[Vec3; 2]] {
        &self.segments
    }

    /// For each edge its number in its object, as in [`ViewedEdge::edge`].
    pub fn edges(&self) -> &[u32] {
        &self.edges
    }

    /// Which edges belong to which object and class; none is empty.
    pub fn runs(&self) -> &[EdgeRun] {
        &self.runs
    }

    /// Number of edges of a class.
    pub fn count(&self, class: EdgeClass) -> usize {
        let runs = self.runs.iter().filter(|run| run.class == class);
        runs.map(|run| run.range().len()).sum()
    }

    /// All edges with what is known about them.
    pub fn iter(&self) -> impl Iterator<Item = ViewedEdge> + '_ {
        self.runs.iter().flat_map(|run| {
            run.range().map(|at| ViewedEdge {
                object: run.object,
                class: run.class,
                edge: self.edges[at],
                segment: self.segments[at],
            })
        })
    }

    pub(super) fn begin(&mut self, object: ObjectId, class: EdgeClass) {
        let start = self.segments.len() as u32;
        self.runs.push(EdgeRun {
            object,
            class,
            start,
            end: start,
        });
    }

    pub(super) fn push(&mut self, edge: u32, segment: [Vec3; 2]) {
        self.edges.push(edge);
        self.segments.push(segment);
    }

    /// Appends as many segments as edges.
    pub(super) fn extend(
        &mut self,
        edges: impl Iterator<Item = u32>,
        segments: impl Iterator<Item = [Vec3; 2]>,
    ) {
        self.edges.extend(edges);
        self.segments.extend(segments);
    }

    /// Closes the run that was begun; drops it if nothing was pushed.
    pub(super) fn end(&mut self) {
        let end = self.segments.len() as u32;
        if let Some(run) = self.runs.last_mut() {
            run.end = end;
            if run.start == end {
                self.runs.pop();
            }
        }
    }
}
