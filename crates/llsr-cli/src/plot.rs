//! Plots as SVG.

use llsr_shading::Method;
use plotters::prelude::*;

use crate::command::bench::Row;
use crate::failure::Failure;

/// Relative error against CPU seconds, both logarithmic, one line a method.
pub(crate) fn error_against_time(title: &str, rows: &[Row]) -> Result<String, Failure> {
    let mut svg = String::new();
    draw(&mut svg, title, rows).map_err(|error| Failure::Work(format!("the plot: {error}")))?;
    Ok(svg)
}

/// Errors below this are drawn at it: single precision ends there.
const FLOOR: f64 = 1e-7;

/// One for each of [`Method::ALL`], dark enough for thin lines on white.
const COLORS: [(u8, u8, u8); Method::ALL.len()] = [
    (220, 20, 60),
    (30, 30, 30),
    (230, 120, 0),
    (0, 110, 200),
    (0, 150, 80),
    (110, 160, 20),
    (0, 165, 165),
    (150, 110, 60),
    (90, 90, 160),
    (235, 90, 150),
    (0, 90, 90),
    (135, 60, 190),
    (130, 80, 20),
];

fn draw(svg: &mut String, title: &str, rows: &[Row]) -> Result<(), Box<dyn std::error::Error>> {
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0f64), |(lo, hi), v| (lo.min(v), hi.max(v)))
    };
    let (t0, t1) = range(&mut rows.iter().map(|r| r.cpu_seconds.max(1e-4)));
    let (e0, e1) = range(&mut rows.iter().map(|r| r.rel_rmse.max(FLOOR)));
    let root = SVGBackend::with_string(svg, (900, 620)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 20))
        .margin(14)
        .x_label_area_size(42)
        .y_label_area_size(70)
        .margin_right(24)
        .build_cartesian_2d((t0 / 1.5..t1 * 1.5).log_scale(), (e0 / 1.5..e1 * 1.5).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("CPU seconds")
        .y_desc("relative RMSE of the irradiance")
        .x_label_formatter(&|v| format!("{v:.3}"))
        .y_label_formatter(&|v| format!("{v:.0e}"))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for (index, method) in Method::ALL.into_iter().enumerate() {
        let points: Vec<(f64, f64)> = rows
            .iter()
            .filter(|r| r.method == method)
            .map(|r| (r.cpu_seconds.max(1e-4), r.rel_rmse.max(FLOOR)))
            .collect();
        if points.is_empty() {
            continue;
        }
        let (r, g, b) = COLORS[index];
        let color = RGBColor(r, g, b).to_rgba();
        chart.draw_series(points.iter().map(|&point| Circle::new(point, 4, color.filled())))?;
        chart
            .draw_series(LineSeries::new(points, color.stroke_width(2)))?
            .label(method.name())
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], color.stroke_width(3)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK)
        .draw()?;
    root.present()?;
    Ok(())
}
