//! A blue-noise mask: one dither value per pixel whose errors the eye averages away.
//!
//! Dithered bisection turns an unknown end of a shadow into an error that is a sawtooth of (position of the
//! end in its cell - dither value). Independent random values make that error white noise. A mask whose
//! neighbours differ makes it noise of high frequency, which the eye, a reconstruction filter, or the mere
//! size of a pixel removes.
//!
//! # Which mask, and why
//! `cargo run --release -p llsr-quadrature --example dither_masks` measures the rms of the error that a
//! Gaussian blur of 1.5 pixels leaves, in cells, for a sawtooth whose phase changes by so many cells a pixel:
//!
//! | values per pixel | constant | mean up to 0.2 | mean up to 0.7 | worst |
//! | --- | --- | --- | --- | --- |
//! | independent random | 0.054 | 0.055 | 0.054 | 0.058 |
//! | interleaved gradient noise | 0.014 | 0.024 | 0.050 | 0.405 |
//! | R2 lattice | 0.012 | 0.024 | 0.033 | 0.409 |
//! | void and cluster, 64x64 (this one) | 0.015 | 0.034 | 0.053 | 0.070 |
//!
//! Both lattices do a little better on average, but where the end of the shadow moves in step with the
//! lattice, their error stays as large as without any dither, in visible bands. A penumbra that curves
//! has such a place. The mask is far better than random values where the shadow is smooth and has no bad place.
//!
//! Source: R. Ulichney, "The void-and-cluster method for dither array generation", SPIE 1913, 1993.

use std::sync::OnceLock;

/// Width and height of the mask in pixels.
const SIZE: usize = 64;
const PIXELS: usize = SIZE * SIZE;
/// The filter falls to this in one pixel: a Gaussian of 1.5 pixels, Ulichney's choice.
const FALLOFF: f64 = 0.800_737_402_916_808_1; // exp(-1 / (2 1.5^2))
/// Beyond this many pixels the quantised filter is zero.
const REACH: usize = 13;
/// Share of the pixels in the first binary pattern.
const FIRST_SHARE: usize = 10;

/// A tile of 64x64 values that repeats over the picture; each multiple of 1/4096 occurs once.
#[derive(Clone, Debug)]
pub struct DitherMask {
    values: Box<[f32; PIXELS]>,
}

impl DitherMask {
    /// The one mask of this crate, made on first use (some 10 ms) and always the same.
    pub fn blue_noise() -> &'static Self {
        static MASK: OnceLock<DitherMask> = OnceLock::new();
        MASK.get_or_init(Self::generate)
    }

    /// The value in (0, 1) for the pixel (`x`, `y`).
    ///
    /// `layer` tells apart several values of one pixel (lights, subsamples, frames): layers are the mask
    /// rotated by multiples of the golden ratio, so consecutive layers of a pixel are evenly spread over
    /// [0, 1), and each layer is blue noise again. Cost: a table look-up.
    #[inline]
    pub fn value(&self, x: u32, y: u32, layer: u32) -> f64 {
        const GOLDEN: f64 = 0.618_033_988_749_894_8;
        let value = f64::from(self.values[(y as usize % SIZE) * SIZE + x as usize % SIZE]);
        (value + f64::from(layer) * GOLDEN).fract()
    }

    /// Void and cluster: ranks pixels so that at every threshold the pixels below it are spread evenly.
    fn generate() -> Self {
        let mut pattern = Pattern::scattered();
        // Swap until the tightest one is also the largest void: the pattern is then even.
        loop {
            let cluster = pattern.tightest_cluster();
            pattern.set(cluster, false);
            let void = pattern.largest_void();
            pattern.set(void, true);
            if void == cluster {
                break;
            }
        }
        let mut ranks = [0u16; PIXELS];
        let first = PIXELS / FIRST_SHARE;
        // Downwards from the first pattern by removing clusters, upwards by filling voids. (Ulichney's third
        // phase looks for clusters of zeros, which are the voids of the ones.)
        let mut thinned = pattern.clone();
        for rank in (0..first).rev() {
            let pixel = thinned.tightest_cluster();
            thinned.set(pixel, false);
            ranks[pixel] = rank as u16;
        }
        for rank in first..PIXELS {
            let pixel = pattern.largest_void();
            pattern.set(pixel, true);
            ranks[pixel] = rank as u16;
        }
        let values = ranks.map(|rank| (f32::from(rank) + 0.5) / PIXELS as f32);
        Self {
            values: Box::new(values),
        }
    }
}

/// A binary pattern on a torus with the filtered density of its ones at every pixel.
#[derive(Clone)]
struct Pattern {
    ones: Vec<bool>,
    /// In units of 2^-56, so that sums are exact in any order and the mask is the same everywhere.
    energy: Vec<u64>,
    kernel: Vec<u64>,
}

impl Pattern {
    /// One pixel in ten, at places that a linear congruence scatters.
    fn scattered() -> Self {
        // The product of d^2 factors: unlike exp, the same on every machine.
        let weight = |d: usize| (0..d.abs_diff(REACH).pow(2)).fold(1.0, |product, _| product * FALLOFF);
        let side = 2 * REACH + 1;
        let kernel = (0..side * side).map(|i| (weight(i % side) * weight(i / side) * 2f64.powi(56)) as u64);
        let mut pattern = Self {
            ones: vec![false; PIXELS],
            energy: vec![0; PIXELS],
            kernel: kernel.collect(),
        };
        let (mut state, mut left) = (0x2545_f491_4f6c_dd1du64, PIXELS / FIRST_SHARE);
        while left > 0 {
            // Knuth's MMIX generator; its high bits pick the pixel.
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let pixel = (state >> 52) as usize % PIXELS;
            if !pattern.ones[pixel] {
                pattern.set(pixel, true);
                left -= 1;
            }
        }
        pattern
    }

    fn set(&mut self, pixel: usize, one: bool) {
        self.ones[pixel] = one;
        let (x0, y0) = (pixel % SIZE + SIZE - REACH, pixel / SIZE + SIZE - REACH);
        for (j, row) in self.kernel.chunks_exact(2 * REACH + 1).enumerate() {
            let start = (y0 + j) % SIZE * SIZE;
            for (i, &weight) in row.iter().enumerate() {
                let energy = &mut self.energy[start + (x0 + i) % SIZE];
                *energy = if one { *energy + weight } else { *energy - weight };
            }
        }
    }

    /// The one where ones are densest; the first of equals.
    fn tightest_cluster(&self) -> usize {
        let mut best = (0, 0);
        for (pixel, (&one, &energy)) in self.ones.iter().zip(&self.energy).enumerate() {
            if one && energy > best.1 {
                best = (pixel, energy);
            }
        }
        best.0
    }

    /// The zero where ones are sparsest; the first of equals.
    fn largest_void(&self) -> usize {
        let mut best = (0, u64::MAX);
        for (pixel, (&one, &energy)) in self.ones.iter().zip(&self.energy).enumerate() {
            if !one && energy < best.1 {
                best = (pixel, energy);
            }
        }
        best.0
    }
}
