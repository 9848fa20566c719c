//! Lights as the quadrature sees them.

use glam::DVec3;
use llsr_quadrature::{DiscLight, Emission, GaussRule, LineAxis, LineLight, RectLight, TubeLight};
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
