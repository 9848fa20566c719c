//! Compares dither masks: what is left of the error of a dithered threshold after a small blur.
//!
//! `cargo run --release -p llsr-quadrature --example dither_masks`

use llsr_quadrature::DitherMask;

const SIZE: usize = 128;

/// Dither value of a pixel.
type Mask = Box<dyn Fn(u32, u32) -> f64>;

fn masks() -> Vec<(&'static str, Mask)> {
    let random = |x: u32, y: u32| {
        // SplitMix64 of the pixel's index.
        let mut z = (u64::from(y) << 32 | u64::from(x)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let gradient = |x: u32, y: u32| {
        // Jimenez 2014.
        (52.982_918_9 * (0.067_110_56 * f64::from(x) + 0.005_837_15 * f64::from(y)).fract()).fract()
    };
    // Roberts 2018, with the plastic number's powers.
    let lattice = |x: u32, y: u32| (0.754_877_666_2 * f64::from(x) + 0.569_840_290_9 * f64::from(y)).fract();
    let mask = DitherMask::blue_noise();
    vec![
        ("independent random", Box::new(random)),
        ("interleaved gradient noise", Box::new(gradient)),
        ("R2 lattice", Box::new(lattice)),
        ("void and cluster", Box::new(move |x, y| mask.value(x, y, 0))),
    ]
}

/// Root mean square of the sawtooth error, phase growing by (`gx`, `gy`) cells per pixel, after a blur.
fn residual(mask: &Mask, (gx, gy): (f64, f64), sigma: f64) -> f64 {
    let error: Vec<f64> = (0..SIZE * SIZE)
        .map(|i| {
            let (x, y) = ((i % SIZE) as u32, (i / SIZE) as u32);
            (f64::from(x) * gx + f64::from(y) * gy + 0.3 - mask(x, y)).rem_euclid(1.0) - 0.5
        })
        .collect();
    let reach = (4.0 * sigma).ceil() as i64;
    let kernel: Vec<f64> = (-reach..=reach)
        .map(|d| (-(d * d) as f64 / (2.0 * sigma * sigma)).exp())
        .collect();
    let total: f64 = kernel.iter().sum();
    // Two passes; the margin, where the blur would reach outside, is left out.
    let blur = |data: &[f64], stride: usize| -> Vec<f64> {
        let sum = |i: usize| {
            let taps = kernel.iter().enumerate();
            taps.map(|(k, w)| {
                let j = i as i64 + (k as i64 - reach) * stride as i64;
                w * data.get(j.max(0) as usize).copied().unwrap_or(0.0)
            })
            .sum::<f64>()
        };
        (0..data.len()).map(|i| sum(i) / total).collect()
    };
    let blurred = blur(&blur(&error, 1), SIZE);
    let margin = reach as usize;
    let inside = |i: &usize| {
        let (x, y) = (i % SIZE, i / SIZE);
        x.min(y) >= margin && x.max(y) < SIZE - margin
    };
    let kept: Vec<f64> = (0..SIZE * SIZE).filter(inside).map(|i| blurred[i]).collect();
    (kept.iter().map(|e| e * e).sum::<f64>() / kept.len() as f64).sqrt()
}

fn main() {
    let start = std::time::Instant::now();
    DitherMask::blue_noise();
    println!("mask made in {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    println!("rms error after a Gaussian blur of 1.5 pixels, in cells of the dithered lattice");
    println!("mask                           constant   up to 0.2   up to 0.7    worst  (cells per pixel)");
    for (name, mask) in masks() {
        let constant = residual(&mask, (0.0, 0.0), 1.5);
        let (mut slow, mut all, mut worst) = ((0.0, 0), (0.0, 0), (0.0, (0.0, 0.0)));
        for i in -16..=16 {
            for j in 0..=16 {
                let gradient = (f64::from(i) / 32.0, f64::from(j) / 32.0);
                let rms = residual(&mask, gradient, 1.5);
                all = (all.0 + rms, all.1 + 1);
                if gradient.0.hypot(gradient.1) <= 0.2 {
                    slow = (slow.0 + rms, slow.1 + 1);
                }
                if rms > worst.0 {
                    worst = (rms, gradient);
                }
            }
        }
        // The worst gradient between the grid points, by a shrinking search around the worst of them.
        let mut step = 1.0 / 64.0;
        while step > 1e-4 {
            let ((before, (x, y)), steps) = (worst, [-step, 0.0, step]);
            for gradient in steps.iter().flat_map(|dx| steps.map(|dy| (x + dx, y + dy))) {
                let rms = residual(&mask, gradient, 1.5);
                if rms > worst.0 {
                    worst = (rms, gradient);
                }
            }
            if worst.0 == before {
                step *= 0.5;
            }
        }
        let (slow, all) = (slow.0 / f64::from(slow.1), all.0 / f64::from(all.1));
        println!(
            "{name:28} {constant:10.3} {slow:11.3} {all:11.3} {:8.3}  {:.3?}",
            worst.0, worst.1
        );
    }
}
