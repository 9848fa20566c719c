//! Analytic primitives.

use glam::Vec3;

use crate::{Bounds, MaterialId};

/// A curved or flat surface with a closed form, in its object's own frame (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A sphere.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius, positive.
        radius: f32,
    },
    /// The mantle of a circular cylinder, closed by two discs if `capped`.
    Cylinder {
        /// Centre of one end.
        a: Vec3,
        /// Centre of the other end, different from `a`.
        b: Vec3,
        /// Radius, positive.
        radius: f32,
        /// Whether the ends are closed.
        capped: bool,
    },
    /// The mantle of a circular cone, closed by a disc at its base if `capped`.
    Cone {
        /// Centre of the base.
        base: Vec3,
        /// Tip, different from `base`.
        apex: Vec3,
        /// Radius of the base, positive.
        radius: f32,
        /// Whether the base is closed.
        capped: bool,
    },
    /// A flat disc.
    Disc {
        /// Centre.
        center: Vec3,
        /// Unit normal.
        normal: Vec3,
        /// Radius, positive.
        radius: f32,
    },
}

impl Shape {
    /// The smallest axis-aligned box, up to rounding.
    pub fn bounds(&self) -> Bounds {
        // Half extent of a disc with unit normal n along axis i: r * sqrt(1 - n_i^2).
        let disc = |center: Vec3, normal: Vec3, radius: f32| {
            let half = radius * (Vec3::ONE - normal * normal).max(Vec3::ZERO).map(f32::sqrt);
            Bounds {
                min: center - half,
                max: center + half,
            }
        };
        match *self {
            Self::Sphere { center, radius } => Bounds {
                min: center - radius,
                max: center + radius,
            },
            Self::Cylinder { a, b, radius, .. } => {
                let axis = (b - a).normalize_or_zero();
                disc(a, axis, radius).union(disc(b, axis, radius))
            }
            Self::Cone {
                base, apex, radius, ..
            } => disc(base, (apex - base).normalize_or_zero(), radius).with(apex),
            Self::Disc {
                center,
                normal,
                radius,
            } => disc(center, normal, radius),
        }
    }

    /// True if every number is finite, radii are positive, axes have a length and a disc's normal is a unit.
    pub fn is_valid(&self) -> bool {
        let axis_ok = |a: Vec3, b: Vec3| a.is_finite() && b.is_finite() && a.distance_squared(b) > 0.0;
        let radius_ok = |r: f32| r.is_finite() && r > 0.0;
        match *self {
            Self::Sphere { center, radius } => center.is_finite() && radius_ok(radius),
            Self::Cylinder { a, b, radius, .. } => axis_ok(a, b) && radius_ok(radius),
            Self::Cone {
                base, apex, radius, ..
            } => axis_ok(base, apex) && radius_ok(radius),
            Self::Disc {
                center,
                normal,
                radius,
            } => center.is_finite() && (normal.length() - 1.0).abs() < 1e-3 && radius_ok(radius),
        }
    }
}

/// A shape with a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primitive {
    /// The surface.
    pub shape: Shape,
    /// Its material.
    pub material: MaterialId,
}
