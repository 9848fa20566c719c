//! A scene without geometry.

use glam::DVec3;
use llsr_scene::{Mesh, Scene};
use llsr_tracer::Tracer;

#[test]
fn nothing_is_hit_where_there_is_nothing() {
    let mut with_an_empty_mesh = Scene::new("an empty mesh");
    with_an_empty_mesh.add_mesh(Mesh::default());
    for scene in [Scene::new("empty"), with_an_empty_mesh] {
        let (tracer, _) = Tracer::new(&scene);
        let mut blocked = [true; 3];
        for direction in [DVec3::X, -DVec3::Y, DVec3::new(0.6, 0.0, 0.8)] {
            assert_eq!(
                tracer.closest(DVec3::ZERO, direction, f64::INFINITY),
                None,
                "{}",
                scene.name
            );
            assert!(!tracer.occluded(DVec3::ZERO, direction), "{}", scene.name);
            tracer.occluded_pencil(DVec3::Z, DVec3::ZERO, direction, &[0.0, 0.5, 1.0], &mut blocked);
            assert_eq!(blocked, [false; 3], "{}", scene.name);
        }
    }
}
