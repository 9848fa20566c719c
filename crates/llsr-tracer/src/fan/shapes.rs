//! Fans against analytic primitives.
//!
//! Light parameters are affine invariant, so everything is done in the canonical frame. There the visibility of a shape
//! can change only where a ray of the fan is tangent to the mantle, passes through a rim, or ends on the surface; each is a
//! quadratic in t. Between two neighbouring parameters of this kind one ray decides.

use glam::DVec3;

use super::gaps::Gaps;
use crate::shape::{Kind, PlacedShape};

/// Parameters in (0, 1) at which the shadow of a shape may begin or end, sorted, with 0 and 1 around them.
struct Events {
    ts: [f64; 16],
    len: usize,
}

impl Events {
    fn push(&mut self, t: f64) {
        if t > 0.0 && t < 1.0 && self.len < self.ts.len() - 1 {
            self.ts[self.len] = t;
            self.len += 1;
        }
    }

    /// Roots of q t^2 + 2 l t + c, given l^2 - q c: where p is on the surface the difference would cancel.
    fn roots(&mut self, [q, l, c]: [f64; 3], discriminant: f64) {
        if discriminant >= 0.0 {
            let sum = -(l + discriminant.sqrt().copysign(l));
            // Infinite and NaN roots are left out by `push`.
            self.push(sum / q);
            self.push(c / sum);
        }
    }

    /// Where the light a + t d meets the surface on which x^2 + y^2 + `sign` z^2 = `constant`.
    fn light_meets(&mut self, a: DVec3, d: DVec3, sign: f64, constant: f64) {
        let form = |u: DVec3, v: DVec3| u.x * v.x + u.y * v.y + sign * u.z * v.z;
        let [q, l, c] = [form(d, d), form(a, d), form(a, a) - constant];
        self.roots([q, l, c], l * l - q * c);
    }

    /// Rays through the unit circle at height `z`, and the point of the light at that height.
    fn rim(&mut self, o: DVec3, a: DVec3, d: DVec3, z: f64) {
        let up = z - o.z;
        let (o, a2, d2) = (o.truncate(), a.truncate(), d.truncate());
        // Where the ray passes the circle's plane, times the ray's climb, which is its length there.
        let (e0, e1) = (o * a.z + a2 * up, o * d.z + d2 * up);
        let wedge = a.z * o.perp_dot(d2) - d.z * o.perp_dot(a2) + up * a2.perp_dot(d2);
        let across = (a2 * d.z - d2 * a.z).length_squared();
        self.roots(
            [
                e1.length_squared() - d.z * d.z,
                e0.dot(e1) - a.z * d.z,
                e0.length_squared() - a.z * a.z,
            ],
            up * up * (across - wedge * wedge),
        );
        self.push((up - a.z) / d.z);
    }
}

/// The coefficients of form(o, a + t d)^2 - power * form(a + t d, a + t d).
fn tangents(form: impl Fn(DVec3, DVec3) -> f64, o: DVec3, a: DVec3, d: DVec3, power: f64) -> [f64; 3] {
    let (oa, od) = (form(o, a), form(o, d));
    [
        od * od - power * form(d, d),
        oa * od - power * form(a, d),
        oa * oa - power * form(a, a),
    ]
}

/// Blocks what the shape hides of the light `a`-`b` from `p`, and says whether that changed anything.
pub(super) fn block_shape(shape: &PlacedShape, p: DVec3, a: DVec3, b: DVec3, gaps: &mut Gaps) -> bool {
    let (kind, o, a, b) = (
        shape.kind(),
        shape.localize(p),
        shape.localize(a),
        shape.localize(b),
    );
    let (d, a) = (b - a, a - o);
    let mut events = Events {
        ts: [0.0; 16],
        len: 1,
    };
    // A ray from o is tangent where form(o, ray)^2 = power form(ray, ray), with the power of o about the surface. The
    // discriminants have the power as a factor: p on the surface has one tangent, not two that rounding tears apart.
    match kind {
        Kind::Sphere => {
            let power = (o.length() - 1.0) * (o.length() + 1.0);
            let normal = a.cross(d);
            let quadratic = tangents(DVec3::dot, o, a, d, power);
            let height = o.dot(normal);
            events.roots(quadratic, power * (normal.length_squared() - height * height));
            events.light_meets(o + a, d, 1.0, 1.0);
        }
        Kind::Cylinder { .. } => {
            let flat = |u: DVec3, v: DVec3| u.truncate().dot(v.truncate());
            let r = o.truncate().length();
            let power = (r - 1.0) * (r + 1.0);
            let area = a.truncate().perp_dot(d.truncate());
            events.roots(tangents(flat, o, a, d, power), power * area * area);
            events.light_meets(o + a, d, 0.0, 1.0);
            events.rim(o, a, d, 0.0);
            events.rim(o, a, d, 1.0);
        }
        Kind::Cone { .. } => {
            // Relative to the tip.
            let form = |u: DVec3, v: DVec3| u.x * v.x + u.y * v.y - u.z * v.z;
            let tip = o - DVec3::Z;
            let r = tip.truncate().length();
            let power = (r - tip.z) * (r + tip.z);
            let volume = tip.dot(a.cross(d));
            events.roots(tangents(form, tip, a, d, power), power * volume * volume);
            events.light_meets(tip + a, d, -1.0, 0.0);
            events.rim(o, a, d, 0.0);
        }
        Kind::Disc => events.rim(o, a, d, 0.0),
    }
    let len = events.len;
    events.ts[1..len].sort_unstable_by(f64::total_cmp);
    events.ts[len] = 1.0;
    let mut changed = false;
    for pair in events.ts[..=len].windows(2) {
        let &[lo, hi] = pair else { continue };
        if lo < hi && shape.cuts_canonical(o, a + d * (0.5 * (lo + hi))) {
            changed |= gaps.block(lo, hi);
        }
    }
    changed
}
