//! Which pixels to sample next: error diffusion along a Hilbert curve.
//!
//! The curve passes all pixels. On the way the priorities are summed, and each time the sum passes the next multiple of
//! a step a sample is requested: the rest is carried on to the next pixel, as in any error diffusion. (Error diffusion
//! along such curves: I. H. Witten, R. M. Neal, "Using Peano Curves for Bilevel Display of Continuous-Tone
//! Images", IEEE Computer Graphics and Applications 2(3), 1982.) Compared with diffusion line by line
//!
//! - it gives exactly the number of requests that was asked for, and every stretch of the curve, so every aligned
//!   square of 2^k pixels, gets its share to less than one request;
//! - nothing is lost at the top of the picture, where line by line nothing was carried over yet;
//! - tiles in which nothing happens are skipped, because their sums are known: it costs little more than reading the
//!   priorities once. All sums are whole numbers;
//! - requests come in an order in which neighbours in the list are neighbours in the picture, which suits a ray tracer.
//!
//! Shifting the start of the steps from frame to frame (`phase`) lets each frame choose other pixels.

use crate::Error;
use crate::hilbert::{Curve, TILE, Tile};
use crate::priority::Priorities;

/// Fractional bits of a step.
const FRACTION: u32 = 16;

/// A pixel that wants a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Request {
    /// Column, 0 at the left.
    pub x: u32,
    /// Row, 0 at the top.
    pub y: u32,
}

/// Chooses pixels by their priorities.
#[derive(Clone, Debug)]
pub struct Chooser {
    size: (u32, u32),
    curve: Curve,
    /// Sum of the priorities of each tile, by row and column of tiles.
    sums: Vec<u32>,
}

impl Chooser {
    /// Prepares the curve for pictures of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`Error::Size`] as for [`Priorities::new`].
    pub fn new(width: u32, height: u32) -> Result<Self, Error> {
        let size = Priorities::new(width, height)?.size();
        let curve = Curve::new(width as usize, height as usize);
        let columns = (width as usize).next_multiple_of(64) / TILE;
        let sums = vec![0; columns * (height as usize).div_ceil(TILE)];
        Ok(Self { size, curve, sums })
    }

    /// Replaces the contents of `out` by `count` pixels chosen by `priorities`, spread over the picture; fewer only if
    /// fewer pixels have a priority above 0.
    ///
    /// A pixel is chosen with a probability proportional to its priority over all phases, cut to a common
    /// limit where otherwise it would have to be chosen more than once. `phase` in [0, 1) shifts the choice; let it
    /// run over a well-spread sequence, say multiples of the golden ratio modulo 1. Chosen pixels have priority 0 for
    /// the next `latency` updates of the priorities: set it to the frames that a request takes to be answered.
    ///
    /// # Panics
    /// If `priorities` has another size.
    pub fn choose(
        &mut self,
        priorities: &mut Priorities,
        count: usize,
        phase: f64,
        latency: u8,
        out: &mut Vec<Request>,
    ) {
        assert_eq!(
            priorities.size(),
            self.size,
            "sizes of the priorities and the chooser"
        );
        out.clear();
        let Some((limit, total)) = self.limit(priorities, count) else {
            return;
        };
        // Not below the limit: so no pixel makes two steps.
        let scaled = total << FRACTION;
        let step = (scaled / count as u64).max(u64::from(limit) << FRACTION);
        let steps = (scaled / step).min(count as u64);
        let phase = if (0.0..1.0).contains(&phase) { phase } else { 0.0 };
        // The sum at which the next request is due: at least 1, so that empty pixels are never chosen.
        let mut due = (((1.0 - phase) * step as f64) as u64).clamp(1, step);
        let mut sum = 0;
        let columns = self.columns();
        for tile in &self.curve.tiles {
            if out.len() as u64 == steps {
                return;
            }
            let weight = u64::from(self.sums[usize::from(tile.row) * columns + usize::from(tile.column)]);
            if sum + (weight << FRACTION) < due {
                sum += weight << FRACTION;
                continue;
            }
            let order = &self.curve.orders[usize::from(tile.order)];
            for (x, y) in pixels(tile, order) {
                let i = y * priorities.stride() + x;
                sum += u64::from(priorities.values()[i].min(limit)) << FRACTION;
                if sum >= due && (out.len() as u64) < steps {
                    due += step;
                    out.push(Request {
                        x: x as u32,
                        y: y as u32,
                    });
                    priorities.set_pending(i, latency);
                }
            }
        }
    }

    fn columns(&self) -> usize {
        (self.size.0 as usize).next_multiple_of(64) / TILE
    }

    /// The largest limit for which `count` steps of the limited priorities are not below the limit, and the sum of all
    /// limited priorities. Leaves the sums of tiles for that limit. `None` if there is nothing to choose.
    fn limit(&mut self, priorities: &Priorities, count: usize) -> Option<(u8, u64)> {
        let total = self.sum_tiles(priorities, u8::MAX);
        if total == 0 || count == 0 {
            return None;
        }
        let count = count as u64;
        if total >= count * 255 {
            return Some((u8::MAX, total));
        }
        // Many requests: count the pixels of each priority.
        let mut histogram = [0u64; 256];
        for &value in priorities.values() {
            histogram[usize::from(value)] += 1;
        }
        // Sum of priorities limited to `limit`: each level up to the limit adds the pixels that reach it.
        let mut reaching: u64 = histogram[1..].iter().sum();
        let (mut limit, mut limited) = (1, reaching);
        for next in 2..=255u64 {
            reaching -= histogram[next as usize - 1];
            if limited + reaching < count * next {
                break;
            }
            (limit, limited) = (next, limited + reaching);
        }
        let limit = limit as u8;
        Some((limit, self.sum_tiles(priorities, limit)))
    }

    /// Sums the priorities, limited to `limit`, of each tile; returns the sum of all.
    fn sum_tiles(&mut self, priorities: &Priorities, limit: u8) -> u64 {
        let columns = self.columns();
        let stride = priorities.stride();
        let mut total = 0;
        for (rows, sums) in priorities
            .values()
            .chunks_exact(TILE * stride)
            .zip(self.sums.chunks_exact_mut(columns))
        {
            sums.fill(0);
            for row in rows.chunks_exact(stride) {
                let (tiles, _) = row.as_chunks::<TILE>();
                let sums = sums.iter_mut().zip(tiles);
                if limit == u8::MAX {
                    sums.for_each(|(sum, pixels)| *sum += sum_of_bytes(*pixels));
                } else {
                    sums.for_each(|(sum, pixels)| *sum += sum_of_bytes(pixels.map(|v| v.min(limit))));
                }
            }
            total += sums.iter().map(|&s| u64::from(s)).sum::<u64>();
        }
        total
    }
}

/// The sum of four bytes, by two 16-bit lanes.
#[inline(always)]
fn sum_of_bytes(bytes: [u8; TILE]) -> u32 {
    let all = u32::from_le_bytes(bytes);
    let pairs = (all & 0x00ff_00ff) + (all >> 8 & 0x00ff_00ff);
    (pairs & 0xffff) + (pairs >> 16)
}

fn pixels<'a>(tile: &Tile, order: &'a [(u8, u8)]) -> impl Iterator<Item = (usize, usize)> + use<'a> {
    let (x, y) = (usize::from(tile.column) * TILE, usize::from(tile.row) * TILE);
    order
        .iter()
        .map(move |&(dx, dy)| (x + usize::from(dx), y + usize::from(dy)))
}
