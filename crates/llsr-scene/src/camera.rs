//! Cameras and their projection.

use glam::{DMat3, DVec3, Mat4, Vec3};

/// Size of a picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Viewport {
    /// Width, at least 1.
    pub width: u32,
    /// Height, at least 1.
    pub height: u32,
}

impl Viewport {
    /// Width over height.
    pub fn aspect(self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }

    /// Number of pixels.
    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// An opening angle in radians, in (0, π), and the side of the picture that it spans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldOfView {
    /// From the lower to the upper border.
    Vertical(f64),
    /// From the left to the right border.
    Horizontal(f64),
}

impl FieldOfView {
    /// A vertical angle in degrees.
    pub fn vertical_degrees(degrees: f64) -> Self {
        Self::Vertical(degrees.to_radians())
    }

    /// A horizontal angle in degrees.
    pub fn horizontal_degrees(degrees: f64) -> Self {
        Self::Horizontal(degrees.to_radians())
    }
}

/// How directions map to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All rays through the camera's position.
    Perspective(FieldOfView),
    /// Parallel rays; the full height of the picture in metres.
    Orthographic {
        /// Height of the picture (m), positive.
        height: f64,
    },
}

/// A camera: right, up and backward axes are the columns of its rotation.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name in the file; may be empty.
    pub name: String,
    /// Position in the scene's recentred frame (m).
    pub position: DVec3,
    /// Orthonormal axes: x to the right, y up, z towards the viewer (the camera looks along -z).
    pub axes: DMat3,
    /// Projection.
    pub projection: Projection,
}

impl Camera {
    /// How far from the middle of the scene a camera may stand (m) where it comes from outside: as far as loaders take geometry. The
    /// squares of larger distances come to no sensible number sooner or later.
    pub const FARTHEST: f64 = 1e15;

    /// A perspective camera at `eye` that looks at `target`.
    ///
    /// Where `up` is (nearly) parallel to the viewing direction another axis takes its place, and a `target` at
    /// `eye` means looking along -z.
    pub fn look_at(
        name: impl Into<String>,
        eye: DVec3,
        target: DVec3,
        up: DVec3,
        field_of_view: FieldOfView,
    ) -> Self {
        let backward = (eye - target).try_normalize().unwrap_or(DVec3::Z);
        let mut right = up.normalize_or_zero().cross(backward);
        if right.length() < 1e-6 {
            right = backward.any_orthogonal_vector();
        }
        let right = right.normalize();
        let axes = DMat3::from_cols(right, backward.cross(right), backward);
        Self {
            name: name.into(),
            position: eye,
            axes,
            projection: Projection::Perspective(field_of_view),
        }
    }

    /// Unit direction that the camera looks along.
    pub fn forward(&self) -> DVec3 {
        -self.axes.z_axis
    }

    /// Half the width and half the height of the picture, one metre ahead (perspective) or in metres.
    pub fn half_extent(&self, viewport: Viewport) -> (f64, f64) {
        let aspect = viewport.aspect();
        match self.projection {
            Projection::Perspective(FieldOfView::Vertical(angle)) => {
                let y = (0.5 * angle).tan();
                (y * aspect, y)
            }
            Projection::Perspective(FieldOfView::Horizontal(angle)) => {
                let x = (0.5 * angle).tan();
                (x, x / aspect)
            }
            Projection::Orthographic { height } => (0.5 * height * aspect, 0.5 * height),
        }
    }

    /// The vertical opening angle in radians for a picture of that shape; `None` for parallel rays.
    pub fn vertical_field_of_view(&self, viewport: Viewport) -> Option<f64> {
        match self.projection {
            Projection::Perspective(_) => Some(2.0 * self.half_extent(viewport).1.atan()),
            Projection::Orthographic { .. } => None,
        }
    }

    /// Origin and unit direction of the ray through picture position (`x`, `y`) in pixels; (0, 0) is the upper
    /// left corner and (0.5, 0.5) the centre of the first pixel.
    ///
    /// Rays of an orthographic camera start in the plane of its position. For many rays prepare [`rays`](Self::rays).
    pub fn ray(&self, viewport: Viewport, x: f64, y: f64) -> (DVec3, DVec3) {
        self.rays(viewport).ray(x, y)
    }

    /// The rays of a picture, prepared.
    pub fn rays(&self, viewport: Viewport) -> CameraRays {
        CameraRays {
            position: self.position,
            axes: self.axes,
            half: self.half_extent(viewport),
            size: (f64::from(viewport.width), f64::from(viewport.height)),
            perspective: matches!(self.projection, Projection::Perspective(_)),
        }
    }

    /// Maps the recentred frame to clip space: x and y in [-w, w] inside the picture, y up, and z = `near` / w
    /// (perspective, reversed and without a far plane) or 1 (orthographic).
    pub fn view_projection(&self, viewport: Viewport, near: f32) -> Mat4 {
        let (half_x, half_y) = self.half_extent(viewport);
        let rotation = Mat4::from_mat3(self.axes.transpose().as_mat3());
        let view = rotation * Mat4::from_translation(-self.position.as_vec3());
        let (sx, sy) = ((1.0 / half_x) as f32, (1.0 / half_y) as f32);
        let projection = match self.projection {
            Projection::Perspective(_) => Mat4::from_cols(
                glam::Vec4::new(sx, 0.0, 0.0, 0.0),
                glam::Vec4::new(0.0, sy, 0.0, 0.0),
                glam::Vec4::new(0.0, 0.0, 0.0, -1.0),
                glam::Vec4::new(0.0, 0.0, near, 0.0),
            ),
            Projection::Orthographic { .. } => Mat4::from_cols(
                glam::Vec4::new(sx, 0.0, 0.0, 0.0),
                glam::Vec4::new(0.0, sy, 0.0, 0.0),
                glam::Vec4::ZERO,
                glam::Vec4::new(0.0, 0.0, 1.0, 1.0),
            ),
        };
        projection * view
    }

    /// Picture position (pixels) and distance along the viewing direction (m) of a point; `None` behind a
    /// perspective camera.
    pub fn project(&self, viewport: Viewport, point: DVec3) -> Option<(f64, f64, f64)> {
        let local = self.axes.transpose() * (point - self.position);
        let depth = -local.z;
        let scale = match self.projection {
            Projection::Perspective(_) if depth <= 0.0 => return None,
            Projection::Perspective(_) => depth,
            Projection::Orthographic { .. } => 1.0,
        };
        let (half_x, half_y) = self.half_extent(viewport);
        let x = (local.x / (scale * half_x) + 1.0) * 0.5 * f64::from(viewport.width);
        let y = (1.0 - local.y / (scale * half_y)) * 0.5 * f64::from(viewport.height);
        Some((x, y, depth))
    }

    /// A camera from direction (1, 0.6, 1) whose picture's shorter side holds 90% around the bounding sphere.
    pub fn outside(center: Vec3, radius: f32, viewport: Viewport) -> Self {
        let angle = 40f64.to_radians();
        let aspect = viewport.aspect();
        let half = if aspect >= 1.0 {
            0.5 * angle
        } else {
            ((0.5 * angle).tan() * aspect).atan()
        };
        let distance = f64::from(radius.max(f32::MIN_POSITIVE)) / (0.9 * half.tan()).atan().sin();
        let center = center.as_dvec3();
        let eye = center + DVec3::new(1.0, 0.6, 1.0).normalize() * distance;
        Self::look_at("outside", eye, center, DVec3::Y, FieldOfView::Vertical(angle))
    }
}

/// The rays of a camera through a picture of a given size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRays {
    position: DVec3,
    axes: DMat3,
    half: (f64, f64),
    size: (f64, f64),
    perspective: bool,
}

impl CameraRays {
    /// Origin and unit direction of the ray through a picture position, as [`Camera::ray`] has them.
    #[inline]
    pub fn ray(&self, x: f64, y: f64) -> (DVec3, DVec3) {
        let u = (2.0 * x / self.size.0 - 1.0) * self.half.0;
        let v = (1.0 - 2.0 * y / self.size.1) * self.half.1;
        if self.perspective {
            (self.position, (self.axes * DVec3::new(u, v, -1.0)).normalize())
        } else {
            (
                self.position + self.axes * DVec3::new(u, v, 0.0),
                -self.axes.z_axis,
            )
        }
    }

    /// The point that all rays start from; `None` for parallel rays.
    pub fn eye(&self) -> Option<DVec3> {
        self.perspective.then_some(self.position)
    }
}
