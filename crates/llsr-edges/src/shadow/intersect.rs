//! A run of events intersected with the receivers of its light and blocker.

use llsr_scene::{LightId, ObjectId, Triple};

use super::envelope::{Piece, SweepScratch, visible_parts};
use super::events::{Event, in_one_plane};
use super::scene::ShadowScene;
use super::section::{Part, SectionScratch, Target, cut, each_part};
use super::{ShadowEdge, ShadowSource, ShadowStatistics};

/// Fewer events than this are not looked at together.
const GROUP: usize = 4;

/// A light, a blocker and their receivers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pairing<'a> {
    pub(super) light: LightId,
    pub(super) blocker: ObjectId,
    /// In order.
    pub(super) receivers: &'a [ObjectId],
    /// Those that are new, if the edges on the others are there already.
    pub(super) added: Option<&'a [ObjectId]>,
}

/// The edges of a run of events.
#[derive(Clone, Debug, Default)]
pub(super) struct Chunk {
    edges: Vec<ShadowEdge>,
    /// Where the edges of each event end.
    ends: Vec<u32>,
    /// Edges of each event that were dropped since.
    dropped: Vec<u32>,
    statistics: ShadowStatistics,
}

/// Working memory of a job.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    section: SectionScratch,
    parts: Vec<Part>,
    sweep: SweepScratch,
    pieces: Vec<Piece>,
    /// Visible parts of an event: piece, from, to.
    shown: Vec<(u32, f64, f64)>,
    touched: Vec<Event>,
    is_touched: Vec<bool>,
    edges: Vec<ShadowEdge>,
    ends: Vec<u32>,
}

impl Chunk {
    /// The edges, those of one event together.
    pub(super) fn edges(&self) -> &[ShadowEdge] {
        &self.edges
    }

    /// Number of edges that were dropped and not computed again.
    pub(super) fn dropped(&self) -> usize {
        self.dropped.iter().map(|&n| n as usize).sum()
    }

    /// What the last update did.
    pub(super) fn statistics(&self) -> ShadowStatistics {
        self.statistics
    }

    /// Keeps the edges for which `keep` holds.
    pub(super) fn retain(&mut self, mut keep: impl FnMut(&ShadowEdge) -> bool) {
        let (mut start, mut kept) = (0, 0);
        for (end, dropped) in self.ends.iter_mut().zip(&mut self.dropped) {
            for i in start..*end as usize {
                if keep(&self.edges[i]) {
                    self.edges[kept] = self.edges[i];
                    kept += 1;
                } else {
                    *dropped += 1;
                }
            }
            start = *end as usize;
            *end = kept as u32;
        }
        self.edges.truncate(kept);
    }

    /// Computes the edges of `events`: all, or those of events that meet a new receiver.
    pub(super) fn update(
        &mut self,
        scene: &ShadowScene,
        pairing: Pairing<'_>,
        events: &[Event],
        scratch: &mut Scratch,
    ) {
        self.statistics = ShadowStatistics::default();
        match pairing.added {
            Some(added) => self.add(scene, pairing, added, events, scratch),
            None => {
                self.edges.clear();
                self.ends.clear();
                self.compute(scene, pairing, events, scratch);
                self.dropped.clear();
                self.dropped.resize(events.len(), 0);
            }
        }
        self.statistics.edges = self.edges.len();
    }

    fn add(
        &mut self,
        scene: &ShadowScene,
        pairing: Pairing<'_>,
        added: &[ObjectId],
        events: &[Event],
        scratch: &mut Scratch,
    ) {
        let only = Pairing {
            receivers: added,
            ..pairing
        };
        let mut is_touched = std::mem::take(&mut scratch.is_touched);
        let mut touched = std::mem::take(&mut scratch.touched);
        is_touched.clear();
        touched.clear();
        each_event(
            scene,
            only,
            events,
            scratch,
            &mut self.statistics,
            |event, pieces, _| {
                is_touched.push(!pieces.is_empty());
                if !pieces.is_empty() {
                    touched.push(*event);
                }
            },
        );
        if !touched.is_empty() {
            let old = (
                std::mem::replace(&mut self.edges, std::mem::take(&mut scratch.edges)),
                std::mem::replace(&mut self.ends, std::mem::take(&mut scratch.ends)),
            );
            self.edges.clear();
            self.ends.clear();
            self.compute(scene, pairing, &touched, scratch);
            let new = (std::mem::take(&mut self.edges), std::mem::take(&mut self.ends));
            let mut next = 0;
            let part = |(edges, ends): &(Vec<ShadowEdge>, Vec<u32>), i: usize| {
                let start = i.checked_sub(1).map_or(0, |before| ends[before]);
                edges[start as usize..ends[i] as usize].to_vec()
            };
            for (i, &is_touched) in is_touched.iter().enumerate() {
                if is_touched {
                    self.edges.extend(part(&new, next));
                    self.dropped[i] = 0;
                    next += 1;
                } else {
                    self.edges.extend(part(&old, i));
                }
                self.ends.push(self.edges.len() as u32);
            }
            (scratch.edges, scratch.ends) = old;
        }
        (scratch.is_touched, scratch.touched) = (is_touched, touched);
    }

    /// Appends the edges of events.
    fn compute(
        &mut self,
        scene: &ShadowScene,
        pairing: Pairing<'_>,
        events: &[Event],
        scratch: &mut Scratch,
    ) {
        let Self {
            edges,
            ends,
            statistics,
            ..
        } = self;
        let Some(source) = scene.light(pairing.light) else {
            ends.resize(ends.len() + events.len(), edges.len() as u32);
            return;
        };
        let Pairing {
            light,
            blocker,
            receivers,
            ..
        } = pairing;
        let mut found = 0;
        let mut shown = std::mem::take(&mut scratch.shown);
        each_event(
            scene,
            pairing,
            events,
            scratch,
            statistics,
            |event, pieces, sweep| {
                found += pieces.len();
                visible_parts(pieces, sweep, |number, from, to| shown.push((number, from, to)));
                each_part(event, pieces, &shown, |number, points| {
                    let piece = &pieces[number as usize];
                    if !points.iter().any(|&p| source.reaches(p)) {
                        return;
                    }
                    let [a, b] = points;
                    let segment = [a.as_vec3(), b.as_vec3()];
                    if segment[0] == segment[1] || !segment.iter().all(|p| p.is_finite()) {
                        return;
                    }
                    for kind in event.kinds.iter() {
                        edges.push(ShadowEdge {
                            kind,
                            segment,
                            triple: Triple {
                                light,
                                blocker,
                                receiver: receivers[piece.slot as usize],
                            },
                            source: event.source,
                            face: piece.face,
                        });
                    }
                });
                shown.clear();
                ends.push(edges.len() as u32);
            },
        );
        scratch.shown = shown;
        statistics.pieces += found;
    }
}

/// Gives to `then` each event, in order, with the pieces of all receivers in its wedge.
fn each_event(
    scene: &ShadowScene,
    pairing: Pairing<'_>,
    events: &[Event],
    scratch: &mut Scratch,
    statistics: &mut ShadowStatistics,
    mut then: impl FnMut(&Event, &[Piece], &mut SweepScratch),
) {
    let corner = |event: &Event| match event.source {
        ShadowSource::Edge { .. } => Some(event.points[0]),
        ShadowSource::Vertex { .. } | ShadowSource::Gap { .. } => None,
    };
    for group in events.chunk_by(|a, b| in_one_plane(a, b) || corner(a) == corner(b) && !b.is_flat()) {
        if group.len() > 1 && group[0].is_flat() {
            scratch.parts.resize_with(pairing.receivers.len(), Part::default);
            for (part, &id) in scratch.parts.iter_mut().zip(pairing.receivers) {
                match scene.object(id) {
                    Some(receiver) => part.set_plane(group, receiver, &mut scratch.section, statistics),
                    None => part.set_whole(),
                }
            }
            each_alone(scene, pairing, group, scratch, statistics, &mut then);
            continue;
        }
        let is_together = group.first().and_then(corner).is_some();
        let (mut rest, mut most) = (group, group.len());
        while !rest.is_empty() {
            let wide = rest.iter().take_while(|event| is_wide(event)).count();
            // Halved until its events lie near enough to each other.
            let mut length = if wide > 0 {
                wide
            } else {
                let narrow = rest.iter().take(most).take_while(|event| !is_wide(event));
                narrow.count()
            };
            let is_together = is_together && wide == 0;
            while !narrow(scene, pairing, &rest[..length], is_together, scratch, statistics) {
                if length <= GROUP {
                    narrow(scene, pairing, &rest[..length], false, scratch, statistics);
                    break;
                }
                length = (length / 2).max(GROUP);
            }
            most = (2 * length).max(GROUP);
            let (now, later) = rest.split_at(length);
            rest = later;
            each_alone(scene, pairing, now, scratch, statistics, &mut then);
        }
    }
}

/// Gives to `then` each event with the pieces in its wedge of the parts of the receivers that were chosen for all of them.
fn each_alone(
    scene: &ShadowScene,
    pairing: Pairing<'_>,
    events: &[Event],
    scratch: &mut Scratch,
    statistics: &mut ShadowStatistics,
    then: &mut impl FnMut(&Event, &[Piece], &mut SweepScratch),
) {
    for event in events {
        scratch.pieces.clear();
        for (slot, &id) in (0u32..).zip(pairing.receivers) {
            let Some(receiver) = scene.object(id) else {
                continue;
            };
            let target = Target {
                receiver,
                part: &scratch.parts[slot as usize],
                slot,
                is_own: id == pairing.blocker,
            };
            cut(
                event,
                target,
                &mut scratch.section,
                &mut scratch.pieces,
                statistics,
            );
        }
        then(event, &scratch.pieces, &mut scratch.sweep);
    }
}

/// Square of the cosine of the largest angle, about 7 degrees, at which an event's edge is seen from its corner if it is to be looked at
/// together with others: wedges of wider ones meet so much that a beam around several meets too much.
const NARROWEST: f64 = 0.985;

fn is_wide(event: &Event) -> bool {
    let [corner, a, b] = event.points;
    let (a, b) = (a - corner, b - corner);
    let along = a.dot(b);
    along < 0.0 || along * along < NARROWEST * a.length_squared() * b.length_squared()
}

/// Finds the parts of the receivers near `events`. False if these are too far from each other to be looked at together.
fn narrow(
    scene: &ShadowScene,
    pairing: Pairing<'_>,
    events: &[Event],
    is_together: bool,
    scratch: &mut Scratch,
    statistics: &mut ShadowStatistics,
) -> bool {
    scratch.parts.resize_with(pairing.receivers.len(), Part::default);
    let is_together = is_together && events.len() >= GROUP;
    for (part, &id) in scratch.parts.iter_mut().zip(pairing.receivers) {
        part.set_whole();
        let Some(receiver) = scene.object(id).filter(|_| is_together) else {
            continue;
        };
        if !part.set(events, receiver, &mut scratch.section, statistics) {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, DVec3, Quat, Vec3};
    use llsr_scene::{AreaLight, AreaShape, Light, LinearLight, Material, Mesh, Scene};
    use llsr_testkit::edges::bumpy_sphere;

    use super::super::events::{EventScratch, find_events};
    use super::super::scene::ShadowOptions;
    use super::*;

    /// Edges of all events of the bars above a sphere with bumps, computed together or one by one.
    fn edges(light: &Light, turned: Quat, together: bool) -> Vec<ShadowEdge> {
        let mut scene = Scene::new("bars above a sphere");
        let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        let sphere = scene.add_mesh(bumpy_sphere(60, 0.02, 3));
        scene.objects[sphere.index()].transform = Affine3A::from_quat(turned);
        let mut bars = Mesh::default();
        for i in 0..4u8 {
            let x = -0.9 + 0.5 * f32::from(i);
            bars.append(&Mesh::cuboid(
                "",
                Vec3::new(x, 1.5, -1.5),
                Vec3::new(x + 0.1, 1.6, 1.5),
                grey,
            ));
            bars.append(&Mesh::cuboid(
                "",
                Vec3::new(-1.5, 1.7, x),
                Vec3::new(1.5, 1.8, x + 0.1),
                grey,
            ));
        }
        let bars = scene.add_mesh(bars);
        scene.lights.push(light.clone());
        let (prepared, left_out) = ShadowScene::new(&scene, ShadowOptions::default());
        assert!(left_out.is_empty(), "all take part");
        let (light, blocker) = (LightId::from(0), prepared.object(bars).expect("there"));
        let mut events = Vec::new();
        let source = prepared.light(light).expect("there");
        find_events(source, blocker, &mut EventScratch::default(), &mut events);
        let pairing = Pairing {
            light,
            blocker: bars,
            receivers: &[sphere, bars],
            added: None,
        };
        let length = if together { events.len() } else { 1 };
        let (mut chunk, mut scratch) = (Chunk::default(), Scratch::default());
        let parts = events.chunks(length).flat_map(|events| {
            chunk.update(&prepared, pairing, events, &mut scratch);
            chunk.edges().to_vec()
        });
        parts.collect()
    }

    #[test]
    fn events_of_one_plane_give_what_each_gives_alone() {
        let along = |z: f64| {
            Light::Linear(LinearLight::new(
                "",
                DVec3::new(-0.4, 3.0, z),
                DVec3::new(0.5, 3.0, z),
                1.0,
            ))
        };
        let askew = Light::Linear(LinearLight::new(
            "",
            DVec3::new(-0.4, 3.0, 0.0),
            DVec3::new(0.5, 3.2, 0.3),
            1.0,
        ));
        // In one plane with the upper sides of the bars along x, and no line.
        let panel = Light::Area(AreaLight {
            name: String::new(),
            shape: AreaShape::Rect {
                corner: DVec3::new(-0.4, 1.8, 0.25),
                along: DVec3::X * 0.8,
                across: DVec3::Z * 0.3,
            },
            flux: 1.0,
            color: Vec3::ONE,
        });
        for light in [along(0.03), along(-0.7), askew, panel] {
            let turned = Quat::from_rotation_x(0.7);
            let (together, alone) = (edges(&light, turned, true), edges(&light, turned, false));
            assert!(alone.len() > 100, "{} edges of {light:?}", alone.len());
            assert!(together == alone, "{light:?}");
        }
    }
}
