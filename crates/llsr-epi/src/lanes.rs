//! Words of 64 pixels, one or several at a time.

/// A run of `WORDS` neighbouring words of a bit plane.
///
/// Algorithms on bit planes are written once over this trait: `u64` is the portable form, the wide ones live in the
/// SIMD modules and must be used only where the CPU has the instructions.
pub(crate) trait Lanes: Copy {
    /// Words handled at once.
    const WORDS: usize;
    /// Loads words `at..at + WORDS`.
    fn load(plane: &[u64], at: usize) -> Self;
    /// Stores words `at..at + WORDS`.
    fn store(self, plane: &mut [u64], at: usize);
    /// All bits set.
    fn ones() -> Self;
    /// The same word everywhere.
    fn splat(word: u64) -> Self;
    /// Bitwise and.
    fn and(self, other: Self) -> Self;
    /// Bitwise or.
    fn or(self, other: Self) -> Self;
    /// `self` without the bits of `other`.
    fn without(self, other: Self) -> Self;
    /// In each word, bits move `K` places up.
    fn up<const K: u32>(self) -> Self;
    /// In each word, bits move `K` places down.
    fn down<const K: u32>(self) -> Self;

    /// Words `at..` of the plane shifted: bit x holds pixel x + dx, for dx in -2..=2. Meant for constant dx.
    #[inline(always)]
    fn load_beside(plane: &[u64], at: usize, dx: isize) -> Self {
        match dx {
            -2 => Self::load(plane, at)
                .up::<2>()
                .or(Self::load(plane, at - 1).down::<62>()),
            -1 => Self::load(plane, at)
                .up::<1>()
                .or(Self::load(plane, at - 1).down::<63>()),
            0 => Self::load(plane, at),
            1 => Self::load(plane, at)
                .down::<1>()
                .or(Self::load(plane, at + 1).up::<63>()),
            _ => Self::load(plane, at)
                .down::<2>()
                .or(Self::load(plane, at + 1).up::<62>()),
        }
    }
}

impl Lanes for u64 {
    const WORDS: usize = 1;

    #[inline(always)]
    fn load(plane: &[u64], at: usize) -> Self {
        plane[at]
    }

    #[inline(always)]
    fn store(self, plane: &mut [u64], at: usize) {
        plane[at] = self;
    }

    #[inline(always)]
    fn ones() -> Self {
        u64::MAX
    }

    #[inline(always)]
    fn splat(word: u64) -> Self {
        word
    }

    #[inline(always)]
    fn and(self, other: Self) -> Self {
        self & other
    }

    #[inline(always)]
    fn or(self, other: Self) -> Self {
        self | other
    }

    #[inline(always)]
    fn without(self, other: Self) -> Self {
        self & !other
    }

    #[inline(always)]
    fn up<const K: u32>(self) -> Self {
        self << K
    }

    #[inline(always)]
    fn down<const K: u32>(self) -> Self {
        self >> K
    }
}
