//! Work beside the display: finished pictures, and plain ray tracing.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::thread;

use glam::Vec3;
use llsr_epi::Picture;
use llsr_epr::shade_lockstep;
use llsr_io::{Development, Image};
use llsr_scene::{Camera, Viewport};
use llsr_shading::{Encounters, ShadeRequest, Shader};

/// Counts steps done; false: give up.
type Step = dyn Fn(u64) -> bool;

/// A thread that makes one thing and can be told to give up.
///
/// Dropping it tells it; the thread then ends by itself soon, and whatever it would have written is not.
#[derive(Debug)]
pub(crate) struct Job<T> {
    result: Receiver<T>,
    stop: Arc<AtomicBool>,
    steps: Arc<AtomicU64>,
    all: u64,
}

impl<T: Send + 'static> Job<T> {
    /// Starts a thread; `work` gets a function that adds to the steps done, of
    /// `all`, and returns false when it should give up.
    fn start(name: &str, all: u64, work: impl FnOnce(&Step) -> T + Send + 'static) -> std::io::Result<Self> {
        let (send, result) = mpsc::channel();
        let (stop, steps) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let (stop_too, steps_too) = (Arc::clone(&stop), Arc::clone(&steps));
        thread::Builder::new().name(name.to_owned()).spawn(move || {
            let step = move |share: u64| {
                steps_too.fetch_add(share, Ordering::Relaxed);
                !stop_too.load(Ordering::Relaxed)
            };
            // Nobody waits any more if this fails.
            let _ = send.send(work(&step));
        })?;
        Ok(Self {
            result,
            stop,
            steps,
            all,
        })
    }

    /// What came of it, once: `Err` if the thread died.
    pub(crate) fn poll(&self) -> Option<Result<T, ()>> {
        match self.result.try_recv() {
            Ok(result) => Some(Ok(result)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(())),
        }
    }

    /// Share done, in [0, 1].
    pub(crate) fn share(&self) -> f64 {
        (self.steps.load(Ordering::Relaxed) as f64 / self.all.max(1) as f64).min(1.0)
    }
}

impl<T> Drop for Job<T> {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// How finished pictures are made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureSettings {
    /// Rays through a pixel, at least 1; raised to the next square, so that they are spread evenly.
    pub spp: u32,
    /// Beginning of the files' names, with the folder: `llsr-view` gives `llsr-view.png`, then `llsr-view-2.png`.
    pub stem: PathBuf,
}

impl Default for PictureSettings {
    fn default() -> Self {
        Self {
            spp: 16,
            stem: PathBuf::from("llsr-view"),
        }
    }
}

/// The first name of `stem`, `stem-2`, ... with that extension that no file has.
pub(crate) fn free_name(stem: &Path, extension: &str) -> PathBuf {
    let named = |number: u32| {
        let mut name = stem.as_os_str().to_owned();
        if number > 1 {
            name.push(format!("-{number}"));
        }
        name.push(format!(".{extension}"));
        PathBuf::from(name)
    };
    let free = (1..=9999).map(named).find(|path| !path.exists());
    free.unwrap_or_else(|| named(10_000))
}

/// What to shade every pixel of.
pub(crate) struct Trace {
    pub(crate) shader: Arc<dyn Shader>,
    pub(crate) camera: Camera,
    pub(crate) viewport: Viewport,
    pub(crate) seed: u64,
}

/// Shades every pixel, several times each, and writes a PNG; the result is the file's name or what went wrong.
pub(crate) fn save_picture(
    trace: Trace,
    settings: &PictureSettings,
    development: Development,
) -> std::io::Result<Job<Result<PathBuf, String>>> {
    let settings = settings.clone();
    let side = f64::from(settings.spp.max(1)).sqrt().ceil() as u32;
    Job::start("picture", trace.bands(), move |step| {
        let picture = trace
            .run(side, step)
            .ok_or_else(|| "given up".to_owned())?
            .map_err(|error| format!("the shader failed: {error}"))?;
        let (width, height) = picture.size();
        let pixels: Vec<_> = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| picture.pixel(x, y))
            .collect();
        let image = Image::from_rgb(width as usize, height as usize, &pixels);
        let path = free_name(&settings.stem, "png");
        llsr_io::write_png(&path, &image, development).map_err(|error| error.to_string())?;
        Ok(path)
    })
}

/// A picture of one ray a pixel, with its time in seconds.
pub(crate) struct Traced {
    pub(crate) picture: Picture,
    pub(crate) seconds: f64,
}

/// Shades every pixel once; the answer is `None` if it was given up, or what the shader says if it fails.
pub(crate) fn trace_picture(trace: Trace) -> std::io::Result<Job<Option<Result<Traced, String>>>> {
    Job::start("ray tracing", trace.bands(), move |step| {
        let start = std::time::Instant::now();
        let picture = trace.run(1, step)?;
        let seconds = start.elapsed().as_secs_f64();
        Some(picture.map(|picture| Traced { picture, seconds }))
    })
}

/// Rows that are shaded between two looks at whether to stop.
const BAND: u32 = 4;

impl Trace {
    fn bands(&self) -> u64 {
        u64::from(self.viewport.height.div_ceil(BAND))
    }

    /// The means of `side` x `side` evenly spaced rays through each pixel; `None` if `step` says to give up.
    fn run(&self, side: u32, step: &Step) -> Option<Result<Picture, String>> {
        let Self {
            shader,
            camera,
            viewport,
            seed,
        } = self;
        let mut picture = Picture::new(viewport.width, viewport.height);
        let (mut points, mut met) = (Vec::new(), Encounters::default());
        let (mut requests, mut sums) = (Vec::new(), Vec::new());
        let place = |i: u32| (f64::from(i) + 0.5) / f64::from(side);
        for first in (0..viewport.height).step_by(BAND as usize) {
            let rows = first..(first + BAND).min(viewport.height);
            sums.clear();
            sums.resize(rows.len() * viewport.width as usize, (Vec3::ZERO, 0u32));
            // One row of subsamples at a time: memory does not grow with their number.
            for row in 0..side {
                if !step(u64::from(row == 0)) {
                    return None;
                }
                requests.clear();
                for (y, x) in rows
                    .clone()
                    .flat_map(|y| (0..viewport.width).map(move |x| (y, x)))
                {
                    let pixel = u64::from(y - first) * u64::from(viewport.width) + u64::from(x);
                    requests.extend((0..side).map(|column| {
                        let (dx, dy) = (place(column), place(row));
                        let (origin, direction) = camera.ray(*viewport, f64::from(x) + dx, f64::from(y) + dy);
                        ShadeRequest {
                            id: pixel,
                            origin,
                            direction,
                        }
                    }));
                }
                points.clear();
                met.clear();
                let report = shade_lockstep(&**shader, &requests, *seed, &mut points, &mut met);
                if let Some(error) = report.last_error {
                    return Some(Err(error));
                }
                for point in &points {
                    if let Some((sum, count)) = sums.get_mut(point.id as usize) {
                        *sum += point.colour;
                        *count += 1;
                    }
                }
            }
            for (y, row) in rows.zip(sums.chunks(viewport.width as usize)) {
                for (x, (sum, count)) in (0..).zip(row) {
                    picture.set_pixel(x, y, *sum / (*count).max(1) as f32);
                }
            }
        }
        Some(Ok(picture))
    }
}
