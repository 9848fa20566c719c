//! Shadow edges, kept for each light and blocker.

use std::collections::BTreeMap;

use llsr_scene::{LightId, ObjectId, Triple};

use super::envelope::{Piece, SweepScratch, visible_parts};
use super::events::{Event, EventScratch, find_events};
use super::scene::ShadowScene;
use super::section::{SectionScratch, cut, point_of};
use super::{ShadowEdge, ShadowStatistics};

/// Events intersected by one job. A fixed number, so that the result does not depend on the number of threads.
const CHUNK: usize = 16;

/// The shadow edges of a set of triples.
///
/// Triples come from outside: from a shader that found out which object shades which, or from
/// [`ShadowScene::all_triples`]. After a move only what Bala et al. (2003, section 6.5) name is computed again: the
/// events of a light and a blocker if either moved, and the edges of all receivers that share them; if a receiver
/// moved, the edges of all receivers that share a light and a blocker with it.
#[derive(Clone, Debug, Default)]
pub struct ShadowEdges {
    pairs: BTreeMap<(LightId, ObjectId), Pair>,
}

/// A light and a blocker.
#[derive(Clone, Debug, Default)]
struct Pair {
    /// In order.
    receivers: Vec<ObjectId>,
    events: Vec<Event>,
    events_stale: bool,
    edges_stale: bool,
    chunks: Vec<Chunk>,
}

/// What a run of events gave.
#[derive(Clone, Debug, Default)]
struct Chunk {
    edges: Vec<ShadowEdge>,
    /// Edges that were dropped since.
    dropped: usize,
    statistics: ShadowStatistics,
}

/// Working memory of a job.
#[derive(Debug, Default)]
struct Scratch {
    section: SectionScratch,
    sweep: SweepScratch,
    pieces: Vec<Piece>,
}

impl ShadowEdges {
    /// The shadow edges of `triples`; a triple that names a light or an object that takes no part has none.
    pub fn compute(scene: &ShadowScene, triples: impl IntoIterator<Item = Triple>) -> Self {
        let mut edges = Self::default();
        edges.add(scene, triples);
        edges
    }

    /// Adds triples; known ones cost nothing. A new receiver may hide another from a light and blocker that both
    /// share, so all edges of these are computed again; events that are there already are not.
    pub fn add(
        &mut self,
        scene: &ShadowScene,
        triples: impl IntoIterator<Item = Triple>,
    ) -> ShadowStatistics {
        for triple in triples {
            let pair = self
                .pairs
                .entry((triple.light, triple.blocker))
                .or_insert_with(|| Pair {
                    events_stale: true,
                    ..Pair::default()
                });
            if let Err(place) = pair.receivers.binary_search(&triple.receiver) {
                pair.receivers.insert(place, triple.receiver);
                pair.edges_stale = true;
            }
        }
        self.update(scene)
    }

    /// Keeps the triples for which `keep` holds, and computes again what the others hid.
    pub fn retain(&mut self, scene: &ShadowScene, mut keep: impl FnMut(Triple) -> bool) -> ShadowStatistics {
        self.pairs.retain(|&(light, blocker), pair| {
            let before = pair.receivers.len();
            pair.receivers.retain(|&receiver| {
                keep(Triple {
                    light,
                    blocker,
                    receiver,
                })
            });
            pair.edges_stale |= pair.receivers.len() != before;
            !pair.receivers.is_empty()
        });
        self.update(scene)
    }

    /// Computes again what a moved object changes: call it after [`ShadowScene::move_object`].
    pub fn object_moved(&mut self, scene: &ShadowScene, object: ObjectId) -> ShadowStatistics {
        self.moved(scene, &[], &[object])
    }

    /// Computes again what a moved light changes: call it after [`ShadowScene::move_light`].
    pub fn light_moved(&mut self, scene: &ShadowScene, light: LightId) -> ShadowStatistics {
        self.moved(scene, &[light], &[])
    }

    /// Computes again what moved lights and objects change, each pair of light and blocker at most once.
    pub fn moved(
        &mut self,
        scene: &ShadowScene,
        lights: &[LightId],
        objects: &[ObjectId],
    ) -> ShadowStatistics {
        for ((light, blocker), pair) in &mut self.pairs {
            if lights.contains(light) || objects.contains(blocker) {
                pair.events_stale = true;
                pair.edges_stale = true;
            }
            pair.edges_stale |= objects.iter().any(|o| pair.receivers.binary_search(o).is_ok());
        }
        self.update(scene)
    }

    /// All triples, in order.
    pub fn triples(&self) -> impl Iterator<Item = Triple> {
        self.pairs.iter().flat_map(|(&(light, blocker), pair)| {
            pair.receivers.iter().map(move |&receiver| Triple {
                light,
                blocker,
                receiver,
            })
        })
    }

    /// All edges, those of a light and a blocker together.
    pub fn iter(&self) -> impl Iterator<Item = &ShadowEdge> {
        self.pairs
            .values()
            .flat_map(|pair| pair.chunks.iter().flat_map(|chunk| &chunk.edges))
    }

    /// The edges of one triple.
    pub fn of(&self, triple: Triple) -> impl Iterator<Item = &ShadowEdge> {
        self.pairs
            .get(&(triple.light, triple.blocker))
            .into_iter()
            .flat_map(|pair| pair.chunks.iter().flat_map(|chunk| &chunk.edges))
            .filter(move |edge| edge.triple.receiver == triple.receiver)
    }

    /// Number of edges.
    pub fn len(&self) -> usize {
        self.pairs
            .values()
            .flat_map(|pair| &pair.chunks)
            .map(|chunk| chunk.edges.len())
            .sum()
    }

    /// Edges of the present triples that [`drop_unimportant`](Self::drop_unimportant) has taken away and that have not been
    /// computed again.
    pub fn dropped(&self) -> usize {
        let chunks = self.pairs.values().flat_map(|pair| &pair.chunks);
        chunks.map(|chunk| chunk.dropped).sum()
    }

    /// There are no edges.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Keeps the edges for which `keep` holds, until they are computed again; returns the number dropped.
    pub(super) fn retain_edges(&mut self, mut keep: impl FnMut(&ShadowEdge) -> bool) -> usize {
        let before = self.len();
        for chunk in self.pairs.values_mut().flat_map(|pair| &mut pair.chunks) {
            let all = chunk.edges.len();
            chunk.edges.retain(&mut keep);
            chunk.dropped += all - chunk.edges.len();
        }
        before - self.len()
    }

    /// Computes what is stale.
    fn update(&mut self, scene: &ShadowScene) -> ShadowStatistics {
        let mut stale: Vec<_> = self
            .pairs
            .iter_mut()
            .filter(|(_, pair)| pair.edges_stale)
            .collect();
        each(
            &mut stale,
            |((light, blocker), pair), scratch: &mut EventScratch| {
                if pair.events_stale {
                    pair.events.clear();
                    if let (Some(light), Some(blocker)) = (scene.light(*light), scene.object(*blocker)) {
                        find_events(light, blocker, scratch, &mut pair.events);
                    }
                    pair.events_stale = false;
                }
            },
        );
        let mut statistics = ShadowStatistics {
            pairs: stale.len(),
            ..ShadowStatistics::default()
        };
        let mut jobs = Vec::new();
        for (key, pair) in &mut stale {
            let Pair {
                receivers,
                events,
                chunks,
                ..
            } = &mut **pair;
            statistics.events += events.len();
            chunks.resize_with(events.len().div_ceil(CHUNK), Chunk::default);
            for (events, chunk) in events.chunks(CHUNK).zip(chunks) {
                jobs.push((**key, &*receivers, events, chunk));
            }
        }
        each(
            &mut jobs,
            |(pair, receivers, events, chunk), scratch: &mut Scratch| {
                run(scene, *pair, receivers, events, chunk, scratch);
            },
        );
        for (_, _, _, chunk) in &jobs {
            statistics.add(&chunk.statistics);
        }
        drop(jobs);
        for (_, pair) in stale {
            pair.edges_stale = false;
        }
        statistics
    }
}

/// Calls `f` on each item with working memory; on all threads with the `rayon` feature.
fn each<T: Send, S: Default>(items: &mut [T], f: impl Fn(&mut T, &mut S) + Sync) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        items
            .par_iter_mut()
            .for_each_init(S::default, |scratch, item| f(item, scratch));
    }
    #[cfg(not(feature = "rayon"))]
    {
        let mut scratch = S::default();
        for item in items {
            f(item, &mut scratch);
        }
    }
}

/// Intersects a run of events with all receivers.
fn run(
    scene: &ShadowScene,
    (light, blocker): (LightId, ObjectId),
    receivers: &[ObjectId],
    events: &[Event],
    chunk: &mut Chunk,
    scratch: &mut Scratch,
) {
    chunk.edges.clear();
    chunk.dropped = 0;
    chunk.statistics = ShadowStatistics::default();
    let Some(source) = scene.light(light) else { return };
    for event in events {
        scratch.pieces.clear();
        for (slot, &id) in (0u32..).zip(receivers) {
            let Some(receiver) = scene.object(id) else {
                continue;
            };
            cut(
                event,
                receiver,
                slot,
                id == blocker,
                &mut scratch.section,
                &mut scratch.pieces,
                &mut chunk.statistics,
            );
        }
        chunk.statistics.pieces += scratch.pieces.len();
        let pieces = &scratch.pieces;
        visible_parts(pieces, &mut scratch.sweep, |number, from, to| {
            let piece = &pieces[number as usize];
            let ends = [from, to].map(|s| point_of(event, s, piece.at(s)));
            if !ends.iter().any(|&p| source.reaches(p)) {
                return;
            }
            let segment = ends.map(|p| p.as_vec3());
            if segment[0] == segment[1] || !segment.iter().all(|p| p.is_finite()) {
                return;
            }
            for kind in event.kinds.iter() {
                chunk.edges.push(ShadowEdge {
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
    }
    chunk.statistics.edges = chunk.edges.len();
}
