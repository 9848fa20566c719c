//! Rasterising edges: their crossings with the boundaries of pixels (BWG03 section 4.5).
//!
//! **Rule for special positions.** Every edge counts as moved by an infinitely small step to the right and a still
//! smaller one downwards. After it no edge runs along a line or through a corner: one along a
//! boundary lies in the pixels to the right of it or below, one through a corner passes to the right of it (and what lies
//! on the border of two eighths belongs to the one to which the step leads). All arithmetic on the snapped ends is
//! exact, so neighbouring pixels never disagree and an edge that leaves one pixel enters the next.

use crate::crossings::BandCrossings;
use crate::edges::{EdgeList, UNITS};
use crate::occlusion::DepthLimits;

/// Grid units in an eighth of a pixel.
const EIGHTH: i64 = UNITS as i64 / 8;

/// Marks the crossings of all edges with the lines of one band. `clear` the band first.
pub(crate) fn mark(edges: &EdgeList, limits: Option<&DepthLimits>, band: &mut BandCrossings<'_>) {
    let spacing_shift = if band.lines == 2 { 7 } else { 8 };
    // Grid rows that the band's lines can meet; the border line belongs to the last band.
    let top = band.first_row as i32 * UNITS;
    let bottom = band.end_row as i32 * UNITS;
    for i in 0..edges.len() {
        let edge = Edge::new(edges, i);
        let (low, high) = (edge.y0.min(edge.y1), edge.y0.max(edge.y1));
        if high < top || low > bottom {
            continue;
        }
        edge.mark_horizontal(spacing_shift, limits, band);
        edge.mark_vertical(spacing_shift, limits, band);
    }
}

/// One edge with what its crossings need.
struct Edge {
    x0: i32,
    y0: i32,
    x1: i32,
    y1: i32,
    key: f32,
    key_step: f32,
}

impl Edge {
    fn new(edges: &EdgeList, i: usize) -> Self {
        Self {
            x0: edges.x0[i],
            y0: edges.y0[i],
            x1: edges.x1[i],
            y1: edges.y1[i],
            key: edges.key0[i],
            key_step: edges.key1[i] - edges.key0[i],
        }
    }

    fn hidden(&self, limits: Option<&DepthLimits>, t: f32, x: usize, y: usize) -> bool {
        limits.is_some_and(|limits| self.key + self.key_step * t > limits.at(x, y))
    }

    fn mark_horizontal(&self, shift: u32, limits: Option<&DepthLimits>, band: &mut BandCrossings<'_>) {
        let lines = band.lines;
        let first_line = (band.first_row * lines) as i32;
        let end_line = (band.end_row * lines) as i32 + i32::from(band.border.is_some());
        // A line y is crossed if one end lies above it and the other on or below it.
        let from = ((self.y0.min(self.y1) >> shift) + 1).max(first_line);
        let to = ((self.y0.max(self.y1) >> shift) + 1).min(end_line);
        let (dx, dy) = (i64::from(self.x1 - self.x0), i64::from(self.y1 - self.y0));
        for line in from..to {
            let along = i64::from((line << shift) - self.y0);
            // The step to the right leads out of a border between eighths to the right: round down.
            let eighth = floor_div(i64::from(self.x0) * dy + along * dx, EIGHTH * dy);
            let x = eighth >> 3;
            if x < 0 || x >= band.width as i64 {
                continue;
            }
            let (x, row) = (x as usize, line as usize / lines);
            if self.hidden(limits, along as f32 / dy as f32, x, row) {
                continue;
            }
            let bit = 1 << (eighth & 7);
            let index = (line - first_line) as usize * band.stride + x;
            match &mut band.border {
                Some(border) if row == band.end_row => border[x] |= bit,
                _ => band.horizontal[index] |= bit,
            }
        }
    }

    fn mark_vertical(&self, shift: u32, limits: Option<&DepthLimits>, band: &mut BandCrossings<'_>) {
        let lines = band.lines;
        let (first_row, end_row) = (band.first_row as i64, band.end_row as i64);
        let from = ((self.x0.min(self.x1) >> shift) + 1).max(0);
        let to = ((self.x0.max(self.x1) >> shift) + 1).min((band.width * lines) as i32 + 1);
        let (dx, dy) = (i64::from(self.x1 - self.x0), i64::from(self.y1 - self.y0));
        // The step to the right moves the crossing up where y grows with x, which then outweighs the step downwards.
        let up = i64::from((dx > 0) == (dy > 0) && dy != 0);
        for line in from..to {
            let along = i64::from((line << shift) - self.x0);
            let (numerator, denominator) = (i64::from(self.y0) * dx + along * dy, EIGHTH * dx);
            let numerator = if denominator < 0 { -numerator } else { numerator };
            let eighth = floor_div(numerator - up, denominator.abs());
            let y = eighth >> 3;
            if y < first_row || y >= end_row {
                continue;
            }
            let x = line as usize / lines;
            if self.hidden(
                limits,
                along as f32 / dx as f32,
                x.min(band.width - 1),
                y as usize,
            ) {
                continue;
            }
            let row = (y - first_row) as usize * lines + line as usize % lines;
            band.vertical[row * (band.stride + 1) + x] |= 1 << (eighth & 7);
        }
    }
}

/// Quotient rounded down, for any signs.
fn floor_div(numerator: i64, denominator: i64) -> i64 {
    let (n, d) = if denominator < 0 {
        (-numerator, -denominator)
    } else {
        (numerator, denominator)
    };
    n.div_euclid(d)
}
