//! A progress bar on a terminal, silence elsewhere, and Ctrl-C.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Lets long work stop at its next step when the user presses Ctrl-C or the system asks the program to end; when it is asked
/// again it ends at once.
pub(crate) fn watch_interrupt() {
    // Without a handler Ctrl-C ends the program as usual, and files are renamed into place only when whole.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(1);
        }
    });
}

/// True once Ctrl-C was pressed or the system asked for the end.
pub(crate) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// A bar on standard error that shows the share done and the time left.
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// `what` is one word for the work; nothing is drawn if `quiet` or if standard error is not a terminal.
    pub(crate) fn new(what: &'static str, steps: u64, quiet: bool) -> Self {
        let visible = !quiet && std::io::stderr().is_terminal();
        let target = if visible {
            ProgressDrawTarget::stderr_with_hz(10)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(steps), target);
        if let Ok(style) = ProgressStyle::with_template("{msg:>10} {wide_bar} {percent:>3}%  {eta} left") {
            bar.set_style(style);
        }
        bar.set_message(what);
        if visible {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        Self { bar }
    }

    /// One step is done; false if the work should stop.
    pub(crate) fn step(&self) -> bool {
        self.bar.inc(1);
        !interrupted()
    }

    pub(crate) fn finish(self) {
        self.bar.finish_and_clear();
    }
}
