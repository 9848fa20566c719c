//! A program as its user meets it: a command line goes in, an exit code, words and files come out.

use std::fmt::Display;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::str::FromStr;

/// A program, and the words with which its command lines begin.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    path: &'static str,
    first: &'static [&'static str],
}

/// How a program ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Exit code; `None` after a signal.
    pub code: Option<i32>,
    /// What it wrote to its standard output.
    pub out: String,
    /// What it wrote to its standard error.
    pub err: String,
}

impl Program {
    /// The program in a file: `env!("CARGO_BIN_EXE_NAME")`. Its command lines begin with `first`.
    pub const fn new(path: &'static str, first: &'static [&'static str]) -> Self {
        Self { path, first }
    }

    /// The program, to be started in `folder`.
    pub fn command(&self, folder: &Path, args: &[&str]) -> Command {
        let mut command = Command::new(self.path);
        command.current_dir(folder).args(self.first).args(args);
        command
    }

    /// Runs it in `folder`, with nothing to read.
    ///
    /// # Panics
    /// If it cannot be started or panics.
    pub fn run(&self, folder: &Path, args: &[&str]) -> Ended {
        let output = self.command(folder, args).stdin(Stdio::null()).output();
        let output = output.unwrap_or_else(|error| panic!("{}: {error}", self.path));
        let [out, err] = [&output.stdout, &output.stderr].map(|b| String::from_utf8_lossy(b).into_owned());
        assert!(!err.contains("panicked"), "{args:?}: {err}");
        let code = output.status.code();
        Ended { code, out, err }
    }

    /// Runs it in `folder` and returns what it wrote to its standard output.
    ///
    /// # Panics
    /// If it does not succeed.
    pub fn ok(&self, folder: &Path, args: &[&str]) -> String {
        let ended = self.run(folder, args);
        assert_eq!(ended.code, Some(0), "{args:?}: {}{}", ended.out, ended.err);
        ended.out
    }

    /// Runs it in `folder` and returns what it wrote to its standard error.
    ///
    /// # Panics
    /// If it does not end with that exit code.
    pub fn fails(&self, folder: &Path, args: &[&str], code: i32) -> String {
        let ended = self.run(folder, args);
        assert_eq!(ended.code, Some(code), "{args:?}: {}{}", ended.out, ended.err);
        ended.err
    }
}

/// Reads a file of text.
///
/// # Panics
/// If it is not there.
pub fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Reads a file that holds a value as text, JSON for instance.
///
/// # Panics
/// If it is not there or its text is not such a value.
pub fn parsed<T: FromStr<Err: Display>>(path: &Path) -> T {
    let value = read(path).parse();
    value.unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
