//! Figure 4 of Ouellette & Fiume 1999: expected estimates as curves.

use std::path::Path;

use llsr_rsb::{Method, expected_estimate};
use plotters::prelude::*;

/// Draws the expected estimate of pure, random-cut, random-seed and dithered bisection after 2 and 4 tests.
pub(crate) fn draw(path: &Path) -> Result<(), String> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let root = SVGBackend::new(path, (1000, 520)).into_drawing_area();
    root.fill(&WHITE).map_err(|e| failed(&e))?;
    for (area, n) in root.split_evenly((1, 2)).iter().zip([2, 4]) {
        let mut chart = ChartBuilder::on(area)
            .caption(format!("n = {n}"), ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(44)
            .build_cartesian_2d(0.0..1.0, 0.0..1.0)
            .map_err(|e| failed(&e))?;
        chart
            .configure_mesh()
            .x_desc("place of the change")
            .y_desc("expected estimate")
            .light_line_style(TRANSPARENT)
            .draw()
            .map_err(|e| failed(&e))?;
        let methods = [
            (Method::Bisection, RED, "pure, jittered"),
            (Method::RandomCut, GREEN, "random cut"),
            (Method::RandomSeed, BLUE, "random seed"),
            (Method::Dithered, BLACK, "dithered"),
        ];
        for (method, color, label) in methods {
            // Pure bisection jumps: a point just before each jump keeps its steps upright.
            let steps = 2048;
            let line = (0..=steps).map(|i| {
                let lambda = f64::from(i) / f64::from(steps);
                (lambda, expected_estimate(method, n, lambda))
            });
            chart
                .draw_series(LineSeries::new(line, color.stroke_width(2)))
                .map_err(|e| failed(&e))?
                .label(label)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], color.stroke_width(2)));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE)
            .border_style(BLACK)
            .draw()
            .map_err(|e| failed(&e))?;
    }
    root.present().map_err(|e| failed(&e))
}
