//! Work beside the display: finished pictures, and plain ray tracing.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::thread;

use llsr_epi::Picture;
use llsr_epr::shade_lockstep;
use llsr_io::{Development, Image};
use llsr_scene::{Camera, Scene, Viewport};
use llsr_shading::{Encounters, Film, Settings, ShadeRequest, Shader, World, render, tile_count};
use llsr_tracer::Tracer;

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
    /// Starts a thread; `work` gets a function to call `all` times that returns false when it should give up.
    fn start(
        name: &str,
        all: u64,
        work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> T + Send + 'static,
    ) -> std::io::Result<Self> {
        let (send, result) = mpsc::channel();
        let (stop, steps) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let (stop_too, steps_too) = (Arc::clone(&stop), Arc::clone(&steps));
        thread::Builder::new().name(name.to_owned()).spawn(move || {
            let step = || {
                steps_too.fetch_add(1, Ordering::Relaxed);
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

/// The scene as it stands in a world.
pub(crate) fn scene_of(world: &World) -> Scene {
    let mut scene = Scene::clone(world.scene());
    for (index, object) in scene.objects.iter_mut().enumerate() {
        object.transform = *world.transform(index.into());
    }
    scene.lights = world.lights().to_vec();
    scene
}

/// How finished pictures are made.
#[derive(Clone, Debug)]
pub struct PictureSettings {
    /// How surfaces are shaded, and how many rays pass through a pixel.
    pub shading: Settings,
    /// Beginning of the files' names, with the folder: `llsr-view` gives `llsr-view.png`, then `llsr-view-2.png`.
    pub stem: PathBuf,
}

impl Default for PictureSettings {
    fn default() -> Self {
        Self {
            shading: Settings {
                spp: 16,
                ..Settings::default()
            },
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

/// Renders the world in full and writes a PNG; the result is the file's name or what went wrong.
pub(crate) fn save_picture(
    world: &World,
    camera: &Camera,
    viewport: Viewport,
    settings: &PictureSettings,
    development: Development,
) -> std::io::Result<Job<Result<PathBuf, String>>> {
    let (scene, camera, settings) = (scene_of(world), camera.clone(), settings.clone());
    Job::start("picture", tile_count(viewport), move |step| {
        let (tracer, _) = Tracer::new(&scene);
        let rendered = render(&scene, &tracer, &camera, viewport, &settings.shading, step)
            .map_err(|_| "given up".to_owned())?;
        let Film { viewport, channels } = rendered.film;
        let image = Image {
            width: viewport.width as usize,
            height: viewport.height as usize,
            channels,
        };
        let path = free_name(&settings.stem, "png");
        llsr_io::write_png(&path, &image, development).map_err(|error| error.to_string())?;
        Ok(path)
    })
}

/// Rows that plain ray tracing shades between two looks at whether it should stop.
const BAND: u32 = 8;

/// A picture of one ray a pixel, with its time in seconds.
pub(crate) struct Traced {
    pub(crate) picture: Picture,
    pub(crate) seconds: f64,
}

/// Shades every pixel once; the answer is `None` if it was given up, or what the shader says if it fails.
pub(crate) fn trace_picture(
    shader: Arc<dyn Shader>,
    camera: &Camera,
    viewport: Viewport,
    seed: u64,
) -> std::io::Result<Job<Option<Result<Traced, String>>>> {
    let camera = camera.clone();
    let bands = viewport.height.div_ceil(BAND);
    Job::start("ray tracing", u64::from(bands), move |step| {
        let start = std::time::Instant::now();
        let mut picture = Picture::new(viewport.width, viewport.height);
        let (mut points, mut met) = (Vec::new(), Encounters::default());
        let mut requests = Vec::new();
        for band in 0..bands {
            if !step() {
                return None;
            }
            requests.clear();
            for y in band * BAND..((band + 1) * BAND).min(viewport.height) {
                requests.extend((0..viewport.width).map(|x| {
                    let (origin, direction) = camera.ray(viewport, f64::from(x) + 0.5, f64::from(y) + 0.5);
                    ShadeRequest {
                        id: u64::from(y) << 32 | u64::from(x),
                        origin,
                        direction,
                    }
                }));
            }
            points.clear();
            met.clear();
            let report = shade_lockstep(&*shader, &requests, seed, &mut points, &mut met);
            if let Some(error) = report.last_error {
                return Some(Err(error));
            }
            for point in &points {
                let (x, y) = (point.id as u32, (point.id >> 32) as u32);
                if x < viewport.width && y < viewport.height {
                    picture.set_pixel(x, y, point.colour);
                }
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        Some(Ok(Traced { picture, seconds }))
    })
}
