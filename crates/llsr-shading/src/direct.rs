//! Direct light of one light on one surface point.

use std::borrow::Cow;

use glam::DVec3;
use llsr_quadrature::{
    DitherMask, GlossyOptions, LineAxis, LineGlossy, LineIrradiance, LineLight, Lobes, Pattern, Receiver,
    horizon_clip,
};
use llsr_rsb::{Method as Bisection, Stop, uniform};
use llsr_scene::{Light, LightId, ObjectId, Scene};
use llsr_tdf::{ChangeCoherence, Coherence, Finder, FinderScratch, Shift, Tdf, TdfScratch};
use llsr_tracer::{FanQuery, FanScratch, Shaft, Sight, Tracer};
use llsr_visibility::{Bracket, Certificate, Counting, Panel, Partition, Visibility};
use rand_pcg::Pcg64Mcg;

use crate::lamps::Source;
use crate::random::Random;
use crate::search::{samples_to_panels, single_change};
use crate::{LightClass, Method, PreparedLights, Settings, Statistics, SurfacePoint};

/// Which pixel is being shaded; seeds patterns and picks from dither masks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pixel {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// Number of the pixel in its picture.
    pub index: u64,
    /// Which of the pixel's samples.
    pub subsample: u32,
}

/// What the neighbouring pixel saw of a light; the caller carries it along a row and starts anew with the
/// default.
#[derive(Clone, Debug, Default)]
pub struct LightState {
    /// One for each line of the light.
    lines: Vec<LineState>,
}

impl LightState {
    /// Forgets the neighbour and keeps the memory.
    pub fn clear(&mut self) {
        self.lines.iter_mut().for_each(LineState::clear);
    }

    /// Takes over what another neighbour, the pixel above, saw of each line, where that has more changes.
    pub(crate) fn prefer_richer(&mut self, above: &Self) {
        for (index, above) in above.lines.iter().enumerate() {
            self.line(index).changes.prefer_richer(&above.changes);
        }
    }

    /// Copies the changes of another state and keeps the memory.
    pub(crate) fn copy_changes(&mut self, from: &Self) {
        self.clear();
        for (index, from) in from.lines.iter().enumerate() {
            self.line(index).changes.clone_from(&from.changes);
        }
    }

    fn line(&mut self, index: usize) -> &mut LineState {
        if self.lines.len() <= index {
            self.lines.resize(index + 1, LineState::default());
        }
        &mut self.lines[index]
    }
}

/// What the neighbouring pixel saw of one line.
#[derive(Clone, Debug, Default)]
struct LineState {
    tdf: Coherence,
    changes: ChangeCoherence,
}

impl LineState {
    fn clear(&mut self) {
        self.tdf = Coherence::default();
        self.changes.clear();
    }
}

/// Working memory of one thread.
#[derive(Debug, Default)]
pub struct Scratch {
    visible: Partition,
    tdf: TdfScratch,
    finder: FinderScratch,
    points: Vec<f64>,
    answers: Vec<bool>,
    samples: Vec<(f64, bool)>,
    mapped: Partition,
    fan: FanScratch,
    widest_untested: f64,
}

impl Scratch {
    /// A sequence of points begins that is the same in every run, whatever was shaded before: so what hid a light from one point
    /// may help with the next.
    pub(crate) fn begin_sequence(&mut self) {
        self.fan.begin_sequence();
    }
}

/// What one light does to one surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightAnswer {
    /// Irradiance, in the unit of the scene.
    pub irradiance: f64,
    /// Changes of visibility along the light that were found; a cut by the horizon is not one.
    pub discontinuities: u32,
    /// Visibility tests that were made.
    pub tests: u32,
    /// How far the answer can be trusted.
    pub certificate: Certificate,
    /// Integrals for glossy reflection towards the viewer; zero if the settings do not ask for it.
    pub lobes: Lobes,
}

impl Default for LightAnswer {
    fn default() -> Self {
        Self {
            irradiance: 0.0,
            discontinuities: 0,
            tests: 0,
            certificate: Certificate::Exact,
            lobes: Lobes::default(),
        }
    }
}

impl LightAnswer {
    /// Adds what another light does.
    pub fn add(&mut self, other: &Self) {
        self.irradiance += other.irradiance;
        self.discontinuities += other.discontinuities;
        self.tests += other.tests;
        self.certificate = self.certificate.weaker(other.certificate);
        self.lobes += other.lobes;
    }
}

/// Shades surface points with the lights of a scene.
#[derive(Debug)]
pub struct DirectLight<'a> {
    pub(crate) tracer: &'a Tracer,
    pub(crate) settings: &'a Settings,
    lights: Cow<'a, PreparedLights>,
}

impl<'a> DirectLight<'a> {
    /// Prepares the lights of `scene`.
    pub fn new(scene: &Scene, tracer: &'a Tracer, settings: &'a Settings) -> Self {
        let lights = PreparedLights::new(&scene.lights, &scene.materials, settings);
        Self {
            tracer,
            settings,
            lights: Cow::Owned(lights),
        }
    }

    /// The same with lights that were prepared before, with the same settings; costs nothing.
    pub fn prepared(lights: &'a PreparedLights, tracer: &'a Tracer, settings: &'a Settings) -> Self {
        Self {
            tracer,
            settings,
            lights: Cow::Borrowed(lights),
        }
    }

    /// Puts another light in the place of one.
    ///
    /// # Panics
    /// If there is no such light.
    pub fn set_light(&mut self, id: LightId, light: &Light) {
        self.lights.to_mut().set(id, light);
    }

    /// Whether visibility is asked of fans, at least at first.
    pub(crate) fn asks_fans(&self) -> bool {
        matches!(self.settings.method, Method::Auto | Method::Exact)
    }

    /// Points whose convex hull holds the light.
    pub(crate) fn hull(&self, light: LightId) -> &[DVec3] {
        &self.lights.hulls[light.index()]
    }

    /// Number of lights of the scene.
    pub(crate) fn light_count(&self) -> usize {
        self.lights.sources.len()
    }

    /// Light of one light on a surface point.
    ///
    /// `state` belongs to this light and is what the neighbouring pixel saw of it. Cost: a few dozen nanoseconds
    /// a line plus the visibility tests, which are counted in the caller's statistics.
    pub(crate) fn shade(
        &self,
        surface: &SurfacePoint,
        light: LightId,
        state: &mut LightState,
        work: &mut Work<'_>,
    ) -> LightAnswer {
        let (answer, class) = match &self.lights.sources[light.index()] {
            Source::Dark => {
                work.statistics.skipped.no_power += 1;
                (LightAnswer::default(), LightClass::Umbra)
            }
            Source::Point { position, line } => self.point(surface, *position, line, work),
            Source::Line { line, axis } => self.line(surface, line, axis, state.line(0), work),
            Source::Tube(tube) => self.lines(
                surface,
                tube.lines(surface.position, self.lights.stack.iter().copied()),
                state,
                work,
            ),
            Source::Rect(rect) => self.lines(
                surface,
                rect.lines(surface.position, self.lights.stack.iter().copied()),
                state,
                work,
            ),
            Source::Disc(disc) => self.lines(
                surface,
                disc.lines(surface.position, self.lights.stack.iter().copied()),
                state,
                work,
            ),
        };
        let statistics = &mut *work.statistics;
        statistics.count_class(class);
        let last = statistics.discontinuities.len() - 1;
        statistics.discontinuities[(answer.discontinuities as usize).min(last)] += 1;
        answer
    }

    /// A light with an area, as the lines that stand for it.
    fn lines(
        &self,
        surface: &SurfacePoint,
        lines: impl Iterator<Item = LineLight>,
        state: &mut LightState,
        work: &mut Work<'_>,
    ) -> (LightAnswer, LightClass) {
        let mut sum = LightAnswer::default();
        let mut classes = [false; 3];
        for (index, line) in lines.enumerate() {
            let (answer, class) = self.line(surface, &line, &LineAxis::new(&line), state.line(index), work);
            sum.add(&answer);
            classes[class as usize] = true;
        }
        let class = match classes {
            [true, false, false] => LightClass::Lit,
            [false, false, _] => LightClass::Umbra,
            _ => LightClass::Penumbra,
        };
        (sum, class)
    }

    fn line(
        &self,
        surface: &SurfacePoint,
        line: &LineLight,
        axis: &LineAxis,
        state: &mut LineState,
        work: &mut Work<'_>,
    ) -> (LightAnswer, LightClass) {
        // The geometric face decides what can arrive at all, the shading normal how much of it counts.
        let face = Receiver {
            position: surface.origin,
            normal: surface.geometric_normal,
        };
        let receiver = Receiver {
            position: surface.position,
            normal: surface.shading_normal,
        };
        let wasteful = self.settings.wasteful;
        let mut above = horizon_clip(&face, line.a, line.b).and_then(|(t0, t1)| {
            let irradiance = LineIrradiance::along(&receiver, axis);
            let (s0, s1) = irradiance.lit_range()?;
            let (t0, t1) = (t0.max(s0), t1.min(s1));
            (t0 < t1).then_some((irradiance, t0, t1))
        });
        if wasteful.clip || (wasteful.horizon && above.is_none()) {
            above = Some((LineIrradiance::along(&receiver, axis), 0.0, 1.0));
        }
        let Some((irradiance, t0, t1)) = above else {
            state.clear();
            work.statistics.skipped.below_horizon += 1;
            return (LightAnswer::default(), LightClass::Umbra);
        };
        work.statistics.skipped.horizon_clipped += u64::from(t0 > 0.0 || t1 < 1.0);
        let stretch = Stretch {
            irradiance,
            t0,
            span: t1 - t0,
        };
        let mut oracle = Counting::new(Toward {
            tracer: self.tracer,
            from: surface.origin,
            line,
            t0,
            span: stretch.span,
        });
        let sum = self.search(&mut oracle, &stretch, state, work);
        let tests = oracle.tests();
        work.statistics.visibility_tests += u64::from(tests);
        let visible = &work.scratch.visible;
        if let Some(blockers) = &mut work.blockers {
            self.blockers(surface.origin, line, &stretch, visible, blockers);
        }
        let class = if visible.is_lit() {
            LightClass::Lit
        } else if visible.is_dark() {
            LightClass::Umbra
        } else {
            LightClass::Penumbra
        };
        let mut lobes = Lobes::default();
        if self.settings.glossy && class != LightClass::Umbra {
            let roughness = self.lights.roughness[surface.material.index()];
            let glossy = LineGlossy::new(&receiver, line, surface.to_viewer, roughness);
            let mut mapped = std::mem::take(&mut work.scratch.mapped);
            mapped.clear();
            for panel in visible.panels() {
                mapped.push(Panel::exact(
                    t0 + stretch.span * panel.start,
                    t0 + stretch.span * panel.end,
                ));
            }
            lobes = glossy.partition(&mapped, &GlossyOptions::default()).lobes;
            work.scratch.mapped = mapped;
        }
        let answer = LightAnswer {
            irradiance: sum,
            discontinuities: visible.discontinuities() as u32,
            tests,
            certificate: visible.certificate(),
            lobes,
        };
        (answer, class)
    }

    /// Finds the visible part of the stretch `t0 + span * [0, 1]` of the light, leaves it in `scratch.visible`
    /// (in parameters of the stretch) and returns the irradiance.
    fn search(
        &self,
        oracle: &mut Counting<Toward<'_>>,
        stretch: &Stretch,
        state: &mut LineState,
        work: &mut Work<'_>,
    ) -> f64 {
        let settings = self.settings;
        match settings.method {
            Method::Exact => {
                self.fan(oracle, stretch, u32::MAX, work);
            }
            Method::Auto => {
                if !self.fan(oracle, stretch, settings.fan_budget, work) {
                    self.search_and_polish(oracle, stretch, state, work);
                }
            }
            Method::Finder => self.any_number(oracle, state, work),
            Method::Gauss | Method::Hpd | Method::Stratified | Method::Uniform => {
                return self.sampled(oracle, stretch, work.random.stream(), work.scratch);
            }
            _ if work.split <= 1 => self.few_changes(oracle, &mut state.tdf, work),
            _ => {
                // Each part on its own: what would be too many changes for one search is few for each of several.
                let parts = f64::from(work.split);
                let mut whole = std::mem::take(&mut work.scratch.mapped);
                whole.clear();
                for part in 0..work.split {
                    let mut within = |t: f64| oracle.visible((f64::from(part) + t) / parts);
                    self.few_changes(&mut within, &mut Coherence::default(), work);
                    for panel in work.scratch.visible.panels() {
                        whole.push(Panel {
                            start: (f64::from(part) + panel.start) / parts,
                            end: (f64::from(part) + panel.end) / parts,
                            start_uncertainty: panel.start_uncertainty / parts,
                            end_uncertainty: panel.end_uncertainty / parts,
                        });
                    }
                }
                whole.set_certificate(Certificate::Sampled);
                work.scratch.mapped = std::mem::replace(&mut work.scratch.visible, whole);
            }
        }
        stretch.panels(&work.scratch.visible)
    }

    /// One exact query for the whole stretch; leaves the result in `scratch.visible`. False if the budget was spent.
    fn fan(
        &self,
        oracle: &mut Counting<Toward<'_>>,
        stretch: &Stretch,
        budget: u32,
        work: &mut Work<'_>,
    ) -> bool {
        let Toward {
            from, line, t0, span, ..
        } = *oracle.inner();
        let prune = !self.settings.wasteful.prune;
        let query = FanQuery {
            t0,
            t1: t0 + span,
            budget,
            prune,
            ..FanQuery::new(from, line.a, line.b)
        };
        let Scratch {
            fan, mapped, visible, ..
        } = &mut *work.scratch;
        visible.clear();
        let sight = work.shaft.map_or(Sight::Unknown, Shaft::sight);
        match sight {
            Sight::Clear => {
                work.statistics.skipped.clear_blocks += 1;
                visible.push(Panel::exact(stretch.inside(query.t0), stretch.inside(query.t1)));
                return true;
            }
            Sight::Blocked => {
                work.statistics.skipped.hidden_blocks += 1;
                return true;
            }
            _ => {}
        }
        let report = match work.shaft {
            Some(shaft) => {
                work.statistics.fans.in_shaft += 1;
                self.tracer.fan_in_shaft(&query, shaft, fan, mapped)
            }
            None => self.tracer.fan(&query, fan, mapped),
        };
        work.statistics.fans.count(&report);
        visible.set_certificate(mapped.certificate());
        for panel in mapped.panels() {
            visible.push(Panel::exact(
                stretch.inside(panel.start),
                stretch.inside(panel.end),
            ));
        }
        report.complete
    }

    /// The finder for any number of changes; leaves the result in `scratch.visible`.
    fn any_number(&self, oracle: &mut Counting<Toward<'_>>, state: &mut LineState, work: &mut Work<'_>) {
        let Work {
            at,
            random,
            scratch,
            statistics,
            ..
        } = work;
        let rng = random.stream();
        let finder = Finder {
            epsilon: self.settings.epsilon,
            nu: self.settings.nu,
        };
        let shift = Shift {
            lattice: self.dither(*at),
            cover: uniform(rng),
        };
        let report = finder.find(
            oracle,
            &mut state.changes,
            shift,
            &mut scratch.finder,
            &mut scratch.visible,
        );
        statistics.end_tests += u64::from(report.end_tests);
        scratch.widest_untested = report.widest_untested;
    }

    /// For a fan too dear to cover: changes are bracketed by the finder, and each bracket's end is then found exactly.
    fn search_and_polish(
        &self,
        oracle: &mut Counting<Toward<'_>>,
        stretch: &Stretch,
        state: &mut LineState,
        work: &mut Work<'_>,
    ) {
        self.any_number(oracle, state, work);
        let Toward { from, line, .. } = *oracle.inner();
        let Scratch {
            visible,
            mapped,
            fan,
            widest_untested,
            ..
        } = &mut *work.scratch;
        mapped.clear();
        let mut exact = true;
        let mut polish = |t: f64, uncertainty: f64, visible_at_lo: bool| -> f64 {
            if uncertainty == 0.0 {
                return t;
            }
            let (lo, hi) = ((t - uncertainty).max(0.0), (t + uncertainty).min(1.0));
            let bracket = Bracket::new(stretch.at(lo), stretch.at(hi), visible_at_lo);
            work.statistics.fans.polished += 1;
            match self.tracer.polish(from, line.a, line.b, bracket, fan) {
                Some(change) => stretch.inside(change),
                None => {
                    exact = false;
                    t
                }
            }
        };
        let mut end_before = 0.0;
        for panel in visible.panels() {
            let start = polish(panel.start, panel.start_uncertainty, false).max(end_before);
            let end = polish(panel.end, panel.end_uncertainty, true);
            mapped.push(Panel::exact(start, end));
            end_before = end.max(start);
        }
        let certificate = if exact {
            Certificate::BoundedGaps(*widest_untested)
        } else {
            Certificate::Sampled
        };
        mapped.set_certificate(certificate);
        std::mem::swap(visible, mapped);
    }

    /// The two-discontinuity finder, or a search for a single change; leaves the result in `scratch.visible`.
    fn few_changes(&self, oracle: &mut impl Visibility, coherence: &mut Coherence, work: &mut Work<'_>) {
        let Work {
            at,
            random,
            scratch,
            statistics,
            ..
        } = work;
        let rng = random.stream();
        let settings = self.settings;
        let visible = &mut scratch.visible;
        let bisection = match settings.method {
            Method::Bisection => Bisection::Bisection,
            Method::JitteredBisection => Bisection::Jittered,
            Method::RandomCut => Bisection::RandomCut,
            Method::Rsb => Bisection::RandomSeed,
            Method::Dithered => Bisection::DitheredAt(self.dither(*at)),
            _ => {
                let tdf = Tdf {
                    stop: Stop::Tolerance(settings.epsilon),
                    nu: settings.nu,
                    ..Tdf::default()
                };
                let report = tdf.find(oracle, coherence, rng, &mut scratch.tdf, visible);
                statistics.end_tests += u64::from(report.end_tests);
                statistics.tdf.count(&report);
                return;
            }
        };
        single_change(oracle, bisection, settings.epsilon, rng, visible);
        statistics.end_tests += 2;
    }

    /// The shift of dithered bisection, from a blue-noise mask: neighbouring pixels err in different directions.
    fn dither(&self, at: Pixel) -> f64 {
        DitherMask::blue_noise().value(at.x, at.y, at.subsample)
    }

    /// Tests the points of a pattern; leaves what they suggest in `scratch.visible` and returns the estimate.
    fn sampled(
        &self,
        oracle: &mut Counting<Toward<'_>>,
        stretch: &Stretch,
        rng: &mut Pcg64Mcg,
        scratch: &mut Scratch,
    ) -> f64 {
        let Scratch {
            visible,
            samples,
            points,
            answers,
            ..
        } = scratch;
        let count = self.settings.samples as usize;
        points.resize(count, 0.0);
        answers.resize(count, false);
        match self.settings.method {
            Method::Gauss => points.copy_from_slice(&self.lights.gauss.0),
            Method::Hpd => Pattern::HierarchicalPoisson.fill(rng, points),
            Method::Uniform => Pattern::Uniform.fill(rng, points),
            _ => Pattern::Stratified.fill(rng, points),
        }
        oracle.visible_each(points, answers);
        let equal = 1.0 / count as f64;
        let mut sum = 0.0;
        samples.clear();
        for (i, (&t, &lit)) in points.iter().zip(answers.iter()).enumerate() {
            samples.push((t, lit));
            if lit {
                sum += self.lights.gauss.1.get(i).unwrap_or(&equal)
                    * stretch.irradiance.density(stretch.t0 + stretch.span * t);
            }
        }
        samples_to_panels(samples, visible);
        sum * stretch.span
    }

    fn point(
        &self,
        surface: &SurfacePoint,
        position: DVec3,
        line: &LineLight,
        work: &mut Work<'_>,
    ) -> (LightAnswer, LightClass) {
        let receiver = Receiver {
            position: surface.position,
            normal: surface.shading_normal,
        };
        let sum = LineIrradiance::new(&receiver, line).panel(0.0, 1.0);
        if sum <= 0.0 || surface.geometric_normal.dot(position - surface.origin) <= 0.0 {
            work.statistics.skipped.below_horizon += 1;
            return (LightAnswer::default(), LightClass::Umbra);
        }
        work.statistics.visibility_tests += 1;
        work.statistics.end_tests += 1;
        let mut answer = LightAnswer {
            tests: 1,
            ..LightAnswer::default()
        };
        if self.tracer.occluded(surface.origin, position) {
            if let Some(blockers) = &mut work.blockers {
                self.first_blocker(surface.origin, position, blockers);
            }
            return (answer, LightClass::Umbra);
        }
        answer.irradiance = sum;
        if self.settings.glossy {
            let roughness = self.lights.roughness[surface.material.index()];
            let glossy = LineGlossy::new(&receiver, line, surface.to_viewer, roughness);
            answer.lobes = glossy.panel(0.0, 1.0, &GlossyOptions::default()).lobes;
        }
        (answer, LightClass::Lit)
    }
}

/// Whose turn it is, and the state that the caller owns.
pub(crate) struct Work<'a> {
    pub(crate) at: Pixel,
    /// Parts of each line that a search for few changes searches on their own; 1 is the rule.
    pub(crate) split: u32,
    /// What is known about the light and the pixels around.
    pub(crate) shaft: Option<&'a Shaft>,
    pub(crate) random: Random,
    /// Where the objects go that hide something of the light, if they are asked for.
    pub(crate) blockers: Option<&'a mut Vec<ObjectId>>,
    pub(crate) scratch: &'a mut Scratch,
    pub(crate) statistics: &'a mut Statistics,
}

/// The part of a line above the horizon: parameters `t0 + span * [0, 1]`.
pub(crate) struct Stretch {
    irradiance: LineIrradiance,
    t0: f64,
    span: f64,
}

impl Stretch {
    /// The light parameter at `u` in [0, 1] of the stretch.
    pub(crate) fn at(&self, u: f64) -> f64 {
        self.t0 + self.span * u
    }

    /// The place in [0, 1] of the stretch of a light parameter.
    fn inside(&self, t: f64) -> f64 {
        ((t - self.t0) / self.span).clamp(0.0, 1.0)
    }

    /// Irradiance of the visible panels, which are in parameters of the stretch.
    fn panels(&self, visible: &Partition) -> f64 {
        visible
            .panels()
            .iter()
            .map(|panel| self.irradiance.panel(self.at(panel.start), self.at(panel.end)))
            .sum()
    }
}

/// The oracle: shadow rays from a surface point to the stretch `t0 + span * [0, 1]` of a light.
#[derive(Clone, Copy)]
struct Toward<'a> {
    tracer: &'a Tracer,
    from: DVec3,
    line: &'a LineLight,
    t0: f64,
    span: f64,
}

impl Visibility for Toward<'_> {
    fn visible(&mut self, t: f64) -> bool {
        !self
            .tracer
            .occluded(self.from, self.line.point(self.t0 + self.span * t))
    }

    fn visible_each(&mut self, ts: &[f64], answers: &mut [bool]) {
        // The pencil runs over the stretch, whose ends are points of the light.
        let (a, b) = (self.line.point(self.t0), self.line.point(self.t0 + self.span));
        self.tracer.occluded_pencil(self.from, a, b, ts, answers);
        for answer in answers {
            *answer = !*answer;
        }
    }
}
