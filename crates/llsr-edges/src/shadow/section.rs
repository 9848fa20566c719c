//! Where an event's wedge cuts the faces of a receiver.
//!
//! A point of the wedge is `origin + alpha d0 + beta d1`. For a VE event the origin is the light's corner and d0, d1
//! reach to the ends of the edge; for an EV event the origin is the vertex and d0, d1 are its distances from the ends
//! of the side. With `s = beta / (alpha + beta)` along the event's edge and `w = 1 / (alpha + beta)`, which is larger
//! for what is nearer to the light, straight lines stay straight. So a face is a segment in (s, w), and clipping what
//! lies behind others is one upper envelope.

use glam::DVec3;
use llsr_intervals::{Beam, FaceHit, FaceScratch, NarrowedFaces, Viewpoint, Wedge};

use super::envelope::Piece;
use super::events::Event;
use super::lanes::{Batch, Found, LANES, Rule};
use super::mesh::ShadowMesh;
use super::scene::ShadowObject;
use super::{ShadowSource, ShadowStatistics};

/// An event's frame in the coordinates of one receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) origin: DVec3,
    pub(super) normal: DVec3,
    /// Dot products with these give alpha and beta.
    pub(super) alpha: DVec3,
    pub(super) beta: DVec3,
}

impl Frame {
    pub(super) fn new(origin: DVec3, d0: DVec3, d1: DVec3) -> Self {
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
    batches: [Batch; BATCHES],
    found: Found,
}

/// Batches filled before the first is cut: what was just written is not read in wider pieces at once.
const BATCHES: usize = 4;

/// Blocks of a receiver that a group of events may meet; more than this are not worth a list.
const NARROW: usize = 256;

/// What part of a receiver a group of events looks at.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    narrowed: Option<NarrowedFaces>,
    spare: NarrowedFaces,
}

impl Part {
    /// All of it.
    pub(super) fn set_whole(&mut self) {
        if let Some(narrowed) = self.narrowed.take() {
            self.spare = narrowed;
        }
    }

    /// The part near `events`, VE events of one corner of the light. False if that is not much less than all of it.
    pub(super) fn set(
        &mut self,
        events: &[Event],
        receiver: &ShadowObject,
        scratch: &mut SectionScratch,
        statistics: &mut ShadowStatistics,
    ) -> bool {
        self.set_whole();
        let tree = receiver.mesh.faces();
        let Some(first) = events.first() else { return true };
        if tree.is_shallow() {
            return true;
        }
        let apex = receiver.to_object.transform_point3(first.points[0]);
        let Some(viewer) = Viewpoint::at(apex) else {
            return true;
        };
        let viewers = [viewer];
        let viewers = &viewers[..usize::from(receiver.mesh.is_solid())];
        let directions = events
            .iter()
            .flat_map(|event| [event.points[1], event.points[2]])
            .map(|p| receiver.to_object.transform_point3(p) - apex);
        let Some(beam) = Beam::around(apex, directions) else {
            return false;
        };
        let done = tree.narrow(&beam, viewers, NARROW, &mut scratch.tree, &mut self.spare);
        let Some(done) = done else { return false };
        statistics.trees.nodes += done.nodes;
        self.narrowed = Some(std::mem::take(&mut self.spare));
        true
    }
}

/// A receiver of an event.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target<'a> {
    pub(super) receiver: &'a ShadowObject,
    /// Where to look.
    pub(super) part: &'a Part,
    /// Its number.
    pub(super) slot: u32,
    /// It is the blocker itself.
    pub(super) is_own: bool,
}

/// Appends the pieces of a receiver in the wedge of `event`; those on the light's side of the blocker as pieces that
/// hide and show nothing.
pub(super) fn cut(
    event: &Event,
    target: Target<'_>,
    scratch: &mut SectionScratch,
    pieces: &mut Vec<Piece>,
    statistics: &mut ShadowStatistics,
) {
    statistics.queries += 1;
    let Target {
        receiver,
        part,
        slot,
        is_own,
    } = target;
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
    let SectionScratch {
        tree: walk,
        faces,
        batches,
        found,
    } = scratch;
    faces.clear();
    let done = match &part.narrowed {
        Some(narrowed) => tree.query_narrowed(narrowed, &wedge, walk, faces),
        None => tree.query(&wedge, viewers, walk, faces),
    };
    statistics.trees.nodes += done.nodes;
    statistics.trees.blocks += done.blocks;
    statistics.faces += faces.len();
    // Alpha and beta are the same in all affine frames.
    let frame = Frame::new(
        tree.to_frame(first),
        tree.direction_to_frame(d0),
        tree.direction_to_frame(d1),
    );
    let light = light.map(|p| tree.to_frame(p));
    let seen_from = solid.then_some(if is_edge { [light[0]; 2] } else { light });
    let rule = if is_edge { Rule::EDGE } else { Rule::VERTEX };
    for run in faces.chunks(BATCHES * LANES) {
        for (hits, batch) in run.chunks(LANES).zip(&mut *batches) {
            for (lane, &hit) in hits.iter().enumerate() {
                batch.set(lane, tree.corners(hit));
            }
        }
        for (hits, batch) in run.chunks(LANES).zip(&mut *batches) {
            batch.place(&frame, rule, seen_from);
            if is_own {
                for (lane, hit) in hits.iter().enumerate() {
                    if batch.is_near(lane) {
                        fix_own(&receiver.mesh, hit.face, event.own, is_edge, lane, batch);
                    }
                }
            }
        }
        for (hits, batch) in run.chunks(LANES).zip(&*batches) {
            batch.cut(rule, found);
            for (lane, hit) in hits.iter().enumerate() {
                if let Some((s, w)) = found.visible(lane) {
                    pieces.push(Piece::new(s, w, slot, hit.face));
                }
                if let Some(s) = found.hiding(lane) {
                    pieces.push(Piece::new(s, [Piece::HIDING; 2], slot, hit.face));
                }
            }
        }
    }
}

/// Puts the vertices that lie in the event's plane where they are, without rounding, and drops faces at the event's
/// own edge.
fn fix_own(mesh: &ShadowMesh, face: u32, own: [u32; 2], is_edge: bool, lane: usize, batch: &mut Batch) {
    let vertices = mesh.edges().faces()[face as usize];
    let mut count = 0;
    for (corner, vertex) in vertices.iter().enumerate() {
        if let Some(which) = own.iter().position(|v| v == vertex) {
            count += 1;
            let place = match (is_edge, which) {
                (false, _) => [0.0, 0.0],
                (true, 0) => [1.0, 0.0],
                (true, _) => [0.0, 1.0],
            };
            batch.put(lane, corner, place);
        }
    }
    if is_edge && count == 2 {
        batch.drop(lane);
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
