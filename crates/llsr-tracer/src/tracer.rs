//! The tracer: what is built from a scene, and its ray queries.

use std::fmt;
use std::sync::Arc;

use glam::{Affine3A, DVec3, Vec3};
use llsr_scene::{Bounds, Geometry as Source, Mesh, ObjectId, Scene, Shape, Weld};

use crate::block::TriangleId;
use crate::build::{ChildRef, WideTree};
use crate::hit::{Hit, Surface};
use crate::lanes::{Instructions, Kernel, Level, Simd};
use crate::motion::{Movable, is_invertible};
use crate::part::{Geometry, Placement};
use crate::ray::RayFilter;
use crate::shape::PlacedShape;
use crate::traverse::{Closest, closest, segment_is_cut};
use crate::unchecked::Stack;

/// Larger coordinates (m) are left out: their products would leave the range of single precision.
pub const LARGEST_COORDINATE: f32 = 1e12;

/// A mesh of at least this many triangles is kept once, however many objects show it.
const INSTANCE_TRIANGLES: usize = 4096;

/// What a tracer left out of a scene.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// Triangles with a corner that does not exist, is not finite or is beyond [`LARGEST_COORDINATE`].
    BadTriangles {
        /// Name of the object.
        object: String,
        /// How many.
        count: usize,
    },
    /// Triangles with two equal corners; they cover nothing.
    DegenerateTriangles {
        /// Name of the object.
        object: String,
        /// How many.
        count: usize,
    },
    /// A primitive without extent, or with numbers that are not finite or out of range.
    BadPrimitive {
        /// Name of the object.
        object: String,
    },
    /// An object whose mesh does not exist.
    MissingMesh {
        /// Name of the object.
        object: String,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadTriangles { object, count } => {
                write!(
                    f,
                    "object '{object}': {count} triangles with unusable corners left out"
                )
            }
            Self::DegenerateTriangles { object, count } => {
                write!(
                    f,
                    "object '{object}': {count} triangles with equal corners left out"
                )
            }
            Self::BadPrimitive { object } => {
                write!(f, "object '{object}': primitive without usable extent left out")
            }
            Self::MissingMesh { object } => write!(f, "object '{object}': its mesh does not exist"),
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) geometry: Arc<Geometry>,
    pub(crate) placement: Option<Placement>,
}

/// Answers visibility queries about a scene.
///
/// Meshes are put into the scene's frame by [`Affine3A::transform_point3`](glam::Affine3A::transform_point3) in single
/// precision; the resulting vertices are the truth that all answers refer to. Large meshes that several objects
/// share stay in their own frame.
#[derive(Clone, Debug)]
pub struct Tracer {
    pub(crate) parts: Vec<Part>,
    /// A tree whose items are parts.
    pub(crate) top: WideTree,
    /// The objects that may be moved.
    pub(crate) movable: Vec<Movable>,
    level: Level,
}

impl Tracer {
    /// Builds the trees for `scene`, and says what had to be left out.
    ///
    /// Cost: about a microsecond a triangle.
    pub fn new(scene: &Scene) -> (Self, Vec<Warning>) {
        Self::with_movable(scene, &[])
    }

    /// The same, with some objects kept apart so that [`set_transform`](Self::set_transform) can move them. Numbers that
    /// name no object are ignored.
    ///
    /// A mesh that may move stays in its own frame, as one that several objects share does. Each such object costs every
    /// query that comes near it a few dozen nanoseconds.
    pub fn with_movable(scene: &Scene, movable: &[ObjectId]) -> (Self, Vec<Warning>) {
        let mut gather = Gather {
            scene,
            movable,
            warnings: Vec::new(),
            soup: Soup::default(),
            shapes: Vec::new(),
            instances: vec![Vec::new(); scene.meshes.len()],
            moving_shapes: Vec::new(),
        };
        gather.run();
        let mut parts = Vec::new();
        let mut movable_parts = Vec::new();
        if !gather.soup.ids.is_empty() || !gather.shapes.is_empty() {
            parts.push(Part {
                geometry: Arc::new(gather.soup.build(gather.shapes)),
                placement: None,
            });
        }
        for (mesh, objects) in gather.instances.iter().enumerate() {
            let Some(&first) = objects.first() else { continue };
            let mut soup = Soup::default();
            let name = &scene.objects[first.index()].name;
            soup.add(&scene.meshes[mesh], |p| p, first, name, &mut gather.warnings);
            let geometry = Arc::new(soup.build(Vec::new()));
            if geometry.tree.bounds.is_empty() {
                continue;
            }
            for &object in objects {
                if movable.contains(&object) {
                    movable_parts.push(Movable {
                        object,
                        part: parts.len(),
                        shape: None,
                    });
                }
                parts.push(Part {
                    geometry: Arc::clone(&geometry),
                    placement: Some(Placement::new(&scene.objects[object.index()].transform, object)),
                });
            }
        }
        for (object, shape, placed) in gather.moving_shapes {
            movable_parts.push(Movable {
                object,
                part: parts.len(),
                shape: Some(shape),
            });
            parts.push(Part {
                geometry: Arc::new(Soup::default().build(vec![placed])),
                placement: None,
            });
        }
        let mut tracer = Self {
            parts,
            top: WideTree::default(),
            movable: movable_parts,
            level: Level::new(Instructions::detect()),
        };
        tracer.rebuild_top();
        (tracer, gather.warnings)
    }

    /// Builds the tree of parts anew.
    pub(crate) fn rebuild_top(&mut self) {
        let boxes: Vec<Bounds> = self.parts.iter().map(Part::bounds).collect();
        self.top = WideTree::build(&boxes, &[], |_| {});
    }

    /// Uses at most the given instructions from now on. Answers stay the same.
    pub fn restrict(&mut self, instructions: Instructions) {
        self.level = Level::new(instructions.min(Instructions::detect()));
    }

    /// The instructions in use.
    pub fn instructions(&self) -> Instructions {
        self.level.instructions()
    }

    /// Does any surface cut the open segment from `from` to `to` (m, recentred frame)?
    ///
    /// Exact for triangles: the answer is that of exact arithmetic on the given coordinates and the meshes' vertices. A
    /// surface that merely touches an end does not count. Start from [`Hit::leave`]. If an end is not
    /// finite the answer is no.
    pub fn occluded(&self, from: DVec3, to: DVec3) -> bool {
        if let [
            Part {
                geometry,
                placement: None,
            },
        ] = self.parts.as_slice()
        {
            return self.level.run(Occluded { geometry, from, to });
        }
        let mut cut = false;
        self.level.run(PartsOnRay {
            tracer: self,
            origin: from,
            direction: to - from,
            t_max: 1.0,
            visit: &mut |part| {
                let (from, to) = match &part.placement {
                    None => (from, to),
                    Some(placement) => (placement.localize(from), placement.localize(to)),
                };
                let geometry = &part.geometry;
                cut = self.level.run(Occluded { geometry, from, to });
                cut
            },
        });
        cut
    }

    /// The first surface on the ray `origin + t direction` with 0 < t <= `t_max`.
    ///
    /// `direction` has unit length if `t` is to be in metres. Of equally near surfaces the one of the smaller object and
    /// triangle is returned. No ray slips between triangles that share an edge. If anything is not finite
    /// (`t_max` may be infinite) nothing is hit.
    pub fn closest(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<Hit> {
        let closest = |geometry: &Geometry, origin, direction, t_max| {
            self.level.run(ClosestHit {
                geometry,
                origin,
                direction,
                t_max,
            })
        };
        if let [part @ Part { placement: None, .. }] = self.parts.as_slice() {
            return closest(&part.geometry, origin, direction, t_max).map(|hit| part.hit(&hit));
        }
        let mut best: Option<Hit> = None;
        self.level.run(PartsOnRay {
            tracer: self,
            origin,
            direction,
            t_max,
            visit: &mut |part| {
                let t_best = best.map_or(t_max, |hit| hit.t);
                let (o, d) = match &part.placement {
                    None => (origin, direction),
                    Some(placement) => (
                        placement.localize(origin),
                        placement.to_local.transform_vector3(direction),
                    ),
                };
                if let Some(hit) = closest(&part.geometry, o, d, t_best) {
                    let hit = part.hit(&hit);
                    if best.is_none_or(|best| hit.t < best.t || hit.object < best.object) {
                        best = Some(hit);
                    }
                }
                false
            },
        });
        best
    }
}

/// Visits the parts that a ray may meet, in no order, until `visit` says stop.
struct PartsOnRay<'a> {
    tracer: &'a Tracer,
    origin: DVec3,
    direction: DVec3,
    t_max: f64,
    visit: &'a mut dyn FnMut(&Part) -> bool,
}

impl Kernel for PartsOnRay<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let top = &self.tracer.top;
        if top.bounds.is_empty() {
            return;
        }
        let reach = top.bounds.min.abs().max(top.bounds.max.abs()).max_element();
        let Some((ray, scale)) = RayFilter::new(s, self.origin, self.direction, self.t_max as f32, reach)
        else {
            return;
        };
        let t_box = self.t_max as f32 * scale * (1.0 + 4.0 * f32::EPSILON);
        let mut stack = Stack::new();
        let mut next = Some(ChildRef::default());
        while let Some(at) = next {
            if at.is_node() {
                let node = &top.nodes[at.index()];
                let (mask, _) = ray.enters(s, node, t_box);
                stack.push_each(s, node, mask);
            } else if (self.visit)(&self.tracer.parts[at.index()]) {
                return;
            }
            next = stack.pop();
        }
    }
}

/// Does anything of one part cut the open segment?
struct Occluded<'a> {
    geometry: &'a Geometry,
    from: DVec3,
    to: DVec3,
}

impl Kernel for Occluded<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        segment_is_cut(s, self.geometry, self.from, self.to)
    }
}

/// The first hit of one part, in its own frame.
struct ClosestHit<'a> {
    geometry: &'a Geometry,
    origin: DVec3,
    direction: DVec3,
    t_max: f64,
}

impl Kernel for ClosestHit<'_> {
    type Output = Option<Closest>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Option<Closest> {
        closest(s, self.geometry, self.origin, self.direction, self.t_max)
    }
}

impl Part {
    pub(crate) fn bounds(&self) -> Bounds {
        let bounds = self.geometry.tree.bounds;
        let Some(placement) = &self.placement else {
            return bounds;
        };
        let corners = bounds
            .corners()
            .map(|p| placement.to_world.transform_point3(p.as_dvec3()));
        let around = Bounds::of(corners.map(|p| p.as_vec3()));
        let slack = around.min.abs().max(around.max.abs()) * (4.0 * f32::EPSILON);
        Bounds {
            min: around.min - slack,
            max: around.max + slack,
        }
    }

    /// Completes a hit of a part in the scene's frame. `face` is what was worked out for the hit before.
    fn hit_on_face(&self, closest: &Closest, face: &mut Option<Face>) -> Hit {
        let Closest::Triangle {
            t,
            id,
            block,
            lane,
            barycentrics,
        } = *closest
        else {
            return self.hit(closest);
        };
        let face = match face {
            Some(face) if face.place == (block, lane) => face,
            _ => {
                let hit = self.hit(closest);
                let corners = self.geometry.blocks[block].triangle(lane);
                face.insert(Face {
                    place: (block, lane),
                    corners: corners.map(|v| v.as_dvec3()),
                    normal: hit.normal,
                    offset: hit.offset,
                })
            }
        };
        let ([a, b, c], [v, w]) = (face.corners, barycentrics);
        Hit {
            t,
            position: a * (1.0 - v - w) + b * v + c * w,
            normal: face.normal,
            object: ObjectId(id.object),
            surface: Surface::Triangle {
                index: id.triangle,
                barycentrics,
            },
            offset: face.offset,
        }
    }

    /// Completes a hit, in the scene's frame.
    fn hit(&self, closest: &Closest) -> Hit {
        let t = closest.t();
        match *closest {
            Closest::Triangle {
                id,
                block,
                lane,
                barycentrics,
                ..
            } => {
                let [a, b, c] = self.geometry.blocks[block].triangle(lane).map(|v| v.as_dvec3());
                let [v, w] = barycentrics;
                let mut position = a * (1.0 - v - w) + b * v + c * w;
                let mut normal = (b - a).cross(c - a);
                // The sum is rounded six times; the offset must also survive its own addition.
                let mut scale = a.abs().max(b.abs()).max(c.abs()).max_element();
                let mut object = id.object;
                if let Some(placement) = &self.placement {
                    let m = placement.to_local.matrix3;
                    let spread = m
                        .x_axis
                        .abs()
                        .max_element()
                        .max(m.y_axis.abs().max_element())
                        .max(m.z_axis.abs().max_element());
                    position = placement.to_world.transform_point3(position);
                    normal = m.transpose() * normal;
                    // Rounding in the scene's frame as the instance's frame sees it, and the other way round.
                    let n = placement.to_world.matrix3;
                    let stretch = n.x_axis.length().max(n.y_axis.length()).max(n.z_axis.length());
                    let outside =
                        position.abs().max_element() + placement.to_world.translation.abs().max_element();
                    scale = (scale * stretch + outside) * (3.0 * spread * stretch).max(1.0);
                    object = placement.object;
                }
                Hit {
                    t,
                    position,
                    normal: normal.normalize_or_zero(),
                    object: ObjectId(object),
                    surface: Surface::Triangle {
                        index: id.triangle,
                        barycentrics,
                    },
                    offset: 16.0 * f64::EPSILON * scale + f64::MIN_POSITIVE,
                }
            }
            Closest::Shape { index, hit } => Hit {
                t,
                position: hit.position,
                normal: hit.normal,
                object: self.geometry.shapes[index].object,
                surface: Surface::Primitive,
                offset: hit.offset,
            },
        }
    }
}

/// A triangle that rays have met, in the scene's frame.
pub(crate) struct Face {
    /// Its block and lane.
    place: (usize, usize),
    corners: [DVec3; 3],
    /// Unit.
    normal: DVec3,
    /// That of every hit on it.
    offset: f64,
}

/// What [`Tracer::new`] collects from a scene.
struct Gather<'a> {
    scene: &'a Scene,
    /// Objects to keep apart.
    movable: &'a [ObjectId],
    warnings: Vec<Warning>,
    soup: Soup,
    shapes: Vec<PlacedShape>,
    /// For each mesh, the objects that show it as an instance.
    instances: Vec<Vec<ObjectId>>,
    /// Primitives to keep apart.
    moving_shapes: Vec<(ObjectId, Shape, PlacedShape)>,
}

impl Gather<'_> {
    fn run(&mut self) {
        let mut users = vec![0usize; self.scene.meshes.len()];
        for object in &self.scene.objects {
            if let Source::Mesh(mesh) = object.geometry
                && let Some(users) = users.get_mut(mesh.index())
            {
                *users += 1;
            }
        }
        for (index, object) in self.scene.objects.iter().enumerate() {
            let id = ObjectId::from(index);
            let moves = self.movable.contains(&id);
            match object.geometry {
                Source::Mesh(mesh_id) => {
                    let Some(mesh) = self.scene.meshes.get(mesh_id.index()) else {
                        let object = object.name.clone();
                        self.warnings.push(Warning::MissingMesh { object });
                        continue;
                    };
                    let shared = users[mesh_id.index()] > 1 && mesh.triangles.len() >= INSTANCE_TRIANGLES;
                    if (shared || moves) && is_invertible(&object.transform) {
                        self.instances[mesh_id.index()].push(id);
                        continue;
                    }
                    let place = |p| object.transform.transform_point3(p);
                    self.soup.add(mesh, place, id, &object.name, &mut self.warnings);
                }
                Source::Primitive(primitive) => match placed_shape(&primitive.shape, &object.transform, id) {
                    Some(placed) if moves => self.moving_shapes.push((id, primitive.shape, placed)),
                    Some(placed) => self.shapes.push(placed),
                    None => self.warnings.push(Warning::BadPrimitive {
                        object: object.name.clone(),
                    }),
                },
            }
        }
    }
}

/// Triangles of several meshes.
#[derive(Default)]
struct Soup {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    ids: Vec<TriangleId>,
}

impl Soup {
    /// Appends the usable triangles of `mesh`.
    fn add(
        &mut self,
        mesh: &Mesh,
        place: impl Fn(Vec3) -> Vec3,
        object: ObjectId,
        name: &str,
        warnings: &mut Vec<Warning>,
    ) {
        let base = self.positions.len();
        self.positions.extend(mesh.positions.iter().map(|&p| place(p)));
        let positions = &self.positions[base..];
        let (mut bad, mut degenerate) = (0, 0);
        self.triangles.reserve(mesh.triangles.len());
        self.ids.reserve(mesh.triangles.len());
        for (index, &corners) in mesh.triangles.iter().enumerate() {
            let usable = |v: u32| positions.get(v as usize).copied().filter(|&p| in_range(p));
            let [Some(a), Some(b), Some(c)] = corners.map(usable) else {
                bad += 1;
                continue;
            };
            if a == b || b == c || c == a {
                degenerate += 1;
                continue;
            }
            self.triangles.push(corners.map(|v| v + base as u32));
            self.ids.push(TriangleId {
                object: object.0,
                triangle: index as u32,
            });
        }
        let object = name.to_owned();
        if bad > 0 {
            warnings.push(Warning::BadTriangles {
                object: object.clone(),
                count: bad,
            });
        }
        if degenerate > 0 {
            warnings.push(Warning::DegenerateTriangles {
                object,
                count: degenerate,
            });
        }
    }

    /// Builds the tree, over vertices welded where their positions are equal.
    fn build(mut self, shapes: Vec<PlacedShape>) -> Geometry {
        let weld = Weld::new(&self.positions);
        let positions: Vec<Vec3> = weld
            .representative
            .iter()
            .map(|&v| self.positions[v as usize])
            .collect();
        for vertex in self.triangles.iter_mut().flatten() {
            *vertex = weld.welded[*vertex as usize];
        }
        Geometry::new(&positions, &self.triangles, &self.ids, shapes)
    }
}

/// Finite and at most [`LARGEST_COORDINATE`]; false for NaN.
pub(crate) fn in_range(p: Vec3) -> bool {
    p.abs().cmple(Vec3::splat(LARGEST_COORDINATE)).all()
}

/// A primitive in the scene's frame, if its numbers are usable.
pub(crate) fn placed_shape(shape: &Shape, transform: &Affine3A, object: ObjectId) -> Option<PlacedShape> {
    PlacedShape::new(shape, transform, object)
        .filter(|shape| in_range(shape.bounds().min) && in_range(shape.bounds().max))
}

/// What fan queries need.
impl Tracer {
    pub(crate) fn level(&self) -> Level {
        self.level
    }

    /// The tree of parts.
    pub(crate) fn top(&self) -> &WideTree {
        &self.top
    }

    pub(crate) fn part(&self, index: usize) -> Option<(&Geometry, Option<&Placement>)> {
        let part = self.parts.get(index)?;
        Some((&part.geometry, part.placement.as_ref()))
    }

    /// A hit of the geometry of a tracer whose only part is in the scene's frame, completed; `face` is kept from hit to
    /// hit.
    #[inline]
    pub(crate) fn complete(&self, closest: &Closest, face: &mut Option<Face>) -> Hit {
        self.parts[0].hit_on_face(closest, face)
    }

    /// The geometry of a tracer whose only part is in the scene's frame.
    pub(crate) fn only_geometry(&self) -> Option<&Geometry> {
        match self.parts.as_slice() {
            [
                Part {
                    geometry,
                    placement: None,
                },
            ] => Some(geometry),
            _ => None,
        }
    }
}
