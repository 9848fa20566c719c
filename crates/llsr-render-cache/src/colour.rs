//! Colours in 48 bits: three 14-bit mantissas and a shared 5-bit exponent.

use glam::Vec3;

/// A component is `mantissa * 2^(exponent - BIAS)`.
const BIAS: i32 = 25;
/// Bits of a mantissa.
const MANTISSA: i32 = 14;
/// Of these the low ones, which lie apart.
const FINE: u32 = 5;

/// The largest component that a packed colour can hold, 16383 * 2^6; larger ones are cut to it.
pub const MAX_COMPONENT: f32 = 1_048_512.0;

/// A packed colour: component = mantissa * 2^(exponent - 25). Black is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PackedColour {
    /// The nine high bits of the mantissas, red in bits 0-8, green 9-17, blue 18-26, and the exponent in bits 27-31.
    pub coarse: u32,
    /// The five low bits of the mantissas, red in bits 0-4, green 5-9, blue 10-14.
    pub fine: u16,
}

/// Packs a linear colour.
///
/// Negative components and NaN count as 0, components over [`MAX_COMPONENT`] as that. The error of a component is
/// at most 2^-14 of the largest one, or 2^-26 if that is more.
#[inline]
pub fn pack_colour(colour: Vec3) -> PackedColour {
    let components = colour
        .to_array()
        .map(|c| if c > 0.0 { c.min(MAX_COMPONENT) } else { 0.0 });
    let largest = components[0].max(components[1]).max(components[2]);
    let floor_log2 = (largest.to_bits() >> 23) as i32 - 127;
    // The mantissa of the largest component shall have its highest bit set; rounding can lift it one bit further, one step further.
    let exponent = (floor_log2 + BIAS - (MANTISSA - 1)).clamp(0, 31);
    let lifted = (largest * power_of_two(BIAS - exponent)).round() >= power_of_two(MANTISSA);
    let exponent = exponent + i32::from(lifted);
    let [r, g, b] = components.map(|c| (c * power_of_two(BIAS - exponent)).round() as u32);
    let fine = |m: u32| m & ((1 << FINE) - 1);
    PackedColour {
        coarse: r >> FINE | (g >> FINE) << 9 | (b >> FINE) << 18 | (exponent as u32) << 27,
        fine: (fine(r) | fine(g) << FINE | fine(b) << (2 * FINE)) as u16,
    }
}

/// The colour that was packed, to the error stated at [`pack_colour`].
#[inline]
pub fn unpack_colour(packed: PackedColour) -> Vec3 {
    let (coarse, fine) = (packed.coarse, u32::from(packed.fine));
    let mantissas = [0, 1, 2].map(|i| (coarse >> (9 * i) & 511) << FINE | fine >> (FINE * i) & 31);
    Vec3::from_array(mantissas.map(|m| m as f32)) * power_of_two((coarse >> 27) as i32 - BIAS)
}

fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((127 + exponent) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn special_values() {
        assert_eq!(pack_colour(Vec3::ZERO), PackedColour::default(), "black");
        assert_eq!(unpack_colour(PackedColour::default()), Vec3::ZERO, "black");
        assert_eq!(
            unpack_colour(pack_colour(Vec3::new(1.0, 0.5, 0.25))),
            Vec3::new(1.0, 0.5, 0.25),
            "powers"
        );
        let wild = pack_colour(Vec3::new(f32::NAN, -4.0, f32::INFINITY));
        assert_eq!(
            unpack_colour(wild),
            Vec3::new(0.0, 0.0, MAX_COMPONENT),
            "repaired"
        );
        let below_two = 2.0 - 1.0 / 65536.0;
        assert_eq!(
            unpack_colour(pack_colour(Vec3::splat(below_two))),
            Vec3::splat(2.0),
            "rounds up a power"
        );
        assert_eq!(
            unpack_colour(pack_colour(Vec3::splat(MAX_COMPONENT))).x,
            MAX_COMPONENT,
            "largest"
        );
        assert_eq!(
            unpack_colour(pack_colour(Vec3::splat(MAX_COMPONENT - 30.0))).x,
            MAX_COMPONENT,
            "rounds to it"
        );
    }

    proptest! {
        #[test]
        fn error_bound(r in -30.0..20f32, g in -30.0..20f32, b in -30.0..20f32) {
            let colour = Vec3::new(r.exp2(), g.exp2(), b.exp2()).min(Vec3::splat(MAX_COMPONENT));
            let error = (unpack_colour(pack_colour(colour)) - colour).abs().max_element();
            prop_assert!(error <= (colour.max_element() / 16384.0).max((-26f32).exp2()), "{error} for {colour}");
        }
    }
}
