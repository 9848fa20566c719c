//! Direct light of one light on one surface point.

use glam::DVec3;
use llsr_quadrature::{
    DitherMask, Emission, GaussRule, LineIrradiance, LineLight, Pattern, Receiver, horizon_clip,
};
use llsr_rsb::{Method as Bisection, Stop, uniform};
use llsr_scene::{EmissionLaw, Light, LightId, Scene};
use llsr_tdf::{ChangeCoherence, Coherence, Finder, FinderScratch, Shift, Tdf, TdfScratch};
use llsr_tracer::Tracer;
use llsr_visibility::{Certificate, Counting, Partition, Visibility};
use rand_pcg::Pcg64Mcg;

use crate::search::{samples_to_panels, single_change};
use crate::{LightClass, Method, Settings, Statistics, SurfacePoint};

/// Which pixel is being shaded; seeds patterns and picks from dither masks.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pixel {
    pub(crate) x: u32,
    pub(crate) y: u32,
    pub(crate) index: u64,
    pub(crate) subsample: u32,
}

/// What the neighbouring pixel saw of a light; the caller carries it along a row and starts anew with the
/// default.
#[derive(Clone, Debug, Default)]
pub struct LightState {
    tdf: Coherence,
    changes: ChangeCoherence,
}

impl LightState {
    /// Forgets the neighbour and keeps the memory.
    pub fn clear(&mut self) {
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
}

impl Default for LightAnswer {
    fn default() -> Self {
        Self {
            irradiance: 0.0,
            discontinuities: 0,
            tests: 0,
            certificate: Certificate::Exact,
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
    }
}

/// A light as the quadrature sees it.
#[derive(Clone, Copy, Debug)]
enum Source {
    Dark,
    Point { position: DVec3, line: LineLight },
    Line(LineLight),
}

/// Shades surface points with the lights of a scene.
#[derive(Debug)]
pub struct DirectLight<'a> {
    tracer: &'a Tracer,
    settings: &'a Settings,
    sources: Vec<Source>,
    /// Nodes and weights of the Gauss rule on [0, 1], for [`Method::Gauss`].
    gauss: (Vec<f64>, Vec<f64>),
}

impl<'a> DirectLight<'a> {
    /// Prepares the lights of `scene`.
    pub fn new(scene: &Scene, tracer: &'a Tracer, settings: &'a Settings) -> Self {
        let gauss = if settings.method == Method::Gauss {
            GaussRule::new(settings.samples as usize).iter().unzip()
        } else {
            (Vec::new(), Vec::new())
        };
        Self {
            tracer,
            settings,
            sources: scene.lights.iter().map(source).collect(),
            gauss,
        }
    }

    /// Irradiance of one light on a surface point.
    ///
    /// `state` belongs to this light and is what the neighbouring pixel saw of it. Cost: a few dozen nanoseconds
    /// plus the visibility tests, which are counted in `statistics`.
    #[expect(
        clippy::too_many_arguments,
        reason = "each is another kind of state that the caller owns"
    )]
    pub(crate) fn shade(
        &self,
        surface: &SurfacePoint,
        light: LightId,
        at: Pixel,
        state: &mut LightState,
        rng: &mut Pcg64Mcg,
        scratch: &mut Scratch,
        statistics: &mut Statistics,
    ) -> LightAnswer {
        let line = match &self.sources[light.index()] {
            Source::Dark => {
                statistics.skipped.no_power += 1;
                statistics.count_class(LightClass::Umbra);
                statistics.discontinuities[0] += 1;
                return LightAnswer::default();
            }
            Source::Point { position, line } => return self.point(surface, *position, line, statistics),
            Source::Line(line) => line,
        };
        // The geometric face decides what can arrive at all, the shading normal how much of it counts.
        let face = Receiver {
            position: surface.origin,
            normal: surface.geometric_normal,
        };
        let receiver = Receiver {
            position: surface.position,
            normal: surface.shading_normal,
        };
        let above = horizon_clip(&face, line.a, line.b).and_then(|(t0, t1)| {
            let irradiance = LineIrradiance::new(&receiver, line);
            let (s0, s1) = irradiance.lit_range()?;
            let (t0, t1) = (t0.max(s0), t1.min(s1));
            (t0 < t1).then_some((irradiance, t0, t1))
        });
        let Some((irradiance, t0, t1)) = above else {
            state.clear();
            statistics.skipped.below_horizon += 1;
            statistics.count_class(LightClass::Umbra);
            statistics.discontinuities[0] += 1;
            return LightAnswer::default();
        };
        statistics.skipped.horizon_clipped += u64::from(t0 > 0.0 || t1 < 1.0);
        let span = t1 - t0;
        let mut oracle = Counting::new(Toward {
            tracer: self.tracer,
            from: surface.origin,
            line,
            t0,
            span,
        });
        let sum = self.search(
            &mut oracle,
            &irradiance,
            (t0, span),
            at,
            state,
            rng,
            scratch,
            statistics,
        );
        let tests = oracle.tests();
        statistics.visibility_tests += u64::from(tests);
        let visible = &scratch.visible;
        let discontinuities = visible.discontinuities() as u32;
        statistics.count_class(if visible.is_lit() {
            LightClass::Lit
        } else if visible.is_dark() {
            LightClass::Umbra
        } else {
            LightClass::Penumbra
        });
        let last = statistics.discontinuities.len() - 1;
        statistics.discontinuities[(discontinuities as usize).min(last)] += 1;
        LightAnswer {
            irradiance: sum,
            discontinuities,
            tests,
            certificate: visible.certificate(),
        }
    }

    /// Finds the visible part of the stretch `t0 + span * [0, 1]` of the light, leaves it in `scratch.visible`
    /// (in parameters of the stretch) and returns the irradiance.
    #[expect(
        clippy::too_many_arguments,
        reason = "each is another kind of state that the caller owns"
    )]
    fn search(
        &self,
        oracle: &mut Counting<Toward<'_>>,
        irradiance: &LineIrradiance,
        (t0, span): (f64, f64),
        at: Pixel,
        state: &mut LightState,
        rng: &mut Pcg64Mcg,
        scratch: &mut Scratch,
        statistics: &mut Statistics,
    ) -> f64 {
        let settings = self.settings;
        let visible = &mut scratch.visible;
        let bisection = match settings.method {
            Method::Bisection => Bisection::Bisection,
            Method::JitteredBisection => Bisection::Jittered,
            Method::RandomCut => Bisection::RandomCut,
            Method::Rsb => Bisection::RandomSeed,
            Method::Dithered => Bisection::DitheredAt(self.dither(at)),
            Method::Tdf => {
                let tdf = Tdf {
                    stop: Stop::Tolerance(settings.epsilon),
                    nu: settings.nu,
                    ..Tdf::default()
                };
                let report = tdf.find(oracle, &mut state.tdf, rng, &mut scratch.tdf, visible);
                statistics.end_tests += u64::from(report.end_tests);
                statistics.tdf.count(&report);
                return panels(irradiance, visible, t0, span);
            }
            Method::Auto => {
                let finder = Finder {
                    epsilon: settings.epsilon,
                    nu: settings.nu,
                };
                let shift = Shift {
                    lattice: self.dither(at),
                    cover: uniform(rng),
                };
                let report = finder.find(oracle, &mut state.changes, shift, &mut scratch.finder, visible);
                statistics.end_tests += u64::from(report.end_tests);
                return panels(irradiance, visible, t0, span);
            }
            Method::Gauss | Method::Hpd | Method::Stratified | Method::Uniform => {
                return self.sampled(oracle, irradiance, (t0, span), rng, scratch);
            }
        };
        single_change(oracle, bisection, settings.epsilon, rng, visible);
        statistics.end_tests += 2;
        panels(irradiance, visible, t0, span)
    }

    /// The shift of dithered bisection, from a blue-noise mask: neighbouring pixels err in different directions.
    fn dither(&self, at: Pixel) -> f64 {
        DitherMask::blue_noise().value(at.x, at.y, at.subsample)
    }

    /// Tests the points of a pattern; leaves what they suggest in `scratch.visible` and returns the estimate.
    fn sampled(
        &self,
        oracle: &mut Counting<Toward<'_>>,
        irradiance: &LineIrradiance,
        (t0, span): (f64, f64),
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
            Method::Gauss => points.copy_from_slice(&self.gauss.0),
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
                sum += self.gauss.1.get(i).unwrap_or(&equal) * irradiance.density(t0 + span * t);
            }
        }
        samples_to_panels(samples, visible);
        sum * span
    }

    fn point(
        &self,
        surface: &SurfacePoint,
        position: DVec3,
        line: &LineLight,
        statistics: &mut Statistics,
    ) -> LightAnswer {
        let receiver = Receiver {
            position: surface.position,
            normal: surface.shading_normal,
        };
        let sum = LineIrradiance::new(&receiver, line).panel(0.0, 1.0);
        statistics.discontinuities[0] += 1;
        if sum <= 0.0 || surface.geometric_normal.dot(position - surface.origin) <= 0.0 {
            statistics.skipped.below_horizon += 1;
            statistics.count_class(LightClass::Umbra);
            return LightAnswer::default();
        }
        statistics.visibility_tests += 1;
        statistics.end_tests += 1;
        let occluded = self.tracer.occluded(surface.origin, position);
        statistics.count_class(if occluded {
            LightClass::Umbra
        } else {
            LightClass::Lit
        });
        LightAnswer {
            irradiance: if occluded { 0.0 } else { sum },
            tests: 1,
            ..LightAnswer::default()
        }
    }
}

/// Irradiance of the visible panels of the stretch `t0 + span * [0, 1]`.
fn panels(irradiance: &LineIrradiance, visible: &Partition, t0: f64, span: f64) -> f64 {
    visible
        .panels()
        .iter()
        .map(|panel| irradiance.panel(t0 + span * panel.start, t0 + span * panel.end))
        .sum()
}

fn source(light: &Light) -> Source {
    if light.flux() <= 0.0 {
        return Source::Dark;
    }
    match light {
        Light::Linear(light) => {
            let emission = match light.emission {
                EmissionLaw::Diffuse => Emission::Diffuse,
                EmissionLaw::Isotropic => Emission::Isotropic,
            };
            let line = LineLight {
                a: light.a,
                b: light.b,
                emission,
                flux: light.flux,
            };
            // Without a length there is nothing to search along.
            if light.length() > 0.0 {
                Source::Line(line)
            } else {
                Source::Point {
                    position: light.a,
                    line,
                }
            }
        }
        Light::Point(light) => {
            let (position, flux) = (light.position, light.flux);
            let line = LineLight {
                a: position,
                b: position,
                emission: Emission::Isotropic,
                flux,
            };
            Source::Point { position, line }
        }
    }
}

/// The oracle: shadow rays from a surface point to the stretch `t0 + span * [0, 1]` of a light.
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
