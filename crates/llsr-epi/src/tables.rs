//! The lookup tables, made by `llsr-epi-tables` when the crate is built.

include!(concat!(env!("OUT_DIR"), "/tables.rs"));

/// Reachability over the boundary of a pixel and its right neighbour, by their 4-bit codes.
#[inline]
pub(crate) fn right(a: u8, b: u8) -> u8 {
    NEIGHBOUR_RIGHT[usize::from(a << 4 | b & 15)]
}

/// Reachability over the boundary of a pixel and the one below it, by their 4-bit codes.
#[inline]
pub(crate) fn down(a: u8, b: u8) -> u8 {
    NEIGHBOUR_DOWN[usize::from(a << 4 | b & 15)]
}

/// Reachability from a to c, of a to b and b to c.
#[inline]
pub(crate) fn chain(ab: u8, bc: u8) -> u8 {
    CHAIN[usize::from(ab << 4 | bc & 15)]
}

/// Reachability from b to a, of a to b.
#[inline]
pub(crate) fn transpose(mask: u8) -> u8 {
    mask & 0b1001 | (mask & 0b0010) << 1 | (mask & 0b0100) >> 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The digest that `cargo xtask tables` writes and checks.
    const COMMITTED: &str = include_str!("../tables.digest");

    #[test]
    fn shipped_tables_are_the_generated_ones_and_match_the_digest() {
        let tables = llsr_epi_tables::Tables::generate();
        assert_eq!(SIDE.as_slice(), tables.side, "side");
        assert_eq!(AREA.as_slice(), tables.area, "area");
        assert_eq!(LENDERS.as_slice(), tables.lenders, "lenders");
        assert_eq!(CORNERS.as_slice(), tables.corners, "corners");
        assert_eq!(
            NEIGHBOUR_RIGHT.as_slice(),
            tables.neighbour_right,
            "neighbour to the right"
        );
        assert_eq!(
            NEIGHBOUR_DOWN.as_slice(),
            tables.neighbour_down,
            "neighbour below"
        );
        assert_eq!(CHAIN.as_slice(), tables.chain, "chain");
        assert_eq!(HALF_SIDE.as_slice(), tables.half_side, "side in half pixels");
        assert_eq!(HALF_AREA.as_slice(), tables.half_area, "area in half pixels");
        assert_eq!(
            COMMITTED.trim(),
            format!("{:016x}", tables.digest()),
            "run `cargo xtask tables` to renew it"
        );
    }

    #[test]
    fn the_tables_take_less_than_16_kb() {
        let bytes = size_of_val(&SIDE)
            + size_of_val(&AREA)
            + size_of_val(&LENDERS)
            + size_of_val(&CORNERS)
            + size_of_val(&NEIGHBOUR_RIGHT)
            + size_of_val(&NEIGHBOUR_DOWN)
            + size_of_val(&CHAIN)
            + size_of_val(&HALF_SIDE)
            + size_of_val(&HALF_AREA);
        assert!(bytes < 16 * 1024, "{bytes} bytes");
    }

    #[test]
    fn transposing_swaps_the_mixed_bits() {
        for mask in 0..16 {
            assert_eq!(transpose(transpose(mask)), mask, "twice is the identity");
            assert_eq!(transpose(mask) & 2 != 0, mask & 4 != 0, "PS comes from SP");
        }
    }
}
