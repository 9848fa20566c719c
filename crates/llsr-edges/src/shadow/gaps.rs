//! EEE events of a line: gaps between two edges that close.
//!
//! Bala et al. (2003, section 6.3) leave events of three edges out. Of a linear light they are the only other changes, and
//! only between part of it and none: the last visible bit lies between an edge that hides what is on one side of it and
//! another edge that hides what is on the other. Lines through a point of the light and both edges sweep a ruled
//! quadric. For each point of the light there is one such line at most, so the surface is walked along the light and the
//! lines are followed to the first receiver behind both edges.

use glam::{DAffine3, DVec3};
use llsr_intervals::{FaceHit, FaceScratch, Viewpoint, Wedge};
use llsr_scene::{LightId, NO_FACE, ObjectId, Triple};

use super::scene::{ShadowObject, ShadowScene, is_outside};
use super::{ShadowEdge, ShadowKind, ShadowSource};
use crate::EdgeScratch;

/// What [`ShadowScene::closing_gaps`] found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gaps {
    /// Umbral edges at which a gap between two edges closes.
    pub edges: Vec<ShadowEdge>,
    /// Pairs of edges that were looked at.
    pub pairs: usize,
    /// True if there were more pairs than allowed, so that some edges were not paired with all others.
    pub truncated: bool,
}

/// An edge that may be a silhouette for some point of the light.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    object: ObjectId,
    edge: u32,
    vertices: [u32; 2],
    ends: [DVec3; 2],
    /// Corners of its faces beside it; the same twice at a boundary.
    beside: [DVec3; 2],
    /// Normals of the planes through it and both ends of the light.
    normals: [DVec3; 2],
}

/// Where a line from the light meets two edges, and how it goes on.
#[derive(Clone, Copy, Debug)]
struct Landing {
    receiver: ObjectId,
    face: u32,
    at: DVec3,
    normal: DVec3,
}

/// Parts of the light between places where a pair of edges may begin or cease to be an event.
const PARTS: usize = 9;
/// Steps in which an event is walked before they are halved where it bends.
const STEPS: u32 = 4;
/// Halvings of a step.
const DEPTH: u32 = 7;
/// How far a curve may lie from its chord, relative to the diagonal of the scene's box.
const BEND: f64 = 1e-5;
/// Faces nearer to an edge than this part of its distance from the light touch it.
const TOUCH: f64 = 1e-6;

impl ShadowScene {
    /// The umbral edges of a linear light that VE and EV events do not give: those at which a gap between edges of the
    /// same or of two blockers closes. Other lights have none here.
    ///
    /// All pairs of edges that may be silhouettes are looked at, at most `most_pairs` of them. Cost: about 10 ns a
    /// pair, and some microseconds for each step along an event. For still pictures: nothing is kept for a move.
    pub fn closing_gaps(&self, id: LightId, most_pairs: usize) -> Gaps {
        let mut gaps = Gaps::default();
        let Some([a, b]) = self
            .light(id)
            .and_then(|light| <[DVec3; 2]>::try_from(light.corners()).ok())
        else {
            return gaps;
        };
        let candidates = self.candidates(a, b);
        let most_far = most_pairs / candidates.len().max(1);
        gaps.truncated = most_far < candidates.len();
        let mut walk = Walk {
            scene: self,
            light: id,
            ends: [a, b],
            tolerance: BEND * f64::from(self.size()),
            scratch: FaceScratch::default(),
            hits: Vec::new(),
        };
        for near in &candidates {
            for far in candidates.iter().take(most_far) {
                gaps.pairs += 1;
                for part in event_parts(near, far, a, b).into_iter().flatten() {
                    walk.event(near, far, part, &mut gaps.edges);
                }
            }
        }
        gaps
    }

    fn candidates(&self, a: DVec3, b: DVec3) -> Vec<Candidate> {
        let mut all = Vec::new();
        let (mut scratch, mut found) = (EdgeScratch::default(), Vec::new());
        for id in self.objects() {
            let Some(object) = self.object(id) else { continue };
            let mesh = &object.mesh;
            let local = [a, b].map(|p| object.to_object.transform_point3(p));
            let [Some(from), Some(to)] = local.map(Viewpoint::at) else {
                continue;
            };
            let convex_only = mesh.is_solid() && is_outside(object, &local);
            found.clear();
            mesh.edges()
                .possible_silhouettes(&[from, to], &mut scratch, &mut found);
            found.extend(mesh.edges().boundaries());
            found.sort_unstable();
            for &edge in &found {
                if convex_only && !mesh.is_convex(edge) {
                    continue;
                }
                let this = mesh.edges().edge(edge);
                let world = |v: u32| object.to_world.transform_point3(mesh.position(v));
                let beside = this.faces.map(|face| {
                    (face != NO_FACE)
                        .then(|| mesh.opposite(face, this.vertices))
                        .flatten()
                });
                let Some(first) = beside[0] else { continue };
                let ends = this.vertices.map(world);
                all.push(Candidate {
                    object: id,
                    edge,
                    vertices: this.vertices,
                    ends,
                    beside: [world(first), world(beside[1].unwrap_or(first))],
                    normals: [a, b].map(|l| (ends[0] - l).cross(ends[1] - l)),
                });
            }
        }
        all
    }
}

/// Parts of the light, as parameters, from which lines go first through `near` and then through `far` so that a gap closes
/// between them.
fn event_parts(near: &Candidate, far: &Candidate, a: DVec3, b: DVec3) -> [Option<[f64; 2]>; PARTS] {
    let mut parts = [None; PARTS];
    // Heights of the ends of one edge above the plane through the light's point and the other edge: linear along the
    // light.
    let heights = |plane: &Candidate, p: DVec3| [plane.normals[0].dot(p - a), plane.normals[1].dot(p - b)];
    let same = |x: [f64; 2], y: [f64; 2]| {
        (x[0] > 0.0 && x[1] > 0.0 && y[0] > 0.0 && y[1] > 0.0)
            || (x[0] < 0.0 && x[1] < 0.0 && y[0] < 0.0 && y[1] < 0.0)
    };
    let (f0, f1) = (heights(near, far.ends[0]), heights(near, far.ends[1]));
    if same(f0, f1) {
        return parts;
    }
    let (g0, g1) = (heights(far, near.ends[0]), heights(far, near.ends[1]));
    if same(g0, g1) {
        return parts;
    }
    if near.object == far.object && near.vertices.iter().any(|v| far.vertices.contains(v)) {
        return parts;
    }
    // Along the light an edge begins or ceases to be a silhouette where the plane of one of its faces is passed.
    let [n0, n1] = near.beside.map(|p| heights(near, p));
    let [m0, m1] = far.beside.map(|p| heights(far, p));
    let mut cuts = [1.0; PARTS + 1];
    cuts[0] = 0.0;
    for (cut, f) in cuts[1..PARTS].iter_mut().zip([f0, f1, g0, g1, n0, n1, m0, m1]) {
        let t = f[0] / (f[0] - f[1]);
        if t > 0.0 && t < 1.0 {
            *cut = t;
        }
    }
    cuts.sort_unstable_by(f64::total_cmp);
    for (part, ends) in parts.iter_mut().zip(cuts.windows(2)) {
        let t = 0.5 * (ends[0] + ends[1]);
        let value = |f: [f64; 2]| f[0] + (f[1] - f[0]) * t;
        if ends[1] - ends[0] < 1e-9 || value(f0) * value(f1) >= 0.0 || value(g0) * value(g1) >= 0.0 {
            continue;
        }
        let q = a + (b - a) * t;
        let x = meeting(near, far, q);
        let y = meeting(far, near, q);
        // In this order on one side of the light.
        if (x - q).dot(y - q) <= (x - q).length_squared() {
            continue;
        }
        let (Some(first), Some(second)) = (hidden_side(near, q, b), hidden_side(far, q, b)) else {
            continue;
        };
        if first != second {
            *part = Some([ends[0], ends[1]]);
        }
    }
    parts
}

/// Where the plane through `q` and the edge `other` meets `edge`.
fn meeting(edge: &Candidate, other: &Candidate, q: DVec3) -> DVec3 {
    let normal = (other.ends[0] - q).cross(other.ends[1] - q);
    let [a, b] = edge.ends;
    let (x, y) = (normal.dot(a - q), normal.dot(b - q));
    a + (b - a) * (x / (x - y))
}

/// Does the edge hide what lies from `q` towards `end` of the light (or the other way)? `None` if it is no silhouette from `q`.
fn hidden_side(edge: &Candidate, q: DVec3, end: DVec3) -> Option<bool> {
    let normal = (edge.ends[0] - q).cross(edge.ends[1] - q);
    let [f, g] = edge.beside.map(|p| normal.dot(p - q) > 0.0);
    (f == g).then(|| f == (normal.dot(end - q) > 0.0))
}

struct Walk<'a> {
    scene: &'a ShadowScene,
    light: LightId,
    ends: [DVec3; 2],
    tolerance: f64,
    scratch: FaceScratch,
    hits: Vec<FaceHit>,
}

impl Walk<'_> {
    fn event(
        &mut self,
        near: &Candidate,
        far: &Candidate,
        [from, to]: [f64; 2],
        edges: &mut Vec<ShadowEdge>,
    ) {
        // Just inside: at an end the line leaves an edge.
        let (from, to) = (from + 1e-9, to - 1e-9);
        let mut before = (from, self.land(near, far, from));
        for i in 1..=STEPS {
            let t = from + (to - from) * f64::from(i) / f64::from(STEPS);
            let here = (t, self.land(near, far, t));
            self.step(near, far, [before, here], DEPTH, edges);
            before = here;
        }
    }

    /// Adds the curve between two places of the light.
    fn step(
        &mut self,
        near: &Candidate,
        far: &Candidate,
        [from, to]: [(f64, Option<Landing>); 2],
        depth: u32,
        edges: &mut Vec<ShadowEdge>,
    ) {
        if from.1.is_none() && to.1.is_none() {
            return;
        }
        let t = 0.5 * (from.0 + to.0);
        let middle = self.land(near, far, t);
        if let (Some(a), Some(b), Some(m)) = (from.1, to.1, middle) {
            let chord = 0.5 * (a.at + b.at);
            let flat = |x: &Landing, y: &Landing| {
                x.receiver == y.receiver
                    && x.normal.dot(y.at - x.at).abs() <= self.tolerance
                    && y.normal.dot(y.at - x.at).abs() <= self.tolerance
            };
            if flat(&a, &m) && flat(&m, &b) && m.at.distance(chord) <= self.tolerance {
                for (x, y) in [(a, m), (m, b)] {
                    let segment = [x.at, y.at].map(|p| p.as_vec3());
                    if segment[0] != segment[1] && segment.iter().all(|p| p.is_finite()) {
                        edges.push(ShadowEdge {
                            kind: ShadowKind::Umbral,
                            segment,
                            triple: Triple {
                                light: self.light,
                                blocker: far.object,
                                receiver: x.receiver,
                            },
                            source: ShadowSource::Gap {
                                near: near.object,
                                near_edge: near.edge,
                                far_edge: far.edge,
                            },
                            face: x.face,
                        });
                    }
                }
                return;
            }
        }
        if depth > 0 {
            self.step(near, far, [from, (t, middle)], depth - 1, edges);
            self.step(near, far, [(t, middle), to], depth - 1, edges);
        }
    }

    /// The first face behind both edges on the line from the light's point at `t`; none if something else is in between.
    fn land(&mut self, near: &Candidate, far: &Candidate, t: f64) -> Option<Landing> {
        let [a, b] = self.ends;
        let q = a + (b - a) * t;
        let (x, y) = (meeting(near, far, q), meeting(far, near, q));
        let way = y - q;
        let first = (x - q).dot(way) / way.length_squared();
        let mut best: Option<(f64, Landing)> = None;
        for id in self.scene.objects() {
            let Some(object) = self.scene.object(id) else {
                continue;
            };
            let tree = object.mesh.faces();
            let [start, along] = in_object(&object.to_object, q, way);
            // As thin a wedge as the tree can hold: a line.
            let side = along.any_orthogonal_vector() * 1e-9;
            let Some(wedge) = Wedge::cone(start, [along - side, along + side]) else {
                continue;
            };
            self.hits.clear();
            tree.query(&wedge, &[], &mut self.scratch, &mut self.hits);
            for hit in &self.hits {
                let corners = object.mesh.edges().corners(hit.face);
                let Some(r) = line_meets(start, along, corners) else {
                    continue;
                };
                if r <= TOUCH || touches(object, id, hit.face, [near, far]) {
                    continue;
                }
                if r < 1.0 - TOUCH {
                    if (r - first).abs() > TOUCH {
                        return None;
                    }
                    continue;
                }
                if best.is_none_or(|(other, _)| r < other) {
                    let [u, v, w] = corners.map(|p| object.to_world.transform_point3(p));
                    let landing = Landing {
                        receiver: id,
                        face: hit.face,
                        at: q + way * r,
                        normal: (v - u).cross(w - u).normalize_or_zero(),
                    };
                    best = Some((r, landing));
                }
            }
        }
        best.map(|(_, landing)| landing)
    }
}

fn in_object(to_object: &DAffine3, start: DVec3, along: DVec3) -> [DVec3; 2] {
    [
        to_object.transform_point3(start),
        to_object.transform_vector3(along),
    ]
}

/// Is the face at one of the edges?
fn touches(object: &ShadowObject, id: ObjectId, face: u32, edges: [&Candidate; 2]) -> bool {
    let corners = object.mesh.edges().faces()[face as usize];
    edges
        .iter()
        .any(|edge| edge.object == id && edge.vertices.iter().all(|v| corners.contains(v)))
}

/// Where a line meets a triangle, in units of `along` (Moeller & Trumbore 1997).
fn line_meets(start: DVec3, along: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (u, v) = (b - a, c - a);
    let h = along.cross(v);
    let inverse = u.dot(h).recip();
    let s = start - a;
    let g = s.cross(u);
    let (x, y) = (s.dot(h) * inverse, along.dot(g) * inverse);
    (x >= 0.0 && y >= 0.0 && x + y <= 1.0).then(|| v.dot(g) * inverse)
}
