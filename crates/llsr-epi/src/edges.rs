//! Edges made ready for rasterising: clipped, projected, snapped to a grid.

use glam::{Mat4, Vec2, Vec3, Vec4};

use crate::simd;

/// Grid of the snapped ends, in units to a pixel.
pub(crate) const UNITS: i32 = 256;
/// Width in pixels of the frame round the picture to which edges are clipped.
///
/// It is wide enough for clipping and snapping to leave every crossing in the picture where it was.
pub(crate) const FRAME: i32 = 2;
/// Added to a number of grid units it leaves the nearest integer in the low bits: at this size one unit in the last place of an
/// f64 is 1.
pub(crate) const ROUND: f64 = (3u64 << 51) as f64;
/// Depth key of an edge whose depth is not known: in front of everything.
pub(crate) const NEAREST: f32 = -1e30;

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
    /// x and y of one end, x and y of the other, in grid units.
    pub(crate) ends: Vec<[i32; 4]>,
    /// Depth keys of the ends: -1 / depth, which grows with the depth and is linear on the screen.
    pub(crate) keys: Vec<[f32; 2]>,
    /// Number of edges that cross no line and so are not listed: wholly between two neighbouring half-pixel lines of either kind.
    pub(crate) between: usize,
}

/// The bits of a coordinate in grid units that tell between which half-pixel lines it lies.
pub(crate) const LINE_BITS: i32 = -(UNITS / 2);

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
        self.ends.clear();
        self.keys.clear();
        self.between = 0;
    }

    /// Number of edges kept: those with a part in or next to the picture.
    pub fn len(&self) -> usize {
        self.ends.len() + self.between
    }

    /// True if no edge was kept.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds a projected edge; parts outside the picture are cut off, one that is not finite is left out.
    #[inline]
    pub fn push(&mut self, segment: ScreenSegment) {
        let ScreenSegment {
            a,
            b,
            depth_a,
            depth_b,
        } = segment;
        let frame = FRAME as f32;
        let (far_x, far_y) = (self.width as f32 + frame, self.height as f32 + frame);
        let in_frame = |p: Vec2| p.x >= -frame && p.y >= -frame && p.x <= far_x && p.y <= far_y;
        let (a64, b64) = (a.as_dvec2().to_array(), b.as_dvec2().to_array());
        if in_frame(a) && in_frame(b) {
            self.push_snapped(a64, b64, keys(depth_a, depth_b));
        } else if a.is_finite() && b.is_finite() {
            self.push_cut(a64, b64, keys(depth_a, depth_b));
        }
    }

    /// Cuts an edge to the frame.
    #[cold]
    fn push_cut(&mut self, a: [f64; 2], b: [f64; 2], [key_a, key_b]: [f32; 2]) {
        let frame = f64::from(FRAME);
        let (far_x, far_y) = (f64::from(self.width) + frame, f64::from(self.height) + frame);
        let planes = [
            (a[0] + frame, b[0] + frame),
            (far_x - a[0], far_x - b[0]),
            (a[1] + frame, b[1] + frame),
            (far_y - a[1], far_y - b[1]),
        ];
        let Some((from, to)) = inside(&planes) else { return };
        // Up to rounding in the frame; lines from far away are only as exact as f64.
        let at = |t: f64| {
            let [x, y] = [0, 1].map(|i| a[i] + (b[i] - a[i]) * t);
            [x.clamp(-frame, far_x), y.clamp(-frame, far_y)]
        };
        let key_at = |t: f64| key_a + (key_b - key_a) * t as f32;
        self.push_snapped(at(from), at(to), [key_at(from), key_at(to)]);
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
        let [width, height] = [self.width, self.height].map(f64::from);
        let frame = [width, height].map(|size| (1.0 + 2.0 * f64::from(FRAME) / size) as f32);
        let plain = |list: &mut Self, segment| list.push_world(view_projection, frame, segment);
        let done = simd::extend_world(self, view_projection, frame, segments, plain);
        for &segment in &segments[done..] {
            self.push_world(view_projection, frame, segment);
        }
    }

    /// The plain form for one edge; `frame` is half the size of the frame in clip space.
    fn push_world(&mut self, view_projection: &Mat4, frame: [f32; 2], segment: [Vec3; 2]) {
        let [frame_x, frame_y] = frame;
        let in_frame = |c: Vec4| c.x.abs() <= frame_x * c.w && c.y.abs() <= frame_y * c.w && c.w > 0.0;
        let [a, b] = segment.map(|p| *view_projection * p.extend(1.0));
        if in_frame(a) && in_frame(b) {
            self.push_snapped(self.screen(a), self.screen(b), keys(a.w, b.w));
        } else {
            self.push_clipped(a, b, f64::from(frame_x), f64::from(frame_y));
        }
    }

    fn reserve(&mut self, count: usize) {
        self.ends.reserve(count);
        self.keys.reserve(count);
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
        self.push_snapped(screen[0], screen[1], keys(ends[0].w as f32, ends[1].w as f32));
    }

    /// Adds an edge whose ends lie in the frame.
    #[inline]
    fn push_snapped(&mut self, a: [f64; 2], b: [f64; 2], keys: [f32; 2]) {
        let [x0, y0, x1, y1] = [snap(a[0]), snap(a[1]), snap(b[0]), snap(b[1])];
        if (x0 ^ x1 | y0 ^ y1) & LINE_BITS == 0 {
            self.between += 1;
            return;
        }
        self.ends.push([x0, y0, x1, y1]);
        self.keys.push(keys);
    }
}

/// Pixels to grid units, to the nearest, for numbers below 2^31 / 256.
#[inline]
fn snap(pixels: f64) -> i32 {
    (pixels * f64::from(UNITS) + ROUND).to_bits() as i32
}

/// The depth keys of an edge; both [`NEAREST`] if one is.
#[inline]
fn keys(depth_a: f32, depth_b: f32) -> [f32; 2] {
    if depth_a > 0.0 && depth_b > 0.0 {
        [-1.0 / depth_a, -1.0 / depth_b].map(|key| key.max(NEAREST))
    } else {
        [NEAREST; 2]
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
