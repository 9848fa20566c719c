//! The segment in which two triangles cross.

use glam::{DVec3, Vec3};
use llsr_scene::Bounds;

/// A triangle with its plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    corners: [Vec3; 3],
    /// Unit normal.
    normal: DVec3,
}

impl Face {
    /// `None` if a coordinate is not finite or the triangle has no area.
    pub(super) fn new(corners: [Vec3; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some(Self { corners, normal })
    }

    pub(super) fn corners(&self) -> [Vec3; 3] {
        self.corners
    }

    /// Signed distance (m) of a point from the plane.
    fn distance(&self, p: Vec3) -> f64 {
        (p.as_dvec3() - self.corners[0].as_dvec3()).dot(self.normal)
    }

    /// The largest signed distance of a box's corners.
    fn furthest(&self, bounds: &Bounds) -> f64 {
        let corners = bounds.corners().into_iter();
        corners.map(|p| self.distance(p)).fold(f64::MIN, f64::max)
    }
}

/// How a triangle lies to a plane: the two places in which its sides cross it.
struct Stretch {
    places: [DVec3; 2],
    /// It has a side in the plane.
    along: bool,
}

/// Where two triangles of different parts cross, or `None` if they only touch, lie in one plane or apart.
///
/// `boxes` are those of the parts. A corner within `touching` (m) of the other's plane counts as lying in it, and what lies in a plane as
/// being in front of it, so that of all faces around a corner in the plane those count that go on behind it. But a part that
/// stays wholly behind only touches the plane from there.
pub(super) fn cross(faces: [&Face; 2], boxes: [&Bounds; 2], touching: f64) -> Option<[Vec3; 2]> {
    let [a, b] = faces;
    let on_b = stretch(a, b, boxes[0], touching)?;
    let on_a = stretch(b, a, boxes[1], touching)?;
    if on_a.along && on_b.along {
        return None;
    }
    // Both lie on the line in which the planes meet.
    let line = a.normal.cross(b.normal).try_normalize()?;
    let mut ends = [on_b.places, on_a.places].map(|places| {
        let mut ends = places.map(|p| (p.dot(line), p));
        ends.sort_by(|x, y| x.0.total_cmp(&y.0));
        ends
    });
    ends.sort_by(|x, y| x[0].0.total_cmp(&y[0].0));
    let [first, second] = ends;
    let from = second[0];
    let to = if first[1].0 < second[1].0 {
        first[1]
    } else {
        second[1]
    };
    let segment = [from.1.as_vec3(), to.1.as_vec3()];
    (from.0 < to.0 && segment[0] != segment[1]).then_some(segment)
}

fn stretch(face: &Face, plane: &Face, part: &Bounds, touching: f64) -> Option<Stretch> {
    let distances = face.corners.map(|p| {
        let distance = plane.distance(p);
        if distance.abs() <= touching { 0.0 } else { distance }
    });
    let behind = distances.map(|d| d < 0.0);
    if behind[0] == behind[1] && behind[1] == behind[2] {
        return None;
    }
    if distances.iter().all(|&d| d <= 0.0) && plane.furthest(part) <= touching {
        return None;
    }
    let mut places = [DVec3::ZERO; 2];
    let mut count = 0;
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        if behind[i] != behind[j] {
            places[count] = between(face.corners, distances, i, j);
            count += 1;
        }
    }
    Some(Stretch {
        places,
        along: distances.iter().filter(|&&d| d == 0.0).count() == 2,
    })
}

/// Where a side crosses the plane; the same for the other triangle that has this side.
fn between(corners: [Vec3; 3], distances: [f64; 3], i: usize, j: usize) -> DVec3 {
    let turned = corners[i].to_array() > corners[j].to_array();
    let (i, j) = if turned { (j, i) } else { (i, j) };
    let (p, q) = (corners[i].as_dvec3(), corners[j].as_dvec3());
    p + (q - p) * (distances[i] / (distances[i] - distances[j]))
}
