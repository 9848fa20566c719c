//! How many of the places where a linear light comes into view or vanishes lie at a shadow edge: `shadow_coverage
//! [SEEDS [SEGMENTS [IMAGES [POINTS]]]]`, by default 20 100 3 100000.
//!
//! For random scenes of several kinds, against exact visibility:
//! - changes between lit and penumbra, and between penumbra and umbra, along random segments on the receivers, located by
//!   bisection;
//! - dense images: points on the receivers are lit, in penumbra or in umbra, and between any two neighbours of different
//!   class there has to be an edge. The other way round: at how many edges' middles does the class change.

use glam::Vec3;
use llsr_edges::{ShadowEdge, ShadowEdges, ShadowKind, ShadowOptions, ShadowScene};
use llsr_scene::{LightId, ObjectId, Scene};
use llsr_testkit::edges::{ClassImage, ShadowCoverage, ShadowScenes, class_image, shadow_coverage};

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

/// Edges by VE and EV events, the same with closing gaps (EEE), and the number of pairs that were looked at for these.
fn find(scene: &Scene) -> ([Vec<ShadowEdge>; 2], usize) {
    let (prepared, _) = ShadowScene::new(scene, ShadowOptions::default());
    let computed = ShadowEdges::compute(&prepared, prepared.all_triples());
    let without: Vec<ShadowEdge> = computed.iter().copied().collect();
    let mut with = without.clone();
    let mut pairs = 0;
    for light in prepared.lights() {
        let gaps = prepared.closing_gaps(light, 1 << 24);
        pairs += gaps.pairs;
        with.extend(gaps.edges);
    }
    ([without, with], pairs)
}

fn along_segments(kind: ShadowScenes, seeds: u32, segments: u32) {
    let mut all = [ShadowCoverage::default(); 2];
    let mut counts = [0; 3];
    for seed in 0..u64::from(seeds) {
        let scene = kind.build(seed);
        let (found, pairs) = find(&scene);
        for (edges, all) in found.iter().zip(&mut all) {
            let of = |light, receiver| edges_of(edges, light, receiver);
            all.add(&shadow_coverage(&scene, segments, seed, of, |_, _| ()));
        }
        let [without, with] = found.map(|edges| edges.len());
        for (count, more) in counts.iter_mut().zip([without, with - without, pairs]) {
            *count += more;
        }
    }
    let [outer, inner] = all[0].shares().map(|share| 100.0 * share);
    let [edges, gaps, pairs] = counts.map(|count| count / seeds.max(1) as usize);
    println!(
        "{:8} {edges:6}   {outer:7.3}% of {:6}   {inner:7.3}% of {:6}   {:7.3}%   {gaps}, {pairs}",
        format!("{kind:?}"),
        all[0].outer[1],
        all[0].inner[1],
        100.0 * all[1].shares()[1],
    );
}

fn dense_images(kind: ShadowScenes, images: u32, points: u32) {
    let mut all = [ClassImage::default(); 2];
    for seed in 0..u64::from(images) {
        let scene = kind.build(seed);
        for (edges, all) in find(&scene).0.iter().zip(&mut all) {
            let of = |light, receiver| edges_of(edges, light, receiver);
            all.add(&class_image(&scene, points, of, |_, _| ()));
        }
    }
    let [without, with] = all;
    let sum: usize = with.points.iter().sum();
    let share = with.points.map(|n| 100.0 * n as f64 / sum.max(1) as f64);
    let [outer, inner] = without.separated.shares().map(|share| 100.0 * share);
    let [outer_real, inner_real] = with.real.shares().map(|share| 100.0 * share);
    println!(
        "{:8} {sum:7}  {:4.1} {:4.1} {:4.1}   {outer:7.3}% of {:6}   {inner:7.3}% of {:6}   {:7.3}%   {outer_real:5.1}% {inner_real:5.1}%",
        format!("{kind:?}"),
        share[2],
        share[1],
        share[0],
        with.separated.outer[1],
        with.separated.inner[1],
        100.0 * with.separated.shares()[1],
    );
}

fn main() {
    let numbers: Vec<u32> = std::env::args().skip(1).filter_map(|x| x.parse().ok()).collect();
    let number = |i: usize, default: u32| numbers.get(i).copied().unwrap_or(default);
    let (seeds, segments) = (number(0, 20), number(1, 100));
    let (images, points) = (number(2, 3), number(3, 100_000));
    println!("Changes along segments that lie at an edge");
    println!("scene     edges   lit/penumbra        penumbra/umbra      with EEE   edges of EEE, of pairs");
    for kind in ShadowScenes::ALL {
        along_segments(kind, seeds, segments);
    }
    println!();
    println!("Neighbours of different class with an edge between them");
    println!(
        "scene     points  lit, penumbra, umbra (%)  lit/penumbra  penumbra/umbra  with EEE  edges at changes: outer, inner"
    );
    for kind in ShadowScenes::ALL {
        dense_images(kind, images, points);
    }
}
