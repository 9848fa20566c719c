//! Working memory of a thread that shades.

use glam::Vec3;
use llsr_scene::ObjectId;

use crate::shader::gi::Sample;
use crate::{LightState, Scratch, Statistics};

/// Working memory of one thread, kept from batch to batch so that shading does not allocate; any shader can use any.
#[derive(Debug, Default)]
pub struct ShaderScratch {
    pub(crate) direct: Scratch,
    pub(crate) states: Vec<LightState>,
    pub(crate) blockers: Vec<ObjectId>,
    pub(crate) statistics: Statistics,
    /// Rays of hemispheres that are not in use.
    pub(crate) samples: Vec<Vec<Sample>>,
    /// What each light may give.
    pub(crate) weights: Vec<f64>,
    /// Where rays of a record of irradiance end (m).
    pub(crate) ends: Vec<Vec3>,
}

impl ShaderScratch {
    /// What all shading with this memory did about direct light.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }
}
