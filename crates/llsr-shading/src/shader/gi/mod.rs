//! Direct light with global illumination by irradiance caching.
//!
//! G. Ward, F. Rubinstein, R. Clear, "A ray tracing solution for diffuse interreflection", SIGGRAPH 1988, with the
//! gradients of Ward & Heckbert 1992: light that comes by way of other surfaces changes slowly, so it is gathered at few
//! places and taken over from there.
//!
//! # Where records lie
//! The original makes a record where one is first missing. That depends on the order of work, and with it every picture
//! would depend on the number of threads. Here records can only lie at places that the scene alone determines (where the
//! lines of a lattice cross surfaces, see [`lattice`]), and what a record says depends on its place alone. A point
//! looks at the four lines of each axis around it, on the coarsest level first, and goes on to finer levels until records that
//! are good enough there cover it; the levels are blended so that nothing jumps. What is remembered and what is made
//! anew then is no longer seen in the result.
//!
//! # Less noise
//! What a record says is a mean over few paths, and each record errs by itself: where that shows, walls look blotchy. Two things keep it
//! low. Where a path meets a surface the lights are asked by rays to places spread as their irradiance is in closed form, so that
//! only what hides them is left to chance. And a path ends on its first surface, if that is far enough away: what comes there
//! over further surfaces is taken from records of their own, see [`far`].
//!
//! # Leaks
//! A record only serves points that see it, so that light does not leak under walls.
//!
//! # Moving things
//! Records that a move may concern are made anew when they are next needed, or little by little; see
//! [`Record::holds`](record::Record::holds) and [`Renewal`].

mod cache;
mod changes;
mod far;
mod gather;
mod lattice;
mod path;
mod record;
mod renewal;

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

use glam::{DVec3, Vec3};
use llsr_scene::luminance;
use llsr_tracer::Hit;
use rand_pcg::Pcg64Mcg;

use crate::random::mix;
use crate::shader::look::{Shaded, direct_and_met, shade_each};
use crate::shader::world::Stage;
use crate::shader::{
    Encounters, MovedThing, SceneChange, ShadeRequest, ShadedPoint, Shader, ShaderError, ShaderScratch, World,
};
use crate::{DirectLight, PreparedLights, Settings, SurfacePoint};
use cache::{Footprint, Memory};
use changes::Changes;
use gather::{Gathered, gather};
pub(crate) use gather::{Sample, frame, unit};
use lattice::{LEVELS, Lattice, LineKey, PlaceKey, scene_size};
use path::{Beacon, Paths};
use record::{Fan, Record};
pub use renewal::Renewal;
use renewal::{Need, Purse};

/// The level of the lattice with the widest records for points; the one before is that of records for rays from afar.
const NEAR_LEVEL: usize = 1;
/// How much farther apart the latter are.
const FAR_WIDTH: f64 = (1 << NEAR_LEVEL) as f64;

/// What coarse levels may leave open of a point's light, as a share, without a finer level being asked: records of that would
/// hardly show.
const LEFT_OPEN: f64 = 0.1;

/// Rays that a ray of a record stands for, those to lights and to records included: of a record for points, and of one for rays
/// from afar, whose paths go on.
const NEAR_COST: u32 = 5;
const FAR_COST: u32 = 8;

/// The least weight of records that speaks for a point.
const ENOUGH: f64 = 0.2;

/// How global illumination is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GiSettings {
    /// Rays of a record from the zenith down and around it; each at least 2, at most 64.
    pub rays: [u32; 2],
    /// Surfaces over which light may come to a record, 1 to 32; what would come over more is left out.
    pub bounces: u32,
    /// How wrong a record may be, as a share, where it is used: the `a` of Ward et al. 1988; 0.05 to 1.
    pub tolerance: f64,
    /// Distance of records on the coarsest level, as a share of the diagonal of the scene's box, large outliers such as a ground left
    /// out; above 0, at most 1.
    pub spacing: f64,
    /// Levels, 1 to 12; on each, records may lie half as far apart as on the one before.
    pub levels: u32,
    /// Memory (bytes), a quarter of it for the lines of the lattice that lead to records, another for records that serve rays from
    /// afar. A record takes about half a kilobyte with
    /// the default number of rays. What was not asked for longest goes first.
    pub memory: usize,
    /// Seed of the records.
    pub seed: u64,
    /// When records that a move may concern are made anew.
    pub renewal: Renewal,
}

impl Default for GiSettings {
    fn default() -> Self {
        Self {
            rays: [8, 23],
            bounces: 8,
            tolerance: 0.3,
            spacing: 1.0 / 32.0,
            levels: 4,
            memory: 64 << 20,
            seed: 0,
            renewal: Renewal::AtOnce,
        }
    }
}

/// What a [`GiShader`] has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GiCounts {
    /// Records made, those for rays from afar too.
    pub made: u64,
    /// Records that are remembered now.
    pub records: u64,
    /// Lines of the lattice that are remembered now.
    pub lines: u64,
    /// What both take (bytes); at most [`GiSettings::memory`], but for a few.
    pub bytes: u64,
    /// Points for which no record was good enough, so that light was gathered for them alone.
    pub alone: u64,
}

/// Direct light with global illumination ("direct illumination with global illumination", Bala et al. 2003, section 7).
///
/// Surfaces reflect diffusely. Points depend on the scene, the settings and the seed alone. After moves they also depend on
/// the order of the moves and on what was shaded between them, still not on threads, as long as the number of
/// records stays below its limit. With [`Renewal::Gradual`] that holds until something moves.
#[derive(Debug)]
pub struct GiShader {
    stage: RwLock<Arc<GiStage>>,
    settings: GiSettings,
    /// Direct light at visible points.
    direct: Settings,
    lattice: Lattice,
    lines: Memory<LineKey, Line>,
    records: Memory<PlaceKey, Record>,
    /// Those that serve rays from afar; see [`far`].
    far_records: Memory<PlaceKey, Record>,
    made: AtomicU64,
    alone: AtomicU64,
    fan: Fan,
    /// That of far records.
    far_fan: Fan,
    /// That of points without a record, which err each by itself and are few: fewer rays.
    alone_fan: Fan,
    purse: Purse,
}

#[derive(Debug)]
struct GiStage {
    stage: Stage,
    beacons: Vec<Beacon>,
    changes: Changes,
}

/// The surfaces along a line.
#[derive(Debug)]
struct Line {
    hits: Box<[Hit]>,
    holds_until: AtomicU64,
}

impl Footprint for Line {
    fn heap_bytes(&self) -> usize {
        size_of_val(&*self.hits)
    }
}

impl GiShader {
    /// A shader for `world`. Settings out of their range are taken to its end.
    pub fn new(world: Arc<World>, settings: &GiSettings) -> Self {
        let range = |value: f64, low: f64, high: f64| if value >= low { value.min(high) } else { low };
        let settings = GiSettings {
            rays: settings.rays.map(|count| count.clamp(2, 64)),
            bounces: settings.bounces.clamp(1, 32),
            tolerance: range(settings.tolerance, 0.05, 1.0),
            spacing: range(settings.spacing, 1e-6, 1.0),
            levels: settings.levels.clamp(1, (LEVELS - NEAR_LEVEL) as u32),
            ..*settings
        };
        let direct = Settings::default();
        let diagonal = f64::from(world.bounds().diagonal()).max(f64::MIN_POSITIVE);
        let size = scene_size(&world).max(f64::MIN_POSITIVE);
        let lights = PreparedLights::new(world.lights(), &world.scene().materials, &direct);
        let beacons = world.lights().iter().map(Beacon::new).collect();
        Self {
            lattice: Lattice::new(world.bounds(), FAR_WIDTH * settings.spacing * size, settings.seed),
            lines: Memory::new(settings.memory / 4),
            records: Memory::new(settings.memory / 2),
            far_records: Memory::new(settings.memory / 4),
            stage: RwLock::new(Arc::new(GiStage {
                stage: Stage { world, lights },
                beacons,
                changes: Changes::default(),
            })),
            purse: Purse::new([
                settings.rays[0] * settings.rays[1] * NEAR_COST,
                far::RAYS[0] * far::RAYS[1] * FAR_COST,
            ]),
            settings,
            direct,
            made: AtomicU64::new(0),
            alone: AtomicU64::new(0),
            fan: Fan {
                rays: settings.rays,
                longest: 2.0 * diagonal,
                asks_far: true,
            },
            alone_fan: Fan {
                rays: settings.rays.map(|count| (count * 5).div_ceil(8).max(2)),
                longest: 2.0 * diagonal,
                asks_far: true,
            },
            far_fan: Fan {
                rays: far::RAYS,
                longest: 2.0 * diagonal,
                asks_far: false,
            },
        }
    }

    /// What has been done so far.
    pub fn counts(&self) -> GiCounts {
        let (lines, line_bytes) = self.lines.size();
        let ((near, near_bytes), (far, far_bytes)) = (self.records.size(), self.far_records.size());
        GiCounts {
            made: self.made.load(Ordering::Relaxed),
            records: (near + far) as u64,
            lines: lines as u64,
            bytes: (near_bytes + far_bytes + line_bytes) as u64,
            alone: self.alone.load(Ordering::Relaxed),
        }
    }

    /// Irradiance at a point that comes by way of other surfaces, linear RGB in lux or W/m2: what the shader adds to direct light.
    ///
    /// It depends on the point, the scene, the settings and the seed alone. `scratch` is working memory of any content.
    ///
    /// Cost: a few shadow rays, and now and then some hundred paths for a record.
    pub fn indirect_irradiance(&self, surface: &SurfacePoint, scratch: &mut ShaderScratch) -> DVec3 {
        let stage = self.current();
        let seed = surface.position.to_array().map(f64::to_bits);
        let hash = seed
            .iter()
            .fold(mix(self.settings.seed), |hash, bits| mix(hash ^ bits));
        self.purse.pay();
        self.batch(&stage).indirect(surface, hash, scratch)
    }

    fn batch<'a>(&'a self, stage: &'a GiStage) -> Batch<'a> {
        let world = &*stage.stage.world;
        Batch {
            shader: self,
            stage,
            lacking: Cell::new(false),
            paths: Paths {
                world,
                lights: &stage.stage.lights,
                beacons: &stage.beacons,
                bounces: self.settings.bounces,
            },
        }
    }

    fn current(&self) -> Arc<GiStage> {
        Arc::clone(&self.stage.read().unwrap_or_else(PoisonError::into_inner))
    }
}

/// What the work on one batch needs.
struct Batch<'a> {
    shader: &'a GiShader,
    stage: &'a GiStage,
    paths: Paths<'a>,
    /// Has anything been taken from records of before a move, or done without a record, since this was last unset?
    lacking: Cell<bool>,
}

/// What is known while records for a point are looked up.
struct Search {
    /// How far records may reach there (m).
    reach: f64,
    /// Has a record been missing that was not to be made yet?
    passed: bool,
}

/// What becomes of a record that a point or another record asks for.
enum Choice {
    /// It is taken as it is.
    Take(Arc<Record>),
    /// It is made.
    Make,
    /// One must do without it.
    Pass,
}

/// Weights of the axes whose lines a surface of this normal is looked up along; they sum to 1.
fn axis_weights(normal: DVec3) -> DVec3 {
    // One of the squares is at least a third.
    let weights = (normal * normal - 0.25).max(DVec3::ZERO);
    weights / weights.element_sum()
}

/// The side of a surface where a lattice line of an axis crosses it.
struct Side {
    /// Is it the one that looks along the axis?
    upper: bool,
    /// Along the axis or against it, out of the surface.
    outwards: DVec3,
    /// Normal of the face on this side.
    face: DVec3,
}

impl Side {
    /// The side on which a point with that normal lies.
    fn of(hit: &Hit, axis: usize, normal: DVec3) -> Self {
        let upper = normal[axis] > 0.0;
        let outwards = Lattice::direction(axis) * if upper { 1.0 } else { -1.0 };
        let face = if hit.normal.dot(outwards) < 0.0 {
            -hit.normal
        } else {
            hit.normal
        };
        Self {
            upper,
            outwards,
            face,
        }
    }
}

impl Batch<'_> {
    /// Irradiance that comes by way of other surfaces.
    fn indirect(&self, surface: &SurfacePoint, hash: u64, scratch: &mut ShaderScratch) -> DVec3 {
        let GiShader {
            settings, lattice, ..
        } = self.shader;
        let (point, normal) = (surface.position, surface.shading_normal);
        let axes = axis_weights(normal);
        let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
        // What the levels so far leave to the next.
        let mut left = 1.0;
        let mut search = Search {
            reach: f64::INFINITY,
            passed: false,
        };
        for level in NEAR_LEVEL..NEAR_LEVEL + settings.levels as usize {
            let (mut found, mut cover) = (DVec3::ZERO, 0.0);
            for axis in (0..3).filter(|&axis| axes[axis] > 0.0) {
                for (key, share) in lattice.around(axis, level, point) {
                    if share < 1e-3 {
                        continue;
                    }
                    let line = self.line(key);
                    let depth = 2.5 * lattice.spacing(level);
                    for hit in &line.hits {
                        if (hit.position[axis] - point[axis]).abs() > depth {
                            continue;
                        }
                        let Some((record, goodness)) =
                            self.record_for(surface, axis, key, hit, &mut search, scratch)
                        else {
                            continue;
                        };
                        let weight = axes[axis] * share * goodness;
                        found += record.irradiance(point, normal) * weight;
                        cover += weight;
                    }
                }
            }
            if cover > 0.0 {
                let taken = left * f64::min(1.0, 1.5 * cover);
                sum += found * (taken / cover);
                weight += taken;
                // Less by a little for all, so that nothing jumps where it comes to nothing.
                left = (left - taken - LEFT_OPEN) / (1.0 - LEFT_OPEN);
            }
            // While records are missing that are not to be made yet, finer ones would be missed as well.
            if left <= 0.0 || search.passed && weight >= ENOUGH {
                break;
            }
        }
        if weight >= ENOUGH {
            return sum / weight;
        }
        self.shader.alone.fetch_add(1, Ordering::Relaxed);
        self.gather(surface, hash, &self.shader.alone_fan, scratch, |_| {})
            .irradiance
            .as_dvec3()
    }

    fn line(&self, key: LineKey) -> Arc<Line> {
        let GiShader { lattice, lines, .. } = self.shader;
        let changes = &self.stage.changes;
        let holds = |line: &Line| {
            let until = line.holds_until.load(Ordering::Relaxed);
            let Some(news) = changes.since(until) else {
                return false;
            };
            // Lines cross objects alone.
            let mut objects = news.filter(|change| matches!(change.what, MovedThing::Object(_)));
            if objects.any(|change| {
                [change.before, change.after]
                    .iter()
                    .any(|b| lattice.crosses(key, b))
            }) {
                return false;
            }
            line.holds_until.fetch_max(changes.count(), Ordering::Relaxed);
            true
        };
        lines.get(&key, holds).unwrap_or_else(|| {
            let line = Line {
                hits: lattice.crossings(key, self.paths.world.tracer()),
                holds_until: AtomicU64::new(changes.count()),
            };
            lines.put(key, line)
        })
    }

    /// The record at a crossing, if it has anything to say at a point, and how good it is there, up to 1.
    fn record_for(
        &self,
        surface: &SurfacePoint,
        axis: usize,
        line: LineKey,
        hit: &Hit,
        search: &mut Search,
        scratch: &mut ShaderScratch,
    ) -> Option<(Arc<Record>, f64)> {
        let GiShader {
            settings, records, ..
        } = self.shader;
        let (point, normal) = (surface.position, surface.shading_normal);
        let Side {
            upper,
            outwards,
            face,
        } = Side::of(hit, axis, normal);
        let offset = point - hit.position;
        let distance = offset.length();
        if face.dot(normal) < 0.5
            || offset.dot(face + normal) < -0.1 * distance
            || distance > settings.tolerance * (search.reach + distance)
        {
            return None;
        }
        let place = PlaceKey::new(line, hit, upper);
        let world = self.paths.world;
        // Lifted off their surfaces, so that a curved one does not come between.
        let lift = 0.2 * distance;
        let (from, to) = (
            surface.origin + normal * lift,
            hit.position + face * (lift + hit.offset),
        );
        if world.tracer().occluded(from, to) {
            return None;
        }
        // Nothing above may depend on whether the record is known already.
        let at = || world.surface(hit, -outwards);
        let record = match self.choose(false, &place, at, scratch) {
            Choice::Take(record) => record,
            Choice::Make => {
                let hash = place.hash(settings.seed);
                records.put(place, self.make(&at(), hash, &self.shader.fan, scratch))
            }
            Choice::Pass => {
                search.passed = true;
                return None;
            }
        };
        search.reach = search.reach.min(record.gathered.mean_distance + distance);
        let goodness = record.goodness(point, normal, settings.tolerance);
        (goodness > 0.0).then_some((record, goodness))
    }

    /// What becomes of the record of a place that lies on the surface `at`: of those for rays from afar, or of the others.
    fn choose(
        &self,
        far: bool,
        place: &PlaceKey,
        at: impl Fn() -> SurfacePoint,
        scratch: &mut ShaderScratch,
    ) -> Choice {
        let GiShader { settings, purse, .. } = self.shader;
        let (memory, fan) = if far {
            (&self.shader.far_records, &self.shader.far_fan)
        } else {
            (&self.shader.records, &self.shader.fan)
        };
        let lights = self.paths.world.lights();
        let ends = &mut scratch.ends;
        let mut holds = |record: &Record| record.holds(fan, &self.stage.changes, lights, ends);
        if settings.renewal == Renewal::AtOnce {
            return memory.get(place, holds).map_or(Choice::Make, Choice::Take);
        }
        let known = memory.get(place, |_| true);
        let (need, known) = match known {
            Some(record) if holds(&record) && record.complete => return Choice::Take(record),
            Some(record) if holds(&record) => (Need::Incomplete, Some(record)),
            // On an object that moved it is now elsewhere.
            Some(record) if record.lies_on(&at(), fan) => (Need::Old, Some(record)),
            _ => (Need::Missing, None),
        };
        if known.is_none() && purse.at_rest() || purse.spend(far, need) {
            return Choice::Make;
        }
        self.lacking.set(true);
        known.map_or(Choice::Pass, Choice::Take)
    }

    /// Makes a record.
    fn make(&self, at: &SurfacePoint, hash: u64, fan: &Fan, scratch: &mut ShaderScratch) -> Record {
        let GiShader {
            settings, lattice, ..
        } = self.shader;
        self.shader.made.fetch_add(1, Ordering::Relaxed);
        let mut lengths = Vec::with_capacity((fan.rays[0] * fan.rays[1]) as usize);
        let before = self.lacking.replace(false);
        let mut gathered = self.gather(at, hash, fan, scratch, |length| lengths.push(fan.encode(length)));
        let lacking = self.lacking.get();
        self.lacking.set(before || lacking);
        // Where light changes fast a record reaches less far than the distances say.
        let slope = Vec3::from_array(gathered.translation.map(luminance)).length();
        let by_slope = f64::from(luminance(gathered.irradiance)) / f64::from(slope);
        let natural = gathered
            .mean_distance
            .min(if by_slope > 0.0 { by_slope } else { f64::INFINITY });
        // On the finest level records must reach each other; what a gradient says beyond the natural reach is toned down.
        let finest = lattice.spacing(NEAR_LEVEL + settings.levels as usize - 1);
        let least = 2.0 * finest / settings.tolerance;
        if natural < least {
            gathered.translation = gathered.translation.map(|slope| slope * (natural / least) as f32);
        }
        Record {
            position: at.position,
            normal: at.shading_normal,
            gathered,
            natural,
            reach: natural.clamp(least, fan.longest.max(least)),
            object: at.object,
            hash,
            lengths: lengths.into_boxed_slice(),
            holds_until: AtomicU64::new(self.stage.changes.count()),
            outdated: AtomicBool::new(false),
            complete: !lacking,
        }
    }

    /// Gathers light over the hemisphere of a point; `each` gets the length of every ray, `None` for those that are not sent
    /// because they run below the surface.
    fn gather(
        &self,
        at: &SurfacePoint,
        hash: u64,
        fan: &Fan,
        scratch: &mut ShaderScratch,
        mut each: impl FnMut(Option<f64>),
    ) -> Gathered {
        let mut random = Fan::random(hash);
        let mut paths_random = Pcg64Mcg::new(u128::from(!hash) << 64 | u128::from(hash) | 1);
        // Records may be made for a record: each takes its own.
        let mut samples = scratch.samples.pop().unwrap_or_default();
        let axes = frame(at.shading_normal);
        let gathered = gather(&axes, fan.rays, &mut random, &mut samples, |direction| {
            if !Paths::is_above(at, direction) {
                each(None);
                return Sample {
                    radiance: Vec3::ZERO,
                    distance: f32::INFINITY,
                };
            }
            let known = |surface: &SurfacePoint, random: &mut Pcg64Mcg, scratch: &mut ShaderScratch| {
                if fan.asks_far {
                    self.seen_from_afar(surface, random, scratch)
                } else {
                    None
                }
            };
            let (radiance, distance) =
                self.paths
                    .radiance(at.origin, direction, &mut paths_random, scratch, known);
            each(Some(distance));
            Sample {
                radiance: radiance.as_vec3(),
                distance: distance as f32,
            }
        });
        scratch.samples.push(samples);
        gathered
    }
}

impl Shader for GiShader {
    fn name(&self) -> &str {
        "gi"
    }

    fn shade(
        &self,
        requests: &[ShadeRequest],
        seed: u64,
        scratch: &mut ShaderScratch,
        points: &mut Vec<ShadedPoint>,
        met: &mut Encounters,
    ) -> Result<(), ShaderError> {
        let stage = self.current();
        let world = &*stage.stage.world;
        let batch = self.batch(&stage);
        let direct = DirectLight::prepared(&stage.stage.lights, world.tracer(), &self.direct);
        shade_each(world, requests, seed, points, met, |surface, hash, met| {
            let mut irradiance = DVec3::ZERO;
            let lights = direct_and_met(world, &direct, surface, hash, scratch, met, |colour, answer| {
                irradiance += colour * answer.irradiance;
            });
            self.purse.pay();
            batch.lacking.set(false);
            irradiance += batch.indirect(surface, hash, scratch);
            Shaded::diffuse(world, surface, irradiance, lights).for_now(batch.lacking.get())
        })
    }

    /// While things move each point pays for about a third of a millisecond at most, and what comes after the next move is lost.
    fn portion(&self) -> usize {
        match self.settings.renewal {
            Renewal::AtOnce => usize::MAX,
            Renewal::Gradual => 4,
        }
    }

    fn changed(&self, change: &SceneChange) {
        let mut current = self.stage.write().unwrap_or_else(PoisonError::into_inner);
        let mut changes = current.changes.clone();
        changes.extend(&change.moves);
        *current = Arc::new(GiStage {
            stage: current.stage.moved(change),
            beacons: change.world.lights().iter().map(Beacon::new).collect(),
            changes,
        });
        self.purse.moved();
        // No record outlives a light that moves.
        if self.settings.renewal == Renewal::AtOnce
            && change
                .moves
                .iter()
                .any(|moved| matches!(moved.what, MovedThing::Light(_)))
        {
            self.records.forget();
            self.far_records.forget();
        }
    }
}
