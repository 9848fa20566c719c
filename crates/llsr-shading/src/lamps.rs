//! Lights as the quadrature sees them.

use glam::DVec3;
use llsr_quadrature::{DiscLight, Emission, GaussRule, LineLight, RectLight, TubeLight};
use llsr_scene::{AreaShape, EmissionLaw, Light, LightId, LinearLight, Material};

use crate::{Method, Settings};

/// A light as the quadrature sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source {
    Dark,
    Point { position: DVec3, line: LineLight },
    Line(LineLight),
    Tube(TubeLight),
    Rect(RectLight),
    Disc(DiscLight),
}

/// What [`DirectLight`](crate::DirectLight) knows of lights and materials, worked out once for many points.
#[derive(Clone, Debug)]
pub struct PreparedLights {
    pub(crate) sources: Vec<Source>,
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
        Self {
            sources: lights.iter().map(source).collect(),
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
        self.sources[id.index()] = source(light);
    }
}

fn source(light: &Light) -> Source {
    if light.flux() <= 0.0 {
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
                Source::Line(line)
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
