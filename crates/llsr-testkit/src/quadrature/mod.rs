//! Slow oracles for integrals over lights: adaptive quadrature of the defining integrals.

mod adaptive;
mod area;
mod double_double;
mod glossy;
mod line;

pub use adaptive::{Sum, adaptive};
pub use area::{Element, area_irradiance, cylinder, ellipse, parallelogram};
pub use double_double::{DoubleDouble, WideVec3};
pub use glossy::{metal_rough, reflected};
pub use line::{Law, line_irradiance, short_line_irradiance};
