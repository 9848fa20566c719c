//! One edge in one pixel: sides, areas and lenders, in integers.
//!
//! Coordinates run over the pixel from 0 to [`SIZE`] in each direction, x to the right and y downwards.

/// Width of a pixel in integer units: segment ends, segment centres and region corners all fall on whole numbers.
const SIZE: i32 = 16;

/// The corners in the order of the bits of a corner pattern: top left, top right, bottom right, bottom left.
pub const CORNERS: [(i32, i32); 4] = [(0, 0), (SIZE, 0), (SIZE, SIZE), (0, SIZE)];

/// Where a region of the pixel lies with respect to the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Some edge with this code cuts the region.
    Ambiguous,
    /// Every edge with this code has the region in its primary part.
    Primary,
    /// Every edge with this code has the region in its secondary part.
    Secondary,
}

/// How finely the boundary and the inside of a pixel, or of a quarter of one, are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Boundary segments on each side; 4 or 8.
    pub segments: usize,
    /// Regions along each side; 2 or 4.
    pub regions: usize,
}

impl Grid {
    /// Do both boundary segments lie on the same side of the pixel, which no edge code of an edge does?
    pub fn same_side(self, first: usize, second: usize) -> bool {
        first / self.segments == second / self.segments
    }

    /// Side (0 top, 1 right, 2 bottom, 3 left) of a boundary segment, and where along it the segment starts.
    fn locate(self, segment: usize) -> (usize, i32) {
        (
            segment / self.segments,
            (segment % self.segments) as i32 * self.step(),
        )
    }

    fn step(self) -> i32 {
        SIZE / self.segments as i32
    }

    fn on_side(side: usize, along: i32) -> (i32, i32) {
        match side {
            0 => (along, 0),
            1 => (SIZE, along),
            2 => (along, SIZE),
            _ => (0, along),
        }
    }

    /// The two ends of a boundary segment.
    fn ends(self, segment: usize) -> [(i32, i32); 2] {
        let (side, start) = self.locate(segment);
        [
            Self::on_side(side, start),
            Self::on_side(side, start + self.step()),
        ]
    }

    /// The point that stands for every crossing of a boundary segment: its centre.
    fn centre(self, segment: usize) -> (i32, i32) {
        let (side, start) = self.locate(segment);
        Self::on_side(side, start + self.step() / 2)
    }

    /// Side of the region in `column` and `row`, for *all* edges that cross the boundary somewhere in the two segments.
    ///
    /// For a fixed point p the number cross(b - a, p - a) is linear in a and in b, and so has its extremes
    /// over the two segments at their ends: if p is on one side for the four pairs of ends, it is for all pairs of points.
    /// It is linear in p too, so the corners of the region decide.
    pub fn side(self, first: usize, second: usize, column: usize, row: usize) -> Side {
        if self.same_side(first, second) {
            return Side::Ambiguous;
        }
        let width = SIZE / self.regions as i32;
        let (x, y) = (column as i32 * width, row as i32 * width);
        let (mut any_primary, mut any_secondary) = (false, false);
        for a in self.ends(first) {
            for b in self.ends(second) {
                for p in [(x, y), (x + width, y), (x, y + width), (x + width, y + width)] {
                    any_primary |= cross(a, b, p) > 0;
                    any_secondary |= cross(a, b, p) < 0;
                }
            }
        }
        match (any_primary, any_secondary) {
            (true, false) => Side::Primary,
            (false, true) => Side::Secondary,
            _ => Side::Ambiguous,
        }
    }

    /// Bit c is set if corner c lies in the secondary region of the edge between the centres of the two segments.
    pub fn secondary_corners(self, first: usize, second: usize) -> u8 {
        let (a, b) = (self.centre(first), self.centre(second));
        (0..4).fold(0, |bits, c| bits | u8::from(cross(a, b, CORNERS[c]) < 0) << c)
    }

    /// Share of the primary region in 512ths: twice its area, as the pixel has 16 x 16 units.
    ///
    /// All of the pixel where the two segments lie on the same side.
    pub fn primary_area(self, first: usize, second: usize) -> u16 {
        if self.same_side(first, second) {
            return 512;
        }
        let secondary = self.secondary_corners(first, second);
        let (a, b) = (self.centre(first), self.centre(second));
        // Walk round the pixel: each corner of the primary region, then the end of the edge that the next side holds.
        let mut outline = Vec::with_capacity(6);
        for (side, &corner) in CORNERS.iter().enumerate() {
            if secondary & (1 << side) == 0 {
                outline.push(corner);
            }
            for (segment, point) in [(first, a), (second, b)] {
                if self.locate(segment).0 == side {
                    outline.push(point);
                }
            }
        }
        let next = outline.iter().cycle().skip(1);
        let twice: i32 = outline.iter().zip(next).map(|(p, q)| p.0 * q.1 - q.0 * p.1).sum();
        twice as u16
    }

    /// Neighbours that may lend the colour of the secondary region, best first; 0 is the one above, then clockwise.
    ///
    /// First those behind a side that is secondary from end to end, then those behind a secondary corner and the sides
    /// that are secondary in part, by the length that they share (a corner counts as half a side: the
    /// neighbour behind it is farther away, but the edge, prolonged, seldom cuts it). A wide secondary region has
    /// more than one whole side; the one opposite to the most primary side leads.
    pub fn lenders(self, first: usize, second: usize) -> Vec<u8> {
        if self.same_side(first, second) {
            return Vec::new();
        }
        let secondary = self.secondary_corners(first, second);
        let is_secondary = |corner: usize| secondary & (1 << (corner % 4)) != 0;
        // Length of each side inside the secondary region.
        let shared: [i32; 4] = std::array::from_fn(|side| {
            let crossing = [first, second]
                .map(|s| self.locate(s))
                .into_iter()
                .find(|s| s.0 == side);
            // Bottom and left run against the clock, so that their first end is their later corner.
            let (start, end) = if side < 2 {
                (side, side + 1)
            } else {
                (side + 1, side)
            };
            match (is_secondary(start), is_secondary(end), crossing) {
                (true, true, _) => SIZE,
                (true, false, Some((_, at))) => at + self.step() / 2,
                (false, true, Some((_, at))) => SIZE - at - self.step() / 2,
                _ => 0,
            }
        });
        let mut ranked: Vec<(i32, u8)> = Vec::new();
        for (side, &length) in shared.iter().enumerate() {
            if length > 0 {
                let opposite = SIZE - shared[(side + 2) % 4];
                let whole = if length == SIZE { 100 + opposite } else { 0 };
                ranked.push((whole + length, 2 * side as u8));
            }
            // Corner `side` precedes side `side` in clockwise order; the neighbour behind the top left one is 7.
            if is_secondary(side) {
                ranked.push((SIZE / 2, (2 * side as u8 + 7) % 8));
            }
        }
        ranked.sort_by_key(|&(rank, neighbour)| (-rank, neighbour));
        ranked.into_iter().map(|(_, neighbour)| neighbour).collect()
    }
}

/// Twice the area of the triangle a, b, p; positive if p lies clockwise of the direction from a to b (y downwards).
fn cross(a: (i32, i32), b: (i32, i32), p: (i32, i32)) -> i32 {
    (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0)
}
