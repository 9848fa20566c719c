//! Drawings as lines in space: Wavefront OBJ.

use std::collections::HashMap;
use std::fmt::Write as _;

use glam::DVec3;

use super::{DrawnLine, Layer};

/// The drawing as a file's text: `v` lines, and `l` lines in a group a class. `origin` is where the recentred frame lies
/// in the file's frame.
pub(crate) fn obj(lines: &[DrawnLine], origin: DVec3, title: &str) -> String {
    let title: String = title
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    let mut vertices = String::new();
    let mut elements = String::new();
    let mut numbers: HashMap<[u64; 3], usize> = HashMap::new();
    for hidden in [false, true] {
        for layer in Layer::ALL {
            let mut named = false;
            for line in lines
                .iter()
                .filter(|line| line.layer == layer && line.hidden == hidden)
            {
                if !named {
                    let prefix = if hidden { "hidden_" } else { "" };
                    let _ = writeln!(elements, "g {prefix}{}", layer.name());
                    named = true;
                }
                elements.push('l');
                for &point in line
                    .points
                    .iter()
                    .chain(line.points.first().filter(|_| line.closed))
                {
                    let next = numbers.len() + 1;
                    let key = (point + DVec3::ZERO).to_array().map(f64::to_bits);
                    let number = *numbers.entry(key).or_insert(next);
                    if number == next {
                        let p = point + origin;
                        let _ = writeln!(
                            vertices,
                            "v {} {} {}",
                            number_text(p.x),
                            number_text(p.y),
                            number_text(p.z)
                        );
                    }
                    let _ = write!(elements, " {number}");
                }
                elements.push('\n');
            }
        }
    }
    format!("# {title}\n{vertices}{elements}")
}

/// A number that reads back as it is; vertices of a mesh that was not moved are as short as in single precision.
fn number_text(x: f64) -> String {
    let short = x as f32;
    if f64::from(short) == x {
        short.to_string()
    } else {
        x.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_points_are_one_vertex_and_loops_close() {
        let (a, b, c) = (DVec3::ZERO, DVec3::X, DVec3::Y);
        let line = |layer, hidden, closed, points: &[DVec3]| DrawnLine {
            layer,
            hidden,
            closed,
            points: points.to_vec(),
        };
        let lines = [
            line(Layer::Silhouette, false, true, &[a, b, c]),
            line(Layer::Silhouette, true, false, &[c, a]),
        ];
        assert_eq!(
            obj(&lines, DVec3::Z, "two\nlines"),
            "# two lines\nv 0 0 1\nv 1 0 1\nv 0 1 1\ng silhouette\nl 1 2 3 1\ng hidden_silhouette\nl 3 1\n"
        );
    }
}
