//! Reachability between neighbours, and its chaining (BWG03 section 5.2).

use crate::COMPLEX_CORNERS;

/// The primary region of the first pixel reaches the primary region of the second.
pub const PP: u8 = 1;
/// Primary of the first, secondary of the second.
pub const PS: u8 = 2;
/// Secondary of the first, primary of the second.
pub const SP: u8 = 4;
/// Secondary of the first, secondary of the second.
pub const SS: u8 = 8;

/// Where the second of two pixels lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// To the right of the first.
    Right,
    /// Below the first.
    Down,
}

/// Reachability over the boundary between a pixel with corner pattern `a` and its neighbour with corner pattern `b`.
///
/// The boundary has a crossing in both pixels or in neither. So each of its two ends lies in one
/// region of each pixel, and those two regions meet there: without a crossing both ends tell of the same two regions, with one each
/// end tells of its own part of the boundary. A pixel that is complex, a diagonal pattern (which no edge has) and two pixels
/// that disagree about the crossing reach nothing.
pub fn neighbour(direction: Direction, a: u8, b: u8) -> u8 {
    let possible = |corners: u8| !matches!(corners, COMPLEX_CORNERS | 0b0101 | 0b1010);
    if !possible(a) || !possible(b) {
        return 0;
    }
    let corner = |corners: u8, c: u8| (corners >> c) & 1;
    // (corner of a, corner of b) at the two ends of the boundary; corners are top left 0, then clockwise.
    let meetings = match direction {
        Direction::Right => [(corner(a, 1), corner(b, 0)), (corner(a, 2), corner(b, 3))],
        Direction::Down => [(corner(a, 3), corner(b, 0)), (corner(a, 2), corner(b, 1))],
    };
    let crossed = |ends: [u8; 2]| ends[0] != ends[1];
    if crossed(meetings.map(|m| m.0)) != crossed(meetings.map(|m| m.1)) {
        return 0;
    }
    meetings
        .iter()
        .fold(0, |mask, &(in_a, in_b)| mask | 1 << (2 * in_a + in_b))
}

/// Reachability from a to c through b, of the masks `ab` and `bc`: through the primary or the secondary region of b.
pub fn chain(ab: u8, bc: u8) -> u8 {
    let mut ac = 0;
    for from in 0..2 {
        for through in 0..2 {
            for to in 0..2 {
                let first = ab >> (2 * from + through) & 1;
                let second = bc >> (2 * through + to) & 1;
                ac |= (first & second) << (2 * from + to);
            }
        }
    }
    ac
}
