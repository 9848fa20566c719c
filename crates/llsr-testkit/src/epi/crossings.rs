//! Which pieces of a boundary an edge crosses, by the signs of exact determinants.
//!
//! Edges count as moved by an infinitely small step to the right and a still smaller one downwards, so that no end lies
//! on a line and no line through an end of a piece. A piece is crossed if the ends of the edge lie on different sides of it and its own ends
//! lie on different sides of the edge.

/// Units to a pixel in which ends of edges are whole numbers.
pub const UNITS: i64 = 256;

/// A point in units of 1/[`UNITS`] of a pixel.
pub type Grid = (i64, i64);

/// The crossings of an edge with the piece of a horizontal line from `start` over `length` units to the right, in eighths of it.
pub fn of_horizontal(edge: [Grid; 2], start: Grid, length: i64) -> u8 {
    let step = length / 8;
    (0..8).fold(0, |mask, i| {
        let (from, to) = ((start.0 + i * step, start.1), (start.0 + (i + 1) * step, start.1));
        mask | u8::from(crosses(edge, from, to)) << i
    })
}

/// The same for a vertical line from `start` downwards.
pub fn of_vertical(edge: [Grid; 2], start: Grid, length: i64) -> u8 {
    let step = length / 8;
    (0..8).fold(0, |mask, i| {
        let (from, to) = ((start.0, start.1 + i * step), (start.0, start.1 + (i + 1) * step));
        mask | u8::from(crosses(edge, from, to)) << i
    })
}

/// Does the moved edge cross the piece from `from` to `to`, which runs along an axis?
fn crosses([a, b]: [Grid; 2], from: Grid, to: Grid) -> bool {
    // Moving the edge by (e, e^2) is moving everything else by (-e, -e^2).
    let beyond = |p: Grid| {
        if from.1 == to.1 {
            p.1 >= from.1
        } else {
            p.0 >= from.0
        }
    };
    let side = |p: Grid| {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let exact = dx * (p.1 - a.1) - dy * (p.0 - a.0);
        // Of the moved point: exact + e dy - e^2 dx.
        [exact, dy, -dx]
            .into_iter()
            .find(|&part| part != 0)
            .map(i64::signum)
    };
    beyond(a) != beyond(b) && side(from) != side(to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_positions_cross_once() {
        let top = |edge, x: i64| of_horizontal(edge, (x * UNITS, 0), UNITS);
        assert_eq!(top([(100, -50), (100, 50)], 0), 1 << 3, "straight down");
        // Through a corner: to the right of it.
        assert_eq!(top([(256, -50), (256, 50)], 0), 0, "not in the left pixel");
        assert_eq!(top([(256, -50), (256, 50)], 1), 1, "in the right one");
        // Along the line: below it, so never across.
        assert_eq!(top([(-300, 0), (700, 0)], 0), 0, "along the boundary");
        assert_eq!(
            of_vertical([(-300, 0), (700, 0)], (0, 0), UNITS),
            1,
            "which it leaves downwards"
        );
        assert_eq!(
            of_vertical([(-300, 0), (700, 0)], (0, -UNITS), UNITS),
            0,
            "not upwards"
        );
        // An end on the line lies below it.
        assert_eq!(top([(10, -9), (10, 0)], 0), 1, "from above down to the line");
        assert_eq!(top([(10, 0), (10, 9)], 0), 0, "from the line down");
        assert_eq!(top([(10, 0), (10, 0)], 0), 0, "a point");
    }
}
