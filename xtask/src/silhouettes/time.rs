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

/// The tree of 2003 is left out (0 ms in the table) where there are more pairs of faces.
const PLAIN_MOST: u32 = 5_000_000;

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
    if !files.is_empty() {
        return Ok(());
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
    let (tree, scan) = (sum(&|row| row.tree), sum(&|row| row.scan));
    println!(
        "| {name} | {} | {} | {:.0} | {tree:.3} | {scan:.3} | {:.2} | {:.3} | {:.3} | {:.0} | {:.0} | {:.1} | {:.2} |",
        sum(&|row| row.triangles as f64),
        sum(&|row| row.pairs as f64),
        sum(&|row| row.found),
        tree / scan,
        sum(&|row| row.not_high),
        sum(&|row| row.plain),
        sum(&|row| row.did[0]),
        sum(&|row| row.did[1]),
        sum(&|row| row.did[2]),
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
    /// Silhouette edges of a view, and nodes, blocks and exact tests; means over the views.
    found: f64,
    did: [f64; 3],
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
        // On millions of edges without order it takes seconds a view.
        let plain_items = if pairs > PLAIN_MOST {
            0
        } else {
            steady.len() as u32
        };
        let plain = PlainTree::build(plain_items, normals, ends, 8, true);

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
        let (mut found, mut did) = (Vec::new(), QueryStatistics::default());
        let tree = median(&viewers, |viewer, list| {
            let here = edges.silhouettes(viewer, &mut scratch, list);
            found.push(list.len());
            did.nodes += here.nodes;
            did.blocks += here.blocks;
            did.exact += here.exact;
        });
        let mut by_scan = Vec::new();
        let scan = median(&viewers, |viewer, list| {
            scan.query(viewer, |item| is_silhouette(viewer, item), list);
            by_scan.push(list.len());
        });
        if found != by_scan && edges.report().non_manifold_edges == 0 {
            return Err(format!("mesh '{}': tree and scan differ", mesh.name));
        }
        let not_high = median(&viewers, |viewer, list| {
            not_high.silhouettes(viewer, &mut scratch, list);
        });
        let few = &viewers[..viewers.len().min(8)];
        let plain = median(few, |viewer, list| {
            plain.query(viewer, |item| is_silhouette(viewer, steady[item as usize]), list);
        });
        // Each view was asked twice.
        let each = |n: usize| n as f64 / (2 * viewers.len().max(1)) as f64;
        Ok(Self {
            triangles: mesh.triangles.len(),
            pairs,
            tree,
            scan,
            not_high,
            plain,
            build,
            found: each(found.iter().sum()),
            did: [did.nodes, did.blocks, did.exact].map(each),
        })
    }
}

/// Milliseconds of one query: the median over the views, after a round to warm up.
///
/// Every method has a loop of its own: what it reads again in the next view stays in the caches if it fits.
fn median(viewers: &[Viewpoint], mut query: impl FnMut(&Viewpoint, &mut Vec<u32>)) -> f64 {
    let (mut list, mut times) = (Vec::new(), Vec::new());
    for round in 0..2 {
        for viewer in viewers {
            list.clear();
            let start = Instant::now();
            query(viewer, &mut list);
            if round > 0 {
                times.push(1e3 * start.elapsed().as_secs_f64());
            }
        }
    }
    times.sort_unstable_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or_default()
}
