//! What a walk reports.

use llsr_epr::{DroppedContrast, FrameRenderer, FrameReport};
use serde_json::{Map, Value, json};

use crate::clock::Seconds;
use crate::report as reports;

/// One frame of a report.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameLine {
    pub(crate) report: FrameReport,
    /// Moving things and drawing the frame.
    pub(crate) drawn: Seconds,
    /// Shading its samples; in live mode, fetching them.
    pub(crate) shaded: Seconds,
    pub(crate) error: Option<Value>,
}

/// A whole walk.
#[derive(Default)]
pub(crate) struct Walk {
    pub(crate) scene: String,
    pub(crate) triangles: usize,
    pub(crate) mesh_edges: usize,
    pub(crate) primitives: usize,
    pub(crate) lights: usize,
    pub(crate) size: (u32, u32),
    pub(crate) shader: String,
    pub(crate) samples: usize,
    pub(crate) seed: u64,
    pub(crate) seconds: Vec<(&'static str, Seconds)>,
    pub(crate) warnings: Vec<String>,
    pub(crate) warm_up_samples: usize,
    pub(crate) frames: Vec<FrameLine>,
    pub(crate) shader_errors: u64,
    /// Counts of the pool, in live mode.
    pub(crate) live: Option<Value>,
    pub(crate) summary: Summary,
    /// What the shadow edges left out at the end do to the picture.
    pub(crate) unmarked: DroppedContrast,
}

#[derive(Default)]
pub(crate) struct Summary {
    /// Medians of the stages over the frames.
    median_ms: Vec<(&'static str, f64)>,
    fps: f64,
    sparseness: f64,
    /// Median of the samples that came in for a frame.
    new_samples: f64,
    /// Seconds of a frame with its samples: wall clock, and processor time of all threads.
    seconds_a_frame: Seconds,
    traced: Option<Traced>,
    hash: u64,
}

/// What ray tracing the same views costs.
struct Traced {
    /// One sample in every pixel.
    picture: Seconds,
    /// One of its samples.
    sample: Seconds,
    /// Cost of a sample at which both ways take as long: a dearer shader gains by edges and points.
    break_even: Seconds,
}

impl Traced {
    /// A picture has `pixels`, a frame `samples` of them, and `drawn` is what a frame costs besides these.
    fn new(picture: Seconds, pixels: f64, samples: f64, drawn: Seconds) -> Self {
        let each = |seconds: Seconds, count: f64| Seconds {
            wall: seconds.wall / count,
            cpu: seconds.cpu / count,
        };
        Self {
            picture,
            sample: each(picture, pixels),
            // drawn + samples x cost = pixels x cost
            break_even: each(drawn, (pixels - samples).max(1.0)),
        }
    }
}

impl Walk {
    /// Works the summary out.
    ///
    /// `raytraced` are the times of ray-traced pictures in their order. The first counts only if there is no other: records of
    /// irradiance are made in it that a walk would have.
    pub(crate) fn finish(&mut self, renderer: &FrameRenderer, raytraced: &[Seconds]) {
        let stages = FrameReport::default().ms.named();
        let median_ms = stages.iter().enumerate().map(|(i, (name, _))| {
            let values = self.frames.iter().map(|line| line.report.ms.named()[i].1);
            (*name, median(values))
        });
        let median_ms: Vec<_> = median_ms.collect();
        let total = median_ms.last().map_or(0.0, |stage| stage.1);
        let medians = |all: &[Seconds]| Seconds {
            wall: median(all.iter().map(|s| s.wall)),
            cpu: median(all.iter().map(|s| s.cpu)),
        };
        let of_frames = |pick: fn(&FrameLine) -> Seconds| -> Seconds {
            medians(&self.frames.iter().map(pick).collect::<Vec<_>>())
        };
        let drawn = of_frames(|line| line.drawn);
        let new: usize = self
            .frames
            .iter()
            .skip(1)
            .map(|line| line.report.new_points)
            .sum();
        let pixels = f64::from(self.size.0) * f64::from(self.size.1);
        let counts = self.frames.iter().skip(1);
        let new_samples = median(counts.map(|line| line.report.new_points as f64));
        let timed = match raytraced {
            [_, later @ ..] if !later.is_empty() => later,
            all => all,
        };
        let picture = (!timed.is_empty()).then(|| medians(timed));
        self.summary = Summary {
            median_ms,
            fps: 1e3 / total,
            sparseness: new as f64 / (self.frames.len().saturating_sub(1).max(1) as f64 * pixels),
            new_samples,
            seconds_a_frame: of_frames(FrameLine::seconds),
            traced: picture.map(|picture| Traced::new(picture, pixels, new_samples, drawn)),
            hash: picture_hash(renderer),
        };
    }

    pub(crate) fn json(&self) -> Value {
        let frames: Vec<Value> = self.frames.iter().map(FrameLine::json).collect();
        let seconds = |pick: fn(&Seconds) -> f64| -> Map<String, Value> {
            let named = self
                .seconds
                .iter()
                .map(|(name, s)| ((*name).to_owned(), json!(pick(s))));
            named.collect()
        };
        json!({
            "scene": self.scene,
            "triangles": self.triangles,
            "mesh_edges": self.mesh_edges,
            "primitives": self.primitives,
            "lights": self.lights,
            "size": [self.size.0, self.size.1],
            "shader": self.shader,
            "samples_per_frame": self.samples,
            "warm_up_samples": self.warm_up_samples,
            "seed": self.seed,
            "threads": rayon::current_num_threads(),
            "seconds": seconds(|s| s.wall),
            "cpu_seconds": seconds(|s| s.cpu),
            "shader_errors": self.shader_errors,
            "live": self.live,
            "warnings": self.warnings,
            "frames": frames,
            "unimportant_contrast": reports::contrast_json(&self.unmarked),
            "summary": self.summary.json(&self.frames),
        })
    }

    pub(crate) fn print(&self) {
        let (width, height) = self.size;
        println!(
            "{}: {} triangles, {} primitives, {} lights; {} frames of {width}x{height}, shader {}",
            self.scene,
            self.triangles,
            self.primitives,
            self.lights,
            self.frames.len(),
            self.shader
        );
        let dropped = self
            .frames
            .last()
            .map_or(0, |line| line.report.shadow_edges_dropped);
        reports::print_contrast(dropped, &self.unmarked);
        let stages: Vec<String> = self
            .summary
            .median_ms
            .iter()
            .map(|(name, ms)| format!("{name} {ms:.2}"))
            .collect();
        println!("median ms: {}", stages.join(", "));
        println!(
            "{:.1} frames a second; {:.2}% new samples a frame",
            self.summary.fps,
            100.0 * self.summary.sparseness
        );
        if let Some(live) = &self.live {
            println!(
                "live: {:.0} samples a frame of {} asked for; {} shaded, {} dropped, {} lost",
                self.summary.new_samples, self.samples, live["shaded"], live["dropped"], live["lost"]
            );
        }
        if let Some(traced) = &self.summary.traced {
            println!(
                "with its samples a frame takes {:.1} ms, one sample in every pixel {:.3} s: {:.1} times as long",
                1e3 * self.summary.seconds_a_frame.wall,
                traced.picture.wall,
                traced.picture.wall / self.summary.seconds_a_frame.wall
            );
            println!(
                "a sample takes {:.2} us of all cores; edges and points gain from {:.3} us on",
                1e6 * traced.sample.wall,
                1e6 * traced.break_even.wall
            );
        }
        if let Some(error) = mean_errors(&self.frames) {
            println!(
                "FLIP against 64 samples a pixel: {:.4}; ray tracing with one {:.4}, without edges {:.4}",
                error[0], error[1], error[2]
            );
        }
    }
}

impl FrameLine {
    /// The frame with its samples, over all cores.
    fn seconds(&self) -> Seconds {
        Seconds {
            wall: self.drawn.wall + self.shaded.wall,
            cpu: self.drawn.cpu + self.shaded.cpu,
        }
    }

    fn json(&self) -> Value {
        let report = &self.report;
        let ms: Map<String, Value> = report
            .ms
            .named()
            .into_iter()
            .map(|(name, ms)| (name.to_owned(), json!(ms)))
            .collect();
        json!({
            "ms": ms,
            "seconds": self.seconds().wall,
            "cpu_seconds": self.seconds().cpu,
            "draw_seconds": self.drawn.wall,
            "edges": {
                "silhouette": report.silhouette_edges,
                "shadow": report.shadow_edges,
                "shadow_unimportant": report.shadow_edges_dropped,
                "shadow_pairs_updated": report.shadow_pairs,
                "shadow_ms_apart": report.shadow_ms,
                "in_picture": report.edges_in_picture,
            },
            "pixels": {
                "empty": report.pixels.empty,
                "simple": report.pixels.simple,
                "complex": report.pixels.complex,
            },
            "points": { "shown": report.points.occupied, "hidden": report.points.hidden, "shone": report.shone },
            "new_samples": report.new_points,
            "doubtful": report.doubtful,
            "filled": report.filled,
            "patched": report.patched,
            "holes": report.holes,
            "error": self.error,
        })
    }
}

impl Summary {
    fn json(&self, frames: &[FrameLine]) -> Value {
        let median_ms: Map<String, Value> = self
            .median_ms
            .iter()
            .map(|(name, ms)| ((*name).to_owned(), json!(ms)))
            .collect();
        let errors = mean_errors(frames);
        let traced = |pick: fn(&Traced) -> f64| self.traced.as_ref().map(pick);
        let holes: usize = frames.iter().map(|line| line.report.holes).sum();
        json!({
            "median_ms": median_ms,
            "fps": self.fps,
            "sparseness": self.sparseness,
            "seconds_per_frame": self.seconds_a_frame.wall,
            "cpu_seconds_per_frame": self.seconds_a_frame.cpu,
            "new_samples": self.new_samples,
            "raytrace_seconds": traced(|t| t.picture.wall),
            "raytrace_cpu_seconds": traced(|t| t.picture.cpu),
            "sample_us": traced(|t| 1e6 * t.sample.wall),
            "cpu_sample_us": traced(|t| 1e6 * t.sample.cpu),
            "break_even_us": traced(|t| 1e6 * t.break_even.wall),
            "cpu_break_even_us": traced(|t| 1e6 * t.break_even.cpu),
            "speedup": traced(|t| t.picture.wall).map(|s| s / self.seconds_a_frame.wall),
            "cpu_speedup": traced(|t| t.picture.cpu).map(|s| s / self.seconds_a_frame.cpu),
            "flip": errors.map(|e| e[0]),
            "raytrace_flip": errors.map(|e| e[1]),
            "blind_flip": errors.map(|e| e[2]),
            "holes": holes,
            "last_frame_hash": format!("{:016x}", self.hash),
        })
    }
}

/// Mean FLIP over the measured frames: ours, of ray tracing, and without edges.
fn mean_errors(frames: &[FrameLine]) -> Option<[f64; 3]> {
    let measured: Vec<&Value> = frames.iter().filter_map(|line| line.error.as_ref()).collect();
    let mean = |pick: fn(&Value) -> &Value| {
        let values = measured.iter().filter_map(|error| pick(error).as_f64());
        values.sum::<f64>() / measured.len() as f64
    };
    (!measured.is_empty()).then(|| {
        [
            mean(|e| &e["flip"]),
            mean(|e| &e["raytrace"]["flip"]),
            mean(|e| &e["blind"]["flip"]),
        ]
    })
}

/// The middle value; 0 without any.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// FNV-1a over the bits of the last picture.
fn picture_hash(renderer: &FrameRenderer) -> u64 {
    let picture = renderer.picture();
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    for y in 0..picture.size().1 {
        for value in picture.row(y).into_iter().flatten() {
            for byte in value.to_bits().to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        }
    }
    hash
}
