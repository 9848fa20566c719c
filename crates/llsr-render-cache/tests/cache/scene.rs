//! Cameras and points for the tests.

use glam::{DMat4, DVec3, Mat4, Vec3};
use llsr_render_cache::{DepthFilter, Point, PointImage, PointStore, Replacement, View};

/// Numbers from a linear congruential sequence.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Uniform in [0, 1).
    pub(crate) fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    pub(crate) fn below(&mut self, end: u32) -> u32 {
        (self.next() * end as f32) as u32
    }
}

/// 90 degrees wide and high, reversed depth: clip = (x, y, near, depth), from `eye` along -z turned by `turn` to the left.
pub(crate) fn matrix(eye: Vec3, turn: f32) -> Mat4 {
    let projection = Mat4::from_cols_array_2d(&[
        [1., 0., 0., 0.],
        [0., 1., 0., 0.],
        [0., 0., 0., -1.],
        [0., 0., 0.1, 0.],
    ]);
    projection * Mat4::from_rotation_y(-turn) * Mat4::from_translation(-eye)
}

pub(crate) fn view(width: u32, height: u32) -> View {
    View::new(&matrix(Vec3::ZERO, 0.0), width, height).expect("size")
}

/// The position that falls to (`x`, `y`) in pixels at `depth` in [`view`].
pub(crate) fn position(width: u32, height: u32, x: f32, y: f32, depth: f32) -> Vec3 {
    let (u, v) = (2.0 * x / width as f32 - 1.0, 1.0 - 2.0 * y / height as f32);
    Vec3::new(u * depth, v * depth, -depth)
}

pub(crate) fn point(position: Vec3, object: u32) -> Point {
    Point {
        position,
        colour: Vec3::new(1.0, 0.5, 0.25),
        surface: 0,
        object,
        lights: 1,
    }
}

/// Stores a point without a picture: it takes a free slot.
pub(crate) fn put(store: &mut PointStore, point: &Point) -> u32 {
    let blank = PointImage::new(1, 1).expect("size");
    store
        .insert(point, &blank, &Replacement::default())
        .expect("a finite position")
        .slot
}

/// No filter.
pub(crate) const OFF: DepthFilter = DepthFilter {
    reach: 0,
    tolerance: 0.0,
    fresh: 0,
};

/// Where a point falls, in quarter pixels and depth, by double precision.
pub(crate) fn project_slowly(
    matrix: &Mat4,
    width: u32,
    height: u32,
    position: Vec3,
) -> Option<(f64, f64, f64)> {
    let m: DMat4 = matrix.as_dmat4();
    let p: DVec3 = position.as_dvec3();
    let clip = m * p.extend(1.0);
    if clip.w <= 0.0 {
        return None;
    }
    let x = (clip.x / clip.w + 1.0) * 2.0 * f64::from(width);
    let y = (1.0 - clip.y / clip.w) * 2.0 * f64::from(height);
    Some((x, y, clip.w))
}
