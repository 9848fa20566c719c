//! How fast silhouettes are found, against a linear scan and the tree of 2003.

use std::path::PathBuf;
use std::time::Instant;

use llsr_edges::{EdgeOptions, EdgeScratch, MeshEdges};
use llsr_intervals::{PlainTree, Plane, PlaneScan, QueryStatistics, TreeOptions, Viewpoint};
use llsr_scene::Mesh;
use llsr_testkit::edges::{bumpy_sphere, cube_cloud, random_roofs};

use super::{meshes, name, viewpoint, views};

/// Meshes and files of at least this many triangles are timed.
const LARGE: usize = 50_000;

pub(super) fn run(files: &[PathBuf], count: usize) -> Result<(), String> {
    println!(
        "| mesh | triangles | pairs of faces | silhouette edges | tree ms | scan ms | tree / scan | without sharp high, ms | \
         tree of 2003, ms | nodes | blocks of 64 | exact tests | build s |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    );
    for path in files {
        let meshes = meshes(path);
        if meshes.iter().map(|mesh| mesh.triangles.len()).sum::<usize>() >= LARGE {
            measure(&name(path), &meshes, count)?;
        }
    }
    measure("smooth sphere", &[bumpy_sphere(465, 0.0, 1)], count)?;
    measure("bumpy sphere", &[bumpy_sphere(465, 0.005, 1)], count)?;
    measure(
        "650,000 roofs with random normals",
        &[random_roofs(650_000, 0.01, 1)],
        count,
    )?;
    measure(
        "a million small cubes",
        &[cube_cloud(1_000_000, 0.002, 1)],
        count.min(20),
    )
}

/// All meshes of a file together: each row of the table is their sum.
fn measure(name: &str, meshes: &[Mesh], count: usize) -> Result<(), String> {
    let mut rows: Vec<Row> = Vec::new();
    for mesh in meshes {
        rows.push(Row::of(mesh, count)?);
    }
    let sum = |value: &dyn Fn(&Row) -> f64| rows.iter().map(value).sum::<f64>();
    let each = count as f64;
    let (tree, scan) = (sum(&|row| row.tree), sum(&|row| row.scan));
    println!(
        "| {name} | {} | {} | {:.0} | {tree:.3} | {scan:.3} | {:.2} | {:.3} | {:.3} | {:.0} | {:.0} | {:.1} | {:.2} |",
        sum(&|row| row.triangles as f64),
        sum(&|row| row.pairs as f64),
        sum(&|row| row.found as f64) / each,
        tree / scan,
        sum(&|row| row.not_high),
        sum(&|row| row.plain),
        sum(&|row| row.did.nodes as f64) / each,
        sum(&|row| row.did.blocks as f64) / each,
        sum(&|row| row.did.exact as f64) / each,
        sum(&|row| row.build)
    );
    Ok(())
}

/// What was measured on one mesh: times of one view in milliseconds, medians over the views.
struct Row {
    triangles: usize,
    pairs: u32,
    tree: f64,
    scan: f64,
    not_high: f64,
    plain: f64,
    /// Seconds, all threads.
    build: f64,
    /// Over all views.
    found: usize,
    did: QueryStatistics,
}

impl Row {
    fn of(mesh: &Mesh, count: usize) -> Result<Self, String> {
        let prepare = |sharp_high| {
            let tree = TreeOptions {
                sharp_high,
                ..TreeOptions::default()
            };
            let options = EdgeOptions {
                tree,
                ..EdgeOptions::default()
            };
            MeshEdges::new(mesh, options).map_err(|error| format!("mesh '{}': {error}", mesh.name))
        };
        let start = Instant::now();
        let edges = prepare(true)?;
        let build = start.elapsed().as_secs_f64();
        let not_high = prepare(false)?;
        let pairs = edges.boundaries().start;
        let planes = |item: u32| {
            let edge = edges.edge(item);
            let [a, b] = edge.faces.map(|face| Plane::of(edges.corners(face)));
            Some([a?, if edge.flipped { b?.flipped() } else { b? }])
        };
        let bounds = edges.bounds();
        let center = bounds.center().as_dvec3();
        let radius = (bounds.max.as_dvec3() - center).length() * (1.0 + 1e-6);
        let scan = PlaneScan::new(pairs, center, radius, planes);
        // The tree of 2003 is of edges with a plane on both sides; few have none.
        let steady: Vec<u32> = (0..pairs).filter(|&item| planes(item).is_some()).collect();
        let normals = |item: u32| {
            let planes = planes(steady[item as usize]).expect("only these are in the list");
            planes.map(|plane| plane.normal())
        };
        let ends = |item: u32| {
            let [a, b] = edges.segment(steady[item as usize]);
            [a.min(b), a.max(b)]
        };
        let plain = PlainTree::build(steady.len() as u32, normals, ends, 8, true);

        let is_silhouette = |viewer: &Viewpoint, item: u32| {
            let edge = edges.edge(item);
            let [a, b] = edge.faces.map(|face| edges.sees_front(viewer, face));
            a != (b != edge.flipped)
        };
        let viewers: Vec<Viewpoint> = views(mesh, bounds, count, 7)
            .into_iter()
            .filter_map(viewpoint)
            .collect();
        let mut scratch = EdgeScratch::default();
        let mut list = Vec::new();
        let mut times = [const { Vec::new() }; 4];
        let (mut found, mut did) = (0, QueryStatistics::default());
        // The first round warms up.
        for round in 0..2 {
            for viewer in &viewers {
                let mut timed = |which: usize, query: &mut dyn FnMut(&mut Vec<u32>)| {
                    list.clear();
                    let start = Instant::now();
                    query(&mut list);
                    if round > 0 {
                        times[which].push(1e3 * start.elapsed().as_secs_f64());
                    }
                    list.len()
                };
                let mut here = QueryStatistics::default();
                let by_tree = timed(0, &mut |list| {
                    here = edges.silhouettes(viewer, &mut scratch, list)
                });
                let by_scan = timed(1, &mut |list| {
                    scan.query(viewer, |item| is_silhouette(viewer, item), list);
                });
                timed(2, &mut |list| {
                    not_high.silhouettes(viewer, &mut scratch, list);
                });
                timed(3, &mut |list| {
                    plain.query(viewer, |item| is_silhouette(viewer, steady[item as usize]), list);
                });
                if by_tree != by_scan && edges.report().non_manifold_edges == 0 {
                    return Err(format!(
                        "mesh '{}': {by_tree} by tree, {by_scan} by scan",
                        mesh.name
                    ));
                }
                if round > 0 {
                    found += by_tree;
                    did.nodes += here.nodes;
                    did.blocks += here.blocks;
                    did.taken_whole += here.taken_whole;
                    did.exact += here.exact;
                }
            }
        }
        let [tree, scan, not_high, plain] = times.map(|mut times| {
            times.sort_unstable_by(f64::total_cmp);
            times.get(times.len() / 2).copied().unwrap_or_default()
        });
        Ok(Self {
            triangles: mesh.triangles.len(),
            pairs,
            tree,
            scan,
            not_high,
            plain,
            build,
            found,
            did,
        })
    }
}
