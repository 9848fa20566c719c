//! What llsr keeps in `extras.llsr`, as read and written.

use glam::Vec3;
use llsr_scene::{EmissionLaw, PhotometricUnit, Shape};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

/// `extras` of anything: other programs' entries do not matter, not even if they are no object at all.
#[derive(Debug, Deserialize)]
struct Outer<'a> {
    #[serde(borrow)]
    llsr: Option<&'a RawValue>,
}

/// The `llsr` entry of some extras: `None` if there is none, an error sentence if it cannot be understood.
pub(super) fn read<'de, T: Deserialize<'de>>(extras: &'de gltf::json::Extras) -> Option<Result<T, String>> {
    let text = extras.as_ref()?.get();
    // A list would do for a structure too.
    let outer: Outer<'de> = serde_json::from_str(text.trim_start().starts_with('{').then_some(text)?).ok()?;
    let entry = outer.llsr?;
    Some(serde_json::from_str(entry.get()).map_err(|error| format!("extras.llsr: {error}")))
}

/// Of the asset.
#[derive(Debug, Default, Deserialize, Serialize)]
pub(super) struct AssetExtras {
    /// Unit of all intensities and emissive strengths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) unit: Option<Unit>,
}

#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Unit {
    Luminous,
    Radiant,
}

impl From<Unit> for PhotometricUnit {
    fn from(unit: Unit) -> Self {
        match unit {
            Unit::Luminous => Self::Luminous,
            Unit::Radiant => Self::Radiant,
        }
    }
}

/// Of a node or of a light.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(super) struct NodeExtras {
    /// Length of a linear light along the local x axis, its middle at the origin (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) length: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) emission: Option<Emission>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) radius: Option<f64>,
    /// Width (local x) and height (local y) of a rectangular light that shines along the local -z axis (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rect: Option<[f64; 2]>,
    /// Radius of a disc light that shines along the local -z axis (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) disc: Option<f64>,
    /// Replaces the node's mesh, which shows it to other programs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) primitive: Option<PrimitiveExtras>,
}

/// Of a camera.
#[derive(Debug, Default, Deserialize, Serialize)]
pub(super) struct CameraExtras {
    /// Horizontal opening angle, which goes before the vertical one of the format (radians).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) horizontal: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Emission {
    #[default]
    Diffuse,
    Isotropic,
}

impl From<Emission> for EmissionLaw {
    fn from(emission: Emission) -> Self {
        match emission {
            Emission::Diffuse => Self::Diffuse,
            Emission::Isotropic => Self::Isotropic,
        }
    }
}

impl From<EmissionLaw> for Emission {
    fn from(law: EmissionLaw) -> Self {
        match law {
            EmissionLaw::Diffuse => Self::Diffuse,
            EmissionLaw::Isotropic => Self::Isotropic,
        }
    }
}

/// An analytic primitive in its node's frame (m).
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub(super) enum PrimitiveExtras {
    Sphere {
        center: [f32; 3],
        radius: f32,
    },
    Cylinder {
        a: [f32; 3],
        b: [f32; 3],
        radius: f32,
        capped: bool,
    },
    Cone {
        base: [f32; 3],
        apex: [f32; 3],
        radius: f32,
        capped: bool,
    },
    Disc {
        center: [f32; 3],
        normal: [f32; 3],
        radius: f32,
    },
}

impl From<&PrimitiveExtras> for Shape {
    fn from(extras: &PrimitiveExtras) -> Self {
        let v = Vec3::from_array;
        match *extras {
            PrimitiveExtras::Sphere { center, radius } => Self::Sphere {
                center: v(center),
                radius,
            },
            PrimitiveExtras::Cylinder { a, b, radius, capped } => Self::Cylinder {
                a: v(a),
                b: v(b),
                radius,
                capped,
            },
            PrimitiveExtras::Cone {
                base,
                apex,
                radius,
                capped,
            } => Self::Cone {
                base: v(base),
                apex: v(apex),
                radius,
                capped,
            },
            PrimitiveExtras::Disc {
                center,
                normal,
                radius,
            } => Self::Disc {
                center: v(center),
                normal: v(normal),
                radius,
            },
        }
    }
}

impl From<&Shape> for PrimitiveExtras {
    fn from(shape: &Shape) -> Self {
        match *shape {
            Shape::Sphere { center, radius } => Self::Sphere {
                center: center.to_array(),
                radius,
            },
            Shape::Cylinder { a, b, radius, capped } => Self::Cylinder {
                a: a.to_array(),
                b: b.to_array(),
                radius,
                capped,
            },
            Shape::Cone {
                base,
                apex,
                radius,
                capped,
            } => Self::Cone {
                base: base.to_array(),
                apex: apex.to_array(),
                radius,
                capped,
            },
            Shape::Disc {
                center,
                normal,
                radius,
            } => Self::Disc {
                center: center.to_array(),
                normal: normal.to_array(),
                radius,
            },
        }
    }
}
