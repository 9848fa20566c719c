//! Where an event's wedge cuts the faces of a receiver.
//!
//! A point of the wedge is `origin + alpha d0 + beta d1`. For a VE event the origin is the light's corner and d0, d1
//! reach to the ends of the edge; for an EV event the origin is the vertex and d0, d1 are its distances from the ends
//! of the side. With `s = beta / (alpha + beta)` along the event's edge and `w = 1 / (alpha + beta)`, which is larger
//! for what is nearer to the light, straight lines stay straight. So a face is a segment in (s, w), and clipping what
//! lies behind others is one upper envelope.

use glam::DVec3;
use llsr_intervals::{FaceHit, FaceScratch, Viewpoint, Wedge};

use super::envelope::Piece;
use super::events::Event;
use super::mesh::ShadowMesh;
use super::scene::ShadowObject;
use super::{ShadowSource, ShadowStatistics};

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
    faces: Vec<FaceHit>,
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
    statistics: &mut ShadowStatistics,
) {
    statistics.queries += 1;
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
    // Of an EV event, what is before the vertex counts too.
    let wedge = if is_edge { wedge } else { wedge.doubled() };
    let solid = receiver.mesh.is_solid();
    let [Some(from), Some(to)] = light.map(Viewpoint::at) else {
        return;
    };
    let both = [from, to];
    let viewers = match (solid, is_edge) {
        (false, _) => &both[..0],
        (true, true) => &both[..1],
        (true, false) => &both[..],
    };
    let tree = receiver.mesh.faces();
    scratch.faces.clear();
    let done = tree.query(&wedge, viewers, &mut scratch.tree, &mut scratch.faces);
    statistics.trees.nodes += done.nodes;
    statistics.trees.blocks += done.blocks;
    statistics.faces += scratch.faces.len();
    // Alpha and beta are the same in all affine frames.
    let job = Job {
        frame: Frame::new(
            tree.to_frame(first),
            tree.direction_to_frame(d0),
            tree.direction_to_frame(d1),
        ),
        is_edge,
        light: light.map(|p| tree.to_frame(p)),
        own: is_own.then_some(event.own),
        mesh: &receiver.mesh,
        slot,
        solid,
    };
    for &hit in &scratch.faces {
        job.face(hit, pieces);
    }
}

struct Job<'a> {
    frame: Frame,
    is_edge: bool,
    light: [DVec3; 2],
    /// Vertices of the receiver that lie in the event's plane.
    own: Option<[u32; 2]>,
    mesh: &'a ShadowMesh,
    slot: u32,
    solid: bool,
}

/// Place of a point in the wedge: alpha and beta.
type Place = [f64; 2];

impl Job<'_> {
    /// Adds the pieces of one face.
    fn face(&self, hit: FaceHit, pieces: &mut Vec<Piece>) {
        let [a, b, c] = self.mesh.faces().corners(hit);
        let [a, b, c] = [a.as_dvec3(), b.as_dvec3(), c.as_dvec3()];
        if self.solid {
            let normal = (b - a).cross(c - a);
            let [from, to] = self.light;
            if normal.dot(from - a) <= 0.0 && (self.is_edge || normal.dot(to - a) <= 0.0) {
                return;
            }
        }
        let Frame {
            origin,
            normal,
            alpha,
            beta,
        } = &self.frame;
        let [a, b, c] = [a - origin, b - origin, c - origin];
        let mut height = [normal.dot(a), normal.dot(b), normal.dot(c)];
        let mut place = [
            [alpha.dot(a), beta.dot(a)],
            [alpha.dot(b), beta.dot(b)],
            [alpha.dot(c), beta.dot(c)],
        ];
        if let Some(own) = self.own
            && !self.fix_own(hit.face, own, &mut height, &mut place)
        {
            return;
        }
        let Some([a, b]) = crossing(height, place) else {
            return;
        };
        self.add(hit.face, a, b, pieces);
        if !self.is_edge {
            self.add_before(hit.face, [-a[0], -a[1]], [-b[0], -b[1]], pieces);
        }
    }

    /// Puts the vertices that lie in the event's plane where they are, without rounding. False for faces at the
    /// event's own edge.
    fn fix_own(&self, face: u32, own: [u32; 2], height: &mut [f64; 3], place: &mut [Place; 3]) -> bool {
        // Far from the blocker there is none of them; this saves a look at the list of faces.
        let near = |p: &Place| (p[0] + p[1] - if self.is_edge { 1.0 } else { 0.0 }).abs() < 1e-3;
        if !place.iter().any(near) {
            return true;
        }
        let vertices = self.mesh.edges().faces()[face as usize];
        let mut count = 0;
        for i in 0..3 {
            if let Some(which) = own.iter().position(|&v| v == vertices[i]) {
                count += 1;
                height[i] = 0.0;
                place[i] = match (self.is_edge, which) {
                    (false, _) => [0.0, 0.0],
                    (true, 0) => [1.0, 0.0],
                    (true, _) => [0.0, 1.0],
                };
            }
        }
        !self.is_edge || count < 2
    }

    /// Adds what lies in the cone behind the light.
    fn add(&self, face: u32, a: Place, b: Place, pieces: &mut Vec<Piece>) {
        let Some((a, b)) = clip(a, b, |p| p[0]).and_then(|(a, b)| clip(a, b, |p| p[1])) else {
            return;
        };
        let nearest = if self.is_edge { 1.0 - CONTACT } else { NEAREST };
        self.push(clip(a, b, |p| p[0] + p[1] - nearest), face, false, pieces);
        if self.is_edge && (a[0] + a[1]).min(b[0] + b[1]) < nearest {
            let part = clip(a, b, |p| nearest - (p[0] + p[1]))
                .and_then(|(a, b)| clip(a, b, |p| p[0] + p[1] - CONTACT));
            self.push(part, face, true, pieces);
        }
    }

    /// Adds what lies between the light and the vertex of an EV event.
    fn add_before(&self, face: u32, a: Place, b: Place, pieces: &mut Vec<Piece>) {
        let part = clip(a, b, |p| p[0])
            .and_then(|(a, b)| clip(a, b, |p| p[1]))
            .and_then(|(a, b)| clip(a, b, |p| p[0] + p[1] - CONTACT))
            .and_then(|(a, b)| clip(a, b, |p| 1.0 - CONTACT - (p[0] + p[1])));
        self.push(part, face, true, pieces);
    }

    fn push(&self, part: Option<(Place, Place)>, face: u32, hides: bool, pieces: &mut Vec<Piece>) {
        let Some((a, b)) = part else { return };
        let (sa, sb) = (a[0] + a[1], b[0] + b[1]);
        let s = [(a[1] / sa).clamp(0.0, 1.0), (b[1] / sb).clamp(0.0, 1.0)];
        let w = if hides {
            [Piece::HIDING; 2]
        } else {
            [sa.recip(), sb.recip()]
        };
        pieces.push(Piece::new(s, w, self.slot, face));
    }
}

/// The ends of the line in which a triangle crosses the plane of height 0, given the heights and places of its
/// corners.
#[inline]
fn crossing(height: [f64; 3], place: [Place; 3]) -> Option<[Place; 2]> {
    let mut ends = [[0.0; 2]; 2];
    let mut count = 0;
    for i in 0..3 {
        let j = (i + 1) % 3;
        let end = if height[i] == 0.0 {
            place[i]
        } else if height[i] * height[j] < 0.0 {
            let t = height[i] / (height[i] - height[j]);
            [
                place[i][0] + (place[j][0] - place[i][0]) * t,
                place[i][1] + (place[j][1] - place[i][1]) * t,
            ]
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
#[inline]
fn clip(a: Place, b: Place, inside: impl Fn(Place) -> f64) -> Option<(Place, Place)> {
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
        // Gaps are no wedges and are walked by themselves.
        ShadowSource::Vertex { .. } | ShadowSource::Gap { .. } => first + (first - along) / w,
    }
}
