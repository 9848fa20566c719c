//! Standard output, whose reader may leave, and files that may not be writable.

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use crate::args::{Command, Common};
use crate::failure::Failure;

/// Finds out before any work whether the files that the command line names can be written; what is there stays as it is.
pub(crate) fn check(command: &Command, common: &Common) -> Result<(), Failure> {
    let file = match command {
        Command::Render(args) => Some(&args.output),
        Command::Edges(args) => args.output.as_ref(),
        Command::Bench(args) => args.output.as_ref(),
        Command::Diff(args) => args.output.as_ref(),
        Command::Demo(args) => args.output.as_ref(),
        Command::Info(_) | Command::Walk(_) | Command::View(_) => None,
    };
    let (option, folder) = match command {
        Command::Walk(args) => ("--keep-frames", args.keep_frames.as_deref()),
        // Nothing may ever be saved in the folder that is only the default.
        Command::View(args) => (
            "--folder",
            Some(&*args.folder).filter(|folder| *folder != Path::new(".")),
        ),
        _ => ("", None),
    };
    let named = |option: &str, error: llsr_io::Error| Failure::Work(format!("{option}: {error}"));
    if let Some(path) = &common.report {
        llsr_io::check_writable(path).map_err(|error| named("--report", error))?;
    }
    if let Some(path) = file {
        llsr_io::check_writable(path).map_err(|error| named("-o", error))?;
    }
    if let Some(path) = folder {
        llsr_io::check_folder(path).map_err(|error| named(option, error))?;
    }
    Ok(())
}

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
