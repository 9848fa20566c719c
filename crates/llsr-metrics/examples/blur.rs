//! Compares a picture with worse copies of itself and prints every measure.
//!
//! `cargo run --release -p llsr-metrics --example blur`

use llsr_metrics::{Error, Image, Options, compare};

const WIDTH: usize = 256;
const HEIGHT: usize = 256;

/// A soft-edged disc over a floor that darkens to the left, in lux.
fn scene(x: f64, y: f64) -> [f32; 3] {
    let distance = (x - 128.0).hypot(y - 110.0);
    let disc = ((60.0 - distance) / 3.0 + 0.5).clamp(0.0, 1.0);
    let floor = 40.0 + x;
    let light = [1.0, 0.93, 0.8];
    light.map(|c| (c * (floor * (1.0 - disc) + 500.0 * disc)) as f32)
}

fn picture(pixel: impl Fn(usize, usize) -> [f32; 3]) -> Vec<[f32; 3]> {
    (0..WIDTH * HEIGHT).map(|i| pixel(i % WIDTH, i / WIDTH)).collect()
}

fn main() -> Result<(), Error> {
    let reference = picture(|x, y| scene(x as f64, y as f64));
    let shifted = picture(|x, y| scene(x as f64 + 1.0, y as f64));
    let brighter = picture(|x, y| scene(x as f64, y as f64).map(|v| 1.05 * v));
    // A hash as noise of 5%.
    let noisy = picture(|x, y| {
        let hash = (x as u32).wrapping_mul(0x9e37_79b9) ^ (y as u32).wrapping_mul(0x85eb_ca6b);
        let unit = (hash ^ (hash >> 15)).wrapping_mul(0x2c1b_3c6d) as f32 / u32::MAX as f32;
        scene(x as f64, y as f64).map(|v| v * (0.95 + 0.1 * unit))
    });

    let b = Image::new(WIDTH, HEIGHT, &reference)?;
    println!(
        "{:<10} {:>8} {:>9} {:>7} {:>8} {:>8}",
        "", "rmse", "rel_rmse", "max", "psnr", "flip"
    );
    for (name, test) in [("shifted", &shifted), ("brighter", &brighter), ("noisy", &noisy)] {
        let c = compare(Image::new(WIDTH, HEIGHT, test)?, b, &Options::default())?;
        println!(
            "{name:<10} {:8.3} {:9.4} {:7.3} {:8.2} {:8.4}",
            c.rmse, c.rel_rmse, c.max, c.psnr, c.flip
        );
    }
    Ok(())
}
