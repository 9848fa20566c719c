//! Drawings as SVG: a group a class, that Inkscape shows as layers.

use std::fmt::Write as _;

use glam::DVec2;
use llsr_scene::Viewport;

use super::{FlatLine, Layer};

/// The drawing as a file's text; `title` is shown by browsers.
pub(crate) fn svg(lines: &[FlatLine], viewport: Viewport, title: &str) -> String {
    let Viewport { width, height } = viewport;
    let scale = f64::from(width.min(height)) / 512.0;
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <svg xmlns=\"http://www.w3.org/2000/svg\" \
         xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
         width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n\
         <title>{}</title>\n<style>\n\
         path {{ fill: none; stroke-linecap: round; stroke-linejoin: round }}\n",
        escaped(title)
    );
    for layer in Layer::ALL {
        let ([r, g, b], width) = layer.style();
        let name = layer.name();
        let _ = writeln!(
            text,
            ".{name} {{ stroke: #{r:02x}{g:02x}{b:02x}; stroke-width: {:.3} }}",
            width * scale
        );
    }
    let _ = writeln!(
        text,
        ".hidden {{ stroke-dasharray: {:.3} {:.3}; stroke-opacity: 0.5 }}\n</style>",
        3.0 * scale,
        3.0 * scale
    );
    if lines.iter().any(|line| line.hidden) {
        open(&mut text, "hidden", "hidden", "hidden parts");
        for layer in Layer::ALL {
            let name = layer.name();
            let (id, label) = (format!("hidden-{name}"), format!("hidden {}", layer.label()));
            group(&mut text, lines, layer, true, (&id, &label));
        }
        text.push_str("</g>\n");
    }
    for layer in Layer::ALL {
        group(&mut text, lines, layer, false, (layer.name(), layer.label()));
    }
    text.push_str("</svg>\n");
    text
}

fn open(text: &mut String, id: &str, class: &str, label: &str) {
    let _ = writeln!(
        text,
        "<g id=\"{id}\" class=\"{class}\" inkscape:groupmode=\"layer\" inkscape:label=\"{label}\">"
    );
}

/// The lines of one layer, if there are any.
fn group(text: &mut String, lines: &[FlatLine], layer: Layer, hidden: bool, (id, label): (&str, &str)) {
    let mut of_layer = lines
        .iter()
        .filter(|line| line.layer == layer && line.hidden == hidden)
        .peekable();
    if of_layer.peek().is_none() {
        return;
    }
    open(text, id, layer.name(), label);
    for line in of_layer {
        text.push_str("<path d=\"");
        let mut before = None;
        for (i, &point) in line.points.iter().enumerate() {
            let place = number_pair(point);
            if before.as_ref() != Some(&place) {
                let _ = write!(text, "{}{place}", if i == 0 { 'M' } else { 'L' });
                before = Some(place);
            }
        }
        text.push_str(if line.closed { "Z\"/>\n" } else { "\"/>\n" });
    }
    text.push_str("</g>\n");
}

/// To a hundredth of a pixel, without trailing zeros.
fn number_pair(point: DVec2) -> String {
    let number = |x: f64| {
        let text = format!("{x:.2}");
        let short = text.trim_end_matches('0').trim_end_matches('.');
        if short == "-0" {
            "0".to_owned()
        } else {
            short.to_owned()
        }
    };
    format!("{} {}", number(point.x), number(point.y))
}

fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            // XML has no other control characters.
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_groups_and_numbers_are_short() {
        let line = |layer, hidden, closed| FlatLine {
            layer,
            hidden,
            closed,
            points: vec![
                DVec2::new(1.0, 2.5),
                DVec2::new(3.25, -0.001),
                DVec2::new(7.125, 100.0),
            ],
        };
        let lines = [
            line(Layer::Silhouette, false, true),
            line(Layer::Crease, true, false),
        ];
        let viewport = Viewport {
            width: 512,
            height: 512,
        };
        let text = svg(&lines, viewport, "a<b&c");
        assert!(text.contains("<title>a&lt;b&amp;c</title>"), "{text}");
        assert!(text.contains("<path d=\"M1 2.5L3.25 0L7.12 100Z\"/>"), "{text}");
        let place = |what: &str| text.find(what).unwrap_or_else(|| panic!("{what} in {text}"));
        assert!(
            place("id=\"hidden-crease\"") < place("id=\"silhouette\""),
            "hidden parts lie below"
        );
        assert!(
            !text.contains("id=\"umbral\""),
            "layers without lines are left out"
        );
        assert_eq!(
            text.matches("<g ").count(),
            text.matches("</g>").count(),
            "{text}"
        );
    }
}
