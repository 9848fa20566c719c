//! Where an event's wedge cuts the faces of a receiver.
//!
//! A point of the wedge is `origin + alpha d0 + beta d1`. For a VE event the origin is the light's corner and d0, d1
//! reach to the ends of the edge; for an EV event the origin is the vertex and d0, d1 are its distances from the ends
//! of the side. With `s = beta / (alpha + beta)` along the event's edge and `w = 1 / (alpha + beta)`, which is larger
//! for what is nearer to the light, straight lines stay straight. So a face is a segment in (s, w), and clipping what
//! lies behind others is one upper envelope.

use glam::DVec3;
use llsr_intervals::{Beam, FaceColumns, FaceHit, FaceScratch, NarrowedFaces, Viewpoint, Wedge};

use super::envelope::Piece;
use super::events::Event;
use super::lanes::{Batch, Corners, Found, LANES, Rule, points};
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
    wedges: Vec<Wedge>,
    faces: Faces,
    batch: Batch,
    found: Found,
}

/// Blocks of a receiver that a group of events may meet; more than this are not worth a list.
const NARROW: usize = 256;

/// What part of a receiver a group of events looks at.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    narrowed: Option<NarrowedFaces>,
    spare: NarrowedFaces,
    /// Faces near all of the group's wedges, which lie in one plane.
    common: Faces,
    is_common: bool,
}

/// Faces that were found, and their corners.
#[derive(Clone, Debug, Default)]
struct Faces {
    hits: Vec<FaceHit>,
    columns: FaceColumns,
}

impl Part {
    /// All of it.
    pub(super) fn set_whole(&mut self) {
        self.is_common = false;
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

    /// The faces near `events`, VE events of one edge and of places of the light in one plane with it: the tree is asked once for all of
    /// them. All of the receiver if they do not fit together.
    pub(super) fn set_plane(
        &mut self,
        events: &[Event],
        receiver: &ShadowObject,
        scratch: &mut SectionScratch,
        statistics: &mut ShadowStatistics,
    ) {
        self.set_whole();
        if events.first().is_some_and(|event| misses(event, receiver)) {
            return;
        }
        let to_object = |p: DVec3| receiver.to_object.transform_point3(p);
        scratch.wedges.clear();
        for event in events {
            let [first, second, third] = event.points.map(to_object);
            let Some(wedge) = Wedge::cone(first, [second - first, third - first]) else {
                return;
            };
            scratch.wedges.push(wedge);
        }
        let tree = receiver.mesh.faces();
        let Some(wedge) = Wedge::around(&scratch.wedges, tree.direction_to_frame(DVec3::X).x.recip()) else {
            return;
        };
        let [Some(first), Some(last)] =
            [events.first(), events.last()].map(|event| event.map(|event| to_object(event.points[0])))
        else {
            return;
        };
        // What turns away from both ends of a line does so from all of it.
        if !events
            .iter()
            .all(|event| is_between(to_object(event.points[0]), [first, last]))
        {
            return;
        }
        let [Some(from), Some(to)] = [first, last].map(Viewpoint::at) else {
            return;
        };
        let viewers = [from, to];
        let viewers = &viewers[..if receiver.mesh.is_solid() { 2 } else { 0 }];
        self.common.hits.clear();
        let done = tree.query(&wedge, viewers, &mut scratch.tree, &mut self.common.hits);
        statistics.trees.nodes += done.nodes;
        statistics.trees.blocks += done.blocks;
        tree.columns(&self.common.hits, &mut self.common.columns);
        self.is_common = true;
    }
}

/// True if an event's plane does not cross the box around a receiver: of many receivers most are told so, long before their trees say it.
fn misses(event: &Event, receiver: &ShadowObject) -> bool {
    let [p, a, b] = event.points;
    let normal = (a - p).cross(b - p);
    let (low, high) = (receiver.bounds.min.as_dvec3(), receiver.bounds.max.as_dvec3());
    let (center, half) = (0.5 * (low + high), 0.5 * (high - low));
    // The box is in single precision. Numbers that are not finite compare as false.
    let room = 1e-5 * (half.length() + center.length() + p.length()) * normal.length();
    (center - p).dot(normal).abs() > half.dot(normal.abs()) + room
}

/// True if a point lies between two others, up to a part in 10^9 of their distance.
fn is_between(p: DVec3, [a, b]: [DVec3; 2]) -> bool {
    let (along, to) = (b - a, p - a);
    let room = 1e-9 * along.length();
    let t = to.dot(along) / along.length_squared();
    (0.0..=1.0).contains(&t) && to.distance(along * t) <= room
        || p.distance(a) <= room
        || p.distance(b) <= room
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
    if misses(event, receiver) || part.is_common && part.common.hits.is_empty() {
        return;
    }
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
        batch,
        found,
        ..
    } = scratch;
    let Faces { hits, columns } = if part.is_common {
        &part.common
    } else {
        faces.hits.clear();
        let done = match &part.narrowed {
            Some(narrowed) => tree.query_narrowed(narrowed, &wedge, walk, &mut faces.hits),
            None => tree.query(&wedge, viewers, walk, &mut faces.hits),
        };
        statistics.trees.nodes += done.nodes;
        statistics.trees.blocks += done.blocks;
        tree.columns(&faces.hits, &mut faces.columns);
        faces
    };
    if hits.is_empty() {
        return;
    }
    statistics.faces += hits.len();
    // Alpha and beta are the same in all affine frames.
    let frame = Frame::new(
        tree.to_frame(first),
        tree.direction_to_frame(d0),
        tree.direction_to_frame(d1),
    );
    let light = light.map(|p| tree.to_frame(p));
    let seen_from = solid.then_some(if is_edge { [light[0]; 2] } else { light });
    let rule = if is_edge { Rule::EDGE } else { Rule::VERTEX };
    for (number, hits) in hits.chunks(LANES).enumerate() {
        let Some(corners) = corners_at(columns, number * LANES) else {
            break;
        };
        batch.place(corners, &frame, rule, seen_from);
        if is_own {
            for (lane, hit) in hits.iter().enumerate() {
                if batch.is_near(lane) {
                    fix_own(&receiver.mesh, hit.face, event.own, is_edge, lane, batch);
                }
            }
        }
        batch.cut(rule, found);
        // Lanes without a face say anything.
        let [visible, hiding] = found.lanes().map(|lanes| lanes & u8::MAX >> (LANES - hits.len()));
        let mut left = visible | hiding;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            let face = hits[lane].face;
            if visible >> lane & 1 == 1 {
                let (s, w, slope) = found.visible(lane);
                pieces.push(Piece::ordered(s, w, slope, slot, face));
            }
            if hiding >> lane & 1 == 1 {
                pieces.push(Piece::new(found.hiding(lane), [Piece::HIDING; 2], slot, face));
            }
            left &= left - 1;
        }
    }
}

/// The corners of eight faces.
#[inline]
fn corners_at(columns: &FaceColumns, start: usize) -> Option<Corners<'_>> {
    let mut corners = [[&[0.0; LANES]; 3]; 3];
    for (corner, axes) in corners.iter_mut().enumerate() {
        for (axis, lanes) in axes.iter_mut().enumerate() {
            *lanes = columns.column(corner, axis).get(start..)?.first_chunk()?;
        }
    }
    Some(corners)
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

/// Gives to `show` the number of each of the visible `parts` (number of the piece, from, to) of an event and its two ends, in the
/// scene's frame.
///
/// A point is that of the event's edge at s, as far from the light as the inverse distance there says.
pub(super) fn each_part(
    event: &Event,
    pieces: &[Piece],
    parts: &[(u32, f64, f64)],
    mut show: impl FnMut(u32, [DVec3; 2]),
) {
    let sign = match event.source {
        ShadowSource::Edge { .. } => 1.0,
        // Gaps are no wedges and are walked by themselves.
        ShadowSource::Vertex { .. } | ShadowSource::Gap { .. } => -1.0,
    };
    let (mut s, mut w) = ([[0.0; LANES]; 2], [[1.0; LANES]; 2]);
    let mut ends = [[[0.0; LANES]; 3]; 2];
    for parts in parts.chunks(LANES) {
        for (lane, &(number, from, to)) in parts.iter().enumerate() {
            let piece = &pieces[number as usize];
            for (end, at) in [from, to].into_iter().enumerate() {
                s[end][lane] = at;
                w[end][lane] = piece.at(at);
            }
        }
        for end in 0..2 {
            points(event.points, sign, &s[end], &w[end], &mut ends[end]);
        }
        for (lane, part) in parts.iter().enumerate() {
            let [[ax, ay, az], [bx, by, bz]] = &ends;
            let [a, b] = [
                DVec3::new(ax[lane], ay[lane], az[lane]),
                DVec3::new(bx[lane], by[lane], bz[lane]),
            ];
            show(part.0, [a, b]);
        }
    }
}
