//! Where surfaces run into each other.
//!
//! A seat that reaches through a wall has an outline there that is no edge of either mesh: the curve in which both surfaces
//! meet. It looks the same from everywhere, so it is found once, like creases.

mod cross;
mod tree;

use std::ops::Range;

use glam::Vec3;
use llsr_scene::{Bounds, ObjectId};

use crate::SceneEdges;
use crate::meeting::cross::{Face, cross};
use crate::meeting::tree::BoxTree;

/// How meetings of surfaces are sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeetingOptions {
    /// A corner so near to a plane counts as lying in it, as a share of the scene's diagonal. What only touches another
    /// surface, say a leg on a floor, meets it along edges that it has already.
    pub touching: f64,
    /// Pairs of triangles that are tried for each triangle of the scene; together with 2^20 more this bounds the time that heaps
    /// of triangles take which all lie in one another.
    pub most_pairs: u64,
}

impl Default for MeetingOptions {
    fn default() -> Self {
        Self {
            touching: 1e-6,
            most_pairs: 64,
        }
    }
}

/// A piece of the curve in which two surfaces meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Whose surfaces; the same twice if they are parts of one mesh that are not connected.
    pub objects: [ObjectId; 2],
    /// Its ends (m, recentred frame).
    pub segment: [Vec3; 2],
}

/// The curves in which surfaces of different objects, or of parts of one mesh that share no vertex, run through each other.
///
/// Primitives are not looked at. Surfaces that lie in one plane, or touch along edges of both, do not meet in this sense. Pieces of one
/// curve that follow each other have bitwise equal ends.
///
/// ```
/// use glam::Vec3;
/// use llsr_edges::{MeetingOptions, Meetings, SceneEdgeOptions, SceneEdges};
/// use llsr_scene::{MaterialId, Mesh, Scene};
///
/// let mut scene = Scene::new("a post in the ground");
/// scene.add_mesh(Mesh::cuboid("post", Vec3::new(-0.1, -1.0, -0.1), Vec3::new(0.1, 1.0, 0.1), MaterialId(0)));
/// let ground = [[-5.0, -5.0], [-5.0, 5.0], [5.0, 5.0], [5.0, -5.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
/// scene.add_mesh(Mesh::quad("ground", ground, MaterialId(0)));
/// let edges = SceneEdges::new(&scene, &SceneEdgeOptions::default());
/// let found = Meetings::new(&edges, MeetingOptions::default());
/// let length: f32 = found.iter().map(|meeting| meeting.segment[0].distance(meeting.segment[1])).sum();
/// assert!((length - 0.8).abs() < 1e-6, "once around the post");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Meetings {
    found: Vec<Meeting>,
    cut_short: bool,
}

/// Triangles of all objects in the recentred frame, with the part that each belongs to.
#[derive(Default)]
struct Triangles {
    faces: Vec<Face>,
    /// For each face its part; the parts of an object follow each other.
    parts: Vec<u32>,
    /// For each part its object and box.
    owners: Vec<(ObjectId, Bounds)>,
}

impl Meetings {
    /// Finds them among the objects of `edges`, where they stand now.
    ///
    /// Cost: O(n log n) in the triangles of the scene, and some ten nanoseconds for each pair of triangles with overlapping boxes.
    pub fn new(edges: &SceneEdges, options: MeetingOptions) -> Self {
        let triangles = Triangles::of(edges);
        if triangles.owners.len() < 2 {
            return Self::default();
        }
        let bounds = triangles
            .owners
            .iter()
            .fold(Bounds::EMPTY, |all, (_, part)| all.union(*part));
        let diagonal = (bounds.max.as_dvec3() - bounds.min.as_dvec3()).length();
        let touching = options.touching * diagonal;
        let boxes: Vec<Bounds> = triangles
            .faces
            .iter()
            .map(|face| Bounds::of(face.corners()))
            .collect();
        let tree = BoxTree::new(&boxes, &triangles.parts);
        let most = (1 << 20) + options.most_pairs.saturating_mul(boxes.len() as u64);
        let mut found = Vec::new();
        let cut_short = !tree.pairs(most, |a, b| {
            let [part_a, part_b] = [a, b].map(|i| triangles.parts[i as usize] as usize);
            let [(object_a, box_a), (object_b, box_b)] = [part_a, part_b].map(|i| triangles.owners[i]);
            let [face_a, face_b] = [a, b].map(|i| &triangles.faces[i as usize]);
            if let Some(segment) = cross([face_a, face_b], [&box_a, &box_b], touching) {
                found.push(Meeting {
                    objects: [object_a.min(object_b), object_a.max(object_b)],
                    segment,
                });
            }
        });
        let key = |meeting: &Meeting| {
            (
                meeting.objects,
                meeting.segment.map(|p| p.to_array().map(f32::to_bits)),
            )
        };
        found.sort_unstable_by_key(key);
        found.dedup();
        Self { found, cut_short }
    }

    /// All pieces, sorted by their objects.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Meeting> {
        self.found.iter()
    }

    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.found.len()
    }

    /// Nothing meets.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// True if there were more pairs of triangles than the options allow, so that some meetings are missing.
    pub fn is_cut_short(&self) -> bool {
        self.cut_short
    }
}

impl Triangles {
    fn of(edges: &SceneEdges) -> Self {
        let mut all = Self::default();
        for object in (0..edges.objects()).map(ObjectId::from) {
            let Some(mesh) = edges.mesh_of(object) else {
                continue;
            };
            let transform = edges.transform(object);
            let world: Vec<Vec3> = mesh
                .positions()
                .iter()
                .map(|&p| transform.transform_point3(p))
                .collect();
            let first = all.owners.len();
            let parts = components(world.len(), mesh.faces());
            for (face, part) in mesh.faces().iter().zip(parts) {
                let corners = face.map(|v| world[v as usize]);
                let part = first + part as usize;
                if all.owners.len() == part {
                    all.owners.push((object, Bounds::EMPTY));
                }
                let Some(face) = Face::new(corners) else {
                    continue;
                };
                let bounds = &mut all.owners[part].1;
                *bounds = corners.into_iter().fold(*bounds, Bounds::with);
                all.faces.push(face);
                all.parts.push(part as u32);
            }
        }
        all
    }
}

/// For each face the number of its connected part, from 0 in the order in which they appear.
fn components(vertices: usize, faces: &[[u32; 3]]) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..vertices as u32).collect();
    let root = |parents: &mut [u32], mut v: u32| {
        while parents[v as usize] != v {
            parents[v as usize] = parents[parents[v as usize] as usize];
            v = parents[v as usize];
        }
        v
    };
    for &[a, b, c] in faces {
        let a = root(&mut parents, a);
        for other in [b, c] {
            let other = root(&mut parents, other);
            parents[other as usize] = a;
        }
    }
    let mut numbers = vec![u32::MAX; vertices];
    let mut count = 0;
    let number = |face: &[u32; 3]| {
        let root = root(&mut parents, face[0]) as usize;
        if numbers[root] == u32::MAX {
            numbers[root] = count;
            count += 1;
        }
        numbers[root]
    };
    faces.iter().map(number).collect()
}

/// Halves of a range, the first at least as long.
fn halves(range: Range<u32>) -> [Range<u32>; 2] {
    let middle = range.start + (range.end - range.start).div_ceil(2);
    [range.start..middle, middle..range.end]
}
