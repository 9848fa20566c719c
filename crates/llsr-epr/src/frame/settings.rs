//! How frames are made.

use llsr_epi::{Kernel, Occlusion};
use llsr_render_cache::{AgeRule, Replacement};

/// How frames are made; the defaults suit 1% new samples a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameSettings {
    /// Angle between the normals of two faces from which on their common edge is drawn (degrees, 0 to 180; BWG03 section 6.2).
    pub crease_degrees: f64,
    /// Find the edges of the shadows that shaders meet (BWG03 sections 6.3 to 6.5).
    pub shadow_edges: bool,
    /// Of these, leave out those of lights that together give less than this share of the light where the edge lies, in
    /// [0, 1]; 0 keeps all (see [`ShadowEdges::drop_unimportant`](llsr_edges::ShadowEdges::drop_unimportant)).
    pub shadow_least_share: f64,
    /// Also those of a light that by itself gives less than about this share there, in [0, 1]; 0 keeps all. Where many
    /// lights shine the shadows of each are hardly seen, and all their edges leave no pixel whole.
    pub shadow_least_contrast: f64,
    /// Leave it to the caller when they are computed: [`FrameRenderer::shadow_work`](crate::FrameRenderer::shadow_work). Otherwise a frame
    /// computes what is new before it is drawn, which can take seconds.
    pub shadows_apart: bool,
    /// The interpolation filter.
    pub kernel: Kernel,
    /// Take means of points to the centres of pixels along the slope around ([`llsr_epi::Settings::linear`]).
    pub linear: bool,
    /// Look textures up for each pixel, where shaders say that colours are light on a texture ([`llsr_shading::Textured`]). Otherwise
    /// they are interpolated with the light.
    pub textures: bool,
    /// Rebuild complex pixels in quarters (BWG03 section 5.4).
    pub complex: bool,
    /// Leave out edges that lie behind the points; `None` draws them all.
    pub occlusion: Option<Occlusion>,
    /// Points kept, in points a pixel; at least one point is kept.
    pub points_per_pixel: f32,
    /// Share of the requests that may go to where the camera will look, in [0, 1].
    pub ahead_share: f32,
    /// How many frames ahead that is; 0 asks for nothing ahead.
    pub ahead_frames: u32,
    /// Frames after which no point is left whose light may have changed when something moved; at least 1, at most 200.
    pub stale_frames: u8,
    /// Frames between a request and its answer, in which its pixel is not asked for again.
    pub latency: u8,
    /// The share of its priority that is left to a pixel while no new sample around it differs from what was shown there, in [0, 1]; with 1
    /// samples go wherever points lack, whether or not anything is wrong there ([`llsr_render_cache::Surprises`]).
    pub calm_priority: f32,
    /// How age turns into priority.
    pub ages: AgeRule,
    /// How new points take the place of old ones.
    pub replacement: Replacement,
    /// Threads that make a frame, at least 1; more than one are those of the current rayon pool. The bits of the picture
    /// do not depend on it.
    pub threads: usize,
    /// Seeds the places of samples within their pixels.
    pub seed: u64,
}

impl Default for FrameSettings {
    fn default() -> Self {
        Self {
            crease_degrees: 85.0,
            shadow_edges: true,
            shadow_least_share: 0.3,
            shadow_least_contrast: 0.1,
            shadows_apart: false,
            kernel: Kernel::SHARP,
            linear: true,
            textures: true,
            complex: true,
            occlusion: Some(Occlusion::default()),
            points_per_pixel: 1.0,
            ahead_share: 0.25,
            ahead_frames: 8,
            stale_frames: 12,
            latency: 0,
            calm_priority: 0.05,
            ages: AgeRule::default(),
            replacement: Replacement::default(),
            threads: 1,
            seed: 0,
        }
    }
}

/// Milliseconds that each part of a frame took on the thread that made it (wall clock); the columns of BWG03's table 2.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    /// Finding silhouettes and, unless that is done apart, updating shadow edges.
    pub edges: f64,
    /// Drawing them into the pixels and classifying these.
    pub rasterize: f64,
    /// Taking new points in, ageing and reprojecting all.
    pub points: f64,
    /// What reaches what.
    pub reach: f64,
    /// Interpolation, and passing colours on to pixels that reach no point.
    pub interpolate: f64,
    /// Blending both sides of edges.
    pub antialias: f64,
    /// Rebuilding complex pixels.
    pub complex: f64,
    /// Priorities and the choice of requests.
    pub requests: f64,
    /// Everything, these parts and what lies between them.
    pub total: f64,
}

impl StageTimes {
    /// Names and values, in the order of a frame.
    pub fn named(&self) -> [(&'static str, f64); 9] {
        [
            ("edges", self.edges),
            ("rasterize", self.rasterize),
            ("points", self.points),
            ("reach", self.reach),
            ("interpolate", self.interpolate),
            ("antialias", self.antialias),
            ("complex", self.complex),
            ("requests", self.requests),
            ("total", self.total),
        ]
    }
}

/// What one frame was made of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameReport {
    /// Number of the frame, from 0.
    pub frame: u64,
    /// How long it took.
    pub ms: StageTimes,
    /// View edges drawn: silhouettes, creases, boundaries and outlines of primitives.
    pub silhouette_edges: usize,
    /// Lines of shadow edges drawn; two edges in one place are one.
    pub shadow_edges: usize,
    /// Shadow edges left out because other lights outshine theirs.
    pub shadow_edges_dropped: usize,
    /// Pairs of light and blocker whose shadow edges were computed since the last frame.
    pub shadow_pairs: usize,
    /// Milliseconds that took; with [`FrameSettings::shadows_apart`] not a part of the frame's own time.
    pub shadow_ms: f64,
    /// Edges of either kind of which a part lies in the picture.
    pub edges_in_picture: usize,
    /// Pixels without an edge, with one, and others.
    pub pixels: llsr_epi::ClassCounts,
    /// Pixels with a point, and pixels whose point shone through something nearer.
    pub points: llsr_render_cache::Counts,
    /// Points that were found to lie behind what they reach, and are gone.
    pub shone: usize,
    /// Points taken in since the last frame.
    pub new_points: usize,
    /// Points that a moving object or light put in doubt since the last frame.
    pub doubtful: usize,
    /// Pixels that reached no point and were coloured by what they reach.
    pub filled: usize,
    /// Pixels that got the colour of their surroundings because nothing that they reach has one.
    pub patched: usize,
    /// Pixels without any colour: none as soon as there is one point.
    pub holes: usize,
}
