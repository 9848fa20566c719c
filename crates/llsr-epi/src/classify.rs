//! Classification of pixels and reconstruction of their edges from the crossings (BWG03 sections 4.5 and 5.1).

use crate::code::EdgeCode;
use crate::crossings::Crossings;
use crate::pixels::{POSITION_SHIFT, SAMPLE, SAMPLE_SHIFT};
use crate::planes::{BandPlanes, outside_of_last_word};
use crate::tables;

/// Planes of the classification.
pub(crate) const COMPLEX: usize = 0;
/// First of four planes: the corner is in the secondary region (top left, top right, bottom right, bottom left).
pub(crate) const CORNER: usize = 1;
/// The pixel has a sample.
pub(crate) const HAS_SAMPLE: usize = 5;
/// The pixel has a sample that interpolation may use: not ambiguous, not in a complex pixel.
pub(crate) const USABLE: usize = 6;
/// The pixel is simple or complex. Unlike [`COMPLEX`], which is set outside the picture, this one is not.
pub(crate) const CROSSED: usize = 7;
/// Number of planes.
pub(crate) const CLASS_PLANES: usize = 8;

/// What classification asks of the bytes and words of 64 pixels: the part that SIMD modules replace.
pub(crate) trait Masks {
    /// Bit i is set if byte i is not zero.
    fn nonzero(bytes: &[u8; 64]) -> u64;
    /// Bit i is set if byte i has more than one bit set.
    fn multiple(bytes: &[u8; 64]) -> u64;
    /// Clears the edge codes; bit i of the result is set if pixel i has a sample.
    fn clear_codes(words: &mut [u16; 64]) -> u64;
}

/// For 64 pixels: which have a crossing on each side, and which have more than one on some side.
struct Sides {
    top: u64,
    right: u64,
    bottom: u64,
    left: u64,
    multiple: u64,
}

/// Classifies rows `first_row..` of a band: writes the edge codes into `words` and the class planes.
#[inline(always)]
pub(crate) fn classify<M: Masks>(
    crossings: &Crossings,
    first_row: usize,
    words: &mut [u16],
    planes: &mut BandPlanes<'_, CLASS_PLANES>,
) {
    let stride = crossings.stride;
    for (i, words) in words.chunks_exact_mut(stride).enumerate() {
        let y = first_row + i;
        let (top, bottom) = (crossings.above(y), crossings.above(y + 1));
        let left = crossings.left(y);
        let row = planes.row_mut(i);
        let plane_len = row.len() / CLASS_PLANES;
        for block in 0..stride / 64 {
            let x = block * 64;
            let boundary = Boundary {
                top: array(&top[x..]),
                right: array(&left[x + 1..]),
                bottom: array(&bottom[x..]),
                left: array(&left[x..]),
            };
            let Some(words) = words[x..].first_chunk_mut() else {
                unreachable!("rows hold whole words")
            };
            let mut class = boundary.classify::<M>(words);
            if x + 64 > crossings.width {
                let outside = outside_of_last_word(crossings.width);
                class[COMPLEX] |= outside;
                class[CROSSED] &= !outside;
            }
            for (plane, bits) in class.into_iter().enumerate() {
                row[plane * plane_len + block + 1] = bits;
            }
        }
    }
}

/// The first 64 bytes.
#[inline(always)]
fn array(bytes: &[u8]) -> &[u8; 64] {
    let Some(array) = bytes.first_chunk() else {
        unreachable!("rows hold whole words")
    };
    array
}

/// The boundaries of 64 pixels in a row.
struct Boundary<'a> {
    top: &'a [u8; 64],
    right: &'a [u8; 64],
    bottom: &'a [u8; 64],
    left: &'a [u8; 64],
}

impl Boundary<'_> {
    #[inline(always)]
    fn classify<M: Masks>(&self, words: &mut [u16; 64]) -> [u64; CLASS_PLANES] {
        let mut class = [0; CLASS_PLANES];
        let has_sample = M::clear_codes(words);
        class[HAS_SAMPLE] = has_sample;
        let Some(sides) = self.sides::<M>() else {
            class[USABLE] = has_sample;
            return class;
        };
        let Sides {
            top,
            right,
            bottom,
            left,
            multiple,
        } = sides;
        // Exactly two sides crossed: the sum of four bits is two.
        let (low_a, high_a, low_b, high_b) = (top ^ right, top & right, bottom ^ left, bottom & left);
        let two = (high_a & !low_b & !high_b) | (high_b & !low_a & !high_a) | (low_a & low_b);
        let simple = two & !multiple;
        let complex = (top | right | bottom | left) & !simple;

        let (mut ambiguous, mut flipped) = (0u64, 0u64);
        let mut rest = simple;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let (code, unsure) = self.edge(i, words[i]);
            words[i] |= code.bits();
            ambiguous |= u64::from(unsure) << i;
            flipped |= u64::from(code.corners() & 1) << i;
        }
        let mut rest = complex;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            words[i] |= EdgeCode::COMPLEX.bits();
        }
        // Round the pixel from the top left corner the region changes with each crossing.
        class[COMPLEX] = complex;
        class[CORNER] = flipped;
        class[CORNER + 1] = (flipped ^ top) & simple;
        class[CORNER + 2] = (flipped ^ top ^ right) & simple;
        class[CORNER + 3] = (flipped ^ left) & simple;
        class[USABLE] = has_sample & !complex & !ambiguous;
        class[CROSSED] = simple | complex;
        class
    }

    /// The code of simple pixel `i`, primary region first, and whether its sample is ambiguous.
    ///
    /// The region that holds the sample is primary, without a usable sample the larger one (BWG03 section 5.1).
    fn edge(&self, i: usize, word: u16) -> (EdgeCode, bool) {
        let mask = u32::from_le_bytes([self.top[i], self.right[i], self.bottom[i], self.left[i]]);
        debug_assert_eq!(mask.count_ones(), 2, "a simple pixel has two crossings");
        let code = EdgeCode::from_segments(mask.trailing_zeros(), 31 - mask.leading_zeros());
        let sampled = word & SAMPLE != 0;
        match code.side_bits(u32::from(word >> POSITION_SHIFT)) {
            1 if sampled => (code, false),
            2 if sampled => (code.reversed(), false),
            _ => {
                let larger = if tables::AREA[code.index()] >= 256 {
                    code
                } else {
                    code.reversed()
                };
                (larger, sampled)
            }
        }
    }

    /// None if there is no crossing at all.
    #[inline(always)]
    fn sides<M: Masks>(&self) -> Option<Sides> {
        let (top, right) = (M::nonzero(self.top), M::nonzero(self.right));
        let (bottom, left) = (M::nonzero(self.bottom), M::nonzero(self.left));
        if top | right | bottom | left == 0 {
            return None;
        }
        let multiple = M::multiple(self.top)
            | M::multiple(self.right)
            | M::multiple(self.bottom)
            | M::multiple(self.left);
        Some(Sides {
            top,
            right,
            bottom,
            left,
            multiple,
        })
    }
}

/// The form that runs anywhere.
#[derive(Debug)]
pub(crate) struct Portable;

impl Portable {
    /// Applies a function to eight bytes at a time and joins the eight bits that come out of each.
    #[inline(always)]
    fn by_eights(bytes: &[u8; 64], bits: impl Fn(u64) -> u64) -> u64 {
        let (eights, _) = bytes.as_chunks::<8>();
        eights
            .iter()
            .enumerate()
            .fold(0, |all, (i, &eight)| match u64::from_le_bytes(eight) {
                0 => all,
                eight => all | bits(eight) << (8 * i),
            })
    }
}

impl Masks for Portable {
    #[inline(always)]
    fn nonzero(bytes: &[u8; 64]) -> u64 {
        Self::by_eights(bytes, nonzero_bytes)
    }

    #[inline(always)]
    fn multiple(bytes: &[u8; 64]) -> u64 {
        Self::by_eights(bytes, |eight| nonzero_bytes(eight & decremented_bytes(eight)))
    }

    #[inline(always)]
    fn clear_codes(words: &mut [u16; 64]) -> u64 {
        let mut samples = 0;
        for (i, word) in words.iter_mut().enumerate() {
            *word &= !EdgeCode::BITS;
            samples |= u64::from(*word >> SAMPLE_SHIFT & 1) << i;
        }
        samples
    }
}

/// Bit i is set if byte i is not zero.
#[inline]
pub(crate) fn nonzero_bytes(bytes: u64) -> u64 {
    const LOW: u64 = 0x7f7f_7f7f_7f7f_7f7f;
    let high_bits = (((bytes & LOW) + LOW) | bytes) & !LOW;
    // Gathers bit 7 of each byte: byte i lands at bit 56 + i.
    (high_bits >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56
}

/// Each byte less one; what a zero byte becomes does not matter, but it takes nothing from its neighbour.
#[inline]
pub(crate) fn decremented_bytes(bytes: u64) -> u64 {
    const HIGH: u64 = 0x8080_8080_8080_8080;
    const ONE: u64 = 0x0101_0101_0101_0101;
    ((bytes | HIGH) - ONE) ^ (!bytes & HIGH)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn byte_tricks_match_bytes() {
        let mut state = 1u64;
        for _ in 0..10_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            // Half of the bytes zero.
            let bytes = state & state.rotate_left(17).wrapping_mul(0x9e37_79b9) & 0xff00_ffff_00ff_0fff;
            let expected = (0..8).fold(0, |bits, i| bits | u64::from(bytes.to_le_bytes()[i] != 0) << i);
            assert_eq!(nonzero_bytes(bytes), expected, "{bytes:#x}");
            for (byte, less) in bytes
                .to_le_bytes()
                .into_iter()
                .zip(decremented_bytes(bytes).to_le_bytes())
            {
                assert!(byte == 0 || less == byte - 1, "{byte} - 1 is not {less}");
            }
        }
    }
}
