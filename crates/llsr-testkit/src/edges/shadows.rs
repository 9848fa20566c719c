//! What is seen of a light, and where along a segment that changes: by brute force over all triangles.

use glam::{DVec3, Vec3};

/// How much of a light a point sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LightClass {
    /// Nothing.
    Umbra,
    /// Some of it.
    Penumbra,
    /// All of it.
    Lit,
}

/// A place where the class changes.
#[derive(Clone, Copy, Debug)]
pub struct ClassChange {
    /// Where (m).
    pub at: DVec3,
    /// The classes before and behind it.
    pub between: [LightClass; 2],
}

/// Parts of the light narrower than this (in units of its length) do not count.
const NARROW: f64 = 1e-9;
/// Triangles nearer to the point than this part of its distance from the light do not count: it lies on them.
const TOUCHING: f64 = 1e-7;
/// Bisection stops at this part of the segment.
const FINE: f64 = 1e-10;

/// Triangles that block light.
#[derive(Clone, Debug, Default)]
pub struct ShadowOracle {
    triangles: Vec<[DVec3; 3]>,
}

impl ShadowOracle {
    /// Of triangles in one frame.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        Self {
            triangles: triangles.iter().map(|t| t.map(Vec3::as_dvec3)).collect(),
        }
    }

    /// The hidden parts of the line from `a` to `b`, as parameters, in order and joined.
    pub fn hidden(&self, p: DVec3, a: DVec3, b: DVec3, hidden: &mut Vec<[f64; 2]>) {
        hidden.clear();
        let (u, v) = (a - p, b - p);
        let normal = u.cross(v);
        let square = normal.length_squared();
        if square == 0.0 {
            return;
        }
        for triangle in &self.triangles {
            let height = triangle.map(|x| normal.dot(x - p));
            if height.iter().all(|&h| h > 0.0) || height.iter().all(|&h| h < 0.0) {
                continue;
            }
            // In the plane: x = p + i u + j v.
            let mut line = Vec::with_capacity(3);
            for k in 0..3 {
                let l = (k + 1) % 3;
                if (height[k] < 0.0) != (height[l] < 0.0) {
                    let x =
                        triangle[k] + (triangle[l] - triangle[k]) * (height[k] / (height[k] - height[l])) - p;
                    line.push([x.cross(v).dot(normal) / square, u.cross(x).dot(normal) / square]);
                }
            }
            if line.len() != 2 {
                continue;
            }
            // The part with i, j >= 0 and TOUCHING <= i + j <= 1.
            let (mut from, mut to) = (0.0f64, 1.0f64);
            let bounds: [&dyn Fn([f64; 2]) -> f64; 4] =
                [&|x| x[0], &|x| x[1], &|x| x[0] + x[1] - TOUCHING, &|x| {
                    1.0 - TOUCHING - x[0] - x[1]
                }];
            for bound in bounds {
                let (s, e) = (bound(line[0]), bound(line[1]));
                if s < 0.0 && e < 0.0 {
                    (from, to) = (1.0, 0.0);
                } else if s < 0.0 {
                    from = from.max(s / (s - e));
                } else if e < 0.0 {
                    to = to.min(s / (s - e));
                }
            }
            if from >= to {
                continue;
            }
            let at = |x: f64| {
                let [i, j] = [0, 1].map(|k| line[0][k] + (line[1][k] - line[0][k]) * x);
                j / (i + j)
            };
            let (s, e) = (at(from), at(to));
            hidden.push([s.min(e), s.max(e)]);
        }
        hidden.sort_unstable_by(|x, y| x[0].total_cmp(&y[0]));
        let mut kept = 0;
        for i in 0..hidden.len() {
            let part = hidden[i];
            if kept > 0 && part[0] <= hidden[kept - 1][1] + NARROW {
                hidden[kept - 1][1] = hidden[kept - 1][1].max(part[1]);
            } else {
                hidden[kept] = part;
                kept += 1;
            }
        }
        hidden.truncate(kept);
    }

    /// How much of the line from `a` to `b` the point sees; a point light has `a` = `b`.
    pub fn class(&self, p: DVec3, a: DVec3, b: DVec3, scratch: &mut Vec<[f64; 2]>) -> LightClass {
        if a == b {
            return if self.is_cut(p, a) {
                LightClass::Umbra
            } else {
                LightClass::Lit
            };
        }
        self.hidden(p, a, b, scratch);
        let mut seen = 0.0;
        let mut end = 0.0;
        for &[from, to] in scratch.iter() {
            seen += f64::max(0.0, from - end - NARROW);
            end = to;
        }
        seen += f64::max(0.0, 1.0 - end - NARROW);
        if !scratch.iter().any(|[from, to]| to - from > NARROW) {
            LightClass::Lit
        } else if seen > 0.0 {
            LightClass::Penumbra
        } else {
            LightClass::Umbra
        }
    }

    /// Does a triangle cut the segment between two points, not at its ends?
    pub fn is_cut(&self, p: DVec3, q: DVec3) -> bool {
        let d = q - p;
        self.triangles.iter().any(|&[a, b, c]| {
            // Moeller and Trumbore.
            let (e, f) = (b - a, c - a);
            let h = d.cross(f);
            let volume = e.dot(h);
            let s = p - a;
            let (x, g) = (s.dot(h) / volume, s.cross(e));
            let (y, t) = (d.dot(g) / volume, f.dot(g) / volume);
            volume != 0.0 && x >= 0.0 && y >= 0.0 && x + y <= 1.0 && t > TOUCHING && t < 1.0 - TOUCHING
        })
    }

    /// Does a triangle reach into the pyramid between the point and a convex polygon? Then the polygon is not fully seen.
    pub fn reaches_into(&self, p: DVec3, polygon: &[DVec3]) -> bool {
        let n = polygon.len();
        let middle = polygon.iter().sum::<DVec3>() / n as f64;
        let mut planes: Vec<(DVec3, f64)> = (0..n)
            .map(|i| {
                let side = (polygon[i] - p).cross(polygon[(i + 1) % n] - p);
                let side = if side.dot(middle - p) < 0.0 { -side } else { side };
                (side.normalize(), side.normalize().dot(p))
            })
            .collect();
        let base = (polygon[1] - polygon[0])
            .cross(polygon[2] - polygon[0])
            .normalize();
        let towards = if base.dot(p - middle) < 0.0 { -base } else { base };
        let high = towards.dot(p - middle);
        planes.push((towards, towards.dot(middle) + TOUCHING * high));
        planes.push((-towards, -towards.dot(p) + TOUCHING * high));
        self.triangles.iter().any(|triangle| {
            let mut part = triangle.to_vec();
            for &(normal, offset) in &planes {
                let inside = |x: DVec3| normal.dot(x) - offset - 1e-12;
                let mut next = Vec::with_capacity(part.len() + 1);
                for i in 0..part.len() {
                    let (x, y) = (part[i], part[(i + 1) % part.len()]);
                    let (s, e) = (inside(x), inside(y));
                    if s >= 0.0 {
                        next.push(x);
                    }
                    if (s < 0.0) != (e < 0.0) {
                        next.push(x + (y - x) * (s / (s - e)));
                    }
                }
                part = next;
            }
            part.len() > 2
        })
    }

    /// The class of a convex polygon that one convex object may hide: umbra if all of its corners are hidden.
    pub fn class_of_polygon(&self, p: DVec3, polygon: &[DVec3]) -> LightClass {
        if !self.reaches_into(p, polygon) {
            LightClass::Lit
        } else if polygon.iter().all(|&corner| self.is_cut(p, corner)) {
            LightClass::Umbra
        } else {
            LightClass::Penumbra
        }
    }
}

/// The places where `class` changes along a segment, found from `samples` places by bisection. Changes that undo
/// each other between two samples are not found.
pub fn class_changes(
    [from, to]: [DVec3; 2],
    samples: u32,
    mut class: impl FnMut(DVec3) -> LightClass,
) -> Vec<ClassChange> {
    let at = |x: f64| from + (to - from) * x;
    let mut changes = Vec::new();
    let mut before = (0.0, class(at(0.0)));
    for i in 1..=samples {
        let x = f64::from(i) / f64::from(samples);
        let here = (x, class(at(x)));
        // Several changes may lie in between: find the first, go on behind it.
        while before.1 != here.1 {
            let (mut low, mut high) = (before, here);
            while high.0 - low.0 > FINE {
                let middle = 0.5 * (low.0 + high.0);
                let found = class(at(middle));
                if found == low.1 {
                    low.0 = middle;
                } else {
                    high = (middle, found);
                }
            }
            changes.push(ClassChange {
                at: at(0.5 * (low.0 + high.0)),
                between: [low.1, high.1],
            });
            before = high;
        }
        before = here;
    }
    changes
}

/// How many class changes lie near an edge of their kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShadowCoverage {
    /// Changes between lit and not lit: found, and all.
    pub outer: [usize; 2],
    /// Changes between dark and not dark: found, and all.
    pub inner: [usize; 2],
}

impl ShadowCoverage {
    /// Counts a change. `outer` and `inner` are the segments at which it may lie, `near` how far from it (m).
    pub fn count(
        &mut self,
        change: &ClassChange,
        outer: &[[Vec3; 2]],
        inner: &[[Vec3; 2]],
        near: f64,
    ) -> bool {
        let is_near = |segments: &[[Vec3; 2]]| segments.iter().any(|&s| distance(change.at, s) <= near);
        let mut found_all = true;
        for (class, segments, counts) in [
            (LightClass::Lit, outer, &mut self.outer),
            (LightClass::Umbra, inner, &mut self.inner),
        ] {
            if change.between.contains(&class) {
                let found = is_near(segments);
                counts[0] += usize::from(found);
                counts[1] += 1;
                found_all &= found;
            }
        }
        found_all
    }

    /// Adds what another one counted.
    pub fn add(&mut self, other: &Self) {
        for k in 0..2 {
            self.outer[k] += other.outer[k];
            self.inner[k] += other.inner[k];
        }
    }

    /// Shares found of the outer and the inner changes; 1 without any.
    pub fn shares(&self) -> [f64; 2] {
        [self.outer, self.inner].map(
            |[found, all]| {
                if all == 0 { 1.0 } else { found as f64 / all as f64 }
            },
        )
    }
}

fn distance(p: DVec3, segment: [Vec3; 2]) -> f64 {
    let [a, b] = segment.map(Vec3::as_dvec3);
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    let t = if t.is_nan() { 0.0 } else { t };
    p.distance(a + along * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracer::fan_cells;

    #[test]
    fn hidden_parts_agree_with_the_exact_fan() {
        let mut state = 7u64;
        let mut unit = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut point = |size: f32| Vec3::new(unit(), unit(), unit()) * (2.0 * size) - size;
        let mut hidden = Vec::new();
        let mut partly = 0;
        for _ in 0..300 {
            let triangles: Vec<[Vec3; 3]> = (0..12)
                .map(|_| {
                    let at = point(1.0);
                    [at, at + point(0.5), at + point(0.5)]
                })
                .collect();
            let [p, a, b] = [point(3.0), point(3.0), point(3.0)].map(|p| p.as_dvec3());
            let oracle = ShadowOracle::new(&triangles);
            oracle.hidden(p, a, b, &mut hidden);
            let width: f64 = hidden.iter().map(|[from, to]| to - from).sum();
            let exact: f64 = fan_cells(&triangles, p, a, b)
                .iter()
                .filter(|cell| cell.blocked)
                .map(|cell| cell.hi - cell.lo)
                .sum();
            assert!((width - exact).abs() < 1e-5, "{width} and {exact}");
            partly += usize::from(exact > 0.0 && exact < 1.0);
        }
        assert!(partly > 50, "{partly} fans are partly hidden");
    }

    #[test]
    fn changes_below_an_edge_lie_where_geometry_says() {
        // A square of side 2 at height 1 under a line of length 1 at height 2.
        let square = [
            [
                Vec3::new(-1.0, 1.0, -1.0),
                Vec3::new(1.0, 1.0, -1.0),
                Vec3::new(1.0, 1.0, 1.0),
            ],
            [
                Vec3::new(-1.0, 1.0, -1.0),
                Vec3::new(1.0, 1.0, 1.0),
                Vec3::new(-1.0, 1.0, 1.0),
            ],
        ];
        let oracle = ShadowOracle::new(&square);
        let (a, b) = (DVec3::new(-0.5, 2.0, 0.1), DVec3::new(0.5, 2.0, 0.1));
        let mut scratch = Vec::new();
        let line = [DVec3::new(-5.0, 0.0, 0.3), DVec3::new(5.0, 0.0, 0.3)];
        let changes = class_changes(line, 16, |p| oracle.class(p, a, b, &mut scratch));
        let places: Vec<f64> = changes.iter().map(|c| c.at.x).collect();
        for (place, expected) in places.iter().zip([-2.5, -1.5, 1.5, 2.5]) {
            assert!((place - expected).abs() < 1e-8, "{places:?}");
        }
        assert_eq!(changes.len(), 4, "in and out of penumbra and umbra");
        let rect = [a, b, b + DVec3::Z * 0.4, a + DVec3::Z * 0.4];
        let changes = class_changes(line, 16, |p| oracle.class_of_polygon(p, &rect));
        for (change, expected) in changes.iter().zip([-2.5, -1.5, 1.5, 2.5]) {
            assert!((change.at.x - expected).abs() < 1e-5, "rectangle: {change:?}");
        }
        assert_eq!(changes.len(), 4, "rectangle: in and out");
        let changes = class_changes(line, 16, |p| oracle.class(p, a, a, &mut scratch));
        assert_eq!(changes.len(), 2, "a point has no penumbra");
    }
}
