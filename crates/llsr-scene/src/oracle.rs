//! Exact visibility of a segment, as the crates above a tracer see it.

use glam::DVec3;
use llsr_visibility::Partition;

/// Answers which part of a segment is visible from a point.
///
/// Implemented by a tracer; the edge finder and the shaders take it as a parameter, so that either can be used
/// with somebody else's tracer.
pub trait SegmentOracle {
    /// Working memory of one caller, kept between queries so that a query does not allocate.
    type Scratch: Default + Send;

    /// Writes to `visible` the part of the segment `a`-`b` (`t = 0` at `a`) that `p` sees.
    ///
    /// Coordinates are metres in the scene's recentred frame. A surface blocks `t` where it cuts the open
    /// segment from `p` to the point at `t`; surfaces that merely touch `p` or the segment itself do not. The
    /// certificate of `visible` says whether the answer is exact.
    fn visible_part(
        &self,
        p: DVec3,
        a: DVec3,
        b: DVec3,
        scratch: &mut Self::Scratch,
        visible: &mut Partition,
    );
}
