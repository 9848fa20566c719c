//! A scene that can be looked at while it changes.
//!
//! A [`World`] never changes: moving something makes a new one that shares all geometry with the old. So threads that
//! shade keep the world they began with, and whoever moves things never waits for them.

use std::error::Error;
use std::fmt;
use std::sync::{Arc, PoisonError, RwLock};

use glam::{Affine3A, DVec3, Vec3};
use llsr_scene::{AreaShape, Bounds, Light, LightId, MaterialId, ObjectId, Scene};
use llsr_tracer::{Hit, MoveError, Tracer, Warning};

use crate::{PreparedLights, Settings, SurfacePoint};

/// A scene at one moment, with the tracer that belongs to it.
#[derive(Clone, Debug)]
pub struct World {
    scene: Arc<Scene>,
    transforms: Vec<Affine3A>,
    lights: Vec<Light>,
    tracer: Tracer,
    bounds: Bounds,
    /// Of each material.
    plain_albedos: Arc<[Vec3]>,
}

impl World {
    /// Builds a tracer for `scene`, and says what it had to leave out. The objects named as movable can be moved; see
    /// [`Tracer::with_movable`].
    pub fn new(scene: Arc<Scene>, movable: &[ObjectId]) -> (Self, Vec<Warning>) {
        let (tracer, warnings) = Tracer::with_movable(&scene, movable);
        let world = Self {
            transforms: scene.objects.iter().map(|object| object.transform).collect(),
            lights: scene.lights.clone(),
            tracer,
            bounds: scene.bounds(),
            plain_albedos: scene.materials.iter().map(|m| scene.plain_albedo(m)).collect(),
            scene,
        };
        (world, warnings)
    }

    /// The scene as it was built: meshes, materials and textures hold, objects and lights may stand elsewhere by now.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The tracer for the scene as it stands.
    pub fn tracer(&self) -> &Tracer {
        &self.tracer
    }

    /// The lights as they stand.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// Maps an object's frame to the scene's recentred frame.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn transform(&self, object: ObjectId) -> &Affine3A {
        &self.transforms[object.index()]
    }

    /// The base colour of a material with the [typical colour](llsr_scene::Texture::typical) of its texture.
    ///
    /// # Panics
    /// If there is no such material.
    pub fn plain_albedo(&self, material: MaterialId) -> Vec3 {
        self.plain_albedos[material.index()]
    }

    /// A box around the geometry as it stood at first (m, recentred frame).
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// A place far outside of the scene on the ray, for samples of the background.
    pub fn background(&self, origin: DVec3, direction: DVec3) -> DVec3 {
        origin + direction * (1000.0 * f64::from(self.bounds.diagonal()).max(1.0))
    }

    /// Irradiance to stand for all light that comes by way of other surfaces: a tenth of what the lights' flux would give
    /// if it were spread evenly over the scene's box. A convention, not physics; linear RGB in lux or W/m2.
    pub fn suggested_ambient(&self) -> Vec3 {
        let all = self
            .lights
            .iter()
            .fold(self.bounds, |all, light| all.union(light_bounds(light)));
        let size = all.size();
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        let flux: Vec3 = self
            .lights
            .iter()
            .map(|light| light.color() * light.flux() as f32)
            .sum();
        let ambient = flux * (0.1 / area);
        if ambient.is_finite() { ambient } else { Vec3::ZERO }
    }

    /// The surface that a ray of unit `direction` meets.
    pub fn look(&self, origin: DVec3, direction: DVec3) -> Option<SurfacePoint> {
        let hit = self.tracer.closest(origin, direction, f64::INFINITY)?;
        Some(self.surface(&hit, direction))
    }

    /// What the world says of a hit by a ray of unit `direction`.
    ///
    /// # Panics
    /// If the hit is not one of this world.
    pub fn surface(&self, hit: &Hit, direction: DVec3) -> SurfacePoint {
        SurfacePoint::placed(&self.scene, &self.transforms[hit.object.index()], hit, direction)
    }

    /// The world after some objects and lights have been put elsewhere; this one stays as it is.
    ///
    /// Cost: a fraction of a millisecond for tens of objects, whatever their size.
    ///
    /// # Errors
    /// [`PlaceError`] for the first that cannot stand there.
    pub fn moved(&self, places: &[Place]) -> Result<SceneChange, PlaceError> {
        let mut world = self.clone();
        let mut moves = Vec::with_capacity(places.len());
        let mut transforms = Vec::new();
        for place in places {
            match *place {
                Place::Object(object, transform) => {
                    let before = self
                        .tracer
                        .movable_bounds(object)
                        .ok_or(PlaceError::Object(MoveError::NotMovable(object)))?;
                    transforms.push((object, transform));
                    world.transforms[object.index()] = transform;
                    moves.push(SceneMove {
                        what: MovedThing::Object(object),
                        before,
                        after: Bounds::EMPTY,
                    });
                }
                Place::Light(id, ref light) => {
                    let old = world
                        .lights
                        .get_mut(id.index())
                        .ok_or(PlaceError::NoSuchLight(id))?;
                    let after = light_bounds(light);
                    if !(after.min.is_finite() && after.max.is_finite() && light.flux() >= 0.0) {
                        return Err(PlaceError::BadLight(id));
                    }
                    moves.push(SceneMove {
                        what: MovedThing::Light(id),
                        before: light_bounds(old),
                        after,
                    });
                    old.clone_from(light);
                }
            }
        }
        if !transforms.is_empty() {
            world
                .tracer
                .set_transforms(&transforms)
                .map_err(PlaceError::Object)?;
        }
        for moved in &mut moves {
            if let MovedThing::Object(object) = moved.what {
                moved.after = world.tracer.movable_bounds(object).unwrap_or(Bounds::EMPTY);
            }
        }
        Ok(SceneChange {
            world: Arc::new(world),
            moves,
        })
    }
}

/// A new place for something.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// For an object: maps its frame to the scene's recentred frame.
    Object(ObjectId, Affine3A),
    /// For a light: what it is from now on.
    Light(LightId, Light),
}

/// Why something cannot be moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PlaceError {
    /// An object.
    Object(MoveError),
    /// The world has no such light.
    NoSuchLight(LightId),
    /// The light's place is not finite, or its flux not a positive number or zero.
    BadLight(LightId),
}

impl fmt::Display for PlaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Object(error) => error.fmt(f),
            Self::NoSuchLight(light) => write!(f, "there is no light {}", light.0),
            Self::BadLight(light) => write!(f, "light {}: place or flux are not usable", light.0),
        }
    }
}

impl Error for PlaceError {}

/// What was moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MovedThing {
    /// An object.
    Object(ObjectId),
    /// A light.
    Light(LightId),
}

/// One thing that was moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneMove {
    /// Which.
    pub what: MovedThing,
    /// A box around it before (m, recentred frame).
    pub before: Bounds,
    /// A box around it afterwards.
    pub after: Bounds,
}

/// What has changed, and the world that came of it.
#[derive(Clone, Debug)]
pub struct SceneChange {
    /// The world as it stands now.
    pub world: Arc<World>,
    /// What was moved.
    pub moves: Vec<SceneMove>,
}

impl SceneChange {
    /// Puts the lights that moved where they stand now.
    pub(crate) fn update_lights(&self, lights: &mut PreparedLights) {
        for moved in &self.moves {
            if let MovedThing::Light(id) = moved.what {
                lights.set(id, &self.world.lights[id.index()]);
            }
        }
    }
}

/// A box around a light (m, recentred frame).
fn light_bounds(light: &Light) -> Bounds {
    let (a, b) = light.ends();
    let around = |centers: &[DVec3], radius: f64| {
        centers.iter().fold(Bounds::EMPTY, |bounds, &center| {
            bounds
                .with((center - radius).as_vec3())
                .with((center + radius).as_vec3())
        })
    };
    match light {
        Light::Linear(light) => around(&[a, b], light.radius),
        Light::Point(_) => around(&[a], 0.0),
        Light::Area(light) => match light.shape {
            AreaShape::Rect {
                corner,
                along,
                across,
            } => around(
                &[corner, corner + along, corner + across, corner + along + across],
                0.0,
            ),
            AreaShape::Disc { center, radius, .. } => around(&[center], radius),
        },
    }
}

/// A world and its lights, ready to shade.
#[derive(Debug)]
pub(crate) struct Stage {
    pub(crate) world: Arc<World>,
    pub(crate) lights: PreparedLights,
}

impl Stage {
    pub(crate) fn moved(&self, change: &SceneChange) -> Self {
        let mut lights = self.lights.clone();
        change.update_lights(&mut lights);
        Self {
            world: Arc::clone(&change.world),
            lights,
        }
    }
}

/// The stage that batches begin with; replaced when something moves.
#[derive(Debug)]
pub(crate) struct CurrentStage(RwLock<Arc<Stage>>);

impl CurrentStage {
    pub(crate) fn new(world: Arc<World>, settings: &Settings) -> Self {
        let lights = PreparedLights::new(&world.lights, &world.scene.materials, settings);
        Self(RwLock::new(Arc::new(Stage { world, lights })))
    }

    pub(crate) fn get(&self) -> Arc<Stage> {
        Arc::clone(&self.0.read().unwrap_or_else(PoisonError::into_inner))
    }

    pub(crate) fn advance(&self, change: &SceneChange) {
        let mut stage = self.0.write().unwrap_or_else(PoisonError::into_inner);
        *stage = Arc::new(stage.moved(change));
    }
}
