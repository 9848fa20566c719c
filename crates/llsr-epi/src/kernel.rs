//! The interpolation filter.

/// A 5x5 filter, the product of two filters of five taps, normalised to the sum 1.
///
/// BWG03 section 5.3 asks for a sharp peak in the centre and finds the rest uncritical; the weights of its figure 6 are not in its
/// text. A product lets windows without edges be filtered in two passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    /// Weight of one tap at distance 0, 1 and 2 along an axis; centre + 2 near + 2 far = 1.
    pub(crate) taps: [f32; 3],
}

impl Kernel {
    /// Taps 1 6 18 6 1: the weight falls to a third beside the centre and to an eighteenth two pixels away.
    pub const PEAKED: Self = Self {
        taps: [18.0 / 32.0, 6.0 / 32.0, 1.0 / 32.0],
    };

    /// Taps 1 8 36 8 1, for means that are taken to the centres of pixels ([`Settings::linear`](crate::Settings::linear)): places need no averaging, and what
    /// bends is bent less.
    pub const SHARP: Self = Self {
        taps: [36.0 / 54.0, 8.0 / 54.0, 1.0 / 54.0],
    };

    /// One for each of the 3x3 pixels, not normalised: what is filtered with it and divided by its weight is their mean.
    pub(crate) const EVEN: Self = Self {
        taps: [1.0, 1.0, 0.0],
    };

    /// A filter with the given weights at distance 0, 1 and 2 along each axis, to be normalised.
    ///
    /// None unless all are finite, `centre` and `far` are positive and centre >= near >= far.
    pub fn new(centre: f32, near: f32, far: f32) -> Option<Self> {
        let sum = centre + 2.0 * near + 2.0 * far;
        let valid = far > 0.0 && near >= far && centre >= near && sum.is_finite();
        valid.then(|| Self {
            taps: [centre, near, far].map(|w| w / sum),
        })
    }

    /// Weight of the neighbour at (dx, dy), each in -2..=2.
    #[inline]
    pub fn weight(&self, dx: isize, dy: isize) -> f32 {
        self.taps[dx.unsigned_abs()] * self.taps[dy.unsigned_abs()]
    }
}

impl Default for Kernel {
    fn default() -> Self {
        Self::PEAKED
    }
}
