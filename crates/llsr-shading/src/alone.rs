//! Surface points shaded on their own, for renderers that choose their points.

use llsr_scene::LightId;

use crate::direct::{Pixel, Work};
use crate::random::stream;
use crate::{DirectLight, LightAnswer, LightState, Scratch, Statistics, SurfacePoint};

impl DirectLight<'_> {
    /// Light of every light of the scene on one surface point that has no neighbour, handed to `each` in their order.
    ///
    /// The answers depend on the settings' seed, `at` and the point alone; for the first pixel of a row they are those of
    /// [`render`](crate::render). `states` is working memory.
    pub fn shade_point(
        &self,
        surface: &SurfacePoint,
        at: Pixel,
        states: &mut Vec<LightState>,
        scratch: &mut Scratch,
        statistics: &mut Statistics,
        mut each: impl FnMut(LightId, &LightAnswer),
    ) {
        states.iter_mut().for_each(LightState::clear);
        states.resize(self.light_count(), LightState::default());
        for (index, state) in states.iter_mut().enumerate() {
            let id = LightId::from(index);
            let rng = stream(self.settings.seed, at.index, at.subsample, index as u32);
            let mut work = Work {
                at,
                split: 1,
                rng,
                scratch: &mut *scratch,
                statistics: &mut *statistics,
            };
            each(id, &self.shade(surface, id, state, &mut work));
        }
    }
}
