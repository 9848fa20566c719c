//! Standard output, whose reader may leave.

use std::fmt;
use std::io::{self, Write};

/// Writes a line to standard output. Takes the place of the standard macro of that name, which panics when the reader of a
/// pipe has gone (`llsr info scene.glb | head`).
macro_rules! println {
    ($($part:tt)*) => {
        $crate::output::line(::std::format_args!($($part)*))
    };
}

/// A reader that has seen enough is no failure: the program goes on without it, since it may have files to write. Any other
/// failure of standard output is told once, on standard error.
pub(crate) fn line(text: fmt::Arguments<'_>) {
    use std::sync::atomic::{AtomicBool, Ordering};
    static GONE: AtomicBool = AtomicBool::new(false);
    if GONE.load(Ordering::Relaxed) {
        return;
    }
    if let Err(error) = writeln!(io::stdout().lock(), "{text}") {
        GONE.store(true, Ordering::Relaxed);
        if error.kind() != io::ErrorKind::BrokenPipe {
            eprintln!("warning: nothing more on standard output: {error}");
        }
    }
}
