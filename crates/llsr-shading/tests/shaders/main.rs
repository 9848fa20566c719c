//! Shaders against pictures, dense sampling and known answers.

mod direct;
mod gi;
mod gi_motion;
mod glossy;
mod support;
