//! Fans against all triangles, in exact arithmetic.

use std::cmp::Ordering;

use glam::{DVec3, Vec3};
use llsr_visibility::{Panel, Partition};

use super::Exact;

/// A stretch of the light between two places where something may change.
#[derive(Clone, Copy, Debug)]
pub struct FanCell {
    /// First parameter.
    pub lo: f64,
    /// Last parameter.
    pub hi: f64,
    /// How much `lo` moves for a relative change of the coordinates.
    pub lo_condition: f64,
    /// How much `hi` moves for a relative change of the coordinates.
    pub hi_condition: f64,
    /// Whether some triangle cuts the segment from the point to the light in between.
    pub blocked: bool,
}

/// Which part of the segment `a`-`b` the triangles hide from `p`: sorted cells that cover [0, 1].
///
/// Cells end where the plane through `p` and an edge meets the light, or where a triangle's plane does; each is decided
/// at its middle, by the exact sides of that point of the light. Cost: the square of the number of triangles that the fan's plane cuts.
pub fn fan_cells(triangles: &[[Vec3; 3]], p: DVec3, a: DVec3, b: DVec3) -> Vec<FanCell> {
    let cut: Vec<[DVec3; 3]> = triangles
        .iter()
        .map(|t| t.map(|v| v.as_dvec3()))
        .filter(|t| {
            let sides = t.map(|v| side(p, a, b, v));
            !sides.iter().all(|&s| s == Ordering::Less) && !sides.iter().all(|&s| s == Ordering::Greater)
        })
        .collect();
    // An event may fall on an end of the light up to rounding.
    let mut events = vec![(0.0, 1.0), (1.0, 1.0)];
    for &[u, v, w] in &cut {
        for (x, y, z) in [(p, u, v), (p, v, w), (p, w, u), (u, v, w)] {
            events.extend(plane_meets_line(x, y, z, a, b).filter(|&(t, _)| 0.0 < t && t < 1.0));
        }
    }
    events.sort_unstable_by(|x, y| x.0.total_cmp(&y.0));
    events
        .windows(2)
        .map(|pair| {
            let [(lo, lo_condition), (hi, hi_condition)] = [pair[0], pair[1]];
            let t = 0.5 * (lo + hi);
            FanCell {
                lo,
                hi,
                lo_condition,
                hi_condition,
                blocked: lo < hi && cut.iter().any(|&triangle| cuts(triangle, p, a, b, t)),
            }
        })
        .collect()
}

/// How an answer differs from the truth.
#[derive(Clone, Copy, Debug, Default)]
pub struct FanDisagreement {
    /// Width of the light that is hidden but was reported visible.
    pub missed: f64,
    /// Width of the light that is visible but was reported hidden.
    pub invented: f64,
    /// Width of the light that is contested between an end and where it may have moved, across places where nothing ends.
    pub moved: f64,
    /// Cells wide enough to be compared.
    pub compared: usize,
}

/// Compares a visible set with the cells, each shortened by `tolerance` times the condition number of its ends.
///
/// A cell may end where nothing becomes visible or hidden, next to an end that moves further than to there. What is contested
/// without a break up to an end of what is hidden, and no wider than `tolerance` times that end's condition number, is the end's move.
pub fn disagreement(cells: &[FanCell], visible: &Partition, tolerance: f64) -> FanDisagreement {
    let mut result = FanDisagreement::default();
    let mut hidden = Partition::default();
    visible.complement_into(&mut hidden);
    let wide: Vec<FanCell> = cells.iter().filter(|cell| cell.lo < cell.hi).copied().collect();
    for run in wide.chunk_by(|x, y| x.blocked == y.blocked) {
        let [Some(first), Some(last)] = [run.first(), run.last()] else {
            continue;
        };
        let wrong = if first.blocked { visible } else { &hidden };
        for cell in run {
            let lo = cell.lo + tolerance * cell.lo_condition;
            let hi = cell.hi - tolerance * cell.hi_condition;
            if hi - lo <= 1e-12 {
                continue;
            }
            result.compared += 1;
            for &Panel {
                start: from, end: to, ..
            } in wrong.panels()
            {
                let width = to.min(hi) - from.max(lo);
                if width <= if cell.blocked { 0.0 } else { 1e-15 } {
                    continue;
                }
                let contested = to.min(last.hi) - from.max(first.lo);
                let from_start =
                    0.0 < first.lo && from <= first.lo && contested <= tolerance * first.lo_condition;
                let to_end = last.hi < 1.0 && last.hi <= to && contested <= tolerance * last.hi_condition;
                *match (from_start || to_end, cell.blocked) {
                    (true, _) => &mut result.moved,
                    (false, true) => &mut result.missed,
                    (false, false) => &mut result.invented,
                } += width;
            }
        }
    }
    result
}

/// Twice the area-weighted height, its rounding scale and its exact sign.
fn side(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Ordering {
    let (value, scale) = height(a, b, c, d);
    if value.abs() > 1e-13 * scale {
        return value.total_cmp(&0.0);
    }
    Exact::orientation(a, b, c, d).sign()
}

fn height(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> (f64, f64) {
    let (a, b, c) = (a - d, b - d, c - d);
    let (m, n, o) = (a.abs(), b.abs(), c.abs());
    let scale = m.x * (n.y * o.z + n.z * o.y) + m.y * (n.z * o.x + n.x * o.z) + m.z * (n.x * o.y + n.y * o.x);
    (a.dot(b.cross(c)), scale)
}

/// Does a triangle cut the segment from `p` to the point of `a`-`b` at `t`, a parameter inside a cell?
///
/// That point has no coordinates in doubles. Rounded, it may leave a triangle in whose plane the fan all but lies, so it is never
/// formed: its sides are those of (1 - t) a + t b in exact arithmetic.
fn cuts([u, v, w]: [DVec3; 3], p: DVec3, a: DVec3, b: DVec3, t: f64) -> bool {
    let at_p = side(u, v, w, p);
    let at_q = side_between(u, v, w, [a, b], t);
    if at_p == Ordering::Equal || at_q == Ordering::Equal || at_p == at_q {
        return false;
    }
    let turns = [(u, v), (v, w), (w, u)].map(|(x, y)| side_between(p, x, y, [a, b], t));
    !(turns.contains(&Ordering::Less) && turns.contains(&Ordering::Greater))
}

/// The exact sign of the height of (1 - t) a + t b over x, y, z. Heights are linear along a line.
fn side_between(x: DVec3, y: DVec3, z: DVec3, [a, b]: [DVec3; 2], t: f64) -> Ordering {
    let (at_a, scale_a) = height(x, y, z, a);
    let (at_b, scale_b) = height(x, y, z, b);
    let value = at_a * (1.0 - t) + at_b * t;
    if value.abs() > 1e-13 * (scale_a * (1.0 - t) + scale_b * t) {
        return value.total_cmp(&0.0);
    }
    let t = Exact::from(t);
    let rest = Exact::from(1.0) - t.clone();
    let [at_a, at_b] = [a, b].map(|q| Exact::orientation(x, y, z, q));
    (&at_a * &rest + &at_b * &t).sign()
}

/// Where the plane x, y, z meets the line a-b, and the condition number; nothing if they are parallel.
fn plane_meets_line(x: DVec3, y: DVec3, z: DVec3, a: DVec3, b: DVec3) -> Option<(f64, f64)> {
    let (at_a, scale_a) = height(x, y, z, a);
    let (at_b, scale_b) = height(x, y, z, b);
    let accurate = at_a.abs() > 1e-3 * scale_a && at_b.abs() > 1e-3 * scale_b;
    let (at_a, at_b) = if accurate {
        (at_a, at_b)
    } else {
        let exact = |q| Exact::orientation(x, y, z, q).approximate();
        (exact(a), exact(b))
    };
    let t = at_a / (at_a - at_b);
    let condition = (scale_a + scale_b) / (at_a - at_b).abs();
    t.is_finite().then_some((t, condition))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// p and the light lie within 1e-17 of this triangle's plane. Rational arithmetic puts p above it and the light from this parameter
    /// on below, and between p and that part of the light the triangle lies all along.
    #[test]
    fn a_fan_all_but_in_a_triangle_is_decided_at_points_that_are_not_rounded() {
        const FIRST_HIDDEN: f64 = 0.886_497_957_295_678_6;
        let triangle = [
            Vec3::new(-0.2175826, -0.3799105, -0.624998),
            Vec3::new(-0.18167315, -0.15319464, -0.5269965),
            Vec3::new(0.22504568, -0.4710082, -0.21518467),
        ]
        .map(|v| v.as_dvec3());
        let p = DVec3::new(-0.053597028466086216, -0.38772186371419914, -0.46599506975508);
        let a = DVec3::new(-0.18741490200021188, -0.36355882567833786, -0.5908265320171713);
        let b = DVec3::new(-0.00859080018952929, -0.34935848987457274, -0.4111519781196925);
        let mut astray = 0;
        for i in 0..=4096 {
            let t = f64::from(i) / 4096.0;
            assert_eq!(cuts(triangle, p, a, b, t), t > FIRST_HIDDEN, "at {t}");
            let rounded = a + (b - a) * t;
            astray += u32::from(cuts(triangle, p, rounded, rounded, 0.0) != (t > FIRST_HIDDEN));
        }
        assert!(astray > 400, "rounded points go astray: {astray}");
    }

    /// Hidden up to 0.5, an end that moves as far as `condition` says, with a cell that ends at 0.4 for no reason.
    fn hidden_half(condition: f64) -> [FanCell; 3] {
        let cell = |[lo, hi]: [f64; 2], [lo_condition, hi_condition]: [f64; 2], blocked| FanCell {
            lo,
            hi,
            lo_condition,
            hi_condition,
            blocked,
        };
        [
            cell([0.0, 0.4], [1.0, 1.0], true),
            cell([0.4, 0.5], [1.0, condition], true),
            cell([0.5, 1.0], [condition, 1.0], false),
        ]
    }

    fn seen(panels: &[[f64; 2]]) -> Partition {
        let mut visible = Partition::default();
        for &[start, end] in panels {
            visible.push(Panel::exact(start, end));
        }
        visible
    }

    #[test]
    fn an_end_may_move_as_far_as_its_condition_says_and_nothing_else_may() {
        // By 0.2, by 0.05, by more than 0.2, and a hole apart from the end.
        let cases = [
            (2e8, &[[0.35, 1.0]][..], true),
            (5e7, &[[0.35, 1.0]], false),
            (2e8, &[[0.25, 1.0]], false),
            (2e8, &[[0.35, 0.38], [0.5, 1.0]], false),
            (2e8, &[[0.0, 0.1], [0.5, 1.0]], false),
        ];
        for (condition, panels, passes) in cases {
            let found = disagreement(&hidden_half(condition), &seen(panels), 1e-9);
            assert_eq!(found.missed == 0.0, passes, "{panels:?}: {found:?}");
            assert_eq!(found.moved > 0.0, passes, "{panels:?}: {found:?}");
            assert_eq!(found.invented, 0.0, "{panels:?}: {found:?}");
        }
    }
}
