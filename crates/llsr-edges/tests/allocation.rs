//! Asking for a view's edges allocates nothing after the first views.

use glam::{Affine3A, DVec3, Vec3};
use llsr_edges::{SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView};
use llsr_scene::{Camera, FieldOfView, ObjectId, Viewport, demo};
use llsr_testkit::allocations::{Counting, count};
use llsr_testkit::edges::{cube_cloud, torus};

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn views_do_not_allocate() {
    let mut scene = demo::build("subway").expect("built in");
    scene.add_mesh(torus(0.5, 0.2, 40, 20));
    scene.add_mesh(cube_cloud(60, 0.1, 1));
    let mut edges = SceneEdges::new(&scene, &SceneEdgeOptions::with_crease_degrees(20.0));
    let (mut scratch, mut found) = (SceneScratch::default(), SceneFound::default());
    let viewport = Viewport {
        width: 320,
        height: 200,
    };
    let cameras: Vec<Camera> = (0..12)
        .map(|i| {
            let angle = f64::from(i);
            let eye = DVec3::new(angle.cos(), 0.2, angle.sin());
            Camera::look_at(
                "",
                eye,
                DVec3::ZERO,
                DVec3::Y,
                FieldOfView::vertical_degrees(70.0),
            )
        })
        .collect();
    let moved = ObjectId::from(scene.objects.len() - 2);
    for round in 0..3 {
        for (i, camera) in cameras.iter().enumerate() {
            let ((), made) = count(|| {
                edges.set_transform(moved, Affine3A::from_translation(Vec3::X * (0.1 * i as f32)));
                let picture = SceneView::Picture { camera, viewport };
                edges.find(picture, None, &mut scratch, &mut found);
            });
            let allocated = made.allocations;
            assert!(
                round < 1 || allocated == 0,
                "{allocated} allocations in round {round}, view {i}"
            );
            assert!(found.len() > 100, "{} edges in view {i}", found.len());
        }
    }
}
