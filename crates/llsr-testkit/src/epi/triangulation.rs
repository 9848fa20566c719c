//! Interpolation over a constrained Delaunay triangulation of samples and edges, as Pighin, Lischinski and Salesin (1997) preview
//! pictures: what the edge-and-point image is compared with.

use glam::Vec2;
use spade::handles::{FixedFaceHandle, FixedVertexHandle, InnerTag};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, PositionInTriangulation, Triangulation};

use super::blind::ScreenSample;

/// A corner of the triangulation.
#[derive(Clone, Copy, Debug)]
struct Corner {
    position: Point2<f64>,
    /// That of a sample; ends of edges have none.
    colour: Option<[f32; 3]>,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// Samples that a pixel is mixed from.
const NEAREST: usize = 4;
/// Triangles that are looked at on the way to them.
const MOST_TRIANGLES: usize = 200;

/// A picture of which samples and edges are known, as a triangulation.
#[derive(Debug)]
pub struct Triangulated {
    mesh: ConstrainedDelaunayTriangulation<Corner>,
}

impl Triangulated {
    /// Triangulates samples and visible edges, given as segments in pixels, best as short pieces: one that crosses an earlier one is
    /// left out, as is what spade refuses (coordinates that are not finite).
    pub fn new(samples: &[ScreenSample], edges: &[[Vec2; 2]]) -> Self {
        // On a grid, so that nearly equal corners become one.
        let grid = |v: f32| (f64::from(v) * 1024.0).round() / 1024.0;
        let corner = |x: f32, y: f32, colour| Corner {
            position: Point2::new(grid(x), grid(y)),
            colour,
        };
        let corners = samples
            .iter()
            .map(|sample| corner(sample.position[0], sample.position[1], Some(sample.colour)))
            .collect();
        let mut mesh = ConstrainedDelaunayTriangulation::bulk_load(corners).unwrap_or_default();
        let insert =
            |mesh: &mut ConstrainedDelaunayTriangulation<Corner>, p: Vec2| -> Option<FixedVertexHandle> {
                let new = corner(p.x, p.y, None);
                // A new corner would take the colour of a sample in its place away.
                match mesh.locate(new.position) {
                    PositionInTriangulation::OnVertex(vertex) => Some(vertex),
                    _ => mesh.insert(new).ok(),
                }
            };
        for &[a, b] in edges {
            let (Some(from), Some(to)) = (insert(&mut mesh, a), insert(&mut mesh, b)) else {
                continue;
            };
            if from != to {
                // Splitting where edges cross would be right, but spade panics on some nearly parallel ones: of two that
                // cross the later piece is left out.
                mesh.try_add_constraint(from, to);
            }
        }
        Self { mesh }
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.mesh.num_inner_faces()
    }

    /// The colours at the centres of all pixels, row by row: means of the nearest samples that are found from triangle to
    /// triangle without crossing an edge, weighted by the inverse square of their distances. `None` where there is none.
    pub fn picture(&self, width: usize, height: usize) -> Vec<Option<[f32; 3]>> {
        let mut hint = None;
        let (mut queue, mut found) = (Vec::new(), Vec::new());
        let mut seen = vec![u32::MAX; self.mesh.num_all_faces()];
        let mut picture = Vec::with_capacity(width * height);
        for i in 0..width * height {
            let p = Point2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            let place = match hint {
                Some(hint) => self.mesh.locate_with_hint(p, hint),
                None => self.mesh.locate(p),
            };
            let start = match place {
                PositionInTriangulation::OnFace(face) => Some(face),
                PositionInTriangulation::OnEdge(edge) => {
                    let edge = self.mesh.directed_edge(edge);
                    let face = edge.face().as_inner().or_else(|| edge.rev().face().as_inner());
                    face.map(|face| face.fix())
                }
                PositionInTriangulation::OnVertex(vertex) => {
                    let mut around = self.mesh.vertex(vertex).out_edges();
                    around.find_map(|edge| edge.face().as_inner().map(|face| face.fix()))
                }
                PositionInTriangulation::OutsideOfConvexHull(edge) => {
                    let face = self.mesh.directed_edge(edge).rev().face();
                    face.as_inner().map(|face| face.fix())
                }
                PositionInTriangulation::NoTriangulation => None,
            };
            let Some(start) = start else {
                picture.push(None);
                continue;
            };
            hint = Some(self.mesh.face(start).vertices()[0].fix());
            self.collect(start, i as u32, &mut seen, &mut queue, &mut found);
            picture.push(mix(&mut found, p));
        }
        picture
    }

    /// The samples at the corners of the triangles nearest to `start`, breadth first.
    fn collect(
        &self,
        start: FixedFaceHandle<InnerTag>,
        round: u32,
        seen: &mut [u32],
        queue: &mut Vec<FixedFaceHandle<InnerTag>>,
        found: &mut Vec<(FixedVertexHandle, Corner)>,
    ) {
        queue.clear();
        found.clear();
        queue.push(start);
        seen[start.index()] = round;
        let mut next = 0;
        while let Some(&face) = queue.get(next) {
            next += 1;
            let face = self.mesh.face(face);
            for vertex in face.vertices() {
                if vertex.data().colour.is_some() && found.iter().all(|known| known.0 != vertex.fix()) {
                    found.push((vertex.fix(), *vertex.data()));
                }
            }
            if found.len() >= NEAREST || next >= MOST_TRIANGLES {
                return;
            }
            for edge in face.adjacent_edges() {
                if edge.is_constraint_edge() {
                    continue;
                }
                if let Some(beyond) = edge.rev().face().as_inner()
                    && seen[beyond.fix().index()] != round
                {
                    seen[beyond.fix().index()] = round;
                    queue.push(beyond.fix());
                }
            }
        }
    }
}

fn mix(found: &mut [(FixedVertexHandle, Corner)], p: Point2<f64>) -> Option<[f32; 3]> {
    let square = |corner: &Corner| {
        let (dx, dy) = (corner.position.x - p.x, corner.position.y - p.y);
        (dx * dx + dy * dy) as f32
    };
    found.sort_by(|a, b| square(&a.1).total_cmp(&square(&b.1)));
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    for (_, corner) in found.iter().take(NEAREST) {
        let weight = 1.0 / (square(corner) + 1e-3);
        weights += weight;
        for (sum, component) in sum.iter_mut().zip(corner.colour.unwrap_or_default()) {
            *sum += weight * component;
        }
    }
    (weights > 0.0).then(|| sum.map(|component| component / weights))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_stay_on_their_side_of_an_edge() {
        let mut samples = Vec::new();
        for i in 0..200 {
            let place = |factor: f32| (i as f32 * factor).fract() * 20.0;
            let (x, y) = (place(0.754_877_7), place(0.569_840_3));
            let value = if x + 0.3 * y < 12.0 { 1.0 } else { 3.0 };
            samples.push(ScreenSample {
                position: [x, y],
                colour: [value; 3],
            });
        }
        // The line x + 0.3 y = 12, and one across it.
        let edges = [
            [Vec2::new(12.6, -2.0), Vec2::new(5.4, 22.0)],
            [Vec2::new(2.0, 7.0), Vec2::new(9.0, 8.0)],
        ];
        let mesh = Triangulated::new(&samples, &edges);
        assert!(mesh.triangles() > 300, "{} triangles", mesh.triangles());
        let (mut low, mut high) = (0, 0);
        for (i, value) in mesh.picture(20, 20).into_iter().enumerate() {
            let (x, y) = ((i % 20) as f32 + 0.5, (i / 20) as f32 + 0.5);
            let Some([value, ..]) = value else { continue };
            let distance = x + 0.3 * y - 12.0;
            if distance.abs() > 0.01 {
                let expected = if distance < 0.0 { 1.0 } else { 3.0 };
                assert!((value - expected).abs() < 1e-5, "({x}, {y}): {value}");
                low += usize::from(distance < 0.0);
                high += usize::from(distance > 0.0);
            }
        }
        assert!(low > 150 && high > 150, "{low} {high}");
    }
}
