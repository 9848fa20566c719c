//! Lines in the plane of a picture.

use glam::DVec2;
use llsr_scene::{Camera, Viewport};

use super::{DrawnLine, Layer};

/// A line in pixels, from the upper left corner.
#[derive(Clone, Debug)]
pub(crate) struct FlatLine {
    pub(crate) layer: Layer,
    pub(crate) hidden: bool,
    pub(crate) closed: bool,
    pub(crate) points: Vec<DVec2>,
}

/// Points are left out that move the line by no more than this (pixels).
const TOLERANCE: f64 = 0.02;

/// Lines that fit into a box of this diagonal (pixels) are left out: as strokes they would be dots of several times their
/// size.
const SPECK: f64 = 1.0;

/// Projects lines that lie in front of the camera, without specks.
pub(crate) fn flatten(lines: &[DrawnLine], camera: &Camera, viewport: Viewport) -> Vec<FlatLine> {
    lines
        .iter()
        .filter_map(|line| {
            let project = |&p| camera.project(viewport, p).map(|(x, y, _)| DVec2::new(x, y));
            let mut points: Vec<DVec2> = line.points.iter().filter_map(project).collect();
            if line.closed {
                points.extend(points.first().copied());
            }
            let points = simplify(&points);
            let (low, high) = points.iter().fold((DVec2::MAX, DVec2::MIN), |(low, high), &p| {
                (low.min(p), high.max(p))
            });
            (low.distance(high) >= SPECK && low.x <= high.x).then_some(FlatLine {
                layer: line.layer,
                hidden: line.hidden,
                closed: line.closed,
                points,
            })
        })
        .map(|mut line| {
            // A loop that became a stroke to and fro stays open.
            line.closed &= line.points.len() > 3;
            if line.closed {
                line.points.pop();
            }
            line
        })
        .collect()
}

/// The fewest points that Douglas and Peucker's method (1973) needs; both ends stay.
fn simplify(points: &[DVec2]) -> Vec<DVec2> {
    let Some(last) = points.len().checked_sub(1) else {
        return Vec::new();
    };
    let mut kept = vec![false; points.len()];
    (kept[0], kept[last]) = (true, true);
    let mut waiting = vec![(0, last)];
    while let Some((from, to)) = waiting.pop() {
        let farthest = (from + 1..to)
            .map(|i| (distance(points[i], points[from], points[to]), i))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((far, at)) = farthest
            && far > TOLERANCE
        {
            kept[at] = true;
            waiting.extend([(from, at), (at, to)]);
        }
    }
    let kept_points = points.iter().zip(kept).filter(|(_, kept)| *kept);
    kept_points.map(|(&p, _)| p).collect()
}

/// Distance of `p` from the segment `a`-`b`.
pub(super) fn distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let length = along.length_squared();
    let t = if length > 0.0 {
        ((p - a).dot(along) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    p.distance(a + along * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use llsr_scene::FieldOfView;

    #[test]
    fn specks_and_lines_behind_the_camera_are_left_out() {
        let viewport = Viewport {
            width: 100,
            height: 100,
        };
        // A metre is 50 pixels at the distance of 1.
        let angle = FieldOfView::vertical_degrees(90.0);
        let camera = Camera::look_at("", DVec3::Z, DVec3::ZERO, DVec3::Y, angle);
        let line = |points: &[DVec3]| DrawnLine {
            layer: Layer::Crease,
            hidden: false,
            closed: false,
            points: points.to_vec(),
        };
        let lines = [
            line(&[DVec3::ZERO, DVec3::X * 0.021]),
            line(&[DVec3::ZERO, DVec3::X * 0.019]),
            line(&[DVec3::ZERO, DVec3::X * 0.01, DVec3::ZERO, DVec3::Y * 0.01]),
            line(&[DVec3::Z * 2.0, DVec3::new(1.0, 0.0, 2.0)]),
            line(&[]),
        ];
        let flat = flatten(&lines, &camera, viewport);
        assert_eq!(flat.len(), 1, "{flat:?}");
        assert!(flat[0].points[0].distance(DVec2::splat(50.0)) < 1e-9, "{flat:?}");
        assert!(
            flat[0].points[1].distance(DVec2::new(51.05, 50.0)) < 1e-9,
            "{flat:?}"
        );
    }

    #[test]
    fn straight_runs_lose_their_inner_points_and_corners_stay() {
        let run: Vec<DVec2> = (0..100)
            .map(|i| DVec2::new(f64::from(i), 0.0))
            .chain((1..50).map(|i| DVec2::new(99.0, f64::from(i))))
            .collect();
        let corners = [DVec2::ZERO, DVec2::new(99.0, 0.0), DVec2::new(99.0, 49.0)];
        assert_eq!(simplify(&run), corners, "two straight runs");
        let circle: Vec<DVec2> = (0..=1000)
            .map(|i| DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 1000.0) * 100.0)
            .collect();
        let few = simplify(&circle);
        assert!(few.len() < 300, "{} points of a circle", few.len());
        for &p in &circle {
            let off = few.windows(2).map(|pair| distance(p, pair[0], pair[1]));
            assert!(off.fold(f64::MAX, f64::min) <= TOLERANCE, "{p} is off the line");
        }
        assert_eq!(simplify(&[]), [], "nothing");
    }
}
