//! The view without its window: input in, pixels out.

mod input;
mod show;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use llsr_epr::{
    BlindInterpolation, FrameRenderer, FrameReport, FrameSettings, Harvest, PoolSettings, ShaderPool,
    ShadowThread, shade_lockstep,
};
use llsr_scene::{Camera, LightId, ObjectId, Viewport};
use llsr_shading::{Encounters, Place, ShadeRequest, Shader, World};

pub use input::Button;

use crate::canvas::{Canvas, ToneTable};
use crate::grip::Grip;
use crate::jobs::{Job, Trace, Traced, trace_picture};
use crate::keys::Flight;
use crate::pace::{Budget, FrameTimes};
use crate::record::Recorder;
use crate::rig::{Rig, Steering};
use crate::settings::{ShaderChoice, ViewError, ViewReport, ViewSettings};

/// How long the first picture of a shader may be prepared.
const WARM_UP: Duration = Duration::from_millis(300);
/// One pixel in so many is shaded for it.
const WARM_UP_SHARE: usize = 16;
/// Requests that lie all over the picture, and then as many others. So many are shaded for the first picture between two looks
/// at the clock, as many again each time.
const CHUNK: usize = 256;
/// Longest time that one frame may stand for (s): after a pause one does not fly through a wall.
const LONGEST_STEP: f64 = 0.1;
/// How long a pool that is no longer wanted may hold up the display.
const PATIENCE: Duration = Duration::from_millis(250);

/// What is shown in place of or over the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Shown {
    help: bool,
    numbers: bool,
    edges: bool,
    samples: bool,
    reach: bool,
    blind: bool,
    ray_trace: bool,
    lights: bool,
}

impl Shown {
    /// What differs from the plain picture, with the keys that switch it off again.
    fn names(self) -> Vec<&'static str> {
        [
            (self.ray_trace, "ray tracing (T)"),
            (self.blind && !self.ray_trace, "blind interpolation (B)"),
            (self.samples, "samples (P)"),
            (self.reach, "reach (R)"),
            (self.edges, "edges (G)"),
            (self.lights, "lights (L)"),
        ]
        .into_iter()
        .filter_map(|(on, name)| on.then_some(name))
        .collect()
    }
}

/// What the mouse is doing.
#[derive(Debug)]
enum Gesture {
    Turn,
    /// Around a point.
    Orbit(DVec3),
    /// In the picture's plane, at that distance.
    Pan(f64),
    /// Something is held; has the pointer moved since it was put there last?
    Drag(Box<Grip>, bool),
}

/// Plain ray tracing.
#[derive(Default)]
struct Tracing {
    job: Option<Job<Option<Result<Traced, String>>>>,
    /// What the job, or the finished picture, was made of.
    of: Option<(Camera, Arc<World>, Viewport)>,
    done: Option<Traced>,
}

/// A view of a world: keys and mouse go in, frames come out.
///
/// It knows no window, so that it can be tested and driven by anything. [`frame`](Self::frame) runs on the calling thread
/// and does not wait for shaders, which have threads of their own.
pub struct Engine {
    settings: ViewSettings,
    shaders: Vec<ShaderChoice>,
    home: (Camera, Arc<World>),
    world: Arc<World>,
    rig: Rig,
    steering: Steering,
    viewport: Viewport,
    renderer: FrameRenderer,
    blind: Option<BlindInterpolation>,
    shader: Arc<dyn Shader>,
    chosen: usize,
    pool: ShaderPool,
    harvest: Harvest,
    shadows: ShadowThread,
    /// The requests of a frame in the order in which they are handed in.
    spread: Vec<ShadeRequest>,
    budget: Budget,
    samples: usize,
    shown: Shown,
    table: ToneTable,
    exposure: f64,
    canvas: Canvas,
    pointer: (f64, f64),
    gesture: Option<Gesture>,
    flight: Vec<Flight>,
    recorder: Option<Recorder>,
    saving: Option<Job<Result<PathBuf, String>>>,
    tracing: Tracing,
    message: Option<(u32, String, Instant)>,
    times: FrameTimes,
    report: ViewReport,
    quit: bool,
}

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Engine")
            .field("viewport", &self.viewport)
            .field("camera", self.rig.camera())
            .field("shader", &self.shaders[self.chosen].name)
            .finish_non_exhaustive()
    }
}

impl Engine {
    /// Begins a view of `world` through `camera` with the first of `shaders`.
    ///
    /// A few percent of the pixels are shaded before this returns, with all threads of the current rayon pool and for a few
    /// tenths of a second at most, so that the first frame has something to show. Objects that the world lets
    /// move can be dragged, and all lights.
    ///
    /// # Errors
    /// [`ViewError`]: no shader, one that cannot be made, a size that does not suit, no threads.
    pub fn new(
        world: Arc<World>,
        camera: Camera,
        viewport: Viewport,
        shaders: Vec<ShaderChoice>,
        settings: ViewSettings,
    ) -> Result<Self, ViewError> {
        let first = shaders.first().ok_or(ViewError::NoShader)?;
        let shader = (first.make)(Arc::clone(&world)).map_err(ViewError::Shader)?;
        let frames = FrameSettings {
            shadows_apart: true,
            ..settings.frames
        };
        let renderer = FrameRenderer::new(world.scene(), viewport, frames)?;
        let pool = start_pool(&shader, &settings).map_err(ViewError::Thread)?;
        let shadows = ShadowThread::start().map_err(|error| ViewError::Thread(error.to_string()))?;
        // Once through the scene in six seconds.
        let speed = f64::from(world.bounds().diagonal()) / 6.0;
        let speed = if speed > 0.0 { speed } else { 1.0 };
        let exposure = settings.exposure.unwrap_or(0.0);
        let mut engine = Self {
            table: ToneTable::new(settings.tone, exposure),
            exposure,
            home: (camera.clone(), Arc::clone(&world)),
            rig: Rig::new(camera, speed),
            steering: Steering::default(),
            viewport,
            renderer,
            blind: None,
            shader,
            chosen: 0,
            pool,
            harvest: Harvest::default(),
            shadows,
            spread: Vec::new(),
            budget: Budget::default(),
            samples: settings.samples.max(1),
            shown: Shown {
                numbers: true,
                ..Shown::default()
            },
            canvas: Canvas::new(viewport.width, viewport.height),
            pointer: (0.5 * f64::from(viewport.width), 0.5 * f64::from(viewport.height)),
            gesture: None,
            flight: Vec::new(),
            recorder: None,
            saving: None,
            tracing: Tracing::default(),
            message: None,
            times: FrameTimes::default(),
            report: ViewReport::default(),
            quit: false,
            world,
            shaders,
            settings,
        };
        engine.warm_up();
        engine.renderer.draw(engine.rig.camera(), 0);
        if engine.settings.exposure.is_none() {
            engine.expose_automatically();
        }
        engine.say_help();
        Ok(engine)
    }

    /// The pixels of the last frame.
    pub fn canvas(&self) -> &Canvas {
        &self.canvas
    }

    /// The camera as it stands.
    pub fn camera(&self) -> &Camera {
        self.rig.camera()
    }

    /// The world as it stands.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// Has the user asked to end?
    pub fn wants_to_quit(&self) -> bool {
        self.quit
    }

    /// What has happened so far.
    pub fn report(&self) -> ViewReport {
        let status = self.pool.status();
        let earlier = &self.report;
        ViewReport {
            frames_per_second: self.times.per_second(),
            median_frame_ms: self.times.median_ms(),
            samples: earlier.samples + status.counts.shaded,
            shader_errors: earlier.shader_errors + status.counts.errors + status.counts.panics,
            last_error: status.last_error.or_else(|| earlier.last_error.clone()),
            ..earlier.clone()
        }
    }

    /// What the last frame was made of, and how long its stages took.
    pub fn last_frame(&self) -> &FrameReport {
        self.renderer.report()
    }

    /// Pairs of light and blocker whose shadows have no edges yet.
    pub fn shadows_waiting(&self) -> usize {
        self.renderer.shadow_pairs_waiting()
    }

    /// Notes that the last frame is on the screen.
    pub fn shown_on_screen(&mut self) {
        let started = self.settings.started;
        self.report
            .first_picture_seconds
            .get_or_insert_with(|| started.elapsed().as_secs_f64());
    }

    /// Makes pictures of another size from now on. A size that does not suit keeps the old one.
    pub fn resize(&mut self, viewport: Viewport) {
        if viewport == self.viewport {
            return;
        }
        match self.renderer.resize(viewport) {
            Ok(()) => {
                self.viewport = viewport;
                self.blind = None;
                self.tracing = Tracing::default();
                self.pool.forget();
                // What was held is elsewhere in the picture now.
                self.gesture = None;
            }
            Err(error) => self.complain(error.to_string()),
        }
    }

    /// The next frame, `seconds` after the one before.
    pub fn frame(&mut self, seconds: f64) {
        let start = Instant::now();
        self.fly(seconds.clamp(0.0, LONGEST_STEP));
        self.take_points(start);
        self.drag();
        let status = self.pool.status();
        let ask = if self.shown.ray_trace {
            0
        } else {
            self.budget
                .ask(self.samples, status.waiting, self.times.interval())
        };
        self.renderer.draw(self.rig.camera(), ask);
        spread(self.renderer.requests(), &mut self.spread);
        self.pool.submit(&self.spread);
        if let Some(recorder) = &mut self.recorder {
            recorder.frame(self.rig.camera(), seconds);
        }
        self.look_after_jobs();
        self.present(&status);
        self.report.frames += 1;
        let end = Instant::now();
        let stages = self.renderer.report().ms;
        self.times.push(end, (end - start).as_secs_f64() * 1e3, stages);
    }

    /// Takes in what the shaders answered. What was shaded before something moved is left out: it may be wrong.
    fn take_points(&mut self, now: Instant) {
        self.pool.collect(&mut self.harvest);
        self.renderer.take(&self.harvest.fresh, &self.harvest.met);
        self.shadows.tend(&mut self.renderer);
        self.budget.watch(now, self.pool.status().counts.shaded);
    }

    /// Puts what is held under the pointer.
    fn drag(&mut self) {
        let Some(Gesture::Drag(grip, moved)) = &mut self.gesture else {
            return;
        };
        if !std::mem::take(moved) {
            return;
        }
        let (x, y) = self.pointer;
        if let Some(place) = grip.drag(self.rig.camera(), self.viewport, x, y) {
            self.put(&[place]);
        }
    }

    /// Puts things elsewhere, for the display and for the shaders.
    fn put(&mut self, places: &[Place]) {
        match self.world.moved(places) {
            Ok(change) => {
                self.pool.changed(&change);
                self.renderer.changed(&change);
                self.world = change.world;
                self.report.moves += 1;
            }
            Err(error) => self.complain(error.to_string()),
        }
    }

    /// Everything that was dragged back to where it was at first.
    fn restore(&mut self) {
        let first = Arc::clone(&self.home.1);
        let objects = (0..first.scene().objects.len()).map(ObjectId::from);
        let moved = objects.filter(|&id| first.transform(id) != self.world.transform(id));
        let mut places: Vec<Place> = moved.map(|id| Place::Object(id, *first.transform(id))).collect();
        let lights = first.lights().iter().zip(self.world.lights()).enumerate();
        places.extend(
            lights
                .filter(|(_, (before, now))| before != now)
                .map(|(i, (before, _))| Place::Light(LightId::from(i), before.clone())),
        );
        self.gesture = None;
        if !places.is_empty() {
            self.put(&places);
        }
    }

    /// Shades some pixels of the view at once, spread over the picture.
    fn warm_up(&mut self) {
        let start = Instant::now();
        let count = self.viewport.pixels().div_ceil(WARM_UP_SHARE).max(1);
        self.renderer.draw(self.rig.camera(), count);
        spread(self.renderer.requests(), &mut self.spread);
        let (mut points, mut met) = (Vec::new(), Encounters::default());
        let mut rest = &self.spread[..];
        let mut chunk = CHUNK;
        while !rest.is_empty() && start.elapsed() < WARM_UP {
            let (now, later) = rest.split_at(chunk.min(rest.len()));
            let seed = self.settings.frames.seed;
            let trouble = shade_lockstep(&*self.shader, now, seed, &mut points, &mut met);
            if let Some(error) = trouble.last_error {
                self.report.shader_errors += (trouble.errors + trouble.panics) as u64;
                self.report.last_error = Some(error);
                break;
            }
            rest = later;
            chunk += CHUNK;
        }
        self.renderer.take(&points, &met);
        self.report.samples += points.len() as u64;
    }

    /// Goes on with another shader.
    fn change_shader(&mut self, index: usize) {
        let shader = match (self.shaders[index].make)(Arc::clone(&self.world)) {
            Ok(shader) => shader,
            Err(error) => {
                self.complain(format!("{}: {error}", self.shaders[index].name));
                return;
            }
        };
        match start_pool(&shader, &self.settings) {
            Ok(pool) => {
                self.report = self.report();
                self.pool = pool;
                self.shader = shader;
                self.chosen = index;
                self.budget = Budget::default();
                self.tracing = Tracing::default();
                self.renderer.forget();
                self.warm_up();
            }
            Err(error) => self.complain(error),
        }
    }

    /// Looks whether work beside the display is done.
    fn look_after_jobs(&mut self) {
        match self.saving.as_ref().and_then(Job::poll) {
            None => {}
            Some(Ok(Ok(path))) => {
                self.saving = None;
                self.say(format!("saved {}", path.display()));
                self.report.files.push(path);
            }
            Some(Ok(Err(error))) => {
                self.saving = None;
                self.complain(format!("the picture was not saved: {error}"));
            }
            Some(Err(())) => {
                self.saving = None;
                self.complain("the picture was not saved: its thread died".to_owned());
            }
        }
        if !self.shown.ray_trace {
            self.tracing = Tracing::default();
            return;
        }
        match self.tracing.job.as_ref().and_then(Job::poll) {
            None => {}
            Some(outcome) => {
                self.tracing.job = None;
                match outcome {
                    Ok(Some(Ok(traced))) => self.tracing.done = Some(traced),
                    Ok(None) => {}
                    Ok(Some(Err(error))) => self.complain(format!("the shader failed: {error}")),
                    Err(()) => self.complain("ray tracing died".to_owned()),
                }
            }
        }
        let of = (self.rig.camera().clone(), Arc::clone(&self.world), self.viewport);
        let same = |(camera, world, viewport): &(Camera, Arc<World>, Viewport)| {
            *camera == of.0 && Arc::ptr_eq(world, &of.1) && *viewport == of.2
        };
        if self.tracing.job.is_none() && !self.tracing.of.as_ref().is_some_and(same) {
            let trace = Trace {
                shader: Arc::clone(&self.shader),
                camera: of.0.clone(),
                viewport: self.viewport,
                seed: self.settings.frames.seed,
            };
            match trace_picture(trace) {
                Ok(job) => self.tracing.job = Some(job),
                Err(error) => self.complain(error.to_string()),
            }
            self.tracing.of = Some(of);
        }
    }
}

/// Puts requests in an order in which the first ones lie everywhere, for a slow shader may not get to the last.
fn spread(requests: &[ShadeRequest], out: &mut Vec<ShadeRequest>) {
    out.clear();
    let rounds = requests.len().div_ceil(CHUNK).max(1);
    for round in 0..rounds {
        out.extend(requests.iter().skip(round).step_by(rounds));
    }
}

fn start_pool(shader: &Arc<dyn Shader>, settings: &ViewSettings) -> Result<ShaderPool, String> {
    let pool = PoolSettings {
        threads: settings.shader_threads.max(1),
        seed: settings.frames.seed,
        patience: PATIENCE,
        ..PoolSettings::default()
    };
    ShaderPool::new(Arc::clone(shader), &pool).map_err(|error| error.to_string())
}
