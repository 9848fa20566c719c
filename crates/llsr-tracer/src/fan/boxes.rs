//! Fans against eight boxes at a time, in single precision with padding.
//!
//! A box meets the fan's triangle only if it is not wholly on one side of the plane, beyond one of the two
//! outer rays, or beyond the light. Each of these is a linear function whose extreme over a box is attained at
//! the corner that its gradient's signs select. Coordinates are taken relative to p first, so that the error is
//! relative to the distance from p to the farthest corner of the tree, not to the distance from the origin.

use glam::DVec3;
use llsr_scene::Bounds;

use super::plane::FanPlane;
use crate::build::{WIDTH, WideNode};

/// Unit roundoff of `f32`.
const U: f32 = f32::EPSILON / 2.0;

type Lanes = [f32; WIDTH];

/// A linear function of position.
#[derive(Clone, Copy, Debug, Default)]
struct Linear {
    gradient: [f32; 3],
    /// Value at the rounded p, plus and minus the bound of all rounding.
    upper: f32,
    lower: f32,
    /// Which of the six planes of a box gives the largest value on each axis.
    largest: [usize; 3],
}

impl Linear {
    /// `gradient . (x - p)`, to be evaluated at `x` - `rounded_p`, whose components are at most `reach`.
    #[inline(always)]
    fn new(gradient: DVec3, p: DVec3, rounded_p: [f32; 3], reach: f32) -> Self {
        let g = gradient.as_vec3().to_array();
        let moved = DVec3::from(rounded_p.map(f64::from)) - p;
        let constant = gradient.dot(moved) as f32;
        // The gradient, the difference, three products and three sums are rounded.
        let padding = 16.0 * U * ((g[0].abs() + g[1].abs() + g[2].abs()) * reach + constant.abs());
        Self {
            gradient: g,
            upper: constant + padding,
            lower: constant - padding,
            largest: [0, 1, 2].map(|axis| if g[axis] > 0.0 { axis + 3 } else { axis }),
        }
    }

    /// At least the largest value over each box.
    #[inline(always)]
    fn max(&self, relative: &[Lanes; 6]) -> Lanes {
        let [x, y, z] = self.largest.map(|plane| &relative[plane]);
        let [gx, gy, gz] = self.gradient;
        std::array::from_fn(|i| gx * x[i] + (gy * y[i] + (gz * z[i] + self.upper)))
    }

    /// At most the smallest value over each box.
    #[inline(always)]
    fn min(&self, relative: &[Lanes; 6]) -> Lanes {
        let [x, y, z] = self
            .largest
            .map(|plane| &relative[if plane < 3 { plane + 3 } else { plane - 3 }]);
        let [gx, gy, gz] = self.gradient;
        std::array::from_fn(|i| gx * x[i] + (gy * y[i] + (gz * z[i] + self.lower)))
    }
}

/// A fan prepared for the boxes of one tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxFilter {
    p: [f32; 3],
    reach: f32,
    /// Distance from the plane, in some unit.
    side: Linear,
    /// 0 at p, 1 on the light.
    height: Linear,
    /// alpha - middle * h.
    across: Linear,
    middle: f32,
    /// alpha - t0 h and t1 h - alpha for the outer rays at t0 and t1.
    left: Linear,
    right: Linear,
}

/// The children of a node that the fan may meet.
pub(super) struct Met {
    /// One bit a child.
    pub(super) mask: u32,
    /// The light parameters behind each child: at most the least and at least the greatest.
    pub(super) t_min: Lanes,
    pub(super) t_max: Lanes,
    /// At most the least h of each child.
    pub(super) near: Lanes,
}

impl BoxFilter {
    /// Prepares the fan for boxes inside `bounds`; [`Self::narrow`] must follow.
    #[inline(always)]
    pub(super) fn new(fan: &FanPlane, bounds: &Bounds) -> Self {
        let rounded = fan.p.as_vec3();
        let reach = (bounds.max - rounded)
            .abs()
            .max((bounds.min - rounded).abs())
            .max_element()
            * (1.0 + 4.0 * f32::EPSILON);
        let p = rounded.to_array();
        let largest = fan.normal.abs().max_element();
        Self {
            p,
            reach,
            side: Linear::new(fan.normal / largest, fan.p, p, reach),
            height: Linear::new(fan.height, fan.p, p, reach),
            across: Linear::default(),
            middle: 0.5,
            left: Linear::default(),
            right: Linear::default(),
        }
    }

    /// Looks for boxes in front of [`t0`, `t1`] only.
    #[inline(always)]
    pub(super) fn narrow(&mut self, fan: &FanPlane, [t0, t1]: [f64; 2]) {
        let linear = |gradient: DVec3| Linear::new(gradient, fan.p, self.p, self.reach);
        let middle = 0.5 * (t0 + t1) as f32;
        self.left = linear(fan.alpha - fan.height * t0);
        self.right = linear(fan.height * t1 - fan.alpha);
        self.across = linear(fan.alpha - fan.height * f64::from(middle));
        self.middle = middle;
    }

    /// Which children the fan may meet, and which light parameters they may hide.
    #[inline(always)]
    pub(super) fn meets(&self, node: &WideNode) -> Met {
        let relative: [Lanes; 6] =
            std::array::from_fn(|plane| node.bounds[plane].map(|x| x - self.p[plane % 3]));
        let (side_min, side_max) = (self.side.min(&relative), self.side.max(&relative));
        let (left, right) = (self.left.max(&relative), self.right.max(&relative));
        let (near, far) = (self.height.min(&relative), self.height.max(&relative));
        let (lo, hi) = (self.across.min(&relative), self.across.max(&relative));
        let mut mask = 0;
        for i in 0..WIDTH {
            let met = (side_min[i] <= 0.0)
                & (0.0 <= side_max[i])
                & (0.0 <= left[i])
                & (0.0 <= right[i])
                & (near[i] <= 1.0)
                & (0.0 <= far[i]);
            mask |= u32::from(met) << i;
        }
        // alpha / h - middle is extreme at corners; where the box reaches p nothing bounds it. What lies beyond the light does
        // not matter.
        let most = |a: f32, b: f32| if a > b { a } else { b };
        let least = |a: f32, b: f32| if a < b { a } else { b };
        let near_h = near.map(|h| 1.0 / most(h, f32::MIN_POSITIVE));
        let far_h = far.map(|h| 1.0 / least(most(h, f32::MIN_POSITIVE), 1.0));
        let slack = 8.0 * U;
        let t_min = std::array::from_fn(|i| {
            let t = lo[i] * if lo[i] < 0.0 { near_h[i] } else { far_h[i] };
            t - t.abs() * slack + (self.middle - slack)
        });
        let t_max = std::array::from_fn(|i| {
            let t = hi[i] * if hi[i] < 0.0 { far_h[i] } else { near_h[i] };
            t + t.abs() * slack + (self.middle + slack)
        });
        Met {
            mask,
            t_min,
            t_max,
            near,
        }
    }
}
