//! Interpolation over a constrained Delaunay triangulation of samples and edges, as Pighin, Lischinski and Salesin (1997) preview
//! pictures: what the edge-and-point image is compared with.

use std::collections::HashMap;

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
    refused: usize,
}

impl Triangulated {
    /// Triangulates samples and visible edges, given as segments in pixels, best as short pieces.
    ///
    /// Edges are cut where they cross each other. All corners lie on a grid of 1/1024 pixel, to which crossings are rounded; a
    /// part that still crosses an earlier one is left out and counted, as is what is not finite or larger than 2^20 pixels.
    pub fn new(samples: &[ScreenSample], edges: &[[Vec2; 2]]) -> Self {
        let corner = |p: Point2<f64>, colour| Corner { position: p, colour };
        let corners = samples
            .iter()
            .filter(|sample| fits(sample.position[0], sample.position[1]))
            .map(|sample| {
                corner(
                    on_grid(sample.position[0], sample.position[1]),
                    Some(sample.colour),
                )
            })
            .collect();
        let mut mesh = ConstrainedDelaunayTriangulation::bulk_load(corners).unwrap_or_default();
        let insert = |mesh: &mut ConstrainedDelaunayTriangulation<Corner>,
                      p: Point2<f64>|
         -> Option<FixedVertexHandle> {
            // A new corner would take the colour of a sample in its place away.
            match mesh.locate(p) {
                PositionInTriangulation::OnVertex(vertex) => Some(vertex),
                _ => mesh.insert(corner(p, None)).ok(),
            }
        };
        let mut refused = edges.len();
        let edges: Vec<[Point2<f64>; 2]> = edges
            .iter()
            .filter(|edge| edge.iter().all(|p| fits(p.x, p.y)))
            .map(|edge| edge.map(|p| on_grid(p.x, p.y)))
            .collect();
        refused -= edges.len();
        for [a, b] in cut_at_crossings(&edges) {
            let (Some(from), Some(to)) = (insert(&mut mesh, a), insert(&mut mesh, b)) else {
                refused += 1;
                continue;
            };
            // Never the way that splits: it computes crossings itself, not exactly, and panics on nearly parallel edges.
            if from != to && !mesh.can_add_constraint(from, to) {
                refused += 1;
            } else if from != to {
                mesh.add_constraint(from, to);
            }
        }
        Self { mesh, refused }
    }

    /// Number of parts of edges that were left out.
    pub fn refused(&self) -> usize {
        self.refused
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

/// Are these coordinates finite, and small enough to stay exact on the grid?
fn fits(x: f32, y: f32) -> bool {
    x.abs() < LARGEST && y.abs() < LARGEST
}

/// The nearest point of the grid, so that nearly equal corners become one.
fn on_grid(x: f32, y: f32) -> Point2<f64> {
    let grid = |v: f32| (f64::from(v) * GRID).round() / GRID;
    Point2::new(grid(x), grid(y))
}

/// Grid points a pixel.
const GRID: f64 = 1024.0;
/// Coordinates (pixels) beyond this are refused.
const LARGEST: f32 = (1u32 << 20) as f32;
/// Cells (pixels) in which edges are looked for that may cross.
const CELL: f64 = 8.0;

/// The edges, cut where they cross or touch each other; cuts are rounded to the grid.
fn cut_at_crossings(edges: &[[Point2<f64>; 2]]) -> Vec<[Point2<f64>; 2]> {
    let mut cells: HashMap<(i64, i64), Vec<usize>> = HashMap::new();
    let cell = |v: f64| (v / CELL).floor() as i64;
    let cells_of = |[a, b]: [Point2<f64>; 2]| {
        let (left, right) = (cell(a.x.min(b.x)), cell(a.x.max(b.x)));
        let (top, bottom) = (cell(a.y.min(b.y)), cell(a.y.max(b.y)));
        (left..=right).flat_map(move |x| (top..=bottom).map(move |y| (x, y)))
    };
    let mut out = Vec::with_capacity(edges.len());
    for (i, &edge) in edges.iter().enumerate() {
        cells_of(edge).for_each(|cell| cells.entry(cell).or_default().push(i));
    }
    let (mut others, mut cuts) = (Vec::new(), Vec::new());
    for (i, &edge) in edges.iter().enumerate() {
        let [a, b] = edge;
        others.clear();
        others.extend(
            cells_of(edge)
                .filter_map(|cell| cells.get(&cell))
                .flatten()
                .copied(),
        );
        others.sort_unstable();
        others.dedup();
        cuts.clear();
        for &j in others.iter().filter(|&&j| j != i) {
            cuts.extend(crossing(edge, edges[j]));
        }
        let along = |p: &Point2<f64>| (p.x - a.x) * (b.x - a.x) + (p.y - a.y) * (b.y - a.y);
        cuts.sort_by(|p, q| along(p).total_cmp(&along(q)));
        let mut from = a;
        for &to in cuts.iter().chain([&b]) {
            if to != from {
                out.push([from, to]);
            }
            from = to;
        }
    }
    out
}

/// Where the first edge is to be cut because of the second: inside it.
fn crossing([a, b]: [Point2<f64>; 2], [c, d]: [Point2<f64>; 2]) -> Option<Point2<f64>> {
    // The same for both, whichever is asked first, so that both get the same cut.
    let ([a, b], [c, d]) = if (a.x, a.y, b.x, b.y) < (c.x, c.y, d.x, d.y) {
        ([a, b], [c, d])
    } else {
        ([c, d], [a, b])
    };
    let (u, v) = ((b.x - a.x, b.y - a.y), (d.x - c.x, d.y - c.y));
    let area = u.0 * v.1 - u.1 * v.0;
    let w = (c.x - a.x, c.y - a.y);
    let (s, t) = ((w.0 * v.1 - w.1 * v.0) / area, (w.0 * u.1 - w.1 * u.0) / area);
    // Parallel ones give infinities or no numbers.
    let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    let grid = |v: f64| (v * GRID).round() / GRID;
    inside.then(|| Point2::new(grid(a.x + s * u.0), grid(a.y + s * u.1)))
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
    fn edges_that_cross_overlap_and_nearly_touch_are_taken_without_a_panic() {
        let mut state = 5u64;
        let mut next = |most: f32| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f32 / (1u64 << 24) as f32 * most
        };
        let samples: Vec<ScreenSample> = (0..300)
            .map(|_| ScreenSample {
                position: [next(30.0), next(30.0)],
                colour: [1.0; 3],
            })
            .collect();
        let mut edges = Vec::new();
        for i in 0..600 {
            let (x, y) = (next(30.0), next(30.0));
            // All through one point, nearly parallel, the same twice, of no length, anywhere.
            let [a, b] = match i % 5 {
                0 => [Vec2::new(x, y), Vec2::new(30.0 - x, 30.0 - y)],
                1 => [Vec2::new(0.0, 10.0), Vec2::new(30.0, 10.0 + 0.01 * next(1.0))],
                2 => [Vec2::new(3.0, 1.0 + 0.01 * y), Vec2::new(4.0, 27.0)],
                3 => [Vec2::new(x, y), Vec2::new(x, y)],
                _ => [Vec2::new(x, y), Vec2::new(next(30.0), next(30.0))],
            };
            edges.push([a, b]);
        }
        edges.push([Vec2::NAN, Vec2::ONE]);
        edges.push([Vec2::splat(1e9), Vec2::ONE]);
        let mesh = Triangulated::new(&samples, &edges);
        assert!(mesh.refused() >= 2, "what is not finite or huge is refused");
        let parts = cut_at_crossings(
            &edges[..600]
                .iter()
                .map(|e| e.map(|p| on_grid(p.x, p.y)))
                .collect::<Vec<_>>(),
        );
        assert!(
            mesh.refused() - 2 < parts.len() / 10,
            "{} of {} parts refused",
            mesh.refused(),
            parts.len()
        );
        assert_eq!(mesh.picture(30, 30).len(), 900, "a colour or none for each pixel");
    }

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
