//! Edges made ready for rasterising: clipped, projected, snapped to a grid.

use glam::{Mat4, Vec2, Vec3, Vec4};

/// Grid of the snapped ends, in units to a pixel.
pub(crate) const UNITS: i32 = 256;
/// Width in pixels of the frame round the picture to which edges are clipped.
///
/// It is wide enough for clipping and snapping to leave every crossing in the picture where it was.
const FRAME: f64 = 2.0;
/// Depth key of an edge whose depth is not known: in front of everything.
const NEAREST: f32 = -1e30;

/// A straight piece of an edge on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenSegment {
    /// One end, in pixels from the top left corner of the picture, y downwards.
    pub a: Vec2,
    /// The other end.
    pub b: Vec2,
    /// Distance of `a` from the eye along the view axis (the w of clip space), positive; anything else means
    /// "not known" and is never found to be hidden.
    pub depth_a: f32,
    /// The same for `b`.
    pub depth_b: f32,
}

/// Edges clipped to the picture and snapped to 1/256 of a pixel, as a structure of arrays.
///
/// Two edges that end in the same point still do after snapping, so a closed outline stays closed. Keep one list and refill it:
/// [`clear`](Self::clear) keeps the memory.
///
/// ```
/// use glam::Vec3;
/// use glam::camera::rh;
///
/// let view = rh::view::look_at_mat4(Vec3::new(0.0, 1.0, 5.0), Vec3::ZERO, Vec3::Y);
/// let projection = rh::proj::directx::perspective(0.8, 4.0 / 3.0, 0.1, 100.0);
/// let mut edges = llsr_epi::EdgeList::new(640, 480);
/// edges.extend_world(&(projection * view), &[[Vec3::NEG_X, Vec3::X], [Vec3::Z, Vec3::Z * 9.0]]);
/// assert_eq!(edges.len(), 2); // the second runs through the plane of the camera and is cut in front of it
/// ```
#[derive(Clone, Debug, Default)]
pub struct EdgeList {
    width: u32,
    height: u32,
    pub(crate) x0: Vec<i32>,
    pub(crate) y0: Vec<i32>,
    pub(crate) x1: Vec<i32>,
    pub(crate) y1: Vec<i32>,
    /// Depth keys of the ends: -1 / depth, which grows with the depth and is linear on the screen.
    pub(crate) key0: Vec<f32>,
    pub(crate) key1: Vec<f32>,
}

impl EdgeList {
    /// An empty list for pictures of the given size in pixels.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            ..Self::default()
        }
    }

    /// Size of the picture in pixels: width, height.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Drops all edges and keeps the memory.
    pub fn clear(&mut self) {
        for array in [&mut self.x0, &mut self.y0, &mut self.x1, &mut self.y1] {
            array.clear();
        }
        self.key0.clear();
        self.key1.clear();
    }

    /// Number of edges kept: those with a part in or next to the picture.
    pub fn len(&self) -> usize {
        self.x0.len()
    }

    /// True if no edge was kept.
    pub fn is_empty(&self) -> bool {
        self.x0.is_empty()
    }

    /// Adds a projected edge; parts outside the picture are cut off, one that is not finite is left out.
    pub fn push(&mut self, segment: ScreenSegment) {
        let (a, b) = (segment.a.as_dvec2(), segment.b.as_dvec2());
        if !(a.is_finite() && b.is_finite()) {
            return;
        }
        let (key_a, key_b) = (depth_key(segment.depth_a), depth_key(segment.depth_b));
        let (key_a, key_b) = if key_a.min(key_b) <= NEAREST {
            (NEAREST, NEAREST)
        } else {
            (key_a, key_b)
        };
        let (far_x, far_y) = (f64::from(self.width) + FRAME, f64::from(self.height) + FRAME);
        let planes = [
            (a.x + FRAME, b.x + FRAME),
            (far_x - a.x, far_x - b.x),
            (a.y + FRAME, b.y + FRAME),
            (far_y - a.y, far_y - b.y),
        ];
        let Some((from, to)) = inside(&planes) else { return };
        let at = |t: f64| a + (b - a) * t;
        let key_at = |t: f64| key_a + (key_b - key_a) * t as f32;
        self.push_snapped(at(from).to_array(), at(to).to_array(), key_at(from), key_at(to));
    }

    /// Adds many projected edges.
    pub fn extend(&mut self, segments: &[ScreenSegment]) {
        self.reserve(segments.len());
        for &segment in segments {
            self.push(segment);
        }
    }

    /// Projects and adds edges given in world space.
    ///
    /// `view_projection` maps to clip space with x to the right, y upwards and w the distance along the view axis, as
    /// glam's and most other perspective matrices do; z is not looked at, so neither near nor far plane cuts
    /// anything. Clipping happens in homogeneous coordinates: what is behind the eye goes, what runs through the camera's
    /// plane keeps its part in front. (An orthographic matrix works too, but has w = 1 everywhere: no edge is found to be hidden.)
    pub fn extend_world(&mut self, view_projection: &Mat4, segments: &[[Vec3; 2]]) {
        self.reserve(segments.len());
        let width = f64::from(self.width);
        let height = f64::from(self.height);
        let (frame_x, frame_y) = (
            (1.0 + 2.0 * FRAME / width) as f32,
            (1.0 + 2.0 * FRAME / height) as f32,
        );
        let in_frame = |c: Vec4| c.x.abs() <= frame_x * c.w && c.y.abs() <= frame_y * c.w && c.w > 0.0;
        for &[a, b] in segments {
            let (a, b) = (*view_projection * a.extend(1.0), *view_projection * b.extend(1.0));
            if in_frame(a) && in_frame(b) {
                let (key_a, key_b) = (depth_key(a.w), depth_key(b.w));
                self.push_snapped(self.screen(a), self.screen(b), key_a, key_b);
            } else {
                self.push_clipped(a, b, f64::from(frame_x), f64::from(frame_y));
            }
        }
    }

    fn reserve(&mut self, count: usize) {
        for array in [&mut self.x0, &mut self.y0, &mut self.x1, &mut self.y1] {
            array.reserve(count);
        }
        self.key0.reserve(count);
        self.key1.reserve(count);
    }

    /// Position in pixels of a point in clip space with w > 0.
    fn screen(&self, c: Vec4) -> [f64; 2] {
        let (x, y, w) = (f64::from(c.x), f64::from(c.y), f64::from(c.w));
        [
            (x / w + 1.0) * 0.5 * f64::from(self.width),
            (1.0 - y / w) * 0.5 * f64::from(self.height),
        ]
    }

    /// Cuts an edge to the pyramid of the frame; the sides of the pyramid leave w >= 0.
    #[cold]
    fn push_clipped(&mut self, a: Vec4, b: Vec4, frame_x: f64, frame_y: f64) {
        if !(a.is_finite() && b.is_finite()) {
            return;
        }
        let (a, b) = (a.as_dvec4(), b.as_dvec4());
        let planes = [
            (frame_x * a.w + a.x, frame_x * b.w + b.x),
            (frame_x * a.w - a.x, frame_x * b.w - b.x),
            (frame_y * a.w + a.y, frame_y * b.w + b.y),
            (frame_y * a.w - a.y, frame_y * b.w - b.y),
        ];
        let Some((from, to)) = inside(&planes) else { return };
        let ends = [from, to].map(|t| a + (b - a) * t);
        // Only a line through the eye itself can get here with w = 0: it shows as a point.
        if !(ends[0].w > 0.0 && ends[1].w > 0.0) {
            return;
        }
        let screen = ends.map(|c| {
            // Within the frame up to rounding; far outside only where w is next to nothing.
            let x = (c.x / c.w).clamp(-frame_x, frame_x);
            let y = (c.y / c.w).clamp(-frame_y, frame_y);
            [
                (x + 1.0) * 0.5 * f64::from(self.width),
                (1.0 - y) * 0.5 * f64::from(self.height),
            ]
        });
        let keys = ends.map(|c| depth_key(c.w as f32));
        self.push_snapped(screen[0], screen[1], keys[0], keys[1]);
    }

    /// Adds an edge whose ends lie in the frame.
    fn push_snapped(&mut self, a: [f64; 2], b: [f64; 2], key_a: f32, key_b: f32) {
        let snap = |v: f64| (v * f64::from(UNITS)).round() as i32;
        self.x0.push(snap(a[0]));
        self.y0.push(snap(a[1]));
        self.x1.push(snap(b[0]));
        self.y1.push(snap(b[1]));
        self.key0.push(key_a);
        self.key1.push(key_b);
    }
}

/// -1 / depth; [`NEAREST`] if the depth is not positive or not a number.
fn depth_key(depth: f32) -> f32 {
    if depth > 0.0 {
        (-1.0 / depth).max(NEAREST)
    } else {
        NEAREST
    }
}

/// The part [from, to] of [0, 1] where all linear functions, given by their values at 0 and 1, are not negative.
fn inside(functions: &[(f64, f64)]) -> Option<(f64, f64)> {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for &(start, end) in functions {
        match (start < 0.0, end < 0.0) {
            (true, true) => return None,
            (true, false) => from = from.max(start / (start - end)),
            (false, true) => to = to.min(start / (start - end)),
            (false, false) => {}
        }
    }
    (from <= to).then_some((from, to))
}
