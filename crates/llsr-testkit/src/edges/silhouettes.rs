//! Brute-force silhouettes with exact signs.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use crate::intervals::Dyadic;

/// From where the silhouettes are sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// A viewer at a point.
    At(DVec3),
    /// A viewer infinitely far away in this direction.
    Towards(DVec3),
}

/// The two ends of an edge, as the bits of their coordinates, in order.
pub type ViewedEdge = [[u32; 3]; 2];

/// All edges of a mesh with the faces at each.
#[derive(Clone, Debug)]
pub struct SilhouetteOracle {
    corners: Vec<[Vec3; 3]>,
    /// Faces at each edge, and whether they run along it from the first to the second end.
    edges: BTreeMap<ViewedEdge, Vec<(usize, bool)>>,
}

fn bits(p: Vec3) -> [u32; 3] {
    p.to_array().map(|x| if x == 0.0 { 0 } else { x.to_bits() })
}

impl SilhouetteOracle {
    /// Takes a mesh apart; faces with two equal corners are left out.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let corners: Vec<[Vec3; 3]> = triangles
            .iter()
            .map(|t| t.map(|v| positions[v as usize]))
            .collect();
        let mut edges: BTreeMap<ViewedEdge, Vec<(usize, bool)>> = BTreeMap::new();
        for (face, corner) in corners.iter().enumerate() {
            let ends = corner.map(bits);
            if ends[0] == ends[1] || ends[1] == ends[2] || ends[2] == ends[0] {
                continue;
            }
            for (a, b) in [(ends[0], ends[1]), (ends[1], ends[2]), (ends[2], ends[0])] {
                let (key, forward) = if a < b { ([a, b], true) } else { ([b, a], false) };
                edges.entry(key).or_default().push((face, forward));
            }
        }
        Self { corners, edges }
    }

    /// Edges with at least two faces, all of which lie on one side of the edge in the picture, in order.
    pub fn silhouettes(&self, view: View) -> Vec<ViewedEdge> {
        let fronts: Vec<bool> = self
            .corners
            .iter()
            .map(|&corners| sees_front(view, corners))
            .collect();
        self.edges
            .iter()
            .filter(|(_, faces)| {
                let mut sides = faces.iter().map(|&(face, forward)| fronts[face] == forward);
                let first = sides.next();
                faces.len() > 1 && sides.all(|side| Some(side) == first)
            })
            .map(|(&edge, _)| edge)
            .collect()
    }

    /// Edges of one face, in order.
    pub fn boundaries(&self) -> Vec<ViewedEdge> {
        self.edges
            .iter()
            .filter(|(_, faces)| faces.len() == 1)
            .map(|(&edge, _)| edge)
            .collect()
    }

    /// The ends of an edge in the oracle's form.
    pub fn name(ends: [Vec3; 2]) -> ViewedEdge {
        let mut edge = ends.map(bits);
        edge.sort_unstable();
        edge
    }
}

/// Exactly: is the viewer strictly on the side from which the corners run counter-clockwise?
fn sees_front(view: View, corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let towards = match view {
        View::At(eye) => eye - a,
        View::Towards(direction) => direction,
    };
    let (u, v) = (b - a, c - a);
    let volume = u.cross(v).dot(towards);
    let scale = u.abs().max_element() * v.abs().max_element() * towards.abs().max_element();
    if volume.abs() > 1e-12 * scale {
        return volume > 0.0;
    }
    let exact = |p: DVec3| p.to_array().map(|x| Dyadic::new(x).expect("finite coordinates"));
    let minus = |p: &[Dyadic; 3], q: &[Dyadic; 3]| [0, 1, 2].map(|k| &p[k] - &q[k]);
    let [a, b, c] = [a, b, c].map(exact);
    let (u, v) = (minus(&b, &a), minus(&c, &a));
    let t = match view {
        View::At(eye) => minus(&exact(eye), &a),
        View::Towards(direction) => exact(direction),
    };
    let cross = |j: usize, k: usize| &(&u[j] * &v[k]) - &(&u[k] * &v[j]);
    let sum = &(&(&cross(1, 2) * &t[0]) + &(&cross(2, 0) * &t[1])) + &(&cross(0, 1) * &t[2]);
    sum.signum() > 0
}
