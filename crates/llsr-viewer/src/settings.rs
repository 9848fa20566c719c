//! What a view begins with, and what it reports at its end.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use llsr_epr::{FrameError, FrameSettings};
use llsr_io::Tone;
use llsr_shading::{Shader, World};

use crate::jobs::PictureSettings;

/// Makes a shader for a world as it stands; the error is a sentence for the window.
pub type MakeShader = Box<dyn Fn(Arc<World>) -> Result<Arc<dyn Shader>, String> + Send + Sync>;

/// A shader that one can switch to.
pub struct ShaderChoice {
    /// Its name, as shown.
    pub name: String,
    /// How it comes to be.
    pub make: MakeShader,
}

impl std::fmt::Debug for ShaderChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ShaderChoice")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

/// How a view works.
#[derive(Clone, Debug)]
pub struct ViewSettings {
    /// Name of what is seen, for the window's title and the numbers.
    pub title: String,
    /// How frames are made.
    pub frames: FrameSettings,
    /// New samples a frame, at most.
    pub samples: usize,
    /// Threads that shade, at least 1; the display has one of its own.
    pub shader_threads: usize,
    /// Tone curve.
    pub tone: Tone,
    /// Exposure in stops; `None` chooses one that suits the first picture.
    pub exposure: Option<f64>,
    /// How finished pictures are made.
    pub picture: PictureSettings,
    /// Beginning of the names of recorded paths, with the folder.
    pub path_stem: PathBuf,
    /// From when the time to the first picture counts.
    pub started: Instant,
}

impl Default for ViewSettings {
    /// Shader threads for all cores but one.
    fn default() -> Self {
        let cores = std::thread::available_parallelism().map_or(2, usize::from);
        Self {
            title: String::new(),
            frames: FrameSettings {
                latency: 3,
                ..FrameSettings::default()
            },
            samples: 4096,
            shader_threads: cores.saturating_sub(1).max(1),
            tone: Tone::Filmic,
            exposure: None,
            picture: PictureSettings::default(),
            path_stem: PathBuf::from("llsr-path"),
            started: Instant::now(),
        }
    }
}

/// What happened in a view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewReport {
    /// Frames drawn.
    pub frames: u64,
    /// Seconds from [`ViewSettings::started`] until the first picture was handed to the screen.
    pub first_picture_seconds: Option<f64>,
    /// Frames a second over the last second or so.
    pub frames_per_second: f64,
    /// Milliseconds of the display thread for a frame, median of the last ones.
    pub median_frame_ms: f64,
    /// Samples that came back from shaders.
    pub samples: u64,
    /// How often something was put elsewhere.
    pub moves: u64,
    /// Files that were written.
    pub files: Vec<PathBuf>,
    /// Batches that a shader failed on or panicked in.
    pub shader_errors: u64,
    /// What the last of them said.
    pub last_error: Option<String>,
}

/// Why there is no view.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ViewError {
    /// No shader was offered.
    NoShader,
    /// The shader cannot be made; what it said.
    Shader(String),
    /// The frames cannot be made.
    Frame(FrameError),
    /// The system gives no thread.
    Thread(String),
    /// There is no window; what the system said.
    Window(String),
}

impl std::fmt::Display for ViewError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoShader => f.write_str("there is no shader to view with"),
            Self::Shader(what) => write!(f, "the shader cannot be made: {what}"),
            Self::Frame(error) => error.fmt(f),
            Self::Thread(what) => write!(f, "the system gives no thread: {what}"),
            Self::Window(what) => write!(f, "no window can be opened: {what}"),
        }
    }
}

impl std::error::Error for ViewError {}

impl From<FrameError> for ViewError {
    fn from(error: FrameError) -> Self {
        Self::Frame(error)
    }
}
