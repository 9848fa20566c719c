//! How many of the places where a linear light comes into view or vanishes lie at a shadow edge: `shadow_coverage
//! [SEEDS [SEGMENTS]]`.
//!
//! For random scenes of several kinds: changes between lit and penumbra, and between penumbra and umbra, along random
//! segments on the receivers, located by bisection over exact visibility, against the edges found.

use glam::Vec3;
use llsr_edges::{ShadowEdges, ShadowKind, ShadowOptions, ShadowScene};
use llsr_scene::{LightId, ObjectId, Scene};
use llsr_testkit::edges::{ShadowCoverage, ShadowScenes, shadow_coverage};

fn edges_of(edges: &ShadowEdges, light: LightId, receiver: ObjectId) -> [Vec<[Vec3; 2]>; 2] {
    let of = |other: ShadowKind| {
        edges
            .iter()
            .filter(|e| e.triple.light == light && e.triple.receiver == receiver && e.kind != other)
            .map(|e| e.segment)
            .collect()
    };
    [of(ShadowKind::Umbral), of(ShadowKind::Penumbral)]
}

fn measure(scene: &Scene, segments: u32, seed: u64, show: bool) -> (ShadowCoverage, usize) {
    let (prepared, _) = ShadowScene::new(scene, ShadowOptions::default());
    let edges = ShadowEdges::compute(&prepared, prepared.all_triples());
    let coverage = shadow_coverage(
        scene,
        segments,
        seed,
        |light, receiver| edges_of(&edges, light, receiver),
        |receiver, change| {
            if show {
                println!("  lost on {receiver:?}: {change:?}");
            }
        },
    );
    (coverage, edges.len())
}

fn main() {
    let mut numbers = std::env::args().skip(1).filter_map(|x| x.parse::<u32>().ok());
    let (seeds, segments) = (numbers.next().unwrap_or(20), numbers.next().unwrap_or(100));
    let show = numbers.next().is_some();
    println!("scene       edges   lit/penumbra        penumbra/umbra");
    for kind in ShadowScenes::ALL {
        let (mut all, mut edges) = (ShadowCoverage::default(), 0);
        for seed in 0..u64::from(seeds) {
            let (coverage, found) = measure(&kind.build(seed), segments, seed, show);
            all.add(&coverage);
            edges += found;
        }
        let [outer, inner] = all.shares().map(|share| 100.0 * share);
        println!(
            "{:10} {:6}   {outer:7.3}% of {:6}   {inner:7.3}% of {:6}",
            format!("{kind:?}"),
            edges / seeds.max(1) as usize,
            all.outer[1],
            all.inner[1]
        );
    }
}
