//! The lines of the protocol, version 1; `docs/shader-protocol.md` is its description.

use std::io::Write;

use glam::{Affine3A, DVec3, Vec3};
use llsr_scene::{AreaShape, EmissionLaw, Light, LightId, ObjectId, PhotometricUnit, Triple};
use llsr_shading::{ShadeRequest, ShadedPoint, World};

use crate::external::ExternalSettings;

/// The version of the protocol that is spoken.
pub const PROTOCOL: u32 = 1;

/// The most bytes that a line of a shader may have, its end not counted.
pub const MAX_LINE: usize = 1024;

/// What a shader says.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Answer {
    Greeting {
        version: u32,
    },
    /// The point's `id` is the number of the ray in its batch.
    Point(ShadedPoint),
    Miss {
        ray: u64,
        colour: Vec3,
    },
    Object(ObjectId),
    Triple(Triple),
    Done {
        batch: u64,
    },
    Failed {
        message: String,
    },
}

/// What numbers may be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) requests: u64,
    pub(super) objects: u32,
    pub(super) lights: u32,
}

impl Answer {
    /// Do the numbers of rays, objects and lights exist, and are the others finite?
    pub(super) fn check(&self, limits: &Limits) -> Result<(), String> {
        let ray = |ray: u64| match ray < limits.requests {
            true => Ok(()),
            false => Err(format!("answered ray {ray} of a batch of {}", limits.requests)),
        };
        let object = |object: ObjectId| match object.0 < limits.objects {
            true => Ok(()),
            false => Err(format!("names object {} of {}", object.0, limits.objects)),
        };
        let finite = |finite: bool| match finite {
            true => Ok(()),
            false => Err("sent a number that is not finite".to_owned()),
        };
        match self {
            Self::Point(point) => {
                ray(point.id)?;
                let ShadedPoint {
                    position,
                    normal,
                    albedo,
                    colour,
                    ..
                } = point;
                finite([position, normal, albedo, colour].iter().all(|v| v.is_finite()))?;
                point.object.map_or(Ok(()), object)
            }
            Self::Miss { ray: number, colour } => {
                ray(*number)?;
                finite(colour.is_finite())
            }
            Self::Object(id) => object(*id),
            Self::Triple(triple) => {
                object(triple.blocker)?;
                object(triple.receiver)?;
                match triple.light.0 < limits.lights {
                    true => Ok(()),
                    false => Err(format!("names light {} of {}", triple.light.0, limits.lights)),
                }
            }
            Self::Greeting { .. } | Self::Done { .. } | Self::Failed { .. } => Ok(()),
        }
    }
}

/// Reads a line with its end; `None` for one that says nothing.
pub(super) fn parse(line: &[u8]) -> Result<Option<Answer>, String> {
    let text = std::str::from_utf8(line).map_err(|_| "sent a line that is not UTF-8".to_owned())?;
    let text = text.trim();
    if text.is_empty() || text.starts_with('#') {
        return Ok(None);
    }
    let wrong = || {
        let shown: String = text.chars().take(60).collect();
        format!("sent a line that makes no sense: {shown}")
    };
    let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
    let mut fields = Fields(rest.split_ascii_whitespace());
    let answer = match word {
        "llsr-shader" => {
            // A name may follow.
            let version = fields.number();
            return version
                .map(|version| Some(Answer::Greeting { version }))
                .ok_or_else(wrong);
        }
        "failed" => {
            return Ok(Some(Answer::Failed {
                message: rest.to_owned(),
            }));
        }
        "point" => fields.point().map(Answer::Point),
        "miss" => fields.miss(),
        "object" => fields.number().map(|id| Answer::Object(ObjectId(id))),
        "triple" => fields.triple().map(Answer::Triple),
        "done" => fields.number().map(|batch| Answer::Done { batch }),
        _ => None,
    };
    let nothing_left = fields.0.next().is_none();
    answer.filter(|_| nothing_left).map(Some).ok_or_else(wrong)
}

/// The fields of a line after its first word.
struct Fields<'a>(std::str::SplitAsciiWhitespace<'a>);

impl Fields<'_> {
    fn number<T: std::str::FromStr>(&mut self) -> Option<T> {
        self.0.next()?.parse().ok()
    }

    fn vector(&mut self) -> Option<Vec3> {
        Some(Vec3::new(self.number()?, self.number()?, self.number()?))
    }

    fn point(&mut self) -> Option<ShadedPoint> {
        let id = self.number()?;
        let (position, normal) = (self.vector()?, self.vector()?);
        let (albedo, colour) = (self.vector()?, self.vector()?);
        let object = match self.0.next()? {
            "-" => None,
            number => Some(ObjectId(number.parse().ok()?)),
        };
        Some(ShadedPoint {
            textured: None,
            id,
            position,
            normal,
            albedo,
            colour,
            object,
            lights: self.number()?,
            provisional: false,
        })
    }

    fn miss(&mut self) -> Option<Answer> {
        Some(Answer::Miss {
            ray: self.number()?,
            colour: self.vector()?,
        })
    }

    fn triple(&mut self) -> Option<Triple> {
        Some(Triple {
            light: LightId(self.number()?),
            blocker: ObjectId(self.number()?),
            receiver: ObjectId(self.number()?),
        })
    }
}

/// Appends one line. Writing to memory does not fail.
macro_rules! line {
    ($text:expr, $($format:tt)*) => {{
        let _ = writeln!($text, $($format)*);
    }};
}

/// Three numbers as shortest decimals that read back as the same.
fn triple(v: DVec3) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

fn triple_single(v: Vec3) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

/// All that the shader is told before it greets back.
pub(super) fn write_greeting(text: &mut Vec<u8>, world: &World, settings: &ExternalSettings) {
    let scene = world.scene();
    line!(text, "llsr-shader {PROTOCOL}");
    let name: String = settings
        .scene
        .chars()
        .filter(|c| !c.is_control())
        .take(800)
        .collect();
    line!(text, "scene {name}");
    let unit = match scene.unit {
        PhotometricUnit::Luminous => "lm",
        PhotometricUnit::Radiant => "W",
    };
    line!(text, "unit {unit}");
    line!(text, "origin {}", triple(scene.origin));
    let bounds = world.bounds();
    if !bounds.is_empty() {
        line!(
            text,
            "bounds {} {}",
            triple_single(bounds.min),
            triple_single(bounds.max)
        );
    }
    line!(text, "objects {}", scene.objects.len());
    line!(text, "lights {}", scene.lights.len());
    for (index, light) in scene.lights.iter().enumerate() {
        write_light(text, LightId::from(index), light);
    }
    if let Some((camera, viewport)) = &settings.view {
        let [right, up, back] = [camera.axes.x_axis, camera.axes.y_axis, camera.axes.z_axis];
        // Parallel projections are no view that the line can tell.
        if let Some(fov) = camera.vertical_field_of_view(*viewport) {
            line!(
                text,
                "view {} {} {} {} {} {} {}",
                viewport.width,
                viewport.height,
                triple(camera.position),
                triple(right),
                triple(up),
                triple(back),
                fov.to_degrees(),
            );
        }
    }
    line!(text, "start");
}

/// A light, at the beginning or after it has moved.
pub(super) fn write_light(text: &mut Vec<u8>, id: LightId, light: &Light) {
    let what = match light {
        Light::Linear(line) => {
            let emission = match line.emission {
                EmissionLaw::Diffuse => "diffuse",
                EmissionLaw::Isotropic => "isotropic",
            };
            format!(
                "line {} {} {} {emission}",
                triple(line.a),
                triple(line.b),
                line.radius
            )
        }
        Light::Point(point) => format!("point {}", triple(point.position)),
        Light::Area(area) => match area.shape {
            AreaShape::Rect {
                corner,
                along,
                across,
            } => format!("rect {} {} {}", triple(corner), triple(along), triple(across)),
            AreaShape::Disc {
                center,
                normal,
                radius,
            } => format!("disc {} {} {radius}", triple(center), triple(normal)),
        },
    };
    line!(
        text,
        "light {} {} {} {what}",
        id.0,
        light.flux(),
        triple_single(light.color())
    );
}

/// An object that has moved.
pub(super) fn write_object(text: &mut Vec<u8>, id: ObjectId, transform: &Affine3A) {
    let matrix = &transform.matrix3;
    line!(
        text,
        "object {} {} {} {} {}",
        id.0,
        triple_single(matrix.x_axis.into()),
        triple_single(matrix.y_axis.into()),
        triple_single(matrix.z_axis.into()),
        triple_single(transform.translation.into()),
    );
}

/// Rays to shade; they are numbered from 0.
pub(super) fn write_batch(text: &mut Vec<u8>, batch: u64, seed: u64, requests: &[ShadeRequest]) {
    line!(text, "shade {batch} {} {seed}", requests.len());
    for (index, request) in requests.iter().enumerate() {
        let direction = request.direction.normalize_or_zero();
        line!(
            text,
            "ray {index} {} {}",
            triple(request.origin),
            triple(direction)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_understood_or_refused() {
        let point = parse(b"point 3 1 2 3 0 1 0 .5 .5 .5 7 8 9 4 5\n")
            .expect("a point")
            .expect("not empty");
        let Answer::Point(point) = point else {
            panic!("a point: {point:?}")
        };
        assert_eq!(
            (point.id, point.object, point.lights),
            (3, Some(ObjectId(4)), 5),
            "{point:?}"
        );
        assert_eq!(
            (point.position, point.colour),
            (Vec3::new(1.0, 2.0, 3.0), Vec3::new(7.0, 8.0, 9.0)),
            "{point:?}"
        );
        let none = parse(b"point 0 1 2 3 0 1 0 1 1 1 7 8 9 - 0\r\n")
            .expect("a point")
            .expect("not empty");
        assert!(
            matches!(none, Answer::Point(ShadedPoint { object: None, .. })),
            "{none:?}"
        );
        let greeting = parse(b"llsr-shader 1 my own renderer\n");
        assert_eq!(greeting, Ok(Some(Answer::Greeting { version: 1 })), "with a name");
        assert_eq!(parse(b"  \n"), Ok(None), "an empty line");
        assert_eq!(parse(b"# loading\n"), Ok(None), "a comment");
        let message = "out of  memory".to_owned();
        assert_eq!(
            parse(b"failed out of  memory\n"),
            Ok(Some(Answer::Failed { message })),
            "as it is"
        );
        for bad in [
            &b"point 3 1 2 3 0 1 0 .5 .5 .5 7 8 9 4\n"[..],
            b"point 3 1 2 3 0 1 0 .5 .5 .5 7 8 9 4 5 6\n",
            b"point -3 1 2 3 0 1 0 .5 .5 .5 7 8 9 4 5\n",
            b"point 3 1 2 3 0 1 0 .5 .5 .5 7 8 x 4 5\n",
            b"done\n",
            b"done 18446744073709551616\n",
            b"hello\n",
            b"\xff\xfe\n",
            b"llsr-shader one\n",
        ] {
            assert!(parse(bad).is_err(), "{}", String::from_utf8_lossy(bad));
        }
    }

    #[test]
    fn numbers_beyond_the_scene_are_refused() {
        let limits = Limits {
            requests: 4,
            objects: 3,
            lights: 2,
        };
        let check = |line: &str| parse(line.as_bytes()).expect(line).expect(line).check(&limits);
        for good in [
            "point 3 1 2 3 0 1 0 1 1 1 7 8 9 2 5",
            "miss 0 1 2 3",
            "object 2",
            "triple 1 2 0",
        ] {
            assert_eq!(check(good), Ok(()), "{good}");
        }
        for bad in [
            "point 4 1 2 3 0 1 0 1 1 1 7 8 9 2 5",
            "point 3 1 2 3 0 1 0 1 1 1 7 8 9 3 5",
            "point 3 1 2 inf 0 1 0 1 1 1 7 8 9 2 5",
            "point 3 1 2 3 0 1 0 1 1 1 7 NaN 9 2 5",
            "miss 9 1 2 3",
            "miss 0 1e99 2 3",
            "object 3",
            "triple 2 2 0",
            "triple 1 3 0",
            "triple 1 0 3",
        ] {
            assert!(check(bad).is_err(), "{bad}");
        }
    }
}
