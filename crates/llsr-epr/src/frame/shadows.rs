//! Shadow edges that are kept from frame to frame (BWG03 section 6.5), computed beside the display or within it.

use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread;
use std::time::Instant;

use glam::{Affine3A, DVec3, Vec3};
use llsr_edges::{ImportanceReport, SceneEdges, ShadowEdge, ShadowEdges, ShadowOptions, ShadowScene};
use llsr_scene::{Light, LightId, ObjectId, Scene, Triple};

use crate::frame::FrameRenderer;

/// Frames between two looks at what was met.
const PATIENCE: u32 = 7;
/// Pairs of light and blocker that a thread computes first, when nothing is known of their cost, and the time (ms) that it is
/// given from then on: something may move meanwhile, and its shadows follow only after that.
const FIRST_PAIRS: usize = 16;
const PORTION_MS: f64 = 100.0;
/// One pair in so many of those that wait is computed at least: each portion also looks at all edges that there are.
const LEAST_SHARE: usize = 8;

/// Middle (m) and flux of a light.
fn strength(light: &Light) -> (DVec3, f64) {
    let (a, b) = light.ends();
    (0.5 * (a + b), light.flux())
}

/// About the share that the light of an edge gives where it lies, if nothing is in the way and all come in at the same angle.
fn contrast(strengths: &[(DVec3, f64)], edge: &ShadowEdge) -> f64 {
    let [a, b] = edge.segment.map(Vec3::as_dvec3);
    let middle = 0.5 * (a + b);
    let of = |&(at, flux): &(DVec3, f64)| flux / at.distance_squared(middle).max(f64::MIN_POSITIVE);
    let own = strengths.get(edge.triple.light.index()).map_or(0.0, of);
    own / strengths.iter().map(of).sum::<f64>().max(f64::MIN_POSITIVE)
}

/// The shadow edges of all triples that shaders have met, as far as they are computed, and what waits to be.
#[derive(Debug)]
pub(crate) struct Shadows {
    /// What computes them, unless it is away at work.
    maker: Option<Box<Maker>>,
    /// All edges, to be projected in one go.
    segments: Vec<[Vec3; 2]>,
    /// What happened since work was last handed out.
    met: Vec<Triple>,
    objects: Vec<(ObjectId, Affine3A)>,
    lights: Vec<(LightId, Light)>,
    /// All triples that were handed out, sorted.
    known: Vec<Triple>,
    /// Pairs of those that are away at work.
    away: usize,
    /// Frames since triples were last handed out.
    waited: u32,
    /// Pairs computed, and milliseconds of that, since [`tally`](Self::tally) last asked.
    done: (usize, f64),
    dropped: (usize, ImportanceReport),
}

/// What computes shadow edges.
#[derive(Debug)]
struct Maker {
    scene: ShadowScene,
    edges: ShadowEdges,
    segments: Vec<[Vec3; 2]>,
    /// For each light its middle (m) and its flux.
    strengths: Vec<(DVec3, f64)>,
    least_share: f64,
    least_contrast: f64,
    /// How many edges were left out, and some of those that were last.
    left_out: usize,
    dropped: ImportanceReport,
    /// The task.
    met: Vec<Triple>,
    objects: Vec<(ObjectId, Affine3A)>,
    lights: Vec<(LightId, Light)>,
    /// Pairs of light and blocker computed, and milliseconds of that.
    pairs: usize,
    ms: f64,
}

/// Shadow edges to be computed beside the display: see [`FrameRenderer::shadow_work`].
#[derive(Debug)]
pub struct ShadowWork(Box<Maker>);

impl ShadowWork {
    /// Does it, with the threads of the current rayon pool. The result does not depend on their number.
    ///
    /// # Cost
    /// From a millisecond for one moved object to seconds where thousands of pairs of light and blocker are met at once.
    pub fn run(&mut self) {
        self.0.run();
    }
}

fn same_pair(a: &Triple, b: &Triple) -> bool {
    (a.light, a.blocker) == (b.light, b.blocker)
}

impl Shadows {
    /// No triple is known yet. The edges of meshes are those of `edges`.
    /// Edges of lights that give too little where they lie are left out; see
    /// [`FrameSettings`](crate::FrameSettings).
    pub(crate) fn new(scene: &Scene, edges: &SceneEdges, [least_share, least_contrast]: [f64; 2]) -> Self {
        let (prepared, _) =
            ShadowScene::with_edges(scene, ShadowOptions::default(), |mesh, _| edges.shared_mesh(mesh));
        let maker = Maker {
            scene: prepared,
            edges: ShadowEdges::default(),
            segments: Vec::new(),
            strengths: scene.lights.iter().map(strength).collect(),
            least_share,
            least_contrast,
            left_out: 0,
            dropped: ImportanceReport::default(),
            met: Vec::new(),
            objects: Vec::new(),
            lights: Vec::new(),
            pairs: 0,
            ms: 0.0,
        };
        Self {
            maker: Some(Box::new(maker)),
            segments: Vec::new(),
            met: Vec::new(),
            objects: Vec::new(),
            lights: Vec::new(),
            known: Vec::new(),
            away: 0,
            waited: PATIENCE,
            done: (0, 0.0),
            dropped: (0, ImportanceReport::default()),
        }
    }

    pub(crate) fn meet(&mut self, triples: &[Triple]) {
        let before = self.met.len();
        let new = |triple: &&Triple| self.known.binary_search(triple).is_err();
        self.met.extend(triples.iter().filter(new));
        // Work may stay away for long.
        if self.met.len() > before {
            self.met.sort_unstable();
            self.met.dedup();
        }
    }

    pub(crate) fn move_object(&mut self, object: ObjectId, transform: Affine3A) {
        self.objects.retain(|moved| moved.0 != object);
        self.objects.push((object, transform));
    }

    pub(crate) fn move_light(&mut self, light: LightId, to: &Light) {
        self.lights.retain(|moved| moved.0 != light);
        self.lights.push((light, to.clone()));
    }

    /// All edges (m, recentred frame), as of the last work that came back.
    pub(crate) fn segments(&self) -> &[[Vec3; 2]] {
        &self.segments
    }

    /// The edges of outshone lights that are left out, and some of those that were last.
    pub(crate) fn dropped(&self) -> (usize, &ImportanceReport) {
        (self.dropped.0, &self.dropped.1)
    }

    /// A frame has passed.
    pub(crate) fn tick(&mut self) {
        self.waited = self.waited.saturating_add(1);
    }

    /// Pairs of light and blocker that were met and whose edges are not there yet.
    pub(crate) fn waiting(&self) -> usize {
        self.away + self.met.chunk_by(same_pair).count()
    }

    /// What there is to compute: what has moved and, every few frames, what was met, the shadows of `most` pairs of light and
    /// blocker at a time. `None` if there is nothing or work is away.
    pub(crate) fn work(&mut self, most: usize) -> Option<ShadowWork> {
        // What is met comes in dribs and drabs, and each time all that a light and a blocker share is computed.
        let meets = !self.met.is_empty() && self.waited > PATIENCE;
        if !meets && self.objects.is_empty() && self.lights.is_empty() {
            return None;
        }
        let mut maker = self.maker.take()?;
        // Both sides of the exchange keep their memory.
        maker.objects.clear();
        maker.lights.clear();
        maker.met.clear();
        std::mem::swap(&mut maker.objects, &mut self.objects);
        std::mem::swap(&mut maker.lights, &mut self.lights);
        if meets {
            let pairs = self.met.chunk_by(same_pair).take(most.max(1));
            let count: usize = pairs.inspect(|_| self.away += 1).map(<[Triple]>::len).sum();
            maker.met.extend(self.met.drain(..count));
            self.known.extend_from_slice(&maker.met);
            self.known.sort_unstable();
            self.known.dedup();
            // The rest waits no longer than for this portion.
            if self.met.is_empty() {
                self.waited = 0;
            }
        }
        Some(ShadowWork(maker))
    }

    /// Takes work back.
    pub(crate) fn finish(&mut self, work: ShadowWork) {
        let mut maker = work.0;
        if maker.pairs > 0 {
            std::mem::swap(&mut self.segments, &mut maker.segments);
            self.dropped = (maker.left_out, std::mem::take(&mut maker.dropped));
        }
        self.away = 0;
        self.done.0 += maker.pairs;
        self.done.1 += maker.ms;
        self.maker = Some(maker);
    }

    /// For how many pairs of light and blocker there was something to compute since the last call, and the milliseconds that took.
    pub(crate) fn tally(&mut self) -> (usize, f64) {
        std::mem::take(&mut self.done)
    }
}

impl Maker {
    fn run(&mut self) {
        let start = Instant::now();
        self.pairs = 0;
        let (scene, strengths) = (&mut self.scene, &mut self.strengths);
        let objects: Vec<ObjectId> = self.objects.iter().map(|moved| moved.0).collect();
        let lights: Vec<LightId> = self.lights.iter().map(|moved| moved.0).collect();
        let mut moved = false;
        for &(object, transform) in &self.objects {
            moved |= scene.move_object(object, transform);
        }
        for (light, to) in &self.lights {
            if scene.move_light(*light, to) {
                strengths[light.index()] = strength(to);
                moved = true;
            }
        }
        if moved {
            self.pairs += self.edges.moved(&self.scene, &lights, &objects).pairs;
        }
        if !self.met.is_empty() {
            self.pairs += self.edges.add(&self.scene, self.met.iter().copied()).pairs;
        }
        if self.pairs > 0 {
            if self.least_share > 0.0 && self.strengths.len() > 1 {
                let strengths = &self.strengths;
                let irradiance = |light: LightId, point: DVec3, normal: DVec3| {
                    let (middle, flux) = strengths[light.index()];
                    let to = middle - point;
                    let square = to.length_squared().max(f64::MIN_POSITIVE);
                    flux * normal.dot(to).max(0.0) / (square * square.sqrt())
                };
                // Frames know nothing of visibility: strong lights are taken as seen.
                self.dropped =
                    self.edges
                        .drop_unimportant(&self.scene, self.least_share, irradiance, irradiance);
            }
            let (strengths, least) = (&self.strengths, self.least_contrast);
            // One light outshines no other.
            let judged = least > 0.0 && strengths.len() > 1;
            let mut left_out = 0;
            self.segments.clear();
            self.segments.reserve(self.edges.len());
            for edge in self.edges.iter() {
                let stays = !judged || contrast(strengths, edge) >= least;
                if !stays {
                    left_out += 1;
                } else if self.segments.last() != Some(&edge.segment) {
                    // Where umbra and penumbra end together there are two edges, and one line to draw.
                    self.segments.push(edge.segment);
                }
            }
            self.left_out = self.edges.dropped() + left_out;
        }
        self.ms = start.elapsed().as_secs_f64() * 1e3;
    }
}

/// A thread that computes the shadow edges of a [`FrameRenderer`] while it draws.
///
/// Shadows that were met are computed in portions of about a tenth of a second, so that those of something that is moved do
/// not wait for all of them. It takes two cores less than the current rayon pool has threads, at least one: display and shader need
/// theirs. The thread ends with the work that it is doing when this is dropped; nobody waits for it.
#[derive(Debug)]
pub struct ShadowThread {
    to: Sender<ShadowWork>,
    from: Receiver<ShadowWork>,
    /// Cost of a pair of light and blocker (ms); 0 as long as none is known.
    cost: f64,
}

impl ShadowThread {
    /// Starts the thread. The renderer should have [`FrameSettings::shadows_apart`](crate::FrameSettings::shadows_apart).
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn start() -> std::io::Result<Self> {
        let threads = rayon::current_num_threads().saturating_sub(2).max(1);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|number| format!("llsr-shadows-{number}"))
            .build()
            .map_err(std::io::Error::other)?;
        let (to, tasks) = channel::<ShadowWork>();
        let (done, from) = channel();
        thread::Builder::new()
            .name("llsr-shadows".to_owned())
            .spawn(move || {
                for mut work in tasks {
                    pool.install(|| work.run());
                    if done.send(work).is_err() {
                        break;
                    }
                }
            })?;
        Ok(Self { to, from, cost: 0.0 })
    }

    /// To be called once a frame: hands over what is done and what is to be done. Returns at once.
    ///
    /// Should the thread panic, edges stay as they are.
    pub fn tend(&mut self, renderer: &mut FrameRenderer) {
        match self.from.try_recv() {
            Ok(work) => {
                let (pairs, ms) = (work.0.pairs, work.0.ms);
                if pairs > 0 {
                    let cost = ms / pairs as f64;
                    self.cost = if self.cost > 0.0 {
                        0.5 * (self.cost + cost)
                    } else {
                        cost
                    };
                }
                renderer.shadow_work_done(work);
            }
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => {}
        }
        let most = if self.cost > 0.0 {
            let share = renderer.shadow_pairs_waiting() / LEAST_SHARE;
            share.max((PORTION_MS / self.cost) as usize)
        } else {
            FIRST_PAIRS
        };
        if let Some(work) = renderer.shadow_portion(most)
            && let Err(back) = self.to.send(work)
        {
            renderer.shadow_work_done(back.0);
        }
    }
}
