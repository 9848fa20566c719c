//! Frames do not allocate after the first ones.

use std::sync::Arc;

use llsr_epr::{CameraPath, FrameRenderer, FrameSettings, shade_lockstep};
use llsr_scene::{Viewport, demo};
use llsr_shading::{DirectShader, Encounters, World};
use llsr_testkit::allocations::{Counting, count};

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn frames_do_not_allocate() {
    let (world, _) = World::new(Arc::new(demo::build("subway").expect("a scene")), &[]);
    let scene = Arc::clone(world.scene());
    let shader = DirectShader::new(Arc::new(world), glam::Vec3::ONE);
    let viewport = Viewport {
        width: 128,
        height: 96,
    };
    let mut renderer = FrameRenderer::new(&scene, viewport, FrameSettings::default()).expect("size");
    // There and back again, so that nothing new is met the second time.
    let there = CameraPath::default_walk(&scene.cameras[0], 12, 10.0).cameras;
    let path: Vec<_> = there.iter().chain(there.iter().rev()).cycle().take(168).collect();
    let (mut points, mut met) = (Vec::new(), Encounters::default());
    renderer.draw(path[0], 800);
    let mut quiet = 0;
    for (frame, camera) in path.into_iter().enumerate() {
        points.clear();
        met.clear();
        shade_lockstep(&shader, renderer.requests(), 0, &mut points, &mut met);
        let ((), made) = count(|| {
            renderer.take(&points, &met);
            renderer.draw(camera, 120);
        });
        // New shadows have edges to be found; only that may ask for memory.
        if frame >= 96 && renderer.report().shadow_pairs == 0 {
            assert_eq!(made.allocations, 0, "allocations in frame {frame}");
            quiet += 1;
        }
    }
    assert!(quiet > 30, "{quiet} frames without new shadows");
}
