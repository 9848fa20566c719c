//! Who shades, and when.

use std::sync::Arc;
use std::time::{Duration, Instant};

use llsr_epr::{FrameRenderer, Harvest, LockstepRenderer, PoolSettings, ShaderPool, ShadowThread};
use llsr_scene::Camera;
use llsr_shading::{SceneChange, Shader};
use serde_json::{Value, json};

use crate::args::WalkArgs;
use crate::failure::Failure;
use crate::progress::interrupted;

/// Frames' worth of requests that may wait for the shader's threads: what waits longer was chosen for a view that is gone.
const FRAMES_WAITING: usize = 2;
/// Longest wait for the samples before the first frame.
const WARM_UP: Duration = Duration::from_secs(20);
/// Time between two looks whether the user wants to end meanwhile.
const LOOK: Duration = Duration::from_millis(100);

/// A renderer and what feeds it.
pub(crate) enum Drive {
    /// A fixed number of samples between two frames.
    Lockstep(Box<LockstepRenderer>, Arc<dyn Shader>),
    /// A fixed number of samples beside each frame.
    Overlap(Box<LockstepRenderer>, Arc<dyn Shader>),
    /// Threads that shade while frames are drawn.
    Live(Box<Live>),
}

/// The renderer beside the threads of a pool.
pub(crate) struct Live {
    renderer: FrameRenderer,
    pool: ShaderPool,
    shadows: ShadowThread,
    harvest: Harvest,
    samples: usize,
}

/// What went wrong with the shader.
pub(crate) struct Trouble {
    pub(crate) errors: u64,
    pub(crate) failed: u64,
    pub(crate) last: Option<String>,
    /// Counts of the pool.
    pub(crate) live: Option<Value>,
}

impl Drive {
    pub(crate) fn new(
        args: &WalkArgs,
        renderer: FrameRenderer,
        shader: Arc<dyn Shader>,
        samples: usize,
    ) -> Result<Self, Failure> {
        if !args.live {
            let lockstep = Box::new(LockstepRenderer::new(renderer, samples));
            return Ok(if args.overlap {
                Self::Overlap(lockstep, shader)
            } else {
                Self::Lockstep(lockstep, shader)
            });
        }
        let settings = PoolSettings {
            // One core is the display's.
            threads: rayon::current_num_threads().saturating_sub(1).max(1),
            queue: FRAMES_WAITING * samples + warm_up_samples(&renderer),
            seed: renderer.settings().seed,
            ..PoolSettings::default()
        };
        let pool = ShaderPool::new(shader, &settings)
            .map_err(|error| Failure::Work(format!("--live: there is no thread to shade on: {error}")))?;
        let shadows = ShadowThread::start().map_err(|error| {
            Failure::Work(format!("--live: there is no thread for shadow edges: {error}"))
        })?;
        Ok(Self::Live(Box::new(Live {
            renderer,
            pool,
            shadows,
            harvest: Harvest::default(),
            samples,
        })))
    }

    pub(crate) fn renderer(&self) -> &FrameRenderer {
        match self {
            Self::Lockstep(lockstep, _) | Self::Overlap(lockstep, _) => &lockstep.renderer,
            Self::Live(live) => &live.renderer,
        }
    }

    /// Follows a change of the scene.
    pub(crate) fn changed(&mut self, change: &SceneChange) {
        match self {
            Self::Lockstep(lockstep, shader) | Self::Overlap(lockstep, shader) => {
                shader.changed(change);
                lockstep.renderer.changed(change);
            }
            Self::Live(live) => {
                live.pool.changed(change);
                live.renderer.changed(change);
            }
        }
    }

    /// Gets samples for the first frame; returns how many.
    pub(crate) fn warm_up(&mut self, camera: &Camera) -> usize {
        match self {
            Self::Lockstep(lockstep, shader) | Self::Overlap(lockstep, shader) => {
                lockstep.warm_up(&**shader, camera)
            }
            Self::Live(live) => {
                live.renderer.draw(camera, warm_up_samples(&live.renderer));
                live.pool.submit(live.renderer.requests());
                let start = Instant::now();
                while start.elapsed() < WARM_UP && !interrupted() && !live.pool.wait_idle(LOOK) {}
                live.collect()
            }
        }
    }

    /// Makes the next frame.
    pub(crate) fn draw(&mut self, camera: &Camera) {
        match self {
            Self::Lockstep(lockstep, _) => lockstep.draw(camera),
            Self::Overlap(lockstep, shader) => {
                lockstep.draw_and_shade(&**shader, camera);
            }
            Self::Live(live) => {
                live.renderer.draw(camera, live.samples);
                live.pool.submit(live.renderer.requests());
            }
        }
    }

    /// Gets samples for the next frame: those asked for in lockstep, if they have not come with the frame, those that are there
    /// otherwise.
    pub(crate) fn shade(&mut self) {
        match self {
            Self::Lockstep(lockstep, shader) => {
                lockstep.shade(&**shader);
            }
            Self::Overlap(..) => {}
            Self::Live(live) => {
                live.collect();
            }
        }
    }

    pub(crate) fn trouble(&self) -> Trouble {
        match self {
            Self::Lockstep(lockstep, _) | Self::Overlap(lockstep, _) => {
                let trouble = lockstep.trouble();
                Trouble {
                    errors: (trouble.errors + trouble.panics) as u64,
                    failed: trouble.failed as u64,
                    last: trouble.last_error.clone(),
                    live: None,
                }
            }
            Self::Live(live) => {
                let status = live.pool.status();
                let counts = status.counts;
                Trouble {
                    errors: counts.errors + counts.panics,
                    failed: counts.failed,
                    last: status.last_error,
                    live: Some(json!({
                        "requested": counts.requested,
                        "dropped": counts.dropped,
                        "shaded": counts.shaded,
                        "lost": counts.lost,
                        "restarts": counts.restarts,
                    })),
                }
            }
        }
    }
}

impl Live {
    /// Takes in what has come. Points of a scene that has changed since are not worth keeping.
    fn collect(&mut self) -> usize {
        self.pool.collect(&mut self.harvest);
        self.renderer.take(&self.harvest.fresh, &self.harvest.met);
        self.shadows.tend(&mut self.renderer);
        self.harvest.fresh.len()
    }
}

fn warm_up_samples(renderer: &FrameRenderer) -> usize {
    renderer.viewport().pixels().div_ceil(16).max(1)
}
