//! Planes of a block of items, quantised to 16 bits in the block's own range.
//!
//! A scan over many edges is bound by memory. Sixteen bits a number halve what it reads; the block's range is
//! small, so a step is too, and the few planes within a step of the viewer are left to an exact test.

/// Items of a block: one bit each in a mask.
pub(crate) const BLOCK: usize = 64;

/// Largest quantised value.
const TOP: f64 = 65535.0;

/// Up to 64 items of `P` planes (normal, offset): number k of plane p of item i is
/// `lo[p][k] + step[p][k] * quantised[p][k][i]`, within half a step.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct PlaneBlock<const P: usize> {
    pub(crate) lo: [[f32; 4]; P],
    pub(crate) step: [[f32; 4]; P],
    pub(crate) quantised: [[[u16; BLOCK]; 4]; P],
}

impl<const P: usize> PlaneBlock<P> {
    /// Quantises the planes of 1 to 64 items.
    pub(crate) fn new(planes: impl ExactSizeIterator<Item = [[f64; 4]; P]>) -> Self {
        let planes: Vec<[[f64; 4]; P]> = planes.collect();
        debug_assert!((1..=BLOCK).contains(&planes.len()), "a block of {}", planes.len());
        let mut block = Self {
            lo: [[0.0; 4]; P],
            step: [[0.0; 4]; P],
            quantised: [[[0; BLOCK]; 4]; P],
        };
        for p in 0..P {
            for k in 0..4 {
                let values = || planes.iter().map(|plane| plane[p][k]);
                let lo = round_down(values().fold(f64::INFINITY, f64::min));
                let hi = round_up(values().fold(f64::NEG_INFINITY, f64::max));
                let width = f64::from(hi) - f64::from(lo);
                // Rounded up, so that the last step reaches the largest value.
                let step = round_up(width / TOP).next_up().max(f32::MIN_POSITIVE);
                block.lo[p][k] = lo;
                block.step[p][k] = step;
                for (i, value) in values().enumerate() {
                    let steps = (value - f64::from(lo)) / f64::from(step);
                    block.quantised[p][k][i] = steps.round().clamp(0.0, TOP) as u16;
                }
            }
        }
        block
    }
}

fn round_down(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x {
        near.next_down()
    } else {
        near
    }
}

fn round_up(x: f64) -> f32 {
    -round_down(-x)
}

/// A viewer's plane coefficients: the side of (normal, offset) is their dot product with this.
pub(crate) type View = [f32; 4];

/// What the quantised planes of a block say about one viewer, or about several together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BlockMasks {
    /// All planes of the item face all viewers, as far as the quantised values tell.
    pub(crate) front: u64,
    /// No plane of the item faces any viewer.
    pub(crate) back: u64,
    /// A plane of the item is so close to a viewer that its side is not sure.
    pub(crate) unsure: u64,
}

/// Linear form of one plane of a block for one viewer: side = `offset` + Σ `slope[k]` · quantised[k].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Form {
    pub(crate) offset: f32,
    pub(crate) slope: [f32; 4],
    /// Sides nearer to 0 than this are not sure.
    pub(crate) error: f32,
}

/// Error of planes before quantising, in the tree's frame: what [`Plane::of`](super::Plane::of) allows the normal,
/// 2⁻³⁰, over a distance of at most 1 + √3, and the double-precision rounding of offset and frame.
const PLANE_ERROR: f32 = 4e-9;

impl<const P: usize> PlaneBlock<P> {
    /// The form of plane `p` for a viewer whose coefficients are at most 1.
    ///
    /// Error, with u the unit roundoff, R = Σ|lo v| and S = Σ|step v|: half a step, 0.5 S; rounding of `view` to
    /// single precision, u (R + 65535 S); of the offset, 4u R; of the slopes, 65535 · 2u S; of the sum of five
    /// terms with or without fused operations, 8u (R + 65535 S). Together below 0.6 S + 16u R, with room for the
    /// rounding of the bound itself.
    #[inline(always)]
    pub(crate) fn form(&self, p: usize, view: &View) -> Form {
        let slope: [f32; 4] = std::array::from_fn(|k| self.step[p][k] * view[k]);
        let base: [f32; 4] = std::array::from_fn(|k| self.lo[p][k] * view[k]);
        let sum = |x: [f32; 4]| (x[0] + x[1]) + (x[2] + x[3]);
        let range = sum(base.map(f32::abs));
        Form {
            offset: sum(base),
            slope,
            error: 0.6 * sum(slope.map(f32::abs)) + 16.0 * (0.5 * f32::EPSILON) * range + PLANE_ERROR,
        }
    }
}
