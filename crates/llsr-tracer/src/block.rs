//! Blocks of eight triangles.

use glam::Vec3;

use crate::build::WIDTH;

/// Which triangle of which object a lane holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TriangleId {
    pub(crate) object: u32,
    pub(crate) triangle: u32,
}

/// Up to eight triangles in structure-of-arrays form; unused lanes hold NaN, which no test accepts.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct TriangleBlock {
    /// `vertices[corner][axis][lane]`.
    pub(crate) vertices: [[[f32; WIDTH]; 3]; 3],
    /// At least the longest edge of any lane (m).
    pub(crate) longest_edge: f32,
    /// Number of used lanes; they come first.
    pub(crate) used: u32,
}

impl TriangleBlock {
    pub(crate) fn new(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Self {
        let mut block = Self {
            vertices: [[[f32::NAN; WIDTH]; 3]; 3],
            longest_edge: 0.0,
            used: 0,
        };
        for (lane, triangle) in triangles.into_iter().enumerate() {
            for (corner, vertex) in triangle.iter().enumerate() {
                for axis in 0..3 {
                    block.vertices[corner][axis][lane] = vertex[axis];
                }
            }
            let [a, b, c] = triangle;
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            // The distance is rounded a few times.
            block.longest_edge = block.longest_edge.max(longest * (1.0 + 8.0 * f32::EPSILON));
            block.used = lane as u32 + 1;
        }
        block
    }

    /// The corners of a used lane.
    #[inline]
    pub(crate) fn triangle(&self, lane: usize) -> [Vec3; 3] {
        self.vertices
            .map(|v| Vec3::new(v[0][lane], v[1][lane], v[2][lane]))
    }
}
