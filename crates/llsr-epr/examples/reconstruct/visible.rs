//! Which parts of edges the camera sees.

use glam::{DVec3, Vec2, Vec3};

use crate::View;

/// Pixels that a piece of an edge takes at most.
const PIECE: f32 = 4.0;
/// Depth (m) before which edges are cut off.
const NEAR: f64 = 1e-3;

/// The visible pieces of edges on the screen, at most [`PIECE`] pixels long; rays say every pixel whether an edge is seen.
pub(crate) fn visible(view: &View<'_>, segments: &[[Vec3; 2]]) -> Vec<[Vec2; 2]> {
    let View {
        tracer,
        camera,
        viewport,
        ..
    } = *view;
    let (width, height) = (viewport.width as f32, viewport.height as f32);
    let seen = |p: DVec3| {
        let to = p - camera.position;
        let distance = to.length();
        tracer
            .closest(camera.position, to / distance, 0.995 * distance)
            .is_none()
    };
    let mut out = Vec::new();
    for &[a, b] in segments {
        let (mut a, mut b) = (a.as_dvec3(), b.as_dvec3());
        let depth = |p: DVec3| (p - camera.position).dot(camera.forward());
        let (mut near, mut far) = (depth(a), depth(b));
        if near > far {
            (a, b, near, far) = (b, a, far, near);
        }
        if far <= NEAR {
            continue;
        }
        if near < NEAR {
            a += (b - a) * ((NEAR - near) / (far - near));
            near = NEAR;
        }
        let on_screen = |p: DVec3| {
            camera
                .project(viewport, p)
                .map(|(x, y, _)| Vec2::new(x as f32, y as f32))
        };
        let (Some(p), Some(q)) = (on_screen(a), on_screen(b)) else {
            continue;
        };
        // The part in the picture, with a pixel around it.
        let (mut from, mut to) = (0.0f32, 1.0f32);
        for (start, end) in [
            (p.x + 1.0, q.x + 1.0),
            (width + 1.0 - p.x, width + 1.0 - q.x),
            (p.y + 1.0, q.y + 1.0),
            (height + 1.0 - p.y, height + 1.0 - q.y),
        ] {
            if start < 0.0 {
                from = from.max(if end > start { start / (start - end) } else { 2.0 });
            }
            if end < 0.0 {
                to = to.min(if start > end { start / (start - end) } else { -1.0 });
            }
        }
        if from >= to {
            continue;
        }
        let steps = (p.distance(q) * (to - from)).ceil().max(1.0);
        let place = |i: f32| from + (to - from) * (i / steps);
        // Equal steps on the screen are not equal ones in space.
        let at = |s: f32| {
            let s = f64::from(s);
            a + (b - a) * (s * near / (s * near + (1.0 - s) * far))
        };
        let mut begin: Option<f32> = None;
        for i in 0..=steps as u32 {
            let i = i as f32;
            let here = i < steps && seen(at(place(i + 0.5)));
            if let Some(first) = begin
                && (!here || i - first >= PIECE)
            {
                out.push([p.lerp(q, place(first)), p.lerp(q, place(i))]);
                begin = None;
            }
            if here && begin.is_none() {
                begin = Some(i);
            }
        }
    }
    out
}
