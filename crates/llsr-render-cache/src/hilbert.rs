//! The order of a Hilbert curve over a picture, in tiles of 4x4 pixels.

/// Pixels along the side of a tile.
pub(crate) const TILE: usize = 4;

/// One tile on the curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    /// Column and row of the tile.
    pub(crate) column: u16,
    pub(crate) row: u16,
    /// Which of the orders in [`Curve::orders`] its pixels are passed in.
    pub(crate) order: u8,
}

/// A curve through all pixels of a picture.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub(crate) tiles: Vec<Tile>,
    /// Column and row of the 16 pixels of a tile, for each orientation of the curve.
    pub(crate) orders: Vec<[(u8, u8); TILE * TILE]>,
}

/// A square on the curve: its corner where the curve comes in, and the two sides from there as steps along x and y;
/// the curve leaves at the far end of the first side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Square {
    corner: (i32, i32),
    first: (i32, i32),
    second: (i32, i32),
}

impl Square {
    fn size(&self) -> i32 {
        self.first.0.abs() + self.first.1.abs()
    }

    /// The upper left corner.
    fn origin(&self) -> (i32, i32) {
        let low = |a: i32, b: i32, c: i32| a + b.min(0) + c.min(0);
        (
            low(self.corner.0, self.first.0, self.second.0),
            low(self.corner.1, self.first.1, self.second.1),
        )
    }

    /// The four quarters in the order of the curve.
    fn quarters(&self) -> [Self; 4] {
        let half = |(x, y): (i32, i32)| (x / 2, y / 2);
        let add = |(a, b): (i32, i32), (c, d): (i32, i32)| (a + c, b + d);
        let minus = |(x, y): (i32, i32)| (-x, -y);
        let (f, s) = (half(self.first), half(self.second));
        let square = |corner, first, second| Self {
            corner,
            first,
            second,
        };
        let middle = add(self.corner, s);
        [
            square(self.corner, s, f),
            square(middle, f, s),
            square(add(middle, f), f, s),
            square(add(add(add(self.corner, f), f), s), minus(s), minus(f)),
        ]
    }
}

impl Curve {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let side = (columns.max(rows).next_power_of_two() * TILE) as i32;
        let mut curve = Self {
            tiles: Vec::with_capacity(columns * rows),
            orders: Vec::new(),
        };
        // Orientations met so far, in the order of `orders`.
        let mut known: Vec<Square> = Vec::new();
        let whole = Square {
            corner: (0, 0),
            first: (side, 0),
            second: (0, side),
        };
        let mut stack = vec![whole];
        while let Some(square) = stack.pop() {
            let (x, y) = square.origin();
            let (column, row) = (x as usize / TILE, y as usize / TILE);
            if column >= columns || row >= rows {
                continue;
            }
            if square.size() > TILE as i32 {
                stack.extend(square.quarters().into_iter().rev());
                continue;
            }
            let local = Square {
                corner: (square.corner.0 - x, square.corner.1 - y),
                ..square
            };
            let order = known.iter().position(|k| *k == local).unwrap_or_else(|| {
                known.push(local);
                curve.orders.push(pixels(local));
                known.len() - 1
            });
            curve.tiles.push(Tile {
                column: column as u16,
                row: row as u16,
                order: order as u8,
            });
        }
        curve
    }
}

/// The pixels of one tile in the order of the curve.
fn pixels(tile: Square) -> [(u8, u8); TILE * TILE] {
    let mut order = [(0, 0); TILE * TILE];
    let mut count = 0;
    let mut stack = vec![tile];
    while let Some(square) = stack.pop() {
        if square.size() > 1 {
            stack.extend(square.quarters().into_iter().rev());
        } else {
            let (x, y) = square.origin();
            order[count] = (x as u8, y as u8);
            count += 1;
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk(width: usize, height: usize) -> Vec<(i32, i32)> {
        let curve = Curve::new(width, height);
        let step = |tile: &Tile| {
            let (x, y) = (
                i32::from(tile.column) * TILE as i32,
                i32::from(tile.row) * TILE as i32,
            );
            curve.orders[usize::from(tile.order)].map(|(dx, dy)| (x + i32::from(dx), y + i32::from(dy)))
        };
        curve.tiles.iter().flat_map(step).collect()
    }

    #[test]
    fn passes_every_pixel_once_by_single_steps() {
        for side in [8, 16, 32, 128] {
            let path = walk(side, side);
            assert_eq!(path.len(), side * side, "as many steps as pixels");
            let unique: std::collections::BTreeSet<_> = path.iter().collect();
            assert_eq!(unique.len(), path.len(), "no pixel twice");
            for pair in path.windows(2) {
                let distance = (pair[0].0 - pair[1].0).abs() + (pair[0].1 - pair[1].1).abs();
                assert_eq!(distance, 1, "{pair:?} are neighbours");
            }
        }
        assert!(Curve::new(512, 512).orders.len() <= 8, "few orientations");
    }

    #[test]
    fn covers_pictures_of_any_shape() {
        for (width, height) in [(1, 1), (100, 37), (9, 300), (640, 8)] {
            let path = walk(width, height);
            let unique: std::collections::BTreeSet<_> = path.iter().copied().collect();
            assert_eq!(unique.len(), path.len(), "no pixel twice in {width} x {height}");
            let all = (0..width as i32).flat_map(|x| (0..height as i32).map(move |y| (x, y)));
            assert!(
                all.clone().all(|p| unique.contains(&p)),
                "every pixel of {width} x {height}"
            );
        }
    }
}
