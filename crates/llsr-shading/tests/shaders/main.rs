//! Shaders against pictures, dense sampling and known answers.

mod direct;
mod gi;
mod glossy;
mod support;
