//! The tree against brute force.

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use llsr_edges::{EdgeOptions, EdgeScratch, FoundEdges, MeshEdges};
use llsr_scene::Mesh;
use llsr_testkit::edges::{SilhouetteOracle, ViewedEdge};

use super::{meshes, name, viewpoint, views};

/// Totals over all meshes.
#[derive(Default)]
struct Totals {
    meshes: usize,
    edges: usize,
    silhouettes: AtomicUsize,
    missed: AtomicUsize,
    extra: AtomicUsize,
    /// Edges of faces without area, which have no front, and of which the tree sees through.
    left_out: usize,
}

pub(super) fn run(files: &[PathBuf], count: usize) -> Result<(), String> {
    let start = Instant::now();
    let mut totals = Totals::default();
    for path in files {
        let before = (
            totals.edges,
            totals.missed.load(Ordering::Relaxed),
            totals.extra.load(Ordering::Relaxed),
        );
        let meshes = meshes(path);
        for (seed, mesh) in meshes.iter().enumerate() {
            check(mesh, count, seed as u64, &mut totals)?;
        }
        println!(
            "{:<28} {:>4} meshes {:>9} edges: {} missed, {} extra",
            name(path),
            meshes.len(),
            totals.edges - before.0,
            totals.missed.load(Ordering::Relaxed) - before.1,
            totals.extra.load(Ordering::Relaxed) - before.2
        );
    }
    let (missed, extra) = (totals.missed.into_inner(), totals.extra.into_inner());
    println!(
        "{} meshes with {} edges, {count} views each: {} silhouette edges, {missed} missed, {extra} extra; {} edges of faces \
         without area not compared; {:.0} s",
        totals.meshes,
        totals.edges,
        totals.silhouettes.into_inner(),
        totals.left_out,
        start.elapsed().as_secs_f64()
    );
    if missed + extra > 0 {
        return Err("the tree and brute force differ".to_owned());
    }
    Ok(())
}

fn check(mesh: &Mesh, count: usize, seed: u64, totals: &mut Totals) -> Result<(), String> {
    let edges = MeshEdges::new(mesh, EdgeOptions::default())
        .map_err(|error| format!("mesh '{}': {error}", mesh.name))?;
    let oracle = SilhouetteOracle::new(&mesh.positions, &mesh.triangles);
    let left_out = edges_of_flat_faces(mesh);
    totals.meshes += 1;
    totals.edges += edges.len();
    totals.left_out += left_out.len();
    let views = views(mesh, edges.bounds(), count, seed);
    let next = AtomicUsize::new(0);
    let totals = &*totals;
    let work = || {
        let (mut scratch, mut found) = (EdgeScratch::default(), FoundEdges::default());
        while let Some(&view) = views.get(next.fetch_add(1, Ordering::Relaxed)) {
            let Some(viewer) = viewpoint(view) else { continue };
            edges.find(&viewer, &mut scratch, &mut found);
            let compared = |edge: &ViewedEdge| left_out.is_empty() || !left_out.contains(edge);
            let mut tree: Vec<ViewedEdge> = found
                .silhouettes
                .iter()
                .map(|&edge| SilhouetteOracle::name(edges.segment(edge)))
                .filter(compared)
                .collect();
            tree.sort_unstable();
            let mut truth = oracle.silhouettes(view);
            truth.retain(compared);
            totals.silhouettes.fetch_add(truth.len(), Ordering::Relaxed);
            if tree != truth {
                let [tree, truth] = [tree, truth].map(|list| list.into_iter().collect::<HashSet<_>>());
                totals
                    .missed
                    .fetch_add(truth.difference(&tree).count(), Ordering::Relaxed);
                totals
                    .extra
                    .fetch_add(tree.difference(&truth).count(), Ordering::Relaxed);
                println!("mesh '{}': they differ for {view:?}", mesh.name);
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(work);
        }
    });
    Ok(())
}

/// Edges of faces whose corners lie on a line, as far as double precision can tell.
fn edges_of_flat_faces(mesh: &Mesh) -> HashSet<ViewedEdge> {
    let mut edges = HashSet::new();
    for index in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(index);
        let (u, v) = (b.as_dvec3() - a.as_dvec3(), c.as_dvec3() - a.as_dvec3());
        if u.cross(v).length() <= 1e-12 * u.length() * v.length() && a != b && b != c && c != a {
            for ends in [[a, b], [b, c], [c, a]] {
                edges.insert(SilhouetteOracle::name(ends));
            }
        }
    }
    edges
}
