//! The plane of a fan, and where edges and triangles cut it.
//!
//! With A = a - p, D = b - a and N = A x D, a point x = p + x' of the plane has the coordinates
//! h = x' . (D x N) / |N|^2, which is 0 at p and 1 on the light, and alpha = x' . (N x A) / |N|^2, so that the ray from p
//! through x meets the light's line at t = alpha / h. Both are linear in x, so that they are computed a vertex and
//! weighted along edges. The relative error of N is a few roundings over the sine of the angle between A and D, and the
//! error of t a few roundings times |A| / (|D| sin(A, D)), times the reciprocal sine of the angle at which the edge
//! crosses the plane.

use glam::{DVec3, Vec3};
use robust::{Coord3D, orient3d};

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
    /// A x D, not normalised.
    pub(super) normal: DVec3,
    /// Bounds the rounding error of `normal . x'` as a product with `|x'|`.
    permanent: DVec3,
    /// A crossing whose h is closer than this to 0 or 1 may be at p or on the light, as far as rounding tells.
    margin: f64,
    /// Gradients of alpha and h.
    pub(super) alpha: DVec3,
    pub(super) height: DVec3,
}

/// A vertex as the fan sees it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FanVertex {
    /// Proportional to the distance from the plane. The sign is that of exact arithmetic; 0 counts as positive.
    pub(super) side: f64,
    pub(super) alpha: f64,
    pub(super) height: f64,
}

impl FanPlane {
    /// The plane of the fan, or `None` if p and the light are so nearly on one line that it is not determined.
    pub(super) fn new(p: DVec3, a: DVec3, b: DVec3) -> Option<Self> {
        let (to_a, along) = (a - p, b - a);
        let normal = to_a.cross(along);
        let square = normal.length_squared();
        let (alpha, height) = (normal.cross(to_a) / square, along.cross(normal) / square);
        let (m, d) = (to_a.abs(), along.abs());
        let permanent = DVec3::new(
            m.y * d.z + m.z * d.y,
            m.z * d.x + m.x * d.z,
            m.x * d.y + m.y * d.x,
        );
        // The differences, products and sums that make the normal and its product with a vector are rounded less than eight
        // times in a row.
        let permanent = permanent * (16.0 * U);
        let determined = square > (1e-12 * to_a.length() * along.length()).powi(2);
        (determined && alpha.is_finite() && height.is_finite()).then_some(Self {
            p,
            a,
            b,
            normal,
            permanent,
            // Many times the rounding of h, which is a few units in the last place of the distance times the gradient.
            margin: 1e-10 * height.length() * (to_a.length() + along.length()),
            alpha,
            height,
        })
    }

    /// The vertex as the fan sees it: one expression for all triangles that meet there.
    #[inline(always)]
    pub(super) fn vertex(&self, v: DVec3) -> FanVertex {
        let x = v - self.p;
        let mut side = self.normal.dot(x);
        if side.abs() <= self.permanent.dot(x.abs()) {
            side = self.exact_side(v);
        }
        FanVertex {
            side,
            alpha: self.alpha.dot(x),
            height: self.height.dot(x),
        }
    }

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
    /// Whether it lies before the light and away from p, beyond doubt.
    pub(super) between: bool,
}

impl FanVertex {
    /// The direction of a vertex in the plane.
    pub(super) fn direction(&self) -> Crossing {
        Crossing {
            t: self.alpha / (self.height + 0.0),
            ahead: self.height >= 0.0,
            between: false,
        }
    }
}

/// The crossing of the edge between a vertex below the plane and one not below it.
///
/// The order of the vertices follows from their sides, so that both faces of an edge get the same bits.
#[inline(always)]
pub(super) fn crossing(fan: &FanPlane, below: &FanVertex, above: &FanVertex) -> Crossing {
    let alpha = above.side * below.alpha - below.side * above.alpha;
    // Adding zero turns a negative zero into a positive one.
    let height = above.side * below.height - below.side * above.height + 0.0;
    let weight = above.side - below.side;
    let slack = weight * fan.margin;
    Crossing {
        t: alpha / height,
        ahead: height >= 0.0,
        between: slack < height && height < weight - slack,
    }
}

/// What a triangle that is cut by the plane does to the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shadow {
    /// Blocks up to two closed intervals of light parameters; an empty one is reversed.
    Blocks([[f64; 2]; 2]),
    /// Is seen edge-on, as exactly as numbers tell: it does not block, but no light passes between its neighbours
    /// because of rounding in this narrow interval.
    Bridges([f64; 2]),
    Nothing,
}

/// No parameter.
const EMPTY: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// A wider interval is not the rounding of a triangle seen edge-on.
const WIDEST_BRIDGE: f64 = 1e-9;

/// The parameters in [0, 1] that a triangle blocks, given the two crossings of its edges with the plane.
///
/// The plane of the triangle must separate p from the point of the light, strictly; this is decided by exact signs,
/// as in the ray test. The ray must pass between the crossings.
#[inline(always)]
pub(super) fn shadow(fan: &FanPlane, triangle: [Vec3; 3], c0: Crossing, c1: Crossing) -> Shadow {
    // A crossing in p itself has no direction; p then lies in the triangle, which does not block it.
    if !(c0.ahead || c1.ahead) || c0.t.is_nan() || c1.t.is_nan() {
        return Shadow::Nothing;
    }
    let (lo, hi) = if c0.t < c1.t { (c0.t, c1.t) } else { (c1.t, c0.t) };
    if c0.between && c1.between && hi - lo > WIDEST_BRIDGE {
        // The whole cut lies between p and the light, and is not seen edge-on.
        return Shadow::Blocks([[lo, hi], EMPTY]);
    }
    shadow_in_doubt(fan, triangle, c0, c1)
}

/// The same where the cut comes close to p or the light, or is seen edge-on.
#[inline(never)]
fn shadow_in_doubt(fan: &FanPlane, triangle: [Vec3; 3], c0: Crossing, c1: Crossing) -> Shadow {
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
    if behind == EMPTY {
        let bridge = doubtful && c0.ahead && c1.ahead && hi - lo <= WIDEST_BRIDGE;
        return if bridge {
            Shadow::Bridges([lo, hi])
        } else {
            Shadow::Nothing
        };
    }
    if c0.ahead && c1.ahead {
        Shadow::Blocks([[lo.max(behind[0]), hi.min(behind[1])], EMPTY])
    } else {
        // The cut passes beside p: it fills the directions beyond both ends, of which one side is behind the plane.
        Shadow::Blocks([[behind[0], lo.min(behind[1])], [hi.max(behind[0]), behind[1]]])
    }
}

/// Positive, negative or zero as exact arithmetic has it, in the sense of (v1 - v0) x (v2 - v0) . (q - v0).
#[cold]
#[inline(never)]
fn exact_side(triangle: [Vec3; 3], q: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|v| coord(v.as_dvec3()));
    -orient3d(a, b, c, coord(q))
}
