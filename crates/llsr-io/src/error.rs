//! What can go wrong for good.

use std::path::{Path, PathBuf};

use llsr_scene::PhotometricUnit;

/// Why a file could not be read or written, or a request not be met.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused.
    #[error("cannot {verb} {path}: {source}", path = path.display())]
    Io {
        /// `read` or `write`.
        verb: &'static str,
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A directory, pipe or device, which may have no end.
    #[error("{path} is a directory or device, not a file", path = path.display())]
    NotAFile {
        /// What is no file.
        path: PathBuf,
    },
    /// Nothing here reads or writes files with this ending.
    #[error("{path}: {what} with the ending \"{ending}\" are not supported; use {use_instead}", path = path.display())]
    Ending {
        /// The file.
        path: PathBuf,
        /// `scenes`, `pictures`, ...
        what: &'static str,
        /// The ending, without the dot; may be empty.
        ending: String,
        /// The endings that work.
        use_instead: &'static str,
    },
    /// The file does not hold what its format asks for.
    #[error("{path}: {element}: {cause}", path = path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, JSON position or part of the file.
        element: String,
        /// What is wrong and what helps.
        cause: String,
    },
    /// Reading the file would take more memory than a file of its kind deserves.
    #[error("{path}: {element} would take {needed} MiB, more than the limit of {limit} MiB", path = path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Which part of it.
        element: String,
        /// Mebibytes that it asks for.
        needed: u64,
        /// Mebibytes that it may have.
        limit: u64,
    },
    /// No triangle, primitive or light is left.
    #[error("{path}: holds no usable geometry and no light{}", notes.iter().map(|n| format!("; {n}")).collect::<String>(), path = path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// The warnings that may say why.
        notes: Vec<String>,
    },
    /// A tube was asked for by a material that the file does not have.
    #[error("{path}: --tube {asked}: no geometry has that material; {}", known_sentence(known), path = path.display())]
    UnknownMaterial {
        /// The file.
        path: PathBuf,
        /// The name asked for.
        asked: String,
        /// The names in use, nearest first.
        known: Vec<String>,
    },
    /// Parts have the material that was asked for, but none of them is long and thin.
    #[error("{path}: --tube {asked}: none of the {parts} parts of that material is a tube: a tube is at least 10 times as long as thick, and equally thick both ways", path = path.display())]
    NoTube {
        /// The file.
        path: PathBuf,
        /// The material.
        asked: String,
        /// Number of connected parts that have it.
        parts: usize,
    },
    /// Lumens and watts in one scene.
    #[error("{first_what} is in {}, {second_what} in {}: one scene uses either lumens or watts", first.flux_symbol(), second.flux_symbol())]
    MixedUnits {
        /// What set the unit.
        first_what: String,
        /// Its unit.
        first: PhotometricUnit,
        /// What disagrees.
        second_what: String,
        /// Its unit.
        second: PhotometricUnit,
    },
    /// A picture to write whose parts do not fit together, or a scene that the format cannot hold.
    #[error("cannot write {path}: {cause}", path = path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        cause: String,
    },
}

impl Error {
    pub(crate) fn read(path: &Path, source: std::io::Error) -> Self {
        Self::Io {
            verb: "read",
            path: path.to_owned(),
            source,
        }
    }

    pub(crate) fn write(path: &Path, source: std::io::Error) -> Self {
        Self::Io {
            verb: "write",
            path: path.to_owned(),
            source,
        }
    }

    pub(crate) fn malformed(path: &Path, element: impl Into<String>, cause: impl Into<String>) -> Self {
        Self::Malformed {
            path: path.to_owned(),
            element: element.into(),
            cause: cause.into(),
        }
    }

    /// The cause alone, for a sentence that has named the file already.
    pub(crate) fn brief(&self) -> String {
        match self {
            Self::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
                "not found".to_owned()
            }
            Self::Io { source, .. } => source.to_string(),
            Self::NotAFile { .. } => "is no file".to_owned(),
            Self::Malformed { element, cause, .. } => format!("{element} {cause}"),
            Self::TooLarge { needed, limit, .. } => {
                format!("{needed} MiB is more than the limit of {limit} MiB")
            }
            other => other.to_string(),
        }
    }

    pub(crate) fn unwritable(path: &Path, cause: impl Into<String>) -> Self {
        Self::Unwritable {
            path: path.to_owned(),
            cause: cause.into(),
        }
    }
}

fn known_sentence(known: &[String]) -> String {
    const SHOWN: usize = 12;
    if known.is_empty() {
        return "the file names no materials".to_owned();
    }
    let names: Vec<String> = known.iter().take(SHOWN).map(|name| format!("{name:?}")).collect();
    let rest = match known.len().saturating_sub(SHOWN) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    format!("the materials are {}{rest}", names.join(", "))
}
