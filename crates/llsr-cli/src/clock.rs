//! Elapsed and processor time.

use std::time::Instant;

/// Wall-clock and processor seconds of one piece of work.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seconds {
    pub(crate) wall: f64,
    pub(crate) cpu: f64,
}

/// Measures from its start; processor time counts all threads of this process.
pub(crate) struct Stopwatch {
    wall: Instant,
    cpu: f64,
}

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self {
            wall: Instant::now(),
            cpu: process_seconds(),
        }
    }

    pub(crate) fn read(&self) -> Seconds {
        Seconds {
            wall: self.wall.elapsed().as_secs_f64(),
            cpu: process_seconds() - self.cpu,
        }
    }
}

/// Processor seconds of all threads of this process so far.
fn process_seconds() -> f64 {
    cpu_time::ProcessTime::try_now().map_or(0.0, |time| time.as_duration().as_secs_f64())
}
