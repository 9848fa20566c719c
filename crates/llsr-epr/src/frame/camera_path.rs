//! Paths of cameras: made, read and written.

use glam::DVec3;
use llsr_scene::{Camera, FieldOfView, Viewport};

/// First line of a path file.
const HEADER: &str = "# llsr camera path 1";
/// Steps a second that a path is meant for.
const RATE: f64 = 30.0;
/// Most steps that a file may have: 9 hours.
const MOST_STEPS: usize = 1_000_000;

/// Cameras, one a frame, 30 a second.
///
/// As text it is one line a frame: position (m), direction of view and upward direction, three numbers each, and the
/// vertical opening angle in degrees, separated by spaces, in the frame of the scene's file. Empty lines and those that start with `#` are comments.
///
/// ```
/// use glam::DVec3;
/// use llsr_epr::CameraPath;
///
/// let path = CameraPath::parse("# llsr camera path 1\n0 1.6 4  0 0 -1  0 1 0  60\n0 1.6 3.9  0 0 -1  0 1 0  60\n", DVec3::ZERO)?;
/// assert_eq!(path.cameras.len(), 2);
/// assert_eq!(path.cameras[1].position, DVec3::new(0.0, 1.6, 3.9));
/// # Ok::<(), llsr_epr::CameraPathError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraPath {
    /// The cameras, in the scene's recentred frame.
    pub cameras: Vec<Camera>,
}

/// Why a text is no path: its line (from 1) and what is wrong there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraPathError {
    /// Line, from 1; 0 for the text as a whole.
    pub line: usize,
    /// What is wrong.
    pub problem: String,
}

impl std::fmt::Display for CameraPathError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            0 => f.write_str(&self.problem),
            line => write!(f, "line {line}: {}", self.problem),
        }
    }
}

impl std::error::Error for CameraPathError {}

impl CameraPath {
    /// Straight on from `camera` while turning to the left: `speed` metres and `degrees` a frame, for `frames` frames.
    pub fn walk(camera: &Camera, frames: usize, speed: f64, degrees: f64) -> Self {
        // Walking does not climb: forward is along the ground where the camera does not look straight down.
        let forward = camera.forward();
        let level = DVec3::new(forward.x, 0.0, forward.z)
            .try_normalize()
            .unwrap_or(forward);
        let cameras = (0..frames).map(|frame| {
            let frame = frame as f64;
            let turn = glam::DMat3::from_rotation_y((degrees * frame).to_radians());
            Camera {
                position: camera.position + level * (speed * frame),
                axes: turn * camera.axes,
                ..camera.clone()
            }
        });
        Self {
            cameras: cameras.collect(),
        }
    }

    /// The default walk through a scene whose bounds have the given diagonal (m): 1.4 m/s, or 0.5% of the diagonal a frame
    /// if that is less, and 20 degrees a second.
    pub fn default_walk(camera: &Camera, frames: usize, diagonal: f64) -> Self {
        Self::walk(camera, frames, (1.4 / RATE).min(0.005 * diagonal), 20.0 / RATE)
    }

    /// Reads a path; `origin` is [`Scene::origin`](llsr_scene::Scene::origin).
    ///
    /// # Errors
    /// A line without ten finite numbers, a position farther than [`Camera::FARTHEST`] from the scene, a direction without length, an angle that is not above 0 and below 180, a text without
    /// cameras or with more than a million.
    pub fn parse(text: &str, origin: DVec3) -> Result<Self, CameraPathError> {
        let mut cameras = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let line_number = index + 1;
            let failed = |problem: String| CameraPathError {
                line: line_number,
                problem,
            };
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            if cameras.len() == MOST_STEPS {
                return Err(failed(format!("a path has at most {MOST_STEPS} cameras")));
            }
            cameras.push(parse_line(line, origin).map_err(failed)?);
        }
        if cameras.is_empty() {
            return Err(CameraPathError {
                line: 0,
                problem: "there is no camera in it".to_owned(),
            });
        }
        Ok(Self { cameras })
    }

    /// Writes a path; [`parse`](Self::parse) with the same `origin` gives the same cameras, up to rounding. An orthographic
    /// camera becomes a perspective one of 45 degrees.
    pub fn to_text(&self, viewport: Viewport, origin: DVec3) -> String {
        use std::fmt::Write as _;
        let mut text = format!(
            "{HEADER}\n# one line a frame, {RATE} a second: position (m), direction, up, vertical opening angle (degrees)\n"
        );
        for camera in &self.cameras {
            let degrees = camera
                .vertical_field_of_view(viewport)
                .map_or(45.0, f64::to_degrees);
            for v in [camera.position + origin, camera.forward(), camera.axes.y_axis] {
                let _ = write!(text, "{} {} {}  ", v.x, v.y, v.z);
            }
            let _ = writeln!(text, "{degrees}");
        }
        text
    }
}

fn parse_line(line: &str, origin: DVec3) -> Result<Camera, String> {
    let mut numbers = [0.0; 10];
    let mut words = line.split_whitespace();
    for (i, number) in numbers.iter_mut().enumerate() {
        let word = words.next().ok_or_else(|| {
            format!("{i} numbers where 10 are needed: position, direction, up, opening angle")
        })?;
        *number = match word.parse::<f64>() {
            Ok(value) if value.is_finite() => value,
            _ => return Err(format!("'{word}' is not a finite number")),
        };
    }
    if words.next().is_some() {
        return Err("more than 10 numbers".to_owned());
    }
    let [px, py, pz, fx, fy, fz, ux, uy, uz, degrees] = numbers;
    let forward = DVec3::new(fx, fy, fz)
        .try_normalize()
        .ok_or("the direction has no length")?;
    let up = DVec3::new(ux, uy, uz)
        .try_normalize()
        .ok_or("the upward direction has no length")?;
    if !(degrees > 0.0 && degrees < 180.0) {
        return Err(format!(
            "an opening angle of {degrees} degrees; it lies above 0 and below 180"
        ));
    }
    let eye = DVec3::new(px, py, pz) - origin;
    if eye.abs().max_element() > Camera::FARTHEST {
        return Err(format!(
            "the position is more than {:e} m away from the scene",
            Camera::FARTHEST
        ));
    }
    Ok(Camera::look_at(
        "path",
        eye,
        eye + forward,
        up,
        FieldOfView::vertical_degrees(degrees),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEWPORT: Viewport = Viewport {
        width: 64,
        height: 48,
    };

    #[test]
    fn a_walk_survives_being_written() {
        let start = Camera::look_at(
            "start",
            DVec3::new(1.0, 1.5, 2.0),
            DVec3::new(0.0, 1.0, 0.0),
            DVec3::Y,
            FieldOfView::horizontal_degrees(70.0),
        );
        let path = CameraPath::default_walk(&start, 20, 100.0);
        assert!(
            (path.cameras[0].position - start.position).length() < 1e-12,
            "begins there"
        );
        let step = path.cameras[1].position - path.cameras[0].position;
        assert!(
            (step.length() - 1.4 / 30.0).abs() < 1e-9 && step.y == 0.0,
            "{step}"
        );
        let angle = path.cameras[18]
            .forward()
            .angle_between(path.cameras[0].forward());
        assert!(angle > 0.15 && angle < 12f64.to_radians(), "{angle}");
        let origin = DVec3::new(1000.0, 0.0, -5.0);
        let again = CameraPath::parse(&path.to_text(VIEWPORT, origin), origin).expect("a path");
        assert_eq!(again.cameras.len(), 20, "all of them");
        for (a, b) in path.cameras.iter().zip(&again.cameras) {
            let difference =
                (a.view_projection(VIEWPORT, 0.1) - b.view_projection(VIEWPORT, 0.1)).to_cols_array();
            let largest = difference.into_iter().fold(0.0f32, |m, v| m.max(v.abs()));
            assert!(largest < 1e-5, "{largest}");
        }
    }

    #[test]
    fn a_small_scene_is_walked_slowly() {
        let start = Camera::outside(glam::Vec3::ZERO, 0.1, VIEWPORT);
        let path = CameraPath::default_walk(&start, 2, 0.2);
        let step = path.cameras[1].position.distance(path.cameras[0].position);
        assert!((step - 0.001).abs() < 1e-9, "{step}");
    }

    #[test]
    fn wrong_lines_are_named() {
        let good = "0 0 0  0 0 -1  0 1 0  60\n";
        for (line, problem) in [
            ("1 2 3", "3 numbers"),
            ("0 0 0  0 0 0  0 1 0  60", "direction has no length"),
            ("0 0 0  0 0 -1  0 0 0  60", "upward direction"),
            ("0 0 0  0 0 -1  0 1 0  180", "180 degrees"),
            ("0 0 0  0 0 -1  0 1 nan  60", "'nan'"),
            ("0 0 0  0 0 -1  0 1 0  60 7", "more than 10"),
            ("0 1e300 0  0 0 -1  0 1 0  60", "more than 1e15 m away"),
            ("-1.1e15 0 0  0 0 -1  0 1 0  60", "more than 1e15 m away"),
        ] {
            let error = CameraPath::parse(&format!("# llsr\n{good}\n{line}\n"), DVec3::ZERO).expect_err(line);
            assert_eq!(error.line, 4, "{error}");
            assert!(error.to_string().contains(problem), "{error}");
        }
        let far = CameraPath::parse("9e14 0 0  0 0 -1  0 1 0  60", DVec3::ZERO);
        assert!(far.is_ok(), "{far:?}");
        let empty = CameraPath::parse("# nothing\n", DVec3::ZERO).expect_err("no camera");
        assert_eq!(empty.to_string(), "there is no camera in it");
    }
}
