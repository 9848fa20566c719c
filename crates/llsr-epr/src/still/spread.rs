//! Spreading samples over the pixels that they reach.
//!
//! The 5x5 filter of BWG03 is made for pictures with a sample in every few pixels. With one in twenty it leaves gaps and
//! steps; here the values between samples are those of a membrane that is fixed at the samples and cut at the edges
//! (the discrete Laplace equation over neighbours that reach each other), which has neither.

use glam::Vec3A;
use rayon::prelude::*;

/// Offsets of the eight neighbours and their weights; neighbour `i` and neighbour `7 - i` are opposite.
pub(crate) const AROUND: [(i32, i32, f32); 8] = [
    (-1, -1, 0.5),
    (0, -1, 1.0),
    (1, -1, 0.5),
    (-1, 0, 1.0),
    (1, 0, 1.0),
    (-1, 1, 0.5),
    (0, 1, 1.0),
    (1, 1, 0.5),
];

/// For each pixel, which of its eight neighbours it passes light on to; symmetric.
#[derive(Clone, Debug)]
pub(crate) struct Links {
    width: usize,
    masks: Vec<u8>,
    offsets: [isize; 8],
}

impl Links {
    /// `joined(x, y)` gives the bits of [`AROUND`]; links of pixels to the right and below that are not returned are cut,
    /// and neighbours must lie in the picture.
    pub(crate) fn new(width: usize, height: usize, joined: impl Fn(u32, u32) -> u8 + Sync) -> Self {
        let mut masks = vec![0u8; width * height];
        masks.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, mask) in row.iter_mut().enumerate() {
                *mask = joined(x as u32, y as u32);
            }
        });
        let offsets = AROUND.map(|(dx, dy, _)| dy as isize * width as isize + dx as isize);
        Self {
            width,
            masks,
            offsets,
        }
    }

    /// The linked neighbours of a pixel and their weights.
    #[inline]
    pub(crate) fn of(&self, index: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        let mut mask = self.masks[index];
        std::iter::from_fn(move || {
            let i = mask.trailing_zeros() as usize;
            mask &= mask.wrapping_sub(1);
            (i < 8).then(|| (index.wrapping_add_signed(self.offsets[i]), AROUND[i].2))
        })
    }

    /// Marks in `reached` all that is linked to `start`, which is not marked yet, and lists it in `found`.
    pub(crate) fn flood(&self, start: usize, reached: &mut [bool], found: &mut Vec<usize>) {
        found.clear();
        found.push(start);
        reached[start] = true;
        let mut next = 0;
        while let Some(&index) = found.get(next) {
            next += 1;
            for (neighbour, _) in self.of(index) {
                if !reached[neighbour] {
                    reached[neighbour] = true;
                    found.push(neighbour);
                }
            }
        }
    }

    /// Gives every pixel that is not fixed the value of the nearest fixed one, in steps over links, and lists the steps;
    /// where no fixed pixel is linked, the value stays and the steps are `u16::MAX`.
    pub(crate) fn fill(&self, values: &mut [Vec3A], fixed: &[bool]) -> Vec<u16> {
        let mut steps: Vec<u16> = fixed
            .iter()
            .map(|&fixed| if fixed { 0 } else { u16::MAX })
            .collect();
        let mut step = 0u16;
        let mut front: Vec<usize> = (0..fixed.len()).filter(|&i| fixed[i]).collect();
        let mut next = Vec::new();
        while !front.is_empty() {
            step = step.saturating_add(1).min(u16::MAX - 1);
            for &index in &front {
                for (neighbour, _) in self.of(index) {
                    if steps[neighbour] == u16::MAX {
                        steps[neighbour] = step;
                        values[neighbour] = values[index];
                        next.push(neighbour);
                    }
                }
            }
            front.clear();
            std::mem::swap(&mut front, &mut next);
        }
        steps
    }

    /// Takes `steps` steps towards the membrane through the fixed values. The same bits for any number of threads.
    ///
    /// Steps are Jacobi's with Chebyshev's acceleration for the eigenvalues that matter at a distance of about `spacing`
    /// pixels between samples.
    pub(crate) fn relax(&self, values: &mut Vec<Vec3A>, fixed: &[bool], spacing: f32, steps: usize) {
        let mut before = values.clone();
        let mut after = values.clone();
        // Jacobi's slowest mode between samples so far apart shrinks by about this factor a step.
        let rho = (std::f32::consts::PI / (2.0 * spacing.max(2.0))).cos();
        let mut omega = 1.0f32;
        for step in 0..steps {
            omega = match step {
                0 => 1.0,
                1 => 1.0 / (1.0 - 0.5 * rho * rho),
                _ => 1.0 / (1.0 - 0.25 * rho * rho * omega),
            };
            let (now, old) = (&*values, &before);
            after.par_chunks_mut(self.width).enumerate().for_each(|(y, row)| {
                for (x, value) in row.iter_mut().enumerate() {
                    let index = y * self.width + x;
                    if fixed[index] || self.masks[index] == 0 {
                        *value = now[index];
                        continue;
                    }
                    let (mut sum, mut weights) = (Vec3A::ZERO, 0.0);
                    for (neighbour, weight) in self.of(index) {
                        sum += now[neighbour] * weight;
                        weights += weight;
                    }
                    *value = old[index] + omega * (sum / weights - old[index]);
                }
            });
            std::mem::swap(&mut before, values);
            std::mem::swap(values, &mut after);
        }
        // Acceleration may overshoot by a little where everything around is dark.
        for value in values {
            *value = value.max(Vec3A::ZERO);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Links of all neighbours in the picture, cut between columns `cut - 1` and `cut`.
    fn links(width: u32, height: u32, cut: u32) -> Links {
        Links::new(width as usize, height as usize, |x, y| {
            let mut mask = 0;
            for (i, (dx, dy, _)) in AROUND.iter().enumerate() {
                let (u, v) = (x.wrapping_add_signed(*dx), y.wrapping_add_signed(*dy));
                if u < width && v < height && (x < cut) == (u < cut) {
                    mask |= 1 << i;
                }
            }
            mask
        })
    }

    #[test]
    fn a_membrane_between_two_fixed_columns_is_a_ramp_and_stops_at_a_cut() {
        let (width, height) = (24usize, 10);
        let links = links(24, 10, 17);
        let mut values = vec![Vec3A::ZERO; width * height];
        let mut fixed = vec![false; width * height];
        for y in 0..height {
            for (x, value) in [(0, 0.0), (16, 16.0), (23, 100.0)] {
                values[y * width + x] = Vec3A::splat(value);
                fixed[y * width + x] = true;
            }
        }
        links.fill(&mut values, &fixed);
        links.relax(&mut values, &fixed, 16.0, 200);
        for (index, value) in values.iter().enumerate() {
            let x = index % width;
            let expected = if x < 17 { x as f32 } else { 100.0 };
            assert!((value.x - expected).abs() < 0.05, "{} at column {x}", value.x);
        }
    }

    #[test]
    fn a_flood_stops_at_a_cut() {
        let links = links(9, 3, 4);
        let mut reached = vec![false; 27];
        let mut found = Vec::new();
        links.flood(0, &mut reached, &mut found);
        assert_eq!(found.len(), 12, "four columns of three");
        assert!(found.iter().all(|i| i % 9 < 4), "all left of the cut");
    }
}
