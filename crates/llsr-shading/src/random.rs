//! Independent random streams for pixels.

use rand_pcg::Pcg64Mcg;

/// The [`stream`] of one subsample of one pixel and one light, made when it is first asked for: exact queries need none.
#[derive(Clone, Debug)]
pub(crate) struct Random {
    seed: u64,
    pixel: u64,
    subsample: u32,
    light: u32,
    stream: Option<Pcg64Mcg>,
}

impl Random {
    pub(crate) fn new(seed: u64, pixel: u64, subsample: u32, light: u32) -> Self {
        Self {
            seed,
            pixel,
            subsample,
            light,
            stream: None,
        }
    }

    /// The stream, where it has got to.
    pub(crate) fn stream(&mut self) -> &mut Pcg64Mcg {
        self.stream
            .get_or_insert_with(|| stream(self.seed, self.pixel, self.subsample, self.light))
    }
}

/// The stream of one subsample of one pixel and one light: the same numbers whichever thread asks.
fn stream(seed: u64, pixel: u64, subsample: u32, light: u32) -> Pcg64Mcg {
    let low = mix(seed ^ mix(pixel));
    let high = mix(low ^ (u64::from(subsample) << 32 | u64::from(light)));
    Pcg64Mcg::new(u128::from(high) << 64 | u128::from(low))
}

/// The finaliser of SplitMix64 (Steele, Lea & Flood 2014).
pub(crate) fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
