//! Which points to test first.

use super::lattice::{Lattice, fraction};

/// Shifts of successive stretches that differ by the golden ratio fall nowhere near each other.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The share of pixels whose additional tests are spread over the whole light.
///
/// The fewest tests that leave no wide stretch tend to the same places as long as the changes stay where they
/// are, and what is narrow may hide between them for long. Half the pixels is where rows of fences and rails
/// (`cargo run --example compare`) gain little more in error for each further test.
const ROVING: f64 = 0.5;

/// A lattice point to test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) index: i64,
    /// Step of the lattice on which a change beside it is to be found.
    pub(super) step: i64,
    /// Whether it is there because the pixel before had a change nearby.
    pub(super) tracked: bool,
}

/// Writes the points to test besides the ends of the light, ascending.
///
/// `changes` are those of the pixel before, ascending, in [0, 1].
pub(super) fn first_tests(lattice: &Lattice, changes: &[f64], cover: f64, points: &mut Vec<Point>) {
    let mut cover = fraction(cover);
    points.clear();
    for (i, &change) in changes.iter().enumerate() {
        let below = change - if i > 0 { changes[i - 1] } else { 0.0 };
        let above = changes.get(i + 1).unwrap_or(&1.0) - change;
        let step = lattice.step_for(below.min(above));
        let lower = lattice.at_or_below(lattice.steps(change).floor() as i64, step);
        for index in [lower, lower + step] {
            if (0..lattice.end).contains(&index) {
                points.push(Point {
                    index,
                    step,
                    tracked: true,
                });
            }
        }
    }
    in_order(points);

    let tracked = points.len();
    if tracked > 0 && cover < ROVING && lattice.gap < lattice.end as f64 {
        let stride = stride(lattice);
        let first = lattice.at_or_above(0, lattice.coarse);
        let choice = (cover / ROVING * (stride / lattice.coarse) as f64) as i64;
        let roving = (first + choice * lattice.coarse..lattice.end).step_by(stride as usize);
        points.extend(roving.map(|index| Point {
            index,
            step: lattice.coarse,
            tracked: false,
        }));
        in_order(points);
        return;
    }
    let mut from = lattice.steps(0.0);
    for i in 0..=tracked {
        let to = points[..tracked]
            .get(i)
            .map_or(lattice.steps(1.0), |point| point.index as f64);
        cover_stretch(lattice, from, to, cover, points);
        cover = fraction(cover + GOLDEN);
        from = to;
    }
    if points.len() > tracked {
        points.sort_unstable_by_key(|point| point.index);
    }
}

/// Sorts the points and joins equal ones. Finer points of one change may lie among those of another.
fn in_order(points: &mut Vec<Point>) {
    points.sort_unstable_by_key(|point| point.index);
    points.dedup_by(|double, kept| {
        let equal = double.index == kept.index;
        if equal {
            kept.step = kept.step.min(double.step);
            kept.tracked |= double.tracked;
        }
        equal
    });
}

/// The widest whole number of ordinary cells that may stay without a test, in steps.
fn stride(lattice: &Lattice) -> i64 {
    (lattice.gap / lattice.coarse as f64).floor() as i64 * lattice.coarse
}

/// Adds as few points as leave no stretch wider than `lattice.gap` between `from` and `to`, in steps.
///
/// Among the ways to place them `cover` chooses: every gap is full but the first and the last.
fn cover_stretch(lattice: &Lattice, from: f64, to: f64, cover: f64, points: &mut Vec<Point>) {
    let step = lattice.coarse;
    if to - from <= lattice.gap {
        return;
    }
    let stride = stride(lattice);
    // The first point is at most here, the last at least there.
    let first = lattice.at_or_below((from + lattice.gap).floor() as i64, step);
    let last = lattice.at_or_above((to - lattice.gap).ceil() as i64, step);
    let strides = ((last - first).max(0) + stride - 1) / stride;
    let slack = (first + strides * stride - last)
        .min(first - 1 - from.floor() as i64)
        .max(0)
        / step;
    let choice = (cover * (slack + 1) as f64) as i64;
    let first = first - choice * step;
    points.extend((0..=strides).map(|i| Point {
        index: first + i * stride,
        step,
        tracked: false,
    }));
}
