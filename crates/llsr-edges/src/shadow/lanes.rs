//! Eight faces of a receiver cut by an event's wedge together.
//!
//! Plain loops over eight lanes without branches, compiled once more for wide registers: all copies give the same bits.
#![cfg_attr(
    target_arch = "x86_64",
    expect(
        unsafe_code,
        reason = "calls of copies compiled for instructions that were asked for"
    )
)]

use glam::{DVec3, Vec3};

use super::section::Frame;

/// Faces cut together.
pub(super) const LANES: usize = 8;

/// A face that touches the blocker within this part of its distance from the light counts as behind it: contacts are
/// only as good as single-precision coordinates.
const CONTACT: f64 = 1e-5;
/// Nearest distance from the origin of an event, relative to that of the blocker from the light.
const NEAREST: f64 = 1e-7;
/// Farther from the blocker than this, relative to its distance from the light, no corner can be one of its own.
const NEAR: f64 = 1e-3;

type Lanes = [f64; LANES];

/// Which parts of the plane, by alpha + beta, are behind the blocker and which before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rule {
    /// alpha + beta at the blocker.
    own: f64,
    /// What can be shown begins here.
    nearest: f64,
    /// Sign of alpha and beta of what hides, and the range of their sum with that sign.
    sign: f64,
    hiding: [f64; 2],
}

impl Rule {
    /// For VE events.
    pub(super) const EDGE: Self = Self {
        own: 1.0,
        nearest: 1.0 - CONTACT,
        sign: 1.0,
        hiding: [CONTACT, 1.0 - CONTACT],
    };
    /// For EV events: what is before the vertex has negative alpha and beta.
    pub(super) const VERTEX: Self = Self {
        own: 0.0,
        nearest: NEAREST,
        sign: -1.0,
        hiding: [CONTACT, 1.0 - CONTACT],
    };
}

/// Up to eight faces.
#[derive(Clone, Debug, Default)]
pub(super) struct Batch {
    /// Corner, axis, lane.
    corners: [[Lanes; 3]; 3],
    /// Height of each corner above the event's plane.
    height: [Lanes; 3],
    alpha: [Lanes; 3],
    beta: [Lanes; 3],
    /// A bit for each lane that cannot be met.
    dropped: u8,
}

/// Where the faces of a batch lie in the wedge, along its edge and in inverse distance.
#[derive(Clone, Debug, Default)]
pub(super) struct Found {
    s: [Lanes; 2],
    w: [Lanes; 2],
    is_visible: [bool; LANES],
    hiding: [Lanes; 2],
    is_hiding: [bool; LANES],
}

impl Found {
    /// The part behind the blocker.
    pub(super) fn visible(&self, lane: usize) -> Option<([f64; 2], [f64; 2])> {
        self.is_visible[lane].then(|| (self.s.map(|s| s[lane]), self.w.map(|w| w[lane])))
    }

    /// The part on the light's side of it.
    pub(super) fn hiding(&self, lane: usize) -> Option<[f64; 2]> {
        self.is_hiding[lane].then(|| self.hiding.map(|s| s[lane]))
    }
}

impl Batch {
    /// No faces.
    pub(super) fn clear(&mut self) {
        self.dropped = u8::MAX;
    }

    /// Puts a face into a lane.
    pub(super) fn set(&mut self, lane: usize, corners: [Vec3; 3]) {
        for (to, corner) in self.corners.iter_mut().zip(corners) {
            for (axis, x) in corner.to_array().into_iter().enumerate() {
                to[axis][lane] = f64::from(x);
            }
        }
        self.dropped &= !(1 << lane);
    }

    /// Takes a face out.
    pub(super) fn drop(&mut self, lane: usize) {
        self.dropped |= 1 << lane;
    }

    /// Puts a corner into the event's plane, at a place (alpha, beta).
    pub(super) fn put(&mut self, lane: usize, corner: usize, [alpha, beta]: [f64; 2]) {
        self.height[corner][lane] = 0.0;
        self.alpha[corner][lane] = alpha;
        self.beta[corner][lane] = beta;
    }

    /// A bit for each lane with a corner about as far from the light as the blocker.
    pub(super) fn near(&self, rule: Rule) -> u8 {
        let mut near = [false; LANES];
        for corner in 0..3 {
            for lane in 0..LANES {
                let off = self.alpha[corner][lane] + self.beta[corner][lane] - rule.own;
                near[lane] |= off.abs() < NEAR;
            }
        }
        let bits = (0..LANES).fold(0, |bits, lane| bits | u8::from(near[lane]) << lane);
        bits & !self.dropped
    }

    /// Finds the places of all corners in the event's frame. Faces of a solid that turn away from both of
    /// `seen_from` are dropped.
    pub(super) fn place(&mut self, frame: &Frame, seen_from: Option<[DVec3; 2]>) {
        #[cfg(target_arch = "x86_64")]
        if is_wide() {
            // SAFETY: the processor has the instructions.
            return unsafe { place_wide(self, frame, seen_from) };
        }
        place(self, frame, seen_from);
    }

    /// Cuts all faces.
    pub(super) fn cut(&self, rule: Rule, found: &mut Found) {
        #[cfg(target_arch = "x86_64")]
        if is_wide() {
            // SAFETY: the processor has the instructions.
            return unsafe { cut_wide(self, rule, found) };
        }
        cut(self, rule, found);
    }
}

#[cfg(target_arch = "x86_64")]
#[inline]
fn is_wide() -> bool {
    std::arch::is_x86_feature_detected!("avx512f")
        && std::arch::is_x86_feature_detected!("avx512dq")
        && std::arch::is_x86_feature_detected!("avx512vl")
        && std::arch::is_x86_feature_detected!("avx512bw")
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw")]
fn place_wide(batch: &mut Batch, frame: &Frame, seen_from: Option<[DVec3; 2]>) {
    place(batch, frame, seen_from);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw")]
fn cut_wide(batch: &Batch, rule: Rule, found: &mut Found) {
    cut(batch, rule, found);
}

#[inline(always)]
fn place(batch: &mut Batch, frame: &Frame, seen_from: Option<[DVec3; 2]>) {
    let Batch {
        corners,
        height,
        alpha,
        beta,
        dropped,
    } = batch;
    for corner in 0..3 {
        let [x, y, z] = &corners[corner];
        for lane in 0..LANES {
            let d = [
                x[lane] - frame.origin.x,
                y[lane] - frame.origin.y,
                z[lane] - frame.origin.z,
            ];
            height[corner][lane] = frame.normal.x * d[0] + frame.normal.y * d[1] + frame.normal.z * d[2];
            alpha[corner][lane] = frame.alpha.x * d[0] + frame.alpha.y * d[1] + frame.alpha.z * d[2];
            beta[corner][lane] = frame.beta.x * d[0] + frame.beta.y * d[1] + frame.beta.z * d[2];
        }
    }
    let Some([from, to]) = seen_from else { return };
    let mut away = [false; LANES];
    let [a, b, c] = &*corners;
    for lane in 0..LANES {
        let u = [0, 1, 2].map(|k| b[k][lane] - a[k][lane]);
        let v = [0, 1, 2].map(|k| c[k][lane] - a[k][lane]);
        let normal = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        let side = |p: DVec3| {
            normal[0] * (p.x - a[0][lane]) + normal[1] * (p.y - a[1][lane]) + normal[2] * (p.z - a[2][lane])
        };
        away[lane] = (side(from) <= 0.0) & (side(to) <= 0.0);
    }
    for (lane, away) in away.into_iter().enumerate() {
        *dropped |= u8::from(away) << lane;
    }
}

#[inline(always)]
fn cut(batch: &Batch, rule: Rule, found: &mut Found) {
    let Batch {
        height, alpha, beta, ..
    } = batch;
    // The line in which a face crosses the plane ends on the two sides of the corner that is alone on its side of the
    // plane; a corner in the plane counts as below.
    let mut first = [[0.0; LANES]; 2];
    let mut second = [[0.0; LANES]; 2];
    let mut crosses = [false; LANES];
    for lane in 0..LANES {
        let h = [height[0][lane], height[1][lane], height[2][lane]];
        let above = h.map(|h| h > 0.0);
        let (first_alone, second_alone) = ((above[1] == above[2]), (above[0] == above[2]));
        crosses[lane] = !(first_alone & second_alone);
        let pick = |x: [f64; 3]| {
            let (a, b, c) = (
                if second_alone { x[1] } else { x[2] },
                if second_alone { x[2] } else { x[0] },
                if second_alone { x[0] } else { x[1] },
            );
            [
                if first_alone { x[0] } else { a },
                if first_alone { x[1] } else { b },
                if first_alone { x[2] } else { c },
            ]
        };
        let h = pick(h);
        let a = pick([alpha[0][lane], alpha[1][lane], alpha[2][lane]]);
        let b = pick([beta[0][lane], beta[1][lane], beta[2][lane]]);
        // Weights of one sign: a corner that lies in the plane is met where it is, without rounding.
        let (p, q) = (1.0 / (h[0] - h[1]), 1.0 / (h[0] - h[2]));
        let at = |x: f64, y: f64, hx: f64, hy: f64, inverse: f64| (y * hx - x * hy) * inverse;
        first[0][lane] = at(a[0], a[1], h[0], h[1], p);
        first[1][lane] = at(b[0], b[1], h[0], h[1], p);
        second[0][lane] = at(a[0], a[2], h[0], h[2], q);
        second[1][lane] = at(b[0], b[2], h[0], h[2], q);
    }
    part(
        &first,
        &second,
        1.0,
        [rule.nearest, 1e30],
        &mut found.s,
        &mut found.w,
        &mut found.is_visible,
    );
    let mut unused = [[0.0; LANES]; 2];
    part(
        &first,
        &second,
        rule.sign,
        rule.hiding,
        &mut found.hiding,
        &mut unused,
        &mut found.is_hiding,
    );
    for lane in 0..LANES {
        let met = crosses[lane] & (batch.dropped >> lane & 1 == 0);
        found.is_visible[lane] &= met;
        found.is_hiding[lane] &= met;
    }
}

/// The part of each segment in which alpha and beta with `sign` are not negative and their sum lies between two numbers.
#[inline(always)]
fn part(
    first: &[Lanes; 2],
    second: &[Lanes; 2],
    sign: f64,
    [low, high]: [f64; 2],
    s: &mut [Lanes; 2],
    w: &mut [Lanes; 2],
    is_there: &mut [bool; LANES],
) {
    for lane in 0..LANES {
        let a = [sign * first[0][lane], sign * first[1][lane]];
        let b = [sign * second[0][lane], sign * second[1][lane]];
        let (from, to) = (a[0] + a[1], b[0] + b[1]);
        let (mut start, mut end) = (0.0f64, 1.0f64);
        let mut empty = false;
        let bounds = [
            (a[0], b[0]),
            (a[1], b[1]),
            (from - low, to - low),
            (high - from, high - to),
        ];
        for (x, y) in bounds {
            let t = x / (x - y);
            let (enters, leaves) = (x < 0.0, y < 0.0);
            empty |= enters & leaves;
            start = if enters & (t > start) { t } else { start };
            end = if leaves & (t < end) { t } else { end };
        }
        let at = |t: f64, k: usize| {
            let x = a[k] + (b[k] - a[k]) * t;
            let x = if t >= 1.0 { b[k] } else { x };
            if t <= 0.0 { a[k] } else { x }
        };
        let mut ends = [0.0; 2];
        for (i, t) in [start, end].into_iter().enumerate() {
            let (x, y) = (at(t, 0), at(t, 1));
            let inverse = 1.0 / (x + y);
            let place = y * inverse;
            let place = if place > 0.0 { place } else { 0.0 };
            ends[i] = if place < 1.0 { place } else { 1.0 };
            s[i][lane] = ends[i];
            w[i][lane] = inverse;
        }
        is_there[lane] = !empty & (start < end) & (ends[0] != ends[1]);
    }
}
