//! Shadow events: the wedges in which the visible part of a light changes its kind.
//!
//! A VE event is the plane through a corner of the light and a silhouette edge of the blocker, an EV event that
//! through a side of the light and a vertex of the blocker (Bala et al. 2003, section 6.3 and appendix A). What is
//! seen of a line changes between all and part only in such events; see `corner` for why.

use std::cmp::Ordering;

use glam::DVec3;
use llsr_intervals::{OrientedPlane, Viewpoint};
use llsr_scene::NO_FACE;

use super::corner::{CornerScratch, corner_events};
use super::light::ShadowLight;
use super::mesh::ShadowMesh;
use super::scene::{ShadowObject, is_outside};
use super::{ShadowKind, ShadowSource};
use crate::EdgeScratch;

/// What changes across an event.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Kinds(u8);

impl Kinds {
    pub(super) const HARD: Self = Self(1);
    pub(super) const UMBRAL: Self = Self(2);
    pub(super) const PENUMBRAL: Self = Self(4);
    pub(super) const BOTH: Self = Self(6);

    /// The kinds, one by one.
    pub(super) fn iter(self) -> impl Iterator<Item = ShadowKind> {
        [
            (Self::HARD, ShadowKind::Hard),
            (Self::UMBRAL, ShadowKind::Umbral),
            (Self::PENUMBRAL, ShadowKind::Penumbral),
        ]
        .into_iter()
        .filter(move |(bit, _)| self.0 & bit.0 != 0)
        .map(|(_, kind)| kind)
    }
}

/// An event of one light and one blocker, in the scene's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Event {
    pub(super) kinds: Kinds,
    pub(super) source: ShadowSource,
    /// VE: the light's corner and the ends of the edge. EV: the blocker's vertex and the part of the light's side.
    pub(super) points: [DVec3; 3],
    /// Vertices of the blocker that lie in the event's plane: the edge's ends, or twice the vertex.
    pub(super) own: [u32; 2],
}

impl Event {
    /// The edge of a VE event in whose plane all of the light lies.
    fn flat_edge(&self) -> Option<u32> {
        match self.source {
            ShadowSource::Edge { edge, .. } if self.kinds == Kinds::BOTH => Some(edge),
            _ => None,
        }
    }

    /// Is it such an event?
    pub(super) fn is_flat(&self) -> bool {
        self.flat_edge().is_some()
    }
}

/// Both are flat events of the same edge.
pub(super) fn in_one_plane(a: &Event, b: &Event) -> bool {
    a.is_flat() && a.flat_edge() == b.flat_edge()
}

/// Where on a line, between its ends, an event begins that contains it.
const ALONG: [f64; 3] = [0.25, 0.5, 0.75];

/// Working memory of the search for events.
#[derive(Clone, Debug, Default)]
pub(super) struct EventScratch {
    edges: EdgeScratch,
    found: Vec<u32>,
    vertices: Vec<u32>,
    /// A bit for each vertex, all zero between calls.
    marks: Vec<u64>,
}

/// Appends the events of a light and a blocker.
pub(super) fn find_events(
    light: &ShadowLight,
    blocker: &ShadowObject,
    scratch: &mut EventScratch,
    events: &mut Vec<Event>,
) {
    let begin = events.len();
    let mesh = &*blocker.mesh;
    let corners: Vec<DVec3> = light
        .corners()
        .iter()
        .map(|&p| blocker.to_object.transform_point3(p))
        .collect();
    let views: Option<Vec<Viewpoint>> = corners.iter().map(|&p| Viewpoint::at(p)).collect();
    let Some(views) = views else { return };
    // Along a concave edge both sides are inside the solid, where nothing is lit.
    let convex_only = mesh.is_solid() && is_outside(blocker, &corners);
    let keep = |edge: u32| !convex_only || mesh.is_convex(edge);
    for (index, view) in views.iter().enumerate() {
        scratch.found.clear();
        mesh.edges()
            .silhouettes(view, &mut scratch.edges, &mut scratch.found);
        scratch.found.extend(mesh.edges().boundaries());
        scratch.found.sort_unstable();
        let corner = light.corners()[index];
        let start = events.len();
        in_runs(
            &scratch.found,
            events,
            |run, events: &mut Vec<Event>, _: &mut ()| {
                for &edge in run.iter().filter(|&&edge| keep(edge)) {
                    let neighbors = light
                        .neighbors(index)
                        .map(|p| blocker.to_object.transform_point3(p));
                    let Some(kinds) = edge_kinds(mesh, edge, corners[index], neighbors) else {
                        continue;
                    };
                    let own = mesh.edges().edge(edge).vertices;
                    let [a, b] = own.map(|v| blocker.to_world.transform_point3(mesh.position(v)));
                    events.push(Event {
                        kinds,
                        source: ShadowSource::Edge {
                            corner: index as u32,
                            edge,
                        },
                        points: [corner, a, b],
                        own,
                    });
                }
            },
        );
        sort_by_direction(&mut events[start..]);
        // All of a line in one plane with an edge throws the same shadow, and parts of it farther than its ends.
        if index == 0 && light.sides() == 1 {
            let [from, to] = light.side(0);
            let end = events.len();
            for t in ALONG {
                for i in start..end {
                    let Event { kinds, points, .. } = events[i];
                    if kinds == Kinds::BOTH {
                        let points = [from + (to - from) * t, points[1], points[2]];
                        events.push(Event { points, ..events[i] });
                    }
                }
            }
        }
    }
    if light.sides() == 0 {
        return;
    }
    gather_flat(&mut events[begin..]);
    // At a vertex where an event begins some edge is a silhouette for some place of the light.
    scratch.found.clear();
    mesh.edges()
        .possible_silhouettes(&views, &mut scratch.edges, &mut scratch.found);
    scratch.found.extend(mesh.edges().boundaries());
    scratch
        .marks
        .resize(mesh.edges().positions().len().div_ceil(64), 0);
    for &edge in scratch.found.iter().filter(|&&edge| keep(edge)) {
        for v in mesh.edges().edge(edge).vertices {
            scratch.marks[v as usize / 64] |= 1 << (v % 64);
        }
    }
    scratch.vertices.clear();
    for (word, mark) in scratch.marks.iter_mut().enumerate() {
        let mut left = std::mem::take(mark);
        while left != 0 {
            scratch.vertices.push(64 * word as u32 + left.trailing_zeros());
            left &= left - 1;
        }
    }
    scratch.marks.clear();
    for side in 0..light.sides() {
        let ends = light.side(side);
        let local = ends.map(|p| blocker.to_object.transform_point3(p));
        let inner = light
            .opposite(side)
            .map(|p| blocker.to_object.transform_point3(p));
        let event = |vertex: u32, kinds: Kinds, [from, to]: [f64; 2]| {
            let at = |t: f64| ends[0] + (ends[1] - ends[0]) * t;
            let place = blocker.to_world.transform_point3(mesh.position(vertex));
            Event {
                kinds,
                source: ShadowSource::Vertex {
                    side: side as u32,
                    vertex,
                },
                points: [place, at(from), at(to)],
                own: [vertex; 2],
            }
        };
        in_runs(
            &scratch.vertices,
            events,
            |run, events: &mut Vec<Event>, scratch: &mut CornerScratch| {
                for &vertex in run {
                    let add = |kinds, part| events.push(event(vertex, kinds, part));
                    corner_events(mesh, vertex, local, inner, scratch, add);
                }
            },
        );
    }
}

/// Puts the flat events behind the others, those of one edge together, where the first of them was.
fn gather_flat(events: &mut [Event]) {
    let mut first: Vec<(u32, u32)> = (0u32..)
        .zip(&*events)
        .filter_map(|(place, event)| Some((event.flat_edge()?, place)))
        .collect();
    if first.is_empty() {
        return;
    }
    first.sort_unstable();
    first.dedup_by_key(|&mut (edge, _)| edge);
    let place = |edge| {
        first
            .binary_search_by_key(&edge, |&(edge, _)| edge)
            .map(|at| first[at].1)
    };
    events.sort_by_cached_key(|event| event.flat_edge().and_then(|edge| place(edge).ok()));
}

/// Puts events of one corner of the light in an order in which those that follow each other lie near each other as the
/// corner sees them, and so meet the same parts of a receiver.
fn sort_by_direction(events: &mut [Event]) {
    let key = |event: &Event| {
        let [corner, a, b] = event.points;
        let d = 0.5 * (a + b) - corner;
        let d = d / d.abs().element_sum();
        // The octahedron unfolded: both halves side by side.
        let (x, y) = (0.5 * (d.x + d.z), 0.5 * (d.x - d.z));
        let half = u64::from(d.y > 0.0) << 32;
        let steps = |x: f64| spread(((x + 0.5) * 65535.0) as u16);
        half | u64::from(steps(x)) | u64::from(steps(y)) << 1
    };
    events.sort_by_cached_key(key);
}

/// The bits of a number at even places.
fn spread(x: u16) -> u32 {
    let mut x = u32::from(x);
    for (shift, mask) in [
        (8, 0x00ff_00ff),
        (4, 0x0f0f_0f0f),
        (2, 0x3333_3333),
        (1, 0x5555_5555),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

/// Appends to `out` what `f` makes of the items, in order; with the `rayon` feature long lists are cut into runs for all
/// threads.
fn in_runs<T: Send, S: Default>(
    items: &[u32],
    out: &mut Vec<T>,
    f: impl Fn(&[u32], &mut Vec<T>, &mut S) + Sync,
) {
    #[cfg(feature = "rayon")]
    if items.len() > RUN {
        use rayon::prelude::*;
        let parts: Vec<Vec<T>> = items
            .par_chunks(RUN)
            .map_init(S::default, |scratch, run| {
                let mut part = Vec::new();
                f(run, &mut part, scratch);
                part
            })
            .collect();
        out.extend(parts.into_iter().flatten());
        return;
    }
    f(items, out, &mut S::default());
}

/// Edges or vertices that are worth a job of their own.
#[cfg(feature = "rayon")]
const RUN: usize = 2048;

/// What changes across the plane through a light's corner and a silhouette edge, or nothing.
///
/// The plane has to touch the light: its other corners are all on one side. If the blocker is on that side too,
/// the corner is the last that comes into view; otherwise it is the first that vanishes. A light that lies in the
/// plane vanishes at once.
fn edge_kinds(
    mesh: &ShadowMesh,
    edge: u32,
    corner: DVec3,
    neighbors: impl Iterator<Item = DVec3>,
) -> Option<Kinds> {
    let edge = mesh.edges().edge(edge);
    let [a, b] = edge.vertices.map(|v| mesh.position(v));
    let plane = OrientedPlane::new([corner, a, b]);
    let mut light = Ordering::Equal;
    let mut is_point = true;
    for neighbor in neighbors {
        is_point = false;
        let side = plane.side(neighbor);
        if light == Ordering::Equal {
            light = side;
        } else if side != Ordering::Equal && side != light {
            return None;
        }
    }
    if is_point {
        return Some(Kinds::HARD);
    }
    if light == Ordering::Equal {
        return Some(Kinds::BOTH);
    }
    let blocker = edge
        .faces
        .iter()
        .filter(|&&face| face != NO_FACE)
        .filter_map(|&face| mesh.opposite(face, edge.vertices))
        .map(|v| plane.side(mesh.position(v)))
        .find(|&side| side != Ordering::Equal);
    Some(if blocker == Some(light) {
        Kinds::UMBRAL
    } else {
        // A face seen edge-on blocks those behind the plane through it, and nobody before it.
        Kinds::PENUMBRAL
    })
}
