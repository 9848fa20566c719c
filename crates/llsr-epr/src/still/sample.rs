//! Which pixels are shaded, and their light.

use glam::{DVec3, Vec3A};
use llsr_epi::{EdgePointImage, PixelClass};
use llsr_quadrature::{DitherMask, MetalRough};
use llsr_render_cache::{Chooser, Priorities};
use llsr_scene::{Camera, LightId, ObjectId, Scene, Triple, Viewport, luminance};
use llsr_shading::{DirectLight, LightAnswer, LightState, Pixel, Scratch, Statistics, SurfacePoint};
use llsr_tracer::Tracer;
use rayon::prelude::*;

use crate::still::spread::Links;
use crate::still::surface::{Seen, look};
use crate::still::{StillCounts, StillSettings};

/// Parts of a round's work, each of which is one step of progress.
pub(crate) const CHUNKS: usize = 64;
/// Steps in which light spreads between rounds, and for the final picture.
const STEPS: (usize, usize) = (12, 40);

/// Memory that one worker keeps.
#[derive(Default)]
pub(crate) struct Brush {
    states: Vec<LightState>,
    scratch: Scratch,
    blockers: Vec<ObjectId>,
    /// What rays through a pixel met.
    pub(crate) points: Vec<Option<SurfacePoint>>,
}

/// Shades surface points.
pub(crate) struct Shaded<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) tracer: &'a Tracer,
    pub(crate) camera: &'a Camera,
    pub(crate) viewport: Viewport,
    pub(crate) direct: &'a DirectLight<'a>,
    pub(crate) glossy: bool,
}

impl Shaded<'_> {
    /// What arrives at a point, to be interpolated: irradiance; with glossy surfaces reflected radiance. With `triples`, notes who
    /// hides which light from it.
    pub(crate) fn light(
        &self,
        point: &SurfacePoint,
        at: Pixel,
        brush: &mut Brush,
        triples: Option<&mut Vec<Triple>>,
        statistics: &mut Statistics,
    ) -> Vec3A {
        let material = &self.scene.materials[point.material.index()];
        let reflection = MetalRough {
            base_color: point.albedo.as_dvec3(),
            metallic: f64::from(material.metallic),
            roughness: f64::from(material.roughness),
        };
        let mut sum = DVec3::ZERO;
        let Brush {
            states,
            scratch,
            blockers,
            ..
        } = brush;
        let mut add = |light: LightId, answer: &LightAnswer| {
            let colour = self.scene.lights[light.index()].color().as_dvec3();
            sum += if self.glossy {
                colour * reflection.radiance(&answer.lobes)
            } else {
                colour * answer.irradiance
            };
        };
        match triples {
            None => self
                .direct
                .shade_point(point, at, states, scratch, statistics, add),
            Some(triples) => self.direct.shade_point_and_blockers(
                point,
                at,
                states,
                scratch,
                statistics,
                blockers,
                |light, answer, blockers| {
                    add(light, answer);
                    triples.extend(blockers.iter().map(|&blocker| Triple {
                        light,
                        blocker,
                        receiver: point.object,
                    }));
                },
            ),
        }
        sum.as_vec3a()
    }

    /// The light at the centres of some pixels; `None` if `progress` asked to stop. Lists each triple met once, in order.
    pub(crate) fn pixels(
        &self,
        pixels: &[u32],
        triples: Option<&mut Vec<Triple>>,
        progress: &(dyn Fn() -> bool + Sync),
        statistics: &mut Statistics,
    ) -> Option<Vec<Vec3A>> {
        let meet = triples.is_some();
        let part = |brush: &mut Brush, pixels: &[u32]| {
            let mut counts = Statistics::default();
            let mut met = Vec::new();
            let light: Vec<Vec3A> = pixels
                .iter()
                .map(|&index| {
                    let (x, y) = (index % self.viewport.width, index / self.viewport.width);
                    let (u, v) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
                    counts.primary_rays += 1;
                    let at = Pixel {
                        x,
                        y,
                        index: u64::from(index),
                        subsample: 0,
                    };
                    look(self.scene, self.tracer, self.camera, self.viewport, u, v).map_or(
                        Vec3A::ZERO,
                        |point| {
                            let triples = meet.then_some(&mut met);
                            self.light(&point, at, brush, triples, &mut counts)
                        },
                    )
                })
                .collect();
            met.sort_unstable();
            met.dedup();
            progress().then_some((light, met, counts))
        };
        let length = pixels.len().div_ceil(CHUNKS).max(1);
        let parts: Option<Vec<_>> = pixels.par_chunks(length).map_init(Brush::default, part).collect();
        let mut all = Vec::with_capacity(pixels.len());
        let mut all_met = Vec::new();
        for (light, met, counts) in parts? {
            all.extend(light);
            all_met.extend(met);
            statistics.add(&counts);
        }
        if let Some(triples) = triples {
            all_met.sort_unstable();
            all_met.dedup();
            *triples = all_met;
        }
        Some(all)
    }
}

/// The pixels that have been shaded, and what follows from them.
pub(crate) struct Choice {
    width: u32,
    height: u32,
    links: Links,
    /// Pixels that may be shaded: not complex, and something is seen there.
    candidate: Vec<bool>,
    /// The light at each pixel; after the last round all of it.
    pub(crate) light: Vec<Vec3A>,
    fixed: Vec<bool>,
    /// In which round a pixel was shaded, from 1; 0 if it was not.
    pub(crate) rounds: Vec<u8>,
    /// Samples of all rounds.
    budget: usize,
    taken: usize,
    count: u32,
    seed: u64,
}

impl Choice {
    pub(crate) fn new(image: &EdgePointImage, seen: &[Seen], links: Links, settings: &StillSettings) -> Self {
        let (width, height) = image.size();
        let candidate = candidates(image, seen);
        let fixed = seen.iter().map(|seen| !seen.is_hit()).collect();
        Self {
            width,
            height,
            links,
            light: vec![Vec3A::ZERO; seen.len()],
            fixed,
            rounds: vec![0; seen.len()],
            budget: (settings.density.clamp(0.0, 1.0) * seen.len() as f64).ceil() as usize,
            taken: 0,
            count: settings.rounds.max(1),
            seed: settings.shading.seed,
            candidate,
        }
    }

    /// The pixels to shade in a round, in scan order.
    pub(crate) fn next(&mut self, round: u32, seen: &[Seen], counts: &mut StillCounts) -> Vec<u32> {
        if round == 0 {
            return self.first(counts);
        }
        // Those of small regions come on top; where there are many they would leave nothing for the places that need it.
        let spread = self.taken.saturating_sub(counts.regions_missed);
        let left = self.budget.saturating_sub(spread) / (self.count - round) as usize;
        self.by_need(round, left, seen)
    }

    /// Blue noise, and the middle of every region that it misses.
    fn first(&self, counts: &mut StillCounts) -> Vec<u32> {
        let share = if self.count > 1 { 0.5 } else { 1.0 };
        let wanted = share * self.budget as f64;
        let candidates = self.candidate.iter().filter(|&&is| is).count();
        let threshold = if candidates == 0 {
            0.0
        } else {
            wanted / candidates as f64
        };
        let mask = DitherMask::blue_noise();
        let shift = [self.seed as u32 % 64, (self.seed >> 6) as u32 % 64];
        let chosen = |index: usize| {
            let (x, y) = (index as u32 % self.width, index as u32 / self.width);
            self.candidate[index] && mask.value(x + shift[0], y + shift[1], 0) < threshold
        };
        let mut pixels: Vec<u32> = (0..self.candidate.len())
            .filter(|&index| chosen(index))
            .map(|index| index as u32)
            .collect();
        pixels.extend(self.unreached(pixels.iter().copied(), counts));
        pixels.sort_unstable();
        pixels
    }

    /// The middle of each region that no sample reaches, in scan order.
    pub(crate) fn missed(&self, counts: &mut StillCounts) -> Vec<u32> {
        let known = (0..self.fixed.len()).filter(|&index| self.fixed[index]);
        let mut pixels = self.unreached(known.map(|index| index as u32), counts);
        pixels.sort_unstable();
        pixels
    }

    /// The middle of each region that is not reached from `known`.
    fn unreached(&self, known: impl Iterator<Item = u32>, counts: &mut StillCounts) -> Vec<u32> {
        let mut reached = vec![false; self.candidate.len()];
        let mut region = Vec::new();
        for index in known {
            if !reached[index as usize] {
                self.links.flood(index as usize, &mut reached, &mut region);
            }
        }
        let mut pixels = Vec::new();
        for index in 0..self.candidate.len() {
            if self.candidate[index] && !reached[index] {
                self.links.flood(index, &mut reached, &mut region);
                // The middle of the flood is far from where it began and where it ended.
                if let Some(&middle) = region.iter().skip(region.len() / 2).find(|&&i| self.candidate[i]) {
                    pixels.push(middle as u32);
                    counts.regions_missed += 1;
                }
            }
        }
        pixels
    }

    /// Goes on with further edges. What is known stays known.
    pub(crate) fn relink(&mut self, image: &EdgePointImage, seen: &[Seen], links: Links) {
        self.links = links;
        self.candidate = candidates(image, seen);
    }

    /// Pixels far from samples and where the picture so far changes.
    fn by_need(&mut self, round: u32, count: usize, seen: &[Seen]) -> Vec<u32> {
        let (Ok(mut priorities), Ok(mut chooser)) = (
            Priorities::new(self.width, self.height),
            Chooser::new(self.width, self.height),
        ) else {
            return Vec::new();
        };
        let mut light = self.light.clone();
        let distance = self.links.fill(&mut light, &self.fixed);
        self.links.relax(&mut light, &self.fixed, self.spacing(), STEPS.0);
        // Radiance is what is looked at; differences in the dark matter less.
        let shown = |index: usize| luminance(seen[index].albedo * glam::Vec3::from(light[index]));
        let lit = (0..seen.len()).filter(|&index| self.candidate[index]);
        let (sum, number) = lit.fold((0.0, 0usize), |(sum, n), index| {
            (sum + f64::from(shown(index)), n + 1)
        });
        let floor = (0.1 * sum / number.max(1) as f64) as f32 + f32::MIN_POSITIVE;
        let width = self.width as usize;
        let need = |index: usize| {
            if self.fixed[index] || !self.candidate[index] {
                return 0;
            }
            let here = luminance(light[index].into());
            let most = self
                .links
                .of(index)
                .map(|(other, _)| (luminance(light[other].into()) - here).abs())
                .fold(0.0f32, f32::max);
            let albedo = luminance(seen[index].albedo);
            let contrast = albedo * most / (shown(index) + floor);
            (f32::from(distance[index].min(16)) * (FLAT + contrast) * SCALE).clamp(1.0, 255.0) as u8
        };
        for y in 0..self.height {
            let row = priorities.row_mut(y);
            for (x, value) in row.iter_mut().enumerate() {
                *value = need(y as usize * width + x);
            }
        }
        let mut requests = Vec::new();
        let phase =
            (f64::from(round) * 0.618_033_988_749_894_8 + self.seed as f64 * 0.381_966_011_250_105).fract();
        chooser.choose(&mut priorities, count, phase, 0, &mut requests);
        let mut pixels: Vec<u32> = requests
            .iter()
            .map(|request| request.y * self.width + request.x)
            .collect();
        pixels.sort_unstable();
        pixels
    }

    /// Takes the light of the pixels of a round.
    pub(crate) fn take(&mut self, round: u32, pixels: &[u32], light: &[Vec3A]) {
        for (&index, &light) in pixels.iter().zip(light) {
            self.light[index as usize] = light;
            self.fixed[index as usize] = true;
            self.rounds[index as usize] = (round + 1).min(255) as u8;
        }
        self.taken += pixels.len();
    }

    /// Spreads all light; after the last round.
    pub(crate) fn finish(&mut self) {
        let spacing = self.spacing();
        self.links.fill(&mut self.light, &self.fixed);
        self.links.relax(&mut self.light, &self.fixed, spacing, STEPS.1);
    }

    /// Typical distance between samples (pixels).
    fn spacing(&self) -> f32 {
        let candidates = self.candidate.iter().filter(|&&is| is).count();
        (candidates as f32 / self.taken.max(1) as f32).sqrt()
    }
}

/// The pixels that may be shaded.
fn candidates(image: &EdgePointImage, seen: &[Seen]) -> Vec<bool> {
    let (width, _) = image.size();
    let pixel = |index: usize| {
        let (x, y) = (index as u32 % width, index as u32 / width);
        seen[index].is_hit() && image.class(x, y) != PixelClass::Complex
    };
    (0..seen.len()).map(pixel).collect()
}

/// Need of a pixel one step from a sample where nothing changes, as a contrast between neighbours.
const FLAT: f32 = 0.01;
/// Priority for each step of distance and unit of contrast.
const SCALE: f32 = 300.0;
