//! Shadow edges, kept for each light and blocker.

use std::collections::BTreeMap;

use llsr_scene::{LightId, ObjectId, Triple};

use super::events::{Event, EventScratch, find_events};
use super::intersect::{Chunk, Pairing, Scratch};
use super::scene::ShadowScene;
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
    /// Receivers that are new since the edges were computed, in order.
    added: Vec<ObjectId>,
    chunks: Vec<Chunk>,
}

impl ShadowEdges {
    /// The shadow edges of `triples`; a triple that names a light or an object that takes no part has none.
    pub fn compute(scene: &ShadowScene, triples: impl IntoIterator<Item = Triple>) -> Self {
        let mut edges = Self::default();
        edges.add(scene, triples);
        edges
    }

    /// Adds triples; known ones cost nothing. Events that are there already are not computed again, and of their edges
    /// only those of events that meet a new receiver: it may hide others from a light and blocker that they share.
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
                let place = pair.added.partition_point(|&other| other < triple.receiver);
                pair.added.insert(place, triple.receiver);
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
            .flat_map(|pair| pair.chunks.iter().flat_map(|chunk| chunk.edges()))
    }

    /// The edges of one triple.
    pub fn of(&self, triple: Triple) -> impl Iterator<Item = &ShadowEdge> {
        self.pairs
            .get(&(triple.light, triple.blocker))
            .into_iter()
            .flat_map(|pair| pair.chunks.iter().flat_map(|chunk| chunk.edges()))
            .filter(move |edge| edge.triple.receiver == triple.receiver)
    }

    /// Number of edges.
    pub fn len(&self) -> usize {
        self.pairs
            .values()
            .flat_map(|pair| &pair.chunks)
            .map(|chunk| chunk.edges().len())
            .sum()
    }

    /// Edges of the present triples that [`drop_unimportant`](Self::drop_unimportant) has taken away and that have not been
    /// computed again.
    pub fn dropped(&self) -> usize {
        let chunks = self.pairs.values().flat_map(|pair| &pair.chunks);
        chunks.map(Chunk::dropped).sum()
    }

    /// There are no edges.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Keeps the edges for which `keep` holds, until they are computed again; returns the number dropped.
    pub(super) fn retain_edges(&mut self, mut keep: impl FnMut(&ShadowEdge) -> bool) -> usize {
        let before = self.len();
        for chunk in self.pairs.values_mut().flat_map(|pair| &mut pair.chunks) {
            chunk.retain(&mut keep);
        }
        before - self.len()
    }

    /// Computes what is stale.
    fn update(&mut self, scene: &ShadowScene) -> ShadowStatistics {
        let mut stale: Vec<_> = self
            .pairs
            .iter_mut()
            .filter(|(_, pair)| pair.events_stale || pair.edges_stale || !pair.added.is_empty())
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
                    pair.edges_stale = true;
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
                edges_stale,
                added,
                chunks,
                ..
            } = &mut **pair;
            statistics.events += events.len();
            chunks.resize_with(events.len().div_ceil(CHUNK), Chunk::default);
            let pairing = Pairing {
                light: key.0,
                blocker: key.1,
                receivers,
                added: (!*edges_stale).then_some(&**added),
            };
            for (events, chunk) in events.chunks(CHUNK).zip(chunks) {
                jobs.push((pairing, events, chunk));
            }
        }
        each(&mut jobs, |(pairing, events, chunk), scratch: &mut Scratch| {
            chunk.update(scene, *pairing, events, scratch);
        });
        for (_, _, chunk) in &jobs {
            statistics.add(&chunk.statistics());
        }
        drop(jobs);
        for (_, pair) in stale {
            pair.edges_stale = false;
            pair.added.clear();
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
