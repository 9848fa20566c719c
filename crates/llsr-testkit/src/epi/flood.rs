//! Flood fill at 16x16 cells a pixel: what edges separate.
//!
//! An edge runs between two points of the boundary of its pixel and cuts cells in two. Each part of a cell is a node of a
//! graph; two parts of neighbouring cells are joined if they share a piece of border of positive length. So thin slivers
//! between two edges are kept apart and together exactly as they are, not as cell centres would have it. All
//! arithmetic is on small integers: edges end on points of the lattice of cell corners.

use std::cmp::Ordering;
use std::sync::OnceLock;

/// Cells along the side of a pixel.
pub const CELLS: usize = 16;

/// A pixel to be painted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pixel {
    /// The boundary segments between whose centres the edge runs, 0..32: top, right, bottom, left, eight each, by growing x
    /// or y. None: no edge.
    pub edge: Option<[u8; 2]>,
    /// Nothing gets through.
    pub blocked: bool,
}

/// A part of a pixel: the side on which `cross(second - first, p - first)` has a sign. `Plus` for all of a pixel without edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// Positive: clockwise of the way from the first to the second end, y downwards.
    Plus,
    /// Negative.
    Minus,
}

/// Which moves a fill may make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moves {
    /// To all four neighbours of a cell.
    All,
    /// Only by these signs of x and y: paths that never turn back.
    Monotone(i32, i32),
}

/// The parts of the cells of a pixel on one side of its edge, a row of cells in a word, bit x for cell x.
#[derive(Clone, Copy, Debug, Default)]
struct Parts {
    /// The cell has a part on this side.
    cells: [u16; CELLS],
    /// So has its border with the cell to the right; bit 15: with the next pixel.
    right: [u16; CELLS],
    /// So has its border with the cell below; row 15: with the next pixel.
    below: [u16; CELLS],
    /// The same for the upper side of the pixel (bit x) and for its left side (bit y).
    top: u16,
    left: u16,
}

/// A block of pixels and, after a fill, what was reached.
#[derive(Clone, Debug)]
pub struct Flood {
    columns: usize,
    pixels: Vec<Pixel>,
    /// Reached cells of each pixel, by side and row.
    reached: Vec<[[u16; CELLS]; 2]>,
}

impl Flood {
    /// Pixels row by row.
    ///
    /// # Panics
    /// If their number is not a multiple of `columns`.
    pub fn new(columns: usize, pixels: &[Pixel]) -> Self {
        assert_eq!(pixels.len() % columns, 0, "rows of {columns} pixels");
        let reached = vec![[[0; CELLS]; 2]; pixels.len()];
        Self {
            columns,
            pixels: pixels.to_vec(),
            reached,
        }
    }

    /// Forgets what was reached.
    pub fn clear(&mut self) {
        self.reached.fill([[0; CELLS]; 2]);
    }

    /// Fills from all parts of cells on one side of a pixel; adds to what was reached before.
    pub fn fill(&mut self, pixel: usize, side: Side, moves: Moves) {
        // A fill starts afresh: where a restricted one came by on another way it may yet lead on.
        let mut new = vec![[[0; CELLS]; 2]; self.pixels.len()];
        new[pixel][side as usize] = self.parts(pixel)[side as usize].cells;
        let allowed = |dx: i32, dy: i32| match moves {
            Moves::All => true,
            Moves::Monotone(sx, sy) => dx == sx && dy == 0 || dy == sy && dx == 0,
        };
        let rows = self.pixels.len() / self.columns;
        let mut queue = vec![pixel];
        while let Some(here) = queue.pop() {
            let parts = self.parts(here);
            for (parts, reached) in parts.iter().zip(&mut new[here]) {
                while parts.spread(reached, allowed) {}
            }
            let (column, row) = (here % self.columns, here / self.columns);
            let neighbours = [
                (1, 0, column + 1 < self.columns),
                (-1, 0, column > 0),
                (0, 1, row + 1 < rows),
                (0, -1, row > 0),
            ];
            for (dx, dy, exists) in neighbours {
                if !exists || !allowed(dx, dy) {
                    continue;
                }
                let there = here.wrapping_add_signed(dx as isize + dy as isize * self.columns as isize);
                let beyond = self.parts(there);
                let before = new[there];
                for from in 0..2 {
                    for to in 0..2 {
                        // Both pixels must see a piece of the border on these sides. The edge meets the side of a pixel in
                        // a corner of cells, so that the border of two cells lies on one side, or in the edge.
                        let (source, border) = parts[from].leaving(&new[here][from], dx, dy);
                        beyond[to].entering(&mut new[there][to], source & border, dx, dy);
                    }
                }
                if new[there] != before {
                    queue.push(there);
                }
            }
        }
        for (all, new) in self.reached.iter_mut().zip(new) {
            for (all, new) in all.iter_mut().flatten().zip(new.iter().flatten()) {
                *all |= new;
            }
        }
    }

    fn parts(&self, pixel: usize) -> [Parts; 2] {
        match self.pixels[pixel] {
            Pixel { blocked: true, .. } => [Parts::default(); 2],
            Pixel { edge, .. } => parts_of(edge),
        }
    }

    /// Was any part of a pixel's side reached?
    pub fn reached(&self, pixel: usize, side: Side) -> bool {
        self.reached[pixel][side as usize] != [0; CELLS]
    }

    /// Was any part of the quarter-pixel region (4 * row + column) reached, on that side?
    pub fn reached_at(&self, pixel: usize, side: Side, position: u8) -> bool {
        let (column, row) = (position % 4, usize::from(position / 4));
        let cells = 0b1111 << (4 * column);
        self.reached[pixel][side as usize][4 * row..4 * row + 4]
            .iter()
            .any(|row| row & cells != 0)
    }
}

impl Parts {
    /// One step inside the pixel; false if nothing is new.
    fn spread(&self, reached: &mut [u16; CELLS], allowed: impl Fn(i32, i32) -> bool) -> bool {
        let before = *reached;
        for y in 0..CELLS {
            if allowed(1, 0) {
                reached[y] |= (reached[y] & self.right[y]) << 1;
            }
            if allowed(-1, 0) {
                reached[y] |= reached[y] >> 1 & self.right[y];
            }
            if allowed(0, 1) && y + 1 < CELLS {
                reached[y + 1] |= reached[y] & self.below[y];
            }
        }
        for y in (1..CELLS).rev() {
            if allowed(0, -1) {
                reached[y - 1] |= reached[y] & self.below[y - 1];
            }
        }
        *reached != before
    }

    /// Reached cells along the side towards (dx, dy), and where the side of the pixel is on this side of the edge.
    fn leaving(&self, reached: &[u16; CELLS], dx: i32, dy: i32) -> (u16, u16) {
        let column = |rows: &[u16; CELLS], x: usize| {
            rows.iter()
                .enumerate()
                .fold(0, |bits, (y, row)| bits | (row >> x & 1) << y)
        };
        match (dx, dy) {
            (1, _) => (column(reached, 15), column(&self.right, 15)),
            (-1, _) => (column(reached, 0), self.left),
            (_, 1) => (reached[15], self.below[15]),
            _ => (reached[0], self.top),
        }
    }

    /// Takes over what comes by (dx, dy) into this pixel.
    fn entering(&self, reached: &mut [u16; CELLS], coming: u16, dx: i32, dy: i32) {
        let (_, border) = self.leaving(&[0; CELLS], -dx, -dy);
        let coming = coming & border;
        match (dx, dy) {
            (0, 1) => reached[0] |= coming,
            (0, _) => reached[15] |= coming,
            _ => {
                let x = if dx == 1 { 0 } else { 15 };
                for (y, row) in reached.iter_mut().enumerate() {
                    *row |= (coming >> y & 1) << x;
                }
            }
        }
    }
}

/// The parts of all cells on both sides of an edge.
fn parts_of(edge: Option<[u8; 2]>) -> [Parts; 2] {
    static ALL: OnceLock<Vec<[Parts; 2]>> = OnceLock::new();
    let all = ALL.get_or_init(|| {
        let edges = (0..1024).map(|i| Some([(i / 32) as u8, (i % 32) as u8]));
        edges.chain([None]).map(cut).collect()
    });
    all[edge.map_or(1024, |[a, b]| usize::from(a) * 32 + usize::from(b))]
}

fn cut(edge: Option<[u8; 2]>) -> [Parts; 2] {
    let signs = corner_signs(edge);
    [1, -1].map(|sign| {
        // A convex piece of the plane has a part on the side if one of its corners is strictly there.
        let on_side = |corners: &[(usize, usize)]| corners.iter().any(|&(x, y)| signs[y][x] == sign);
        let mut parts = Parts::default();
        for i in 0..CELLS {
            parts.top |= u16::from(on_side(&[(i, 0), (i + 1, 0)])) << i;
            parts.left |= u16::from(on_side(&[(0, i), (0, i + 1)])) << i;
        }
        for y in 0..CELLS {
            for x in 0..CELLS {
                let cell = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                parts.cells[y] |= u16::from(on_side(&cell)) << x;
                parts.right[y] |= u16::from(on_side(&[cell[1], cell[3]])) << x;
                parts.below[y] |= u16::from(on_side(&[cell[2], cell[3]])) << x;
            }
        }
        parts
    })
}

/// The side on which the region at `position` lies for every edge that crosses the two segments anywhere; none if that differs.
pub fn side_of_position(edge: [u8; 2], position: u8) -> Option<Side> {
    let mut seen = None;
    // Five crossings in each segment, five by five points in the region, in units of a 32nd of a pixel.
    for i in 0..5 {
        for j in 0..5 {
            let (a, b) = (on_segment(edge[0], i), on_segment(edge[1], j));
            for v in 0..5 {
                for u in 0..5 {
                    let p = (
                        i32::from(position % 4) * 8 + 2 * u,
                        i32::from(position / 4) * 8 + 2 * v,
                    );
                    let side = match turn(a, b, p).cmp(&0) {
                        Ordering::Greater => Side::Plus,
                        Ordering::Less => Side::Minus,
                        Ordering::Equal => continue,
                    };
                    if seen.is_some_and(|seen| seen != side) {
                        return None;
                    }
                    seen = Some(side);
                }
            }
        }
    }
    seen
}

/// The larger side of an edge, by counting whole and cut cells; none if they are equal.
pub fn larger_side(edge: [u8; 2]) -> Option<Side> {
    let (a, b) = (on_segment(edge[0], 2), on_segment(edge[1], 2));
    // Area of the Plus side times a constant: clip the square against the line (Sutherland and Hodgman), in f64, exact here
    // up to a rounding far below the smallest difference of 1/256.
    let square = [(0.0, 0.0), (32.0, 0.0), (32.0, 32.0), (0.0, 32.0)];
    let (ax, ay) = (f64::from(a.0), f64::from(a.1));
    let (bx, by) = (f64::from(b.0), f64::from(b.1));
    let side = |p: (f64, f64)| (bx - ax) * (p.1 - ay) - (by - ay) * (p.0 - ax);
    let mut outline: Vec<(f64, f64)> = Vec::new();
    for i in 0..4 {
        let (p, q) = (square[i], square[(i + 1) % 4]);
        let (sp, sq) = (side(p), side(q));
        if sp >= 0.0 {
            outline.push(p);
        }
        if (sp > 0.0) != (sq > 0.0) && sp != sq {
            let t = sp / (sp - sq);
            outline.push((p.0 + (q.0 - p.0) * t, p.1 + (q.1 - p.1) * t));
        }
    }
    let mut twice = 0.0;
    for (i, p) in outline.iter().enumerate() {
        let q = outline[(i + 1) % outline.len()];
        twice += p.0 * q.1 - q.0 * p.1;
    }
    let difference = twice - 1024.0;
    match difference.abs() < 1e-6 {
        true => None,
        false if difference > 0.0 => Some(Side::Plus),
        false => Some(Side::Minus),
    }
}

/// A point of a boundary segment, `quarter` quarters of the way along, in 32nds of a pixel.
fn on_segment(segment: u8, quarter: i32) -> (i32, i32) {
    let along = i32::from(segment % 8) * 4 + quarter;
    match segment / 8 {
        0 => (along, 0),
        1 => (32, along),
        2 => (along, 32),
        _ => (0, along),
    }
}

fn turn(a: (i32, i32), b: (i32, i32), p: (i32, i32)) -> i32 {
    (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0)
}

fn corner_signs(edge: Option<[u8; 2]>) -> [[i8; CELLS + 1]; CELLS + 1] {
    let mut signs = [[1; CELLS + 1]; CELLS + 1];
    if let Some(edge) = edge {
        let (a, b) = (on_segment(edge[0], 2), on_segment(edge[1], 2));
        for (y, row) in signs.iter_mut().enumerate() {
            for (x, sign) in row.iter_mut().enumerate() {
                *sign = turn(a, b, (2 * x as i32, 2 * y as i32)).signum() as i8;
            }
        }
    }
    signs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(first: u8, second: u8) -> Pixel {
        Pixel {
            edge: Some([first, second]),
            blocked: false,
        }
    }

    #[test]
    fn an_edge_through_two_pixels_separates_them() {
        // Horizontal through the middle of both: left 24 + 3 to right 8 + 3.
        let mut flood = Flood::new(2, &[edge(27, 11), edge(27, 11)]);
        flood.fill(0, Side::Plus, Moves::All);
        assert!(flood.reached(1, Side::Plus), "the lower half is one");
        assert!(
            !flood.reached(0, Side::Minus) && !flood.reached(1, Side::Minus),
            "the upper one is another"
        );
    }

    #[test]
    fn slivers_connect_and_blocked_pixels_do_not() {
        // A corner triangle of 1/16 in the left pixel, and one in the right pixel beside it.
        let smaller = |edge| {
            if larger_side(edge) == Some(Side::Plus) {
                Side::Minus
            } else {
                Side::Plus
            }
        };
        let mut flood = Flood::new(2, &[edge(7, 8), edge(24, 0)]);
        flood.fill(0, smaller([7, 8]), Moves::All);
        assert!(flood.reached(1, smaller([24, 0])), "the triangles touch");
        assert!(
            !flood.reached(0, larger_side([7, 8]).unwrap()),
            "the rest of the left pixel is behind the edge"
        );
        assert!(
            !flood.reached(1, larger_side([24, 0]).unwrap()),
            "the rest of the right pixel is, too"
        );
        let wall = Pixel {
            edge: None,
            blocked: true,
        };
        let mut flood = Flood::new(3, &[Pixel::default(), wall, Pixel::default()]);
        flood.fill(0, Side::Plus, Moves::All);
        assert!(
            !flood.reached(1, Side::Plus) && !flood.reached(2, Side::Plus),
            "nothing gets through"
        );
    }

    #[test]
    fn monotone_fills_do_not_turn_back() {
        let free = Pixel::default();
        let wall = Pixel {
            edge: None,
            blocked: true,
        };
        // A wall with a way round it.
        let pixels = [free, wall, free, free, free, free];
        let mut flood = Flood::new(3, &pixels);
        flood.fill(0, Side::Plus, Moves::Monotone(1, 1));
        assert!(
            flood.reached(5, Side::Plus) && !flood.reached(2, Side::Plus),
            "down and right only"
        );
        flood.fill(0, Side::Plus, Moves::All);
        assert!(flood.reached(2, Side::Plus), "round the wall");
    }

    #[test]
    fn sides_and_sizes() {
        // Down the middle: Plus is to the left.
        assert_eq!(side_of_position([3, 20], 0), Some(Side::Plus), "left column");
        assert_eq!(side_of_position([3, 20], 7), Some(Side::Minus), "right column");
        assert_eq!(side_of_position([3, 20], 5), None, "cut");
        assert_eq!(larger_side([2, 18]), Some(Side::Minus), "left of 5/16");
        assert_eq!(larger_side([3, 20]), None, "from 7/16 to 9/16");
    }
}
