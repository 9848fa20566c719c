//! Frames in lockstep with a shader: what is asked for in one frame is there in the next.

use llsr_epi::Picture;
use llsr_scene::{Camera, Viewport};
use llsr_shading::{Encounters, ShadeRequest, ShadedPoint, Shader};

use crate::frame::{FrameRenderer, ShadowWork};
use crate::pool::{Lockstep, shade_lockstep};

/// A renderer in lockstep with a shader: a frame is [drawn](Self::draw) on the calling thread, then what it asks for is
/// [shaded](Self::shade) with all threads of the current rayon pool, for the next frame. Or both go on beside each other:
/// [`draw_and_shade`](Self::draw_and_shade).
///
/// Same seed, same cameras, same bits, for any number of threads.
///
/// ```
/// use std::sync::Arc;
///
/// use llsr_epr::{CameraPath, FrameRenderer, FrameSettings, LockstepRenderer};
/// use llsr_scene::{Viewport, demo};
/// use llsr_shading::{DirectShader, World};
///
/// let (world, _) = World::new(Arc::new(demo::build("subway").unwrap()), &[]);
/// let scene = Arc::clone(world.scene());
/// let viewport = Viewport { width: 80, height: 60 };
/// let shader = DirectShader::new(Arc::new(world), glam::Vec3::ZERO);
/// let renderer = FrameRenderer::new(&scene, viewport, FrameSettings::default())?;
/// let mut lockstep = LockstepRenderer::new(renderer, viewport.pixels() / 100);
/// let path = CameraPath::default_walk(&scene.cameras[0], 5, 10.0);
/// lockstep.warm_up(&shader, &path.cameras[0]);
/// for camera in &path.cameras {
///     lockstep.draw(camera);
///     lockstep.shade(&shader);
/// }
/// assert_eq!(lockstep.renderer.report().holes, 0);
/// # Ok::<(), llsr_epr::FrameError>(())
/// ```
#[derive(Debug)]
pub struct LockstepRenderer {
    /// The renderer.
    pub renderer: FrameRenderer,
    /// Requests a frame.
    pub samples: usize,
    points: Vec<ShadedPoint>,
    met: Encounters,
    /// What the last frame of [`draw_and_shade`](Self::draw_and_shade) asked for.
    open: Vec<ShadeRequest>,
    trouble: Lockstep,
}

/// Share of the pixels that are shaded before the first frame, so that it is not empty.
const FIRST_SHARE: usize = 16;

impl LockstepRenderer {
    /// Begins with no points.
    pub fn new(renderer: FrameRenderer, samples: usize) -> Self {
        Self {
            renderer,
            samples,
            points: Vec::new(),
            met: Encounters::default(),
            open: Vec::new(),
            trouble: Lockstep::default(),
        }
    }

    /// Draws and shades one pixel in 16 of the view of `camera` before the first frame, so that this has something to show.
    /// Returns how many points came.
    pub fn warm_up(&mut self, shader: &dyn Shader, camera: &Camera) -> usize {
        let count = self.renderer.viewport().pixels().div_ceil(FIRST_SHARE).max(1);
        self.renderer.draw(camera, count);
        self.shade(shader)
    }

    /// Shades what the last frame asked for and takes the answers in. Returns how many points came. With
    /// [`FrameSettings::shadows_apart`](crate::FrameSettings::shadows_apart) shadow edges are computed beside that, for the next frame like the points.
    ///
    /// What goes wrong is counted; the picture goes on with what there is.
    pub fn shade(&mut self, shader: &dyn Shader) -> usize {
        self.open.clear();
        self.open.extend_from_slice(self.renderer.requests());
        self.shade_beside(shader, |_| ())
    }

    /// Draws the next frame while what the one before asked for is shaded with the other threads of the current rayon pool, as
    /// a display and its shader run beside each other. So answers come one frame later than with [`draw`](Self::draw) and
    /// [`shade`](Self::shade) in turn ([`FrameSettings::latency`](crate::FrameSettings::latency) should be 1), and a frame takes as long as the
    /// display thread or half of all work, whichever is longer. Returns how many points came, for the next frame.
    ///
    /// Same seed, same cameras, same bits, for any number of threads.
    pub fn draw_and_shade(&mut self, shader: &dyn Shader, camera: &Camera) -> usize {
        let samples = self.samples;
        let count = self.shade_beside(shader, |renderer| renderer.draw(camera, samples));
        self.open.extend_from_slice(self.renderer.requests());
        count
    }

    /// Shades the open requests and computes shadow edges, and does something else beside it.
    fn shade_beside(&mut self, shader: &dyn Shader, other: impl FnOnce(&mut FrameRenderer) + Send) -> usize {
        let seed = self.renderer.settings().seed;
        self.points.clear();
        self.met.clear();
        let mut work = if self.renderer.settings().shadows_apart {
            self.renderer.shadow_work()
        } else {
            None
        };
        let (points, met, renderer) = (&mut self.points, &mut self.met, &mut self.renderer);
        let open = &self.open;
        let ((), (report, ())) = rayon::join(
            || other(renderer),
            || {
                rayon::join(
                    || shade_lockstep(shader, open, seed, points, met),
                    || work.iter_mut().for_each(ShadowWork::run),
                )
            },
        );
        self.open.clear();
        if let Some(work) = work {
            self.renderer.shadow_work_done(work);
        }
        self.trouble.failed += report.failed;
        self.trouble.errors += report.errors;
        self.trouble.panics += report.panics;
        self.trouble.last_error = report.last_error.or(self.trouble.last_error.take());
        self.renderer.take(&self.points, &self.met);
        self.points.len()
    }

    /// Makes the picture of the next frame.
    pub fn draw(&mut self, camera: &Camera) {
        self.renderer.draw(camera, self.samples);
    }

    /// What went wrong with the shader so far.
    pub fn trouble(&self) -> &Lockstep {
        &self.trouble
    }
}

/// Shades every pixel of a picture, `side` x `side` evenly spaced rays each, with the threads of the current rayon pool.
///
/// `side` 1 is the ray tracer that frames are compared with, 8 a reference. The same bits for any number of threads. Rays whose points are
/// [provisional](ShadedPoint::provisional) are asked for again until they are not, for some seconds at most.
///
/// # Errors
/// What the shader says, if it fails or panics.
pub fn ray_trace(
    shader: &dyn Shader,
    camera: &Camera,
    viewport: Viewport,
    side: u32,
    seed: u64,
) -> Result<Picture, String> {
    let mut picture = Picture::new(viewport.width, viewport.height);
    let (mut points, mut met) = (Vec::new(), Encounters::default());
    let mut requests = Vec::new();
    let subsamples = (side * side) as usize;
    let width = u64::from(viewport.width);
    // Some rows at a time, so that memory stays small.
    let rows = (1 << 18) / (viewport.width as usize * subsamples) + 1;
    for first in (0..viewport.height).step_by(rows) {
        let band = first..(first + rows as u32).min(viewport.height);
        requests.clear();
        for y in band.clone() {
            for x in 0..viewport.width {
                for sub in 0..side * side {
                    let [dx, dy] = [sub % side, sub / side].map(|i| (f64::from(i) + 0.5) / f64::from(side));
                    let (origin, direction) = camera.ray(viewport, f64::from(x) + dx, f64::from(y) + dy);
                    let pixel = u64::from(y) * width + u64::from(x);
                    requests.push(ShadeRequest {
                        id: pixel * subsamples as u64 + u64::from(sub),
                        origin,
                        direction,
                    });
                }
            }
        }
        points.clear();
        met.clear();
        let report = shade_lockstep(shader, &requests, seed, &mut points, &mut met);
        if let Some(error) = report.last_error {
            return Err(error);
        }
        settle(shader, &requests, seed, &mut points);
        // A shader that leaves rays out darkens nothing: pixels are means of what came.
        let pixel_of = |point: &ShadedPoint| point.id / subsamples as u64;
        for points in points.chunk_by(|a, b| pixel_of(a) == pixel_of(b)) {
            let sum = points.iter().map(|p| p.colour.as_dvec3()).sum::<glam::DVec3>();
            let pixel = pixel_of(&points[0]);
            let (x, y) = ((pixel % width) as u32, (pixel / width) as u32);
            if x < viewport.width && y < viewport.height {
                picture.set_pixel(x, y, (sum / points.len() as f64).as_vec3());
            }
        }
    }
    Ok(picture)
}

/// Times that a ray is asked for again.
const ROUNDS: usize = 10_000;

/// Asks once more for what is provisional; `points` are answers to `requests`, whose ids are in rising order.
fn settle(shader: &dyn Shader, requests: &[ShadeRequest], seed: u64, points: &mut [ShadedPoint]) {
    let (mut again, mut better) = (Vec::new(), Vec::new());
    let mut met = Encounters::default();
    for _ in 0..ROUNDS {
        let open = points.iter().filter(|point| point.provisional);
        again.clear();
        again.extend(open.filter_map(|point| {
            let at = requests.binary_search_by_key(&point.id, |request| request.id);
            at.ok().map(|at| requests[at])
        }));
        if again.is_empty() {
            return;
        }
        better.clear();
        met.clear();
        let report = shade_lockstep(shader, &again, seed, &mut better, &mut met);
        if report.last_error.is_some() || better.len() != again.len() {
            return;
        }
        let open = points.iter_mut().filter(|point| point.provisional);
        open.zip(&better).for_each(|(point, better)| *point = *better);
    }
}
