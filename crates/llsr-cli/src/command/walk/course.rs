//! Where the camera is and what moves, frame by frame.

use llsr_epr::CameraPath;
use llsr_scene::{Camera, ObjectId, Scene};
use llsr_shading::Place;

use crate::args::WalkArgs;
use crate::command::walk::stage::Motion;
use crate::command::walk::wander::Wander;
use crate::failure::Failure;

/// Bytes that a path file may have.
const LARGEST_PATH: u64 = 256 << 20;
/// Frames without `--frames` and `--path`.
const FRAMES: u32 = 120;

/// The course of a walk.
pub(crate) struct Course {
    frames: usize,
    way: Way,
}

enum Way {
    /// A camera for each frame, and what moves to and fro.
    Path(CameraPath, Option<Motion>),
    Wander(Box<Wander>),
}

impl Course {
    /// The course that the command line asks for; `motion` is that of `--move`.
    pub(crate) fn new(
        args: &WalkArgs,
        scene: &Scene,
        camera: &Camera,
        motion: Option<Motion>,
        seed: u64,
    ) -> Result<Self, Failure> {
        if args.wander {
            return Ok(Self {
                frames: args.frames.unwrap_or(FRAMES) as usize,
                way: Way::Wander(Box::new(Wander::new(scene, camera, seed))),
            });
        }
        let path = camera_path(args, scene, camera)?;
        Ok(Self {
            frames: path.cameras.len(),
            way: Way::Path(path, motion),
        })
    }

    /// The objects that a walk with these arguments moves.
    pub(crate) fn movable(args: &WalkArgs, scene: &Scene, motion: Option<&Motion>) -> Vec<ObjectId> {
        if args.wander {
            llsr_epr::movable_objects(scene)
        } else {
            motion.iter().map(|motion| motion.object).collect()
        }
    }

    /// How many frames there are.
    pub(crate) fn frames(&self) -> usize {
        self.frames
    }

    /// The camera of a frame and where what moves is put before it. Frames are asked for in order, each once.
    pub(crate) fn step(&mut self, frame: usize) -> (Camera, Vec<Place>) {
        match &mut self.way {
            Way::Path(path, motion) => {
                let places = motion.iter().map(|motion| motion.place(frame)).collect();
                (path.cameras[frame].clone(), places)
            }
            Way::Wander(wander) => (wander.camera(), wander.places()),
        }
    }
}

fn camera_path(args: &WalkArgs, scene: &Scene, camera: &Camera) -> Result<CameraPath, Failure> {
    let Some(file) = &args.path else {
        let frames = args.frames.unwrap_or(FRAMES) as usize;
        let diagonal = f64::from(scene.bounds().diagonal());
        return Ok(CameraPath::default_walk(camera, frames, diagonal));
    };
    let failed = |what: String| Failure::Work(format!("--path {}: {what}", file.display()));
    let text = llsr_io::read_text(file, LARGEST_PATH)?;
    let mut path = CameraPath::parse(&text, scene.origin).map_err(|error| failed(error.to_string()))?;
    if let Some(frames) = args.frames {
        // A path that is too short waits at its end.
        let last = path.cameras[path.cameras.len() - 1].clone();
        path.cameras.resize(frames as usize, last);
    }
    Ok(path)
}
