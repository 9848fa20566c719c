//! The corpus of cases in `fixtures/visibility`, run through every search.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::Steps;

/// A light, its blockers and the right answer.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Unique in its file.
    pub name: String,
    /// Blockers, each from its first to its second number; anything goes.
    pub blocked: Vec<[f64; 2]>,
    /// The changes of visibility inside (0, 1), ascending.
    pub changes: Vec<f64>,
    /// The visible share of the light.
    pub visible: f64,
    /// Searches that need not solve the case, and why.
    #[serde(default)]
    pub skip: BTreeMap<String, String>,
    /// Name of the file without its extension; not in the file.
    #[serde(skip)]
    pub file: String,
}

impl Case {
    /// The light as an oracle.
    pub fn steps(&self) -> Steps {
        Steps::behind(&self.blocked)
    }

    /// `file/name`, to find the case again.
    pub fn id(&self) -> String {
        format!("{}/{}", self.file, self.name)
    }

    /// True if `engine` is to solve the case.
    pub fn is_for(&self, engine: &str) -> bool {
        !self.skip.contains_key(engine)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    case: Vec<Case>,
}

/// All cases of `fixtures/visibility`, files in alphabetical order.
///
/// # Panics
/// If a file cannot be read or understood, or names a case twice, or there are none.
pub fn corpus() -> Vec<Case> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/visibility");
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<_> = entries
        .map(|entry| entry.expect("directory entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    paths.sort();
    let mut cases: Vec<Case> = Vec::new();
    for path in paths {
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let file: File = toml::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let stem = path
            .file_stem()
            .expect("a .toml file has a stem")
            .to_string_lossy()
            .into_owned();
        for case in file.case {
            let case = Case {
                file: stem.clone(),
                ..case
            };
            assert!(
                cases.iter().all(|other| other.id() != case.id()),
                "{} occurs twice",
                case.id()
            );
            cases.push(case);
        }
    }
    assert!(!cases.is_empty(), "no case in {}", folder.display());
    cases
}
