//! Colours in 32 bits: three 9-bit mantissas and a shared 5-bit exponent.

use glam::Vec3;

/// A component is `mantissa * 2^(exponent - BIAS)`.
const BIAS: i32 = 20;

/// The largest component that a packed colour can hold, 511 * 2^11; larger ones are cut to it.
pub const MAX_COMPONENT: f32 = 1_046_528.0;

/// Packs a linear colour: red in bits 0-8, green 9-17, blue 18-26, exponent 27-31, component = mantissa *
/// 2^(exponent - 20). Black is 0.
///
/// Negative components and NaN count as 0, components over [`MAX_COMPONENT`] as that. The error of a component is
/// at most 1/512 of the largest one, or 2^-21 if that is more.
#[inline]
pub fn pack_colour(colour: Vec3) -> u32 {
    let components = colour
        .to_array()
        .map(|c| if c > 0.0 { c.min(MAX_COMPONENT) } else { 0.0 });
    let largest = components[0].max(components[1]).max(components[2]);
    let floor_log2 = (largest.to_bits() >> 23) as i32 - 127;
    // The mantissa of the largest component shall be 256 to 511; rounding can lift it to 512, one step further.
    let exponent = (floor_log2 + BIAS - 8).clamp(0, 31);
    let exponent = exponent + i32::from((largest * power_of_two(BIAS - exponent)).round() >= 512.0);
    let [r, g, b] = components.map(|c| (c * power_of_two(BIAS - exponent)).round() as u32);
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// The colour that was packed, to the error stated at [`pack_colour`].
#[inline]
pub fn unpack_colour(packed: u32) -> Vec3 {
    let mantissas = [packed & 511, packed >> 9 & 511, packed >> 18 & 511];
    Vec3::from_array(mantissas.map(|m| m as f32)) * power_of_two((packed >> 27) as i32 - BIAS)
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
        assert_eq!(pack_colour(Vec3::ZERO), 0, "black");
        assert_eq!(unpack_colour(0), Vec3::ZERO, "black");
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
        let below_two = 2.0 - 1.0 / 4096.0;
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
            unpack_colour(pack_colour(Vec3::splat(MAX_COMPONENT - 500.0))).x,
            MAX_COMPONENT,
            "rounds to it"
        );
    }

    proptest! {
        #[test]
        fn error_bound(r in -30.0..20f32, g in -30.0..20f32, b in -30.0..20f32) {
            let colour = Vec3::new(r.exp2(), g.exp2(), b.exp2()).min(Vec3::splat(MAX_COMPONENT));
            let error = (unpack_colour(pack_colour(colour)) - colour).abs().max_element();
            prop_assert!(error <= (colour.max_element() / 512.0).max((-21f32).exp2()), "{error} for {colour}");
        }
    }
}
