//! Silhouettes from the tree against brute force over all edges.

use glam::{DVec3, Vec3};
use llsr_edges::{EdgeOptions, EdgeScratch, FoundEdges, MeshEdges};
use llsr_intervals::Viewpoint;
use llsr_scene::{MaterialId, Mesh};
use llsr_testkit::edges::{
    SilhouetteOracle, View, ViewedEdge, bumpy_sphere, chain_link, cube_cloud, random_roofs, torus,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn name(edges: &MeshEdges, found: &[u32]) -> Vec<ViewedEdge> {
    let mut names: Vec<ViewedEdge> = found
        .iter()
        .map(|&edge| SilhouetteOracle::name(edges.segment(edge)))
        .collect();
    names.sort_unstable();
    names
}

fn viewpoint(view: View) -> Viewpoint {
    match view {
        View::At(eye) => Viewpoint::at(eye),
        View::Towards(direction) => Viewpoint::towards(direction),
    }
    .expect("a finite view")
}

/// Views around, inside, far away, parallel, from a vertex and in the plane of a face.
fn views(mesh: &Mesh, count: usize, seed: u64) -> Vec<View> {
    let random = &mut Pcg64Mcg::seed_from_u64(seed);
    let mut uniform = || f64::from(random.next_u32() >> 8) / f64::from(1 << 23) - 1.0;
    let bounds = mesh.bounds();
    let (center, size) = (bounds.center().as_dvec3(), f64::from(bounds.diagonal()));
    let mut views: Vec<View> = (0..count)
        .map(|i| {
            let direction = DVec3::new(uniform(), uniform(), uniform());
            match i % 4 {
                0 => View::At(center + size * direction),
                1 => View::At(center + 3.0 * size * direction),
                2 => View::At(center + 0.3 * size * direction),
                _ => View::Towards(direction),
            }
        })
        .collect();
    let [a, b, c] = mesh.corners(mesh.triangles.len() / 2).map(|p| p.as_dvec3());
    views.push(View::At(a));
    views.push(View::At(a + 2.0 * (b - a) - 0.5 * (c - a)));
    views.push(View::Towards(DVec3::Y));
    views.push(View::Towards(b - c));
    views
}

fn check(mesh: &Mesh, count: usize) {
    let oracle = SilhouetteOracle::new(&mesh.positions, &mesh.triangles);
    let edges = MeshEdges::new(mesh, EdgeOptions::default()).expect("a valid mesh");
    let boundaries: Vec<u32> = edges.boundaries().collect();
    assert_eq!(
        name(&edges, &boundaries),
        oracle.boundaries(),
        "{}: boundaries",
        mesh.name
    );
    let (mut scratch, mut found) = (EdgeScratch::default(), FoundEdges::default());
    for view in views(mesh, count, 5) {
        edges.find(&viewpoint(view), &mut scratch, &mut found);
        assert_eq!(
            name(&edges, &found.silhouettes),
            oracle.silhouettes(view),
            "{}: {view:?}",
            mesh.name
        );
    }
}

#[test]
fn closed_meshes() {
    check(&bumpy_sphere(24, 0.0, 1), 40);
    check(&bumpy_sphere(24, 0.2, 2), 40);
    check(&torus(1.0, 0.3, 30, 14), 40);
    check(&chain_link(Vec3::new(100.0, -3.0, 7.0), 0.4, true, 24, 12), 40);
    check(&Mesh::cuboid("cube", Vec3::ZERO, Vec3::ONE, MaterialId(0)), 40);
}

#[test]
fn meshes_that_defy_sorting() {
    check(&random_roofs(1500, 0.05, 3), 30);
    check(&cube_cloud(300, 0.02, 4), 30);
}

#[test]
fn unwelded_and_scaled_meshes() {
    for scale in [1e-3, 1e5, 1e-20] {
        let sphere = bumpy_sphere(16, 0.1, 6);
        let positions: Vec<Vec3> = (0..sphere.triangles.len())
            .flat_map(|i| sphere.corners(i))
            .map(|p| p * scale)
            .collect();
        let triangles = (0..sphere.triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        let mesh = Mesh::new(
            format!("loose sphere of size {scale}"),
            positions,
            triangles,
            MaterialId(0),
        );
        check(&mesh, 16);
        let edges = MeshEdges::new(&mesh, EdgeOptions::default()).expect("valid");
        assert!(
            edges.is_closed() && edges.boundaries().is_empty(),
            "welding closes it"
        );
    }
}

#[test]
fn open_turned_doubled_and_crowded_meshes() {
    let sphere = bumpy_sphere(16, 0.1, 7);
    let mut open = sphere.clone();
    open.name = "open sphere".into();
    open.triangles.truncate(400);
    open.materials.truncate(400);
    check(&open, 30);

    let mut turned = sphere.clone();
    turned.name = "sphere with every seventh face turned over".into();
    turned.triangles.iter_mut().step_by(7).for_each(|t| t.swap(0, 1));
    check(&turned, 30);

    let mut doubled = sphere.clone();
    doubled.name = "sphere with every third face twice".into();
    let again: Vec<[u32; 3]> = doubled.triangles.iter().step_by(3).copied().collect();
    doubled.materials.extend(again.iter().map(|_| MaterialId(0)));
    doubled.triangles.extend(again);
    check(&doubled, 30);

    // A sheet of coplanar faces, every third turned over: one of the views is in its plane.
    let corner = |i: u16| Vec3::new(f32::from(i % 5), 0.0, f32::from(i / 5));
    let mut sheet = Mesh::new(
        "sheet with turned faces",
        (0..25).map(corner).collect(),
        (0..20u32)
            .filter(|i| i % 5 != 4)
            .flat_map(|i| [[i, i + 5, i + 6], [i, i + 6, i + 1]])
            .collect(),
        MaterialId(0),
    );
    sheet.triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    check(&sheet, 30);

    // Cubes on a grid that share corners and edges.
    let mut grid = Mesh {
        name: "touching cubes".into(),
        ..Mesh::default()
    };
    for i in 0..27u32 {
        if i % 2 == 0 {
            let corner = Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32);
            grid.append(&Mesh::cuboid("", corner, corner + Vec3::ONE, MaterialId(0)));
        }
    }
    check(&grid, 30);
    let edges = MeshEdges::new(&grid, EdgeOptions::default()).expect("valid");
    assert!(edges.report().non_manifold_edges > 20, "{:?}", edges.report());
}

#[test]
fn mirrored_and_moved_instances_ask_in_their_own_frame() {
    let mesh = torus(1.0, 0.3, 20, 12);
    let edges = MeshEdges::new(&mesh, EdgeOptions::default()).expect("valid");
    let transform = glam::DAffine3::from_scale_rotation_translation(
        DVec3::new(-2.0, 1.0, 0.5),
        glam::DQuat::from_rotation_y(0.7),
        DVec3::new(3.0, 2.0, 1.0),
    );
    let eye = DVec3::new(9.0, 4.0, -3.0);
    let local = Viewpoint::at(transform.inverse().transform_point3(eye)).expect("finite");
    let mut found = FoundEdges::default();
    edges.find(&local, &mut EdgeScratch::default(), &mut found);
    // The same seen from the world: signs of volumes in world space, far from 0 for this view.
    let front = |face: u32| {
        let [a, b, c] = edges.corners(face).map(|p| transform.transform_point3(p));
        (b - a).cross(c - a).dot(eye - a) > 0.0
    };
    let mut expected: Vec<u32> = (0..edges.len() as u32)
        .filter(|&e| {
            let [f, g] = edges.edge(e).faces;
            front(f) != front(g)
        })
        .collect();
    expected.sort_unstable();
    found.silhouettes.sort_unstable();
    assert_eq!(found.silhouettes, expected, "instance");
}

#[test]
fn creases_face_the_viewer() {
    let cube = Mesh::cuboid("cube", Vec3::ZERO, Vec3::ONE, MaterialId(0));
    let find = |mesh: &Mesh, degrees: f64, eye: DVec3| {
        let options = EdgeOptions {
            crease_degrees: degrees,
            ..EdgeOptions::default()
        };
        let edges = MeshEdges::new(mesh, options).expect("valid");
        let mut found = FoundEdges::default();
        edges.find(
            &Viewpoint::at(eye).expect("finite"),
            &mut EdgeScratch::default(),
            &mut found,
        );
        (found.silhouettes.len(), found.creases.len())
    };
    assert_eq!(find(&cube, 85.0, DVec3::splat(3.0)), (6, 3), "three faces seen");
    assert_eq!(
        find(&cube, 95.0, DVec3::splat(3.0)),
        (6, 0),
        "right angles are below the cut-off"
    );
    assert_eq!(
        find(&cube, 85.0, DVec3::new(0.5, 0.5, 3.0)),
        (4, 0),
        "one face seen"
    );
    // From inside a closed box no face is seen from the front.
    assert_eq!(find(&cube, 85.0, DVec3::splat(0.5)), (0, 0), "inside");
    // A box without a lid is seen from inside too.
    let mut tray = cube.clone();
    tray.triangles.drain(6..8);
    tray.materials.drain(6..8);
    assert_eq!(
        find(&tray, 85.0, DVec3::splat(0.5)),
        (0, 8),
        "all inner corners of the tray"
    );
}

#[test]
fn flat_faces_are_seen_through() {
    // A square with a vertex in the middle of its diagonal on one side only: the gap is closed by a face without
    // area. Seen from the front nothing of it may be a silhouette.
    let positions = vec![
        Vec3::ZERO,
        Vec3::X,
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::Y,
        Vec3::new(0.5, 0.5, 0.0),
    ];
    let triangles = vec![[0, 1, 2], [0, 4, 3], [4, 2, 3], [0, 2, 4]];
    let mesh = Mesh::new("patched square", positions, triangles, MaterialId(0));
    let edges = MeshEdges::new(&mesh, EdgeOptions::default()).expect("valid");
    assert_eq!(edges.report().flat_faces, 1, "{:?}", edges.report());
    assert_eq!(edges.boundaries().len(), 4, "only the square's sides bound it");
    let mut found = FoundEdges::default();
    for eye in [
        DVec3::new(0.3, 0.4, 2.0),
        DVec3::new(5.0, 1.0, 0.2),
        DVec3::new(0.0, 0.0, -1.0),
    ] {
        edges.find(
            &Viewpoint::at(eye).expect("finite"),
            &mut EdgeScratch::default(),
            &mut found,
        );
        assert_eq!(
            found,
            FoundEdges::default(),
            "a flat square has no inner edge from {eye}"
        );
    }
    // The same, folded along the diagonal: the two halves of it are silhouettes, the face between is not.
    let mut folded = mesh.clone();
    folded.positions[1].z = -1.0;
    let edges = MeshEdges::new(&folded, EdgeOptions::default()).expect("valid");
    let view = Viewpoint::at(DVec3::new(-1.0, 1.0, 0.1)).expect("finite");
    edges.find(&view, &mut EdgeScratch::default(), &mut found);
    let sides: Vec<bool> = (0..2).map(|f| edges.sees_front(&view, f)).collect();
    assert_eq!(
        found.silhouettes.len(),
        if sides[0] == sides[1] { 0 } else { 2 },
        "{sides:?}"
    );
    assert_ne!(sides[0], sides[1], "this view sees the fold");
}

#[test]
fn nothing_to_find_and_nothing_to_find_it_in() {
    let mut found = FoundEdges::default();
    let view = Viewpoint::at(DVec3::ONE).expect("finite");
    for mesh in [
        Mesh::default(),
        Mesh::new("point", vec![Vec3::ONE; 3], vec![[0, 1, 2]], MaterialId(0)),
        Mesh::new(
            "line",
            vec![Vec3::ZERO, Vec3::X, Vec3::X * 3.0],
            vec![[0, 1, 2]],
            MaterialId(0),
        ),
    ] {
        let edges = MeshEdges::new(&mesh, EdgeOptions::default()).expect("valid");
        edges.find(&view, &mut EdgeScratch::default(), &mut found);
        assert_eq!(found, FoundEdges::default(), "{}", mesh.name);
    }
    let broken = Mesh::new("index", vec![Vec3::ZERO], vec![[0, 1, 2]], MaterialId(0));
    assert!(
        MeshEdges::new(&broken, EdgeOptions::default()).is_err(),
        "index out of range"
    );
    let broken = Mesh::new("nan", vec![Vec3::NAN; 3], vec![[0, 1, 2]], MaterialId(0));
    assert!(MeshEdges::new(&broken, EdgeOptions::default()).is_err(), "NaN");
}

#[test]
fn materials_meet_at_creases_however_flat_the_surface() {
    // Six vertices in a plane: two quads side by side, each of two triangles.
    let positions: Vec<Vec3> = (0..6)
        .map(|i| Vec3::new((i / 2) as f32, 0.0, (i % 2) as f32))
        .collect();
    let triangles = vec![[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]];
    let mut mesh = Mesh::new("floor", positions, triangles, MaterialId(0));
    let creases = |mesh: &Mesh, eye: DVec3| {
        let edges = MeshEdges::new(mesh, EdgeOptions::default()).expect("a valid mesh");
        let mut found = FoundEdges::default();
        let viewer = Viewpoint::at(eye).expect("finite");
        edges.find(&viewer, &mut EdgeScratch::default(), &mut found);
        assert!(found.silhouettes.is_empty(), "a plane has none but its border");
        name(&edges, &found.creases)
    };
    let (above, below) = (DVec3::new(0.3, 2.0, 0.4), DVec3::new(0.3, -2.0, 0.4));
    assert!(creases(&mesh, above).is_empty(), "one material");
    mesh.materials[2..].fill(MaterialId(1));
    let border = SilhouetteOracle::name([Vec3::X, Vec3::new(1.0, 0.0, 1.0)]);
    assert_eq!(creases(&mesh, above), [border], "two, from above");
    assert_eq!(
        creases(&mesh, below),
        [border],
        "and from below, for a plane has two sides"
    );
}
