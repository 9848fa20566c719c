//! Faces without area, and edges inside a plane.

use std::cmp::Ordering;

use glam::{DVec3, Vec3};
use llsr_intervals::{Plane, Viewpoint, orientation};
use llsr_scene::{Edge, NO_FACE};

/// Joins the neighbours of faces whose corners lie exactly on a line; returns the number of such faces.
///
/// Such a face stands where a vertex of one neighbour touches the side of another. It has no front, so its three
/// sides would come and go as silhouettes. Seen as it is meant, its long side does not exist, and its short sides
/// lie between their other face and the face beyond the long side.
pub(super) fn join_across_flat_faces(positions: &[Vec3], faces: &[[u32; 3]], edges: &mut Vec<Edge>) -> usize {
    let corner = |v: u32| positions[v as usize].as_dvec3();
    let long_side: Vec<Option<[u32; 2]>> = faces
        .iter()
        .map(|&face| long_side_if_flat(face, face.map(corner)))
        .collect();
    let flat = long_side.iter().flatten().count();
    if flat == 0 {
        return 0;
    }
    // For each flat face the face beyond its long side, and whether that one is oriented against it.
    let mut beyond: Vec<Option<(u32, bool)>> = vec![None; faces.len()];
    let mut blocked = vec![false; faces.len()];
    for edge in edges.iter() {
        let [a, b] = edge.vertices;
        for (this, other) in [(edge.faces[0], edge.faces[1]), (edge.faces[1], edge.faces[0])] {
            let Some(Some([c, d])) = long_side.get(this as usize) else {
                continue;
            };
            if [a, b] != [*c, *d] && [b, a] != [*c, *d] {
                continue;
            }
            if edge.non_manifold {
                blocked[this as usize] = true;
            } else if other != NO_FACE {
                beyond[this as usize] = Some((other, edge.flipped));
            }
        }
    }
    // What stands for a face: itself, or what lies beyond it; nothing if that is the rim of the mesh or a ring of
    // flat faces. Flat faces at non-manifold edges stay as they are.
    let stands_for = |mut face: u32| -> Option<(u32, bool)> {
        let mut flipped = false;
        for _ in 0..=flat {
            if face == NO_FACE {
                return None;
            }
            if long_side[face as usize].is_none() || blocked[face as usize] {
                return Some((face, flipped));
            }
            let (next, against) = beyond[face as usize]?;
            flipped ^= against;
            face = next;
        }
        None
    };
    edges.retain_mut(|edge| {
        let found = edge.faces.map(stands_for);
        match found {
            [Some((a, turned_a)), Some((b, turned_b))] if a != b => {
                edge.faces = [a, b];
                edge.flipped ^= turned_a ^ turned_b;
                true
            }
            [Some((face, _)), None] | [None, Some((face, _))] => {
                edge.faces = [face, NO_FACE];
                edge.flipped = false;
                true
            }
            _ => false,
        }
    });
    flat
}

/// The two far ends of a face with three different corners on a line.
fn long_side_if_flat(face: [u32; 3], corners: [DVec3; 3]) -> Option<[u32; 2]> {
    let [a, b, c] = corners;
    let (u, v) = (b - a, c - a);
    // Nearly all faces are done with here.
    if u.cross(v).length_squared() > 1e-24 * u.length_squared() * v.length_squared() {
        return None;
    }
    if face[0] == face[1] || face[1] == face[2] || face[2] == face[0] {
        return None;
    }
    let flat = [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .all(|axis| Viewpoint::towards(axis).is_some_and(|viewer| viewer.side(corners) == Ordering::Equal));
    let between = |p: DVec3, q: DVec3, r: DVec3| (p - q).dot(r - q) < 0.0;
    if !flat {
        None
    } else if between(a, b, c) {
        Some([face[0], face[2]])
    } else if between(b, c, a) {
        Some([face[1], face[0]])
    } else {
        Some([face[1], face[2]])
    }
}

/// True if the two faces of an edge lie exactly in one plane and look to the same side: every viewer then sees
/// both from the front or neither. Faces turned against each other are not taken for such a pair: to a viewer in their
/// plane neither has its front, so that they seem to lie on one side of the edge.
pub(super) fn lies_in_one_plane(
    edge: &Edge,
    faces: &[[u32; 3]],
    positions: &[Vec3],
    planes: &[Option<Plane>],
) -> bool {
    if edge.faces[1] == NO_FACE || edge.non_manifold || edge.flipped {
        return false;
    }
    let [Some(first), Some(second)] = edge.faces.map(|face| planes[face as usize]) else {
        return false;
    };
    let cosine = first.normal().dot(second.normal());
    if cosine < 1.0 - 1e-9 {
        return false;
    }
    let corner = |v: u32| positions[v as usize].as_dvec3();
    let [a, b, c] = faces[edge.faces[0] as usize].map(corner);
    faces[edge.faces[1] as usize]
        .iter()
        .all(|&v| orientation(a, b, c, corner(v)) == Ordering::Equal)
}
