//! Generator of the lookup tables of the edge-and-point image.
//!
//! The edge-and-point image (Bala, Walter and Greenberg 2003, "BWG03", sections 4 and 5) knows of each pixel
//! at most one edge, to an eighth of a pixel, and one sample, to a quarter of a pixel. Everything that it asks about
//! them has few answers, so the answers are worked out once, when the crate is built: here, with integers only, so that
//! every platform gets the same bits. `llsr-epi` calls [`Tables::generate`] from its build script;
//! `cargo xtask tables` prints sizes and the digest.
//!
//! ```
//! let tables = llsr_epi_tables::Tables::generate();
//! assert!(tables.byte_len() < 16 * 1024);
//! // Down from the fifth eighth of the top side (segment 4) to that of the bottom side (segment 16 + 4), through the centres
//! // of both, at 9/16 of the pixel. The primary region is to the left.
//! let code = llsr_epi_tables::code(4, 20);
//! assert_eq!(tables.area[code], 512 * 9 / 16);
//! ```

mod geometry;
mod pack;
mod reach;
mod source;

pub use geometry::{CORNERS, Grid, Side};
pub use reach::{Direction, PP, PS, SP, SS, chain, neighbour};

use pack::{corners, pack_lenders, pack_sides};

/// Edge code of a pixel without an edge: a pair of ends that no edge can have.
pub const EMPTY: usize = 0;
/// Edge code of a pixel that one edge cannot describe.
pub const COMPLEX: usize = 1;
/// Corner pattern (see [`Tables::corners`]) of a complex pixel.
pub const COMPLEX_CORNERS: u8 = 0b1111;

/// The 10-bit code of the edge from boundary segment `first` to boundary segment `second`, each in 0..32.
///
/// Segments are numbered side by side (top, right, bottom, left), eight to a side, each side by growing x or y. The
/// order of the ends says which region is primary: with x to the right and y downwards, the one that
/// lies clockwise of the direction of travel, `cross(second - first, p - first) > 0`.
pub const fn code(first: usize, second: usize) -> usize {
    first * 32 + second
}

/// All tables, in the layout in which they are stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tables {
    /// By edge code: sixteen 2-bit fields, field `4 * row + column` for each quarter-pixel region: 0 edge-ambiguous,
    /// 1 primary, 2 secondary (BWG03 section 4.3).
    pub side: Vec<u32>,
    /// By edge code: the share of the primary region in 512ths (BWG03 section 5.3, anti-aliasing).
    pub area: Vec<u16>,
    /// By edge code: five 3-bit fields, best first: the neighbours that may lend the colour of the secondary region.
    /// Neighbours are numbered clockwise from the one above: 0 N, 1 NE, 2 E, 3 SE, 4 S, 5 SW, 6 W, 7 NW.
    pub lenders: Vec<u16>,
    /// By edge code: the 4-bit code that reachability needs. Bit c is set if corner c (top left, top right, bottom
    /// right, bottom left) is secondary. Empty has 0, complex 15; simple pixels use the twelve patterns left when the two
    /// diagonal ones are taken out.
    pub corners: Vec<u8>,
    /// By `16 * (4-bit code of the pixel) + (4-bit code of its right neighbour)`: reachability over their boundary.
    pub neighbour_right: Vec<u8>,
    /// The same for the neighbour below.
    pub neighbour_down: Vec<u8>,
    /// By `16 * (a to b) + (b to c)`: reachability from a to c through b.
    pub chain: Vec<u8>,
    /// By half-pixel edge code `16 * first + second` (four segments to a side): four 2-bit fields, as in
    /// [`side`](Self::side), for the 2x2 regions of a quarter of a pixel.
    pub half_side: Vec<u8>,
    /// By half-pixel edge code: the share of the primary region in 512ths.
    pub half_area: Vec<u16>,
}

impl Tables {
    /// Works out all tables. Takes a few milliseconds, and ten times that without optimisation.
    pub fn generate() -> Self {
        let whole = Grid {
            segments: 8,
            regions: 4,
        };
        let half = Grid {
            segments: 4,
            regions: 2,
        };
        let by_code = |code: usize| (code / 32, code % 32);
        let by_half_code = |code: usize| (code / 16, code % 16);
        Self {
            side: (0..1024).map(|c| pack_sides(whole, by_code(c))).collect(),
            area: (0..1024)
                .map(|c| whole.primary_area(by_code(c).0, by_code(c).1))
                .collect(),
            lenders: (0..1024)
                .map(|c| pack_lenders(&whole.lenders(by_code(c).0, by_code(c).1)))
                .collect(),
            corners: (0..1024).map(|c| corners(whole, c)).collect(),
            neighbour_right: (0..=255)
                .map(|i| neighbour(Direction::Right, i >> 4, i & 15))
                .collect(),
            neighbour_down: (0..=255)
                .map(|i| neighbour(Direction::Down, i >> 4, i & 15))
                .collect(),
            chain: (0..=255).map(|i| chain(i >> 4, i & 15)).collect(),
            half_side: (0..256)
                .map(|c| pack_sides(half, by_half_code(c)) as u8)
                .collect(),
            half_area: (0..256)
                .map(|c| half.primary_area(by_half_code(c).0, by_half_code(c).1))
                .collect(),
        }
    }

    /// Size of all tables as stored, in bytes.
    pub fn byte_len(&self) -> usize {
        self.parts().iter().map(|(_, bytes)| bytes.len()).sum()
    }

    /// Digest of the contents: FNV-1a, 64 bits, over the little-endian bytes in the order of the fields.
    ///
    /// Made to catch a change by accident, not by malice.
    pub fn digest(&self) -> u64 {
        self.parts()
            .iter()
            .flat_map(|(_, bytes)| bytes.iter())
            .fold(0xcbf2_9ce4_8422_2325, |h, &byte| {
                (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
            })
    }

    /// Name and little-endian bytes of each table.
    pub fn parts(&self) -> [(&'static str, Vec<u8>); 9] {
        let wide = |table: &[u16]| table.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        [
            ("side", self.side.iter().flat_map(|v| v.to_le_bytes()).collect()),
            ("area", wide(&self.area)),
            ("lenders", wide(&self.lenders)),
            ("corners", self.corners.clone()),
            ("neighbour_right", self.neighbour_right.clone()),
            ("neighbour_down", self.neighbour_down.clone()),
            ("chain", self.chain.clone()),
            ("half_side", self.half_side.clone()),
            ("half_area", wide(&self.half_area)),
        ]
    }
}

#[cfg(test)]
mod tests;
