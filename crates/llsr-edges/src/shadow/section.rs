//! Where an event's wedge cuts the faces of a receiver.
//!
//! A point of the wedge is `origin + alpha d0 + beta d1`. For a VE event the origin is the light's corner and d0, d1
//! reach to the ends of the edge; for an EV event the origin is the vertex and d0, d1 are its distances from the ends
//! of the side. With `s = beta / (alpha + beta)` along the event's edge and `w = 1 / (alpha + beta)`, which is larger
//! for what is nearer to the light, straight lines stay straight. So a face is a segment in (s, w), and clipping what
//! lies behind others is one upper envelope.

use glam::DVec3;
use llsr_intervals::{FaceScratch, Viewpoint, Wedge};

use super::ShadowSource;
use super::envelope::Piece;
use super::events::Event;
use super::scene::ShadowObject;

/// A face that touches the blocker within this part of its distance from the light counts as behind it: contacts are
/// only as good as single-precision coordinates.
const CONTACT: f64 = 1e-5;
/// Nearest distance from the origin of an event, relative to that of the blocker from the light.
const NEAREST: f64 = 1e-7;

/// An event's frame in the coordinates of one receiver.
#[derive(Clone, Copy, Debug)]
struct Frame {
    origin: DVec3,
    normal: DVec3,
    /// Dot products with these give alpha and beta.
    alpha: DVec3,
    beta: DVec3,
}

impl Frame {
    fn new(origin: DVec3, d0: DVec3, d1: DVec3) -> Self {
        let normal = d0.cross(d1);
        let inverse = normal.length_squared().recip();
        Self {
            origin,
            normal,
            alpha: d1.cross(normal) * inverse,
            beta: normal.cross(d0) * inverse,
        }
    }
}

/// Working memory of intersections.
#[derive(Clone, Debug, Default)]
pub(super) struct SectionScratch {
    tree: FaceScratch,
    faces: Vec<u32>,
}

/// Appends the pieces of `receiver` in the wedge of `event`, numbered `slot`; those on the light's side of the
/// blocker as pieces that hide and show nothing. `is_own`: the receiver is the blocker itself.
pub(super) fn cut(
    event: &Event,
    receiver: &ShadowObject,
    slot: u32,
    is_own: bool,
    scratch: &mut SectionScratch,
    pieces: &mut Vec<Piece>,
) {
    let to_object = |p: DVec3| receiver.to_object.transform_point3(p);
    let [first, second, third] = event.points.map(to_object);
    let is_edge = matches!(event.source, ShadowSource::Edge { .. });
    // The origin, the two directions, and the light's places.
    let (d0, d1, light) = if is_edge {
        (second - first, third - first, [first; 2])
    } else {
        (first - second, first - third, [second, third])
    };
    let Some(wedge) = Wedge::cone(first, [d0, d1]) else {
        return;
    };
    let solid = receiver.mesh.is_solid();
    let viewers = light.map(Viewpoint::at);
    let [Some(from), Some(to)] = viewers else { return };
    let both = [from, to];
    let viewers = match (solid, is_edge) {
        (false, _) => &both[..0],
        (true, true) => &both[..1],
        (true, false) => &both[..],
    };
    let job = Job {
        frame: Frame::new(first, d0, d1),
        is_edge,
        light,
        own: if is_own { event.own } else { [u32::MAX; 2] },
        receiver,
        slot,
        solid,
    };
    let tree = receiver.mesh.faces();
    scratch.faces.clear();
    tree.query(&wedge, viewers, &mut scratch.tree, &mut scratch.faces);
    for &face in &scratch.faces {
        job.face(face, false, pieces);
    }
    if is_edge {
        return;
    }
    // Before the vertex, on the way from the light.
    if let Some(wedge) = Wedge::cone(first, [-d0, -d1]) {
        scratch.faces.clear();
        tree.query(&wedge, viewers, &mut scratch.tree, &mut scratch.faces);
        for &face in &scratch.faces {
            job.face(face, true, pieces);
        }
    }
}

struct Job<'a> {
    frame: Frame,
    is_edge: bool,
    light: [DVec3; 2],
    own: [u32; 2],
    receiver: &'a ShadowObject,
    slot: u32,
    solid: bool,
}

impl Job<'_> {
    /// Adds the piece of one face; `before`: of the part of an EV event on the light's side of the vertex.
    fn face(&self, face: u32, before: bool, pieces: &mut Vec<Piece>) {
        let edges = self.receiver.mesh.edges();
        let vertices = edges.faces()[face as usize];
        let own = vertices.map(|v| self.own.contains(&v));
        if self.is_edge && own.iter().filter(|&&own| own).count() > 1 {
            // A face at the edge itself.
            return;
        }
        let corners = edges.corners(face);
        if self.solid {
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            if self.light.iter().all(|&l| normal.dot(l - corners[0]) <= 0.0) {
                return;
            }
        }
        let Frame {
            origin,
            normal,
            alpha,
            beta,
        } = self.frame;
        let mut height = [0.0; 3];
        let mut place = [[0.0; 2]; 3];
        for i in 0..3 {
            let p = corners[i] - origin;
            height[i] = normal.dot(p);
            place[i] = [alpha.dot(p), beta.dot(p)];
            if own[i] {
                // Known without rounding.
                height[i] = 0.0;
                place[i] = match (self.is_edge, vertices[i] == self.own[0]) {
                    (false, _) => [0.0, 0.0],
                    (true, true) => [1.0, 0.0],
                    (true, false) => [0.0, 1.0],
                };
            }
        }
        let Some([mut a, mut b]) = crossing(height, place) else {
            return;
        };
        if before {
            (a, b) = (a.map(|x| -x), b.map(|x| -x));
        }
        let Some((a, b)) = clip(a, b, |p| p[0]).and_then(|(a, b)| clip(a, b, |p| p[1])) else {
            return;
        };
        if before {
            // Between the light and the vertex.
            let part = clip(a, b, |p| p[0] + p[1] - CONTACT)
                .and_then(|(a, b)| clip(a, b, |p| 1.0 - CONTACT - (p[0] + p[1])));
            self.push(part, face, true, pieces);
            return;
        }
        let nearest = if self.is_edge { 1.0 - CONTACT } else { NEAREST };
        self.push(clip(a, b, |p| p[0] + p[1] - nearest), face, false, pieces);
        if self.is_edge && (a[0] + a[1]).min(b[0] + b[1]) < nearest {
            let part = clip(a, b, |p| nearest - (p[0] + p[1]))
                .and_then(|(a, b)| clip(a, b, |p| p[0] + p[1] - CONTACT));
            self.push(part, face, true, pieces);
        }
    }

    fn push(&self, part: Option<([f64; 2], [f64; 2])>, face: u32, hides: bool, pieces: &mut Vec<Piece>) {
        let Some((a, b)) = part else { return };
        let point = |p: [f64; 2]| {
            let sum = p[0] + p[1];
            ((p[1] / sum).clamp(0.0, 1.0), sum.recip())
        };
        let (mut a, mut b) = (point(a), point(b));
        if a.0 > b.0 {
            std::mem::swap(&mut a, &mut b);
        }
        if hides {
            (a.1, b.1) = (Piece::HIDING, Piece::HIDING);
        }
        pieces.push(Piece {
            s: [a.0, b.0],
            w: [a.1, b.1],
            slot: self.slot,
            face,
        });
    }
}

/// The ends of the line in which a triangle crosses the plane of height 0, given the heights and places of its
/// corners.
fn crossing(height: [f64; 3], place: [[f64; 2]; 3]) -> Option<[[f64; 2]; 2]> {
    let mut ends = [[0.0; 2]; 2];
    let mut count = 0;
    for i in 0..3 {
        let j = (i + 1) % 3;
        let end = if height[i] == 0.0 {
            place[i]
        } else if height[i] * height[j] < 0.0 {
            let t = height[i] / (height[i] - height[j]);
            [0, 1].map(|k| place[i][k] + (place[j][k] - place[i][k]) * t)
        } else {
            continue;
        };
        if count < 2 {
            ends[count] = end;
        }
        count += 1;
    }
    // Three zeros: the face lies in the plane of the event, seen edge-on.
    (count == 2).then_some(ends)
}

/// The part of a-b where `inside`, which is linear, is not negative.
fn clip(a: [f64; 2], b: [f64; 2], inside: impl Fn([f64; 2]) -> f64) -> Option<([f64; 2], [f64; 2])> {
    let (x, y) = (inside(a), inside(b));
    let cut = || {
        let t = x / (x - y);
        [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
    };
    match (x >= 0.0, y >= 0.0) {
        (true, true) => Some((a, b)),
        (false, false) => None,
        (true, false) => Some((a, cut())),
        (false, true) => Some((cut(), b)),
    }
}

/// The point of an event at `s` along its edge and at the inverse distance `w`, in the scene's frame.
pub(super) fn point_of(event: &Event, s: f64, w: f64) -> DVec3 {
    let [first, second, third] = event.points;
    let along = second + (third - second) * s;
    match event.source {
        ShadowSource::Edge { .. } => first + (along - first) / w,
        ShadowSource::Vertex { .. } => first + (first - along) / w,
    }
}
