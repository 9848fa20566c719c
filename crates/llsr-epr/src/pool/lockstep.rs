//! The same work without queues: all requests of a frame, done when the call returns.

use llsr_shading::{Encounters, ShadeRequest, ShadedPoint, Shader};
use rayon::prelude::*;

use crate::pool::worker::{Job, Outcome};

/// Requests that a thread takes at a time. Results do not depend on it.
const CHUNK: usize = 32;

/// What went wrong in [`shade_lockstep`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lockstep {
    /// Requests for which no point came back.
    pub failed: usize,
    /// Chunks of requests that ended with an error.
    pub errors: usize,
    /// Chunks of requests that panicked.
    pub panics: usize,
    /// What the last of them said.
    pub last_error: Option<String>,
}

/// Shades all requests on the threads of the current rayon pool and appends the results to `points` and `met`, in the order
/// of the requests; the same bits for any number of threads.
///
/// A shader that panics or fails costs its chunk of requests; the rest are shaded.
pub fn shade_lockstep(
    shader: &dyn Shader,
    requests: &[ShadeRequest],
    seed: u64,
    points: &mut Vec<ShadedPoint>,
    met: &mut Encounters,
) -> Lockstep {
    let shade = |job: &mut Job, chunk: &[ShadeRequest]| {
        let outcome = job.shade(shader, chunk, seed);
        (
            std::mem::take(&mut job.points),
            std::mem::take(&mut job.met),
            outcome,
        )
    };
    let parts: Vec<_> = requests.par_chunks(CHUNK).map_init(Job::default, shade).collect();
    let mut report = Lockstep::default();
    for ((part, part_met, outcome), chunk) in parts.into_iter().zip(requests.chunks(CHUNK)) {
        report.failed += chunk.len().saturating_sub(part.len());
        points.extend(part);
        met.triples.extend(part_met.triples);
        met.objects.extend(part_met.objects);
        match outcome {
            Outcome::Done => {}
            Outcome::Failed(error) => {
                report.errors += 1;
                report.last_error = Some(error);
            }
            Outcome::Panicked(error) => {
                report.panics += 1;
                report.last_error = Some(error);
            }
        }
    }
    met.settle();
    report
}
