//! Irradiance from visible panels of a linear light: closed forms, Gauss rules and sample patterns.
