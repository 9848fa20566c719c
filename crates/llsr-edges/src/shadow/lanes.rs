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

use glam::DVec3;

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
/// Nor farther than this from the event's plane, in units of the receiver's size: corners are single-precision numbers
/// of at most 1.
const FLAT: f64 = 2e-6;

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

/// The corners of eight faces: corner, axis, lane.
pub(super) type Corners<'a> = [[&'a [f32; LANES]; 3]; 3];

/// Up to eight faces.
#[derive(Clone, Debug, Default)]
pub(super) struct Batch {
    /// Height of each corner above the event's plane.
    height: [Lanes; 3],
    alpha: [Lanes; 3],
    beta: [Lanes; 3],
    /// Not positive for faces that cannot be met.
    facing: Lanes,
    /// A corner may be the blocker's own.
    is_near: [bool; LANES],
}

/// Where the faces of a batch lie in the wedge, along its edge from the smaller place on, and in inverse distance.
#[derive(Clone, Debug, Default)]
pub(super) struct Found {
    s: [Lanes; 2],
    w: Lanes,
    slope: Lanes,
    is_visible: [bool; LANES],
    hiding: [Lanes; 2],
    is_hiding: [bool; LANES],
}

impl Found {
    /// A bit for each lane with a part behind the blocker, and for each with one on the light's side of it.
    pub(super) fn lanes(&self) -> [u8; 2] {
        [self.is_visible, self.is_hiding].map(|lanes| {
            // Eight bytes, each 0 or 1, moved to the eight highest bits.
            let bytes = u64::from_le_bytes(lanes.map(u8::from));
            (bytes.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
        })
    }

    /// The part of a face behind the blocker: its ends, inverse distance at the first, and the change of that along the edge.
    pub(super) fn visible(&self, lane: usize) -> ([f64; 2], f64, f64) {
        (self.s.map(|s| s[lane]), self.w[lane], self.slope[lane])
    }

    /// The part on the light's side of it.
    pub(super) fn hiding(&self, lane: usize) -> [f64; 2] {
        self.hiding.map(|s| s[lane])
    }
}

impl Batch {
    /// Takes a face out.
    pub(super) fn drop(&mut self, lane: usize) {
        self.facing[lane] = -1.0;
    }

    /// Puts a corner into the event's plane, at a place (alpha, beta).
    pub(super) fn put(&mut self, lane: usize, corner: usize, [alpha, beta]: [f64; 2]) {
        self.height[corner][lane] = 0.0;
        self.alpha[corner][lane] = alpha;
        self.beta[corner][lane] = beta;
    }

    /// True if a corner is in the event's plane about as far from the light as the blocker, so that it may be the
    /// blocker's own.
    pub(super) fn is_near(&self, lane: usize) -> bool {
        self.is_near[lane] && self.facing[lane] > 0.0
    }

    /// Finds the places of all corners in the event's frame. Faces of a solid that turn away from both of
    /// `seen_from` are dropped.
    pub(super) fn place(
        &mut self,
        corners: Corners<'_>,
        frame: &Frame,
        rule: Rule,
        seen_from: Option<[DVec3; 2]>,
    ) {
        #[cfg(target_arch = "x86_64")]
        if is_wide() {
            // SAFETY: the processor has the instructions.
            return unsafe { place_wide(self, corners, frame, rule, seen_from) };
        }
        place(self, corners, frame, rule, seen_from);
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
fn place_wide(
    batch: &mut Batch,
    corners: Corners<'_>,
    frame: &Frame,
    rule: Rule,
    seen_from: Option<[DVec3; 2]>,
) {
    place(batch, corners, frame, rule, seen_from);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw")]
fn cut_wide(batch: &Batch, rule: Rule, found: &mut Found) {
    cut(batch, rule, found);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw")]
fn points_wide(frame: [DVec3; 3], sign: f64, s: &Lanes, w: &Lanes, points: &mut [Lanes; 3]) {
    points_at(frame, sign, s, w, points);
}

/// The points of an event at eight places `s` along its edge and inverse distances `w`, by axis, in the frame of its points: first +
/// sign (second + (third - second) s - first) / w.
pub(super) fn points(frame: [DVec3; 3], sign: f64, s: &Lanes, w: &Lanes, points: &mut [Lanes; 3]) {
    #[cfg(target_arch = "x86_64")]
    if is_wide() {
        // SAFETY: the processor has the instructions.
        return unsafe { points_wide(frame, sign, s, w, points) };
    }
    points_at(frame, sign, s, w, points);
}

#[inline(always)]
fn points_at(frame: [DVec3; 3], sign: f64, s: &Lanes, w: &Lanes, points: &mut [Lanes; 3]) {
    let [first, second, third] = frame.map(|p| p.to_array());
    for axis in 0..3 {
        let (from, length) = (second[axis], third[axis] - second[axis]);
        for lane in 0..LANES {
            let along = from + length * s[lane];
            points[axis][lane] = first[axis] + sign * (along - first[axis]) / w[lane];
        }
    }
}

#[inline(always)]
fn place(batch: &mut Batch, corners: Corners<'_>, frame: &Frame, rule: Rule, seen_from: Option<[DVec3; 2]>) {
    let Batch {
        height,
        alpha,
        beta,
        facing,
        is_near,
    } = batch;
    let mut wide = [[[0.0; LANES]; 3]; 3];
    for corner in 0..3 {
        for axis in 0..3 {
            for lane in 0..LANES {
                wide[corner][axis][lane] = f64::from(corners[corner][axis][lane]);
            }
        }
    }
    let corners = &wide;
    let flat = FLAT * frame.normal.length();
    *is_near = [false; LANES];
    for corner in 0..3 {
        let [x, y, z] = &corners[corner];
        let (height, alpha, beta) = (&mut height[corner], &mut alpha[corner], &mut beta[corner]);
        for lane in 0..LANES {
            let d = [
                x[lane] - frame.origin.x,
                y[lane] - frame.origin.y,
                z[lane] - frame.origin.z,
            ];
            let h = frame.normal.x * d[0] + frame.normal.y * d[1] + frame.normal.z * d[2];
            let a = frame.alpha.x * d[0] + frame.alpha.y * d[1] + frame.alpha.z * d[2];
            let b = frame.beta.x * d[0] + frame.beta.y * d[1] + frame.beta.z * d[2];
            (height[lane], alpha[lane], beta[lane]) = (h, a, b);
            is_near[lane] |= ((a + b - rule.own).abs() < NEAR) & (h.abs() < flat);
        }
    }
    let Some([from, to]) = seen_from else {
        *facing = [1.0; LANES];
        return;
    };
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = corners;
    for lane in 0..LANES {
        let (ux, uy, uz) = (bx[lane] - ax[lane], by[lane] - ay[lane], bz[lane] - az[lane]);
        let (vx, vy, vz) = (cx[lane] - ax[lane], cy[lane] - ay[lane], cz[lane] - az[lane]);
        let (nx, ny, nz) = (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
        let own = nx * ax[lane] + ny * ay[lane] + nz * az[lane];
        let first = nx * from.x + ny * from.y + nz * from.z;
        let second = nx * to.x + ny * to.y + nz * to.z;
        let most = if first > second { first } else { second };
        facing[lane] = most - own;
    }
}

#[inline(always)]
fn cut(batch: &Batch, rule: Rule, found: &mut Found) {
    let Batch {
        height,
        alpha,
        beta,
        facing,
        ..
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
    let (mut s, mut w) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
    part(
        &first,
        &second,
        1.0,
        [rule.nearest, 1e30],
        &mut s,
        &mut w,
        &mut found.is_visible,
    );
    let mut any = false;
    for lane in 0..LANES {
        crosses[lane] &= facing[lane] > 0.0;
        found.is_visible[lane] &= crosses[lane];
        let (from, to) = (
            rule.sign * first[0][lane] + rule.sign * first[1][lane],
            rule.sign * second[0][lane] + rule.sign * second[1][lane],
        );
        let [low, high] = rule.hiding;
        let beyond = (from < low) & (to < low) | (from > high) & (to > high);
        any |= crosses[lane] & !beyond;
    }
    // In arrays of their own: lanes that are written one beside the other in memory are joined in other ways.
    let (mut start, mut end) = ([0.0; LANES], [0.0; LANES]);
    let (mut here, mut there) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        let turned = s[0][lane] > s[1][lane];
        start[lane] = if turned { s[1][lane] } else { s[0][lane] };
        end[lane] = if turned { s[0][lane] } else { s[1][lane] };
        here[lane] = if turned { w[1][lane] } else { w[0][lane] };
        there[lane] = if turned { w[0][lane] } else { w[1][lane] };
    }
    let mut slope = [0.0; LANES];
    for lane in 0..LANES {
        slope[lane] = (there[lane] - here[lane]) / (end[lane] - start[lane]);
    }
    found.s = [start, end];
    found.w = here;
    found.slope = slope;
    // Most faces lie behind the blocker.
    if !any {
        found.is_hiding = [false; LANES];
        return;
    }
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
    for (hides, crosses) in found.is_hiding.iter_mut().zip(crosses) {
        *hides &= crosses;
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

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;

    fn columns(faces: &[[Vec3; 3]]) -> [[[f32; LANES]; 3]; 3] {
        let mut columns = [[[0.0; LANES]; 3]; 3];
        for (lane, face) in faces.iter().enumerate() {
            for (corner, p) in face.iter().enumerate() {
                for axis in 0..3 {
                    columns[corner][axis][lane] = p[axis];
                }
            }
        }
        columns
    }

    fn borrowed(columns: &[[[f32; LANES]; 3]; 3]) -> Corners<'_> {
        columns.each_ref().map(|axes| axes.each_ref())
    }

    fn vector(x: [i16; 3]) -> Vec3 {
        Vec3::from_array(x.map(|x| f32::from(x) / 1024.0))
    }

    /// Checks a range of places along the event's edge, or that there is none, against points of the line in which a
    /// face crosses the plane.
    fn check(
        corners: [Vec3; 3],
        frame: &Frame,
        sum: [f64; 2],
        sign: f64,
        here: Option<[f64; 2]>,
    ) -> Result<(), TestCaseError> {
        let c = corners.map(|p| p.as_dvec3());
        let height = c.map(|p| frame.normal.dot(p - frame.origin));
        let ends: Vec<DVec3> = (0..3)
            .filter_map(|i| {
                let j = (i + 1) % 3;
                let crosses = (height[i] > 0.0) != (height[j] > 0.0);
                crosses.then(|| c[i] + (c[j] - c[i]) * (height[i] / (height[i] - height[j])))
            })
            .collect();
        let &[p, q] = ends.as_slice() else {
            prop_assert!(here.is_none(), "the face does not cross the plane");
            return Ok(());
        };
        let place = |t: f64| {
            let d = p + (q - p) * t - frame.origin;
            [sign * frame.alpha.dot(d), sign * frame.beta.dot(d)]
        };
        // How far a place is inside of the part looked for.
        let depth = |[a, b]: [f64; 2]| a.min(b).min(a + b - sum[0]).min(sum[1] - a - b);
        let [low, high] = here.map_or([2.0, -1.0], |[a, b]| [a.min(b), a.max(b)]);
        for i in 0..=500 {
            let at = place(f64::from(i) / 500.0);
            let s = at[1] / (at[0] + at[1]);
            if depth(at) > 1e-9 && here.is_some() {
                prop_assert!(low - 1e-9 <= s && s <= high + 1e-9, "{s} in {low} to {high}");
            } else if depth(at) > 1e-9 {
                // What is seen along itself has no width.
                let [f, g] = [place(0.0), place(1.0)];
                prop_assert!((f[0] * g[1] - f[1] * g[0]).abs() < 1e-9, "nothing at {s}");
            }
        }
        for s in here.into_iter().flatten() {
            let across = |[a, b]: [f64; 2]| (1.0 - s) * b - s * a;
            let (f, g) = (across(place(0.0)), across(place(1.0)));
            if (f - g).abs() > 1e-9 {
                let t = f / (f - g);
                prop_assert!((-1e-6..=1.0 + 1e-6).contains(&t), "{s} is beyond an end");
                prop_assert!(depth(place(t)) > -1e-6, "{s} is outside");
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn faces_are_cut_where_points_of_their_lines_say(
            faces in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(-1024i16..1024)), LANES),
            ends in prop::array::uniform2(prop::array::uniform3(-512i16..512)),
            is_edge in any::<bool>(),
        ) {
            let origin = DVec3::new(0.013, 0.007, if is_edge { 3.0 } else { 0.1 });
            let to = ends.map(|e| vector(e).as_dvec3() + DVec3::Z * if is_edge { 0.4 } else { 2.0 });
            let [d0, d1] = if is_edge { to.map(|p| p - origin) } else { to.map(|p| origin - p) };
            prop_assume!(d0.cross(d1).length() > 1e-2);
            let frame = Frame::new(origin, d0, d1);
            let rule = if is_edge { Rule::EDGE } else { Rule::VERTEX };
            let (mut batch, mut found) = (Batch::default(), Found::default());
            let corners: Vec<[Vec3; 3]> = faces.iter().map(|f| f.map(vector)).collect();
            let columns = columns(&corners);
            batch.place(borrowed(&columns), &frame, rule, None);
            batch.cut(rule, &mut found);
            let is_in = |lanes: u8, lane: usize| lanes >> lane & 1 == 1;
            let [visible, hiding] = found.lanes();
            for (lane, &face) in corners.iter().enumerate() {
                let range = is_in(visible, lane).then(|| found.visible(lane).0);
                check(face, &frame, [rule.nearest, 1e30], 1.0, range)?;
                let range = is_in(hiding, lane).then(|| found.hiding(lane));
                check(face, &frame, rule.hiding, rule.sign, range)?;
                if is_in(visible, lane) {
                    let (s, w, slope) = found.visible(lane);
                    prop_assert!(s[0] < s[1], "from the smaller place on");
                    for i in 0..2 {
                        let w = w + slope * (s[i] - s[0]);
                        let at = origin + (d0 * (1.0 - s[i]) + d1 * s[i]) / w;
                        let [a, b, c] = face.map(|p| p.as_dvec3());
                        let normal = (b - a).cross(c - a);
                        let off = normal.dot(at - a).abs();
                        prop_assert!(off < 1e-6 * (1.0 + w.recip()), "{at} lies in the face's plane: {off}");
                    }
                }
            }
            // The copy for any processor gives the same bits.
            let (mut plain, mut plain_found) = (batch.clone(), Found::default());
            place(&mut plain, borrowed(&columns), &frame, rule, None);
            cut(&plain, rule, &mut plain_found);
            prop_assert_eq!(found.lanes(), plain_found.lanes());
            for lane in 0..LANES {
                if is_in(visible, lane) {
                    prop_assert_eq!(found.visible(lane), plain_found.visible(lane));
                }
                if is_in(hiding, lane) {
                    prop_assert_eq!(found.hiding(lane), plain_found.hiding(lane));
                }
            }
        }
    }

    #[test]
    fn faces_that_turn_away_and_own_corners_are_told() {
        let frame = Frame::new(
            DVec3::Z * 3.0,
            DVec3::new(-0.1, 0.0, -1.0),
            DVec3::new(0.1, 0.0, -1.0),
        );
        let [a, b, c] = [
            Vec3::new(-0.5, -0.5, 0.0),
            Vec3::new(0.5, -0.5, 0.0),
            Vec3::new(0.0, 0.5, 0.0),
        ];
        let own = (DVec3::Z * 3.0 + DVec3::new(0.1, 0.0, -1.0)).as_vec3();
        let (mut batch, mut found) = (Batch::default(), Found::default());
        let columns = columns(&[[a, b, c], [b, a, c], [own, c, b], [a, b, c]]);
        batch.place(borrowed(&columns), &frame, Rule::EDGE, Some([DVec3::Z * 3.0; 2]));
        assert!(batch.is_near(2) && !batch.is_near(0), "a corner of the edge");
        batch.drop(3);
        batch.cut(Rule::EDGE, &mut found);
        let [visible, _] = found.lanes();
        let met = [0, 1, 3].map(|lane| visible >> lane & 1 == 1);
        assert_eq!(met, [true, false, false], "front, back, taken out");
    }
}
