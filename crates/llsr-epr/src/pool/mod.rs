//! Shaders on threads of their own, beside the display.
//!
//! Requests wait in one bounded queue, results in another; the display hands in and takes out and never waits. Requests
//! and points may be lost when a queue is full, and are counted; what shaders met never is. A shader that fails or panics costs
//! its batch and nothing else.

mod lockstep;
mod worker;

use std::io;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use llsr_shading::{Encounters, SceneChange, ShadeRequest, ShadedPoint, Shader};

pub use lockstep::{Lockstep, shade_lockstep};
use worker::Shared;

/// What happens to requests for which there is no room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Overflow {
    /// The requests that have waited longest are dropped: they were chosen for a view that is gone.
    #[default]
    DropOldest,
    /// The new ones are refused.
    Refuse,
}

/// How a pool works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoolSettings {
    /// Threads that shade, at least 1.
    pub threads: usize,
    /// Requests that may wait, at least 1.
    pub queue: usize,
    /// Points that may wait to be collected, at least 1; beyond it the oldest are dropped.
    pub results: usize,
    /// Requests that a thread takes at a time, at least 1; fewer if the shader wants [smaller portions](Shader::portion).
    pub batch: usize,
    /// What happens when the queue is full.
    pub overflow: Overflow,
    /// Seed handed to the shader.
    pub seed: u64,
    /// How long the end of the pool waits for its threads. One that is still shading then is left behind; it ends by itself
    /// with its batch, or with the process.
    pub patience: Duration,
}

impl Default for PoolSettings {
    /// One thread, 8192 requests, 65536 points, batches of 16, the oldest dropped, one second of patience.
    fn default() -> Self {
        Self {
            threads: 1,
            queue: 8192,
            results: 65_536,
            batch: 16,
            overflow: Overflow::DropOldest,
            seed: 0,
            patience: Duration::from_secs(1),
        }
    }
}

/// What a pool has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoolCounts {
    /// Requests handed in.
    pub requested: u64,
    /// Requests refused or dropped because the queue was full.
    pub dropped: u64,
    /// Points that came back.
    pub shaded: u64,
    /// Points dropped because nobody collected them.
    pub lost: u64,
    /// Points that were not finite, or more than were asked for; dropped.
    pub unusable: u64,
    /// Requests in batches that failed or panicked for which no point came back.
    pub failed: u64,
    /// Batches that ended with an error.
    pub errors: u64,
    /// Batches that panicked.
    pub panics: u64,
    /// Times that a thread died and another took its place.
    pub restarts: u64,
}

/// How a pool stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PoolStatus {
    /// What it has done.
    pub counts: PoolCounts,
    /// Requests that wait.
    pub waiting: usize,
    /// Requests that are being shaded.
    pub in_flight: usize,
    /// Threads at work or ready for it.
    pub threads: usize,
    /// What the last failure or panic said; a success does not clear it.
    pub last_error: Option<String>,
}

/// What came back since the last time.
#[derive(Clone, Debug, Default)]
pub struct Harvest {
    /// Points whose shading began before the last change of the scene was told.
    pub stale: Vec<ShadedPoint>,
    /// Points of the scene as it stands.
    pub fresh: Vec<ShadedPoint>,
    /// What the shader met.
    pub met: Encounters,
}

/// Threads that shade.
///
/// Dropping it stops the threads: it waits for them as long as the settings say and never longer.
pub struct ShaderPool {
    shader: Arc<dyn Shader>,
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
    patience: Duration,
}

impl std::fmt::Debug for ShaderPool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ShaderPool")
            .field("shader", &self.shader.name())
            .field("status", &self.status())
            .finish_non_exhaustive()
    }
}

impl ShaderPool {
    /// Starts the threads. Settings below their least values are raised to them.
    ///
    /// # Errors
    /// If the system gives no thread at all; with some of them the pool works.
    pub fn new(shader: Arc<dyn Shader>, settings: &PoolSettings) -> io::Result<Self> {
        let shared = Arc::new(Shared::new(settings));
        let mut threads = Vec::new();
        for number in 0..settings.threads.max(1) {
            let (shader, shared_too) = (Arc::clone(&shader), Arc::clone(&shared));
            shared.enter();
            let thread = thread::Builder::new()
                .name(format!("shader-{number}"))
                .spawn(move || worker::run(&*shader, &shared_too));
            match thread {
                Ok(thread) => threads.push(thread),
                Err(error) => {
                    shared.leave();
                    if threads.is_empty() {
                        return Err(error);
                    }
                    shared.lock().last_error = Some(format!("only {number} shader threads: {error}"));
                    break;
                }
            }
        }
        Ok(Self {
            shader,
            shared,
            threads,
            patience: settings.patience,
        })
    }

    /// The shader.
    pub fn shader(&self) -> &dyn Shader {
        &*self.shader
    }

    /// Hands in requests; returns how many were dropped or refused, of these or of earlier ones. Does not wait.
    pub fn submit(&self, requests: &[ShadeRequest]) -> usize {
        self.shared.submit(requests)
    }

    /// Drops the requests that wait, for instance because the view has jumped; returns how many.
    pub fn forget(&self) -> usize {
        self.shared.forget()
    }

    /// Takes what has come back since the last call. What `harvest` held is gone; its memory is used again. Does not wait.
    pub fn collect(&self, harvest: &mut Harvest) {
        harvest.stale.clear();
        harvest.fresh.clear();
        harvest.met.clear();
        self.shared.collect(harvest);
        harvest.met.settle();
    }

    /// Tells the shader that something has moved. Points whose shading began earlier are stale from now on. Does not wait.
    pub fn changed(&self, change: &SceneChange) {
        // In this order: a batch that begins between the two is called stale although it is not.
        self.shader.changed(change);
        self.shared.age();
    }

    /// How the pool stands.
    pub fn status(&self) -> PoolStatus {
        self.shared.status()
    }

    /// Waits until nothing waits or is being shaded, at most for `timeout`; true if so.
    pub fn wait_idle(&self, timeout: Duration) -> bool {
        self.shared.wait_idle(Instant::now() + timeout)
    }
}

impl Drop for ShaderPool {
    fn drop(&mut self) {
        self.shared.stop();
        self.shader.interrupt();
        if self.shared.wait_gone(Instant::now() + self.patience) {
            for thread in self.threads.drain(..) {
                // They have ended; a panic was counted where it happened.
                let _ = thread.join();
            }
        }
    }
}
