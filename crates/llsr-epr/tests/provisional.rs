//! Points of which a shader says that it will know better.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use glam::Vec3;
use llsr_epr::{FrameRenderer, FrameSettings, LockstepRenderer, ray_trace};
use llsr_scene::{Viewport, demo};
use llsr_shading::{
    DirectShader, Encounters, ShadeRequest, ShadedPoint, Shader, ShaderError, ShaderScratch, World,
};

const VIEWPORT: Viewport = Viewport {
    width: 96,
    height: 72,
};

fn world() -> Arc<World> {
    let scene = demo::build("subway").expect("built in");
    Arc::new(World::new(Arc::new(scene), &[]).0)
}

/// Too dark by a tenth until it knows better, and says so or not.
struct Late {
    inner: DirectShader,
    knows: AtomicBool,
    honest: bool,
}

impl Shader for Late {
    fn name(&self) -> &str {
        "late"
    }

    fn shade(
        &self,
        requests: &[ShadeRequest],
        seed: u64,
        scratch: &mut ShaderScratch,
        points: &mut Vec<ShadedPoint>,
        met: &mut Encounters,
    ) -> Result<(), ShaderError> {
        let first = points.len();
        self.inner.shade(requests, seed, scratch, points, met)?;
        if !self.knows.load(Ordering::Relaxed) {
            for point in &mut points[first..] {
                point.colour *= 0.9;
                point.textured = None;
                point.provisional = self.honest;
            }
        }
        Ok(())
    }
}

/// How many points are still too dark some frames after the shader has learned better, as a share.
fn left_over(honest: bool) -> f64 {
    let world = world();
    let camera = world.scene().cameras[0].clone();
    let shader = Late {
        inner: DirectShader::new(Arc::clone(&world), Vec3::ONE),
        knows: AtomicBool::new(false),
        honest,
    };
    let settings = FrameSettings {
        textures: false,
        // New samples that differ from the picture would find the dark ones, too.
        calm_priority: 1.0,
        ..FrameSettings::default()
    };
    let renderer = FrameRenderer::new(world.scene(), VIEWPORT, settings).expect("a size");
    let mut lockstep = LockstepRenderer::new(renderer, VIEWPORT.pixels() / 25);
    lockstep.warm_up(&shader, &camera);
    let mut walk = |shader: &Late, frames: usize| {
        for _ in 0..frames {
            lockstep.draw(&camera);
            lockstep.shade(shader);
        }
        lockstep.draw(&camera);
        lockstep.renderer.picture().clone()
    };
    let dark = walk(&shader, 20);
    shader.knows.store(true, Ordering::Relaxed);
    let now = walk(&shader, 20);
    let truth = ray_trace(&shader, &camera, VIEWPORT, 1, 0).expect("no error");
    // The share of the missing tenth that is still missing, in pixels that were a tenth too dark.
    let (mut missing, mut all) = (0.0, 0.0);
    for y in 0..VIEWPORT.height {
        let [rows, before, right] = [&now, &dark, &truth].map(|picture| picture.row(y)[1]);
        for x in 0..VIEWPORT.width as usize {
            if (before[x] / right[x] - 0.9).abs() < 0.02 {
                missing += f64::from(((right[x] - rows[x]) / (0.1 * right[x])).clamp(0.0, 1.0));
                all += 1.0;
            }
        }
    }
    assert!(all > 1000.0, "{all} pixels");
    missing / all
}

#[test]
fn provisional_points_are_asked_for_again_before_others() {
    let [honest, silent] = [true, false].map(left_over);
    println!("left over: {honest:.3}, of a shader that says nothing {silent:.3}");
    assert!(honest < 0.7 * silent, "{honest} and {silent}");
}

/// Black until it has been asked for a ray three times.
struct Slow {
    inner: DirectShader,
    asked: Mutex<HashMap<u64, u32>>,
}

impl Shader for Slow {
    fn name(&self) -> &str {
        "slow"
    }

    fn shade(
        &self,
        requests: &[ShadeRequest],
        seed: u64,
        scratch: &mut ShaderScratch,
        points: &mut Vec<ShadedPoint>,
        met: &mut Encounters,
    ) -> Result<(), ShaderError> {
        let first = points.len();
        self.inner.shade(requests, seed, scratch, points, met)?;
        let mut asked = self.asked.lock().expect("no panic");
        for point in &mut points[first..] {
            let times = asked.entry(point.id).or_insert(0);
            *times += 1;
            // Some need more than others.
            if *times < 1 + point.id as u32 % 3 {
                point.colour = Vec3::ZERO;
                point.provisional = true;
            }
        }
        Ok(())
    }
}

#[test]
fn ray_tracing_waits_for_what_is_final() {
    let world = world();
    let camera = world.scene().cameras[0].clone();
    let direct = || DirectShader::new(Arc::clone(&world), Vec3::ONE);
    let slow = Slow {
        inner: direct(),
        asked: Mutex::default(),
    };
    let got = ray_trace(&slow, &camera, VIEWPORT, 1, 0).expect("no error");
    let truth = ray_trace(&direct(), &camera, VIEWPORT, 1, 0).expect("no error");
    for y in 0..VIEWPORT.height {
        assert_eq!(got.row(y), truth.row(y), "row {y}");
    }
    let asked = slow.asked.into_inner().expect("no panic");
    assert!(
        asked.iter().all(|(id, &times)| times == 1 + *id as u32 % 3),
        "and no ray is asked for in vain"
    );
}
