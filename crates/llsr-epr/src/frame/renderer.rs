//! The renderer of interactive frames.

use std::time::Instant;

use glam::{Mat4, Vec3};
use llsr_edges::{DroppedEdge, SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView};
use llsr_epi::{
    AntialiasBand, ClassifyBand, ComplexBand, EdgeList, EdgePointImage, FillBand, InterpolateBand, Picture,
    PixelClass, RasterizeBand, ReachBand, SamplePlanes,
};
use llsr_render_cache::{
    Chooser, DepthFilter, Fate, FinishBand, Point, PointImage, PointStore, Prediction, Priorities,
    ProjectChunk, Request, ResolveBand, Surprises, View,
};
use llsr_scene::{Bounds, Camera, ObjectId, Scene, Viewport};
use llsr_shading::{Encounters, MovedThing, SceneChange, ShadeRequest, ShadedPoint};

use crate::frame::hidden::HiddenScratch;
use crate::frame::motion::{LightSpan, Shade};
use crate::frame::occluders::Occluders;
use crate::frame::patch::{PatchScratch, patch};
use crate::frame::predict::extrapolate;
use crate::frame::settings::{FrameReport, FrameSettings, StageTimes};
use crate::frame::shadows::{ShadowWork, Shadows};
use crate::frame::share::share;
use crate::frame::texture::{Shown, TextureScratch, Textures};

/// Object of points of the background.
const BACKGROUND: u32 = u32::MAX;
/// An object counts as visible until so many samples a pixel have come in without meeting it. Not a number of frames: the
/// shader may be slow, or gone.
const VISIBLE_SAMPLES: f64 = 2.5;
/// Passes that hand colours on to pixels that reach no point, two pixels each.
const FILL_PASSES: usize = 2;
/// Points of a cell of 8x8 pixels from which on the prediction asks for no more: one in five.
const ENOUGH: usize = 13;
/// New samples ahead of the one that is stored, for which the memory is asked.
const FETCHED_AHEAD: usize = 6;
/// The filter of the cache knows no edges: it takes points seen through gaps of few pixels for points that shine through, as often as they are
/// sampled. What does shine through is found by what it reaches ([`HiddenScratch::discard`]).
const NO_FILTER: DepthFilter = DepthFilter {
    reach: 0,
    tolerance: 0.0,
    fresh: 0,
};
/// Pixels to each sample that is remembered for having differed from the picture.
const SURPRISE_PIXELS: usize = 16;
/// One group of points in so many is looked at to predict.
const PREDICTION_SHARE: usize = 4;
/// Near plane of the projection; only the ratios of x, y and w are looked at.
const NEAR: f32 = 1e-3;
/// Golden ratio: multiples of it modulo 1 are spread evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Why there are no frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameError {
    /// The size does not suit an edge-and-point image.
    Size(llsr_epi::SizeError),
    /// The cache of points cannot be made.
    Cache(llsr_render_cache::Error),
}

impl std::fmt::Display for FrameError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Size(error) => error.fmt(f),
            Self::Cache(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for FrameError {}

impl From<llsr_epi::SizeError> for FrameError {
    fn from(error: llsr_epi::SizeError) -> Self {
        Self::Size(error)
    }
}

impl From<llsr_render_cache::Error> for FrameError {
    fn from(error: llsr_render_cache::Error) -> Self {
        Self::Cache(error)
    }
}

/// Makes frames from edges and from the points that a shader has found so far (BWG03 section 3).
///
/// It shades nothing and starts no threads. Each frame takes three calls: [`take`](Self::take) what the shader answered,
/// [`draw`](Self::draw), and hand the [`requests`](Self::requests) to the shader; [`LockstepRenderer`](crate::LockstepRenderer) does that
/// with a shader that answers before the next frame. Between frames objects and lights may move.
///
/// The same calls give the same picture and requests, to the bit. After the first frames nothing is allocated.
#[derive(Debug)]
pub struct FrameRenderer {
    viewport: Viewport,
    settings: FrameSettings,
    edges: SceneEdges,
    shadows: Option<Shadows>,
    occluders: Occluders,
    textures: Textures,
    /// For each object the samples taken in when one met it last, and all of them.
    seen: Vec<u64>,
    taken: u64,
    lights: Vec<LightSpan>,
    /// Did a light change since the last frame?
    relit: bool,
    store: PointStore,
    points: PointImage,
    priorities: Priorities,
    chooser: Chooser,
    prediction: Prediction,
    surprises: Surprises,
    image: EdgePointImage,
    picture: Picture,
    list: EdgeList,
    scratch: Scratch,
    /// The camera of the last frame, and where it seems to go.
    camera: Camera,
    ahead: Camera,
    requests: Vec<ShadeRequest>,
    next_id: u64,
    report: FrameReport,
    coming: Coming,
    frame: u64,
}

/// What happened since the last frame.
#[derive(Clone, Copy, Debug, Default)]
struct Coming {
    new_points: usize,
    doubtful: usize,
    /// Milliseconds of taking points in and of moving them.
    points: f64,
}

/// Working memory.
#[derive(Debug, Default)]
struct Scratch {
    visible: Vec<ObjectId>,
    edges: SceneScratch,
    found: SceneFound,
    chosen: Vec<Request>,
    ahead: Vec<Request>,
    patch: PatchScratch,
    textures: TextureScratch,
    hidden: HiddenScratch,
    /// Boxes in which something moved since the last frame.
    swept: Vec<Bounds>,
    shades: Vec<Shade>,
}

impl FrameRenderer {
    /// A renderer of `scene` for pictures of a size; no point is known yet.
    ///
    /// # Errors
    /// A size that is 0 or above [`llsr_epi::MAX_SIZE`].
    ///
    /// # Cost
    /// That of [`SceneEdges::new`], about 145 bytes a pixel, and where there are textures 12 more for each pixel and eleven for each texel.
    pub fn new(scene: &Scene, viewport: Viewport, settings: FrameSettings) -> Result<Self, FrameError> {
        let edges = SceneEdges::new(
            scene,
            &SceneEdgeOptions::with_crease_degrees(settings.crease_degrees),
        );
        let (width, height) = (viewport.width, viewport.height);
        let capacity = (viewport.pixels() as f64 * f64::from(settings.points_per_pixel.max(0.0))) as usize;
        let image = llsr_epi::Settings {
            kernel: settings.kernel,
            linear: settings.linear,
            half_lines: settings.complex,
            fallback: Vec3::ZERO,
        };
        Ok(Self {
            viewport,
            settings,
            shadows: settings.shadow_edges.then(|| {
                let least = [settings.shadow_least_share, settings.shadow_least_contrast];
                Shadows::new(scene, &edges, least)
            }),
            occluders: Occluders::new(scene),
            textures: if settings.textures {
                Textures::new(scene)
            } else {
                Textures::default()
            },
            edges,
            seen: vec![0; scene.objects.len()],
            taken: 0,
            lights: scene.lights.iter().map(LightSpan::of).collect(),
            relit: false,
            image: EdgePointImage::new(width, height, image)?,
            store: PointStore::new(capacity.clamp(1, llsr_render_cache::MAX_CAPACITY))?,
            points: PointImage::new(width, height)?,
            priorities: Priorities::new(width, height)?,
            chooser: Chooser::new(width, height)?,
            prediction: Prediction::new(width, height)?,
            surprises: Surprises::new(width, height, viewport.pixels().div_ceil(SURPRISE_PIXELS))?,
            picture: Picture::new(width, height),
            list: EdgeList::new(width, height),
            scratch: Scratch::default(),
            camera: Camera::outside(Vec3::ZERO, 1.0, viewport),
            ahead: Camera::outside(Vec3::ZERO, 1.0, viewport),
            requests: Vec::new(),
            next_id: 0,
            report: FrameReport::default(),
            coming: Coming::default(),
            frame: 0,
        })
    }

    /// Makes pictures of another size from now on. Edges and points stay; so the next picture has something to show.
    ///
    /// As many points are kept as before: [`FrameSettings::points_per_pixel`] is that of the first size.
    ///
    /// # Errors
    /// A size that is 0 or above [`llsr_epi::MAX_SIZE`]; the renderer then is as it was.
    pub fn resize(&mut self, viewport: Viewport) -> Result<(), FrameError> {
        let (width, height) = (viewport.width, viewport.height);
        let image = EdgePointImage::new(width, height, *self.image.settings())?;
        let points = PointImage::new(width, height)?;
        let priorities = Priorities::new(width, height)?;
        let chooser = Chooser::new(width, height)?;
        let prediction = Prediction::new(width, height)?;
        let surprises = Surprises::new(width, height, viewport.pixels().div_ceil(SURPRISE_PIXELS))?;
        (self.image, self.points, self.priorities) = (image, points, priorities);
        (self.chooser, self.prediction, self.surprises) = (chooser, prediction, surprises);
        self.picture = Picture::new(width, height);
        self.list = EdgeList::new(width, height);
        self.requests.clear();
        self.viewport = viewport;
        Ok(())
    }

    /// Size of the pictures.
    pub fn viewport(&self) -> Viewport {
        self.viewport
    }

    /// How frames are made.
    pub fn settings(&self) -> &FrameSettings {
        &self.settings
    }

    /// The last picture: reflected radiance, linear.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// Edges, classes, samples and reachability of the last picture.
    pub fn image(&self) -> &EdgePointImage {
        &self.image
    }

    /// The points of the last picture.
    pub fn points(&self) -> &PointImage {
        &self.points
    }

    /// All points that are kept.
    pub fn store(&self) -> &PointStore {
        &self.store
    }

    /// Edges of the meshes that are searched for view edges; those of a mesh count for each object that shows it.
    pub fn mesh_edges(&self) -> usize {
        let of = |i: usize| self.edges.mesh_of(ObjectId::from(i)).map_or(0, |mesh| mesh.len());
        (0..self.seen.len()).map(of).sum()
    }

    /// View edges of the last picture (m, recentred frame).
    pub fn view_edges(&self) -> &SceneFound {
        &self.scratch.found
    }

    /// What the last picture was made of.
    pub fn report(&self) -> &FrameReport {
        &self.report
    }

    /// Some of the shadow edges that were left out last because other lights outshine theirs, to measure what that does to the
    /// picture ([`dropped_contrast`](crate::dropped_contrast)).
    pub fn dropped_shadow_edges(&self) -> &[DroppedEdge] {
        let shadows = self.shadows.as_ref();
        shadows.map_or(&[], |shadows| &shadows.dropped().1.sample)
    }

    /// The rays that the last frame asks the shader to shade; ids are not used twice.
    pub fn requests(&self) -> &[ShadeRequest] {
        &self.requests
    }

    /// Takes in what a shader answered: points, the objects that it met and the shadows that it saw.
    pub fn take(&mut self, points: &[ShadedPoint], met: &Encounters) {
        let start = Instant::now();
        self.taken += points.len() as u64;
        for (i, point) in points.iter().enumerate() {
            if let Some(next) = points.get(i + FETCHED_AHEAD) {
                self.store.prefetch(next.position, &self.points);
            }
            // Asked for ahead, from where the camera may never be: behind a wall, say, that is seen from both sides.
            let to_eye = self.camera.position.as_vec3() - point.position;
            if self.frame > 0 && point.normal.dot(to_eye) <= 0.0 {
                continue;
            }
            self.compare(point);
            let object = point.object.map_or(BACKGROUND, |id| id.0);
            let textured = point.object.zip(point.textured).and_then(|(object, textured)| {
                let surface = self.textures.surface(object, textured.triangle)?;
                Some((textured.plain, surface))
            });
            let (colour, surface) = textured.unwrap_or((point.colour, 0));
            let new = Point {
                position: point.position,
                colour,
                surface,
                object,
                lights: point.lights,
            };
            let stored = self.store.insert(&new, &self.points, &self.settings.replacement);
            if let Some(stored) = stored {
                self.coming.new_points += 1;
                if point.provisional {
                    // Asked for again before others; it stays until it is answered.
                    self.store
                        .invalidate(stored.slot, Fate::Age(self.settings.ages.old));
                }
            }
            self.see(point.object);
        }
        for &object in &met.objects {
            self.see(Some(object));
        }
        if let Some(shadows) = &mut self.shadows {
            shadows.meet(&met.triples);
        }
        self.coming.points += milliseconds(start);
    }

    /// Follows objects and lights that moved; the shader must know of the same change.
    ///
    /// The points of an object move along. Those whose light the motion may change are asked for first and are gone after
    /// [`FrameSettings::stale_frames`] frames: the object's own, those from which it was or is in the way of a light, and
    /// for a light that moved all of them.
    pub fn changed(&mut self, change: &SceneChange) {
        let start = Instant::now();
        for moved in &change.moves {
            match moved.what {
                MovedThing::Object(object) => {
                    let transform = *change.world.transform(object);
                    let motion = transform * self.edges.transform(object).inverse();
                    self.edges.set_transform(object, transform);
                    if let Some(shadows) = &mut self.shadows {
                        shadows.move_object(object, transform);
                    }
                    self.see(Some(object));
                    self.store.move_object(object.0, &motion);
                    let fate = self.doubt();
                    self.coming.doubtful += self.store.invalidate_object(object.0, fate);
                    // Both boxes apart: under fast motion much of what lies between them was never in the shade.
                    let boxes = [moved.before, moved.after];
                    self.scratch
                        .swept
                        .extend(boxes.into_iter().filter(|bounds| !bounds.is_empty()));
                }
                MovedThing::Light(light) => {
                    let now = &change.world.lights()[light.index()];
                    self.lights[light.index()] = LightSpan::of(now);
                    if let Some(shadows) = &mut self.shadows {
                        shadows.move_light(light, now);
                    }
                    self.relit = true;
                }
            }
        }
        self.coming.points += milliseconds(start);
    }

    /// With [`FrameSettings::shadows_apart`] the shadow edges that are to be computed, if any: let them
    /// [run](ShadowWork::run) wherever there is time, while frames are drawn, and hand them back. Until then frames show the shadow
    /// edges of before, and there is no other work.
    pub fn shadow_work(&mut self) -> Option<ShadowWork> {
        self.shadow_portion(usize::MAX)
    }

    /// As [`shadow_work`](Self::shadow_work), but of the shadows that were met only those of `most` pairs of light and blocker (at
    /// least one); the others follow when this work is back.
    pub fn shadow_portion(&mut self, most: usize) -> Option<ShadowWork> {
        self.shadows.as_mut().and_then(|shadows| shadows.work(most))
    }

    /// Pairs of light and blocker whose shadows were met and are not computed yet.
    pub fn shadow_pairs_waiting(&self) -> usize {
        self.shadows.as_ref().map_or(0, Shadows::waiting)
    }

    /// Takes back what [`shadow_work`](Self::shadow_work) gave, for the next frame.
    pub fn shadow_work_done(&mut self, work: ShadowWork) {
        if let Some(shadows) = &mut self.shadows {
            shadows.finish(work);
        }
    }

    /// Forgets all points, say after a change of materials.
    pub fn forget(&mut self) {
        self.store.clear();
    }

    /// Makes the next frame: the view of `camera`, and at most `samples` requests.
    pub fn draw(&mut self, camera: &Camera, samples: usize) {
        if self.settings.threads > 1 {
            // Into the pool once, not for each pass.
            rayon::scope(|_| self.make_frame(camera, samples));
        } else {
            self.make_frame(camera, samples);
        }
    }

    fn make_frame(&mut self, camera: &Camera, samples: usize) {
        let bands = self.settings.threads.max(1);
        let mut watch = Watch::start();
        let mut ms = StageTimes::default();
        let matrix = camera.view_projection(self.viewport, NEAR);

        self.doubt_points();
        // Ages beyond this are those of points in doubt.
        let rest = u8::MAX - 1 - self.stale_frames();
        self.store.advance_to_rest(1, rest, u8::MAX - 1);
        self.reproject(&matrix);
        let (edges, occlusion) = (&self.edges, self.settings.occlusion);
        let behind = match occlusion {
            Some(_) => {
                let place = |object| edges.transform(object);
                let depths = self.occluders.update(&matrix, self.viewport, place);
                self.image.bound_depths(depths);
                self.scratch.hidden.hide_beyond(depths, &mut self.points)
            }
            None => 0,
        };
        ms.points = watch.lap() + self.coming.points;

        self.find_edges(camera);
        let (mut shadow_pairs, mut shadow_ms) = (0, 0.0);
        if let Some(shadows) = &mut self.shadows {
            shadows.tick();
            if !self.settings.shadows_apart
                && let Some(mut work) = shadows.work(usize::MAX)
            {
                work.run();
                shadows.finish(work);
            }
            (shadow_pairs, shadow_ms) = shadows.tally();
        }
        ms.edges = watch.lap();

        self.list.clear();
        self.list.extend_world(&matrix, self.scratch.found.segments());
        ms.rasterize = watch.lap();

        let (depth, region) = self.scratch.hidden.least_depths(&self.points);
        self.image.load_places(planes(&self.points, depth, region));
        ms.points += watch.lap();
        // Of the view edges only classes and reachability are wanted so far.
        self.rasterize(bands, true);
        ms.rasterize += watch.lap();
        share(self.image.reach_bands(bands), &ReachBand::run);
        ms.reach = watch.lap();
        let shone = self
            .scratch
            .hidden
            .discard(&self.image, &mut self.points, &mut self.store);
        self.image.keep_reach();

        // From here on with shadows too: a jump of depth is not theirs.
        let (depth, region) = (self.points.depth_plane(), self.points.region_plane());
        self.image.load_samples(planes(&self.points, depth, region));
        ms.points += watch.lap();
        let shadow_edges = self.shadows.as_ref().map_or(&[][..], Shadows::segments);
        let shadow_edge_count = shadow_edges.len();
        self.list.extend_world(&matrix, shadow_edges);
        self.rasterize(bands, false);
        ms.rasterize += watch.lap();
        share(self.image.reach_bands(bands), &ReachBand::run);
        ms.reach += watch.lap();

        share(
            self.image.interpolate_bands(&mut self.picture, bands),
            &InterpolateBand::run,
        );
        let mut filled = 0;
        for _ in 0..FILL_PASSES {
            share(self.image.fill_bands(&self.picture, bands), &FillBand::run);
            filled += self.image.apply(&mut self.picture);
        }
        // What shadow edges cut off takes light from the same surface first.
        for _ in 0..FILL_PASSES {
            share(self.image.fill_bands(&self.picture, bands), &|band: FillBand<
                '_,
            >| {
                band.kept().run();
            });
            filled += self.image.apply(&mut self.picture);
        }
        let (patched, holes) = patch(&mut self.image, &mut self.picture, bands, &mut self.scratch.patch);
        if !self.textures.is_empty() {
            let shown = Shown {
                points: &self.points,
                matrix: &matrix,
                viewport: self.viewport,
            };
            let place = |object| self.edges.transform(object);
            let pictures = (&mut self.image, &mut self.picture);
            self.textures
                .apply(pictures, &shown, place, bands, &mut self.scratch.textures);
        }
        ms.interpolate = watch.lap();

        if self.settings.complex {
            let textures = &self.scratch.textures;
            share(
                self.image.complex_bands(&self.picture, bands),
                &|band: ComplexBand<'_>| {
                    if self.textures.is_empty() {
                        band.run(|_, _| Vec3::ONE);
                    } else {
                        band.run(|x, y| textures.factor(x, y));
                    }
                },
            );
            self.image.apply(&mut self.picture);
        }
        ms.complex = watch.lap();

        share(
            self.image.antialias_bands(&self.picture, bands),
            &AntialiasBand::run,
        );
        self.image.apply(&mut self.picture);
        ms.antialias = watch.lap();

        self.ask(camera, samples);
        ms.requests = watch.lap();

        self.report = FrameReport {
            frame: self.frame,
            ms: StageTimes {
                total: watch.total() + self.coming.points,
                ..ms
            },
            silhouette_edges: self.scratch.found.len(),
            shadow_edges: shadow_edge_count,
            shadow_edges_dropped: self.shadows.as_ref().map_or(0, |shadows| shadows.dropped().0),
            shadow_pairs,
            shadow_ms,
            edges_in_picture: self.list.len(),
            pixels: self.image.class_counts(),
            points: self.points.counts(),
            shone: shone + behind,
            new_points: self.coming.new_points,
            doubtful: self.coming.doubtful,
            filled,
            patched,
            holes,
        };
        self.coming = Coming::default();
        self.frame += 1;
    }

    /// Multiplies a picture of the points of the last frame, made by somebody else, by the textures.
    pub(crate) fn put_textures(
        &self,
        image: &mut EdgePointImage,
        picture: &mut Picture,
        scratch: &mut TextureScratch,
    ) {
        if !self.textures.is_empty() {
            let shown = Shown {
                points: &self.points,
                matrix: &self.camera.view_projection(self.viewport, NEAR),
                viewport: self.viewport,
            };
            let place = |object| self.edges.transform(object);
            self.textures.apply((image, picture), &shown, place, 1, scratch);
        }
    }

    /// Draws the edges of the list, with half-pixel lines or without, and classifies the pixels.
    fn rasterize(&mut self, bands: usize, whole_lines: bool) {
        let occlusion = self.settings.occlusion;
        share(
            self.image.rasterize_bands(&self.list, occlusion, bands),
            &|band: RasterizeBand<'_>| {
                if whole_lines {
                    band.whole_lines().run();
                } else {
                    band.run();
                }
            },
        );
        share(self.image.classify_bands(bands), &ClassifyBand::run);
    }

    /// Compares a new sample with what the last picture showed in its place. In pixels with an edge the picture blends what lies on either
    /// side, and on textures it shows what the sample does not know; so these tell nothing.
    fn compare(&mut self, point: &ShadedPoint) {
        if self.frame > 0
            && point.textured.is_none()
            && let Some(at) = self.points.view().project(point.position)
            && self.image.class(at.x, at.y) == PixelClass::Empty
        {
            let shown = self.picture.pixel(at.x, at.y);
            self.surprises.compare(point.position, point.colour, shown);
        }
    }

    fn see(&mut self, object: Option<ObjectId>) {
        if let Some(seen) = object.and_then(|id| self.seen.get_mut(id.index())) {
            *seen = self.taken;
        }
    }

    /// What becomes of points whose colour may be wrong.
    fn doubt(&self) -> Fate {
        Fate::Expire(self.stale_frames())
    }

    fn stale_frames(&self) -> u8 {
        self.settings.stale_frames.clamp(1, 200)
    }

    /// Dates the points whose light may have changed since the last frame.
    fn doubt_points(&mut self) {
        let fate = self.doubt();
        let Scratch { swept, shades, .. } = &mut self.scratch;
        if std::mem::take(&mut self.relit) {
            self.coming.doubtful += self.store.invalidate_positions(|_| true, fate);
        } else if !swept.is_empty() {
            shades.clear();
            for span in &self.lights {
                shades.extend(swept.iter().map(|&bounds| Shade::new(span, bounds)));
            }
            let shades = &*shades;
            let affected = |p: Vec3| shades.iter().any(|shade| shade.covers(p));
            self.coming.doubtful += self.store.invalidate_positions(affected, fate);
        }
        swept.clear();
    }

    fn reproject(&mut self, matrix: &Mat4) {
        let (width, height) = (self.viewport.width, self.viewport.height);
        let Ok(view) = View::new(matrix, width, height) else {
            unreachable!("the size was checked when the image of points was made")
        };
        let bands = self.settings.threads.max(1);
        if bands == 1 {
            self.points.reproject(&self.store, &view, &NO_FILTER);
            return;
        }
        share(
            self.points.project_chunks(&self.store, &view, &NO_FILTER, bands),
            &ProjectChunk::run,
        );
        share(self.points.resolve_bands(bands), &ResolveBand::run);
        share(self.points.finish_bands(&self.store, bands), &FinishBand::run);
    }

    fn find_edges(&mut self, camera: &Camera) {
        let Scratch {
            visible,
            edges,
            found,
            ..
        } = &mut self.scratch;
        visible.clear();
        let enough = (VISIBLE_SAMPLES * self.viewport.pixels() as f64) as u64;
        let ids = (0..self.seen.len()).filter(|&i| self.taken - self.seen[i] <= enough);
        visible.extend(ids.map(ObjectId::from));
        let viewport = self.viewport;
        self.edges.find(
            SceneView::Picture { camera, viewport },
            Some(visible),
            edges,
            found,
        );
    }

    /// Chooses what to shade next.
    fn ask(&mut self, camera: &Camera, samples: usize) {
        let picture = &self.picture;
        self.priorities
            .update(&self.points, self.settings.ages, |y| picture.priorities(y));
        self.surprises.apply(
            self.points.view(),
            self.settings.calm_priority,
            &mut self.priorities,
        );
        let phase = (self.frame as f64 * GOLDEN).fract();
        let (width, height) = (self.viewport.width, self.viewport.height);
        self.requests.clear();

        let frames = self.settings.ahead_frames;
        let share = f64::from(self.settings.ahead_share.clamp(0.0, 1.0));
        let most = (samples as f64 * share) as usize;
        let moves = self.frame > 0 && extrapolate(&self.camera, camera, frames, &mut self.ahead);
        if moves
            && frames > 0
            && most > 0
            && let Ok(view) = View::new(&self.ahead.view_projection(self.viewport, NEAR), width, height)
        {
            let start = self.frame as usize;
            self.prediction
                .update(&self.store, &view, PREDICTION_SHARE, start, ENOUGH);
            self.prediction.choose(most, phase, &mut self.scratch.ahead);
            push_rays(
                &self.ahead,
                self.viewport,
                &self.scratch.ahead,
                (self.settings.seed, self.frame, &mut self.next_id),
                &mut self.requests,
            );
        }
        self.chooser.choose(
            &mut self.priorities,
            samples - self.requests.len(),
            phase,
            self.settings.latency,
            &mut self.scratch.chosen,
        );
        push_rays(
            camera,
            self.viewport,
            &self.scratch.chosen,
            (self.settings.seed, self.frame, &mut self.next_id),
            &mut self.requests,
        );
        self.camera.position = camera.position;
        self.camera.axes = camera.axes;
        self.camera.projection = camera.projection;
    }
}

/// The points as samples, with depths and regions in the layout of their planes.
pub(crate) fn planes<'a>(points: &'a PointImage, depth: &'a [f32], region: &'a [u8]) -> SamplePlanes<'a> {
    SamplePlanes {
        stride: points.stride(),
        region,
        depth,
        colour: points.colour_plane(),
        fine: points.fine_plane(),
    }
}

/// Rays through the chosen pixels, each through a place in its pixel that depends on seed, frame and pixel.
fn push_rays(
    camera: &Camera,
    viewport: Viewport,
    chosen: &[Request],
    (seed, frame, next_id): (u64, u64, &mut u64),
    out: &mut Vec<ShadeRequest>,
) {
    out.extend(chosen.iter().map(|request| {
        let [dx, dy] = place(
            seed ^ frame.wrapping_mul(0x9e37_79b9_7f4a_7c15),
            request.x,
            request.y,
        );
        let (origin, direction) = camera.ray(viewport, f64::from(request.x) + dx, f64::from(request.y) + dy);
        *next_id += 1;
        ShadeRequest {
            id: *next_id - 1,
            origin,
            direction,
        }
    }));
}

/// A place in a pixel, away from its border so that rounding does not move the point to the next one.
fn place(seed: u64, x: u32, y: u32) -> [f64; 2] {
    // The finaliser of splitmix64 (Steele, Lea, Flood 2014).
    let mut z = seed ^ (u64::from(x) << 32 | u64::from(y));
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    [z >> 32, z & 0xffff_ffff].map(|half| 0.02 + 0.96 * half as f64 / f64::from(u32::MAX))
}

/// Wall-clock times of consecutive parts.
struct Watch {
    start: Instant,
    last: Instant,
}

impl Watch {
    fn start() -> Self {
        let start = Instant::now();
        Self { start, last: start }
    }

    /// Milliseconds since the last lap.
    fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let lap = (now - self.last).as_secs_f64() * 1e3;
        self.last = now;
        lap
    }

    fn total(&self) -> f64 {
        milliseconds(self.start)
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
