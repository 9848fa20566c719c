//! Answers about an edge code, packed into an integer.

use crate::geometry::{Grid, Side};
use crate::{COMPLEX_CORNERS, EMPTY};

/// Two bits a region: 0 edge-ambiguous, 1 primary, 2 secondary.
pub(crate) fn pack_sides(grid: Grid, (first, second): (usize, usize)) -> u32 {
    let mut packed = 0;
    for row in 0..grid.regions {
        for column in 0..grid.regions {
            let field = match grid.side(first, second, column, row) {
                Side::Ambiguous => 0,
                Side::Primary => 1,
                Side::Secondary => 2,
            };
            packed |= field << (2 * (row * grid.regions + column));
        }
    }
    packed
}

/// Which corners of the pixel lie in the secondary region, as a bit each.
pub(crate) fn corners(grid: Grid, code: usize) -> u8 {
    match code {
        EMPTY => 0,
        _ if grid.same_side(code / 32, code % 32) => COMPLEX_CORNERS,
        _ => grid.secondary_corners(code / 32, code % 32),
    }
}

/// The first five, the last one repeated where there are fewer.
pub(crate) fn pack_lenders(neighbours: &[u8]) -> u16 {
    let Some(&last) = neighbours.last() else { return 0 };
    (0..5).fold(0, |packed, i| {
        packed | u16::from(*neighbours.get(i).unwrap_or(&last)) << (3 * i)
    })
}
