//! The edges of a whole scene, as a viewer sees them.

mod found;
mod outline;
mod warning;

use std::sync::Arc;

use glam::{Affine3A, DAffine3, DMat3, DVec3};
use llsr_intervals::{QueryStatistics, Viewpoint};
use llsr_scene::{Bounds, Camera, Geometry, Mesh, MeshId, ObjectId, Projection, Scene, Viewport};

use crate::{EdgeOptions, EdgeScratch, FoundEdges, MeshEdges};

pub use found::{EdgeClass, EdgeRun, SceneFound, ViewedEdge};
pub use outline::{Eye, onto_surface, outline, outline_chords};
pub use warning::EdgeWarning;

/// How the edges of a scene are prepared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneEdgeOptions {
    /// For all meshes; its crease angle is that of primitives too.
    pub edges: EdgeOptions,
    /// Meshes with a crease angle of their own (degrees, 0 to 180); of several for one mesh the last counts.
    pub crease_degrees_of: Vec<(MeshId, f64)>,
}

impl SceneEdgeOptions {
    /// The defaults, with one crease angle (degrees, 0 to 180) for everything.
    pub fn with_crease_degrees(crease_degrees: f64) -> Self {
        Self {
            edges: EdgeOptions {
                crease_degrees,
                ..EdgeOptions::default()
            },
            ..Self::default()
        }
    }

    fn of_mesh(&self, mesh: usize) -> EdgeOptions {
        let own = self
            .crease_degrees_of
            .iter()
            .rev()
            .find(|(id, _)| id.index() == mesh);
        EdgeOptions {
            crease_degrees: own.map_or(self.edges.crease_degrees, |&(_, degrees)| degrees),
            ..self.edges
        }
    }
}

/// What a scene is looked at through.
#[derive(Clone, Copy, Debug)]
pub enum SceneView<'a> {
    /// A picture: chords of curved outlines leave them by at most 1/20 of a pixel.
    Picture {
        /// The camera, in the scene's recentred frame.
        camera: &'a Camera,
        /// Size of the picture.
        viewport: Viewport,
    },
    /// A place or direction without a picture, say a light's end.
    Eye {
        /// Where the edges are seen from.
        eye: Eye,
        /// Chords that stand for a full circle of a curved outline, at least 3.
        chords: u32,
    },
}

impl SceneView<'_> {
    /// Where the scene is seen from.
    pub fn eye(&self) -> Eye {
        match *self {
            Self::Picture { camera, .. } => Eye::of(camera),
            Self::Eye { eye, .. } => eye,
        }
    }
}

/// Working memory of [`SceneEdges::find`].
#[derive(Clone, Debug, Default)]
pub struct SceneScratch {
    mesh: EdgeScratch,
    found: FoundEdges,
}

/// The edges of all objects of a scene, prepared once and asked as often as the viewer or the objects move.
///
/// Meshes are prepared in their own frame and shared by the objects that show them, so that moving an object rebuilds
/// nothing: the viewer is brought into the object's frame instead.
///
/// ```
/// use glam::{Affine3A, DVec3, Vec3};
/// use llsr_edges::{EdgeClass, Eye, SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView};
/// use llsr_scene::{MaterialId, Mesh, Scene};
///
/// let mut scene = Scene::new("a cube");
/// let cube = scene.add_mesh(Mesh::cuboid("cube", Vec3::ZERO, Vec3::ONE, MaterialId(0)));
/// let mut edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
/// let (mut scratch, mut found) = (SceneScratch::default(), SceneFound::default());
/// let view = SceneView::Eye { eye: Eye::At(DVec3::splat(3.0)), chords: 64 };
/// edges.find(view, None, &mut scratch, &mut found);
/// assert_eq!(found.count(EdgeClass::Silhouette), 6, "a hexagon");
/// assert_eq!(found.count(EdgeClass::Crease), 3, "three edges meet at the near corner");
///
/// edges.set_transform(cube, Affine3A::from_translation(Vec3::new(2.0, 2.0, 0.0)));
/// edges.find(view, None, &mut scratch, &mut found);
/// assert_eq!(found.count(EdgeClass::Silhouette), 4, "now only one face is seen");
/// ```
#[derive(Clone, Debug)]
pub struct SceneEdges {
    /// For each mesh of the scene its edges, if an object shows it and it is valid.
    meshes: Vec<Option<Arc<MeshEdges>>>,
    objects: Vec<Placed>,
    /// Crease angle of primitives (degrees).
    crease_degrees: f64,
    warnings: Vec<EdgeWarning>,
}

/// An object of the scene.
#[derive(Clone, Copy, Debug)]
struct Placed {
    geometry: Geometry,
    transform: Affine3A,
    to_world: DAffine3,
    /// None if the transform has no finite inverse.
    to_object: Option<DAffine3>,
}

impl Placed {
    fn new(geometry: Geometry, transform: Affine3A) -> Self {
        let to_world = double(&transform);
        let inverse = to_world.inverse();
        Self {
            geometry,
            transform,
            to_world,
            to_object: (to_world.is_finite() && inverse.is_finite()).then_some(inverse),
        }
    }
}

impl SceneEdges {
    /// Prepares the edges of all meshes that an object of `scene` shows.
    ///
    /// What cannot be prepared has no edges, and is named by [`warnings`](Self::warnings). Cost: that of
    /// [`MeshEdges::new`] for each mesh; the `rayon` feature uses all threads, with the same result.
    pub fn new(scene: &Scene, options: &SceneEdgeOptions) -> Self {
        let mut used = vec![false; scene.meshes.len()];
        let mut warnings = Vec::new();
        let mut objects = Vec::with_capacity(scene.objects.len());
        for object in &scene.objects {
            let placed = Placed::new(object.geometry, object.transform);
            let name = || object.name.clone();
            match object.geometry {
                Geometry::Mesh(mesh) => match used.get_mut(mesh.index()) {
                    Some(used) => *used = true,
                    None => warnings.push(EdgeWarning::MissingMesh { object: name() }),
                },
                Geometry::Primitive(primitive) if !primitive.shape.is_valid() => {
                    warnings.push(EdgeWarning::BadPrimitive { object: name() });
                }
                Geometry::Primitive(_) => {}
            }
            if placed.to_object.is_none() {
                warnings.push(EdgeWarning::BadTransform { object: name() });
            }
            objects.push(placed);
        }
        let prepare = |index: usize, mesh: &Mesh| {
            used[index]
                .then(|| MeshEdges::new(mesh, options.of_mesh(index)).ok().map(Arc::new))
                .flatten()
        };
        let meshes = prepare_all(&scene.meshes, prepare);
        for (index, (mesh, edges)) in scene.meshes.iter().zip(&meshes).enumerate() {
            let mesh = mesh.name.clone();
            match edges {
                Some(edges) => warnings.extend(EdgeWarning::of_report(mesh, edges.report())),
                None if used[index] => warnings.push(EdgeWarning::InvalidMesh { mesh }),
                None => {}
            }
        }
        Self {
            meshes,
            objects,
            crease_degrees: options.edges.crease_degrees,
            warnings,
        }
    }

    /// What was repaired or has no edges.
    pub fn warnings(&self) -> &[EdgeWarning] {
        &self.warnings
    }

    /// Number of objects.
    pub fn objects(&self) -> usize {
        self.objects.len()
    }

    /// The edges of a mesh, if an object shows it and it is valid.
    pub fn mesh(&self, mesh: MeshId) -> Option<&MeshEdges> {
        self.meshes.get(mesh.index())?.as_deref()
    }

    /// The same to be kept and shared, say with a [`ShadowScene`](crate::ShadowScene).
    pub fn shared_mesh(&self, mesh: MeshId) -> Option<Arc<MeshEdges>> {
        self.meshes.get(mesh.index())?.clone()
    }

    /// The edges of an object's mesh, in its own frame; `None` for a primitive and for a mesh without edges.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn mesh_of(&self, object: ObjectId) -> Option<&MeshEdges> {
        match self.objects[object.index()].geometry {
            Geometry::Mesh(mesh) => self.mesh(mesh),
            Geometry::Primitive(_) => None,
        }
    }

    /// Maps the object's frame to the scene's recentred frame.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn transform(&self, object: ObjectId) -> Affine3A {
        self.objects[object.index()].transform
    }

    /// Maps the scene's recentred frame to the object's frame; `None` if the transform has no finite inverse.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn to_object(&self, object: ObjectId) -> Option<DAffine3> {
        self.objects[object.index()].to_object
    }

    /// Moves an object. Nothing is rebuilt. An object whose transform has no finite inverse has no edges.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn set_transform(&mut self, object: ObjectId, transform: Affine3A) {
        let placed = &mut self.objects[object.index()];
        *placed = Placed::new(placed.geometry, transform);
    }

    /// The viewer in an object's frame; `None` if it cannot look at the object from there, because a number is not
    /// finite or a direction is zero.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn viewpoint(&self, object: ObjectId, eye: Eye) -> Option<Viewpoint> {
        local_viewpoint(&self.objects[object.index()].to_object?, eye)
    }

    /// Writes to `found` the silhouettes, creases and boundaries that the viewer may see, in the scene's recentred frame,
    /// object by object; those hidden behind something are among them. Objects wholly outside a picture have none.
    ///
    /// Only the objects of `visible` are looked at, in its order, or all of them. Allocates nothing once `scratch` and
    /// `found` have grown to the largest view.
    ///
    /// # Panics
    /// If `visible` names an object that does not exist.
    pub fn find(
        &self,
        view: SceneView<'_>,
        visible: Option<&[ObjectId]>,
        scratch: &mut SceneScratch,
        found: &mut SceneFound,
    ) -> QueryStatistics {
        found.clear();
        let mut statistics = QueryStatistics::default();
        let mut add = |object: ObjectId| {
            if self.is_outside(&view, object) {
                return;
            }
            let did = self.find_object(view, object, scratch, found);
            statistics.nodes += did.nodes;
            statistics.blocks += did.blocks;
            statistics.taken_whole += did.taken_whole;
            statistics.exact += did.exact;
        };
        match visible {
            Some(visible) => visible.iter().copied().for_each(&mut add),
            None => (0..self.objects.len()).map(ObjectId::from).for_each(&mut add),
        }
        statistics
    }

    /// True if an object lies wholly beyond one side of the view's picture or behind its camera.
    fn is_outside(&self, view: &SceneView<'_>, object: ObjectId) -> bool {
        let placed = &self.objects[object.index()];
        let bounds = match placed.geometry {
            Geometry::Mesh(mesh) => self.mesh(mesh).map_or(Bounds::EMPTY, MeshEdges::bounds),
            Geometry::Primitive(primitive) => primitive.shape.bounds(),
        };
        is_outside(view, &corners(bounds, &placed.to_world))
    }

    /// Appends the edges of one object to `found`, wherever it stands.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn find_object(
        &self,
        view: SceneView<'_>,
        object: ObjectId,
        scratch: &mut SceneScratch,
        found: &mut SceneFound,
    ) -> QueryStatistics {
        let nothing = QueryStatistics::default();
        let placed = &self.objects[object.index()];
        let Some(to_object) = &placed.to_object else {
            return nothing;
        };
        match placed.geometry {
            Geometry::Mesh(mesh) => {
                let Some(edges) = self.mesh(mesh) else {
                    return nothing;
                };
                let Some(viewer) = local_viewpoint(to_object, view.eye()) else {
                    return nothing;
                };
                let statistics = edges.find(&viewer, &mut scratch.mesh, &mut scratch.found);
                let transform = &placed.transform;
                let FoundEdges {
                    silhouettes, creases, ..
                } = &scratch.found;
                let run = |class| (object, class, edges, transform);
                append(found, run(EdgeClass::Silhouette), silhouettes.iter().copied());
                append(found, run(EdgeClass::Crease), creases.iter().copied());
                append(found, run(EdgeClass::Boundary), edges.boundaries());
                statistics
            }
            Geometry::Primitive(primitive) => {
                let chords = match view {
                    SceneView::Picture { camera, viewport } => {
                        let corners = corners(primitive.shape.bounds(), &placed.to_world);
                        outline_chords(radius_pixels(camera, viewport, &corners))
                    }
                    SceneView::Eye { chords, .. } => chords.max(3),
                };
                for class in EdgeClass::ALL {
                    found.begin(object, class);
                    outline(
                        &primitive.shape,
                        &placed.transform,
                        view.eye(),
                        chords,
                        self.crease_degrees,
                        |piece, curve, segment| {
                            if piece == class {
                                found.push(curve, segment);
                            }
                        },
                    );
                    found.end();
                }
                nothing
            }
        }
    }
}

/// Appends edges of one object and class.
fn append(
    found: &mut SceneFound,
    (object, class, edges, transform): (ObjectId, EdgeClass, &MeshEdges, &Affine3A),
    list: impl Iterator<Item = u32> + Clone,
) {
    found.begin(object, class);
    let place = |edge| {
        let [a, b] = edges.segment(edge);
        [transform.transform_point3(a), transform.transform_point3(b)]
    };
    found.extend(list.clone(), list.map(place));
    found.end();
}

fn prepare_all(
    meshes: &[Mesh],
    prepare: impl Fn(usize, &Mesh) -> Option<Arc<MeshEdges>> + Sync,
) -> Vec<Option<Arc<MeshEdges>>> {
    let prepare = |(index, mesh): (usize, &Mesh)| prepare(index, mesh);
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        meshes.par_iter().enumerate().map(prepare).collect()
    }
    #[cfg(not(feature = "rayon"))]
    meshes.iter().enumerate().map(prepare).collect()
}

/// The same map in double precision.
pub(crate) fn double(transform: &Affine3A) -> DAffine3 {
    DAffine3::from_mat3_translation(
        DMat3::from_cols(
            transform.matrix3.x_axis.as_dvec3(),
            transform.matrix3.y_axis.as_dvec3(),
            transform.matrix3.z_axis.as_dvec3(),
        ),
        transform.translation.as_dvec3(),
    )
}

fn local_viewpoint(to_object: &DAffine3, eye: Eye) -> Option<Viewpoint> {
    match eye {
        Eye::At(position) => Viewpoint::at(to_object.transform_point3(position)),
        Eye::Towards(direction) => Viewpoint::towards(to_object.transform_vector3(direction)),
    }
}

fn corners(bounds: Bounds, to_world: &DAffine3) -> [DVec3; 8] {
    bounds.corners().map(|p| to_world.transform_point3(p.as_dvec3()))
}

/// True if a box with these corners lies wholly beyond one side of the picture or behind a perspective camera.
fn is_outside(view: &SceneView<'_>, corners: &[DVec3; 8]) -> bool {
    let &SceneView::Picture { camera, viewport } = view else {
        return false;
    };
    let (half_x, half_y) = camera.half_extent(viewport);
    // Rounding must not drop an edge that touches the border.
    let slack = 1.0 + 1e-6;
    let mut beyond = [true; 5];
    for &corner in corners {
        let p = camera.axes.transpose() * (corner - camera.position);
        let (depth, width) = match camera.projection {
            Projection::Perspective(_) => (-p.z, -p.z),
            Projection::Orthographic { .. } => (1.0, 1.0),
        };
        let (x, y) = (half_x * width * slack, half_y * width * slack);
        for (beyond, now) in beyond
            .iter_mut()
            .zip([p.x > x, p.x < -x, p.y > y, p.y < -y, depth <= 0.0])
        {
            *beyond &= now;
        }
    }
    beyond.contains(&true)
}

/// Upper bound of the radius in pixels of what lies between `corners`, as far as it can matter.
fn radius_pixels(camera: &Camera, viewport: Viewport, corners: &[DVec3; 8]) -> f64 {
    let largest = 4.0 * f64::from(viewport.width.max(viewport.height));
    let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
    for &corner in corners {
        let Some((x, y, _)) = camera.project(viewport, corner) else {
            return largest;
        };
        low = (low.0.min(x), low.1.min(y));
        high = (high.0.max(x), high.1.max(y));
    }
    (high.0 - low.0).hypot(high.1 - low.1).min(largest)
}
