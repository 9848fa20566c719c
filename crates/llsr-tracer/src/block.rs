//! Blocks of triangles over shared vertices.
//!
//! Neighbouring triangles share most of their vertices, so a block holds each vertex once: a patch of up to sixteen
//! triangles takes 256 bytes, and what is computed a vertex (where it lies about a ray, or on which side of
//! a fan) is computed once and is the same for all triangles that meet there.

use glam::Vec3;

/// The most triangles and the most vertices of a block.
pub(crate) const BLOCK: usize = 16;

/// Which triangle of which object a lane holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TriangleId {
    pub(crate) object: u32,
    pub(crate) triangle: u32,
}

/// Up to sixteen triangles over up to sixteen vertices, in structure-of-arrays form.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct TriangleBlock {
    /// `vertices[axis][vertex]`; unused places repeat the first vertex.
    pub(crate) vertices: [[f32; BLOCK]; 3],
    /// `corners[corner][triangle]`; unused triangles have three equal corners.
    pub(crate) corners: [[u8; BLOCK]; 3],
    /// At least the longest edge (m).
    pub(crate) longest_edge: f32,
    /// One bit a used triangle.
    pub(crate) used: u32,
}

impl TriangleBlock {
    /// Packs triangles given by their vertices' numbers and positions.
    ///
    /// # Panics
    /// If there are more than [`BLOCK`] triangles or different vertices.
    pub(crate) fn new(triangles: impl IntoIterator<Item = [u32; 3]>, positions: &[Vec3]) -> Self {
        let mut numbers = [0u32; BLOCK];
        let mut count = 0;
        let mut block = Self {
            vertices: [[0.0; BLOCK]; 3],
            corners: [[0; BLOCK]; 3],
            longest_edge: 0.0,
            used: 0,
        };
        for (lane, triangle) in triangles.into_iter().enumerate() {
            for (corner, &number) in triangle.iter().enumerate() {
                let place = numbers[..count]
                    .iter()
                    .position(|&n| n == number)
                    .unwrap_or_else(|| {
                        numbers[count] = number;
                        count += 1;
                        count - 1
                    });
                block.corners[corner][lane] = place as u8;
            }
            let [a, b, c] = triangle.map(|v| positions[v as usize]);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            // The distance is rounded a few times.
            block.longest_edge = block.longest_edge.max(longest * (1.0 + 8.0 * f32::EPSILON));
            block.used |= 1 << lane;
        }
        for place in 0..BLOCK {
            let number = numbers[if place < count { place } else { 0 }];
            for (row, x) in block
                .vertices
                .iter_mut()
                .zip(positions[number as usize].to_array())
            {
                row[place] = x;
            }
        }
        block
    }

    /// The vertex at a place below [`BLOCK`].
    #[inline]
    pub(crate) fn vertex(&self, place: u8) -> Vec3 {
        let place = usize::from(place) & (BLOCK - 1);
        let [x, y, z] = &self.vertices;
        Vec3::new(x[place], y[place], z[place])
    }

    /// The places of the corners of a triangle below [`BLOCK`].
    #[inline(always)]
    pub(crate) fn places(&self, lane: usize) -> [usize; 3] {
        let lane = lane & (BLOCK - 1);
        let [a, b, c] = &self.corners;
        [a[lane].into(), b[lane].into(), c[lane].into()]
    }

    /// The corners of a used triangle.
    #[inline]
    pub(crate) fn triangle(&self, lane: usize) -> [Vec3; 3] {
        let [a, b, c] = &self.corners;
        [a[lane], b[lane], c[lane]].map(|place| self.vertex(place))
    }
}
