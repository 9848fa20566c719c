//! The command line as typed: flags and their texts, checked only for form.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use llsr_io::{LineLightRequest, TubeRequest, parse_point};
use llsr_shading::Method;

/// Finished soft shadows from tube lights.
///
/// Without a command, renders the built-in subway scene to llsr.png.
#[derive(Debug, Parser)]
#[command(name = "llsr", version, max_term_width = 110, disable_help_subcommand = true)]
#[command(
    after_help = "Scenes are .obj, .gltf or .glb files, or demo:NAME (see `llsr demo`).\n\
    Exit codes: 0 done, 1 the work failed, 2 the command line is wrong."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// Flags that every command takes.
#[derive(Args, Clone, Debug)]
pub(crate) struct Common {
    /// Number of threads [default: all cores]; the picture does not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
    /// Seed of all random choices
    #[arg(long, global = true, value_name = "S", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Write a JSON report of what was done and how long it took (bench: CSV)
    #[arg(long, global = true, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a picture (.png for looking at, .exr with layers for work)
    Render(RenderArgs),
    /// Walk through a scene at interactive rates without a window (Bala et al. 2003), and report each frame
    Walk(WalkArgs),
    /// Draw a scene's lines: silhouettes, creases, boundaries and shadow edges, as layers of an .svg
    Edges(EdgesArgs),
    /// Walk through a scene in a window, and move what is in it
    #[command(long_about = VIEW)]
    View(ViewArgs),
    /// Measure error against run time, method by method
    Bench(BenchArgs),
    /// Say what a scene file holds: units, camera, lights, repairs and what was left out
    Info(InfoArgs),
    /// Compare two pictures: rmse, rel_rmse, max, psnr and flip
    Diff(DiffArgs),
    /// List the built-in scenes, or write one as glTF
    Demo(DemoArgs),
}

/// The scene and the camera, for every command that looks at one.
#[derive(Args, Clone, Debug)]
pub(crate) struct SceneArgs {
    /// Scene file (.obj, .gltf, .glb) or demo:NAME
    #[arg(value_name = "SCENE", default_value = "demo:subway")]
    pub(crate) scene: String,
    /// Turn the long thin parts of MATERIAL into tube lights of that flux each (3000lm or 36W)
    #[arg(
        long,
        value_name = "MATERIAL=FLUX",
        help_heading = "Lights",
        allow_hyphen_values = true
    )]
    pub(crate) tube: Vec<TubeRequest>,
    /// Add a linear light from A to B (metres), as x,y,z:x,y,z=3000lm or =36W
    #[arg(
        long,
        value_name = "A:B=FLUX",
        help_heading = "Lights",
        allow_hyphen_values = true
    )]
    pub(crate) line_light: Vec<LineLightRequest>,
    /// Emission law of the lights given here: diffuse falls with the sine of the angle to the axis
    #[arg(long, value_enum, help_heading = "Lights", value_name = "LAW")]
    pub(crate) emission: Option<Emission>,
    /// Use the camera of that name
    #[arg(long, value_name = "NAME", help_heading = "Camera", conflicts_with_all = ["look_from", "look_at"])]
    pub(crate) camera: Option<String>,
    /// Position of the camera
    #[arg(long, value_name = "x,y,z", help_heading = "Camera", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) look_from: Option<DVec3>,
    /// Point that the camera looks at
    #[arg(long, value_name = "x,y,z", help_heading = "Camera", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) look_at: Option<DVec3>,
    /// Upward direction of the picture [default: 0,1,0]
    #[arg(long, value_name = "x,y,z", help_heading = "Camera", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) up: Option<DVec3>,
    /// Vertical opening angle of the camera in degrees
    #[arg(long, value_name = "DEG", help_heading = "Camera", value_parser = field_of_view)]
    pub(crate) fov: Option<f64>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", help_heading = "Camera", value_parser = size)]
    pub(crate) size: (u32, u32),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Emission {
    Diffuse,
    Isotropic,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Picture to write, .png or .exr
    #[arg(short, long, value_name = "FILE", default_value = "llsr.png")]
    pub(crate) output: PathBuf,
    /// How the visible part of a light is found
    #[arg(short, long, default_value_t = Method::Auto, value_parser = str::parse::<Method>, value_name = "M",
        long_help = METHODS)]
    pub(crate) method: Method,
    /// Tolerance of a change's place, as a share of the light's length
    #[arg(long, value_name = "E", default_value_t = 0.05, value_parser = share)]
    pub(crate) epsilon: f64,
    /// Widest gap, as a share of the light's length, that a search may overlook
    #[arg(long, value_name = "N", default_value_t = 0.25, value_parser = share)]
    pub(crate) nu: f64,
    /// Samples of a light for gauss, hpd, stratified and uniform
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(crate) samples: u32,
    /// Rays through a pixel; 1 is its centre
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) spp: u32,
    /// Lines that stand for a tube with a radius, a rectangle or a disc
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=256))]
    pub(crate) light_lines: u32,
    /// How surfaces reflect: direct is Lambert, glossy is glTF's metal-rough model
    #[arg(long, value_enum, default_value_t = Shader::Direct)]
    pub(crate) shader: Shader,
    /// Render again, more carefully, where the irradiance varies much around a pixel (with tdf)
    #[arg(long, value_enum, value_name = "HOW")]
    pub(crate) refine: Option<Refine>,
    /// Do work that is left out otherwise, to measure what that saves
    #[arg(long, value_enum, value_name = "KIND", value_delimiter = ',')]
    pub(crate) no_skip: Vec<Skip>,
    /// Shade few pixels and rebuild the others from edges and points (Bala et al. 2003)
    #[arg(long, value_enum, value_name = "HOW", conflicts_with_all = ["spp", "refine"])]
    pub(crate) reconstruct: Option<Reconstruct>,
    /// With --reconstruct: shaded pixels as a share of all
    #[arg(long, value_name = "D", default_value_t = 0.05, value_parser = density, allow_hyphen_values = true,
        requires = "reconstruct")]
    pub(crate) density: f64,
    /// With --reconstruct: rounds in which these are chosen
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=64),
        requires = "reconstruct")]
    pub(crate) rounds: u32,
    /// Layers of an .exr beside the picture, separated by commas
    #[arg(long, value_name = "LIST", value_delimiter = ',', long_help = LAYERS)]
    pub(crate) aov: Vec<String>,
    /// Exposure of a .png in stops; chosen from the picture if left out
    #[arg(long, value_name = "EV", allow_hyphen_values = true)]
    pub(crate) exposure: Option<f64>,
    /// Tone curve of a .png
    #[arg(long, value_enum, default_value_t = Tone::Filmic)]
    pub(crate) tone: Tone,
}

const METHODS: &str = "How the visible part of a light is found:
  auto                 exact queries; where one is too dear, a search whose ends are then found exactly (default)
  exact                exact queries, whatever they cost
  finder               search for any number of changes, to --epsilon and --nu
  tdf                  two-discontinuity finder with random seed bisection (1999)
  rsb, dithered, random-cut, bisection, jittered-bisection
                       two end tests and, where they differ, one change found that way
  gauss, hpd, stratified, uniform
                       --samples points on the light, each tested";

const LAYERS: &str = "Layers of an .exr beside the picture, separated by commas:
  irradiance           on the visible side, all lights together (lux or W/m2)
  irradiance:LIGHT     of one light; irradiance:* for each
  discontinuities      changes of visibility along the lights
  tests                visibility tests
  certificate          0 exact, 1 ends exact and gaps bounded by nu, 2 sampled
  albedo, normal       of the surface
  depth                distance along the ray (m)
With --reconstruct: irradiance, albedo, normal, depth, and
  edges                0 without an edge, 0.5 with one, 1 in complex pixels
  reach                the neighbours that a pixel reaches, 24 bits as a number
  samples              the round in which a pixel was shaded, 0 if it was not; minus the points shaded in a complex pixel
With -o OUT.png the last three are drawn as OUT-edges.png (purple: one edge, green: complex), OUT-reach.png (the bits as a
colour) and OUT-samples.png (white, yellow, red: rounds; green: complex)";

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Shader {
    Direct,
    Glossy,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Skip {
    /// One answer about the lights for all subsamples of a pixel on one surface
    Share,
    /// Lights below the horizon of a surface
    Horizon,
    /// Cutting lights at the horizon
    Clip,
    /// Lights without power
    Power,
    /// Subtrees that hide nothing new from a fan query
    Prune,
    /// Proofs for blocks of pixels of what lies between them and a light
    Tiles,
    /// Boxes that a fan misses: everything in the scene is asked (slow but for small scenes)
    Boxes,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Reconstruct {
    /// The edge-and-point image
    Epi,
    /// The same samples without regard to edges, for comparison
    Blind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Refine {
    /// Where the variance in a 3x3 neighbourhood is high (Ouellette & Fiume 1999, section 6)
    Variance,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Tone {
    /// Plain sRGB, clipped at 1
    Srgb,
    /// A soft shoulder that keeps bright parts apart
    Filmic,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct WalkArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Frames to make [default: all of --path, else 120]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) frames: Option<u32>,
    /// Camera path: a text file with one camera a line, as `llsr view` records it [default: straight on, turning slowly]
    #[arg(long, value_name = "FILE", long_help = PATHS)]
    pub(crate) path: Option<PathBuf>,
    /// What samples are shaded with
    #[arg(long, value_enum, default_value_t = WalkShader::Direct)]
    pub(crate) shader: WalkShader,
    /// Another program to shade with, over its standard streams (docs/shader-protocol.md)
    #[arg(
        long,
        value_name = "CMD",
        conflicts_with = "shader",
        allow_hyphen_values = true
    )]
    pub(crate) shader_cmd: Option<String>,
    /// Shade on threads of their own while frames are drawn, instead of a fixed number of samples between frames
    #[arg(long)]
    pub(crate) live: bool,
    /// Memory for what global illumination remembers (MiB)
    #[arg(long, value_name = "MIB", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) gi_memory: u32,
    /// Draw each frame while the samples that the one before asked for are shaded beside it: they come a frame later
    #[arg(long, conflicts_with = "live")]
    pub(crate) overlap: bool,
    /// New samples a frame, with --live at most [default: 1% of the pixels]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) samples_per_frame: Option<u32>,
    /// Threads that draw a frame; the picture does not depend on it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(crate) display_threads: u16,
    /// Time the same shader on every pixel too, one sample each, on the same cores
    #[arg(long, value_enum, value_name = "WITH")]
    pub(crate) compare: Option<Compare>,
    /// Measure the error of some frames against 64 samples a pixel, beside that of ray tracing with one and of interpolation
    /// without edges
    #[arg(long)]
    pub(crate) reference: bool,
    /// Put a grid of bars above the scene
    #[arg(long)]
    pub(crate) add_grid: bool,
    /// Move an object to and fro: the grid, or the object of that name
    #[arg(long = "move", value_name = "NAME", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    pub(crate) moves: Option<String>,
    /// Move the camera, objects and lights at random, after the seed: to try endurance
    #[arg(long, conflicts_with_all = ["path", "moves"])]
    pub(crate) wander: bool,
    /// Write some frames as PNG into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) keep_frames: Option<PathBuf>,
    /// Keep and measure one frame in N, and the last one
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) every: u32,
}

const VIEW: &str = "Walk through a scene in a window, and move what is in it

W A S D and the arrows fly, E and Q go up and down, dragging with the left mouse button turns, the wheel comes nearer, and
dragging with the right button moves what is under the pointer: objects, and lights once L shows them. G, P, R, B and T show
edges, samples, reachability, blind interpolation and plain ray tracing. X saves a finished picture, C records a path for
`llsr walk --path`, H lists all keys, Escape ends.";

const PATHS: &str = "Camera path: a text file with one line a frame, 30 frames a second. A line holds ten numbers: the
position (metres, in the frame of the scene's file), the direction of view, the upward direction, and the vertical
opening angle in degrees. Empty lines and lines that start with # do not count. `llsr view` records such files.
--frames cuts a longer path, and at the end of a shorter one the camera waits. Without a path the camera goes straight on
at 1.4 m/s (slower in small scenes) and turns by 20 degrees a second.";

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum WalkShader {
    /// Direct light and a constant for the rest
    Direct,
    /// Direct light, traced glossy reflections and a constant for the rest
    Glossy,
    /// Direct light and global illumination
    Gi,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Compare {
    /// A ray tracer that shades every pixel of every frame
    Raytrace,
}

/// Without the window these are read and not looked at, so that the message is the same for all.
#[derive(Args, Clone, Debug)]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// What samples are shaded with at first; N goes on to the next
    #[arg(long, value_enum, default_value_t = WalkShader::Direct)]
    pub(crate) shader: WalkShader,
    /// Memory for what global illumination remembers (MiB)
    #[arg(long, value_name = "MIB", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) gi_memory: u32,
    /// New samples a frame at most [default: 2% of the pixels]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) samples_per_frame: Option<u32>,
    /// Rays through a pixel of a picture that X saves
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) spp: u32,
    /// Folder for saved pictures and recorded paths
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub(crate) folder: PathBuf,
    /// Exposure in stops; chosen from the first picture if left out
    #[arg(long, value_name = "EV", allow_hyphen_values = true)]
    pub(crate) exposure: Option<f64>,
    /// Tone curve
    #[arg(long, value_enum, default_value_t = Tone::Filmic)]
    pub(crate) tone: Tone,
}

#[derive(Args, Clone, Debug)]
#[command(after_help = EDGES)]
pub(crate) struct EdgesArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// File to write; its ending is the format [default: edges.svg]
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: Option<PathBuf>,
    /// What to write, whatever the name of the file says
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub(crate) format: Option<DrawingFormat>,
    /// Keep hidden parts in a dashed layer
    #[arg(long)]
    pub(crate) hidden: bool,
    /// Draw edges as creases whose faces enclose more than that angle, in degrees between their normals
    #[arg(long, value_name = "DEG", default_value_t = 85.0, value_parser = crease)]
    pub(crate) crease: f64,
}

const EDGES: &str = "Layers: silhouette, crease, boundary (borders of open surfaces); with lights also hard (edges of point lights'
shadows), umbral and penumbral (where a linear light begins to be seen, and where it is seen whole).
No light is needed for the first three.";

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DrawingFormat {
    /// Lines in pixels, a layer a class, to be restyled in Inkscape or a browser
    Svg,
    /// The same lines in space (metres, frame of the scene's file), a group a class
    Obj,
    /// The lines over a quick picture of the scene
    Png,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct BenchArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Methods to measure, separated by commas [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = str::parse::<Method>)]
    pub(crate) methods: Vec<Method>,
    /// Plot to write
    #[arg(short, long, value_name = "PLOT.svg")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct InfoArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct DiffArgs {
    /// Picture (.png or .exr)
    #[arg(value_name = "A")]
    pub(crate) a: PathBuf,
    /// Reference picture; its brightness sets the scale
    #[arg(value_name = "B")]
    pub(crate) b: PathBuf,
    /// Write a picture of where they differ
    #[arg(short, long, value_name = "HEAT.png")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct DemoArgs {
    /// Name of a built-in scene; without it they are listed
    #[arg(value_name = "NAME")]
    pub(crate) name: Option<String>,
    /// File to write (.gltf or .glb) [default: NAME.gltf]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}

fn field_of_view(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 180.0 => Ok(value),
        _ => Err("an angle above 0 and below 180 degrees is needed".to_owned()),
    }
}

fn crease(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=180.0).contains(&value) => Ok(value),
        _ => Err("an angle from 0 to 180 degrees is needed".to_owned()),
    }
}

/// Largest width or height that a picture may have.
const MAX_SIDE: u32 = 32_768;
/// Largest number of pixels.
const MAX_PIXELS: u64 = 1 << 28;

fn size(text: &str) -> Result<(u32, u32), String> {
    let wanted = "a size like 512x512 is needed";
    let (width, height) = text.split_once(['x', 'X']).ok_or(wanted)?;
    let side = |part: &str| part.trim().parse::<u32>().map_err(|_| wanted);
    let (width, height) = (side(width)?, side(height)?);
    let fits = (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height);
    if !fits || u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(format!(
            "sides go from 1 to {MAX_SIDE} and a picture has at most 2^28 pixels"
        ));
    }
    Ok((width, height))
}

fn density(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1.0 => Ok(value),
        _ => Err("a share of the pixels above 0 and at most 1 is needed".to_owned()),
    }
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1.0 => Ok(value),
        _ => Err("a share of the light above 0 and at most 1 is needed".to_owned()),
    }
}
