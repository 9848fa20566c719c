//! Uniform numbers from a caller's stream.

use rand_core::Rng;

/// A number uniform on the open interval (0, 1), from the upper 52 bits of one word of the stream.
///
/// The 2<sup>52</sup> values lie half way between the multiples of 2<sup>-52</sup>, so neither 0 nor 1 occurs
/// and the mean is exactly 1/2.
pub fn uniform<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    ((rng.next_u64() >> 12) as f64 + 0.5) * (1.0 / (1u64 << 52) as f64)
}
