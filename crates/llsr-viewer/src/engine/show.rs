//! From a frame to the pixels of the window.

use llsr_epr::{BlindInterpolation, PoolStatus, StageTimes};

use super::{Engine, Gesture};
use crate::jobs::Job;
use crate::overlay;

/// How long messages stay (s).
const MESSAGE_SECONDS: f64 = 6.0;
const WHITE: u32 = 0xff_ff_ff;
/// Characters of an error that are shown.
const LONGEST: usize = 60;

impl Engine {
    /// Develops the frame and draws over it what is switched on.
    pub(super) fn present(&mut self, status: &PoolStatus) {
        let shown = self.shown;
        let traced = self.tracing.done.as_ref().filter(|_| shown.ray_trace);
        if let Some(traced) = traced {
            self.canvas.develop(&traced.picture, &self.table);
        } else if shown.blind {
            if self.blind.is_none() {
                self.blind = BlindInterpolation::new(&self.renderer).ok();
            }
            if let Some(blind) = &mut self.blind {
                self.canvas.develop(blind.draw(&self.renderer), &self.table);
            }
        } else {
            self.canvas.develop(self.renderer.picture(), &self.table);
        }
        if shown.samples {
            overlay::samples(&mut self.canvas, &self.renderer);
        }
        if shown.reach {
            overlay::reach(&mut self.canvas, self.renderer.image());
        }
        if shown.edges {
            overlay::edges(&mut self.canvas, self.renderer.image());
        }
        let held = match &self.gesture {
            Some(Gesture::Drag(grip, _)) if grip.is_light() => Some(grip.name(&self.world)),
            _ => None,
        };
        if shown.lights || held.is_some() {
            let (lights, camera) = (self.world.lights(), self.rig.camera());
            overlay::lights(&mut self.canvas, lights, camera, self.viewport, held);
        }
        let lines = self.lines(status);
        if !lines.is_empty() {
            overlay::numbers(&mut self.canvas, &lines);
        }
        if shown.help {
            overlay::help(&mut self.canvas);
        }
    }

    /// What is written into the corner, with its colours.
    pub(super) fn lines(&self, status: &PoolStatus) -> Vec<(u32, String)> {
        let mut lines = Vec::new();
        if self.shown.numbers {
            lines.extend(self.numbers(status).map(|line| (WHITE, line)));
            let on = self.shown.names();
            if !on.is_empty() {
                lines.push((overlay::MESSAGE, format!("shown: {}", on.join(", "))));
            }
        }
        if let Some(recorder) = &self.recorder {
            lines.push((
                overlay::ERROR,
                format!("recording {:.1} s (C: stop)", recorder.seconds()),
            ));
        }
        if let Some(job) = &self.saving {
            let percent = 100.0 * Job::share(job);
            lines.push((
                overlay::MESSAGE,
                format!("saving a picture: {percent:.0}% (X: give up)"),
            ));
        }
        let failed = self.report.shader_errors + status.counts.errors + status.counts.panics;
        if failed > 0 {
            let error = status.last_error.as_ref().or(self.report.last_error.as_ref());
            let mut text: String = error.map_or("", String::as_str).chars().take(LONGEST).collect();
            text = text.replace('\n', " ");
            lines.push((overlay::ERROR, format!("shader failed {failed} times: {text}")));
        }
        let message = self.message.as_ref();
        if let Some((color, text, since)) = message
            && since.elapsed().as_secs_f64() < MESSAGE_SECONDS
        {
            lines.push((*color, text.clone()));
        }
        lines
    }

    fn numbers(&self, status: &PoolStatus) -> impl Iterator<Item = String> + use<> {
        let frame = self.renderer.report();
        let ms = |stage: fn(&StageTimes) -> f64| self.times.stage_ms(stage);
        let pixels = self.viewport.pixels() as f64;
        let percent = |count: usize| 100.0 * count as f64 / pixels;
        let what = if self.shown.ray_trace {
            match &self.tracing.done {
                Some(traced) => format!("ray tracing: {:.2} s a picture", traced.seconds),
                None => {
                    let share = self.tracing.job.as_ref().map_or(0.0, Job::share);
                    format!("ray tracing: {:.0}%", 100.0 * share)
                }
            }
        } else {
            format!(
                "{:.0} frames/s, {:.1} ms each",
                self.times.per_second(),
                self.times.median_ms()
            )
        };
        let (width, height) = (self.viewport.width, self.viewport.height);
        let name = &self.settings.title;
        let shader = &self.shaders[self.chosen].name;
        [
            format!("{name} {width}x{height}  {what}"),
            format!(
                "edges {:.1} raster {:.1} points {:.1} reach {:.1}",
                ms(|ms| ms.edges),
                ms(|ms| ms.rasterize),
                ms(|ms| ms.points),
                ms(|ms| ms.reach)
            ),
            format!(
                "interp {:.1} aa {:.1} complex {:.1} ask {:.1} ms",
                ms(|ms| ms.interpolate),
                ms(|ms| ms.antialias),
                ms(|ms| ms.complex),
                ms(|ms| ms.requests)
            ),
            format!(
                "{} edges  {:.1}% simple {:.1}% complex pixels",
                frame.silhouette_edges + frame.shadow_edges,
                percent(frame.pixels.simple),
                percent(frame.pixels.complex)
            ),
            format!(
                "{shader}: {} new ({:.2}%) of {}, {:.0}k/s",
                frame.new_points,
                percent(frame.new_points),
                self.samples,
                self.budget.rate() / 1e3
            ),
            format!(
                "samples in {:.0}% of the pixels, {} wait{}",
                percent(frame.points.occupied),
                status.waiting,
                match self.renderer.shadow_pairs_waiting() {
                    0 => String::new(),
                    pairs => format!("; shadows to find: {pairs}"),
                }
            ),
        ]
        .into_iter()
    }
}
