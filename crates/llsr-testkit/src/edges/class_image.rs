//! Dense images of how much receivers see of a light, against shadow edges.

use glam::{DVec3, Vec3};
use llsr_scene::{Light, LightId, ObjectId, Scene};

use super::shadow_scenes::{area, lit_faces};
use super::shadows::{LightClass, ShadowCoverage, ShadowOracle};
use crate::tracer::world_triangles;

/// A point of a receiver and how much of the light it sees.
pub type ClassPoint = (DVec3, LightClass);

/// What a dense image says of the shadow edges of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassImage {
    /// Points that are in umbra, in penumbra and lit.
    pub points: [usize; 3],
    /// Pairs of neighbouring points.
    pub pairs: usize,
    /// Pairs of different class with an edge of each kind that they need between them, and all such pairs.
    pub separated: ShadowCoverage,
    /// Edges at whose middle the class changes as their kind says, and all edges looked at.
    pub real: ShadowCoverage,
}

impl ClassImage {
    /// Adds what another one counted.
    pub fn add(&mut self, other: &Self) {
        for (mine, more) in self.points.iter_mut().zip(other.points) {
            *mine += more;
        }
        self.pairs += other.pairs;
        self.separated.add(&other.separated);
        self.real.add(&other.real);
    }
}

/// Classifies about `points` points a light by exact visibility, half of them on object 0 and the rest by area on the other
/// receivers, in a triangular lattice on each face; then asks for an edge between any two neighbours of different class.
///
/// `edges` gives the segments of a light and a receiver at which the class may change between lit and not lit, and between
/// dark and not dark. One of them has to come within 1e-4 of the scene's size of the segment between the points. A face is
/// a receiver if the whole light is before it. Pairs without an edge are passed to `lost`.
///
/// Cost: points times triangles, about 10 ns each.
pub fn class_image(
    scene: &Scene,
    points: u32,
    mut edges: impl FnMut(LightId, ObjectId) -> [Vec<[Vec3; 2]>; 2],
    mut lost: impl FnMut(ObjectId, [ClassPoint; 2]),
) -> ClassImage {
    let oracle = ShadowOracle::new(&world_triangles(scene));
    let near = 1e-4 * f64::from(scene.bounds().diagonal());
    let mut image = ClassImage::default();
    let mut scratch = Vec::new();
    for (index, light) in scene.lights.iter().enumerate() {
        let Light::Linear(light) = light else { continue };
        let ends = [light.a, light.b];
        let receivers: Vec<(ObjectId, Vec<[DVec3; 3]>, f64)> = (0..scene.objects.len())
            .map(|o| (ObjectId::from(o), lit_faces(scene, o, ends)))
            .filter(|(_, faces)| !faces.is_empty())
            .map(|(id, faces)| {
                let whole = faces.iter().map(area).sum();
                (id, faces, whole)
            })
            .collect();
        let others: f64 = receivers.iter().skip(1).map(|(_, _, whole)| whole).sum();
        for (receiver, faces, whole) in &receivers {
            let found = edges(LightId::from(index), *receiver);
            let floor = receiver.0 == 0;
            let share = if floor { 0.5 } else { 0.5 * whole / others };
            let per_area = f64::from(points) * share / whole;
            let mut class = |p| oracle.class(p, ends[0], ends[1], &mut scratch);
            for face in faces {
                // A lattice of n (n + 1) / 2 points; of small faces at least three.
                let n = ((2.0 * area(face) * per_area).sqrt().round() as usize).max(2);
                lattice(face, n, &mut class, &mut image, |pair, image| {
                    let close =
                        |a: &[Vec3; 2]| segments_apart(pair.map(|(p, _)| p), a.map(Vec3::as_dvec3)) <= near;
                    let counts = [
                        (LightClass::Lit, &mut image.separated.outer),
                        (LightClass::Umbra, &mut image.separated.inner),
                    ];
                    let mut all = true;
                    for ((class, counts), segments) in counts.into_iter().zip(&found) {
                        if pair.iter().any(|&(_, c)| c == class) {
                            let is_found = segments.iter().any(close);
                            counts[0] += usize::from(is_found);
                            counts[1] += 1;
                            all &= is_found;
                        }
                    }
                    if !all {
                        lost(*receiver, pair);
                    }
                });
            }
            for ((class_beside, counts), segments) in [
                (LightClass::Lit, &mut image.real.outer),
                (LightClass::Umbra, &mut image.real.inner),
            ]
            .into_iter()
            .zip(&found)
            {
                for segment in segments {
                    let Some([p, q]) = beside(segment.map(Vec3::as_dvec3), faces, 0.1 * near) else {
                        continue;
                    };
                    let is_real = (class(p) == class_beside) != (class(q) == class_beside);
                    counts[0] += usize::from(is_real);
                    counts[1] += 1;
                }
            }
        }
    }
    image
}

/// Visits the pairs of neighbours of different class in a lattice of `n` rows on a face.
fn lattice(
    face: &[DVec3; 3],
    n: usize,
    class: &mut impl FnMut(DVec3) -> LightClass,
    image: &mut ClassImage,
    mut visit: impl FnMut([ClassPoint; 2], &mut ClassImage),
) {
    let at = |i: usize, j: usize| {
        let [u, v] = [i, j].map(|k| (k as f64 + 1.0 / 3.0) / n as f64);
        face[0] + (face[1] - face[0]) * u + (face[2] - face[0]) * v
    };
    let mut before: Vec<ClassPoint> = Vec::new();
    for j in 0..n {
        let row: Vec<ClassPoint> = (0..n - j).map(|i| (at(i, j), class(at(i, j)))).collect();
        let mut pair = |a: ClassPoint, b: ClassPoint| {
            image.pairs += 1;
            if a.1 != b.1 {
                visit([a, b], image);
            }
        };
        for (i, &point) in row.iter().enumerate() {
            if i > 0 {
                pair(row[i - 1], point);
            }
            if j > 0 {
                pair(before[i], point);
                pair(before[i + 1], point);
            }
        }
        for (_, class) in &row {
            image.points[*class as usize] += 1;
        }
        before = row;
    }
}

/// Two points of the nearest face on both sides of a segment's middle; `None` if the segment is on none of the faces, so
/// short that its direction is not known, or too near to the border of the face.
fn beside([a, b]: [DVec3; 2], faces: &[[DVec3; 3]], step: f64) -> Option<[DVec3; 2]> {
    let middle = 0.5 * (a + b);
    let along = (b - a).length() > step;
    let inside = |p: DVec3, &[x, y, z]: &[DVec3; 3]| {
        let normal = (y - x).cross(z - x);
        let side = |s: DVec3, e: DVec3| (e - s).cross(p - s).dot(normal) > 0.0;
        let height = normal.normalize().dot(p - x).abs();
        height < 0.1 * step && side(x, y) && side(y, z) && side(z, x)
    };
    let face = faces.iter().find(|face| inside(middle, face))?;
    let normal = (face[1] - face[0]).cross(face[2] - face[0]);
    let across = normal.cross(b - a).try_normalize()? * step;
    let both = [middle + across, middle - across];
    (along && both.iter().all(|&p| inside(p, face))).then_some(both)
}

/// Distance between two segments.
fn segments_apart([p, q]: [DVec3; 2], [a, b]: [DVec3; 2]) -> f64 {
    let to_segment = |x: DVec3, [s, e]: [DVec3; 2]| {
        let along = e - s;
        let t = ((x - s).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        x.distance(s + along * if t.is_nan() { 0.0 } else { t })
    };
    let ends = to_segment(p, [a, b])
        .min(to_segment(q, [a, b]))
        .min(to_segment(a, [p, q]))
        .min(to_segment(b, [p, q]));
    // Nearest inside both: where the common normal meets them.
    let (u, v, w) = (q - p, b - a, a - p);
    let normal = u.cross(v);
    let square = normal.length_squared();
    let (s, t) = (w.cross(v).dot(normal) / square, w.cross(u).dot(normal) / square);
    if square > 0.0 && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
        ends.min(w.dot(normal).abs() / square.sqrt())
    } else {
        ends
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edges::ShadowScenes;

    #[test]
    fn distances_of_segments() {
        let segment = |a: [f64; 3], b: [f64; 3]| [DVec3::from(a), DVec3::from(b)];
        let x = segment([0.0, 0.0, 0.0], [2.0, 0.0, 0.0]);
        for (other, expected) in [
            (segment([1.0, -1.0, 0.5], [1.0, 1.0, 0.5]), 0.5),
            (segment([1.0, 0.25, 0.0], [1.0, 3.0, 0.0]), 0.25),
            (segment([3.0, 1.0, 0.0], [3.0, -1.0, 0.0]), 1.0),
            (segment([-1.0, 0.3, 0.0], [4.0, 0.3, 0.0]), 0.3),
            (segment([1.0, 1.0, 0.0], [1.0, 1.0, 0.0]), 1.0),
        ] {
            for (a, b) in [(x, other), (other, x)] {
                assert!((segments_apart(a, b) - expected).abs() < 1e-12, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn without_edges_every_change_is_lost_and_a_shifted_edge_is_not_real() {
        let scene = ShadowScenes::Box.build(3);
        let mut losses = 0;
        let none = class_image(
            &scene,
            4000,
            |_, _| Default::default(),
            |_, pair| {
                assert_ne!(pair[0].1, pair[1].1, "classes differ");
                losses += 1;
            },
        );
        let ClassImage {
            points, separated, ..
        } = none;
        assert!(points.iter().all(|&n| n > 20), "all classes: {none:?}");
        assert!((3000..6000).contains(&points.iter().sum::<usize>()), "{none:?}");
        assert!(
            losses > 50 && separated.outer[0] + separated.inner[0] == 0,
            "{none:?}"
        );
        let nowhere = [Vec3::new(-5.5, 0.0, -5.5), Vec3::new(-5.0, 0.0, -5.4)];
        let shifted = class_image(&scene, 400, |_, _| [vec![nowhere], vec![]], |_, _| ());
        assert_eq!(shifted.real.outer[0], 0, "{shifted:?}");
        assert!(shifted.real.outer[1] > 0, "{shifted:?}");
    }
}
