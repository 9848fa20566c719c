//! Which camera to look through.

use glam::{DVec3, Vec3};
use llsr_scene::{Bounds, Camera, FieldOfView, Projection, Scene, Viewport};
use llsr_tracer::Tracer;

use crate::args::SceneArgs;
use crate::failure::Failure;

/// Where the camera comes from, for `info`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// Named or placed on the command line.
    CommandLine,
    /// The first one in the file.
    File,
    /// Put at eye height near a corner of the room.
    Room,
    /// Put outside so that the whole scene is in the picture.
    Outside,
}

impl Source {
    pub(crate) fn sentence(self) -> &'static str {
        match self {
            Self::CommandLine => "from the command line",
            Self::File => "the first in the file",
            Self::Room => "made: eye height near a corner of the room",
            Self::Outside => "made: the whole scene from outside",
        }
    }
}

/// The camera that the command line asks for, else the file's first, else one that suits the scene.
///
/// Positions on the command line are in the file's frame.
pub(crate) fn choose(
    args: &SceneArgs,
    scene: &Scene,
    tracer: &Tracer,
    viewport: Viewport,
) -> Result<(Camera, Source), Failure> {
    let (mut camera, mut source) = if let Some(name) = &args.camera {
        let found = scene.cameras.iter().find(|camera| camera.name == *name);
        (
            found
                .cloned()
                .ok_or_else(|| Failure::Usage(no_such_camera(name, scene)))?,
            Source::CommandLine,
        )
    } else {
        match scene.cameras.first() {
            Some(camera) => (camera.clone(), Source::File),
            None => automatic(scene, tracer, viewport),
        }
    };
    let eye = args.look_from.map(|p| p - scene.origin);
    let target = args.look_at.map(|p| p - scene.origin);
    if eye.is_some() || target.is_some() || args.up.is_some() {
        let position = eye.unwrap_or(camera.position);
        let ahead = match (eye, target) {
            (_, Some(target)) => target,
            (Some(_), None) => scene.bounds().center().as_dvec3(),
            (None, None) => position + camera.forward(),
        };
        for (option, place) in [("--look-from", position), ("--look-at", ahead)] {
            if place.abs().max_element() > Camera::FARTHEST {
                return Err(Failure::Usage(format!(
                    "{option}: more than {:e} m away from the scene",
                    Camera::FARTHEST
                )));
            }
        }
        if position.distance(ahead) == 0.0 {
            return Err(Failure::Usage(
                "--look-from and --look-at are the same point: the camera has no direction".to_owned(),
            ));
        }
        let up = args.up.unwrap_or(DVec3::Y);
        let field_of_view = match camera.projection {
            Projection::Perspective(angle) if eye.is_none() => angle,
            _ => FieldOfView::vertical_degrees(45.0),
        };
        camera = Camera::look_at("command line", position, ahead, up, field_of_view);
        source = Source::CommandLine;
    }
    if let Some(degrees) = args.fov {
        camera.projection = Projection::Perspective(FieldOfView::vertical_degrees(degrees));
    }
    Ok((camera, source))
}

fn no_such_camera(name: &str, scene: &Scene) -> String {
    let names: Vec<_> = scene
        .cameras
        .iter()
        .map(|camera| format!("'{}'", camera.name))
        .collect();
    if names.is_empty() {
        format!("--camera {name}: the scene has no cameras; --look-from and --look-at place one")
    } else {
        format!(
            "--camera {name}: there is no such camera; the scene has {}",
            names.join(", ")
        )
    }
}

/// Inside an enclosing room near a corner, else outside.
fn automatic(scene: &Scene, tracer: &Tracer, viewport: Viewport) -> (Camera, Source) {
    let bounds = scene.bounds();
    match inside(bounds, tracer) {
        Some(camera) => (camera, Source::Room),
        None => {
            let (center, radius) = (bounds.center(), 0.5 * bounds.diagonal());
            (Camera::outside(center, radius, viewport), Source::Outside)
        }
    }
}

/// Directions spread evenly over the sphere (a golden spiral).
fn directions(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let angle = f64::from(i) * std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let r = (1.0 - y * y).sqrt();
        DVec3::new(r * angle.cos(), y, r * angle.sin())
    })
}

/// A camera in a room, if the scene encloses its middle: nearly all directions from there end on a surface, and most
/// of those surfaces are near the border of the scene, as walls are and the inside of a solid thing is too.
fn inside(bounds: Bounds, tracer: &Tracer) -> Option<Camera> {
    let (center, size) = (bounds.center().as_dvec3(), bounds.size().as_dvec3());
    if size.min_element() <= 0.0 {
        return None;
    }
    const RAYS: u32 = 256;
    let hits: Vec<_> = directions(RAYS)
        .filter_map(|d| Some((d, tracer.closest(center, d, f64::INFINITY)?)))
        .collect();
    // A window or an open door may let a tenth of the directions out.
    if (hits.len() as u32) < RAYS * 9 / 10 {
        return None;
    }
    // A solid thing is seen from behind everywhere; if its surface does not follow the border, it is no room.
    let is_near = |p: DVec3| {
        let inner = (size * 0.5 - (p - center).abs()) / size;
        inner.min_element() < 0.05
    };
    let near = hits.iter().filter(|(_, hit)| is_near(hit.position)).count();
    let behind = hits.iter().filter(|(d, hit)| hit.normal.dot(*d) > 0.0).count();
    if behind * 10 > hits.len() * 9 && near * 5 < hits.len() * 4 {
        return None;
    }
    let floor = f64::from(bounds.min.y);
    let eye_height = floor + 1.6f64.min(0.55 * size.y);
    let target = DVec3::new(center.x, floor + 0.4 * size.y, center.z);
    let mut best: Option<(f64, DVec3)> = None;
    for inset in [0.08, 0.14, 0.2] {
        for (sx, sz) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
            let corner = Vec3::new(
                if sx > 0.0 { bounds.max.x } else { bounds.min.x },
                0.0,
                if sz > 0.0 { bounds.max.z } else { bounds.min.z },
            );
            let corner = DVec3::new(f64::from(corner.x), eye_height, f64::from(corner.z));
            let eye = corner - DVec3::new(sx * inset * size.x, 0.0, sz * inset * size.z);
            let score = openness(tracer, eye, target);
            if best.is_none_or(|(other, _)| score > other) {
                best = Some((score, eye));
            }
        }
    }
    best.map(|(_, eye)| Camera::look_at("room", eye, target, DVec3::Y, FieldOfView::vertical_degrees(60.0)))
}

/// How far a viewer sees on average in a cone towards `target` (m), not more than to it and half as far again.
fn openness(tracer: &Tracer, eye: DVec3, target: DVec3) -> f64 {
    let Some(forward) = (target - eye).try_normalize() else {
        return 0.0;
    };
    let reach = 1.5 * eye.distance(target);
    let cone = directions(200).filter(|d| d.dot(forward) > 0.85);
    let (sum, count) = cone.fold((0.0, 0u32), |(sum, count), d| {
        let seen = tracer.closest(eye, d, reach).map_or(reach, |hit| hit.t);
        (sum + seen.min(reach), count + 1)
    });
    sum / f64::from(count.max(1))
}
