//! Linear and point lights.

use glam::{DVec3, Vec3};

/// Whether fluxes are in lumens or watts. One scene uses one of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PhotometricUnit {
    /// Flux in lumens, irradiance in lux.
    #[default]
    Luminous,
    /// Flux in watts, irradiance in W/m².
    Radiant,
}

impl PhotometricUnit {
    /// Symbol of flux: `lm` or `W`.
    pub fn flux_symbol(self) -> &'static str {
        match self {
            Self::Luminous => "lm",
            Self::Radiant => "W",
        }
    }

    /// Symbol of irradiance: `lux` or `W/m2`.
    pub fn irradiance_symbol(self) -> &'static str {
        match self {
            Self::Luminous => "lux",
            Self::Radiant => "W/m2",
        }
    }
}

/// How an element of a linear light sends its flux into directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmissionLaw {
    /// The limit of a thin Lambertian tube: emission falls with the sine of the angle to the axis.
    #[default]
    Diffuse,
    /// The same into every direction.
    Isotropic,
}

/// A light along the segment `a`-`b`; `t = 0` is at `a`.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearLight {
    /// Name, unique in a scene after [`Scene::add_light`](crate::Scene::add_light).
    pub name: String,
    /// First end, in the scene's recentred frame (m).
    pub a: DVec3,
    /// Second end (m).
    pub b: DVec3,
    /// Total flux over all directions, in the scene's unit; not negative.
    pub flux: f64,
    /// Linear RGB colour, scaled to luminance 1.
    pub color: Vec3,
    /// Emission law.
    pub emission: EmissionLaw,
    /// Radius of the tube (m); 0 treats it as a line.
    pub radius: f64,
}

impl LinearLight {
    /// A white diffuse line.
    pub fn new(name: impl Into<String>, a: DVec3, b: DVec3, flux: f64) -> Self {
        Self {
            name: name.into(),
            a,
            b,
            flux,
            color: Vec3::ONE,
            emission: EmissionLaw::Diffuse,
            radius: 0.0,
        }
    }

    /// The point at parameter `t` in [0, 1].
    pub fn point(&self, t: f64) -> DVec3 {
        self.a + (self.b - self.a) * t
    }

    /// Length (m).
    pub fn length(&self) -> f64 {
        self.a.distance(self.b)
    }
}

/// A light in one point that sends the same intensity into every direction.
#[derive(Clone, Debug, PartialEq)]
pub struct PointLight {
    /// Name, unique in a scene after [`Scene::add_light`](crate::Scene::add_light).
    pub name: String,
    /// Position in the scene's recentred frame (m).
    pub position: DVec3,
    /// Total flux over all directions (4π times the intensity), in the scene's unit; not negative.
    pub flux: f64,
    /// Linear RGB colour, scaled to luminance 1.
    pub color: Vec3,
}

/// The surface of an area light. It is Lambertian and emits to one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AreaShape {
    /// A rectangle that emits to the side of `along` x `across`.
    Rect {
        /// One corner (m, recentred frame).
        corner: DVec3,
        /// From the corner along one side (m).
        along: DVec3,
        /// From the corner along the other side (m), at right angles to `along`.
        across: DVec3,
    },
    /// A disc that emits to the side of its normal.
    Disc {
        /// Centre (m, recentred frame).
        center: DVec3,
        /// Unit normal.
        normal: DVec3,
        /// Radius (m), positive.
        radius: f64,
    },
}

/// A light with an area.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaLight {
    /// Name, unique in a scene after [`Scene::add_light`](crate::Scene::add_light).
    pub name: String,
    /// Its surface.
    pub shape: AreaShape,
    /// Total flux, in the scene's unit; not negative.
    pub flux: f64,
    /// Linear RGB colour, scaled to luminance 1.
    pub color: Vec3,
}

/// A light of a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Along a segment.
    Linear(LinearLight),
    /// In one point.
    Point(PointLight),
    /// On a surface.
    Area(AreaLight),
}

impl Light {
    /// The light's name.
    pub fn name(&self) -> &str {
        match self {
            Self::Linear(light) => &light.name,
            Self::Point(light) => &light.name,
            Self::Area(light) => &light.name,
        }
    }

    pub(crate) fn name_mut(&mut self) -> &mut String {
        match self {
            Self::Linear(light) => &mut light.name,
            Self::Point(light) => &mut light.name,
            Self::Area(light) => &mut light.name,
        }
    }

    /// Total flux in the scene's unit.
    pub fn flux(&self) -> f64 {
        match self {
            Self::Linear(light) => light.flux,
            Self::Point(light) => light.flux,
            Self::Area(light) => light.flux,
        }
    }

    /// Linear RGB colour of luminance 1.
    pub fn color(&self) -> Vec3 {
        match self {
            Self::Linear(light) => light.color,
            Self::Point(light) => light.color,
            Self::Area(light) => light.color,
        }
    }

    /// The two ends of the light; equal for a point light, opposite corners or points of the rim for an area.
    pub fn ends(&self) -> (DVec3, DVec3) {
        match self {
            Self::Linear(light) => (light.a, light.b),
            Self::Point(light) => (light.position, light.position),
            Self::Area(light) => match light.shape {
                AreaShape::Rect {
                    corner,
                    along,
                    across,
                } => (corner, corner + along + across),
                AreaShape::Disc {
                    center,
                    normal,
                    radius,
                } => {
                    let across = normal.any_orthonormal_vector() * radius;
                    (center - across, center + across)
                }
            },
        }
    }

    /// Moves the light by `offset` metres.
    pub fn translate(&mut self, offset: DVec3) {
        match self {
            Self::Linear(light) => {
                light.a += offset;
                light.b += offset;
            }
            Self::Point(light) => light.position += offset,
            Self::Area(light) => match &mut light.shape {
                AreaShape::Rect { corner, .. } => *corner += offset,
                AreaShape::Disc { center, .. } => *center += offset,
            },
        }
    }
}

impl From<LinearLight> for Light {
    fn from(light: LinearLight) -> Self {
        Self::Linear(light)
    }
}

impl From<PointLight> for Light {
    fn from(light: PointLight) -> Self {
        Self::Point(light)
    }
}

impl From<AreaLight> for Light {
    fn from(light: AreaLight) -> Self {
        Self::Area(light)
    }
}
