//! Surface points shaded on their own, for renderers that choose their points.

use llsr_scene::{LightId, ObjectId};

use crate::direct::{Pixel, Work};
use crate::random::Random;
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
        self.shade_each(surface, at, states, scratch, statistics, None, |id, answer, _| {
            each(id, answer)
        });
    }

    /// The same, and the objects that hide something of each light from the point: those that the light's visible parts end
    /// at, and for a hidden light the first on the way to its middle. `each` gets them with the light's answer, sorted and
    /// without repetition.
    ///
    /// Cost: one ray more for each end of a visible part.
    #[expect(
        clippy::too_many_arguments,
        reason = "as `shade_point`, with one more piece of working memory"
    )]
    pub fn shade_point_and_blockers(
        &self,
        surface: &SurfacePoint,
        at: Pixel,
        states: &mut Vec<LightState>,
        scratch: &mut Scratch,
        statistics: &mut Statistics,
        blockers: &mut Vec<ObjectId>,
        each: impl FnMut(LightId, &LightAnswer, &[ObjectId]),
    ) {
        self.shade_each(surface, at, states, scratch, statistics, Some(blockers), each);
    }

    #[expect(clippy::too_many_arguments, reason = "both public forms hand on all they got")]
    fn shade_each(
        &self,
        surface: &SurfacePoint,
        at: Pixel,
        states: &mut Vec<LightState>,
        scratch: &mut Scratch,
        statistics: &mut Statistics,
        mut blockers: Option<&mut Vec<ObjectId>>,
        mut each: impl FnMut(LightId, &LightAnswer, &[ObjectId]),
    ) {
        states.iter_mut().for_each(LightState::clear);
        states.resize(self.light_count(), LightState::default());
        for (index, state) in states.iter_mut().enumerate() {
            let id = LightId::from(index);
            let random = Random::new(self.settings.seed, at.index, at.subsample, index as u32);
            if let Some(blockers) = &mut blockers {
                blockers.clear();
            }
            let mut work = Work {
                at,
                split: 1,
                shaft: None,
                random,
                blockers: blockers.as_deref_mut(),
                scratch: &mut *scratch,
                statistics: &mut *statistics,
            };
            let answer = self.shade(surface, id, state, &mut work);
            if let Some(blockers) = &mut blockers {
                blockers.sort_unstable();
                blockers.dedup();
            }
            each(id, &answer, blockers.as_deref().map_or(&[], Vec::as_slice));
        }
    }
}
