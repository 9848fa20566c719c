//! What a command says when it cannot go on.

use std::fmt;

/// Why the program stops, and with which exit code.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The command line asks for something that does not exist: exit code 2.
    Usage(String),
    /// The work could not be done: exit code 1.
    Work(String),
    /// The user pressed Ctrl-C, or the system asked for the end: exit code 1, and nothing half-written stays.
    Interrupted,
}

impl Failure {
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Work(_) | Self::Interrupted => 1,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(text) | Self::Work(text) => f.write_str(text),
            Self::Interrupted => f.write_str("interrupted; nothing unfinished was written"),
        }
    }
}

impl From<llsr_io::Error> for Failure {
    fn from(error: llsr_io::Error) -> Self {
        Self::Work(error.to_string())
    }
}
