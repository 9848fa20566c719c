//! The plane of a fan, and where edges and triangles cut it.
//!
//! With A = a - p, D = b - a and N = A x D, a point x = p + x' of the plane is x' = h A + alpha D: h is 0 at p and 1 on the
//! light, and the ray from p through x meets the light's line at t = alpha / h. Both are solved for in the two axes u, v
//! beside the largest component of N (Cramer's rule: the determinant is that component), so that they are linear
//! functions of two coordinates, computed once a vertex and weighted along edges. The relative error of N is a few
//! roundings over the sine of the angle between A and D, and the error of t a few roundings times
//! |A| / (|D| sin(A, D)), times the reciprocal sine of the angle at which the edge crosses the plane.

use glam::{DVec3, Vec3};
use robust::{Coord3D, orient3d};

use crate::unchecked::Axis;

/// Unit roundoff of `f64`.
const U: f64 = f64::EPSILON / 2.0;

pub(super) fn coord(p: DVec3) -> Coord3D<f64> {
    Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    }
}

/// The plane through p and the light, with coordinates in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct FanPlane {
    pub(super) p: DVec3,
    pub(super) a: DVec3,
    pub(super) b: DVec3,
    /// u, v and the axis of the normal's largest component, in cyclic order.
    pub(super) axes: [Axis; 3],
    /// p in these axes.
    pub(super) from: [f64; 3],
    /// A x D in these axes, not normalised.
    pub(super) normal: [f64; 3],
    /// Bounds the rounding error of `normal . x'` as a product with `|x'|`.
    pub(super) permanent: [f64; 3],
    /// A crossing whose h is closer than this to 0 or 1 may be at p or on the light, as far as rounding tells.
    pub(super) margin: f64,
    /// Coefficients of alpha and h for u and v.
    pub(super) alpha: [f64; 2],
    pub(super) height: [f64; 2],
}

impl FanPlane {
    /// The plane of the fan, or `None` if p and the light are so nearly on one line that it is not determined.
    #[inline]
    pub(super) fn new(p: DVec3, a: DVec3, b: DVec3) -> Option<Self> {
        let (to_a, along) = (a - p, b - a);
        let normal = to_a.cross(along);
        let square = normal.length_squared();
        let determined = square > 1e-24 * (to_a.length_squared() * along.length_squared());
        let size = normal.abs();
        let axes = if size.x > size.y && size.x > size.z {
            [1, 2, 0]
        } else if size.y > size.z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        }
        .map(Axis::new);
        let turn = |v: DVec3| {
            let v = v.to_array();
            axes.map(|axis| *axis.of(&v))
        };
        let (m, d, normal) = (turn(to_a), turn(along), turn(normal));
        let inverse = 1.0 / normal[2];
        let alpha = [-m[1] * inverse, m[0] * inverse];
        let height = [d[1] * inverse, -d[0] * inverse];
        // The differences, products and sums that make the normal and its product with a vector are rounded less than eight
        // times in a row.
        let (m, d) = (m.map(f64::abs), d.map(f64::abs));
        let product = |i: usize, j: usize| (m[i] * d[j] + m[j] * d[i]) * (16.0 * U);
        let steepest = height[0].abs().max(height[1].abs());
        // Many times the rounding of h, which is a few units in the last place of the distance times the gradient.
        let margin = 2e-10 * steepest * ((m[0] + m[1] + m[2]) + (d[0] + d[1] + d[2]));
        // A sum of the coefficients is finite only if all are; those of alpha could cancel.
        let finite = margin.is_finite() && alpha[0].is_finite() && alpha[1].is_finite();
        (determined && finite).then_some(Self {
            p,
            a,
            b,
            axes,
            from: turn(p),
            normal,
            permanent: [product(1, 2), product(2, 0), product(0, 1)],
            margin,
            alpha,
            height,
        })
    }

    /// A number with the sign of the exact side of the plane on which `v` lies, in the sense of `normal . x'`.
    #[cold]
    #[inline(never)]
    pub(super) fn exact_side(&self, v: DVec3) -> f64 {
        -orient3d(coord(self.p), coord(self.a), coord(self.b), coord(v))
    }
}

/// Where an edge cuts the plane: the light parameter seen in that direction, and whether it lies before p.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// alpha / h; infinite where the direction is parallel to the light.
    pub(super) t: f64,
    pub(super) ahead: bool,
}

impl Crossing {
    /// The direction of a point of the plane.
    pub(super) fn at(alpha: f64, height: f64) -> Self {
        Self {
            // Adding zero turns a negative zero into a positive one.
            t: alpha / (height + 0.0),
            ahead: height >= 0.0,
        }
    }
}

/// What a triangle that is cut by the plane does to the light; an empty interval is reversed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shadow {
    /// Closed intervals of light parameters that it blocks.
    pub(super) blocks: [[f64; 2]; 2],
    /// It is seen edge-on, as exactly as numbers tell: it may not block, but no light passes between its neighbours
    /// because of rounding in this narrow interval.
    pub(super) bridge: [f64; 2],
}

/// No parameter.
const EMPTY: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

impl Shadow {
    const NOTHING: Self = Self {
        blocks: [EMPTY; 2],
        bridge: EMPTY,
    };
}

/// A wider interval is not the rounding of a triangle seen edge-on.
pub(super) const WIDEST_BRIDGE: f64 = 1e-9;
/// A narrower interval where a cut ends on the light is the rounding of a touch.
const TOUCH: f64 = 1e-14;

/// The parameters in [0, 1] that a triangle blocks, given the two crossings of its edges with the plane, where its cut comes
/// close to p or the light or is seen edge-on.
///
/// The plane of the triangle must separate p from the point of the light, strictly; this is decided by exact signs,
/// as in the ray test. The ray must pass between the crossings.
#[inline(never)]
pub(super) fn shadow_in_doubt(fan: &FanPlane, triangle: [Vec3; 3], c0: Crossing, c1: Crossing) -> Shadow {
    // A crossing in p itself has no direction; p then lies in the triangle, which does not block it.
    if !(c0.ahead || c1.ahead) || c0.t.is_nan() || c1.t.is_nan() {
        return Shadow::NOTHING;
    }
    let [v0, v1, v2] = triangle.map(|v| v.as_dvec3());
    let (e1, e2) = (v1 - v0, v2 - v0);
    let normal = e1.cross(e2);
    let (m, n) = (e1.abs(), e2.abs());
    let permanent = DVec3::new(
        m.y * n.z + m.z * n.y,
        m.z * n.x + m.x * n.z,
        m.x * n.y + m.y * n.x,
    ) * (16.0 * U);
    let side = |q: DVec3| {
        let x = q - v0;
        let side = normal.dot(x);
        if side.abs() <= permanent.dot(x.abs()) {
            (exact_side(triangle, q), true)
        } else {
            (side, false)
        }
    };
    let (at_p, doubtful) = side(fan.p);
    let (at_a, _) = side(fan.a);
    let (at_b, _) = side(fan.b);
    let opposite = |x: f64| (x < 0.0 && at_p > 0.0) || (x > 0.0 && at_p < 0.0);
    // Parameters whose points are separated from p.
    let behind = match (opposite(at_a), opposite(at_b)) {
        (true, true) => [0.0, 1.0],
        (true, false) => [0.0, at_a / (at_a - at_b)],
        (false, true) => [at_a / (at_a - at_b), 1.0],
        (false, false) => EMPTY,
    };
    let (lo, hi) = if c0.t < c1.t { (c0.t, c1.t) } else { (c1.t, c0.t) };
    if !(c0.ahead && c1.ahead) {
        // The cut passes beside p: it fills the directions beyond both ends, of which one side is behind the plane.
        let blocks = [[behind[0], lo.min(behind[1])], [hi.max(behind[0]), behind[1]]];
        return Shadow {
            blocks: if behind == EMPTY { [EMPTY; 2] } else { blocks },
            bridge: EMPTY,
        };
    }
    let part = [lo.max(behind[0]), hi.min(behind[1])];
    // Seen edge-on, the plane meets the light where the cut is seen, and rounding decides what is left of it.
    let whole = part == [lo, hi];
    let edge_on = !whole && hi - lo <= WIDEST_BRIDGE && (doubtful || behind != EMPTY);
    let touches = !whole && part[1] - part[0] <= TOUCH;
    Shadow {
        blocks: [if touches { EMPTY } else { part }, EMPTY],
        bridge: match (edge_on, touches) {
            (true, _) => [lo, hi],
            (false, true) => part,
            (false, false) => EMPTY,
        },
    }
}

/// Positive, negative or zero as exact arithmetic has it, in the sense of (v1 - v0) x (v2 - v0) . (q - v0).
#[cold]
#[inline(never)]
fn exact_side(triangle: [Vec3; 3], q: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|v| coord(v.as_dvec3()));
    -orient3d(a, b, c, coord(q))
}
