//! The threads of a pool and what they share.

use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use llsr_shading::{Encounters, ShadeRequest, ShadedPoint, Shader, ShaderScratch};

use crate::pool::{Harvest, Overflow, PoolCounts, PoolSettings, PoolStatus};

/// Encounters that may pile up before repetitions are taken out.
const MET_PILE: usize = 8192;
/// A shader that fails again and again is asked more and more rarely: first and longest pause.
const PAUSES: (Duration, Duration) = (Duration::from_millis(5), Duration::from_millis(500));

/// What the display and the threads share.
pub(super) struct Shared {
    state: Mutex<State>,
    /// Something to do, or the end.
    work: Condvar,
    /// A batch is done, or a thread has ended.
    done: Condvar,
    queue: usize,
    results: usize,
    batch: usize,
    overflow: Overflow,
    seed: u64,
}

/// All of it is touched for a short time only: nobody shades, sorts or waits while holding it.
#[derive(Default)]
pub(super) struct State {
    waiting: VecDeque<ShadeRequest>,
    in_flight: usize,
    fresh: Vec<ShadedPoint>,
    stale: Vec<ShadedPoint>,
    met: Encounters,
    /// How often the scene has changed.
    epoch: u64,
    counts: PoolCounts,
    pub(super) last_error: Option<String>,
    /// Failures since the last success.
    failures: u32,
    threads: usize,
    stop: bool,
}

impl Shared {
    pub(super) fn new(settings: &PoolSettings) -> Self {
        Self {
            state: Mutex::default(),
            work: Condvar::new(),
            done: Condvar::new(),
            queue: settings.queue.max(1),
            results: settings.results.max(1),
            batch: settings.batch.max(1),
            overflow: settings.overflow,
            seed: settings.seed,
        }
    }

    /// A thread that panicked while holding the lock left nothing half done that matters.
    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn enter(&self) {
        self.lock().threads += 1;
    }

    pub(super) fn leave(&self) {
        self.lock().threads -= 1;
        self.done.notify_all();
    }

    pub(super) fn submit(&self, requests: &[ShadeRequest]) -> usize {
        let mut state = self.lock();
        let room = self.queue - state.waiting.len();
        // Of more than the queue holds, the last are the ones that stay.
        let (taken, dropped) = match self.overflow {
            Overflow::Refuse => {
                let taken = &requests[..requests.len().min(room)];
                (taken, requests.len() - taken.len())
            }
            Overflow::DropOldest => {
                let taken = &requests[requests.len().saturating_sub(self.queue)..];
                let over = taken.len().saturating_sub(room);
                state.waiting.drain(..over);
                (taken, requests.len() - taken.len() + over)
            }
        };
        state.waiting.extend(taken);
        state.counts.requested += requests.len() as u64;
        state.counts.dropped += dropped as u64;
        drop(state);
        self.work.notify_all();
        dropped
    }

    pub(super) fn forget(&self) -> usize {
        let mut state = self.lock();
        let count = state.waiting.len();
        state.waiting.clear();
        state.counts.dropped += count as u64;
        drop(state);
        self.done.notify_all();
        count
    }

    /// The lists of `harvest` are empty and change places with the full ones.
    pub(super) fn collect(&self, harvest: &mut Harvest) {
        let mut state = self.lock();
        std::mem::swap(&mut state.fresh, &mut harvest.fresh);
        std::mem::swap(&mut state.stale, &mut harvest.stale);
        std::mem::swap(&mut state.met, &mut harvest.met);
    }

    pub(super) fn age(&self) {
        let mut state = self.lock();
        state.epoch += 1;
        let State {
            fresh, stale, counts, ..
        } = &mut *state;
        stale.append(fresh);
        counts.lost += trim(stale, self.results);
    }

    pub(super) fn status(&self) -> PoolStatus {
        let state = self.lock();
        PoolStatus {
            counts: state.counts,
            waiting: state.waiting.len(),
            in_flight: state.in_flight,
            threads: state.threads,
            last_error: state.last_error.clone(),
        }
    }

    pub(super) fn stop(&self) {
        self.lock().stop = true;
        self.work.notify_all();
        self.done.notify_all();
    }

    pub(super) fn wait_idle(&self, until: Instant) -> bool {
        self.wait(until, |state| {
            (state.waiting.is_empty() || state.threads == 0) && state.in_flight == 0
        })
    }

    pub(super) fn wait_gone(&self, until: Instant) -> bool {
        self.wait(until, |state| state.threads == 0)
    }

    fn wait(&self, until: Instant, ready: impl Fn(&State) -> bool) -> bool {
        let mut state = self.lock();
        loop {
            if ready(&state) {
                return true;
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            state = self
                .done
                .wait_timeout(state, left)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }

    /// Waits for requests and takes a batch of `most` at most; `None` at the end. Returns the epoch of the scene with it.
    fn take(&self, batch: &mut Vec<ShadeRequest>, most: usize) -> Option<u64> {
        batch.clear();
        let mut state = self.lock();
        while state.waiting.is_empty() && !state.stop {
            state = self.work.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if state.stop {
            return None;
        }
        let count = most.min(state.waiting.len());
        batch.extend(state.waiting.drain(..count));
        state.in_flight += count;
        Some(state.epoch)
    }

    /// Takes over what a batch gave.
    fn give(&self, asked: usize, epoch: u64, job: &mut Job, outcome: Outcome) {
        let Job { points, met, .. } = job;
        let before = points.len();
        points.truncate(asked);
        points.retain(is_usable);
        let mut state = self.lock();
        state.in_flight -= asked;
        state.counts.unusable += (before - points.len()) as u64;
        state.counts.shaded += points.len() as u64;
        match outcome {
            Outcome::Done => state.failures = 0,
            Outcome::Failed(error) => {
                state.counts.errors += 1;
                state.failed(asked - points.len(), error);
            }
            Outcome::Panicked(message) => {
                state.counts.panics += 1;
                state.failed(asked - points.len(), message);
            }
        }
        let current = epoch == state.epoch;
        let list = if current {
            &mut state.fresh
        } else {
            &mut state.stale
        };
        list.extend_from_slice(points);
        let lost = trim(list, self.results);
        state.counts.lost += lost;
        state.met.triples.extend_from_slice(&met.triples);
        state.met.objects.extend_from_slice(&met.objects);
        // A pile that is full of repetitions is thinned out without holding the lock.
        let pile = state.met.triples.len() + state.met.objects.len();
        let mut thin = (pile > MET_PILE).then(|| std::mem::take(&mut state.met));
        drop(state);
        self.done.notify_all();
        if let Some(thin) = &mut thin {
            thin.settle();
            let mut state = self.lock();
            state.met.triples.append(&mut thin.triples);
            state.met.objects.append(&mut thin.objects);
        }
    }

    /// After failures in a row: waits a while, so that a dead shader does not keep a core busy.
    fn pause(&self) {
        let mut state = self.lock();
        if state.failures == 0 {
            return;
        }
        let pause = PAUSES
            .0
            .saturating_mul(1 << (state.failures - 1).min(16))
            .min(PAUSES.1);
        let until = Instant::now() + pause;
        while !state.stop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            // Woken by new requests too; the pause goes on.
            state = self
                .work
                .wait_timeout(state, left)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }
}

impl State {
    fn failed(&mut self, requests: usize, message: String) {
        self.failures = self.failures.saturating_add(1);
        self.counts.failed += requests as u64;
        self.last_error = Some(message);
    }
}

/// Drops the oldest beyond `limit` and says how many.
fn trim(points: &mut Vec<ShadedPoint>, limit: usize) -> u64 {
    let over = points.len().saturating_sub(limit);
    points.drain(..over);
    over as u64
}

fn is_usable(point: &ShadedPoint) -> bool {
    point.position.is_finite()
        && point.normal.is_finite()
        && point.albedo.is_finite()
        && point.colour.is_finite()
}

pub(super) enum Outcome {
    Done,
    Failed(String),
    Panicked(String),
}

/// Memory of one thread.
#[derive(Default)]
pub(super) struct Job {
    pub(super) scratch: ShaderScratch,
    pub(super) points: Vec<ShadedPoint>,
    pub(super) met: Encounters,
}

impl Job {
    /// Shades a batch; a panic is caught, and what was made until then is forgotten.
    pub(super) fn shade(&mut self, shader: &dyn Shader, batch: &[ShadeRequest], seed: u64) -> Outcome {
        self.points.clear();
        self.met.clear();
        let Self { scratch, points, met } = self;
        // Whatever a panic leaves behind in these is thrown away below.
        let shaded = catch_unwind(AssertUnwindSafe(|| {
            shader.shade(batch, seed, scratch, points, met)
        }));
        match shaded {
            Ok(Ok(())) => Outcome::Done,
            Ok(Err(error)) => Outcome::Failed(format!("{}: {error}", shader.name())),
            Err(payload) => {
                *self = Self::default();
                Outcome::Panicked(format!("{} panicked: {}", shader.name(), message(&*payload)))
            }
        }
    }
}

/// What a panic said.
fn message(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("without a message")
}

/// The life of a thread.
pub(super) fn run(shader: &dyn Shader, shared: &Shared) {
    /// Counts the thread out however it ends.
    struct Leave<'a>(&'a Shared);
    impl Drop for Leave<'_> {
        fn drop(&mut self) {
            self.0.leave();
        }
    }
    let _leave = Leave(shared);
    loop {
        // Panics in a shader are caught around each batch. What is left are those in its panic's own clean-up.
        let Err(payload) = catch_unwind(AssertUnwindSafe(|| work(shader, shared))) else {
            return;
        };
        // Not dropped: whatever made the clean-up panic could do so again.
        std::mem::forget(payload);
        let mut state = shared.lock();
        state.counts.restarts += 1;
        state.failed(0, "a shader thread died and was started again".to_owned());
    }
}

fn work(shader: &dyn Shader, shared: &Shared) {
    /// Counts a batch as failed unless it has been given back.
    struct Open<'a>(&'a Shared, usize);
    impl Drop for Open<'_> {
        fn drop(&mut self) {
            let mut state = self.0.lock();
            state.in_flight -= self.1;
            state.counts.failed += self.1 as u64;
            drop(state);
            self.0.done.notify_all();
        }
    }
    let mut batch = Vec::with_capacity(shared.batch);
    let mut job = Job::default();
    let most = shared.batch.min(shader.portion()).max(1);
    while let Some(epoch) = shared.take(&mut batch, most) {
        let open = Open(shared, batch.len());
        let outcome = job.shade(shader, &batch, shared.seed);
        std::mem::forget(open);
        shared.give(batch.len(), epoch, &mut job, outcome);
        shared.pause();
    }
}
