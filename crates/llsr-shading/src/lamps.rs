//! Lights as the quadrature sees them.

use glam::DVec3;
use llsr_quadrature::{
    DiscLight, Emission, GaussRule, LineAxis, LineIrradiance, LineLight, Receiver, RectLight, TubeLight,
    horizon_clip,
};
use llsr_scene::{AreaShape, EmissionLaw, Light, LightId, LinearLight, Material};

use crate::{Method, Settings};

/// A light as the quadrature sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source {
    Dark,
    Point { position: DVec3, line: LineLight },
    Line { line: LineLight, axis: LineAxis },
    Tube(TubeLight),
    Rect(RectLight),
    Disc(DiscLight),
}

impl Source {
    /// Points whose convex hull holds all lines that can stand for the light.
    pub(crate) fn hull(&self) -> Vec<DVec3> {
        // The lines are rounded.
        const MARGIN: f64 = 1.0 + 1e-9;
        let around = |center: DVec3, u: DVec3, v: DVec3| {
            [u + v, u - v, v - u, -u - v].map(|offset| center + offset * MARGIN)
        };
        match *self {
            Self::Dark => Vec::new(),
            Self::Point { position, .. } => vec![position],
            Self::Line { line, .. } => vec![line.a, line.b],
            Self::Tube(TubeLight { a, b, radius, .. }) => {
                let (u, v) = (b - a).normalize_or(DVec3::X).any_orthonormal_pair();
                let ends = [a, b].map(|end| around(end, u * radius, v * radius));
                ends.concat()
            }
            Self::Rect(RectLight {
                corner,
                along,
                across,
                ..
            }) => around(corner + 0.5 * (along + across), 0.5 * along, 0.5 * across).to_vec(),
            Self::Disc(DiscLight { center, u, v, .. }) => around(center, u, v).to_vec(),
        }
    }
}

/// What [`DirectLight`](crate::DirectLight) knows of lights and materials, worked out once for many points.
#[derive(Clone, Debug)]
pub struct PreparedLights {
    pub(crate) sources: Vec<Source>,
    /// Points around each light.
    pub(crate) hulls: Vec<Vec<DVec3>>,
    /// Lights without power are searched like the others.
    dark_too: bool,
    /// Nodes and weights of the Gauss rule on [0, 1], for [`Method::Gauss`].
    pub(crate) gauss: (Vec<f64>, Vec<f64>),
    /// Nodes and weights on [0, 1] of the lines that stand for a light with an area.
    pub(crate) stack: Vec<(f64, f64)>,
    /// Roughness of each material.
    pub(crate) roughness: Vec<f64>,
}

impl PreparedLights {
    /// Prepares lights for surfaces of these materials. Cost: some dozen nanoseconds for each.
    pub fn new(lights: &[Light], materials: &[Material], settings: &Settings) -> Self {
        let gauss = if settings.method == Method::Gauss {
            GaussRule::new(settings.samples as usize).iter().unzip()
        } else {
            (Vec::new(), Vec::new())
        };
        let dark_too = settings.wasteful.power;
        let sources: Vec<Source> = lights.iter().map(|light| source(light, dark_too)).collect();
        Self {
            hulls: sources.iter().map(Source::hull).collect(),
            sources,
            dark_too,
            gauss,
            stack: GaussRule::new(settings.light_lines as usize).iter().collect(),
            roughness: materials.iter().map(|m| f64::from(m.roughness)).collect(),
        }
    }

    /// Puts another light in the place of one.
    ///
    /// # Panics
    /// If there is no such light.
    pub fn set(&mut self, id: LightId, light: &Light) {
        let source = source(light, self.dark_too);
        self.hulls[id.index()] = source.hull();
        self.sources[id.index()] = source;
    }

    /// What a diffuse surface receives of a light if nothing hides it (lux or W/m2), where the light is on the side of the surface
    /// to which `facing` points (its geometric normal; the receiver's may be a shading normal).
    ///
    /// The closed form for lines; tubes, rectangles and discs are taken as the one line that stands best for them. Cost: some 60 ns.
    ///
    /// # Panics
    /// If there is no such light.
    pub fn free_irradiance(&self, light: LightId, receiver: &Receiver, facing: DVec3) -> f64 {
        match self.stretch(light, receiver, facing) {
            Some(Stretch {
                irradiance,
                t: [a, b],
                ..
            }) => irradiance.panel(a, b),
            None => 0.0,
        }
    }

    /// The same from those thirds of the part above the surface whose middle is `visible`.
    ///
    /// An estimate where a third is hidden in part, never more than [`free_irradiance`](Self::free_irradiance) but for rounding.
    /// Cost: that and three questions at most.
    ///
    /// # Panics
    /// If there is no such light.
    pub fn irradiance_past(
        &self,
        light: LightId,
        receiver: &Receiver,
        facing: DVec3,
        mut visible: impl FnMut(DVec3) -> bool,
    ) -> f64 {
        let Some(Stretch {
            line,
            irradiance,
            t: [a, b],
        }) = self.stretch(light, receiver, facing)
        else {
            return 0.0;
        };
        let thirds = if line.a == line.b { 1 } else { 3 };
        let at = |sixths: i32| a + (b - a) * f64::from(sixths) / f64::from(2 * thirds);
        (0..thirds)
            .filter(|third| visible(line.point(at(2 * third + 1))))
            .map(|third| irradiance.panel(at(2 * third), at(2 * third + 2)))
            .sum()
    }

    /// The place of a light between which and its start a share `u`, in [0, 1], of [`free_irradiance`](Self::free_irradiance) comes
    /// from, and that irradiance; `None` if nothing comes. With `u` at random, the irradiance if the place is seen and nothing if not is
    /// right on average, for a line: how near a part of the light lies makes no noise.
    ///
    /// The share is met to about a thousandth. Cost: some 150 ns.
    pub(crate) fn place(
        &self,
        light: LightId,
        receiver: &Receiver,
        facing: DVec3,
        u: f64,
    ) -> Option<(DVec3, f64)> {
        let Stretch {
            line,
            irradiance,
            t: [a, b],
        } = self.stretch(light, receiver, facing)?;
        let all = irradiance.panel(a, b);
        if all <= 0.0 {
            return None;
        }
        let (from, to) = irradiance.lit_range()?;
        let start = a.max(from);
        let (mut low, mut high) = (start, b.min(to));
        // Newton's method, kept between what is known to be too low and too high.
        let mut t = low + u * (high - low);
        for _ in 0..6 {
            let off = irradiance.panel(start, t) - u * all;
            if off.abs() < 1e-3 * all {
                break;
            }
            if off < 0.0 {
                low = t
            } else {
                high = t
            }
            let next = t - off / irradiance.density(t);
            t = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
        }
        Some((line.point(t), all))
    }

    fn stretch(&self, light: LightId, receiver: &Receiver, facing: DVec3) -> Option<Stretch> {
        let middle = [(0.5, 1.0)];
        let source = &self.sources[light.index()];
        let line = match source {
            Source::Dark => None,
            Source::Point { line, .. } | Source::Line { line, .. } => Some(*line),
            Source::Tube(tube) => tube.lines(receiver.position, middle).next(),
            Source::Rect(rect) => rect.lines(receiver.position, middle).next(),
            Source::Disc(disc) => disc.lines(receiver.position, middle).next(),
        }?;
        let side = Receiver {
            normal: facing,
            ..*receiver
        };
        let (a, b) = horizon_clip(&side, line.a, line.b)?;
        let irradiance = match source {
            Source::Line { axis, .. } => LineIrradiance::along(receiver, axis),
            _ => LineIrradiance::new(receiver, &line),
        };
        Some(Stretch {
            line,
            irradiance,
            t: [a, b],
        })
    }
}

/// The part of a line light above a surface.
struct Stretch {
    line: LineLight,
    irradiance: LineIrradiance,
    t: [f64; 2],
}

fn source(light: &Light, dark_too: bool) -> Source {
    if light.flux() <= 0.0 && !dark_too {
        return Source::Dark;
    }
    match light {
        Light::Linear(light) => {
            let emission = match light.emission {
                EmissionLaw::Diffuse => Emission::Diffuse,
                EmissionLaw::Isotropic => Emission::Isotropic,
            };
            let line = LineLight {
                a: light.a,
                b: light.b,
                emission,
                flux: light.flux,
            };
            if light.radius > 0.0 && light.length() > 0.0 {
                let LinearLight {
                    a, b, radius, flux, ..
                } = *light;
                return Source::Tube(TubeLight { a, b, radius, flux });
            }
            // Without a length there is nothing to search along.
            if light.length() > 0.0 {
                let axis = LineAxis::new(&line);
                Source::Line { line, axis }
            } else {
                Source::Point {
                    position: light.a,
                    line,
                }
            }
        }
        Light::Area(light) => match light.shape {
            AreaShape::Rect {
                corner,
                along,
                across,
            } => Source::Rect(RectLight {
                corner,
                along,
                across,
                flux: light.flux,
            }),
            AreaShape::Disc {
                center,
                normal,
                radius,
            } => Source::Disc(DiscLight::new(center, normal, radius, light.flux)),
        },
        Light::Point(light) => {
            let (position, flux) = (light.position, light.flux);
            let line = LineLight {
                a: position,
                b: position,
                emission: Emission::Isotropic,
                flux,
            };
            Source::Point { position, line }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use llsr_scene::{AreaLight, MaterialId, ObjectId, PointLight, Scene};
    use llsr_tracer::Tracer;
    use proptest::prelude::*;

    use super::*;
    use crate::{DirectLight, Pixel, Scratch, Statistics, SurfacePoint};

    fn lights() -> Vec<Light> {
        let (a, b) = (DVec3::new(-0.6, 2.5, 0.2), DVec3::new(0.7, 2.2, 0.0));
        let tube = LinearLight::new("tube", a, b, 3000.0);
        let area = |name: &str, shape| {
            Light::from(AreaLight {
                name: name.to_owned(),
                shape,
                flux: 800.0,
                color: Vec3::ONE,
            })
        };
        vec![
            tube.clone().into(),
            LinearLight {
                emission: EmissionLaw::Isotropic,
                ..tube.clone()
            }
            .into(),
            LinearLight { radius: 0.02, ..tube }.into(),
            PointLight {
                name: "point".to_owned(),
                position: a,
                flux: 500.0,
                color: Vec3::ONE,
            }
            .into(),
            area(
                "rect",
                AreaShape::Rect {
                    corner: DVec3::new(-0.1, 2.0, -0.1),
                    along: DVec3::X * 0.3,
                    across: DVec3::Z * 0.2,
                },
            ),
            area(
                "disc",
                AreaShape::Disc {
                    center: DVec3::Y * 3.0,
                    normal: DVec3::NEG_Y,
                    radius: 0.15,
                },
            ),
        ]
    }

    proptest! {
        /// Beside what the renderer itself finds in an empty scene: closed forms alike, areas from one line in place of many.
        #[test]
        fn free_irradiance_is_that_of_an_empty_scene(
            position in prop::array::uniform3(-2.0..2.0f64),
            toward in prop::array::uniform3(-1.0..1.0f64),
            shown in 0usize..8,
        ) {
            let (position, facing) = (DVec3::from(position) * DVec3::new(1.0, 0.5, 1.0), DVec3::from(toward));
            prop_assume!(facing.length() > 0.1);
            let facing = facing.normalize();
            let lights = lights();
            let settings = Settings::default();
            let materials = [Material::diffuse("grey", Vec3::ONE)];
            let prepared = PreparedLights::new(&lights, &materials, &settings);
            let (tracer, _) = Tracer::new(&Scene::default());
            let direct = DirectLight::prepared(&prepared, &tracer, &settings);
            let mut states = Vec::new();
            let surface = SurfacePoint {
                position,
                origin: position,
                geometric_normal: facing,
                shading_normal: facing,
                to_viewer: facing,
                distance: 1.0,
                albedo: Vec3::ONE,
                emission: Vec3::ZERO,
                object: ObjectId(0),
                material: MaterialId(0),
                textured: None,
            };
            let receiver = Receiver { position, normal: facing };
            let toward_lights = (DVec3::Y * 2.4 - position).normalize();
            let mut all = Vec::new();
            direct.shade_point(&surface, Pixel::default(), &mut states, &mut Scratch::default(), &mut Statistics::default(),
                |id, answer| all.push((id, answer.irradiance)));
            for (id, truth) in all {
                let free = prepared.free_irradiance(id, &receiver, facing);
                let exact = id.index() < 2 || id.index() == 3;
                // At a grazing angle the area's rim counts, which its middle line does not have.
                let head_on = prepared.free_irradiance(id, &Receiver { position, normal: toward_lights }, toward_lights);
                let tolerance = if exact { 1e-9 * truth.max(1e-3) } else { 0.1 * truth.max(head_on) };
                prop_assert!((free - truth).abs() <= tolerance, "{id:?}: {free} for {truth}");
                let everything = prepared.irradiance_past(id, &receiver, facing, |_| true);
                prop_assert!((everything - free).abs() <= 1e-9 * free.max(1e-3), "{id:?}: {everything} for {free}");
                // Of what is hidden nothing comes, and the thirds add up.
                let pass = |inverted: bool| {
                    let mut asked = 0;
                    prepared.irradiance_past(id, &receiver, facing, |_| {
                        asked += 1;
                        (shown >> (asked - 1) & 1 == 1) != inverted
                    })
                };
                prop_assert!((pass(false) + pass(true) - free).abs() <= 1e-9 * free.max(1e-3));
                prop_assert_eq!(prepared.irradiance_past(id, &receiver, facing, |_| false), 0.0);
            }
        }
    }

    proptest! {
        /// Places at even shares, of which a stretch is hidden: the mean is the closed form of the rest.
        #[test]
        fn places_are_spread_as_irradiance_is(
            position in prop::array::uniform3(-2.0..2.0f64),
            toward in prop::array::uniform3(-1.0..1.0f64),
            hidden in prop::array::uniform2(-0.1..1.1f64),
        ) {
            let (position, facing) = (DVec3::from(position) * DVec3::new(1.0, 1.2, 1.0), DVec3::from(toward));
            prop_assume!(facing.length() > 0.1);
            let facing = facing.normalize();
            let lights = &lights()[..2];
            let prepared = PreparedLights::new(lights, &[], &Settings::default());
            let receiver = Receiver { position, normal: facing };
            let (a, b) = lights[0].ends();
            for (index, emission) in [Emission::Diffuse, Emission::Isotropic].into_iter().enumerate() {
                let light = LineLight { a, b, emission, flux: 3000.0 };
                let line = LineIrradiance::new(&receiver, &light);
                let shadow = [hidden[0].min(hidden[1]), hidden[0].max(hidden[1])];
                let truth = line.panel(0.0, shadow[0]) + line.panel(shadow[1], 1.0);
                let all = line.panel(0.0, 1.0);
                let count = 400;
                let mean = (0..count)
                    .filter_map(|k| prepared.place(LightId::from(index), &receiver, facing, (f64::from(k) + 0.5) / f64::from(count)))
                    .filter(|(place, _)| {
                        let t = (*place - a).dot(b - a) / (b - a).length_squared();
                        t < shadow[0] || t > shadow[1]
                    })
                    .map(|(_, irradiance)| irradiance)
                    .sum::<f64>() / f64::from(count);
                // Each end of the shadow is met to half a step and the tolerance of the search.
                prop_assert!((mean - truth).abs() <= 0.006 * all, "{emission:?}: {mean} for {truth} of {all}");
                prop_assert!(prepared.place(LightId::from(index), &receiver, facing, 0.5).is_some() == (all > 0.0));
            }
        }
    }
}
