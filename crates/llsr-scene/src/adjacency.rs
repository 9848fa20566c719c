//! Welding of equal positions and the edges between faces.

use glam::Vec3;

/// Marks a missing face of a boundary [`Edge`].
pub const NO_FACE: u32 = u32::MAX;

/// Vertices at bitwise equal positions made one (negative zero equals zero).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Weld {
    /// For each vertex of the mesh, its welded vertex.
    pub welded: Vec<u32>,
    /// For each welded vertex, the first vertex of the mesh at its position.
    pub representative: Vec<u32>,
}

impl Weld {
    /// Welds `positions`. Cost: linear, one open-addressing table.
    ///
    /// # Panics
    /// If there are more than 2^31 positions.
    pub fn new(positions: &[Vec3]) -> Self {
        assert!(positions.len() <= 1 << 31, "a mesh has at most 2^31 vertices");
        const FREE: u32 = u32::MAX;
        let capacity = (positions.len() * 2).next_power_of_two().max(16);
        let shift = 64 - capacity.trailing_zeros();
        let mut table = vec![FREE; capacity];
        let mut welded = Vec::with_capacity(positions.len());
        let mut representative: Vec<u32> = Vec::new();
        // Adding zero turns -0 into 0.
        let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
        for (index, &position) in positions.iter().enumerate() {
            let bits = key(position);
            let mixed = (u64::from(bits[0]) | u64::from(bits[1]) << 32)
                .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                .rotate_left(29)
                .wrapping_add(u64::from(bits[2]))
                .wrapping_mul(0xd6e8_feb8_6659_fd93);
            let mut slot = (mixed >> shift) as usize;
            let id = loop {
                match table[slot] {
                    FREE => {
                        let id = representative.len() as u32;
                        table[slot] = id;
                        representative.push(index as u32);
                        break id;
                    }
                    id if key(positions[representative[id as usize] as usize]) == bits => break id,
                    _ => slot = (slot + 1) & (capacity - 1),
                }
            };
            welded.push(id);
        }
        Self {
            welded,
            representative,
        }
    }
}

/// An edge between two welded vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Welded vertices; the first face runs from the first to the second.
    pub vertices: [u32; 2],
    /// The two faces that share the edge; the second is [`NO_FACE`] at a boundary.
    pub faces: [u32; 2],
    /// True if the second face runs along the edge in the same direction as the first, so that the two faces are
    /// oriented against each other.
    pub flipped: bool,
    /// True if more than two faces meet at this edge; it then stands once for each further face, always with
    /// the same first face.
    pub non_manifold: bool,
}

/// The edges of a mesh after welding.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Adjacency {
    /// Welded vertices.
    pub weld: Weld,
    /// Faces over welded vertices; same order as the mesh's triangles.
    pub faces: Vec<[u32; 3]>,
    /// All edges, ordered by their smaller and then their larger vertex.
    pub edges: Vec<Edge>,
    /// Number of faces with two equal corners after welding; they take part in no edge.
    pub degenerate_faces: usize,
    /// Number of edges of a single face.
    pub boundary_edges: usize,
    /// Number of edges at which more than two faces meet.
    pub non_manifold_edges: usize,
}

impl Adjacency {
    /// Finds the edges of the triangles over `positions`. Cost: linear in practice (counting sort by vertex).
    ///
    /// # Panics
    /// If a triangle names a vertex that does not exist.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let weld = Weld::new(positions);
        let faces: Vec<[u32; 3]> = triangles
            .iter()
            .map(|t| t.map(|v| weld.welded[v as usize]))
            .collect();
        let mut degenerate_faces = 0;

        // Half-edges in buckets by their smaller vertex.
        let mut starts = vec![0u32; weld.representative.len() + 1];
        let is_degenerate = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
        for &face in &faces {
            if is_degenerate(face) {
                degenerate_faces += 1;
                continue;
            }
            for (from, to) in half_edges(face) {
                starts[from.min(to) as usize + 1] += 1;
            }
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let total = starts.last().map_or(0, |&n| n as usize);
        // (larger vertex, face, whether the face runs from the smaller to the larger vertex)
        let mut half = vec![(0u32, 0u32, false); total];
        let mut cursor = starts.clone();
        for (index, &face) in faces.iter().enumerate() {
            if is_degenerate(face) {
                continue;
            }
            for (from, to) in half_edges(face) {
                let place = &mut cursor[from.min(to) as usize];
                half[*place as usize] = (from.max(to), index as u32, from < to);
                *place += 1;
            }
        }

        let mut edges = Vec::with_capacity(total / 2 + 1);
        let (mut boundary_edges, mut non_manifold_edges) = (0, 0);
        for (low, range) in starts.windows(2).enumerate() {
            let bucket = &mut half[range[0] as usize..range[1] as usize];
            bucket.sort_unstable_by_key(|&(high, face, _)| (high, face));
            for run in bucket.chunk_by(|x, y| x.0 == y.0) {
                let (high, first, forward) = run[0];
                let vertices = if forward {
                    [low as u32, high]
                } else {
                    [high, low as u32]
                };
                if run.len() == 1 {
                    boundary_edges += 1;
                    let faces = [first, NO_FACE];
                    edges.push(Edge {
                        vertices,
                        faces,
                        flipped: false,
                        non_manifold: false,
                    });
                }
                let non_manifold = run.len() > 2;
                non_manifold_edges += usize::from(non_manifold);
                for &(_, face, other) in &run[1..] {
                    let faces = [first, face];
                    edges.push(Edge {
                        vertices,
                        faces,
                        flipped: forward == other,
                        non_manifold,
                    });
                }
            }
        }
        Self {
            weld,
            faces,
            edges,
            degenerate_faces,
            boundary_edges,
            non_manifold_edges,
        }
    }

    /// Position of a welded vertex, given the positions that the adjacency was built from.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn position(&self, positions: &[Vec3], vertex: u32) -> Vec3 {
        positions[self.weld.representative[vertex as usize] as usize]
    }

    /// True if every edge is shared by exactly two faces of matching orientation.
    pub fn is_closed(&self) -> bool {
        self.boundary_edges == 0 && self.non_manifold_edges == 0 && self.edges.iter().all(|e| !e.flipped)
    }
}

fn half_edges([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MaterialId, Mesh};

    #[test]
    fn a_cube_is_closed_with_eighteen_edges() {
        let cube = Mesh::cuboid("cube", Vec3::ZERO, Vec3::ONE, MaterialId(0));
        let adjacency = Adjacency::new(&cube.positions, &cube.triangles);
        assert_eq!(adjacency.edges.len(), 18, "12 sides and 6 diagonals");
        assert!(adjacency.is_closed(), "every edge has two faces");
    }

    #[test]
    fn unwelded_corners_are_joined_and_minus_zero_is_zero() {
        let cube = Mesh::cuboid("cube", Vec3::ZERO, Vec3::ONE, MaterialId(0));
        let positions: Vec<Vec3> = (0..12).flat_map(|i| cube.corners(i)).map(|p| p * -1.0).collect();
        let triangles: Vec<[u32; 3]> = (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mut positions_mixed = positions.clone();
        for p in positions_mixed.iter_mut().step_by(2) {
            *p += Vec3::ZERO;
        }
        let adjacency = Adjacency::new(&positions_mixed, &triangles);
        assert_eq!(adjacency.weld.representative.len(), 8, "eight corners stay");
        assert!(adjacency.is_closed(), "welding closes the cube");
    }

    #[test]
    fn boundaries_fans_and_slivers_are_counted() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Y];
        // Three faces around the edge 0-1, and one collapsed face.
        let triangles = [[0, 1, 2], [1, 0, 3], [0, 1, 4], [2, 2, 3]];
        let adjacency = Adjacency::new(&positions, &triangles);
        assert_eq!(adjacency.degenerate_faces, 1, "the face with equal corners");
        assert_eq!(adjacency.non_manifold_edges, 1, "the edge 0-1");
        assert_eq!(adjacency.boundary_edges, 6, "two outer sides of each face");
        let shared: Vec<_> = adjacency.edges.iter().filter(|e| e.non_manifold).collect();
        assert_eq!(shared.len(), 2, "one entry for each further face");
        assert_eq!(
            shared.iter().filter(|e| e.flipped).count(),
            1,
            "one of the two runs the same way"
        );
    }
}
