//! Colours and depths as stored: 48 and 16 bits.

use glam::Vec3;

/// Bias of the stored exponent: a component is `mantissa * 2^(exponent - BIAS)`.
///
/// With 14 bits of mantissa and 5 of exponent the largest component is 16383 * 2^6 = 1,048,512, and components of 2^-12 or more next to
/// nothing larger keep all bits.
const BIAS: i32 = 25;
/// Bits of a mantissa.
const MANTISSA: u32 = 14;
/// Low bits of a mantissa, kept apart from the others: see [`Packed`].
pub(crate) const FINE: u32 = 5;

/// The largest component that can be stored; larger ones are cut to it.
pub const MAX_COMPONENT: f32 = 1_048_512.0;

/// A colour with a shared exponent in 47 bits, in the two places where there is room for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Packed {
    /// The nine high bits of red, green and blue from bit 0, the exponent from bit 27.
    pub(crate) coarse: u32,
    /// The five low bits of red, green and blue from bit 0.
    pub(crate) fine: u16,
}

/// Packs a linear colour: three 14-bit mantissas and a shared 5-bit exponent.
///
/// Components are linear and not negative (negative ones and NaN count as 0, infinity as [`MAX_COMPONENT`]). The error
/// of a component is at most 2^-14 of the largest one, or 2^-26 if that is more.
#[inline]
pub(crate) fn pack_colour(colour: Vec3) -> Packed {
    let [r, g, b] = colour
        .to_array()
        .map(|c| if c > 0.0 { c.min(MAX_COMPONENT) } else { 0.0 });
    let largest = r.max(g).max(b);
    // The exponent field of the float gives floor(log2); the other mantissa bits lie below it.
    let floor_log2 = (largest.to_bits() >> 23) as i32 - 127;
    let mut exponent = (floor_log2 - (MANTISSA as i32 - 1) + BIAS).clamp(0, 31);
    let scale = |exponent: i32| f32::from_bits(((127 + BIAS - exponent) as u32) << 23);
    if (largest * scale(exponent)).round() >= (1 << MANTISSA) as f32 {
        exponent += 1;
    }
    let scale = scale(exponent);
    let [r, g, b] = [r, g, b].map(|c| (c * scale).round() as u32);
    let fine = |m: u32| m & ((1 << FINE) - 1);
    Packed {
        coarse: r >> FINE | (g >> FINE) << 9 | (b >> FINE) << 18 | (exponent as u32) << 27,
        fine: (fine(r) | fine(g) << FINE | fine(b) << (2 * FINE)) as u16,
    }
}

/// The scale that turns the mantissas of a packed colour into components.
#[inline]
fn unit(coarse: u32) -> f32 {
    f32::from_bits(((coarse >> 27) + (127 - BIAS as u32)) << 23)
}

/// Unpacks a colour; exact.
#[inline]
pub(crate) fn unpack_colour(packed: Packed) -> Vec3 {
    let (coarse, fine) = (packed.coarse, u32::from(packed.fine));
    let mantissas = [0, 1, 2].map(|i| (coarse >> (9 * i) & 0x1ff) << FINE | fine >> (FINE * i) & 0x1f);
    Vec3::from_array(mantissas.map(|m| m as f32)) * unit(coarse)
}

/// Packs a positive depth into 16 bits, 6 for the exponent and 10 for the mantissa, rounded up by at most 2^-10.
///
/// Order is kept. Depths outside 2^-31..2^32 go to the nearest end; what is beyond the far end counts as infinitely far.
#[inline]
pub(crate) fn pack_depth(depth: f32) -> u16 {
    const LOWEST: u32 = (127 - 31) << 10;
    let rounded_up = depth.max(0.0).to_bits().saturating_add((1 << 13) - 1) >> 13;
    rounded_up.saturating_sub(LOWEST).min(0xffff) as u16
}

/// The depth that stands for a packed one; never less than what was packed, infinite for the last code.
#[inline]
pub(crate) fn unpack_depth(packed: u16) -> f32 {
    const LOWEST: u32 = (127 - 31) << 10;
    if packed == u16::MAX {
        return f32::INFINITY;
    }
    f32::from_bits((u32::from(packed) + LOWEST) << 13)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn special_colours() {
        assert_eq!(unpack_colour(pack_colour(Vec3::ZERO)), Vec3::ZERO, "black");
        assert_eq!(unpack_colour(pack_colour(Vec3::ONE)), Vec3::ONE, "white");
        assert_eq!(
            pack_colour(Vec3::ZERO),
            Packed::default(),
            "an absent sample decodes to black"
        );
        let wild = Vec3::new(f32::NAN, f32::INFINITY, -3.0);
        assert_eq!(
            unpack_colour(pack_colour(wild)),
            Vec3::new(0.0, MAX_COMPONENT, 0.0),
            "wild components"
        );
        assert_eq!(
            unpack_colour(pack_colour(Vec3::splat(1e9))).x,
            MAX_COMPONENT,
            "saturation"
        );
        let almost = unpack_colour(pack_colour(Vec3::splat(0.999_999)));
        assert_eq!(
            almost,
            Vec3::ONE,
            "the mantissa may round up to the next exponent"
        );
        assert_eq!(
            unpack_colour(pack_colour(Vec3::splat(MAX_COMPONENT - 1.0))).y,
            MAX_COMPONENT,
            "near the end"
        );
    }

    #[test]
    fn special_depths() {
        assert_eq!(pack_depth(0.0), 0, "nothing is nearer");
        assert_eq!(pack_depth(f32::INFINITY), u16::MAX, "infinite");
        assert_eq!(unpack_depth(u16::MAX), f32::INFINITY, "infinite");
        assert_eq!(unpack_depth(pack_depth(1.0)), 1.0, "exact powers stay");
    }

    proptest! {
        #[test]
        fn colour_error_is_bounded(r in -9f32..20.0, g in -9f32..20.0, b in -9f32..20.0) {
            let colour = Vec3::new(r.exp2(), g.exp2(), b.exp2());
            let largest = colour.max_element().min(MAX_COMPONENT);
            let error = (unpack_colour(pack_colour(colour)) - colour.min(Vec3::splat(MAX_COMPONENT))).abs();
            prop_assert!(error.max_element() <= (largest / 16384.0).max(0.5f32.powi(26)), "{colour} {error}");
        }

        #[test]
        fn depth_is_rounded_up_a_little(e in -30f32..31.9) {
            let depth = e.exp2();
            let stored = unpack_depth(pack_depth(depth));
            prop_assert!(stored >= depth && stored <= depth * (1.0 + 1.0 / 1023.0), "{depth} {stored}");
        }

        #[test]
        fn depth_keeps_order(a in 0f32..1e9, b in 0f32..1e9) {
            prop_assert_eq!(pack_depth(a) <= pack_depth(b), pack_depth(a) <= pack_depth(b.max(a)) && (a <= b || pack_depth(a) == pack_depth(b)));
        }
    }
}
