//! How many of the places where a linear light comes into view or vanishes lie at a shadow edge: `shadow_coverage
//! [SEEDS [SEGMENTS]]`.
//!
//! For random scenes of several kinds: changes between lit and penumbra, and between penumbra and umbra, along random
//! segments on the receivers, located by bisection over exact visibility, against the edges found.

use glam::Vec3;
use llsr_edges::{ShadowEdge, ShadowEdges, ShadowKind, ShadowOptions, ShadowScene};
use llsr_scene::{LightId, ObjectId, Scene};
use llsr_testkit::edges::{ShadowCoverage, ShadowScenes, shadow_coverage};

fn edges_of(edges: &[ShadowEdge], light: LightId, receiver: ObjectId) -> [Vec<[Vec3; 2]>; 2] {
    let of = |other: ShadowKind| {
        edges
            .iter()
            .filter(|e| e.triple.light == light && e.triple.receiver == receiver && e.kind != other)
            .map(|e| e.segment)
            .collect()
    };
    [of(ShadowKind::Umbral), of(ShadowKind::Penumbral)]
}

/// Coverage by VE and EV events, the same with closing gaps (EEE), numbers of edges, and pairs looked at.
fn measure(scene: &Scene, segments: u32, seed: u64, show: bool) -> ([ShadowCoverage; 2], [usize; 3]) {
    let (prepared, _) = ShadowScene::new(scene, ShadowOptions::default());
    let mut edges: Vec<ShadowEdge> = ShadowEdges::compute(&prepared, prepared.all_triples())
        .iter()
        .copied()
        .collect();
    let mut counts = [edges.len(), 0, 0];
    let coverage = [false, true].map(|with_gaps| {
        if with_gaps {
            for light in prepared.lights() {
                let gaps = prepared.closing_gaps(light, 1 << 24);
                counts[1] += gaps.edges.len();
                counts[2] += gaps.pairs;
                edges.extend(gaps.edges);
            }
        }
        shadow_coverage(
            scene,
            segments,
            seed,
            |light, receiver| edges_of(&edges, light, receiver),
            |receiver, change| {
                if show && with_gaps {
                    println!("  lost on {receiver:?}: {change:?}");
                }
            },
        )
    });
    (coverage, counts)
}

fn main() {
    let mut numbers = std::env::args().skip(1).filter_map(|x| x.parse::<u32>().ok());
    let (seeds, segments) = (numbers.next().unwrap_or(20), numbers.next().unwrap_or(100));
    let show = numbers.next().is_some();
    println!(
        "scene       edges   lit/penumbra        penumbra/umbra         with EEE   edges of EEE, of pairs"
    );
    for kind in ShadowScenes::ALL {
        let (mut all, mut counts) = ([ShadowCoverage::default(); 2], [0; 3]);
        for seed in 0..u64::from(seeds) {
            let (coverage, found) = measure(&kind.build(seed), segments, seed, show);
            for k in 0..2 {
                all[k].add(&coverage[k]);
            }
            for k in 0..3 {
                counts[k] += found[k];
            }
        }
        let [outer, inner] = all[0].shares().map(|share| 100.0 * share);
        let counts = counts.map(|count| count / seeds.max(1) as usize);
        println!(
            "{:10} {:6}   {outer:7.3}% of {:6}   {inner:7.3}% of {:6}   {:7.3}%   {}, {}",
            format!("{kind:?}"),
            counts[0],
            all[0].outer[1],
            all[0].inner[1],
            100.0 * all[1].shares()[1],
            counts[1],
            counts[2],
        );
    }
}
