//! Boxes beside a light that runs along x: what a point sees past them, in closed form.

use glam::DVec3;
use llsr_scene::{EmissionLaw, LinearLight, Mesh};

use crate::quadrature::{Law, short_line_irradiance};

/// A box with faces along the axes, by two opposite corners.
#[derive(Clone, Copy, Debug)]
pub struct AxisBox {
    /// The corner with the least coordinates.
    pub min: DVec3,
    /// The corner with the greatest coordinates.
    pub max: DVec3,
}

impl AxisBox {
    /// The bounds of a mesh, which should be such a box.
    pub fn of(mesh: &Mesh) -> Self {
        let bounds = mesh.bounds();
        Self {
            min: bounds.min.as_dvec3(),
            max: bounds.max.as_dvec3(),
        }
    }
}

/// What arrives of a light past boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PastBoxes {
    /// Irradiance, in the unit of the light.
    pub irradiance: f64,
    /// Changes of visibility along the light above the horizon; `None` where two of them, or one and an end, lie so close
    /// (1e-6) that rounding may part or join them.
    pub changes: Option<usize>,
}

/// The light that arrives at `position` on a face with unit `normal`, past boxes, of a light along x; `origin` is the same
/// point a little off the face. Relative error about 1e-8.
///
/// # Panics
/// If the light does not run along x.
pub fn light_past_boxes(
    boxes: &[AxisBox],
    position: DVec3,
    origin: DVec3,
    normal: DVec3,
    light: &LinearLight,
) -> PastBoxes {
    let (at_a, at_b) = (normal.dot(light.a - origin), normal.dot(light.b - origin));
    let mut result = PastBoxes {
        irradiance: 0.0,
        changes: Some(0),
    };
    if at_a <= 0.0 && at_b <= 0.0 {
        return result;
    }
    let crossing = at_a / (at_a - at_b);
    let lo = if at_a < 0.0 { crossing } else { 0.0 };
    let hi = if at_b < 0.0 { crossing } else { 1.0 };
    // A convex body hides nothing above the horizon of its own faces.
    let others: Vec<AxisBox> = boxes
        .iter()
        .filter(|solid| position.clamp(solid.min, solid.max).distance(position) > 1e-5)
        .copied()
        .collect();
    let law = match light.emission {
        EmissionLaw::Diffuse => Law::Diffuse,
        EmissionLaw::Isotropic => Law::Isotropic,
    };
    let (mut changes, mut close) = (0, false);
    let mut end_before = f64::NEG_INFINITY;
    for (from, to) in visible_past_boxes(&others, origin, light.a, light.b) {
        let near = |x: f64, y: f64| x != y && (x - y).abs() < 1e-6;
        close |= from - end_before < 1e-6;
        close |= near(from, lo) || near(from, hi) || near(to, lo) || near(to, hi);
        end_before = to;
        let (from, to) = (from.max(lo), to.min(hi));
        if from >= to {
            continue;
        }
        close |= to - from < 1e-6;
        changes += usize::from(from > lo) + usize::from(to < hi);
        let steps = 4 + (200.0 * (to - from)) as u32;
        result.irradiance +=
            light.flux * short_line_irradiance(position, normal, (light.a, light.b), law, (from, to), steps);
    }
    result.changes = (!close).then_some(changes);
    result
}

/// The stretches of the light `a`-`b`, in parameters from 0 to 1, that `p` sees past the boxes, sorted.
///
/// The light runs along x, so that the segments from `p` to it agree in y and z: all enter the rectangle that a box
/// makes of its y and z in the same place and leave it in the same place. In between they sweep over a stretch of x
/// whose ends are linear in that of the light. Boxes must not hold `p`.
///
/// # Panics
/// If the light does not run along x.
pub fn visible_past_boxes(boxes: &[AxisBox], p: DVec3, a: DVec3, b: DVec3) -> Vec<(f64, f64)> {
    assert!(
        a.y == b.y && a.z == b.z && a.x != b.x,
        "the light {a} - {b} does not run along x"
    );
    let mut hidden: Vec<(f64, f64)> = boxes
        .iter()
        .filter_map(|solid| {
            let (mut enter, mut leave) = (0.0f64, 1.0f64);
            for axis in [1, 2] {
                let (from, way) = (p[axis], a[axis] - p[axis]);
                if way == 0.0 {
                    if from <= solid.min[axis] || from >= solid.max[axis] {
                        return None;
                    }
                    continue;
                }
                let (u, v) = ((solid.min[axis] - from) / way, (solid.max[axis] - from) / way);
                enter = enter.max(u.min(v));
                leave = leave.min(u.max(v));
            }
            if enter >= leave {
                return None;
            }
            // Where the light's point is if the segment has the given x at the share s of its way.
            let light_x = |x: f64, s: f64| p.x + (x - p.x) / s.max(f64::MIN_POSITIVE);
            let lo = light_x(solid.min.x, enter).min(light_x(solid.min.x, leave));
            let hi = light_x(solid.max.x, enter).max(light_x(solid.max.x, leave));
            let (u, v) = ((lo - a.x) / (b.x - a.x), (hi - a.x) / (b.x - a.x));
            Some((u.min(v), u.max(v)))
        })
        .collect();
    hidden.sort_unstable_by(|x, y| x.0.total_cmp(&y.0));
    let mut visible = Vec::new();
    let mut end = 0.0;
    for (from, to) in hidden {
        if from > end && end < 1.0 {
            visible.push((end, from.min(1.0)));
        }
        end = to.max(end);
    }
    if end < 1.0 {
        visible.push((end, 1.0));
    }
    visible
}
