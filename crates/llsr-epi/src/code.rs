//! The 10-bit edge code of a pixel.

use crate::tables;

/// What the edges do in a pixel (BWG03 section 4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PixelClass {
    /// No edge crosses the boundary.
    Empty,
    /// One edge spans the pixel: two crossings, on different sides.
    Simple,
    /// Anything else: dangling ends, junctions, more than one edge.
    Complex,
}

/// The edge of a pixel in 10 bits: two boundary segments, ordered so that the order tells the primary region
/// (BWG03 section 4.2).
///
/// The boundary has 32 segments of an eighth of a pixel: top 0-7, right 8-15, bottom 16-23, left 24-31, each side by growing
/// x or y (y downwards). Seen from the first end towards the second, the primary region lies clockwise: to the right hand of
/// somebody who walks over the picture. Two codes that no edge has stand for empty and complex pixels.
///
/// ```
/// use llsr_epi::{EdgeCode, PixelClass};
///
/// let down = EdgeCode::new(4, 20).unwrap();
/// assert_eq!(down.class(), PixelClass::Simple);
/// assert_eq!(down.primary_share(), 9.0 / 16.0);
/// assert_eq!(down.reversed().primary_share(), 7.0 / 16.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EdgeCode(u16);

impl EdgeCode {
    /// A pixel without edges.
    pub const EMPTY: Self = Self(0);
    /// A pixel that one edge cannot describe.
    pub const COMPLEX: Self = Self(1);
    /// Mask of the bits of a code.
    pub(crate) const BITS: u16 = 0x3ff;

    /// The edge between two boundary segments; none if one is not below 32 or both lie on the same side.
    pub fn new(first: u8, second: u8) -> Option<Self> {
        let valid = first < 32 && second < 32 && first / 8 != second / 8;
        valid.then(|| Self::from_segments(first.into(), second.into()))
    }

    /// The edge between two boundary segments on different sides.
    #[inline]
    pub(crate) fn from_segments(first: u32, second: u32) -> Self {
        debug_assert!(
            first < 32 && second < 32 && first / 8 != second / 8,
            "{first} and {second} are no edge"
        );
        Self((first << 5 | second) as u16)
    }

    /// The code in the low ten bits of `word`.
    #[inline]
    pub(crate) fn from_word(word: u16) -> Self {
        Self(word & Self::BITS)
    }

    /// The ten bits.
    #[inline]
    pub fn bits(self) -> u16 {
        self.0
    }

    #[inline]
    pub(crate) fn index(self) -> usize {
        usize::from(self.0 & Self::BITS)
    }

    /// Empty, simple or complex.
    #[inline]
    pub fn class(self) -> PixelClass {
        match self {
            Self::EMPTY => PixelClass::Empty,
            Self::COMPLEX => PixelClass::Complex,
            _ => PixelClass::Simple,
        }
    }

    /// The two boundary segments of a simple pixel, first end first.
    pub fn segments(self) -> Option<(u8, u8)> {
        (self.class() == PixelClass::Simple).then_some(((self.0 >> 5) as u8, (self.0 & 31) as u8))
    }

    /// The ends of the edge of a simple pixel: the centres of its boundary segments, in pixels from the top left corner.
    pub fn ends(self) -> Option<[glam::Vec2; 2]> {
        let (first, second) = self.segments()?;
        Some([first, second].map(|segment| {
            let along = (f32::from(segment % 8) + 0.5) / 8.0;
            match segment / 8 {
                0 => glam::Vec2::new(along, 0.0),
                1 => glam::Vec2::new(1.0, along),
                2 => glam::Vec2::new(along, 1.0),
                _ => glam::Vec2::new(0.0, along),
            }
        }))
    }

    /// The same edge with the regions exchanged; empty and complex stay what they are.
    #[inline]
    pub fn reversed(self) -> Self {
        match self.class() {
            PixelClass::Simple => Self((self.0 & 31) << 5 | self.0 >> 5),
            _ => self,
        }
    }

    /// Bit c is set if corner c (top left, top right, bottom right, bottom left) is secondary; 15 for complex.
    ///
    /// This is the 4-bit code on which reachability between neighbours depends (BWG03 section 5.2).
    #[inline]
    pub fn corners(self) -> u8 {
        tables::CORNERS[self.index()]
    }

    /// Share of the pixel that is primary, in [0, 1]; exact. 1 for empty and complex pixels.
    #[inline]
    pub fn primary_share(self) -> f32 {
        f32::from(tables::AREA[self.index()]) / 512.0
    }

    /// Where the quarter-pixel region `position` (row * 4 + column, below 16) of a simple pixel lies.
    ///
    /// Everything is primary in an empty pixel and ambiguous in a complex one.
    pub fn side(self, position: u8) -> RegionSide {
        match (self.class(), self.side_bits(position.into())) {
            (PixelClass::Empty, _) | (_, 1) => RegionSide::Primary,
            (_, 2) => RegionSide::Secondary,
            _ => RegionSide::Ambiguous,
        }
    }

    /// The 2-bit table entry of a simple pixel: 0 ambiguous, 1 primary, 2 secondary.
    #[inline]
    pub(crate) fn side_bits(self, position: u32) -> u32 {
        tables::SIDE[self.index()] >> (2 * (position & 15)) & 3
    }

    /// The neighbour that is asked as number `rank` (below 5) for the colour of the secondary region: 0 N, then clockwise.
    #[inline]
    pub(crate) fn lender(self, rank: u32) -> usize {
        usize::from(tables::LENDERS[self.index()] >> (3 * rank) & 7)
    }
}

/// Where a quarter-pixel region lies with respect to the edge (BWG03 section 4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RegionSide {
    /// In the primary region, wherever in its two boundary segments the edge ends.
    Primary,
    /// In the secondary region, likewise.
    Secondary,
    /// An edge with this code may cut the region: its sample cannot be used.
    Ambiguous,
}

/// Reachability between the regions of two pixels (BWG03 section 5.2), in 4 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Reachability(u8);

impl Reachability {
    /// Over the boundary between a pixel and its right neighbour.
    pub fn right(a: EdgeCode, b: EdgeCode) -> Self {
        Self(tables::right(a.corners(), b.corners()))
    }

    /// Over the boundary between a pixel and the one below.
    pub fn down(a: EdgeCode, b: EdgeCode) -> Self {
        Self(tables::down(a.corners(), b.corners()))
    }

    /// From the first pixel of `self` through its second, which is the first of `next`, to the second of `next`.
    #[must_use]
    pub fn then(self, next: Self) -> Self {
        Self(tables::chain(self.0, next.0))
    }

    /// Along either of two paths.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The same seen from the second pixel.
    #[must_use]
    pub fn reversed(self) -> Self {
        Self(tables::transpose(self.0))
    }

    /// Does one region of the first pixel reach one of the second? `true` stands for the secondary region.
    pub fn reaches(self, from_secondary: bool, to_secondary: bool) -> bool {
        self.0 & 1 << (2 * u8::from(from_secondary) + u8::from(to_secondary)) != 0
    }
}
