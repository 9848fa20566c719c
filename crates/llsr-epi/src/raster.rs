//! Rasterising edges: their crossings with the boundaries of pixels (BWG03 section 4.5).
//!
//! **Rule for special positions.** Every edge counts as moved by an infinitely small step to the right and a still
//! smaller one downwards. After it no edge runs along a line or through a corner: one along a
//! boundary lies in the pixels to the right of it or below, one through a corner passes to the right of it (and what lies
//! on the border of two eighths belongs to the one to which the step leads). All arithmetic on the snapped ends is
//! exact, so neighbouring pixels never disagree and an edge that leaves one pixel enters the next.

use crate::crossings::BandCrossings;
use crate::edges::{EdgeList, FRAME, UNITS};
use crate::occlusion::BandLimits;

/// Grid units in an eighth of a pixel.
pub(crate) const EIGHTH: f64 = UNITS as f64 / 8.0;
/// Added to coordinates to make them positive, in grid units and in eighths.
pub(crate) const SHIFT: i32 = FRAME * UNITS;
pub(crate) const SHIFT_EIGHTHS: i64 = FRAME as i64 * 8;

/// Marks the crossings of all edges with the lines of one band. `clear` the band first.
pub(crate) fn mark(edges: &EdgeList, limits: Option<&BandLimits<'_>>, band: &mut BandCrossings<'_>) {
    match (limits, band.lines) {
        (None, 1) => mark_all::<8>(edges, |_, _, _, _| false, band),
        (None, _) => mark_all::<7>(edges, |_, _, _, _| false, band),
        (Some(limits), lines) => {
            let hidden = |i: usize, t: f64, x: usize, y: usize| {
                let [key, end] = edges.keys[i];
                key + (end - key) * t as f32 > limits.at(x, y)
            };
            if lines == 1 {
                mark_all::<8>(edges, hidden, band);
            } else {
                mark_all::<7>(edges, hidden, band);
            }
        }
    }
}

/// `SPACING` is the binary logarithm of the distance between lines; `hidden` gets an edge, the parameter of the crossing and its pixel.
#[inline(always)]
fn mark_all<const SPACING: u32>(
    edges: &EdgeList,
    hidden: impl Fn(usize, f64, usize, usize) -> bool,
    band: &mut BandCrossings<'_>,
) {
    let lines = (UNITS >> SPACING) as usize;
    let (first_row, end_row) = (band.first_row, band.end_row);
    let (stride, pitch, width) = (band.stride, band.pitch, band.width);
    let (top, bottom) = ((first_row as i32) * UNITS, (end_row as i32) * UNITS);
    let first_line = (first_row * lines) as i32;
    let end_line = first_line + band.horizontal_lines() as i32;
    let end_column = (width * lines) as i32 + 1;
    for (i, &[x0, y0, x1, y1]) in edges.ends.iter().enumerate() {
        let (low, high) = (y0.min(y1), y0.max(y1));
        if high < top || low > bottom {
            continue;
        }
        // A line is crossed if one end lies above it (left of it) and the other on it or beyond.
        let rows = ((low >> SPACING) + 1).max(first_line)..((high >> SPACING) + 1).min(end_line);
        if !rows.is_empty() {
            // The step to the right leads away from a border between eighths to the right: round down.
            let crossing = Crossing::new((y0, x0), (y1, x1), 0.5);
            for line in rows {
                let (t, eighth) = crossing.at(line << SPACING);
                let (x, row) = ((eighth >> 3) as usize, line as usize / lines);
                if x < width && !hidden(i, t, x, row) {
                    band.horizontal[(line - first_line) as usize * stride + x] |= 1 << (eighth & 7);
                }
            }
        }
        let columns = ((x0.min(x1) >> SPACING) + 1).max(0)..((x0.max(x1) >> SPACING) + 1).min(end_column);
        if !columns.is_empty() {
            // The step to the right moves the crossing up where y grows with x, which outweighs the smaller step down.
            let up = (x1 > x0) == (y1 > y0) && y0 != y1;
            let crossing = Crossing::new((x0, y0), (x1, y1), if up { -0.5 } else { 0.5 });
            for line in columns {
                let (t, eighth) = crossing.at(line << SPACING);
                let (y, x) = ((eighth >> 3) as usize, line as usize / lines);
                if y >= first_row && y < end_row && !hidden(i, t, x.min(width - 1), y) {
                    let row = (y - first_row) * lines + line as usize % lines;
                    band.vertical[row * pitch + x] |= 1 << (eighth & 7);
                }
            }
        }
    }
}

/// Where an edge crosses lines across one axis, as a position along the other.
struct Crossing {
    from: f64,
    /// 1 / |distance of the ends across the lines|.
    inverse: f64,
    /// Numerator of the position at `from`, rounding included, and its growth with the distance from there.
    start: f64,
    slope: f64,
    /// Signed 1 / distance.
    step: f64,
}

impl Crossing {
    /// Ends as (position across the lines, position along them). `rounding` is 1/2 to round down, -1/2 to round what lies on a
    /// border to the eighth below.
    ///
    /// All sums and products are integers (and a half) below 2^47 and so exact in f64. The quotient differs from a whole number, if
    /// it is none, by at least 2^-28, and is off by less than 2^-34, so rounding down is exact, too.
    #[inline(always)]
    fn new((across0, along0): (i32, i32), (across1, along1): (i32, i32), rounding: f64) -> Self {
        let distance = f64::from(across1 - across0);
        let inverse = 1.0 / distance.abs();
        let slope = f64::from(along1 - along0);
        Self {
            from: f64::from(across0),
            inverse: inverse * (1.0 / EIGHTH),
            start: f64::from(along0 + SHIFT) * distance.abs() + rounding,
            slope: if distance < 0.0 { -slope } else { slope },
            step: if distance < 0.0 { -inverse } else { inverse },
        }
    }

    /// The parameter of the crossing with a line and its position in eighths of a pixel; positions before the picture are negative.
    #[inline(always)]
    fn at(&self, line: i32) -> (f64, i64) {
        let along = f64::from(line) - self.from;
        let eighth = (self.start + along * self.slope) * self.inverse;
        (along * self.step, eighth as i64 - SHIFT_EIGHTHS)
    }
}
