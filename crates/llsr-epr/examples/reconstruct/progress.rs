//! What takes the time of a comparison, said as it goes on.

use std::cell::Cell;
use std::time::Instant;

/// Says on standard error how long each phase took.
pub(crate) struct Progress(Cell<Instant>);

impl Progress {
    pub(crate) fn start() -> Self {
        Self(Cell::new(Instant::now()))
    }

    /// Ends a phase.
    pub(crate) fn ended(&self, what: &str) {
        let now = Instant::now();
        let took = now.duration_since(self.0.replace(now));
        eprintln!("  [{:7.1} s] {what}", took.as_secs_f64());
    }
}
