//! Drawings over a picture, with smooth lines.

use glam::{DVec2, Vec3};
use llsr_scene::{Viewport, srgb_to_linear};

use super::flat::distance;
use super::{FlatLine, Layer};

/// Draws `lines` over `pixels`, linear colours for display, row by row.
pub(crate) fn overlay(pixels: &mut [Vec3], lines: &[FlatLine], viewport: Viewport) {
    let scale = f64::from(viewport.width.min(viewport.height)) / 512.0;
    for hidden in [true, false] {
        for layer in Layer::ALL {
            let (colour, width) = layer.style();
            let colour = Vec3::from(colour.map(|c| srgb_to_linear(f32::from(c) / 255.0)));
            // Lines thinner than a pixel are as light as they are thin.
            let mut canvas = Canvas {
                viewport,
                half: 0.5 * (width * scale).max(1.0),
                coverage: vec![0.0; pixels.len()],
            };
            let mut any = false;
            for line in lines.iter().filter(|l| l.layer == layer && l.hidden == hidden) {
                any = true;
                let closing = line.points.first().filter(|_| line.closed);
                let points: Vec<DVec2> = line.points.iter().chain(closing).copied().collect();
                let mut passed = 0.0;
                for pair in points.windows(2) {
                    if hidden {
                        canvas.dashes(pair[0], pair[1], &mut passed, 3.0 * scale.max(1.0));
                    } else {
                        canvas.stroke(pair[0], pair[1]);
                    }
                }
            }
            let opacity = (width * scale).min(1.0) as f32 * if hidden { 0.5 } else { 1.0 };
            if any {
                for (pixel, coverage) in pixels.iter_mut().zip(&canvas.coverage) {
                    *pixel = pixel.lerp(colour, coverage * opacity);
                }
            }
        }
    }
}

/// How much of each pixel a layer's lines cover.
struct Canvas {
    viewport: Viewport,
    /// Half the width of a line (pixels).
    half: f64,
    coverage: Vec<f32>,
}

impl Canvas {
    /// Covers the pixels near a segment; where lines meet the larger coverage counts.
    fn stroke(&mut self, a: DVec2, b: DVec2) {
        let reach = self.half + 0.5;
        let (low, high) = (a.min(b) - reach - 0.5, a.max(b) + reach - 0.5);
        let clamp = |x: f64, size: u32| x.clamp(-1.0, f64::from(size)) as i64;
        let (width, height) = (self.viewport.width, self.viewport.height);
        let rows =
            clamp(low.y.ceil(), height).max(0)..=clamp(high.y.floor(), height).min(i64::from(height) - 1);
        for y in rows {
            // Of a long slanting line only the stretch beside this row.
            let centre = y as f64 + 0.5;
            let (mut from, mut to) = (low.x, high.x);
            let slope = (b.x - a.x) / (b.y - a.y);
            if slope.is_finite() && (b.y - a.y).abs() > 1.0 {
                let around = |row: f64| a.x + (row - a.y) * slope;
                let (x0, x1) = (around(centre - 2.0 * reach), around(centre + 2.0 * reach));
                from = from.max(x0.min(x1) - reach - 0.5);
                to = to.min(x0.max(x1) + reach - 0.5);
            }
            let columns =
                clamp(from.ceil(), width).max(0)..=clamp(to.floor(), width).min(i64::from(width) - 1);
            for x in columns {
                let pixel = DVec2::new(x as f64 + 0.5, centre);
                let covered = (reach - distance(pixel, a, b)).clamp(0.0, 1.0) as f32;
                let held = &mut self.coverage[y as usize * width as usize + x as usize];
                *held = held.max(covered);
            }
        }
    }

    /// The same in dashes and gaps of equal length; `passed` is the length of the line so far.
    fn dashes(&mut self, a: DVec2, b: DVec2, passed: &mut f64, dash: f64) {
        let length = a.distance(b);
        let point = |s: f64| a + (b - a) * ((s - *passed) / length).clamp(0.0, 1.0);
        let end = *passed + length;
        let mut number = (*passed / dash).floor();
        let mut strokes = Vec::new();
        while number * dash < end && length > 0.0 {
            if number % 2.0 == 0.0 {
                strokes.push((point(number * dash), point((number + 1.0) * dash)));
            }
            number += 1.0;
        }
        for (from, to) in strokes {
            self.stroke(from, to);
        }
        *passed = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(points: Vec<DVec2>, hidden: bool) -> Vec<Vec3> {
        let viewport = Viewport {
            width: 512,
            height: 512,
        };
        let mut pixels = vec![Vec3::ONE; 512 * 512];
        let line = FlatLine {
            layer: Layer::Silhouette,
            hidden,
            closed: false,
            points,
        };
        overlay(&mut pixels, &[line], viewport);
        pixels
    }

    fn ink(pixels: &[Vec3]) -> f64 {
        pixels.iter().map(|p| f64::from(1.0 - p.x)).sum()
    }

    #[test]
    fn ink_grows_with_length_at_any_angle() {
        // Width 1.6, colour nearly black; the ends are round.
        let dark = 1.0 - f64::from(srgb_to_linear(16.0 / 255.0));
        for angle in [0.0, 0.3, 0.9, std::f64::consts::FRAC_PI_2, 2.0] {
            let middle = DVec2::splat(256.0);
            let half = DVec2::from_angle(angle) * 150.0;
            let found = ink(&drawn(vec![middle - half, middle + half], false)) / dark;
            assert!((found - 300.0 * 1.6).abs() < 6.0, "{found} at {angle}");
            let dashed = ink(&drawn(vec![middle - half, middle + half], true)) / dark;
            assert!((150.0..340.0).contains(&dashed), "{dashed} dashed at {angle}");
        }
    }

    #[test]
    fn lines_may_leave_the_picture() {
        let far = drawn(vec![DVec2::new(-1e7, 30.0), DVec2::new(1e7, 30.0)], false);
        assert!((ink(&far) - 512.0 * 1.6).abs() < 8.0, "{}", ink(&far));
        let outside = drawn(vec![DVec2::new(-100.0, -3.0), DVec2::new(700.0, -5.0)], false);
        assert_eq!(ink(&outside), 0.0, "nothing outside");
    }
}
